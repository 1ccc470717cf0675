/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "line_set.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t lines_behind(const struct record records[], size_t n_records)
{
    size_t first = 0;
    while (first < n_records && records[first].kind == RECORD_SAMPLES)
        first++;
    for (size_t r = first; r < n_records; r++)
        if (records[r].kind == RECORD_SAMPLES)
            return SIZE_MAX;
    return first;
}

/* ---- Life ---- */

/* An effect that no mode of a linear beam has: a law, a drive, a signal of its own. */
static enum bf_status check_linear(const struct model *model, const struct record *record, struct bf_error *err)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (!effect_is_linear(model->effects[e].effect))
            return bf_fail(
                err, BF_USAGE,
                "%s: %s has no natural frequencies: they are of a linear beam, and what it does changes with "
                "the amplitude or adds to the signal; drop %s, or give records in time",
                record->path, model->effects[e].effect->id, model->effects[e].effect->id);
    return BF_OK;
}

static enum bf_status find_parameters(struct line_set *set, const struct parameter_ref refs[], size_t n_refs,
                                      struct bf_error *err)
{
    const struct parameter_ref *own;
    set->n_refs = transfer_parameters(set->predictor, &own);
    set->from = bf_alloc(set->n_refs, sizeof *set->from);
    for (size_t i = 0; i < set->n_refs; i++) {
        while (set->from[i] < n_refs && strcmp(refs[set->from[i]].label, own[i].label) != 0)
            set->from[i]++;
        if (set->from[i] == n_refs)
            return bf_fail(err, BF_USAGE, "%s: %s is not known to the fit; give the record another name",
                           set->record->path, own[i].label);
    }
    return BF_OK;
}

static bool is_list(const struct line_set *set)
{
    return set->record->kind == RECORD_FREQUENCIES;
}

static enum bf_status open_set(struct line_rows *lines, struct line_set *set, const struct model *model,
                               const struct parameter_ref refs[], const struct predict_options *options,
                               struct bf_error *err)
{
    struct predict_options quiet = *options;
    quiet.quiet = true;
    enum bf_status status = check_linear(model, set->record, err);
    if (status == BF_OK)
        status = is_list(set) ? frequencies_make(set, model, err) : magnitudes_make(set, model, err);
    if (status == BF_OK)
        status = predictor_new(model, &set->made, 1, &quiet, &set->predictor, err);
    if (status == BF_OK)
        status = find_parameters(set, refs, lines->n_refs, err);
    if (status == BF_OK && is_list(set))
        frequencies_add(lines, set);
    else if (status == BF_OK)
        magnitudes_add(lines, set, model);
    return status;
}

enum bf_status lines_new(const struct model *model, const struct record records[], size_t first, size_t n_records,
                         const struct parameter_ref refs[], size_t n_refs, const struct predict_options *options,
                         struct line_rows **out, struct bf_error *err)
{
    *out = NULL;
    if (first >= n_records)
        return BF_OK;
    struct line_rows *lines = bf_alloc(1, sizeof *lines);
    *lines = (struct line_rows){.n_refs = n_refs, .sets = bf_alloc(n_records - first, sizeof *lines->sets)};
    enum bf_status status = BF_OK;
    for (size_t r = first; r < n_records && !status; r++) {
        struct line_set *set = &lines->sets[lines->n_sets++];
        *set = (struct line_set){.record = &records[r], .index = r};
        status = open_set(lines, set, model, refs, options, err);
    }
    if (status != BF_OK) {
        lines_free(lines);
        return status;
    }
    lines->used = bf_alloc(lines->n_rows, sizeof *lines->used);
    lines->residual = bf_alloc(lines->n_rows, sizeof *lines->residual);
    lines->jacobian = bf_alloc(lines->n_rows * n_refs, sizeof *lines->jacobian);
    *out = lines;
    return BF_OK;
}

void lines_free(struct line_rows *lines)
{
    if (lines == NULL)
        return;
    for (size_t i = 0; i < lines->n_sets; i++) {
        struct line_set *set = &lines->sets[i];
        predictor_free(set->predictor);
        record_free(&set->made);
        frequency_list_free(&set->list);
        free(set->from), free(set->mode);
    }
    free(lines->sets), free(lines->groups), free(lines->scale), free(lines->measured), free(lines->used);
    free(lines->residual), free(lines->jacobian);
    free(lines);
}

/* ---- Runs ---- */

struct rebase {
    bool pair;
};

static enum bf_status run_set(struct line_rows *lines, struct line_set *set, const double theta[], const bool want[],
                              const struct rebase *rebase, struct bf_error *err)
{
    struct prediction y;
    double *x = bf_alloc(set->n_refs + 1, sizeof *x);
    bool *wanted = bf_alloc(set->n_refs + 1, sizeof *wanted);
    for (size_t i = 0; i < set->n_refs; i++) {
        x[i] = theta[set->from[i]];
        wanted[i] = want != NULL && want[set->from[i]];
    }
    enum bf_status status = rebase != NULL ? predictor_rebase(set->predictor, x, err) : BF_OK;
    if (status == BF_OK)
        status = predictor_run(set->predictor, x, want != NULL ? wanted : NULL, &y, err);
    if (status == BF_OK && rebase != NULL && rebase->pair)
        is_list(set) ? frequencies_pair(lines, set) : magnitudes_pair(lines, set);
    if (status == BF_OK && is_list(set))
        status = frequencies_fill(lines, set, x, want != NULL ? wanted : NULL, err);
    else if (status == BF_OK)
        status = magnitudes_fill(lines, set, &y, want != NULL ? wanted : NULL, err);
    free(x), free(wanted);
    return status;
}

static enum bf_status run_all(struct line_rows *lines, const double theta[], const bool want[],
                              const struct rebase *rebase, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    if (want != NULL)
        memset(lines->jacobian, 0, lines->n_rows * lines->n_refs * sizeof *lines->jacobian);
    for (size_t i = 0; i < lines->n_sets && !status; i++)
        status = run_set(lines, &lines->sets[i], theta, want, rebase, err);
    return status;
}

enum bf_status lines_rebase(struct line_rows *lines, const double theta[], bool pair, struct bf_error *err)
{
    const struct rebase rebase = {.pair = pair};
    return lines != NULL ? run_all(lines, theta, NULL, &rebase, err) : BF_OK;
}

enum bf_status lines_run(struct line_rows *lines, const double theta[], const bool want[], struct bf_error *err)
{
    return lines != NULL ? run_all(lines, theta, want, NULL, err) : BF_OK;
}

/* ---- What they are ---- */

size_t lines_rows(const struct line_rows *lines)
{
    return lines != NULL ? lines->n_rows : 0;
}

size_t lines_used(const struct line_rows *lines)
{
    size_t n = 0;
    for (size_t k = 0; k < lines_rows(lines); k++)
        n += lines->used[k];
    return n;
}

bool lines_stated(const struct line_rows *lines)
{
    for (size_t g = 0; g < lines->n_groups; g++)
        if (!lines->groups[g].stated)
            return false;
    return true;
}

void lines_errors(const struct line_rows *lines, struct fit_channel_error errors[])
{
    for (size_t g = 0; g < lines->n_groups; g++) {
        const struct line_group *group = &lines->groups[g];
        struct fit_channel_error *e = &errors[g];
        double relative = 0.0, square = 0.0, noise = 0.0, size = 0.0;
        *e = (struct fit_channel_error){.record = group->record};
        memcpy(e->name, group->name, sizeof e->name);
        for (size_t k = group->row; k < group->row + group->n; k++) {
            if (!lines->used[k])
                continue;
            const double difference = lines->residual[k] * lines->scale[k];
            e->n++;
            relative += pow(group->kind == LINE_MAGNITUDE ? difference : expm1(difference), 2.0);
            size += group->kind == LINE_MAGNITUDE ? pow(lines->measured[k], 2.0) : 1.0;
            square += pow(lines->residual[k], 2.0);
            noise += pow(lines->scale[k], 2.0);
        }
        const double n = fmax((double)e->n, 1.0);
        e->nrmse = size > 0.0 ? sqrt(relative / size) : 0.0;
        e->noise = group->stated || group->kind == LINE_MAGNITUDE ? sqrt(noise / n) : 0.0;
        e->noise_ratio = group->stated || group->kind == LINE_MAGNITUDE ? sqrt(square / n) : nan("");
    }
}
