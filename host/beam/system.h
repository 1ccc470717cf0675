/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * system.h — the reduced model at one parameter vector: M, C, K, memory terms, its poles and their derivatives.
 *
 * A(s) = s²M + sC + K + Σ E τs/(1+τs) B is complex symmetric, so
 *     A(s)⁻¹ = Σ_k φ_k φ_kᵀ/(s − p_k),   φ_kᵀ A'(p_k) φ_k = 1   (all poles, conjugates included),
 * and a change δA(s) moves them by
 *     δp_k = −W_kk(p_k),   δ(cᵀφ_k) = −Σ_{j≠k} cᵀφ_j W_jk(p_k)/(p_k − p_j) − ½ cᵀφ_k W'_kk(p_k),   W_jk = φ_jᵀ δA φ_k.
 */
#ifndef BEAMFIT_SYSTEM_H
#define BEAMFIT_SYSTEM_H

#include <complex.h>
#include "reduced.h"

/* Where each thing stands in the parameter vector of model_parameters(). */
struct parameter_map {
    size_t n, n_records;
    size_t *EI, *rho, *cDI; /* [materials] */
    size_t gamma, Ks, KB;
    size_t *residual; /* [n_residuals] */
    size_t *effect;   /* [n_records][n_effects][BEAM_EFFECT_PARAMETERS]; record 0 for shared parameters */
    size_t n_effects;
};

struct parameter_map parameter_map_new(const struct model *model, const struct parameter_ref refs[], size_t n,
                                       size_t n_records);
void parameter_map_free(struct parameter_map *map);
/* The parameters of effect e in record r, gathered in catalogue order. */
void parameter_map_effect(const struct parameter_map *map, size_t record, size_t effect, const double theta[],
                          double p[BEAM_EFFECT_PARAMETERS]);
static inline size_t parameter_map_slot(const struct parameter_map *map, size_t record, size_t effect, int slot)
{
    return map->effect[(record * map->n_effects + effect) * BEAM_EFFECT_PARAMETERS + (size_t)slot];
}

struct pole_derivative {
    double complex *p; /* [n_poles] δp_k */
    double complex *Z; /* [n_all × n_poles], column-major: δ(cᵀφ_k) = −Σ_j (cᵀφ_j) Z(j, k) */
};

struct system {
    const struct model *model;
    const struct reduced *reduced;
    const struct parameter_map *map;
    size_t n;
    double *M, *C, *K; /* [n × n], effects included */
    double *omega_rad; /* [n] undamped circular frequencies, ascending */
    double *modes;     /* [n × n] undamped modes, M-orthonormal columns */
    size_t n_poles;    /* one of each conjugate pair (Im > 0), then the real ones */
    size_t n_pairs;
    size_t n_all;        /* 2 n_pairs + reals: order of Z's rows: pairs, reals, conjugates of the pairs */
    double complex *p;   /* [n_poles] */
    double complex *phi; /* [n × n_poles] */
    /* The whole space may move by one number d (the patch's shift); set before system_evaluate(), NULL: it does not. */
    double *const *block_by_shift;      /* [n_blocks][n × n] dB/dd of every block, not owned */
    const double *shift_by;             /* [map->n] dd/d parameter, not owned */
    struct pole_derivative *derivative; /* [map->n]; members NULL where not asked */
    struct system_work *work;
};

enum bf_status system_new(const struct model *model, const struct reduced *reduced, const struct parameter_map *map,
                          struct system **out, struct bf_error *err);
void system_free(struct system *system);

/* Evaluate at theta[map->n]; derivatives for the parameters with want[i] (NULL: none). O(n³). */
enum bf_status system_evaluate(struct system *system, const double theta[], const bool want[], struct bf_error *err);

/* alpha[n_poles] = gᵀφ_k, and its derivative by parameter i (system_evaluate() must have been asked for it). */
void system_functional(const struct system *system, const double g[], double complex alpha[]);
void system_functional_derivative(const struct system *system, size_t i, const double complex alpha[],
                                  double complex d_alpha[]);

/* The memory E τs/(1 + τs) B of block b at the last evaluation, *B[n × n]; false when the block has none. */
bool system_memory(const struct system *s, size_t b, double *E, double *relaxation_s, const double **B);

/* A(at) assembled, [n × n], for checks and direct solves. */
void system_dynamic_stiffness(const struct system *s, double complex at, double complex A[]);

#endif
