/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reduced_basis.h"
#include "reduced_place.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "fine.h"

/* A vector whose part outside the space so far is smaller than this adds nothing but rounding. */
static const double dependent_part = 1e-7;

/* ---- Fine matrices at the base ---- */

/* Linear effects at the base: mass and stiffness of forms and of places that keep the band. */
static enum bf_status add_effects(const struct fine_space *space, const struct model *model, double M[], double K[],
                                  struct bf_error *err)
{
    for (size_t e = 0; e < model->n_effects; e++) {
        struct beam_term terms[BEAM_EFFECT_TERMS];
        enum bf_status status = effect_terms(model, e, terms, err);
        if (status != BF_OK)
            return status;
        for (int t = 0; t < model->effects[e].effect->n_terms; t++) {
            struct place_points points = place_points(&terms[t].place, model);
            double m = terms[t].value.mass, k = terms[t].value.stiffness;
            if (points.n == 1 && terms[t].place.kind != BEAM_AT_POINT_TO_OWN) {
                fine_add_point(space, points.derivative, points.at[0], m, M);
                fine_add_point(space, points.derivative, points.at[0], k, K);
            }
            for (size_t r = 0; is_form(terms[t].place.kind) && r < model->n_materials; r++) {
                double w = model_weight(model, &model->materials[r], terms[t].place.weight);
                reduced_material_form(space, model, r, form_derivative(terms[t].place.kind), w * m, M);
                reduced_material_form(space, model, r, form_derivative(terms[t].place.kind), w * k, K);
            }
        }
    }
    return BF_OK;
}

static enum bf_status fine_matrices(const struct fine_space *space, const struct model *model, double M[], double K[],
                                    struct bf_error *err)
{
    for (size_t r = 0; r < model->n_materials; r++) {
        reduced_material_form(space, model, r, 0, model->materials[r].rho.value, M);
        reduced_material_form(space, model, r, 2, model->materials[r].EI.value, K);
    }
    for (size_t o = 0; o < model->n_outputs; o++)
        if (model->outputs[o].mass_kg > 0.0)
            fine_add_point(space, 0, model->outputs[o].at_m, model->outputs[o].mass_kg, M);
    return add_effects(space, model, M, K, err);
}

/* ---- The basis ---- */

static void multiply_mass(const void *context, const double x[], double y[])
{
    const struct basis *basis = context;
    fine_multiply(basis->space, basis->M, x, y);
}

/* Append v made M-orthonormal to the basis; nothing when it depends on the basis. */
static void basis_append(struct basis *b, const double v[])
{
    size_t N = b->space->n;
    if (b->n >= b->limit)
        return;
    double *x = b->V + b->n * N;
    memcpy(x, v, N * sizeof *x);
    fine_multiply(b->space, b->M, x, b->work);
    double before = sqrt(dense_dot(N, x, b->work));
    if (!(before > 0.0))
        return;
    for (int pass = 0; pass < 2; pass++) { /* twice is enough (Kahan) */
        fine_multiply(b->space, b->M, x, b->work);
        for (size_t k = 0; k < b->n; k++) {
            double overlap = dense_dot(N, b->V + k * N, b->work);
            for (size_t i = 0; i < N; i++)
                x[i] -= overlap * b->V[k * N + i];
        }
    }
    fine_multiply(b->space, b->M, x, b->work);
    double after = sqrt(dense_dot(N, x, b->work));
    if (!(after > dependent_part * before))
        return;
    for (size_t i = 0; i < N; i++)
        x[i] /= after;
    b->n++;
}

/* Static response to g and its first dynamic correction. */
static enum bf_status basis_append_static(struct basis *b, const double g[], int corrections, struct bf_error *err)
{
    double *x = bf_alloc(b->space->n, sizeof *x);
    enum bf_status status = sparse_solve(b->factor, g, x, err); /* K⁻¹ g */
    if (status == BF_OK)
        basis_append(b, x);
    for (int c = 0; status == BF_OK && c < corrections; c++) {
        fine_multiply(b->space, b->M, x, b->work);
        status = sparse_solve(b->factor, b->work, x, err); /* K⁻¹ M K⁻¹ g */
        if (status == BF_OK)
            basis_append(b, x);
    }
    free(x);
    return status;
}

static enum bf_status append_points(struct basis *b, const struct place_points *points, struct bf_error *err)
{
    double *g = bf_alloc(b->space->n, sizeof *g);
    place_functional(b->space, points, g);
    enum bf_status status = basis_append_static(b, g, b->corrections, err);
    free(g);
    return status;
}

static enum bf_status append_channels(struct basis *b, const struct model *model, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t i = 0; status == BF_OK && i < model->n_inputs; i++) {
        const struct model_input *in = &model->inputs[i];
        struct place_points points = {.n = 1, .derivative = 0, .at = {in->at_m}, .scale = {1.0}};
        if (in->kind == INPUT_PATCH_MOMENT)
            points = place_slope_difference(in->from_m, in->to_m);
        status = append_points(b, &points, err);
    }
    for (size_t i = 0; status == BF_OK && i < model->n_outputs; i++) {
        const struct model_output *o = &model->outputs[i];
        struct place_points points = {.n = 1, .derivative = 0, .at = {o->at_m}, .scale = {1.0}};
        if (o->kind == OUTPUT_PATCH_STRAIN)
            points = place_slope_difference(o->from_m, o->to_m);
        status = append_points(b, &points, err);
    }
    return status;
}

static enum bf_status append_law(struct basis *b, const struct model *model, size_t e, struct bf_error *err)
{
    const struct beam_effect *effect = model->effects[e].effect;
    if (effect->law_place == NULL)
        return BF_OK;
    double p[BEAM_EFFECT_PARAMETERS] = {0};
    for (int s = 0; s < effect->n_parameters; s++)
        p[s] = model->effects[e].parameters[s].value;
    struct beam_place place = model_place(model);
    struct beam_law_place law = {0};
    if (effect->law_place(p, &place, &law) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    struct beam_operator at = {.kind = BEAM_AT_NOTHING,
                               .at_m = law.at_m,
                               .from_m = law.at_m - 0.5 * law.width_m,
                               .to_m = law.at_m + 0.5 * law.width_m};
    if (law.points == BEAM_LAW_AT_POINT)
        at.kind = BEAM_AT_POINT;
    else if (law.points == BEAM_LAW_AT_PATCH)
        at.kind = BEAM_AT_PATCH;
    else if (law.points == BEAM_LAW_AT_SPAN)
        at.kind = BEAM_AT_SLOPE_DIFFERENCE;
    else
        return BF_OK;
    struct place_points points = place_points(&at, model);
    return append_points(b, &points, err);
}

static enum bf_status append_effects(struct basis *b, const struct model *model, struct bf_error *err)
{
    for (size_t e = 0; e < model->n_effects; e++) {
        struct beam_term terms[BEAM_EFFECT_TERMS];
        enum bf_status status = effect_terms(model, e, terms, err);
        for (int t = 0; status == BF_OK && t < model->effects[e].effect->n_terms; t++) {
            struct place_points points = place_points(&terms[t].place, model);
            if (points.n > 0)
                status = append_points(b, &points, err);
        }
        if (status == BF_OK)
            status = append_law(b, model, e, err);
        if (status != BF_OK)
            return status;
    }
    return BF_OK;
}

/* Modes below top_rad, between min_modes and max_modes of them. The Weyl count of a beam says how many to ask for. */
static enum bf_status append_modes(struct basis *b, const struct model *model, const struct reduced_options *options,
                                   double shift, struct reduced *out, struct bf_error *err)
{
    double rho = 0.0, EI = INFINITY;
    for (size_t r = 0; r < model->n_materials; r++) {
        rho = fmax(rho, model->materials[r].rho.value);
        EI = fmin(EI, model->materials[r].EI.value);
    }
    double wavenumber = sqrt(options->top_rad * sqrt(rho / EI)); /* k⁴ = ω² ρ/EI */
    double count = wavenumber * model->length_m / acos(-1.0) + 3.0;
    size_t ask = options->max_modes;
    if (count < (double)ask)
        ask = (size_t)count;
    if (ask < options->min_modes)
        ask = options->min_modes;
    if (ask + 3 > b->space->n)
        ask = b->space->n - 3;
    double *values = bf_alloc(ask, sizeof *values), *vectors = bf_alloc(ask * b->space->n, sizeof *vectors);
    enum bf_status status = sparse_modes(b->factor, b->space->n, ask, shift, multiply_mass, b, values, vectors, err);
    out->frequency_rad = bf_alloc(ask, sizeof(double));
    for (size_t k = 0; status == BF_OK && k < ask && b->n < b->limit; k++) {
        double omega = values[k] > 0.0 ? sqrt(values[k]) : 0.0;
        if (k >= options->min_modes && omega > options->top_rad)
            break;
        basis_append(b, vectors + k * b->space->n);
        out->frequency_rad[out->n_modes++] = omega;
    }
    free(values);
    free(vectors);
    return status;
}

/*
 * K is singular for a free beam: its factor is taken about a shift below every elastic mode, (0.1/22.4)² of the first elastic ω², or as much more as the rounding
 * of a piece that is much stiffer than the rest asks for: K[N·FINE_BAND] is exact to the last digit of its largest entries only.
 */
static double base_shift(const struct basis *b, const struct model *model, const double K[])
{
    static const double enough = 100.0; /* times the rounding of the largest ω² */
    if (model->support != SUPPORT_FREE_FREE)
        return 0.0;
    const struct material *m = &model->materials[0];
    const double scale = m->EI.value / m->rho.value / pow(model->length_m, 4.0);
    double largest = 0.0;
    for (size_t i = 0; i < b->space->n * FINE_BAND; i += FINE_BAND)
        largest = fmax(largest, K[i] / b->M[i]);
    return -fmax(1e-2 * scale, enough * DBL_EPSILON * largest);
}

enum bf_status reduced_basis(struct basis *b, const struct model *model, const struct reduced_options *options,
                             struct reduced *out, struct bf_error *err)
{
    const size_t N = b->space->n;
    double *K = bf_alloc(N * FINE_BAND, sizeof *K), shift = 0.0;
    enum bf_status status = fine_matrices(b->space, model, b->M, K, err);
    if (status == BF_OK)
        shift = base_shift(b, model, K);
    for (size_t i = 0; i < N * FINE_BAND; i++)
        K[i] -= shift * b->M[i];
    if (status == BF_OK)
        status = sparse_factorise(N, FINE_BAND, K, &b->factor, err);
    free(K);
    if (status == BF_OK)
        status = append_modes(b, model, options, shift, out, err);
    if (status == BF_OK && options->statics > 0)
        status = append_channels(b, model, err);
    if (status == BF_OK && options->statics > 0)
        status = append_effects(b, model, err);
    return status;
}
