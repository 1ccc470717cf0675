/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SPLINES = 160, DEPLOYED_DIMENSION = 10 };

static double two_pi(void)
{
    return 2.0 * acos(-1.0);
}

/* ---- One space ---- */

struct space {
    struct reduced reduced;
    struct parameter_ref *refs;
    struct parameter_map map;
    struct system *system;
};

static void space_free(struct space *s)
{
    system_free(s->system);
    parameter_map_free(&s->map);
    free(s->refs);
    reduced_free(&s->reduced);
}

static enum bf_status space_new(const struct model *model, const struct reduced_options *options, struct space *out,
                                struct bf_error *err)
{
    *out = (struct space){0};
    enum bf_status status = reduced_new(model, options, &out->reduced, err);
    if (status != BF_OK)
        return status;
    size_t n = model_parameters(model, NULL, 0, &out->refs);
    out->map = parameter_map_new(model, out->refs, n, 0);
    status = system_new(model, &out->reduced, &out->map, &out->system, err);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = out->refs[i].value;
    if (status == BF_OK)
        status = system_evaluate(out->system, theta, NULL, err);
    free(theta);
    if (status != BF_OK)
        space_free(out);
    return status;
}

/* Of a beam with something on it that has a mode of its own: those of the whole. */
static enum bf_status coupled_frequencies(const struct model *model, const struct reduced_options *beam, size_t n_modes,
                                          double frequency_Hz[], struct bf_error *err)
{
    struct reduced_options options = *beam;
    options.statics = 2;
    struct space space;
    const enum bf_status status = space_new(model, &options, &space, err);
    if (status != BF_OK)
        return status;
    for (size_t k = 0; k < n_modes; k++)
        frequency_Hz[k] = k < space.reduced.n ? space.system->omega_rad[k] / two_pi() : (double)NAN;
    space_free(&space);
    return BF_OK;
}

enum bf_status modes_frequencies(const struct model *model, size_t n_splines, bool uniform, size_t n_modes,
                                 double frequency_Hz[], struct bf_error *err)
{
    struct reduced_options options = {
        .n_splines = n_splines, .top_rad = INFINITY, .min_modes = n_modes, .max_modes = n_modes, .uniform = uniform};
    if (own_index(model, model->n_effects) > 0)
        return coupled_frequencies(model, &options, n_modes, frequency_Hz, err);
    struct reduced reduced;
    enum bf_status status = reduced_new(model, &options, &reduced, err);
    if (status != BF_OK)
        return status;
    for (size_t k = 0; k < n_modes; k++)
        frequency_Hz[k] = k < reduced.n_modes ? reduced.frequency_rad[k] / two_pi() : (double)NAN;
    reduced_free(&reduced);
    return BF_OK;
}

size_t modes_rigid(const double frequency_Hz[], size_t n)
{
    static const double rigid = 1e-4; /* of the highest: what is computed is not zero */
    size_t first = 0;
    while (first < n && frequency_Hz[first] < rigid * frequency_Hz[n - 1])
        first++;
    return first;
}

/* ---- The deployed space: lowest modes and static responses, ten in all ---- */

static size_t count_statics(const struct model *model)
{
    size_t n = model->n_inputs + model->n_outputs;
    for (size_t e = 0; e < model->n_effects; e++)
        n += model->effects[e].effect->law != NULL ? 1 : 0;
    return n < 4 ? n : 4;
}

static enum bf_status deployed_frequencies(const struct model *model, size_t *n_modes, size_t *n_statics, size_t n,
                                           double frequency_Hz[], struct bf_error *err)
{
    size_t kept = DEPLOYED_DIMENSION - count_statics(model) - own_index(model, model->n_effects);
    struct reduced_options options = {
        .top_rad = INFINITY, .min_modes = kept, .max_modes = kept, .statics = 1, .limit = DEPLOYED_DIMENSION};
    struct space space;
    enum bf_status status = space_new(model, &options, &space, err);
    if (status != BF_OK)
        return status;
    *n_modes = space.reduced.n_modes;
    *n_statics = space.reduced.n - space.reduced.n_modes - space.reduced.n_own;
    for (size_t k = 0; k < n; k++)
        frequency_Hz[k] = k < space.reduced.n ? space.system->omega_rad[k] / two_pi() : (double)NAN;
    space_free(&space);
    return BF_OK;
}

/* ---- All together ---- */

/* Damped poles in the order of the undamped modes: the pair nearest iω_k. */
static void damping(const struct system *system, size_t k, struct mode *mode)
{
    double omega = system->omega_rad[k], best = INFINITY;
    mode->undamped_Hz = omega / two_pi();
    mode->frequency_Hz = mode->undamped_Hz;
    mode->damping_ratio = 1.0;
    for (size_t i = 0; i < system->n_pairs; i++) {
        double distance = fabs(cabs(system->p[i]) - omega);
        if (distance >= best)
            continue;
        best = distance;
        mode->frequency_Hz = cabs(system->p[i]) / two_pi();
        mode->damping_ratio = -creal(system->p[i]) / cabs(system->p[i]);
    }
}

static void shapes(const struct space *space, const struct model *model, struct modes *out)
{
    size_t n = space->system->n, points = out->n_points;
    double *g = bf_alloc(n, sizeof *g);
    out->x_m = bf_alloc(points, sizeof(double));
    out->shape = bf_alloc(points * out->n, sizeof(double));
    for (size_t i = 0; i < points; i++) {
        out->x_m[i] = points > 1 ? model->length_m * (double)i / (double)(points - 1) : model->length_m;
        reduced_point(&space->reduced, 0, out->x_m[i], g);
        for (size_t k = 0; k < out->n; k++)
            for (size_t j = 0; j < n; j++)
                out->shape[k * points + i] += g[j] * space->system->modes[j + k * n];
    }
    for (size_t k = 0; k < out->n; k++) {
        double largest = 0.0;
        for (size_t i = 0; i < points; i++)
            if (fabs(out->shape[k * points + i]) > fabs(largest))
                largest = out->shape[k * points + i];
        for (size_t i = 0; i < points; i++)
            out->shape[k * points + i] /= largest < 0.0 || largest > 0.0 ? largest : 1.0;
    }
    free(g);
}

static enum bf_status compare_spaces(const struct model *model, double band_Hz, struct modes *out, struct bf_error *err)
{
    double *other = bf_alloc(out->n, sizeof *other);
    size_t n_uniform = out->n < 8 ? out->n : 8;
    enum bf_status status =
        deployed_frequencies(model, &out->deployed_modes, &out->deployed_statics, out->n, other, err);
    for (size_t k = 0; status == BF_OK && k < out->n; k++)
        out->mode[k].deployed_error = other[k] / out->mode[k].undamped_Hz - 1.0;
    if (status == BF_OK)
        status = modes_frequencies(model, DEPLOYED_DIMENSION - 1, true, n_uniform, other, err);
    for (size_t k = 0; status == BF_OK && k < out->n; k++)
        out->mode[k].uniform_error = k < n_uniform ? other[k] / out->mode[k].undamped_Hz - 1.0 : (double)NAN;
    if (status == BF_OK)
        status = modes_frequencies(model, 2 * SPLINES, false, out->n, other, err);
    for (size_t k = 0; status == BF_OK && k < out->n; k++)
        out->convergence = fmax(out->convergence, fabs(out->mode[k].undamped_Hz / other[k] - 1.0));
    while (out->in_band < out->n &&
           (band_Hz > 0.0 ? out->mode[out->in_band].undamped_Hz <= band_Hz : out->in_band < out->deployed_modes))
        out->in_band++;
    free(other);
    return status;
}

enum bf_status modes_compute(const struct model *model, size_t n_modes, double band_Hz, size_t n_points,
                             struct modes *out, struct bf_error *err)
{
    struct reduced_options options = {
        .n_splines = SPLINES, .top_rad = INFINITY, .min_modes = n_modes + 6, .max_modes = n_modes + 6, .statics = 2};
    struct space space;
    *out = (struct modes){.n = n_modes, .n_points = n_points};
    enum bf_status status = space_new(model, &options, &space, err);
    if (status != BF_OK)
        return status;
    out->mode = bf_alloc(n_modes, sizeof *out->mode);
    for (size_t k = 0; k < n_modes; k++)
        damping(space.system, k, &out->mode[k]);
    shapes(&space, model, out);
    space_free(&space);
    status = compare_spaces(model, band_Hz, out, err);
    if (status != BF_OK)
        modes_free(out);
    return status;
}

void modes_free(struct modes *modes)
{
    free(modes->mode);
    free(modes->x_m);
    free(modes->shape);
    *modes = (struct modes){0};
}
