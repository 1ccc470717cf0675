/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_print.c — a comparison as a table and sentences, for a person. */
#include "compare_text.h"
#include "show.h"
#include "compare/compare.h"
#include "ground/ground.h"

#include <math.h>
#include <string.h>

/* What only --all prints of a channel. */
static void print_tests(FILE *out, const struct comparison_channel *c)
{
    double input_p = 1.0;
    for (size_t j = 0; j < c->n_inputs; j++)
        input_p = fmin(input_p, c->inputs[j].correlation.p_value);
    if (isfinite(c->noise_ratio))
        (void)fprintf(out, " %9.3g  %-22s", 100.0 * c->noise.rms / c->rms, noise_method_text(c->noise.method));
    else
        (void)fprintf(out, " %9s  %-22s", "-", "not to be told");
    (void)fprintf(out, " %9.2g", c->whiteness.p_value);
    if (c->n_inputs > 0)
        (void)fprintf(out, " %9.2g", input_p);
    else
        (void)fprintf(out, " %9s", "-");
}

static void print_header(FILE *out, const struct comparison *all, bool all_columns)
{
    size_t width = 6;
    for (size_t i = 0; i < all->n_channels; i++) {
        const size_t w = text_width(text_base_name(all->records[all->channels[i].record].path));
        width = w > width ? w : width;
    }
    (void)fprintf(out, "%-*s  %-14s %9s %8s", (int)width, "record", "channel", "error %", "noise x");
    (void)fprintf(out, all_columns ? " %9s  %-22s %9s %9s\n" : "\n", "noise %", "noise judged from", "white p",
                  "input p");
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        if (c->held_out && (i == 0 || !all->channels[i - 1].held_out))
            (void)fprintf(out, "held out:\n");
        text_print_padded(out, text_base_name(all->records[c->record].path), width);
        (void)fprintf(out, "  %-14s %9.4g ", c->name, 100.0 * c->nrmse);
        if (isfinite(c->noise_ratio))
            (void)fprintf(out, "%8.4g", c->noise_ratio);
        else
            (void)fprintf(out, "%8s", "-");
        if (all_columns)
            print_tests(out, c);
        (void)fputc('\n', out);
    }
}

static void noise_words(double noise_ratio, char text[48])
{
    text[0] = '\0';
    if (isfinite(noise_ratio))
        (void)snprintf(text, 48, ", %.4g times the noise", noise_ratio);
}

static void print_totals(FILE *out, const struct comparison *all)
{
    char fitted[80], held_out[120] = "", noise[48];
    noise_words(all->noise_ratio, noise);
    (void)snprintf(fitted, sizeof fitted, "error %.4g %%%s", 100.0 * all->nrmse, noise);
    noise_words(all->check_noise_ratio, noise);
    if (isfinite(all->check_nrmse))
        (void)snprintf(held_out, sizeof held_out, "; held out: error %.4g %%%s", 100.0 * all->check_nrmse, noise);
    text_say(out, "\n", 0, "all channels (root mean square): %s%s", fitted, held_out);
    attainable_print(out, &all->attainable, all->nrmse);
    for (size_t r = 0; r < all->n_records; r++)
        if (all->level[r] < 1.0 || all->level[r] > 1.0)
            (void)fprintf(out, "level of the excitation of %s: %.6g (solved for)\n",
                          text_base_name(all->records[r].path), all->level[r]);
}

static void print_share(FILE *out, const struct comparison_channel *c)
{
    char text[1500];
    size_t n = 0;
    text[0] = '\0';
    for (size_t b = 0; b < c->n_bands && n < sizeof text; b++) {
        const struct comparison_band *band = &c->bands[b];
        char mode[32] = "";
        if (band->share < 0.005)
            continue;
        if (band->mode > 0)
            (void)snprintf(mode, sizeof mode, " m%zu", band->mode);
        n += (size_t)snprintf(text + n, sizeof text - n, "%s%.3g-%.3g Hz%s %.0f", n > 0 ? ", " : "", band->from_Hz,
                              band->to_Hz, mode, 100.0 * band->share);
    }
    text_say(out, "", 4, "%s", text);
}

/* Bands of one sampling rate belong to one table; every channel has its own rates in general, so one paragraph each. */
static void print_bands(FILE *out, const struct comparison *all)
{
    (void)fprintf(out, "\nWhere the misfit is (share of it in %%; m: the mode in the band):\n");
    for (size_t i = 0; i < all->n_channels; i++) {
        const struct comparison_channel *c = &all->channels[i];
        text_say(out, "", 2, "%s %s:", text_base_name(all->records[c->record].path), c->name);
        print_share(out, c);
        text_say(out, "", 4, "in time (thirds): %.0f %.0f %.0f;  error by motion, small to large: %.3g %.3g %.3g %%",
                 100.0 * c->time_share[0], 100.0 * c->time_share[1], 100.0 * c->time_share[2],
                 100.0 * c->amplitude.relative[0], 100.0 * c->amplitude.relative[1], 100.0 * c->amplitude.relative[2]);
        for (size_t j = 0; j < c->n_inputs; j++)
            if (isfinite(c->inputs[j].coherence))
                text_say(out, "", 4, "coherence with %s %.4f (chance: %.2f)", c->inputs[j].name, c->inputs[j].coherence,
                         c->inputs[j].coherence_bound);
    }
}

void compare_print(FILE *out, const struct comparison *all, bool all_columns)
{
    char text[1200];
    print_header(out, all, all_columns);
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
