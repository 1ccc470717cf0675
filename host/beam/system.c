/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"
#include "poles.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "reduced_place.h"
#include "system.h"

enum bf_status system_new(const struct model *model, const struct reduced *reduced, const struct parameter_map *map,
                          struct system **out, struct bf_error *err)
{
    if (reduced->n == 0)
        return bf_fail(err, BF_NUMERIC, "the reduced space is empty");
    size_t n = reduced->n;
    struct system *s = bf_alloc(1, sizeof *s);
    *s = (struct system){.model = model, .reduced = reduced, .map = map, .n = n};
    s->M = bf_alloc(n * n, sizeof(double));
    s->C = bf_alloc(n * n, sizeof(double));
    s->K = bf_alloc(n * n, sizeof(double));
    s->omega_rad = bf_alloc(n, sizeof(double));
    s->modes = bf_alloc(n * n, sizeof(double));
    s->derivative = bf_alloc(map->n, sizeof *s->derivative);
    s->use = bf_alloc(reduced->n_blocks, sizeof *s->use);
    *out = s;
    return BF_OK;
}

void system_free(struct system *s)
{
    if (s == NULL)
        return;
    for (size_t i = 0; i < s->map->n; i++) {
        free(s->derivative[i].p);
        free(s->derivative[i].Z);
    }
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        free(s->use[b].own);
        free(s->use[b].B_at);
    }
    free(s->use);
    free(s->derivative);
    free(s->M);
    free(s->C);
    free(s->K);
    free(s->omega_rad);
    free(s->modes);
    free(s->p);
    free(s->phi);
    free(s->cluster);
    free(s);
}

/* ---- Coefficients of each block ---- */

static void depend(struct block_use *use, size_t parameter, int coefficient, double d)
{
    if (parameter == SIZE_MAX)
        return;
    for (size_t i = 0; i < use->n_dependencies; i++) {
        if (use->dependency[i].parameter == parameter) {
            use->dependency[i].d[coefficient] += d;
            return;
        }
    }
    size_t i = use->n_dependencies++;
    use->dependency[i].parameter = parameter;
    memset(use->dependency[i].d, 0, sizeof use->dependency[i].d);
    use->dependency[i].d[coefficient] = d;
}

static void read_coefficients(const struct beam_coefficients *c, double out[COEFFICIENTS])
{
    out[OF_MASS] = c->mass;
    out[OF_DAMPING] = c->damping;
    out[OF_STIFFNESS] = c->stiffness;
    out[OF_MEMORY] = c->memory;
    out[OF_RELAXATION] = c->relaxation_s;
}

/* weight(x) of a form over one material, and what it depends on. */
struct form_weight {
    double value;
    size_t n, parameter[3];
    double by_parameter[3];
};

static void weight_by(struct form_weight *w, size_t parameter, double derivative)
{
    w->parameter[w->n] = parameter;
    w->by_parameter[w->n++] = derivative;
}

static void weight_is(struct form_weight *w, size_t parameter, const double theta[])
{
    w->value = theta[parameter];
    weight_by(w, parameter, 1.0);
}

static struct form_weight form_weight(const struct system *s, const double theta[], enum beam_weight weight,
                                      size_t material)
{
    const struct parameter_map *map = s->map;
    struct form_weight w = {.value = 1.0};
    switch (weight) {
    case BEAM_WEIGHT_RHO:
        weight_is(&w, map->rho[material], theta);
        break;
    case BEAM_WEIGHT_EI:
        weight_is(&w, map->EI[material], theta);
        break;
    case BEAM_WEIGHT_CDI:
        weight_is(&w, map->cDI[material], theta);
        break;
    case BEAM_WEIGHT_PATCH:
        w.value = strcmp(s->model->materials[material].name, "patch") == 0 ? 1.0 : 0.0;
        break;
    case BEAM_WEIGHT_TURNING: {
        const size_t plain = model_plain_material(s->model);
        const double EI = theta[map->EI[plain]], rho = theta[map->rho[plain]], own = theta[map->rho[material]];
        w.value = own * EI / rho;
        weight_by(&w, map->EI[plain], own / rho);
        weight_by(&w, map->rho[material], EI / rho);
        weight_by(&w, map->rho[plain], -own * EI / (rho * rho));
        break;
    }
    case BEAM_WEIGHT_ONE:
        break;
    }
    return w;
}

static void use_term(const struct system *s, const struct block *block, const struct beam_term *term,
                     const double theta[], struct block_use *use)
{
    struct form_weight weight = {.value = 1.0};
    double c[COEFFICIENTS];
    if (block->kind == BLOCK_FORM)
        weight = form_weight(s, theta, term->place.weight, block->material);
    const double w = weight.value;
    read_coefficients(&term->value, c);
    for (int k = 0; k < COEFFICIENTS; k++) {
        double scale = k == OF_RELAXATION ? 1.0 : w; /* τ is a time, not a force */
        use->value[k] = scale * c[k];
        for (size_t i = 0; i < weight.n && k != OF_RELAXATION; i++)
            depend(use, weight.parameter[i], k, weight.by_parameter[i] * c[k]);
    }
    const struct beam_effect *effect = s->model->effects[block->effect].effect;
    for (int slot = 0; slot < effect->n_parameters; slot++) {
        double d[COEFFICIENTS];
        read_coefficients(&term->by_parameter[slot], d);
        for (int k = 0; k < COEFFICIENTS; k++)
            if (d[k] < 0.0 || d[k] > 0.0)
                depend(use, parameter_map_slot(s->map, 0, block->effect, slot), k,
                       k == OF_RELAXATION ? d[k] : w * d[k]);
    }
}

/* A place whose coordinate is the parameter `position` is projected anew. */
static void use_place(const struct system *s, const struct beam_operator *place, size_t effect, size_t position,
                      struct block_use *use)
{
    size_t n = s->n;
    use->position = position;
    if (use->own == NULL) {
        use->own = bf_alloc(n * n, sizeof(double));
        use->B_at = bf_alloc(n * n, sizeof(double));
    }
    double *g = bf_alloc(2 * n, sizeof *g);
    reduced_effect_place(s->reduced, place, s->model, effect, g, g + n);
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n; i++) {
            use->own[i + j * n] = g[i] * g[j];
            use->B_at[i + j * n] = g[n + i] * g[j] + g[i] * g[n + j];
        }
    }
    use->B = use->own;
    free(g);
}

static void use_sensor(const struct system *s, const struct block *block, const double theta[], struct block_use *use)
{
    const size_t position = s->map->output_place[block->output];
    use->value[OF_MASS] = s->model->outputs[block->output].mass_kg;
    if (position == SIZE_MAX)
        return;
    const struct beam_operator place = sensor_place(theta[position]);
    use_place(s, &place, 0, position, use);
}

static enum bf_status terms_at(const struct system *s, size_t effect_index, const double theta[],
                               struct beam_term out[BEAM_EFFECT_TERMS], struct bf_error *err)
{
    const struct beam_effect *effect = s->model->effects[effect_index].effect;
    double p[BEAM_EFFECT_PARAMETERS];
    parameter_map_effect(s->map, 0, effect_index, theta, p);
    struct beam_place place = model_place(s->model);
    memset(out, 0, BEAM_EFFECT_TERMS * sizeof *out);
    if (effect->terms(p, &place, out) != 0)
        return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
    return BF_OK;
}

static enum bf_status use_block(const struct system *s, const struct block *block, const double theta[],
                                struct block_use *use, struct bf_error *err)
{
    const struct parameter_map *map = s->map;
    struct beam_term terms[BEAM_EFFECT_TERMS];
    memset(use->value, 0, sizeof use->value);
    use->n_dependencies = 0;
    use->position = SIZE_MAX;
    use->B = block->B;
    switch (block->kind) {
    case BLOCK_MASS:
        use->value[OF_MASS] = theta[map->rho[block->material]];
        use->value[OF_DAMPING] = theta[map->gamma];
        depend(use, map->rho[block->material], OF_MASS, 1.0);
        depend(use, map->gamma, OF_DAMPING, 1.0);
        return BF_OK;
    case BLOCK_STIFFNESS:
        use->value[OF_STIFFNESS] = theta[map->EI[block->material]];
        use->value[OF_DAMPING] = theta[map->cDI[block->material]];
        depend(use, map->EI[block->material], OF_STIFFNESS, 1.0);
        depend(use, map->cDI[block->material], OF_DAMPING, 1.0);
        return BF_OK;
    case BLOCK_SENSOR:
        use_sensor(s, block, theta, use);
        return BF_OK;
    case BLOCK_FORM:
    case BLOCK_PLACE:
    case BLOCK_MODES:
        break;
    }
    enum bf_status status = terms_at(s, block->effect, theta, terms, err);
    if (status == BF_OK) {
        use_term(s, block, &terms[block->term], theta, use);
        const struct beam_operator *place = &terms[block->term].place;
        if (block->kind == BLOCK_PLACE && place->at_parameter != 0)
            use_place(s, place, block->effect, parameter_map_slot(s->map, 0, block->effect, place->at_parameter - 1),
                      use);
    }
    return status;
}

/* ---- Assembly ---- */

static void add_scaled(size_t n, double scale, const double B[], double A[])
{
    if (scale < 0.0 || scale > 0.0)
        for (size_t i = 0; i < n * n; i++)
            A[i] += scale * B[i];
}

/* C += η X, X = M Φ Ω Φᵀ M: the damping whose modal diagonal is η ω_j. */
static void assemble_modal_damping(struct system *s)
{
    size_t n = s->n;
    double *P = bf_alloc(2 * n * n, sizeof *P), *Q = P + n * n;
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        struct block_use *use = &s->use[b];
        if (s->reduced->blocks[b].kind != BLOCK_MODES)
            continue;
        if (use->own == NULL)
            use->own = bf_alloc(n * n, sizeof(double));
        dense_gemm(false, false, n, n, n, 1.0, s->M, s->modes, 0.0, P); /* M Φ */
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n; i++)
                Q[i + j * n] = P[i + j * n] * s->omega_rad[j];
        dense_gemm(false, true, n, n, n, 1.0, Q, P, 0.0, use->own);
        use->B = use->own;
        add_scaled(n, use->value[OF_DAMPING], use->B, s->C);
    }
    free(P);
}

static enum bf_status undamped_modes(struct system *s, struct bf_error *err)
{
    double *values = s->omega_rad;
    if (dense_symmetric_eigen(s->n, s->K, s->M, values, s->modes, err) != BF_OK)
        return bf_fail(err, BF_NUMERIC,
                       "the mass matrix is not positive definite at these parameters; check rho and added masses");
    for (size_t i = 0; i < s->n; i++)
        values[i] = values[i] > 0.0 ? sqrt(values[i]) : 0.0;
    return BF_OK;
}

enum bf_status system_evaluate(struct system *s, const double theta[], const bool want[], struct bf_error *err)
{
    size_t n = s->n;
    for (size_t i = 0; i < s->map->n; i++)
        if (!isfinite(theta[i]) && want != NULL && want[i])
            return bf_fail(err, BF_NUMERIC, "a parameter is not a finite number");
    memset(s->M, 0, n * n * sizeof(double));
    memset(s->C, 0, n * n * sizeof(double));
    memset(s->K, 0, n * n * sizeof(double));
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        struct block_use *use = &s->use[b];
        enum bf_status status = use_block(s, &s->reduced->blocks[b], theta, use, err);
        if (status != BF_OK)
            return status;
        if (s->reduced->blocks[b].kind == BLOCK_MODES)
            continue;
        add_scaled(n, use->value[OF_MASS], use->B, s->M);
        add_scaled(n, use->value[OF_DAMPING], use->B, s->C);
        add_scaled(n, use->value[OF_STIFFNESS], use->B, s->K);
    }
    enum bf_status status = undamped_modes(s, err);
    if (status == BF_OK)
        assemble_modal_damping(s);
    if (status == BF_OK)
        status = poles_compute(s, err);
    if (status == BF_OK && want != NULL)
        status = poles_differentiate(s, want, err);
    return status;
}

bool system_memory(const struct system *s, size_t b, double *E, double *relaxation_s, const double **B)
{
    const struct block_use *use = &s->use[b];
    *E = use->value[OF_MEMORY];
    *relaxation_s = use->value[OF_RELAXATION];
    *B = use->B;
    return *E < 0.0 || *E > 0.0;
}

/* The leading block of ΦᵀBΦ, times scale, added to D[n × n]. */
static void add_modal(size_t n, size_t n_modes, const double shape[], double scale, const double B[], double D[])
{
    double *work = bf_alloc(n, sizeof *work);
    for (size_t l = 0; l < n_modes; l++) {
        const double *right = shape + l * n;
        for (size_t i = 0; i < n; i++) {
            work[i] = 0.0;
            for (size_t j = 0; j < n; j++)
                work[i] += B[i + j * n] * right[j];
        }
        for (size_t k = 0; k < n_modes; k++) {
            double sum = 0.0;
            for (size_t i = 0; i < n; i++)
                sum += shape[k * n + i] * work[i];
            D[k + l * n_modes] += scale * sum;
        }
    }
    free(work);
}

bool system_modal_change(const struct system *s, size_t n_modes, const double shape[], size_t parameter, double *D[3])
{
    static const int power[3] = {OF_MASS, OF_DAMPING, OF_STIFFNESS};
    bool acts = false;
    for (int k = 0; k < 3; k++)
        memset(D[k], 0, n_modes * n_modes * sizeof(double));
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        const struct block_use *use = &s->use[b];
        if (use->position == parameter)
            return false;
        for (size_t i = 0; i < use->n_dependencies; i++) {
            const double *d = use->dependency[i].d;
            if (use->dependency[i].parameter != parameter || use->B == NULL)
                continue;
            if (d[OF_MEMORY] < 0.0 || d[OF_MEMORY] > 0.0 || d[OF_RELAXATION] < 0.0 || d[OF_RELAXATION] > 0.0)
                return false;
            for (int k = 0; k < 3; k++) {
                if (d[power[k]] < 0.0 || d[power[k]] > 0.0) {
                    add_modal(s->n, n_modes, shape, d[power[k]], use->B, D[k]);
                    acts = true;
                }
            }
        }
    }
    return acts;
}

void system_dynamic_stiffness(const struct system *s, double complex at, double complex A[])
{
    memset(A, 0, s->n * s->n * sizeof *A);
    for (size_t b = 0; b < s->reduced->n_blocks; b++) {
        double complex a = block_coefficient(s->use[b].value, at);
        for (size_t i = 0; i < s->n * s->n; i++)
            A[i] += a * s->use[b].B[i];
    }
}
