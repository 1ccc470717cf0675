/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What reaches the beam: a recorded drive behind its amplifier and patch (hysteresis, saturation). The record's
 * band-limited curve is sampled several times a sample, the drive effects act on it in their order, and only the change is
 * transformed back: what they leave alone stays exact. They act before the recorder's filter, where a record states one.
 * Derivatives go along by forward differentiation.
 */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Of a band-limited input; held inputs are taken at their samples. */
enum { DRIVE_OVERSAMPLE = 8 };

static bool input_driven(const struct model *model, size_t input)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->drive != NULL && effect_on_input(model, e, input))
            return true;
    return false;
}

/* One input of one record on the fine grid. */
struct drive_work {
    const struct run *run;
    struct record_plan *plan;
    const struct response_grid *grid;
    size_t record, input, factor, N;
    double *weight; /* [N] e^(−σt) */
    double *x;      /* [N] behind the effects so far */
    size_t n_slots;
    size_t slot[8 * BEAM_EFFECT_PARAMETERS]; /* wanted parameters of the effects so far */
    double *dx;                              /* [n_slots][N] */
};

static enum bf_status upsample(const struct drive_work *w, const double complex U[], struct bf_error *err)
{
    size_t n_fine = w->grid->n_fft * w->factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *x = bf_alloc(n_fine, sizeof *x);
    for (size_t k = 0; k < w->grid->m; k++)
        wide[k] = (double)w->factor * U[k];
    if (w->factor > 1)
        wide[w->grid->m - 1] *= 0.5; /* one line at the old Nyquist frequency becomes a pair */
    fft_inverse(plan, wide, x);
    for (size_t k = 0; k < w->N; k++)
        w->x[k] = x[k] / w->weight[k];
    free(wide);
    free(x);
    return BF_OK;
}

/* U[m] += the transform of x. */
static enum bf_status add_transform(const struct drive_work *w, const double x[], double complex U[],
                                    struct bf_error *err)
{
    size_t n_fine = w->grid->n_fft * w->factor;
    const struct fft *plan;
    enum bf_status status = fft_get(n_fine, &plan, err);
    if (status != BF_OK)
        return status;
    double complex *wide = bf_alloc(n_fine / 2 + 1, sizeof *wide);
    double *padded = bf_alloc(n_fine, sizeof *padded);
    for (size_t k = 0; k < w->N; k++)
        padded[k] = x[k] * w->weight[k];
    fft_forward(plan, padded, wide);
    recorder_apply(w->plan->A, w->grid->m, wide);
    for (size_t k = 0; k < w->grid->m; k++)
        U[k] += wide[k] / (double)w->factor;
    free(wide);
    free(padded);
    return BF_OK;
}

/* State of an effect along the record, and its derivative by every slot. */
struct drive_state {
    double z[BEAM_DRIVE_STATES], dz[8 * BEAM_EFFECT_PARAMETERS][BEAM_DRIVE_STATES];
};

static void differentiate_step(struct drive_work *w, size_t k, size_t first_own, const size_t own[],
                               const struct beam_drive_output *o, const double du_old[], struct drive_state *s)
{
    for (size_t j = 0; j < w->n_slots; j++) {
        double du = w->dx[j * w->N + k], dx = o->u_u * du + o->u_u_old * du_old[j], dz[BEAM_DRIVE_STATES];
        for (int i = 0; i < BEAM_DRIVE_STATES; i++) {
            dx += o->u_z[i] * s->dz[j][i];
            dz[i] = o->z_u[i] * du + o->z_u_old[i] * du_old[j];
            for (int l = 0; l < BEAM_DRIVE_STATES; l++)
                dz[i] += o->z_z[i][l] * s->dz[j][l];
            if (j >= first_own)
                dz[i] += o->z_p[i][own[j - first_own]];
        }
        if (j >= first_own)
            dx += o->u_p[own[j - first_own]];
        memcpy(s->dz[j], dz, sizeof dz);
        w->dx[j * w->N + k] = dx;
    }
}

/* x and dx behind one more effect. */
static enum bf_status apply_effect(struct drive_work *w, size_t e, struct bf_error *err)
{
    const struct predictor *p = w->run->p;
    const struct beam_effect *effect = p->model.effects[e].effect;
    double parameters[BEAM_EFFECT_PARAMETERS];
    size_t own[BEAM_EFFECT_PARAMETERS], first_own = w->n_slots;
    parameter_map_effect(&p->map, w->record, e, w->run->theta, parameters);
    for (int s = 0; s < effect->n_parameters; s++) {
        size_t j = parameter_map_slot(&p->map, w->record, e, s);
        if (!run_wants(w->run, j) || w->n_slots >= sizeof w->slot / sizeof w->slot[0])
            continue;
        own[w->n_slots - first_own] = (size_t)s;
        w->slot[w->n_slots++] = j;
    }
    struct drive_state state = {.z = {0}};
    double u_old = w->x[0], du_old[8 * BEAM_EFFECT_PARAMETERS];
    for (size_t j = 0; j < w->n_slots; j++)
        du_old[j] = w->dx[j * w->N];
    for (size_t k = 0; k < w->N; k++) {
        struct beam_drive_output o;
        memset(&o, 0, sizeof o);
        double u = w->x[k], du[8 * BEAM_EFFECT_PARAMETERS];
        if (effect->drive(parameters, u, u_old, state.z, &o) != 0)
            return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
        for (size_t j = 0; j < w->n_slots; j++)
            du[j] = w->dx[j * w->N + k];
        differentiate_step(w, k, first_own, own, &o, du_old, &state);
        memcpy(du_old, du, w->n_slots * sizeof du[0]);
        memcpy(state.z, o.z, sizeof state.z);
        w->x[k] = o.u;
        u_old = u;
    }
    return BF_OK;
}

static enum bf_status store(struct drive_work *w, const double before[], struct bf_error *err)
{
    struct record_plan *plan = w->plan;
    size_t m = w->grid->m;
    double complex *U = plan->driven[w->input] = bf_grow(plan->driven[w->input], m, sizeof *U);
    memcpy(U, plan->recorded[w->input], m * sizeof *U);
    plan->U[w->input] = U;
    for (size_t k = 0; k < w->N; k++)
        w->x[k] -= before[k];
    enum bf_status status = add_transform(w, w->x, U, err);
    for (size_t j = 0; status == BF_OK && j < w->n_slots; j++) {
        plan->changes = bf_grow(plan->changes, plan->n_changes + 1, sizeof *plan->changes);
        struct drive_change *change = &plan->changes[plan->n_changes++];
        *change = (struct drive_change){w->input, w->slot[j], bf_alloc(m, sizeof *U)};
        status = add_transform(w, w->dx + j * w->N, change->U, err);
    }
    return status;
}

static enum bf_status drive_input(struct drive_work *w, struct bf_error *err)
{
    const struct model *model = &w->run->p->model;
    double step_s = w->grid->dt_s / (double)w->factor;
    w->N = (w->grid->n + w->grid->n_tail) * w->factor;
    w->weight = bf_alloc(3 * w->N, sizeof *w->weight);
    w->x = w->weight + w->N;
    double *before = w->x + w->N;
    w->dx = bf_alloc(sizeof w->slot / sizeof w->slot[0] * w->N, sizeof *w->dx);
    for (size_t k = 0; k < w->N; k++)
        w->weight[k] = exp(-w->grid->sigma * step_s * (double)k);
    double complex *U = bf_grow(NULL, w->grid->m, sizeof *U);
    memcpy(U, w->plan->recorded[w->input], w->grid->m * sizeof *U);
    recorder_undo(w->plan->A, w->grid->m, U);
    enum bf_status status = upsample(w, U, err);
    memcpy(before, w->x, w->N * sizeof *before);
    for (size_t e = 0; status == BF_OK && e < model->n_effects; e++)
        if (model->effects[e].effect->drive != NULL && effect_on_input(model, e, w->input))
            status = apply_effect(w, e, err);
    if (status == BF_OK)
        status = store(w, before, err);
    free(U);
    free(w->weight);
    free(w->dx);
    return status;
}

enum bf_status drives_evaluate(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < p->n_records; r++) {
        struct record_plan *plan = &p->plans[r];
        for (size_t c = 0; c < plan->n_changes; c++)
            free(plan->changes[c].U);
        plan->n_changes = 0;
        for (size_t i = 0; status == BF_OK && i < p->model.n_inputs; i++) {
            if (plan->input[i] == NULL || !input_driven(&p->model, i))
                continue;
            struct drive_work w = {
                .run = run, .plan = plan, .grid = &p->grids[plan->grid], .record = r, .input = i, .factor = 1};
            if (p->options.intersample == INTERSAMPLE_BAND_LIMITED)
                w.factor = DRIVE_OVERSAMPLE;
            status = drive_input(&w, err);
        }
    }
    return status;
}
