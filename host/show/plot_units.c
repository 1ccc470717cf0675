/* SPDX-License-Identifier: GPL-3.0-or-later */
/* plot_units.c — what a quantity is called on an axis, and the prefix that makes its numbers short. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "plot.h"
#include "plot_gnuplot.h"

void plot_quantity(const char *name, const char *suffix, char *out, size_t size)
{
    static const struct {
        const char *ending, *unit;
    } units[] = {{"_V", "V"},       {"_N", "N"},         {"_m", "m"},   {"_mps", "m/s"}, {"_mps2", "m/s²"},
                 {"_rad", "rad"},   {"_radps", "rad/s"}, {"_Pa", "Pa"}, {"_A", "A"},     {"_mm", "mm"},
                 {"_mmps", "mm/s"}, {"_g", "g"},         {"_Nm", "N·m"}};
    const char *ending = strrchr(name, '_');
    for (size_t i = 0; ending != NULL && ending != name && i < sizeof units / sizeof *units; i++)
        if (strcmp(ending, units[i].ending) == 0) {
            const bool power = strncmp(suffix, "²", strlen("²")) == 0 && strpbrk(units[i].unit, "/") != NULL;
            (void)snprintf(out, size, power ? "%.*s ((%s)%s)" : "%.*s (%s%s)", (int)(ending - name), name,
                           units[i].unit, suffix);
            return;
        }
    (void)snprintf(out, size, "%s", name);
}

const char *plot_prefix(double x, const char *unit, double *factor)
{
    static const char *const taking[] = {"V", "N", "m", "m/s", "m/s²", "rad", "rad/s", "Pa", "A", "N·m"};
    static const struct {
        const char *prefix;
        double size;
    } prefixes[] = {{"n", 1e-9}, {"µ", 1e-6}, {"m", 1e-3}, {"", 1.0}, {"k", 1e3}};
    enum { PREFIXES = sizeof prefixes / sizeof *prefixes, PLAIN = 3 };
    size_t k = 0;
    bool takes = false;
    for (size_t i = 0; i < sizeof taking / sizeof *taking; i++)
        takes = takes || strcmp(unit, taking[i]) == 0;
    while (k + 1 < PREFIXES && fabs(x) >= 0.9995 * prefixes[k + 1].size)
        k++;
    if (!takes || !(fabs(x) >= 1e-9 && fabs(x) < 1e6))
        k = PLAIN;
    *factor = 1.0 / prefixes[k].size;
    return prefixes[k].prefix;
}

double plot_scaled(const char *name, double largest, char *out, size_t size)
{
    char text[200], unit[40] = "";
    double factor = 1.0;
    plot_quantity(name, "", text, sizeof text);
    char *open = strrchr(text, '(');
    if (strcmp(text, name) != 0 && open != NULL) {
        (void)snprintf(unit, sizeof unit, "%.*s", (int)strcspn(open + 1, ")"), open + 1);
        *open = '\0';
        const char *prefix = plot_prefix(largest, unit, &factor);
        (void)snprintf(out, size, "%s(%s%s)", text, prefix, unit);
    } else {
        (void)snprintf(out, size, "%s", text);
    }
    return factor;
}

/* "20 m" at 0.02; 1e-20 where there is no prefix. */
static void write_tick(FILE *script, int factor, int decade)
{
    static const char *const prefixes[] = {"p", "n", "µ", "m", "", "k", "M", "G"};
    enum { PLAIN = 4, PREFIXES = sizeof prefixes / sizeof *prefixes };
    const int step = (int)floor(decade / 3.0), part = PLAIN + step;
    if (part >= 0 && part < PREFIXES)
        (void)fprintf(script, "'%g%s%s' %de%d", factor * pow(10.0, decade - 3 * step), step != 0 ? " " : "",
                      prefixes[part], factor, decade);
    else
        (void)fprintf(script, "'%de%d' %de%d", factor, decade, factor, decade);
}

void plot_si_logarithmic(FILE *script, char axis, double low, double high)
{
    enum { MOST = 7, FEWEST = 3 };
    static const int factors[] = {1, 2, 5};
    const int first = (int)floor(log10(low) + 1e-9), last = (int)floor(log10(high) + 1e-9);
    const int decades = last - (int)ceil(log10(low) - 1e-9) + 1, every = (decades - 1) / MOST + 1;
    bool some = false;
    (void)fprintf(script, "set logscale %c\nset %crange [%.6g:%.6g]\nset m%ctics 10\nset %ctics (", axis, axis, low,
                  high, axis, axis);
    for (int k = first; k <= last; k++)
        for (int i = 0; i < (decades < FEWEST ? 3 : 1); i++) { /* two and five between few powers of ten */
            const double x = factors[i] * pow(10.0, k);
            if (x < low * (1.0 - 1e-9) || x > high * (1.0 + 1e-9) || (decades >= FEWEST && (last - k) % every != 0))
                continue;
            (void)fputs(some ? ", " : "", script);
            write_tick(script, factors[i], k);
            some = true;
        }
    (void)fprintf(script, "%s)\n", some ? "" : "1");
}

void plot_linear(FILE *script, char axis)
{
    (void)fprintf(script, "unset logscale %c\nset m%ctics default\nset %ctics autofreq\nset %crange [*:*]\n", axis,
                  axis, axis, axis);
}
