/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * reduced.h — a small Galerkin space that is exact in the band: the fine model's lowest modes at given parameters, the
 * static responses to every input, output and effect place, and their first dynamic corrections K⁻¹M K⁻¹g.
 * Every parameter-free matrix is projected once; the reduced M, C, K stay linear in the parameters, and an evaluation
 * away from the parameters of the base is in error of second order in the distance.
 */
#ifndef BEAMFIT_REDUCED_H
#define BEAMFIT_REDUCED_H

#include "fine.h"
#include "model/model.h"

/* What a block is multiplied by, in the order of struct beam_coefficients. */
enum { COEFFICIENTS = 5, OF_MASS = 0, OF_DAMPING, OF_STIFFNESS, OF_MEMORY, OF_RELAXATION };

enum block_kind {
    BLOCK_MASS,      /* ∫ yφ over a material:   M += ρ,  C += γ */
    BLOCK_STIFFNESS, /* ∫ y″φ″ over a material: K += EI, C += cDI */
    BLOCK_FORM,      /* an effect's form over one material (weight × coefficients of the term) */
    BLOCK_PLACE,     /* an effect's functional: rank one, g gᵀ */
    BLOCK_MODES      /* X with X M⁻¹ X = K: not linear, computed at each evaluation */
};

struct block {
    enum block_kind kind;
    size_t material;     /* BLOCK_MASS, BLOCK_STIFFNESS, BLOCK_FORM */
    size_t effect, term; /* the others */
    double *B;           /* [n × n] symmetric; for BLOCK_PLACE at the place of the base; NULL for BLOCK_MODES */
};

struct reduced {
    struct fine_space space;
    size_t n;
    double *V;             /* [space.n × n], columns orthonormal in M at the base */
    size_t n_modes;        /* leading columns that are modes */
    double *frequency_rad; /* [n_modes] undamped circular frequencies at the base */
    size_t n_blocks;
    struct block *blocks;
    bool uniform; /* knots are not on the region edges */
};

struct reduced_options {
    size_t n_splines; /* 0: 160 */
    double top_rad;   /* modes below this circular frequency are taken (at least min_modes) */
    size_t min_modes, max_modes;
    int statics;  /* 0: modes only; 1: static responses too; 2: and their first dynamic corrections */
    bool uniform; /* equidistant knots, not on the region edges */
    size_t limit; /* dimension at most; 0: no limit */
};

/* Effect parameters of the base: p[effect][slot]; material etc. are taken from the model. */
enum bf_status reduced_new(const struct model *model, const struct reduced_options *options, struct reduced *out,
                           struct bf_error *err);
void reduced_free(struct reduced *reduced);

/* g[n] = Vᵀ D^k φ(at): the k-th derivative of the deflection at a point, as a functional on the reduced space. */
void reduced_point(const struct reduced *reduced, int derivative, double at_m, double g[]);
/* The functional of an effect's place (BEAM_AT_*), and its derivative by at_m (both [n]). */
void reduced_place(const struct reduced *reduced, const struct beam_operator *place, const struct model *model,
                   double g[], double g_at[]);
/* Functionals of the model's channels, [n]; gains (Ks, KB) not included. */
void reduced_input(const struct reduced *reduced, const struct model_input *input, double g[]);
void reduced_output(const struct reduced *reduced, const struct model_output *output, double g[]);

/* L[n] = Vᵀ ∫ φ dx over a material. */
void reduced_load(const struct reduced *reduced, const struct model *model, size_t material, double L[]);

/*
 * The same vectors on a beam whose region edges have moved: the knots of every region are stretched along with it and all
 * blocks projected anew, so that everything is a smooth function of the edges. `from_model` is the model of `from`.
 */
enum bf_status reduced_move(const struct reduced *from, const struct model *from_model, const struct model *to_model,
                            struct reduced *out, struct bf_error *err);

/* The term `term` of effect `e` at the model's parameters. */
enum bf_status effect_terms(const struct model *model, size_t e, struct beam_term out[BEAM_EFFECT_TERMS],
                            struct bf_error *err);

#endif
