/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fleet_words.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "report_page.h"

enum { MOST_NAMES = 12 };

static void add(char text[FLEET_SENTENCE], const char *format, ...) __attribute__((format(printf, 2, 3)));
static void add(char text[FLEET_SENTENCE], const char *format, ...)
{
    const size_t n = strlen(text);
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text + n, FLEET_SENTENCE - n, format, args);
    va_end(args);
}

/* "7, 12 and 31", the first few of more. */
static void add_units(char text[FLEET_SENTENCE], const struct fleet_population *p, const struct fleet_effect *e)
{
    const size_t shown = e->n > MOST_NAMES ? MOST_NAMES : e->n;
    for (size_t i = 0; i < shown; i++)
        add(text, "%s%.40s", i == 0 ? "" : i + 1 == e->n ? " and " : ", ", p->diagnosed[e->units[i]]);
    if (e->n > shown)
        add(text, " and %zu more", e->n - shown);
}

/* "1.02 ± 0.15 g": the mean and the spread over the units, or one unit's value and its error. */
static void add_value(char text[FLEET_SENTENCE], const struct fleet_effect *e)
{
    char format[40], both[120];
    const double width = e->n_values > 1 ? e->spread : e->sd;
    if (!isfinite(e->mean))
        return;
    const bool mass = strcmp(e->si_unit, "kg") == 0 && fabs(e->mean) < 0.1; /* a person says grams */
    const double factor = mass ? 1e3 : report_prefix(e->mean, e->si_unit, format);
    if (mass)
        (void)snprintf(format, sizeof format, "%%.3g g");
    const char *tail = strstr(format, "%.3g");
    (void)snprintf(both, sizeof both, ", %.3g ± %.2g%s", factor * e->mean, factor * width,
                   tail != NULL ? tail + strlen("%.3g") : "");
    add(text, "%s", both);
}

void fleet_diagnosis_words(const struct fleet_population *p, char text[FLEET_SENTENCE])
{
    size_t k = 0;
    text[0] = '\0';
    if (p->n_diagnosed == 0)
        return;
    if (p->n_effects > 0 && 2 * p->effects[0].n > p->n_diagnosed) {
        add(text, "%s is missing in %zu of %zu units", p->effects[0].id, p->effects[0].n, p->n_diagnosed);
        add_value(text, &p->effects[k++]);
        if (p->n_verdicts[0] > 0)
            add(text, "; %zu are complete without", p->n_verdicts[0]);
    } else {
        add(text, "%zu of %zu units are complete", p->n_verdicts[0], p->n_diagnosed);
    }
    for (const char *before = "; "; k < p->n_effects; k++) {
        add(text, "%sunit%s ", before, p->effects[k].n > 1 ? "s" : "");
        add_units(text, p, &p->effects[k]);
        add(text, " differ%s: %s", p->effects[k].n > 1 ? "" : "s", p->effects[k].id);
        add_value(text, &p->effects[k]);
    }
    if (p->n_verdicts[2] + p->n_verdicts[3] > 0)
        add(text, "; %zu ambiguous, %zu unknown", p->n_verdicts[2], p->n_verdicts[3]);
    add(text, ".");
}

void fleet_drift_words(const struct fleet_population *p, const struct fleet_drift *d, char text[FLEET_SENTENCE])
{
    const struct fleet_estimates *e = &p->estimates;
    const bool relative = e->logarithmic[d->parameter];
    text[0] = '\0';
    add(text, "%s %s by %.3g ± %.2g %s for each unit of %.60s (%zu units, p %.2g)", e->parameters[d->parameter],
        d->slope > 0.0 ? "rises" : "falls", (relative ? 100.0 : 1.0) * fabs(d->slope), (relative ? 100.0 : 1.0) * d->sd,
        relative ? "%" : e->si_units[d->parameter], d->column, d->n, d->p_value);
}

void fleet_outlier_words(const struct fleet_population *p, const struct fleet_outlier *o, char text[FLEET_SENTENCE])
{
    text[0] = '\0';
    add(text, "%s: p %.2g as a whole; furthest off is %s, %.3g spreads %s the mean", p->estimates.units[o->unit],
        o->p_value, p->estimates.parameters[o->parameter], fabs(o->deviation), o->deviation > 0.0 ? "above" : "below");
}

void fleet_alarm_words(const struct fleet_population *p, char text[FLEET_SENTENCE])
{
    text[0] = '\0';
    add(text,
        "A unit stands out when one as far from the mean would come in at most %.3g %% of fleets of this size that "
        "have "
        "none (Hotelling's T² against the others, counted once for each of %zu units); a drift likewise, of %zu pairs "
        "of "
        "parameter and column.",
        100.0 * p->false_alarm_rate, p->estimates.n, p->n_tested);
}

struct fleet_value_words fleet_parameter(const struct fleet_population *p, size_t k)
{
    const struct fleet_mixed *m = &p->mixed;
    const size_t n = p->estimates.p;
    const double mean = m->mean[k], sd = sqrt(m->mean_covariance[k + k * n]), spread = sqrt(m->spread[k + k * n]);
    if (!p->estimates.logarithmic[k])
        return (struct fleet_value_words){mean, sd, spread, false};
    return (struct fleet_value_words){exp(mean), exp(mean) * sd, spread, true};
}
