/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"
#include "law.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Gauss–Legendre with three points on each of about this many elements of the span. */
enum { SPAN_ELEMENTS = 10, GAUSS = 3 };
/* A law over the span sees the modes below this part of the Nyquist frequency. */
static const double span_band = 1.0;
/*
 * Large rotation sees those up to the sampling frequency, within what the steps follow: its force is made of slopes and
 * curvatures, which a few modes do not show near the patch.
 */
static const double axial_band = 2.0;
static const double gauss_x[GAUSS] = {-0.77459666924148337704, 0.0, 0.77459666924148337704};
static const double gauss_w[GAUSS] = {0.55555555555555555556, 0.88888888888888888889, 0.55555555555555555556};

/* ---- Building ---- */

static void depend_on(struct law *law, size_t parameter)
{
    for (size_t i = 0; i < law->n_dependencies; i++)
        if (law->dependency[i] == parameter)
            return;
    if (parameter != SIZE_MAX && law->n_dependencies < LAW_DEPENDENCIES)
        law->dependency[law->n_dependencies++] = parameter;
}

size_t law_weight_parameter(const struct parameter_map *map, enum beam_weight weight, size_t material)
{
    switch (weight) {
    case BEAM_WEIGHT_EI:
        return map->EI[material];
    case BEAM_WEIGHT_RHO:
        return map->rho[material];
    case BEAM_WEIGHT_CDI:
        return map->cDI[material];
    case BEAM_WEIGHT_ONE:
    case BEAM_WEIGHT_PATCH:
    case BEAM_WEIGHT_TURNING: /* of linear forms only */
        break;
    }
    return SIZE_MAX;
}

/* The functional of a point law and its derivatives, at the place that p gives. */
static void locate(struct law *law, const struct model *model, const struct reduced *reduced,
                   const struct beam_law_place *place)
{
    struct beam_operator at = {
        .at_m = place->at_m, .from_m = place->at_m - 0.5 * place->width_m, .to_m = place->at_m + 0.5 * place->width_m};
    at.kind = place->points == BEAM_LAW_AT_POINT   ? BEAM_AT_POINT
              : place->points == BEAM_LAW_AT_PATCH ? BEAM_AT_PATCH
                                                   : BEAM_AT_SLOPE_DIFFERENCE;
    reduced_place(reduced, &at, model, law->g, law->g_at);
    if (place->points != BEAM_LAW_AT_SPAN)
        return;
    double *from =
        bf_alloc(reduced->n, sizeof *from); /* d/dwidth [y'(a + h/2) − y'(a − h/2)] = (y″(to) + y″(from))/2 */
    reduced_point(reduced, 2, at.to_m, law->g_width);
    reduced_point(reduced, 2, at.from_m, from);
    for (size_t i = 0; i < reduced->n; i++)
        law->g_width[i] = 0.5 * (law->g_width[i] + from[i]);
    free(from);
}

static enum bf_status place_of(const struct law *law, const struct model *model, const double p[],
                               struct beam_law_place *out, struct bf_error *err)
{
    struct beam_place place = model_place(model);
    memset(out, 0, sizeof *out);
    if (law->effect->law_place(p, &place, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: its place is outside the beam", law->effect->id);
    return BF_OK;
}

enum bf_status law_move(struct law *law, const struct model *model, const struct reduced *reduced, const double p[],
                        struct bf_error *err)
{
    struct beam_law_place place;
    if (law->g_at == NULL)
        return BF_OK;
    enum bf_status status = place_of(law, model, p, &place, err);
    if (status == BF_OK)
        locate(law, model, reduced, &place);
    return status;
}

static void new_point_law(struct law *law, const struct model *model, const struct reduced *reduced,
                          const struct parameter_map *map, const struct beam_law_place *place)
{
    law->d = law->width = law->n_points = 1;
    law->g = bf_alloc(reduced->n, sizeof(double));
    law->g_at = bf_alloc(reduced->n, sizeof(double));
    law->g_width = bf_alloc(reduced->n, sizeof(double));
    locate(law, model, reduced, place);
    law->stride = VECTOR_LENGTH;
    law->psi = bf_alloc(VECTOR_LENGTH, sizeof(double));
    law->psi[0] = 1.0;
    law->quadrature = bf_alloc(1, sizeof(double));
    law->quadrature[0] = 1.0;
    law->material = bf_alloc(1, sizeof(size_t));
    if (place->at_parameter > 0)
        law->at_parameter = parameter_map_slot(map, 0, law->effect_index, place->at_parameter - 1);
    if (place->width_parameter > 0)
        law->width_parameter = parameter_map_slot(map, 0, law->effect_index, place->width_parameter - 1);
}

static size_t region_material(const struct model *model, size_t region)
{
    for (size_t m = 0; m < model->n_materials; m++)
        if (strcmp(model->materials[m].name, model->regions[region].name) == 0)
            return m;
    return 0;
}

static void add_span_point(struct law *law, const struct reduced *reduced, int derivative, double x, double weight,
                           size_t material)
{
    size_t q = law->n_points++;
    double *values = bf_alloc(reduced->n, sizeof *values);
    for (size_t k = 0; k < law->width; k++) {
        reduced_point(reduced, derivative + (int)k, x, values);
        for (size_t j = 0; j < law->d; j++)
            law->psi[(k * law->d + j) * law->stride + q] = values[j];
    }
    free(values);
    law->quadrature[q] = weight;
    law->material[q] = material;
}

/* G += ∫ φ' φ'ᵀ ds, Gauss–Legendre. */
static void add_integral(const struct reduced *reduced, size_t d, double from_m, double to_m, double slope[],
                         double G[LAW_COORDINATES][LAW_COORDINATES])
{
    double half = 0.5 * (to_m - from_m);
    for (int g = 0; g < GAUSS; g++) {
        reduced_point(reduced, 1, from_m + half * (1.0 + gauss_x[g]), slope);
        for (size_t i = 0; i < d; i++)
            for (size_t j = 0; j < d; j++)
                G[i][j] += half * gauss_w[g] * slope[i] * slope[j];
    }
}

/* G of law_axial.h at the points x_m[n_points], ascending from the clamp. */
static void add_shortening(struct law *law, const struct reduced *reduced, const double x_m[])
{
    size_t d = law->d;
    double G[LAW_COORDINATES][LAW_COORDINATES] = {{0.0}}, *slope = bf_alloc(reduced->n, sizeof *slope);
    law->shortening = bf_alloc(law->stride * d * d, sizeof *law->shortening);
    for (size_t q = 0; q < law->n_points; q++) {
        add_integral(reduced, d, q > 0 ? x_m[q - 1] : 0.0, x_m[q], slope, G);
        for (size_t i = 0; i < d; i++)
            for (size_t j = 0; j < d; j++)
                law->shortening[(i * d + j) * law->stride + q] = G[i][j];
    }
    free(slope);
}

static void new_span_law(struct law *law, const struct model *model, const struct reduced *reduced,
                         const struct parameter_map *map, enum beam_law_points points, double top_rad)
{
    int derivative = points == BEAM_LAW_OVER_DEFLECTION ? 0 : points == BEAM_LAW_OVER_CURVATURE ? 2 : 1;
    law->width = points == BEAM_LAW_OVER_SLOPE_AND_CURVATURE ? 2 : 1;
    double band_rad = (law->effect->axial_inertia != NULL ? axial_band : span_band) * top_rad;
    while (law->d < reduced->n_modes && law->d < LAW_COORDINATES && reduced->frequency_rad[law->d] < band_rad)
        law->d++;
    size_t most = GAUSS * (SPAN_ELEMENTS + model->n_regions);
    double *x_m = bf_alloc(most, sizeof *x_m);
    law->g = bf_alloc(law->d * reduced->n, sizeof(double));
    for (size_t j = 0; j < law->d; j++)
        law->g[j * reduced->n + j] = 1.0; /* amplitude of basis vector j */
    law->stride = vector_round(most);
    law->psi = bf_alloc(law->stride * law->width * law->d, sizeof(double));
    law->quadrature = bf_alloc(most, sizeof(double));
    law->material = bf_alloc(most, sizeof(size_t));
    for (size_t r = 0; r < model->n_regions; r++) {
        double from = model->regions[r].from_m, span = model->regions[r].to_m - from;
        size_t elements = (size_t)ceil(span / model->length_m * SPAN_ELEMENTS), material = region_material(model, r);
        double h = span / (double)elements;
        for (size_t e = 0; e < elements; e++)
            for (int i = 0; i < GAUSS; i++) {
                double x = x_m[law->n_points] = from + h * ((double)e + 0.5 + 0.5 * gauss_x[i]);
                add_span_point(law, reduced, derivative, x, 0.5 * h * gauss_w[i], material);
            }
        depend_on(law, law_weight_parameter(map, law->weight, material));
        if (law->effect->axial_inertia != NULL)
            depend_on(law, law_weight_parameter(map, BEAM_WEIGHT_RHO, material));
    }
    if (law->effect->axial_inertia != NULL)
        add_shortening(law, reduced, x_m);
    free(x_m);
}

/* The catalogue's typical values: what a law is like does not change with the values of a model, 0 among them. */
static void typical_values(const struct beam_effect *effect, double p[])
{
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = effect->parameters[s].start;
}

/* No jump of the tangents from one to the next of many points along a line, at several scales of the motion. */
static bool is_smooth(const struct law *law)
{
    enum { STEPS = 64 };
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    typical_values(law->effect, p);
    static const double most_jump = 0.25; /* of the largest; a cubic law changes by 2/STEPS of it a step */
    for (int scale = 0; scale < 4; scale++) {
        double extent = pow(10.0, -scale), largest = 0.0, jump = 0.0, last[2 * BEAM_LAW_WIDTH * BEAM_LAW_WIDTH] = {0};
        for (int i = 0; i <= STEPS; i++) {
            double x = extent * (2.0 * i / STEPS - 1.0);
            struct beam_law_input in = {
                .w = {x, 0.7 * x}, .v = {x, x}, .w_old = {x, 0.7 * x}, .t_s = 1.0, .dt_s = 1e-3};
            struct beam_law_output o;
            memset(&o, 0, sizeof o);
            if (law->effect->law(p, &in, &o) != 0)
                return false;
            for (size_t k = 0; k < BEAM_LAW_WIDTH * BEAM_LAW_WIDTH; k++) {
                double now[2] = {(&o.f_w[0][0])[k], (&o.f_v[0][0])[k]};
                for (size_t j = 0; j < 2; j++) {
                    largest = fmax(largest, fabs(now[j]));
                    jump = i > 0 ? fmax(jump, fabs(now[j] - last[2 * k + j])) : 0.0;
                    last[2 * k + j] = now[j];
                }
            }
        }
        if (jump > most_jump * largest)
            return false;
    }
    return law->effect->n_law_states == 0;
}

/* Which arguments a law over the span has: asked of the law itself, at a few motions. Point laws are cheap: all. */
static void find_uses(struct law *law)
{
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    typical_values(law->effect, p);
    law->uses_w = law->uses_v = law->uses_w_old = law->g_at != NULL || law->effect->n_law_states > 0;
    law->resists = false;
    for (int i = 1; i <= 8; i++) {
        double x = (i % 2 ? 1.0 : -1.0) * pow(10.0, -0.5 * i);
        struct beam_law_input in = {
            .w = {x, -0.7 * x}, .v = {1.3 * x, x}, .w_old = {0.9 * x, x}, .t_s = i, .dt_s = 1e-3};
        struct beam_law_output o;
        memset(&o, 0, sizeof o);
        if (law->effect->law(p, &in, &o) != 0)
            continue;
        for (size_t k = 0; k < BEAM_LAW_WIDTH * BEAM_LAW_WIDTH; k++) {
            law->uses_w = law->uses_w || fabs((&o.f_w[0][0])[k]) > 0.0;
            law->resists = law->resists || fabs((&o.f_v[0][0])[k]) > 0.0;
            law->uses_w_old = law->uses_w_old || fabs((&o.f_w_old[0][0])[k]) > 0.0;
        }
    }
    law->uses_v = law->uses_v || law->resists;
}

enum bf_status law_new(const struct model *model, const struct reduced *reduced, const struct parameter_map *map,
                       size_t effect_index, double top_rad, struct law *out, struct bf_error *err)
{
    const struct beam_effect *effect = model->effects[effect_index].effect;
    *out = (struct law){
        .effect = effect, .effect_index = effect_index, .at_parameter = SIZE_MAX, .width_parameter = SIZE_MAX};
    if (effect->law == NULL)
        return BF_OK;
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = model->effects[effect_index].parameters[s].value;
    struct beam_law_place where;
    enum bf_status status = place_of(out, model, p, &where, err);
    if (status != BF_OK)
        return status;
    out->weight = where.weight;
    if (where.points >= BEAM_LAW_OVER_DEFLECTION)
        new_span_law(out, model, reduced, map, where.points, top_rad);
    else
        new_point_law(out, model, reduced, map, &where);
    find_uses(out);
    out->smooth = is_smooth(out);
    for (int s = 0; s < effect->n_parameters; s++) {
        size_t parameter = parameter_map_slot(map, 0, effect_index, s);
        if (parameter != out->at_parameter && parameter != out->width_parameter)
            depend_on(out, parameter);
    }
    return BF_OK;
}

void law_free(struct law *law)
{
    free(law->g);
    free(law->g_at);
    free(law->g_width);
    free(law->psi);
    free(law->quadrature);
    free(law->material);
    free(law->shortening);
    *law = (struct law){0};
}
