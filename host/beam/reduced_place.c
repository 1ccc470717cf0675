/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reduced_place.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "fine.h"

struct place_points place_slope_difference(double from, double to)
{
    return (struct place_points){.n = 2, .derivative = 1, .at = {to, from}, .scale = {1.0, -1.0}};
}

struct beam_operator sensor_place(double at_m)
{
    return (struct beam_operator){.kind = BEAM_AT_POINT, .at_m = at_m};
}

struct place_points place_points(const struct beam_operator *place, const struct model *model)
{
    double from = 0.0, to = 0.0;
    switch (place->kind) {
    case BEAM_AT_POINT:
    case BEAM_AT_POINT_TO_OWN:
        return (struct place_points){.n = 1, .derivative = 0, .at = {place->at_m}, .scale = {1.0}};
    case BEAM_AT_SLOPE:
        return (struct place_points){.n = 1, .derivative = 1, .at = {place->at_m}, .scale = {1.0}};
    case BEAM_AT_ROOT:
        return (struct place_points){.n = 1, .derivative = 1, .at = {0.0}, .scale = {1.0}};
    case BEAM_AT_SLOPE_DIFFERENCE:
        return place_slope_difference(place->from_m, place->to_m);
    case BEAM_AT_PATCH:
        model_patch(model, &from, &to);
        return place_slope_difference(from, to);
    case BEAM_AT_NOTHING:
    case BEAM_AT_OWN:
    case BEAM_OVER_DEFLECTION:
    case BEAM_OVER_SLOPE:
    case BEAM_OVER_CURVATURE:
    case BEAM_OVER_MODES:
        break;
    }
    return (struct place_points){0};
}

void place_functional(const struct fine_space *space, const struct place_points *points, double g[])
{
    for (int i = 0; i < points->n; i++)
        fine_add_functional(space, points->derivative, points->at[i], points->scale[i], g);
}

static void reduced_points(const struct reduced *reduced, const struct place_points *points, double g[])
{
    double *fine = bf_alloc(reduced->space.n, sizeof *fine);
    place_functional(&reduced->space, points, fine);
    dense_gemv(true, reduced->space.n, reduced->n, 1.0, reduced->V, fine, 0.0, g); /* g = Vᵀ g_fine */
    free(fine);
}

void reduced_point(const struct reduced *reduced, int derivative, double at_m, double g[])
{
    struct place_points points = {.n = 1, .derivative = derivative, .at = {at_m}, .scale = {1.0}};
    reduced_points(reduced, &points, g);
}

void reduced_place(const struct reduced *reduced, const struct beam_operator *place, const struct model *model,
                   double g[], double g_at[])
{
    struct place_points points = place_points(place, model);
    reduced_points(reduced, &points, g);
    points.derivative++;
    reduced_points(reduced, &points, g_at);
}

void reduced_effect_place(const struct reduced *reduced, const struct beam_operator *place, const struct model *model,
                          size_t effect, double g[], double g_at[])
{
    reduced_place(reduced, place, model, g, g_at);
    if (own_share(place->kind) != 0.0)
        g[reduced->n - reduced->n_own + own_index(model, effect)] = own_share(place->kind);
}

bool effect_has_own(const struct beam_effect *effect)
{
    const struct beam_place place = {.length_m = 1.0};
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    struct beam_term terms[BEAM_EFFECT_TERMS] = {{.place = {.kind = BEAM_AT_NOTHING}}};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = effect->parameters[s].start;
    if (effect->terms == NULL || effect->terms(p, &place, terms) != 0)
        return false;
    for (int t = 0; t < effect->n_terms; t++)
        if (terms[t].place.kind == BEAM_AT_OWN)
            return true;
    return false;
}

size_t own_index(const struct model *model, size_t effect)
{
    size_t n = 0;
    for (size_t e = 0; e < effect; e++)
        n += effect_has_own(model->effects[e].effect) ? 1 : 0;
    return n;
}

void reduced_input(const struct reduced *reduced, const struct model_input *input, double g[])
{
    struct place_points points = {.n = 1, .derivative = 0, .at = {input->at_m}, .scale = {1.0}};
    if (input->kind == INPUT_PATCH_MOMENT)
        points = place_slope_difference(input->from_m, input->to_m);
    reduced_points(reduced, &points, g);
}

void reduced_output(const struct reduced *reduced, const struct model_output *output, double g[])
{
    struct place_points points = {.n = 1, .derivative = 0, .at = {output->at_m}, .scale = {1.0}};
    if (output->kind == OUTPUT_PATCH_STRAIN)
        points = place_slope_difference(output->from_m, output->to_m);
    reduced_points(reduced, &points, g);
}

/* Two-point Gauss on every element: exact for a cubic. */
void reduced_load(const struct reduced *reduced, const struct model *model, size_t material, double L[])
{
    const struct fine_space *space = &reduced->space;
    double *fine = bf_alloc(space->n, sizeof *fine);
    const double gauss_x = 0.57735026918962576451;
    for (size_t r = 0; r < model->n_regions; r++) {
        if (strcmp(model->regions[r].name, model->materials[material].name) != 0)
            continue;
        for (size_t i = 3; i < space->spline.n; i++) {
            double from = fmax(space->spline.knots[i], model->regions[r].from_m);
            double to = fmin(space->spline.knots[i + 1], model->regions[r].to_m), h = to - from;
            for (int side = -1; h > 0.0 && side <= 1; side += 2)
                fine_add_functional(space, 0, from + 0.5 * h * (1.0 + side * gauss_x), 0.5 * h, fine);
        }
    }
    dense_gemv(true, space->n, reduced->n, 1.0, reduced->V, fine, 0.0, L);
    free(fine);
}

enum bf_status effect_terms(const struct model *model, size_t e, struct beam_term out[BEAM_EFFECT_TERMS],
                            struct bf_error *err)
{
    const struct beam_effect *effect = model->effects[e].effect;
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = model->effects[e].parameters[s].value;
    struct beam_place place = model_place(model);
    memset(out, 0, BEAM_EFFECT_TERMS * sizeof *out);
    if (effect->terms != NULL && effect->terms(p, &place, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    return BF_OK;
}

void reduced_material_form(const struct fine_space *space, const struct model *model, size_t material, int derivative,
                           double scale, double band[])
{
    for (size_t r = 0; r < model->n_regions; r++)
        if (strcmp(model->regions[r].name, model->materials[material].name) == 0)
            fine_add_form(space, derivative, model->regions[r].from_m, model->regions[r].to_m, scale, band);
}
