/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * beam.h — from a model and a parameter vector θ to matrices and poles: a fine spline model, a small space that is projected
 * from it once, and in that space the system of every θ with its poles and their derivatives. Also the modes of a model.
 *
 * Order of calls:
 *   reduced_new()        once for a model; reduced_point(), reduced_input(), reduced_output() give functionals on its space
 *   parameter_map_new()  once: where each parameter stands in θ
 *   system_new()         once, then system_evaluate() for every θ; system_functional() gives residues of what it found
 *   system_free(), parameter_map_free(), reduced_free()
 *   modes_compute()      does all of this for the values of a model
 */
#ifndef BEAMFIT_BEAM_H
#define BEAMFIT_BEAM_H

#include <complex.h>

#include "maths/maths.h"
#include "model/model.h"

/*
 * FINE — Galerkin spaces of cubic splines, by default with double knots (y″ may jump there) on every region edge and on the
 * ends of the short span of a law at a crack. Essential boundary conditions are imposed by leaving basis functions out.
 * Matrices are symmetric and banded (half bandwidth 3). Only reduced_new() makes such a space.
 */

struct fine_space {
    struct spline spline;
    struct spline_values *gauss; /* [4 · spline.n] at the points of quadrature; of knots i to i + 1 from 4 i on */
    size_t lead, trail;          /* functions left out at either end */
    size_t n;                    /* degrees of freedom */
    double length_m;
};

/*
 * REDUCED — a small Galerkin space that is exact in the band: the fine model's lowest modes at given parameters, the
 * static responses to every input, output and effect place, and their first dynamic corrections K⁻¹M K⁻¹g.
 * Every parameter-free matrix is projected once; the reduced M, C, K stay linear in the parameters, and an evaluation
 * away from the parameters of the base is in error of second order in the distance.
 */

/* What a block is multiplied by, in the order of struct beam_coefficients. */
enum { COEFFICIENTS = 5, OF_MASS = 0, OF_DAMPING, OF_STIFFNESS, OF_MEMORY, OF_RELAXATION };

enum block_kind {
    BLOCK_MASS,      /* ∫ yφ over a material:   M += ρ,  C += γ */
    BLOCK_STIFFNESS, /* ∫ y″φ″ over a material: K += EI, C += cDI */
    BLOCK_FORM,      /* an effect's form over one material (weight × coefficients of the term) */
    BLOCK_PLACE,     /* an effect's functional: rank one, g gᵀ */
    BLOCK_SENSOR,    /* the mass of an output's sensor at its place: rank one, M += m */
    BLOCK_MODES      /* X with X M⁻¹ X = K: not linear, computed at each evaluation */
};

struct block {
    enum block_kind kind;
    size_t material;     /* BLOCK_MASS, BLOCK_STIFFNESS, BLOCK_FORM */
    size_t output;       /* BLOCK_SENSOR */
    size_t effect, term; /* the others */
    double *B;           /* [n × n] symmetric; for BLOCK_PLACE at the place of the base; NULL for BLOCK_MODES */
};

struct reduced {
    struct fine_space space;
    size_t n;
    size_t n_own;          /* the last coordinates, those of effects beside the beam; part of n */
    double *V;             /* [space.n × n], columns orthonormal in M at the base; 0 for coordinates beside the beam */
    size_t n_modes;        /* leading columns that are modes */
    double *frequency_rad; /* [n_modes] undamped circular frequencies at the base */
    size_t n_blocks;
    struct block *blocks;
    bool uniform; /* knots are equidistant, not on the region edges */
};

struct reduced_options {
    size_t n_splines; /* 0: 160 */
    double top_rad;   /* modes below this circular frequency are taken (at least min_modes) */
    size_t min_modes, max_modes;
    int statics;  /* 0: modes only; 1: static responses too; 2: first dynamic corrections of these too */
    bool uniform; /* equidistant knots, not on the region edges */
    size_t limit; /* dimension at most, coordinates beside the beam included; 0: no limit */
};

/*
 * The base is the model with its own values, those of its effects included. BF_NUMERIC: an effect's parameter is out of its
 * range, or the stiffness is not positive definite. Free with reduced_free(); after a failure there is nothing to free.
 */
enum bf_status reduced_new(const struct model *model, const struct reduced_options *options, struct reduced *out,
                           struct bf_error *err);
void reduced_free(struct reduced *reduced);

/* g[n] = Vᵀ D^k φ(at): the k-th derivative of the deflection at a point, as a functional on the reduced space. */
void reduced_point(const struct reduced *reduced, int derivative, double at_m, double g[]);

/* The functional of a place on the beam (BEAM_AT_*), and its derivative by at_m (both [n]). */
void reduced_place(const struct reduced *reduced, const struct beam_operator *place, const struct model *model,
                   double g[], double g_at[]);

/* The same of a place of effect `effect`, whose own coordinate may be part of it. */
void reduced_effect_place(const struct reduced *reduced, const struct beam_operator *place, const struct model *model,
                          size_t effect, double g[], double g_at[]);

/* The effect hangs something on the beam that has a coordinate of its own. */
bool effect_has_own(const struct beam_effect *effect);
/* Coordinates of their own that the effects before `effect` have: where its own stands among them. */
size_t own_index(const struct model *model, size_t effect);

/* Functionals of the model's channels, [n]; gains (Ks, KB) not included. */
void reduced_input(const struct reduced *reduced, const struct model_input *input, double g[]);
void reduced_output(const struct reduced *reduced, const struct model_output *output, double g[]);

/* L[n] = Vᵀ ∫ φ dx over a material. */
void reduced_load(const struct reduced *reduced, const struct model *model, size_t material, double L[]);

/*
 * The same vectors on a beam whose region edges, the free end among them, have moved: the knots of every region are stretched along with it and all
 * blocks projected anew, so that everything is a smooth function of the edges. `from_model` is the model of `from`.
 */
enum bf_status reduced_move(const struct reduced *from, const struct model *from_model, const struct model *to_model,
                            struct reduced *out, struct bf_error *err);

/*
 * SYSTEM — the reduced model at one parameter vector: M, C, K, memory terms, its poles and their derivatives.
 *
 * A(s) = s²M + sC + K + Σ E τs/(1+τs) B is complex symmetric, so
 *     A(s)⁻¹ = Σ_k φ_k φ_kᵀ/(s − p_k),   φ_kᵀ A'(p_k) φ_k = 1   (all poles, conjugates included),
 * and a change δA(s) moves them by
 *     δp_k = −W_kk(p_k),   δ(cᵀφ_k) = −Σ_{j≠k} cᵀφ_j W_jk(p_k)/(p_k − p_j) − ½ cᵀφ_k W'_kk(p_k),   W_jk = φ_jᵀ δA φ_k.
 */

/* Where each parameter stands in the vector of model_parameters(). */
struct parameter_map {
    size_t n, n_records;
    size_t *EI, *rho, *cDI; /* [materials] */
    size_t gamma, Ks, KB;
    size_t *residual;                   /* [n_residuals] */
    size_t *input_place, *input_gain;   /* [n_inputs]; SIZE_MAX where the model holds them */
    size_t *output_place, *output_gain; /* [n_outputs] */
    size_t move[MODEL_MOVES];           /* of the geometry: the length, the edges of the patch; SIZE_MAX likewise */
    size_t *effect; /* [n_records][n_effects][BEAM_EFFECT_PARAMETERS]; record 0 for shared parameters;
                         SIZE_MAX where the effect has no such parameter */
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

struct block_use; /* how a block of the space enters; private */

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
    size_t n_all;        /* 2 n_pairs + reals; rows of Z in this order: pairs, reals, conjugates of the pairs */
    double complex *p;   /* [n_poles] */
    double complex *phi; /* [n × n_poles] */
    size_t *cluster; /* [n_poles] the first of the poles that nearly coincide with it: of a free beam's rigid motions */
    /* The whole space may move by the numbers d of enum model_move, each parameter by one of them; set before system_evaluate(), not owned. */
    double *const *block_by_move[MODEL_MOVES]; /* [n_blocks][n × n] dB/dd of every block; NULL: it does not move */
    const double *move_by;                     /* [map->n][MODEL_MOVES] dd/d parameter */
    struct pole_derivative *derivative;        /* [map->n]; members NULL where not asked */
    struct block_use *use;                     /* [reduced->n_blocks] as of the last evaluation */
};

/* model, reduced and map must outlive the system. BF_NUMERIC: the reduced space is empty. Free with system_free(). */
enum bf_status system_new(const struct model *model, const struct reduced *reduced, const struct parameter_map *map,
                          struct system **out, struct bf_error *err);
void system_free(struct system *system);

/*
 * Evaluates at theta[map->n]; derivatives by the parameters with want[i] (NULL: by none). BF_NUMERIC: a parameter is not finite
 * or out of its range, the mass matrix is not positive definite, or two poles coincide. O(n³); derivatives O(n³) for each block.
 */
enum bf_status system_evaluate(struct system *system, const double theta[], const bool want[], struct bf_error *err);

/* alpha[n_poles] = gᵀφ_k, and its derivative by parameter i (system_evaluate() must have been asked for it). */
void system_functional(const struct system *system, const double g[], double complex alpha[]);
void system_functional_derivative(const struct system *system, size_t i, const double complex alpha[],
                                  double complex d_alpha[]);

/* The memory E τs/(1 + τs) B of block b at the last evaluation, *B[n × n]; false when the block has none. */
bool system_memory(const struct system *s, size_t b, double *E, double *relaxation_s, const double **B);

/*
 * The change of A by parameter i in the modes shape[n_modes][n]: s² D[0] + s D[1] + D[2], each [n_modes × n_modes], column-major;
 * false when the parameter does not act there, or acts through a memory term or a moving place.
 */
bool system_modal_change(const struct system *s, size_t n_modes, const double shape[], size_t i, double *D[3]);

/*
 * MODES — natural frequencies, damping and shapes of a model, and the errors of these in smaller spaces: the one that is put
 * on a controller (10 dimensions: the lowest modes and static responses) and equidistant splines.
 */

struct mode {
    double frequency_Hz; /* |p|/2π of the damped pole */
    double undamped_Hz;
    double damping_ratio;  /* −Re p/|p|; 1 for a mode without oscillation */
    double deployed_error; /* relative error of undamped_Hz in the space that goes on the target; NAN beyond it */
    double uniform_error;  /* the same for 10 equidistant cubic splines (the seed paper's space); NAN beyond them */
};

struct modes {
    size_t n;
    struct mode *mode;
    size_t in_band;                          /* modes that the deployed space must have right */
    size_t deployed_modes, deployed_statics; /* what spans the space that goes on the target: 10 together */
    double convergence; /* largest relative change of the modes' frequencies when the splines are doubled */
    size_t n_points;
    double *x_m;   /* [n_points] from 0 to the beam's length */
    double *shape; /* [n][n_points], largest value 1 */
};

/*
 * n_modes lowest modes at the values of the model; band_Hz: modes up to this are 'in band' (0: as many as the deployed space
 * has modes). Free with modes_free(); after a failure there is nothing to free.
 */
enum bf_status modes_compute(const struct model *model, size_t n_modes, double band_Hz, size_t n_points,
                             struct modes *out, struct bf_error *err);
void modes_free(struct modes *modes);

/* Undamped frequencies of n_modes modes with n_splines splines; uniform: equidistant knots. NAN beyond what they have. */
enum bf_status modes_frequencies(const struct model *model, size_t n_splines, bool uniform, size_t n_modes,
                                 double frequency_Hz[], struct bf_error *err);
/* How many of frequency_Hz[n], ascending, are motions as a whole of a beam that nothing holds: the first ones, next to zero. */
size_t modes_rigid(const double frequency_Hz[], size_t n);

#endif
