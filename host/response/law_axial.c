/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_axial.h"

#include <stdint.h>
#include <stdlib.h>

#include "maths/maths.h"

/* Points evaluated together. */
enum { POINTS = 64 };

/* For one block of points. */
struct axial_block {
    size_t first, count; /* points; count is a multiple of the vectors' length */
    double Gw[LAW_COORDINATES][POINTS], Gv[LAW_COORDINATES][POINTS], Ga[LAW_COORDINATES][POINTS];
    double pull[POINTS];                  /* −u_tt = v·G v + a·G w */
    double inertia[POINTS];               /* κ ρ dx (−u_tt) */
    double left[LAW_COORDINATES][POINTS]; /* κ ρ dx G w */
};

/* out_i = Σ_j G_ij x_j at the points of a block. */
VECTOR_INLINE void multiply(const struct law *law, const struct axial_block *b, const double x[], double out[][POINTS])
{
    for (size_t i = 0; i < law->d; i++) {
        const double *G = law->shortening + i * law->d * law->stride + b->first;
        for (size_t q = 0; q < b->count; q += VECTOR_LENGTH) {
            vector_real sum = {0.0}, value;
            for (size_t j = 0; j < law->d; j++) {
                vector_load(&value, G + j * law->stride + q);
                sum += x[j] * value;
            }
            vector_store(out[i] + q, &sum);
        }
    }
}

VECTOR_INLINE void fill_block(const struct law_prepared *prepared, const struct law_motion *motion, double kappa,
                              struct axial_block *b)
{
    const struct law *law = prepared->law;
    multiply(law, b, motion->w, b->Gw);
    multiply(law, b, motion->v, b->Gv);
    for (size_t q = 0; q < b->count; q += VECTOR_LENGTH) {
        vector_real sum = {0.0}, Gw, Gv, mass;
        for (size_t i = 0; i < law->d; i++) {
            vector_load(&Gw, b->Gw[i] + q);
            vector_load(&Gv, b->Gv[i] + q);
            sum += motion->v[i] * Gv + motion->a[i] * Gw;
        }
        vector_store(b->pull + q, &sum);
        vector_load(&mass, prepared->mass + b->first + q);
        sum *= kappa * mass;
        vector_store(b->inertia + q, &sum);
    }
}

/* by_w += Σ κ ρ dx (−u_tt G + G w (G a)ᵀ), by_v += Σ κ ρ dx G w 2 (G v)ᵀ, by_a += Σ κ ρ dx G w (G w)ᵀ */
VECTOR_INLINE void add_tangents(const struct law_prepared *prepared, const struct law_motion *motion, double kappa,
                                struct axial_block *b, struct law_force *out)
{
    const struct law *law = prepared->law;
    size_t d = law->d;
    multiply(law, b, motion->a, b->Ga);
    for (size_t i = 0; i < d; i++) {
        for (size_t q = 0; q < b->count; q += VECTOR_LENGTH) {
            vector_real x, mass;
            vector_load(&x, b->Gw[i] + q);
            vector_load(&mass, prepared->mass + b->first + q);
            x *= kappa * mass;
            vector_store(b->left[i] + q, &x);
        }
        for (size_t j = 0; j < d; j++) {
            const double *G = law->shortening + (i * d + j) * law->stride + b->first;
            out->by_w[i * d + j] += vector_dot(b->count, b->inertia, G) + vector_dot(b->count, b->left[i], b->Ga[j]);
            out->by_v[i * d + j] += 2.0 * vector_dot(b->count, b->left[i], b->Gv[j]);
            out->by_a[i * d + j] += vector_dot(b->count, b->left[i], b->Gw[j]);
        }
    }
}

/* By κ's parameters and by ρ. */
static void add_derivatives(const struct law_prepared *prepared, const struct beam_sample_output *kappa,
                            const struct axial_block *b, struct law_force *out)
{
    const struct law *law = prepared->law;
    for (size_t q = 0; q < b->count && b->first + q < law->n_points; q++) {
        size_t point = b->first + q;
        for (size_t i = 0; i < law->d; i++) {
            double force = b->pull[q] * b->Gw[i][q];
            for (int s = 0; s < law->effect->n_parameters; s++)
                if (prepared->slot[s] != SIZE_MAX)
                    out->by_parameter[prepared->slot[s]][i] += kappa->y_p[s] * prepared->mass[point] * force;
            if (prepared->by_mass[point] != SIZE_MAX)
                out->by_parameter[prepared->by_mass[point]][i] += kappa->y * law->quadrature[point] * force;
        }
    }
}

VECTOR_CLONES int law_axial_add(const struct law_prepared *prepared, const struct law_motion *motion, bool tangents,
                                bool derivatives, struct law_force *out)
{
    const struct law *law = prepared->law;
    struct beam_sample_output kappa = {0};
    struct axial_block b;
    if (law->effect->axial_inertia(prepared->p, &kappa) != 0)
        return -1;
    for (b.first = 0; b.first < law->n_points; b.first += POINTS) {
        size_t left = law->stride - b.first;
        b.count = left < POINTS ? left : POINTS;
        fill_block(prepared, motion, kappa.y, &b);
        for (size_t i = 0; i < law->d; i++)
            out->f[i] += vector_dot(b.count, b.inertia, b.Gw[i]);
        if (tangents)
            add_tangents(prepared, motion, kappa.y, &b, out);
        if (derivatives)
            add_derivatives(prepared, &kappa, &b, out);
    }
    return 0;
}
