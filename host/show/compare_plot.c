/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_plot.c — the pictures of a comparison. */
#include "compare_plot.h"
#include "show.h"
#include "plot.h"
#include "maths/maths.h"

#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

void compare_name_picture(const struct record records[], size_t r, const char *what, char stem[PLOT_STEM])
{
    const char *name = text_base_name(records[r].path), *dot = strrchr(name, '.');
    const int length = dot != NULL && dot != name ? (int)(dot - name) : (int)strlen(name);
    int copies = 0; /* records of one name from different directories get a number */
    for (size_t i = 0; i < r; i++)
        copies += strcmp(text_base_name(records[i].path), name) == 0;
    if (copies > 0)
        (void)snprintf(stem, PLOT_STEM, "%.60s_%d-%.60s", name, copies + 1, what);
    else
        (void)snprintf(stem, PLOT_STEM, "%.*s-%.60s", length < 60 ? length : 60, name, what);
}

void compare_amplitude_stem(const struct record records[], size_t r, const char *channel, char stem[PLOT_STEM + 16])
{
    char name[PLOT_STEM];
    compare_name_picture(records, r, channel, name);
    (void)snprintf(stem, PLOT_STEM + 16, "%s-amplitude", name);
}

/* What was measured and how well it is predicted; whose record it is stands in the corner. */
static void name_title(const struct comparison_channel *c, char *title, size_t size)
{
    (void)snprintf(title, size, "%s: error %.3g %%", c->name, 100.0 * c->nrmse);
    const size_t n = strlen(title);
    if (c->noise.rms > 0.0 && n < size)
        (void)snprintf(title + n, size - n, ", %.3g times the noise", c->noise_ratio);
}

double compare_worth_showing_Hz(const struct comparison_channel *c)
{
    double *amplitude = bf_alloc(c->n / 2 + 1, sizeof *amplitude), total = 0.0, sum = 0.0, top_Hz = 0.0;
    const double nyquist_Hz = 0.5 / c->dt_s;
    struct bf_error ignored;
    if (spectrum_amplitude(c->measured, c->n, WINDOW_NONE, amplitude, &ignored) == BF_OK) {
        for (size_t k = 1; k <= c->n / 2; k++)
            total += amplitude[k] * amplitude[k];
        for (size_t k = 1; k <= c->n / 2 && sum < 0.9999 * total; k++) {
            sum += amplitude[k] * amplitude[k];
            top_Hz = 2.0 * (double)k / (c->dt_s * (double)c->n);
        }
    }
    free(amplitude);
    return top_Hz < 0.6 * nyquist_Hz ? top_Hz : 0.0;
}

static enum bf_status draw_residual(const struct comparison_channel *c, const char *note, const char *directory,
                                    const char *stem, const char *title, struct bf_error *err)
{
    double edge_Hz[64], share[64];
    struct plot_residual page = {.directory = directory,
                                 .stem = stem,
                                 .title = title,
                                 .note = note,
                                 .quantity = c->name,
                                 .n = c->n,
                                 .t0_s = c->t0_s,
                                 .dt_s = c->dt_s,
                                 .residual = c->residual,
                                 .noise_rms = c->noise.rms,
                                 .noise_psd = c->noise.psd,
                                 .n_noise = c->noise.n_bins,
                                 .autocorrelation = c->autocorrelation,
                                 .n_autocorrelation = c->n_autocorrelation,
                                 .autocorrelation_bound = c->whiteness.correlation_bound};
    for (size_t b = 0; b < c->n_bands && b < 63; b++) {
        edge_Hz[b] = c->bands[b].from_Hz;
        edge_Hz[b + 1] = c->bands[b].to_Hz;
        share[b] = c->bands[b].share;
        page.n_bands = b + 1;
    }
    page.edge_Hz = edge_Hz;
    page.share = share;
    if (c->n_inputs > 0) {
        page.input_name = c->inputs[0].name;
        page.input_correlation = c->inputs[0].correlation.rho;
        page.n_lags = c->inputs[0].correlation.n_lags;
        page.input_bound = c->inputs[0].correlation.bound_all;
    }
    return plot_residual(&page, err);
}

enum bf_status compare_plot_channel(const struct comparison *all, size_t channel, const char *directory,
                                    const char *stem, struct bf_error *err)
{
    const struct comparison_channel *c = &all->channels[channel];
    char residual[180], title[240];
    if (c->n < COMPARE_PLOT)
        return bf_fail(err, BF_NUMERIC, "a picture of '%s' needs at least %d samples; it has %zu", c->name,
                       COMPARE_PLOT, c->n);
    const char *note = text_base_name(all->records[c->record].path);
    name_title(c, title, sizeof title);
    const struct plot_panels panels = {.directory = directory,
                                       .stem = stem,
                                       .title = title,
                                       .note = note,
                                       .quantity = c->name,
                                       .n = c->n,
                                       .t0_s = c->t0_s,
                                       .dt_s = c->dt_s,
                                       .to_Hz = compare_worth_showing_Hz(c),
                                       .measured = c->measured,
                                       .model = c->predicted,
                                       .noise_psd = c->noise.psd,
                                       .n_noise = c->noise.n_bins};
    const enum bf_status status = compare_is_response(all, c) ? compare_plot_bode(all, c, directory, stem, title, err)
                                                              : plot_panels(&panels, err);
    if (status != BF_OK)
        return status;
    (void)snprintf(residual, sizeof residual, "%s-residual", stem);
    return draw_residual(c, note, directory, residual, title, err);
}

enum bf_status compare_plot(const struct comparison *all, const char *directory, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        char stem[PLOT_STEM];
        if (all->channels[i].n < COMPARE_PLOT)
            continue;
        compare_name_picture(all->records, all->channels[i].record, all->channels[i].name, stem);
        status = compare_plot_channel(all, i, directory, stem, err);
    }
    return status;
}

enum bf_status compare_plot_prepare(const struct model *model, const struct record records[], size_t n,
                                    const char *directory, struct bf_error *err)
{
    char(*stems)[PLOT_STEM + 16] = bf_alloc(3 * n * (model->n_outputs + 1) + 2, sizeof *stems);
    const char **names = bf_alloc(3 * n * (model->n_outputs + 1) + 2, sizeof *names);
    size_t count = 0;
    for (size_t r = 0; r < n; r++) {
        if (records[r].kind == RECORD_FREQUENCIES)
            pole_table_stem(text_base_name(records[r].path), stems[count++]);
        for (size_t o = 0; o < model->n_outputs && records[r].kind != RECORD_FREQUENCIES; o++) {
            compare_name_picture(records, r, model->outputs[o].name, stems[count]);
            (void)snprintf(stems[count + 1], sizeof *stems, "%.160s-residual", stems[count]);
            compare_amplitude_stem(records, r, model->outputs[o].name, stems[count + 2]);
            count += 3;
        }
    }
    (void)snprintf(stems[count++], sizeof *stems, COMPARE_STABILISATION);
    pole_table_stem(COMPARE_POLES, stems[count++]);
    for (size_t i = 0; i < count; i++)
        names[i] = stems[i];
    const enum bf_status status = plot_prepare(directory, names, count, err);
    free(stems), free(names);
    return status;
}
