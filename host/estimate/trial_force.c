/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "trial_force.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Points a sample: a force over the span is smooth (products of motions), a force at a point may have corners. */
enum { OVERSAMPLE_POINT = 4, OVERSAMPLE_SPAN = 2 };

static const char **names_of(const struct motion *motion)
{
    const char **names = bf_alloc(motion->n_records, sizeof *names);
    for (size_t r = 0; r < motion->n_records; r++)
        names[r] = record_base_name(transfer_record(motion->predictor, r).record);
    return names;
}

static double shortest_step(const struct motion *motion)
{
    double dt = INFINITY;
    for (size_t c = 0; c < motion->n_channels; c++)
        dt = fmin(dt, motion->channels[c].dt_s);
    return dt;
}

static void allocate(struct trial_force *force)
{
    const struct motion *motion = force->motion;
    size_t longest = 0;
    force->w = bf_alloc(motion->n_records, sizeof *force->w);
    force->v = bf_alloc(motion->n_records, sizeof *force->v);
    force->a = bf_alloc(motion->n_records, sizeof *force->a);
    for (size_t r = 0; r < motion->n_records; r++) {
        size_t steps = motion->records[r].n * (size_t)force->oversample;
        longest = steps > longest ? steps : longest;
        force->w[r] = bf_alloc(steps * force->law.d, sizeof(double));
        force->v[r] = bf_alloc(steps * force->law.d, sizeof(double));
        if (force->law.shortening != NULL)
            force->a[r] = bf_alloc(steps * force->law.d, sizeof(double));
    }
    force->F_work = bf_alloc(longest * force->law.d, sizeof(double));
}

enum bf_status trial_force_new(const struct motion *motion, const struct beam_effect *effect, struct trial_force *out,
                               struct bf_error *err)
{
    *out = (struct trial_force){.motion = motion};
    enum bf_status status = model_copy(transfer_model(motion->predictor), &out->model, err);
    if (status == BF_OK)
        status = model_append_effect(&out->model, effect->id, "", err);
    if (status != BF_OK) {
        trial_force_free(out);
        return status;
    }
    const char **names = names_of(motion);
    out->effect = out->model.n_effects - 1;
    out->n_parameters = model_parameters(&out->model, names, motion->n_records, &out->refs);
    free(names);
    out->map = parameter_map_new(&out->model, out->refs, out->n_parameters, motion->n_records);
    out->theta = bf_alloc(out->n_parameters, sizeof(double));
    for (size_t j = 0; j < out->n_parameters; j++)
        out->theta[j] = out->refs[j].value;
    memcpy(out->theta, motion->theta, motion->n_parameters * sizeof(double)); /* the effect's own stand last */
    status = law_new(&out->model, transfer_reduced(motion->predictor), &out->map, out->effect,
                     acos(-1.0) / shortest_step(motion), &out->law, err);
    if (status == BF_OK && out->law.d == 0)
        status = bf_fail(err, BF_USAGE, "effect %s has no force law", effect->id);
    if (status != BF_OK) {
        trial_force_free(out);
        return status;
    }
    out->oversample = out->law.g_at != NULL ? OVERSAMPLE_POINT : OVERSAMPLE_SPAN;
    allocate(out);
    return BF_OK;
}

void trial_force_free(struct trial_force *force)
{
    for (size_t r = 0; force->w != NULL && r < force->motion->n_records; r++) {
        free(force->w[r]);
        free(force->v[r]);
        free(force->a[r]);
    }
    free(force->w);
    free(force->v);
    free(force->a);
    free(force->F_work);
    if (force->motion != NULL)
        motion_paths_free(force->motion, &force->paths);
    law_free(&force->law);
    parameter_map_free(&force->map);
    free(force->refs);
    free(force->theta);
    model_free(&force->model);
    *force = (struct trial_force){0};
}

/* ---- Motion at the place ---- */

static enum bf_status fill_motion(struct trial_force *force, size_t record, struct bf_error *err)
{
    const struct motion *motion = force->motion;
    size_t d = force->law.d, steps = motion->records[record].n * (size_t)force->oversample;
    double *w = bf_alloc(3 * steps, sizeof *w), *v = w + steps;
    double *a = force->a[record] != NULL ? v + steps : NULL;
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < d; c++) {
        status = motion_of(motion, record, force->law.g + c * motion->modes.dimension, force->oversample, w, v, a, err);
        for (size_t k = 0; k < steps; k++) {
            force->w[record][k * d + c] = w[k];
            force->v[record][k * d + c] = v[k];
            if (a != NULL)
                force->a[record][k * d + c] = a[k];
        }
    }
    free(w);
    return status;
}

enum bf_status trial_force_place(struct trial_force *force, const double p[BEAM_EFFECT_PARAMETERS],
                                 struct bf_error *err)
{
    const struct motion *motion = force->motion;
    struct law *law = &force->law;
    double *theta = force->theta;
    bool same = force->placed;
    for (int s = 0; s < law->effect->n_parameters; s++) {
        size_t j = parameter_map_slot(&force->map, 0, force->effect, s);
        if (j == law->at_parameter || j == law->width_parameter)
            same = same && fabs(theta[j] - p[s]) <= 1e-12 * fabs(p[s]);
        theta[j] = p[s];
    }
    if (same)
        return BF_OK;
    force->placed = false;
    enum bf_status status = law_move(law, &force->model, transfer_reduced(motion->predictor), p, err);
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++)
        status = fill_motion(force, r, err);
    if (status != BF_OK)
        return status;
    motion_paths_free(motion, &force->paths);
    motion_paths_new(motion, law->g, law->d, &force->paths);
    force->placed = true;
    return BF_OK;
}

void trial_force_scales(const struct trial_force *force, double *w, double *v)
{
    size_t d = force->law.d;
    *w = *v = 0.0;
    for (size_t r = 0; r < force->motion->n_records; r++) {
        for (size_t k = 0; k < force->motion->records[r].n * (size_t)force->oversample; k++) {
            *w = fmax(*w, fabs(force->w[r][k * d]));
            *v = fmax(*v, fabs(force->v[r][k * d]));
        }
    }
}

/* ---- Force ---- */

static enum bf_status march(struct trial_force *force, size_t record, struct bf_error *err)
{
    const struct law *law = &force->law;
    size_t d = law->d, steps = force->motion->records[record].n * (size_t)force->oversample;
    double h = transfer_record(force->motion->predictor, record).grid->dt_s / (double)force->oversample;
    double z[BEAM_LAW_STATES] = {0}, still[LAW_COORDINATES] = {0}, sum = 0.0;
    struct law_prepared prepared;
    struct law_force out;
    bool possible = true;
    const double *w = force->w[record], *v = force->v[record], *w_old = still;
    law_prepare(law, &force->map, force->theta, &prepared);
    for (size_t k = 0; k < steps && possible; k++, w_old = w, w += d, v += d) {
        struct law_motion motion = {.w = w, .v = v, .w_old = w_old, .z = z, .t_s = h * (double)k, .dt_s = h};
        if (law->shortening != NULL)
            motion.a = force->a[record] + k * d;
        possible = law_force(&prepared, &motion, false, false, &out) == 0;
        for (size_t c = 0; c < d && possible; c++)
            sum += fabs(force->F_work[k * d + c] = out.f[c]);
        if (possible && law->effect->n_law_states > 0)
            memcpy(z, out.z, sizeof z);
    }
    law_prepared_free(&prepared);
    if (!possible)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", law->effect->id);
    return isfinite(sum) ? BF_OK : bf_fail(err, BF_NUMERIC, "effect %s: its force is not finite", law->effect->id);
}

/* F[d][m] of one record at the place in use. */
static enum bf_status spectrum_of(struct trial_force *force, size_t record, double complex F[], struct bf_error *err)
{
    const struct motion *motion = force->motion;
    size_t m = motion->records[record].m, d = force->law.d;
    enum bf_status status = march(force, record, err);
    for (size_t c = 0; status == BF_OK && c < d; c++)
        status = motion_transform(motion, record, force->F_work + c, d, force->oversample, F + c * m, err);
    return status;
}

enum bf_status trial_force_rows(struct trial_force *force, const double p[BEAM_EFFECT_PARAMETERS], double rows[],
                                struct bf_error *err)
{
    const struct motion *motion = force->motion;
    enum bf_status status = trial_force_place(force, p, err);
    memset(rows, 0, motion->n_rows * sizeof *rows);
    force->evaluations++;
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        double complex *F = bf_alloc(force->law.d * motion->records[r].m, sizeof *F);
        status = spectrum_of(force, r, F, err);
        if (status == BF_OK)
            status = motion_respond(motion, &force->paths, r, F, rows, err);
        free(F);
    }
    return status;
}

enum bf_status trial_force_assume(struct trial_force *force, struct motion *motion,
                                  const double p[BEAM_EFFECT_PARAMETERS], int times, struct bf_error *err)
{
    double complex **F = bf_alloc(motion->n_records, sizeof *F);
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < motion->n_records; r++)
        F[r] = bf_alloc(force->law.d * motion->records[r].m, sizeof *F[r]);
    for (int i = 0; status == BF_OK && i < times; i++) {
        status = trial_force_place(force, p, err);
        force->evaluations++;
        for (size_t r = 0; status == BF_OK && r < motion->n_records; r++)
            status = spectrum_of(force, r, F[r], err);
        if (status == BF_OK)
            status = motion_assume(motion, force->law.g, &force->paths, F, err);
        force->placed = false;
    }
    for (size_t r = 0; r < motion->n_records; r++)
        free(F[r]);
    free(F);
    return status == BF_OK ? motion_update_jacobian(motion, err) : status;
}
