/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "beam/beam.h"
#include "estimate/estimate.h"

static const double explained = 0.6; /* error of a fit that has found the beam in the records */
static const double explained_sign = 0.7,
                    fall_sign = 0.4; /* error after; share of the misfit's power that a turn leaves */
static const double fall_size = 0.4; /* error after over error before, of a factor of another size */
static const double near_ten = 0.15, near_thousand = 0.4; /* |ln| of found over hypothesis; */
static const double alike = 1.5, alike_sign = 3.0;        /* largest over smallest factor of the records */

struct work {
    const struct factor_pair *pair;
    struct model model;                 /* of the check */
    struct record view[FACTOR_RECORDS]; /* the pair's records with the pair's columns; columns are borrowed */
    struct record_column *columns;      /* [FACTOR_RECORDS · n_columns] */
    size_t n_columns;                   /* inputs, then the output */
    struct fit_options fit;
};

static void work_free(struct work *w)
{
    model_free(&w->model);
    free(w->columns);
}

/* ---- The records ---- */

static void take_view(struct work *w, const struct record *record, size_t slot)
{
    struct record_column *columns = w->columns + slot * w->n_columns;
    struct record *view = &w->view[slot];
    *view = *record;
    view->n = factor_enough(&w->model, record);
    view->t0_s *= w->pair->time_factor, view->dt_s *= w->pair->time_factor;
    view->columns = columns, view->n_columns = 0;
    for (size_t c = 0; c < record->n_columns; c++) {
        bool wanted = strcmp(record->columns[c].name, w->model.outputs[w->pair->output].name) == 0;
        for (size_t i = 0; i < w->model.n_inputs; i++)
            wanted = wanted || strcmp(record->columns[c].name, w->model.inputs[i].name) == 0;
        if (wanted && view->n_columns < w->n_columns)
            columns[view->n_columns++] = record->columns[c];
    }
}

static enum bf_status work_new(const struct model *model, const struct record records[],
                               const struct predict_options *options, const struct factor_pair *pair, struct work *w,
                               struct bf_error *err)
{
    *w = (struct work){.pair = pair, .n_columns = model->n_inputs + 1};
    w->fit = (struct fit_options){.start = FIT_GIVEN, .never_search = true, .quiet = true};
    if (options)
        w->fit.predict = *options;
    w->fit.predict.quiet = true;
    const enum bf_status status = factor_check_model(model, pair->output, &w->model, err);
    if (status)
        return status;
    w->columns = bf_alloc(FACTOR_RECORDS * w->n_columns, sizeof *w->columns);
    for (size_t r = 0; r < pair->n_records; r++)
        take_view(w, &records[pair->record[r]], r);
    return BF_OK;
}

/* ---- Fits ---- */

enum factor_of_fit { FACTOR_OPEN, FACTOR_POSITIVE, FACTOR_HELD };

static void set_gain(struct model *model, size_t output, enum factor_of_fit how, double factor)
{
    struct model_output *o = &model->outputs[output];
    const bool strain = o->kind == OUTPUT_PATCH_STRAIN;
    struct parameter *gain = strain ? &model->Ks : &o->own.gain;
    gain->value *= factor, gain->prior = 0.0;
    gain->min = -HUGE_VAL, gain->max = how == FACTOR_POSITIVE && gain->value < 0.0 ? 0.0 : HUGE_VAL;
    gain->fixed = how == FACTOR_HELD;
    gain->logarithmic = how == FACTOR_POSITIVE && gain->value > 0.0;
    o->own.lists_gain = o->own.lists_gain || !strain;
}

/* A fit without an answer is no failure: result->n_channels is 0 then. */
static enum bf_status fit_so(const struct work *w, enum factor_of_fit how, double factor, struct model *model,
                             struct fit_result *result, struct bf_error *err)
{
    *result = (struct fit_result){.nrmse = HUGE_VAL};
    *model = (struct model){0};
    enum bf_status status = model_copy(&w->model, model, err);
    if (status)
        return status;
    if (how == FACTOR_OPEN)
        for (size_t i = 0; i < model->n_inputs; i++)
            model->inputs[i].level_per_record = true;
    else
        set_gain(model, w->pair->output, how, factor);
    status = fit_run(model, w->view, w->pair->n_records, &w->fit, result, err);
    if (status == BF_NUMERIC || status == BF_BAD_FILE) { /* no value at the start, or nothing to fit */
        *result = (struct fit_result){.nrmse = HUGE_VAL};
        return BF_OK;
    }
    return status;
}

static enum bf_status error_of(const struct work *w, enum factor_of_fit how, double factor, double *nrmse,
                               struct bf_error *err)
{
    struct model model;
    struct fit_result result;
    const enum bf_status status = fit_so(w, how, factor, &model, &result, err);
    *nrmse = status == BF_OK ? result.nrmse : HUGE_VAL;
    fit_free(&result);
    model_free(&model);
    return status;
}

/* ---- What an open factor says ---- */

/* The records' common factor; false: they have none. */
static bool common_factor(const struct fit_result *result, double *factor)
{
    double sorted[FACTOR_RECORDS];
    const size_t n = result->n_records;
    if (n == 0 || n > FACTOR_RECORDS)
        return false;
    memcpy(sorted, result->level, n * sizeof *sorted);
    *factor = median(n, sorted); /* sorts them */
    const double low = sorted[0], high = sorted[n - 1];
    const double ratio = low > 0.0 ? high / low : low / high;
    return low * high > 0.0 && ratio < (*factor < 0.0 ? alike_sign : alike);
}

static enum bf_status judge_bands(const struct work *w, const struct model *model, const struct fit_result *result,
                                  struct factor_bands *out, struct bf_error *err)
{
    struct finer_prediction y;
    double *theta = bf_alloc(result->n_parameters + 1, sizeof *theta);
    for (size_t i = 0; i < result->n_parameters; i++)
        theta[i] = result->parameters[i].value;
    double *sigma = bf_alloc(result->n_channels + 1, sizeof *sigma);
    for (size_t c = 0; c < result->n_channels; c++)
        sigma[c] = result->channels[c].noise > 0.0 ? result->channels[c].noise : 1.0; /* one channel: any weight does */
    struct fit_options options = w->fit;
    options.sigma = sigma;
    enum bf_status status = fit_predict(model, w->view, w->pair->n_records, &options, theta, &y, err);
    *out = (struct factor_bands){.even = true};
    for (size_t c = 0; c < y.n_channels && !status; c++) {
        const struct predict_channel *channel = &y.channels[c];
        struct factor_bands one;
        status = factor_bands_judge(channel->measured, y.fitted + channel->row, channel->n, &one, err);
        out->turned = out->turned || one.turned;
        out->early = out->early || one.early;
        out->even = out->even && one.even;
    }
    finer_prediction_free(&y);
    free(theta), free(sigma);
    return status;
}

/* The size of the hypothesis that `found` is near, else 1. 9.80665 where the two are near; its owner knows which. */
double factor_size_of(double found, bool even)
{
    static const struct {
        double size;
        bool thousand;
    } sizes[] = {{9.80665, false}, {1.0 / 9.80665, false}, {10.0, false}, {0.1, false}, {1e3, true}, {1e-3, true}};
    double best = 1.0, nearest = HUGE_VAL;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const double away = fabs(log(found / sizes[i].size)), limit = sizes[i].thousand ? near_thousand : near_ten;
        if (away < limit && away < nearest && (even || sizes[i].thousand))
            best = sizes[i].size, nearest = away;
    }
    return best;
}

bool factor_size_is_stated(const struct model *model, const struct factor_pair *pair)
{
    const bool strain = model->outputs[pair->output].kind == OUTPUT_PATCH_STRAIN;
    const bool moment = pair->input != SIZE_MAX && model->inputs[pair->input].kind == INPUT_PATCH_MOMENT;
    return (!strain || model->Ks.fixed || model->Ks.prior > 0.0) &&
           (!moment || model->KB.fixed || model->KB.prior > 0.0);
}

/* ---- The judgement ---- */

/* Some record's drive is wide enough for a sign. */
static enum bf_status drive_is_wide(const struct work *w, bool *wide, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *wide = false;
    for (size_t r = 0; r < w->pair->n_records && !status && !*wide; r++)
        status = factor_drive_wide(&w->model, &w->view[r], w->pair->input, wide, err);
    return status;
}

static enum bf_status judge_sign(const struct work *w, const struct factor_bands *bands, double after,
                                 struct factor_pair *pair, struct bf_error *err)
{
    bool wide;
    enum bf_status status = drive_is_wide(w, &wide, err);
    if (status || !wide || bands->turned || bands->early || after > explained_sign)
        return status;
    double with_sign = 0.0;
    status = error_of(w, FACTOR_POSITIVE, fabs(pair->found), &with_sign, err);
    with_sign = fmin(with_sign, 1.0);
    if (status != BF_OK || with_sign < explained || after * after > fall_sign * with_sign * with_sign)
        return status;
    pair->told = true, pair->factor = -1.0;
    pair->before = with_sign, pair->after = after;
    return BF_OK;
}

/* A size on top of the sign that is known. */
static enum bf_status judge_size(const struct work *w, const struct factor_bands *bands, struct factor_pair *pair,
                                 struct bf_error *err)
{
    const double open = pair->reference != 0.0 ? fabs(pair->reference) : 1.0;
    const double sign = pair->factor, size = factor_size_of(fabs(pair->found) / open, bands->even);
    double without = 0.0, with = 0.0;
    if (!(fabs(log(size)) > 0.0))
        return BF_OK;
    enum bf_status status = error_of(w, FACTOR_HELD, sign * open, &without, err);
    if (!status)
        status = error_of(w, FACTOR_HELD, sign * open * size, &with, err);
    if (status || with > explained || with > fall_size * without)
        return status;
    pair->factor = sign * size;
    if (sign > 0.0)
        pair->before = without;
    pair->after = with;
    return BF_OK;
}

static enum bf_status judge_open(const struct model *given, const struct work *w, const struct model *model,
                                 const struct fit_result *result, struct factor_pair *pair, struct bf_error *err)
{
    struct factor_bands bands;
    if (!(result->nrmse <= explained_sign) || !common_factor(result, &pair->found))
        return BF_OK;
    enum bf_status status = judge_bands(w, model, result, &bands, err);
    if (status)
        return status;
    pair->factor = 1.0, pair->before = pair->after = result->nrmse;
    if (pair->found < 0.0)
        status = judge_sign(w, &bands, result->nrmse, pair, err);
    else
        pair->told = result->nrmse <= explained;
    if (!status && pair->told && !bands.turned && (factor_size_is_stated(given, pair) || pair->reference != 0.0))
        status = judge_size(w, &bands, pair, err);
    return status;
}

/* A mass at the free end that the model lacks turns no mode, but hides what does. */
static bool add_tip_mass(struct model *model)
{
    struct bf_error ignored;
    for (size_t e = 0; e < model->n_effects; e++)
        if (strcmp(model->effects[e].effect->id, "tip_mass") == 0)
            return false;
    return model_append_effect(model, "tip_mass", "", &ignored) == BF_OK && model_check(model, &ignored) == BF_OK;
}

static enum bf_status judge_once(const struct model *given, const struct work *w, struct factor_pair *pair,
                                 struct bf_error *err)
{
    struct model model;
    struct fit_result result;
    enum bf_status status = fit_so(w, FACTOR_OPEN, 1.0, &model, &result, err);
    if (!status)
        status = judge_open(given, w, &model, &result, pair, err);
    fit_free(&result);
    model_free(&model);
    return status;
}

/* Nothing was found, or a factor far from 1 that is none of the hypotheses: the beam is not well enough known. */
static bool is_in_doubt(const struct model *given, const struct factor_pair *pair)
{
    const bool unsaid = pair->factor >= 1.0 && pair->factor <= 1.0 && factor_size_is_stated(given, pair);
    return !pair->told || (unsaid && fabs(log(fabs(pair->found))) > near_thousand);
}

enum bf_status factor_pair_judge(const struct model *model, const struct record records[],
                                 const struct predict_options *options, struct factor_pair *pair, struct bf_error *err)
{
    struct work w;
    pair->told = false;
    enum bf_status status = work_new(model, records, options, pair, &w, err);
    if (!status)
        status = judge_once(model, &w, pair, err);
    if (!status && is_in_doubt(model, pair) && add_tip_mass(&w.model)) {
        const struct factor_pair first = *pair;
        status = judge_once(model, &w, pair, err);
        if (first.told && !(pair->after < first.after))
            *pair = first;
    }
    work_free(&w);
    return status;
}
