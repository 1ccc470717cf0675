/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The predictor that everybody calls: of records of one beam it is one, as in the other predict_*.c. Where a mass differs from record to record, or a sensor or a
 * blow was elsewhere, each record has one of its own; parameters are handed down to them and rows up. The transfer functions are then of the first record's system.
 */
#include "predictor.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Is any parameter of this model on these records of one record alone and moves the beam, or is any place? */
static bool each_wanted(const struct model *model, const struct record records[], size_t n_records)
{
    bool wanted = model_differs_by_record(model);
    for (size_t r = 0; r < n_records && !wanted; r++)
        wanted = record_has_places(model, &records[r]);
    return wanted;
}

static enum bf_status hold_place(const struct model *model, const struct record *record, const char *name,
                                 struct channel_parameters *own, double *at_m, struct bf_error *err)
{
    double stated_m;
    if (!record_place(model, record, name, &stated_m))
        return BF_OK;
    if (!(stated_m >= 0.0 && stated_m <= model->length_m))
        return bf_fail_at(err, record->path, 1, "%s.at_m: %.6g m is outside the beam (0 … %.6g m); is it in metres?",
                          name, stated_m, model->length_m);
    *at_m = own->at.value = stated_m;
    own->lists_at = false;
    own->at.fixed = true;
    return BF_OK;
}

/* The model of one record, in which nothing differs any more. */
static enum bf_status record_model(const struct model *model, const struct record *record, struct model *out,
                                   struct bf_error *err)
{
    const char *name = record_base_name(record);
    enum bf_status status = model_copy(model, out, err);
    for (size_t e = 0; e < out->n_effects; e++) {
        struct model_effect *effect = &out->effects[e];
        for (int j = 0; j < effect->effect->n_parameters; j++) {
            const struct per_record_value *own = effect_record_value(effect, j, name);
            if (effect->by_record[j] && own != NULL)
                effect->parameters[j].value = own->value;
            effect->by_record[j] = false;
        }
    }
    for (size_t i = 0; i < out->n_inputs && !status; i++)
        if (out->inputs[i].kind == INPUT_POINT_FORCE)
            status = hold_place(model, record, out->inputs[i].name, &out->inputs[i].own, &out->inputs[i].at_m, err);
    for (size_t o = 0; o < out->n_outputs && !status; o++)
        if (out->outputs[o].kind != OUTPUT_PATCH_STRAIN)
            status = hold_place(model, record, out->outputs[o].name, &out->outputs[o].own, &out->outputs[o].at_m, err);
    return status;
}

/* ---- Life ---- */

static size_t common_index(const struct predictor *p, const struct parameter_ref *ref, size_t record)
{
    for (size_t i = 0; i < p->map.n; i++) {
        const struct parameter_ref *other = &p->refs[i];
        if (other->role == ref->role && other->owner == ref->owner && other->slot == ref->slot &&
            (other->record < 0 || (size_t)other->record == record))
            return i;
    }
    return SIZE_MAX; /* every parameter of a record is one of all */
}

static enum bf_status open_record(struct predictor *p, size_t r, struct each_record *own, struct bf_error *err)
{
    struct predict_options options = p->options;
    struct model model;
    const struct record *record = &p->records[r];
    const char *name = record_base_name(record);
    options.quiet = true;
    enum bf_status status = record_model(&p->model, record, &model, err);
    if (!status) {
        own->n_refs = model_parameters(&model, &name, 1, &own->refs);
        own->from = bf_alloc(own->n_refs, sizeof *own->from);
        for (size_t i = 0; i < own->n_refs; i++)
            own->from[i] = common_index(p, &own->refs[i], r);
        status = single_new(&model, record, 1, &options, &own->predictor, err);
    }
    model_free(&model);
    return status;
}

/* The common initial states, once the records' are counted. */
static void count_states(struct predictor *p)
{
    p->n_nuisance = p->states.most = 0;
    for (size_t r = 0; r < p->n_records; r++) {
        p->each[r].nuisance = p->plans[r].first_nuisance = p->n_nuisance;
        p->n_nuisance += p->each[r].predictor != NULL ? p->each[r].predictor->n_nuisance : 0;
    }
    p->amplitude = bf_grow(p->amplitude, p->n_nuisance, sizeof(double));
    memset(p->amplitude, 0, p->n_nuisance * sizeof(double));
}

enum bf_status predictor_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, struct predictor **out, struct bf_error *err)
{
    struct predictor *p;
    enum bf_status status = single_new(model, records, n_records, options, &p, err);
    if (status == BF_OK && each_wanted(model, records, n_records)) {
        p->each = bf_alloc(n_records, sizeof *p->each);
        for (size_t r = 0; r < n_records && !status; r++)
            status = open_record(p, r, &p->each[r], err);
        if (status == BF_OK) {
            count_states(p);
            status = predictor_window(p, INFINITY, err);
        }
        if (status != BF_OK)
            predictor_free(p);
    }
    if (status == BF_OK)
        *out = p;
    return status;
}

void predictor_free(struct predictor *p)
{
    for (size_t r = 0; p != NULL && p->each != NULL && r < p->n_records; r++) {
        single_free(p->each[r].predictor);
        free(p->each[r].refs);
        free(p->each[r].from);
    }
    if (p != NULL)
        free(p->each);
    single_free(p);
}

enum bf_status predictor_clone(const struct predictor *from, struct predictor **out, struct bf_error *err)
{
    struct model model;
    geometry_original(from, &model);
    enum bf_status status = predictor_new(&model, from->records, from->n_records, &from->options, out, err);
    model_free(&model);
    if (status == BF_OK && isfinite(from->t_end_s)) {
        status = predictor_window(*out, from->t_end_s, err);
        if (status != BF_OK)
            predictor_free(*out);
    }
    return status;
}

/* ---- Down and up ---- */

static double *hand_down(const struct each_record *own, const double theta[])
{
    double *x = bf_alloc(own->n_refs, sizeof *x);
    for (size_t i = 0; i < own->n_refs; i++)
        x[i] = own->from[i] != SIZE_MAX ? theta[own->from[i]] : own->refs[i].value;
    return x;
}

enum bf_status predictor_rebase(struct predictor *p, const double theta[], struct bf_error *err)
{
    enum bf_status status = single_rebase(p, theta, err);
    for (size_t r = 0; p->each != NULL && r < p->n_records && !status; r++) {
        double *x = hand_down(&p->each[r], theta);
        status = single_rebase(p->each[r].predictor, x, err);
        free(x);
    }
    return status;
}

enum bf_status predictor_window(struct predictor *p, double t_end_s, struct bf_error *err)
{
    enum bf_status status = single_window(p, t_end_s, err);
    for (size_t r = 0; p->each != NULL && r < p->n_records && !status; r++) {
        p->each[r].row = p->channels[p->plans[r].first_channel].row;
        status = single_window(p->each[r].predictor, t_end_s, err);
    }
    return status;
}

void predictor_set_nuisance(struct predictor *p, const double amplitude[])
{
    single_set_nuisance(p, amplitude);
    for (size_t r = 0; p->each != NULL && r < p->n_records; r++)
        single_set_nuisance(p->each[r].predictor, amplitude + p->each[r].nuisance);
}

static void hand_up(struct predictor *p, const struct each_record *own, const struct prediction *y, bool jacobian)
{
    const size_t rows = y->n_rows;
    memcpy(p->y + own->row, y->y, rows * sizeof *p->y);
    for (size_t k = 0; k < y->n_nuisance; k++)
        memcpy(p->nuisance + (own->nuisance + k) * p->n_rows + own->row, y->nuisance + k * rows,
               rows * sizeof *p->nuisance);
    for (size_t i = 0; jacobian && i < own->n_refs; i++)
        if (own->from[i] != SIZE_MAX)
            memcpy(p->jacobian + own->from[i] * p->n_rows + own->row, y->jacobian + i * rows,
                   rows * sizeof *p->jacobian);
}

static enum bf_status run_each(struct predictor *p, const double theta[], const bool want[], struct prediction *out,
                               struct bf_error *err)
{
    enum bf_status status = single_run_system(p, theta, want != NULL, out, err);
    memset(p->nuisance, 0, p->n_rows * p->n_nuisance * sizeof *p->nuisance);
    out->bends = false;
    for (size_t r = 0; r < p->n_records && !status; r++) {
        const struct each_record *own = &p->each[r];
        struct prediction y;
        double *x = hand_down(own, theta);
        bool *wanted = bf_alloc(own->n_refs, sizeof *wanted);
        for (size_t i = 0; i < own->n_refs; i++)
            wanted[i] = want != NULL && own->from[i] != SIZE_MAX && want[own->from[i]];
        status = single_run(own->predictor, x, want != NULL ? wanted : NULL, &y, err);
        if (!status)
            hand_up(p, own, &y, want != NULL);
        out->bends = out->bends || (!status && y.bends);
        free(wanted), free(x);
    }
    return status;
}

enum bf_status predictor_run(struct predictor *p, const double theta[], const bool want[], struct prediction *out,
                             struct bf_error *err)
{
    return p->each != NULL ? run_each(p, theta, want, out, err) : single_run(p, theta, want, out, err);
}

static enum bf_status settle_each(struct predictor *p, const double theta[], const struct predict_target *target,
                                  struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < p->n_records && !status; r++) {
        const struct each_record *own = &p->each[r];
        const struct predict_target part = {.weight = target->weight + own->row,
                                            .z = target->z != NULL ? target->z + own->row : NULL,
                                            .start = target->start != NULL ? target->start + own->nuisance : NULL,
                                            .runs = target->runs};
        double *x = hand_down(own, theta);
        status = single_settle(own->predictor, x, &part, err);
        memcpy(p->amplitude + own->nuisance, own->predictor->amplitude,
               own->predictor->n_nuisance * sizeof *p->amplitude);
        free(x);
    }
    return status;
}

enum bf_status predictor_settle(struct predictor *p, const double theta[], const struct predict_target *target,
                                struct bf_error *err)
{
    return p->each != NULL ? settle_each(p, theta, target, err) : single_settle(p, theta, target, err);
}

enum bf_status predictor_run_solved(struct predictor *p, const double theta[], const struct predict_target *target,
                                    struct prediction *out, struct bf_error *err)
{
    enum bf_status status = predictor_settle(p, theta, target, err);
    if (status == BF_OK)
        status = predictor_run(p, theta, NULL, out, err);
    if (status != BF_OK || p->n_nuisance == 0)
        return status;
    double *a = bf_alloc(p->n_nuisance, sizeof *a);
    status = settle_last(p, target, out, a, err);
    if (status == BF_OK)
        predictor_set_nuisance(p, a);
    free(a);
    return status;
}
