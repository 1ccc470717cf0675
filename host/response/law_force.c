/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The force of a law at one instant: motion at its points, the effect's own function there, back by virtual work. */
#include "response.h"
#include "law.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "law_axial.h"
#include "maths/maths.h"

/* Points evaluated together. */
enum { POINTS = 64, WIDTH = BEAM_LAW_WIDTH };

static size_t dependency_index(const struct law *law, size_t parameter)
{
    for (size_t i = 0; i < law->n_dependencies; i++)
        if (law->dependency[i] == parameter)
            return i;
    return SIZE_MAX;
}

/* Quadrature times the material's value of a weight at every point, and where that value stands. */
static void weigh(const struct law *law, const struct parameter_map *map, enum beam_weight weight, const double theta[],
                  double out[], size_t by[])
{
    for (size_t q = 0; q < law->n_points; q++) {
        size_t parameter = law_weight_parameter(map, weight, law->material[q]);
        out[q] = law->quadrature[q] * (parameter == SIZE_MAX ? 1.0 : theta[parameter]);
        by[q] = parameter == SIZE_MAX ? SIZE_MAX : dependency_index(law, parameter);
    }
}

void law_prepare(const struct law *law, const struct parameter_map *map, const double theta[], struct law_prepared *out)
{
    *out = (struct law_prepared){.law = law};
    parameter_map_effect(map, 0, law->effect_index, theta, out->p);
    for (int s = 0; s < BEAM_EFFECT_PARAMETERS; s++) {
        size_t parameter = parameter_map_slot(map, 0, law->effect_index, s);
        out->slot[s] = parameter == SIZE_MAX ? SIZE_MAX : dependency_index(law, parameter);
    }
    out->weight = bf_alloc(law->n_points, sizeof *out->weight);
    out->by_weight = bf_alloc(law->n_points, sizeof *out->by_weight);
    weigh(law, map, law->weight, theta, out->weight, out->by_weight);
    if (law->shortening == NULL)
        return;
    out->mass = bf_alloc(law->stride, sizeof *out->mass);
    out->by_mass = bf_alloc(law->n_points, sizeof *out->by_mass);
    weigh(law, map, BEAM_WEIGHT_RHO, theta, out->mass, out->by_mass);
}

void law_prepared_free(struct law_prepared *prepared)
{
    free(prepared->weight);
    free(prepared->by_weight);
    free(prepared->mass);
    free(prepared->by_mass);
    *prepared = (struct law_prepared){0};
}

/* An effect's answer, and the same as numbers in a row: memset() of it costs more than most laws. */
enum {
    ANSWER_NUMBERS = sizeof(struct beam_law_output) / sizeof(beam_real),
    ANSWER_FORCES = offsetof(struct beam_law_output, z_w) / sizeof(beam_real) /* what a law without states may write */
};
union answer {
    struct beam_law_output o;
    double x[ANSWER_NUMBERS];
};
_Static_assert(sizeof(beam_real) == sizeof(double) && ANSWER_NUMBERS % VECTOR_LENGTH == 0 &&
                   ANSWER_FORCES % VECTOR_LENGTH == 0,
               "an answer is made of whole vectors");

/* The zero is read, so that the compiler does not make a call of memset() of this again. */
VECTOR_INLINE void clear_answer(const struct law_prepared *prepared, union answer *answer)
{
    vector_real zero;
    vector_load(&zero, prepared->zero);
    for (size_t i = 0; i < ANSWER_FORCES; i += VECTOR_LENGTH)
        vector_store(answer->x + i, &zero);
    for (size_t i = ANSWER_FORCES; prepared->law->effect->n_law_states > 0 && i < ANSWER_NUMBERS; i += VECTOR_LENGTH)
        vector_store(answer->x + i, &zero);
}

/* Point by point, for one block of points. */
struct span_block {
    size_t first, count; /* points; count is a multiple of the vectors' length */
    double w[WIDTH][POINTS], v[WIDTH][POINTS], w_old[WIDTH][POINTS];
    double f[WIDTH][POINTS]; /* times the quadrature weight; so are the tangents */
    double by_w[WIDTH][WIDTH][POINTS], by_v[WIDTH][WIDTH][POINTS], by_w_old[WIDTH][WIDTH][POINTS];
};

/* out = Σ_j ψ_j x_j at the points of a block. */
VECTOR_INLINE void spread(const struct law *law, size_t width, const struct span_block *b, const double x[],
                          double out[])
{
    const double *psi = law->psi + width * law->d * law->stride + b->first;
    for (size_t q = 0; q < b->count; q += VECTOR_LENGTH) {
        vector_real sum = {0.0}, value;
        for (size_t j = 0; j < law->d; j++) {
            vector_load(&value, psi + j * law->stride + q);
            sum += x[j] * value;
        }
        vector_store(out + q, &sum);
    }
}

VECTOR_INLINE void block_motion(const struct law *law, const struct law_motion *motion, struct span_block *b)
{
    for (size_t a = 0; a < law->width; a++) {
        if (law->uses_w)
            spread(law, a, b, motion->w, b->w[a]);
        if (law->uses_v)
            spread(law, a, b, motion->v, b->v[a]);
        if (law->uses_w_old)
            spread(law, a, b, motion->w_old, b->w_old[a]);
    }
}

/* Derivatives by the law's own parameters and by the value its weight stands for. */
static void add_derivatives(const struct law_prepared *prepared, size_t q, const struct beam_law_output *o,
                            struct law_force *out)
{
    const struct law *law = prepared->law;
    for (size_t a = 0; a < law->width; a++) {
        for (size_t j = 0; j < law->d; j++) {
            double psi = law->psi[(a * law->d + j) * law->stride + q];
            for (int s = 0; s < law->effect->n_parameters; s++)
                if (prepared->slot[s] != SIZE_MAX)
                    out->by_parameter[prepared->slot[s]][j] += prepared->weight[q] * o->f_p[a][s] * psi;
            if (prepared->by_weight[q] != SIZE_MAX)
                out->by_parameter[prepared->by_weight[q]][j] += law->quadrature[q] * o->f[a] * psi;
        }
    }
}

static void copy_states(const struct law_prepared *prepared, const struct beam_law_output *o, struct law_force *out)
{
    const struct beam_effect *effect = prepared->law->effect;
    for (int k = 0; k < effect->n_law_states; k++) {
        out->z[k] = o->z[k];
        out->by_z[k] = o->f_z[0][k];
        out->z_by_w[k] = o->z_w[k][0];
        out->z_by_v[k] = o->z_v[k][0];
        out->z_by_w_old[k] = o->z_w_old[k][0];
        for (int l = 0; l < effect->n_law_states; l++)
            out->z_by_z[k][l] = o->z_z[k][l];
        for (int s = 0; s < effect->n_parameters; s++)
            if (prepared->slot[s] != SIZE_MAX)
                out->z_by_parameter[k][prepared->slot[s]] = o->z_p[k][s];
    }
}

/* The effect's function at every point of a block. */
VECTOR_INLINE int block_law(const struct law_prepared *prepared, size_t width, struct beam_law_input *in, bool tangents,
                            bool derivatives, struct span_block *b, struct law_force *out)
{
    const struct law *law = prepared->law;
    int n_states = law->effect->n_law_states;
    for (size_t i = 0; i < b->count && b->first + i < law->n_points; i++) {
        _Alignas(64) union answer answer;
        const struct beam_law_output *o = &answer.o;
        clear_answer(prepared, &answer);
        /* what a law uses was filled above: NOLINTBEGIN(clang-analyzer-core.uninitialized.Assign) */
        for (size_t a = 0; a < width; a++) {
            if (law->uses_w)
                in->w[a] = b->w[a][i];
            if (law->uses_v)
                in->v[a] = b->v[a][i];
            if (law->uses_w_old)
                in->w_old[a] = b->w_old[a][i];
        }
        /* NOLINTEND(clang-analyzer-core.uninitialized.Assign) */
        if (law->effect->law(prepared->p, in, &answer.o) != 0)
            return -1;
        double weight = prepared->weight[b->first + i];
        for (size_t a = 0; a < width; a++) {
            b->f[a][i] = weight * o->f[a];
            for (size_t c = 0; tangents && c < width; c++) {
                b->by_w[a][c][i] = weight * o->f_w[a][c];
                b->by_v[a][c][i] = weight * o->f_v[a][c];
                b->by_w_old[a][c][i] = weight * o->f_w_old[a][c];
            }
        }
        if (derivatives)
            add_derivatives(prepared, b->first + i, o, out);
        if (n_states > 0)
            copy_states(prepared, o, out);
    }
    return 0;
}

/* T += Σ_q k_q ψ_a ψ_cᵀ */
VECTOR_INLINE void add_outer(const struct law *law, const struct span_block *b, size_t a, size_t c, const double k[],
                             double T[])
{
    const double *left = law->psi + a * law->d * law->stride + b->first;
    const double *right = law->psi + c * law->d * law->stride + b->first;
    for (size_t j = 0; j < law->d; j++) {
        double scaled[POINTS];
        for (size_t q = 0; q < b->count; q += VECTOR_LENGTH) {
            vector_real x, y;
            vector_load(&x, k + q);
            vector_load(&y, right + j * law->stride + q);
            x *= y;
            vector_store(scaled + q, &x);
        }
        for (size_t i = 0; i < law->d; i++)
            T[i * law->d + j] += vector_dot(b->count, left + i * law->stride, scaled);
    }
}

VECTOR_INLINE void add_block(const struct law *law, const struct span_block *b, bool tangents, struct law_force *out)
{
    for (size_t a = 0; a < law->width; a++) {
        const double *psi = law->psi + a * law->d * law->stride + b->first;
        for (size_t j = 0; j < law->d; j++)
            out->f[j] += vector_dot(b->count, psi + j * law->stride, b->f[a]);
        for (size_t c = 0; tangents && c < law->width; c++) {
            if (law->uses_w)
                add_outer(law, b, a, c, b->by_w[a][c], out->by_w);
            if (law->uses_v)
                add_outer(law, b, a, c, b->by_v[a][c], out->by_v);
            if (law->uses_w_old)
                add_outer(law, b, a, c, b->by_w_old[a][c], out->by_w_old);
        }
    }
}

/* Numbers of the points that fill up the last vector. */
static void clear_padding(const struct law *law, struct span_block *b)
{
    size_t used = law->n_points - b->first < b->count ? law->n_points - b->first : b->count;
    for (size_t a = 0; a < law->width && used < b->count; a++) {
        size_t bytes = (b->count - used) * sizeof(double);
        memset(b->f[a] + used, 0, bytes);
        for (size_t c = 0; c < law->width; c++) {
            memset(b->by_w[a][c] + used, 0, bytes);
            memset(b->by_v[a][c] + used, 0, bytes);
            memset(b->by_w_old[a][c] + used, 0, bytes);
        }
    }
}

/* Everything that a call adds to begins at zero; states of a span law are never written. */
static void clear_force(const struct law *law, bool tangents, bool derivatives, struct law_force *out)
{
    size_t d = law->d;
    for (size_t j = 0; j < d; j++)
        out->f[j] = 0.0;
    for (size_t j = 0; tangents && j < d * d; j++)
        out->by_w[j] = out->by_v[j] = out->by_w_old[j] = 0.0;
    for (size_t j = 0; tangents && law->shortening != NULL && j < d * d; j++)
        out->by_a[j] = 0.0;
    for (size_t i = 0; derivatives && i < law->n_dependencies; i++)
        for (size_t j = 0; j < d; j++)
            out->by_parameter[i][j] = 0.0;
}

static int point_force(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents,
                       bool derivatives, struct law_force *out)
{
    struct beam_law_input in = {.w = {motion->w[0]},
                                .v = {motion->v[0]},
                                .w_old = {motion->w_old[0]},
                                .t_s = motion->t_s,
                                .dt_s = motion->dt_s};
    _Alignas(64) union answer answer;
    const struct beam_law_output *o = &answer.o;
    int n_states = prepared->law->effect->n_law_states;
    clear_answer(prepared, &answer);
    for (int k = 0; k < n_states; k++)
        in.z[k] = motion->z[k];
    if (prepared->law->effect->law(prepared->p, &in, &answer.o) != 0)
        return -1;
    double weight = prepared->weight[0];
    out->f[0] = weight * o->f[0];
    if (tangents) {
        out->by_w[0] = weight * o->f_w[0][0];
        out->by_v[0] = weight * o->f_v[0][0];
        out->by_w_old[0] = weight * o->f_w_old[0][0];
    }
    if (derivatives) {
        for (size_t i = 0; i < prepared->law->n_dependencies; i++)
            out->by_parameter[i][0] = 0.0;
        add_derivatives(prepared, 0, o, out);
    }
    copy_states(prepared, o, out);
    return 0;
}

VECTOR_CLONES static int span_force(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents,
                                    bool derivatives, struct law_force *out)
{
    const struct law *law = prepared->law;
    size_t width = law->width;
    struct beam_law_input in = {.t_s = motion->t_s, .dt_s = motion->dt_s};
    _Alignas(64) struct span_block b;
    clear_force(law, tangents, derivatives, out);
    for (int k = 0; k < law->effect->n_law_states; k++)
        in.z[k] = motion->z[k];
    for (b.first = 0; b.first < law->n_points; b.first += POINTS) {
        size_t left = law->n_points - b.first;
        b.count = left < POINTS ? vector_round(left) : POINTS;
        block_motion(law, motion, &b);
        if (width == 1 ? block_law(prepared, 1, &in, tangents, derivatives, &b, out)
                       : block_law(prepared, WIDTH, &in, tangents, derivatives, &b, out))
            return -1;
        clear_padding(law, &b);
        add_block(law, &b, tangents, out);
    }
    return law->shortening != NULL ? law_axial_add(prepared, motion, tangents, derivatives, out) : 0;
}

int law_force(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents, bool derivatives,
              struct law_force *out)
{
    tangents = tangents || derivatives;
    if (prepared->law->g_at != NULL)
        return point_force(prepared, motion, tangents, derivatives, out);
    return span_force(prepared, motion, tangents, derivatives, out);
}
