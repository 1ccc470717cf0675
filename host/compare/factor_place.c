/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factor_place.c — what a wrong sign looks like and is not: a channel at another place than the model says, two columns under each other's names. */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"

static const double explained = 0.3;       /* error of a fit that has found the beam, all outputs together */
static const double well_explained = 0.05; /* no other start is tried */
static const double worth_an_end = 0.6;    /* error where a fit is left early: above, it is not gone on with */
static const double fall = 0.4;            /* error after over error before */
static const double as_well =
    1.5; /* error of another channel's place over that of the best: they cannot be told apart */
static const double moved = 0.02; /* of the length; less is a ruler's error, which a fit with a prior finds */
static const double well_inside = 0.02;
/* Evaluations in which a fit finds the beam, if its channels are where they are looked for; another goes on several times as long, and ends far off. */
enum { ENOUGH_RUNS = 80 };
static const double starts[] = {0.3, 0.55, 0.8, 0.97}; /* of the length, beside the place as given */

struct place_work {
    struct model model; /* of the check, every place held */
    const struct model *given;
    const struct record *given_records;
    const size_t *record; /* [n] of them */
    size_t n;
    struct record view[FACTOR_RECORDS];
    struct record_column *columns; /* [FACTOR_RECORDS · n_columns], swapped or not */
    size_t n_columns;
    struct fit_options fit;
    double before;
};

/* ---- Fits ---- */

/* Error of a fit of all outputs, to its end where it comes near the records; HUGE_VAL: it has no answer. */
static enum bf_status error_of_fit(const struct place_work *w, const struct model *model, struct fit_result *result,
                                   struct bf_error *err)
{
    struct fit_options quick = w->fit;
    quick.most_runs = ENOUGH_RUNS;
    enum bf_status status = fit_run(model, w->view, w->n, &quick, result, err);
    if (status == BF_OK && result->nrmse <= worth_an_end && result->evaluations >= ENOUGH_RUNS) {
        fit_free(result);
        status = fit_run(model, w->view, w->n, &w->fit, result, err);
    }
    if (status != BF_NUMERIC && status != BF_BAD_FILE)
        return status;
    *result = (struct fit_result){.nrmse = HUGE_VAL};
    return BF_OK;
}

static enum bf_status error_as_given(const struct place_work *w, double *nrmse, struct bf_error *err)
{
    struct fit_result result;
    const enum bf_status status = error_of_fit(w, &w->model, &result, err);
    if (status == BF_OK)
        *nrmse = result.nrmse;
    fit_free(&result);
    return status;
}

static double place_found(const struct fit_result *result, const char *name)
{
    const size_t length = strlen(name);
    for (size_t i = 0; i < result->n_parameters; i++)
        if (strncmp(result->parameters[i].label, name, length) == 0 &&
            strcmp(result->parameters[i].label + length, ".at_m") == 0)
            return result->parameters[i].value;
    return NAN;
}

static const char *free_place(struct model *model, bool is_input, size_t channel, double at_m)
{
    struct channel_parameters *own = is_input ? &model->inputs[channel].own : &model->outputs[channel].own;
    double *place = is_input ? &model->inputs[channel].at_m : &model->outputs[channel].at_m;
    own->lists_at = true, own->at.fixed = false;
    own->at.value = own->at.prior_value = *place = at_m;
    own->at.prior = 0.0;
    own->at.min = 0.0, own->at.max = model->length_m;
    return is_input ? model->inputs[channel].name : model->outputs[channel].name;
}

/* The best place of one channel, from the given one and then from others until one explains the records. */
static enum bf_status best_place(const struct place_work *w, bool is_input, size_t channel, double *at_m, double *nrmse,
                                 struct bf_error *err)
{
    const size_t n = sizeof starts / sizeof *starts;
    enum bf_status status = BF_OK;
    *nrmse = HUGE_VAL;
    for (size_t i = 0; i <= n && status == BF_OK && *nrmse > well_explained; i++) {
        struct model model = {0};
        struct fit_result result = {0};
        status = model_copy(&w->model, &model, err);
        if (status == BF_OK) {
            const double given = is_input ? model.inputs[channel].at_m : model.outputs[channel].at_m;
            const char *name = free_place(&model, is_input, channel, i == 0 ? given : starts[i - 1] * model.length_m);
            status = error_of_fit(w, &model, &result, err);
            if (status == BF_OK && result.nrmse < *nrmse)
                *nrmse = result.nrmse, *at_m = place_found(&result, name);
        }
        fit_free(&result);
        model_free(&model);
    }
    return status;
}

/* ---- Another place ---- */

static bool is_another(const struct place_work *w, double given_m, double at_m, double nrmse)
{
    const double length_m = w->model.length_m;
    return nrmse <= explained && nrmse <= fall * w->before && fabs(at_m - given_m) > moved * length_m &&
           at_m > well_inside * length_m;
}

/* Keeps the best in `best`; one that does as well stands beside it, the output first. */
static void take(struct channel_factor *best, const struct channel_factor *one)
{
    if (best->after > one->after * as_well) {
        *best = *one;
    } else if (one->after <= best->after * as_well && !best->either && best->is_input != one->is_input) {
        const struct channel_factor *output = best->is_input ? one : best, *input = best->is_input ? best : one;
        const struct channel_factor both = {.kind = FACTOR_PLACE,
                                            .channel = output->channel,
                                            .found = output->found,
                                            .factor = 1.0,
                                            .either = true,
                                            .other_is_input = true,
                                            .other = input->channel,
                                            .other_found = input->found,
                                            .before = output->before,
                                            .after = output->after};
        *best = both;
    } else if (one->after < best->after) {
        *best = *one;
    }
}

static enum bf_status try_place(const struct place_work *w, bool is_input, size_t channel, struct channel_factor *best,
                                struct bf_error *err)
{
    const double given_m = is_input ? w->model.inputs[channel].at_m : w->model.outputs[channel].at_m;
    double at_m = given_m, nrmse;
    const enum bf_status status = best_place(w, is_input, channel, &at_m, &nrmse, err);
    if (status != BF_OK || !is_another(w, given_m, at_m, nrmse))
        return status;
    const struct channel_factor one = {.kind = FACTOR_PLACE,
                                       .is_input = is_input,
                                       .channel = channel,
                                       .factor = 1.0,
                                       .found = at_m,
                                       .before = w->before,
                                       .after = nrmse};
    take(best, &one);
    return status;
}

/* One line tells an amplitude and a phase, which nearly any place or exchange explains. */
static enum bf_status any_is_wide(const struct place_work *w, bool *wide, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *wide = false;
    for (size_t r = 0; r < w->n && !status && !*wide; r++)
        status = factor_drive_wide(&w->model, &w->view[r], SIZE_MAX, wide, err);
    return status;
}

static enum bf_status try_places(const struct place_work *w, struct channel_factor *best, struct bf_error *err)
{
    bool wide;
    enum bf_status status = any_is_wide(w, &wide, err);
    if (status != BF_OK || !wide)
        return status;
    for (size_t o = 0; o < w->model.n_outputs && status == BF_OK; o++)
        if (w->model.outputs[o].kind != OUTPUT_PATCH_STRAIN &&
            record_column(&w->view[0], w->model.outputs[o].name) != NULL)
            status = try_place(w, false, o, best, err);
    for (size_t i = 0; i < w->model.n_inputs && status == BF_OK; i++)
        if (w->model.inputs[i].kind == INPUT_POINT_FORCE && record_column(&w->view[0], w->model.inputs[i].name) != NULL)
            status = try_place(w, true, i, best, err);
    return status;
}

/* ---- Two columns exchanged ---- */

static bool exchange(struct record *record, const char *a, const char *b)
{
    struct record_column *one = NULL, *two = NULL;
    for (size_t c = 0; c < record->n_columns; c++) {
        one = strcmp(record->columns[c].name, a) == 0 ? &record->columns[c] : one;
        two = strcmp(record->columns[c].name, b) == 0 ? &record->columns[c] : two;
    }
    if (one == NULL || two == NULL)
        return false;
    const struct record_column first = *one;
    one->x = two->x, one->noise_psd = two->noise_psd, one->noise = two->noise;
    two->x = first.x, two->noise_psd = first.noise_psd, two->noise = first.noise;
    return true;
}

static const char *name_at(const struct model *model, size_t k)
{
    return k < model->n_outputs ? model->outputs[k].name : model->inputs[k - model->n_outputs].name;
}

/* Channels k and l, the outputs counted first. */
static enum bf_status try_exchange(struct place_work *w, size_t k, size_t l, struct channel_factor *best,
                                   struct bf_error *err)
{
    const char *a = name_at(&w->model, k), *b = name_at(&w->model, l);
    const size_t outputs = w->model.n_outputs;
    double nrmse = HUGE_VAL;
    bool both = true, wide = false;
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < w->n; r++)
        both = exchange(&w->view[r], a, b) && both;
    if (both)
        status = any_is_wide(w, &wide, err);
    if (wide && status == BF_OK)
        status = error_as_given(w, &nrmse, err);
    for (size_t r = 0; r < w->n; r++)
        (void)exchange(&w->view[r], a, b);
    if (status == BF_OK && nrmse <= explained && nrmse <= fall * w->before && nrmse < best->after * as_well)
        *best = (struct channel_factor){.kind = FACTOR_EXCHANGE,
                                        .is_input = k >= outputs,
                                        .channel = k < outputs ? k : k - outputs,
                                        .other_is_input = l >= outputs,
                                        .other = l < outputs ? l : l - outputs,
                                        .factor = 1.0,
                                        .found = 1.0,
                                        .before = w->before,
                                        .after = nrmse};
    return status;
}

static enum bf_status try_exchanges(struct place_work *w, struct channel_factor *best, struct bf_error *err)
{
    enum { MOST = 5 }; /* channels: ten exchanges */
    const size_t n = w->model.n_outputs + w->model.n_inputs;
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < n && n <= MOST; k++)
        for (size_t l = k + 1; l < n && status == BF_OK; l++)
            status = try_exchange(w, k, l, best, err);
    return status;
}

/* ---- Where to start ---- */

/* Leaves one of the outputs to be seen. */
static void show_only(const struct place_work *w, size_t output)
{
    static char hidden[] = "-";
    for (size_t r = 0; r < w->n; r++)
        for (size_t c = 0; c < w->view[r].n_columns; c++) {
            w->view[r].columns[c].name = w->given_records[w->record[r]].columns[c].name;
            for (size_t o = 0; o < w->model.n_outputs && output != SIZE_MAX; o++)
                if (o != output && strcmp(w->view[r].columns[c].name, w->model.outputs[o].name) == 0)
                    w->view[r].columns[c].name = hidden;
        }
}

/* An output that the model explains alone knows stiffness and damping: with a wrong one beside it a fit may end elsewhere. */
static enum bf_status start_from_one(struct place_work *w, struct bf_error *err)
{
    struct model best = {0};
    double least = explained;
    enum bf_status status = BF_OK;
    for (size_t o = 0; o < w->model.n_outputs && w->model.n_outputs > 1 && status == BF_OK; o++) {
        struct fit_result result = {0};
        show_only(w, o);
        w->fit.never_search = false; /* a damping that went to zero on its way stays there */
        status = error_of_fit(w, &w->model, &result, err);
        w->fit.never_search = true;
        if (status == BF_OK && result.nrmse < least) {
            static const struct fit_check none;
            least = result.nrmse;
            model_free(&best);
            status = model_copy(&w->model, &best, err);
            if (status == BF_OK)
                fit_into_model(&result, w->view, &none, &best);
        }
        fit_free(&result);
    }
    show_only(w, SIZE_MAX);
    if (least < explained && status == BF_OK) {
        model_free(&w->model);
        w->model = best;
    } else {
        model_free(&best);
    }
    return status;
}

/* ---- All of it ---- */

static enum bf_status work_new(struct place_work *w, struct bf_error *err)
{
    const enum bf_status status = factor_check_model(w->given, SIZE_MAX, &w->model, err);
    for (size_t r = 0; r < w->n; r++)
        w->n_columns = w->given_records[w->record[r]].n_columns > w->n_columns
                           ? w->given_records[w->record[r]].n_columns
                           : w->n_columns;
    w->columns = bf_alloc(FACTOR_RECORDS * w->n_columns + 1, sizeof *w->columns);
    for (size_t r = 0; r < w->n && status == BF_OK; r++) {
        const struct record *from = &w->given_records[w->record[r]];
        w->view[r] = *from;
        w->view[r].n = factor_enough(&w->model, from);
        w->view[r].columns = w->columns + r * w->n_columns;
        memcpy(w->view[r].columns, from->columns, from->n_columns * sizeof *from->columns);
    }
    return status;
}

enum bf_status factor_place_find(const struct model *model, const struct record records[], const size_t record[],
                                 size_t n, double known, bool places, const struct predict_options *options,
                                 struct channel_factor *out, struct bf_error *err)
{
    struct place_work w = {.given = model, .given_records = records, .record = record, .n = n};
    *out = (struct channel_factor){.after = HUGE_VAL};
    w.fit = (struct fit_options){.start = FIT_GIVEN, .never_search = true, .quiet = true};
    if (options)
        w.fit.predict = *options;
    w.fit.predict.quiet = true;
    enum bf_status status = work_new(&w, err);
    if (status == BF_OK)
        status = start_from_one(&w, err);
    if (status == BF_OK)
        status = error_as_given(&w, &w.before, err);
    w.before = fmin(w.before, known);
    if (status == BF_OK && places && w.before > explained)
        status = try_places(&w, out, err);
    if (status == BF_OK && w.before > explained)
        status = try_exchanges(&w, out, err);
    model_free(&w.model);
    free(w.columns);
    return status;
}
