/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Records that are no samples beside a model: what a model as it is leaves of lists of frequencies and spectra without phase. */
#include <math.h>
#include <stdlib.h>

#include "compare.h"

enum { LEAST_MODES = 10, MORE_MODES = 4, SHAPE_POINTS = 201, MOST_MODES = 24 };

static size_t modes_wanted(const struct record records[], size_t n)
{
    size_t most = LEAST_MODES - MORE_MODES;
    for (size_t r = 0; r < n; r++)
        if (records[r].kind == RECORD_FREQUENCIES)
            most = records[r].n > most ? records[r].n : most;
    return most + MORE_MODES < MOST_MODES ? most + MORE_MODES : MOST_MODES;
}

static void make_table(const struct record *record, const struct modes *modes, struct pole_table *out)
{
    double model_Hz[MOST_MODES];
    struct frequency_list list;
    for (size_t k = 0; k < modes->n; k++)
        model_Hz[k] = modes->mode[k].undamped_Hz;
    frequency_list_of_record(record, &list);
    pole_table_make(&list, model_Hz, modes->n, out);
    pole_table_damping(out, modes);
    frequency_list_free(&list);
}

enum bf_status compare_lines(const struct model *model, const struct record records[], size_t n, size_t n_held_out,
                             const struct predict_options *options, struct line_comparison *out, struct bf_error *err)
{
    struct fit_options fit = {.quiet = true};
    struct own_values own;
    *out = (struct line_comparison){.records = records, .n = n, .n_held_out = n_held_out};
    if (n == 0)
        return BF_OK;
    if (options != NULL)
        fit.predict = *options;
    enum bf_status status = own_values_find(model, records, n, &fit, &own, err);
    if (status == BF_OK)
        status = fit_errors(own.model, records, n, &fit, &out->channels, &out->n_channels, err);
    if (status == BF_OK)
        status = modes_compute(own.model, modes_wanted(records, n), 0.0, SHAPE_POINTS, &out->modes, err);
    out->tables = bf_alloc(n, sizeof *out->tables);
    out->spectra = bf_alloc(n, sizeof *out->spectra);
    for (size_t r = 0; r < n && status == BF_OK; r++)
        if (records[r].kind == RECORD_FREQUENCIES)
            make_table(&records[r], &out->modes, &out->tables[r]);
        else
            status = fit_line_spectra(own.model, &records[r], options, &out->spectra[r].all, &out->spectra[r].n, err);
    own_values_free(&own);
    return status;
}

void compare_lines_free(struct line_comparison *lines)
{
    for (size_t r = 0; lines->tables != NULL && r < lines->n; r++)
        pole_table_free(&lines->tables[r]);
    for (size_t r = 0; lines->spectra != NULL && r < lines->n; r++)
        line_spectra_free(lines->spectra[r].all, lines->spectra[r].n);
    free(lines->tables), free(lines->spectra), free(lines->channels);
    modes_free(&lines->modes);
    *lines = (struct line_comparison){0};
}

/* mean: of n squares and the one of these; NAN: none. */
static double with(double mean, double n, double more, double n_more)
{
    const double sum = (n > 0.0 ? n * mean * mean : 0.0) + (n_more > 0.0 ? more : 0.0);
    return n + n_more > 0.0 ? sqrt(sum / (n + n_more)) : nan("");
}

static void add(bool held_out, const struct line_comparison *lines, const struct comparison *all, double *nrmse,
                double *noise_ratio)
{
    double n = 0.0, n_ratios = 0.0, errors = 0.0, ratios = 0.0, n_lines = 0.0, n_line_ratios = 0.0;
    for (size_t i = 0; i < all->n_channels; i++)
        if (all->channels[i].held_out == held_out) {
            n += 1.0;
            n_ratios += isfinite(all->channels[i].noise_ratio);
        }
    for (size_t i = 0; i < lines->n_channels; i++) {
        const struct fit_channel_error *c = &lines->channels[i];
        if ((c->record >= lines->n - lines->n_held_out) != held_out)
            continue;
        n_lines += 1.0;
        errors += c->nrmse * c->nrmse;
        n_line_ratios += isfinite(c->noise_ratio);
        ratios += isfinite(c->noise_ratio) ? c->noise_ratio * c->noise_ratio : 0.0;
    }
    *nrmse = with(*nrmse, n, errors, n_lines);
    *noise_ratio = with(*noise_ratio, n_ratios, ratios, n_line_ratios);
}

void compare_add_lines(const struct line_comparison *lines, struct comparison *all)
{
    add(false, lines, all, &all->nrmse, &all->noise_ratio);
    add(true, lines, all, &all->check_nrmse, &all->check_noise_ratio);
}
