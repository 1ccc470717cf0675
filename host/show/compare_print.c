/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_print.c — a comparison in words. */
#include "show.h"
#include "compare/compare.h"
#include "ground/ground.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

bool compare_is_noise(double noise_ratio)
{
    return noise_ratio <= 1.05;
}

/* Appends to text, never beyond size. */
static void say(char *text, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void say(char *text, size_t size, const char *format, ...)
{
    const size_t n = strlen(text);
    va_list args;
    va_start(args, format);
    if (n + 1 < size)
        (void)vsnprintf(text + n, size - n, format, args);
    va_end(args);
}

/* ---- Sentences about one channel ---- */

const struct comparison_band *compare_worst_band(const struct comparison_channel *c)
{
    const struct comparison_band *worst = NULL;
    for (size_t b = 0; b < c->n_bands; b++)
        if (worst == NULL || c->bands[b].share > worst->share)
            worst = &c->bands[b];
    return worst;
}

static void say_where(const struct comparison_channel *c, char *text, size_t size)
{
    const struct comparison_band *band = compare_worst_band(c);
    if (band != NULL && band->share > 0.3) {
        say(text, size, " %.0f %% of the misfit lies between %.3g and %.3g Hz", 100.0 * band->share, band->from_Hz,
            band->to_Hz);
        if (band->mode > 0)
            say(text, size, " (mode %zu)", band->mode);
        say(text, size, ".");
    }
    const double *t = c->time_share;
    if (t[0] > 0.6)
        say(text, size, " Most of it is in the first third of the record.");
    else if (t[2] > 0.6)
        say(text, size, " Most of it is in the last third of the record.");
    const double small = c->amplitude.relative[0], large = c->amplitude.relative[2];
    const double floor = c->noise.rms > 0.0 && c->rms > 0.0 ? 3.0 * c->noise.rms / c->rms : 0.0;
    if (large > 2.0 * small && large > floor)
        say(text, size, " The relative error grows with the motion (%.2g %% small, %.2g %% large).", 100.0 * small,
            100.0 * large);
}

static void say_input(const struct comparison_channel *c, char *text, size_t size)
{
    for (size_t i = 0; i < c->n_inputs; i++) {
        const struct input_correlation *r = &c->inputs[i].correlation;
        if (!(r->p_value < 0.01))
            continue;
        if (r->largest_lag < 0 && r->largest_lag >= -r->alike)
            say(text, size, " It goes with %s: part of the response to it is missing.", c->inputs[i].name);
        else if (r->largest_lag < 0)
            say(text, size, " The residual runs ahead of %s by %.3g ms: a clock or a channel is out of step.",
                c->inputs[i].name, -1e3 * (double)r->largest_lag * c->dt_s);
        else if (r->largest_lag <= 1)
            say(text, size,
                " It follows %s at once: a direct path is missing (feedthrough, local compliance, a timing error).",
                c->inputs[i].name);
        else
            say(text, size, " It follows %s after %.3g ms: part of the response to it is missing.", c->inputs[i].name,
                1e3 * (double)r->largest_lag * c->dt_s);
    }
}

static bool can_judge(const struct comparison_channel *c)
{
    return c->n >= 20 && c->rms > 0.0;
}

void compare_finding(const struct comparison *all, const struct comparison_channel *c, char *text, size_t size)
{
    text[0] = '\0';
    say(text, size, "%s %s: ", text_base_name(all->records[c->record].path), c->name);
    if (!can_judge(c)) {
        say(text, size, "too little motion to judge.");
        return;
    }
    say(text, size, "the model misses %.3g %% of the signal", 100.0 * c->nrmse);
    if (!isfinite(c->noise_ratio))
        say(text, size, "; the noise could not be told from the record.");
    else if (compare_is_noise(c->noise_ratio))
        say(text, size, ", which is the noise of the channel (%.3g %%): nothing is left to explain.",
            100.0 * c->noise.rms / c->rms);
    else
        say(text, size, ", %.3g times the noise of the channel (%.3g %%).", c->noise_ratio,
            100.0 * c->noise.rms / c->rms);
    if (!compare_is_noise(c->noise_ratio))
        say_where(c, text, size);
}

void compare_summary(const struct comparison *all, const struct comparison_channel *c, char *text, size_t size)
{
    compare_finding(all, c, text, size);
    if (!can_judge(c))
        return;
    if (compare_is_noise(c->noise_ratio)) {
        if (c->whiteness.p_value < 0.01)
            say(text, size,
                " The residual is not white (p = %.2g), so the noise is coloured or a trace of misfit remains.",
                c->whiteness.p_value);
        return;
    }
    say_input(c, text, size);
    if (c->noise.rms > 0.0 && c->noise.used_share < 0.5)
        say(text, size,
            " Only %.0f %% of the record behaves as a linear system with noise: expect something nonlinear.",
            100.0 * c->noise.used_share);
}

/* ---- The table ---- */

static void print_header(FILE *out, const struct comparison *all)
{
    size_t width = 6;
    for (size_t i = 0; i < all->n_channels; i++) {
        const size_t w = text_width(text_base_name(all->records[all->channels[i].record].path));
        width = w > width ? w : width;
    }
    (void)fprintf(out, "%-*s  %-14s %9s %8s %9s  %-22s %9s %9s\n", (int)width, "record", "channel", "error %",
                  "noise x", "noise %", "noise judged from", "white p", "input p");
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        double input_p = 1.0;
        for (size_t j = 0; j < c->n_inputs; j++)
            input_p = fmin(input_p, c->inputs[j].correlation.p_value);
        if (c->held_out && (i == 0 || !all->channels[i - 1].held_out))
            (void)fprintf(out, "held out:\n");
        text_print_padded(out, text_base_name(all->records[c->record].path), width);
        (void)fprintf(out, "  %-14s %9.4g ", c->name, 100.0 * c->nrmse);
        if (isfinite(c->noise_ratio))
            (void)fprintf(out, "%8.4g %9.3g  %-22s", c->noise_ratio, 100.0 * c->noise.rms / c->rms,
                          noise_method_text(c->noise.method));
        else
            (void)fprintf(out, "%8s %9s  %-22s", "-", "-", "not to be told");
        (void)fprintf(out, " %9.2g", c->whiteness.p_value);
        if (c->n_inputs > 0)
            (void)fprintf(out, " %9.2g\n", input_p);
        else
            (void)fprintf(out, " %9s\n", "-");
    }
}

static void print_totals(FILE *out, const struct comparison *all)
{
    (void)fprintf(out, "\nall channels (root mean square): error %.4g %%", 100.0 * all->nrmse);
    if (isfinite(all->noise_ratio))
        (void)fprintf(out, ", %.4g times the noise", all->noise_ratio);
    if (isfinite(all->check_nrmse)) {
        (void)fprintf(out, "; held out: error %.4g %%", 100.0 * all->check_nrmse);
        if (isfinite(all->check_noise_ratio))
            (void)fprintf(out, ", %.4g times the noise", all->check_noise_ratio);
    }
    (void)fputc('\n', out);
    attainable_print(out, &all->attainable, all->nrmse);
    for (size_t r = 0; r < all->n_records; r++)
        if (all->level[r] < 1.0 || all->level[r] > 1.0)
            (void)fprintf(out, "level of the excitation of %s: %.6g (solved for)\n",
                          text_base_name(all->records[r].path), all->level[r]);
}

/* Bands of one sampling rate belong to one table; every channel has its own rates in general, so one line each. */
static void print_bands(FILE *out, const struct comparison *all)
{
    (void)fprintf(out, "\nWhere the misfit is (share of it in %%; m: the mode in the band):\n");
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        (void)fprintf(out, "  %s %s:", text_base_name(all->records[c->record].path), c->name);
        for (size_t b = 0; b < c->n_bands; b++) {
            if (c->bands[b].share < 0.005)
                continue;
            (void)fprintf(out, "  %.3g-%.3g Hz", c->bands[b].from_Hz, c->bands[b].to_Hz);
            if (c->bands[b].mode > 0)
                (void)fprintf(out, " m%zu", c->bands[b].mode);
            (void)fprintf(out, " %.0f%s", 100.0 * c->bands[b].share, b + 1 < c->n_bands ? "," : "");
        }
        (void)fprintf(
            out, "\n    in time (thirds): %.0f %.0f %.0f;  error by motion, small to large: %.3g %.3g %.3g %%",
            100.0 * c->time_share[0], 100.0 * c->time_share[1], 100.0 * c->time_share[2],
            100.0 * c->amplitude.relative[0], 100.0 * c->amplitude.relative[1], 100.0 * c->amplitude.relative[2]);
        for (size_t j = 0; j < c->n_inputs; j++)
            if (isfinite(c->inputs[j].coherence))
                (void)fprintf(out, ";  coherence with %s %.4f (chance: %.2f)", c->inputs[j].name,
                              c->inputs[j].coherence, c->inputs[j].coherence_bound);
        (void)fputc('\n', out);
    }
}

void compare_print(FILE *out, const struct comparison *all)
{
    char text[1200];
    print_header(out, all);
    print_totals(out, all);
    print_bands(out, all);
    (void)fputc('\n', out);
    for (size_t i = 0; i < all->n_channels; i++) {
        compare_summary(all, &all->channels[i], text, sizeof text);
        (void)fputs("- ", out);
        text_print_wrapped(out, text, 2, text_columns());
    }
    for (size_t i = 0; i < all->n_notes; i++) {
        (void)snprintf(text, sizeof text, "%s.", all->notes[i]);
        (void)fputs("- ", out);
        text_print_wrapped(out, text, 2, text_columns());
    }
}
