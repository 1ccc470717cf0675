/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_print.c — a comparison as a table and sentences, for a person. */
#include "compare_text.h"
#include "show.h"
#include "compare/compare.h"
#include "ground/ground.h"

#include <math.h>
#include <string.h>

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
