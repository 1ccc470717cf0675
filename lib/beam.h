/* SPDX-License-Identifier: MIT */
/*
 * beam.h — a beam in ten dimensions, one bounded step a sample; this header is the manual.
 *
 *     M ÿ + C ẏ + K y + (memory) + Σ g f(gᵀy, gᵀẏ, z, t) = Σ b u(t),   outputs cᵀy, cᵀẏ, cᵀÿ        (paper eq. 5)
 *
 *     struct beam_description d = {...};      what is known: parameters, channels, effects
 *     struct beam_model model;                matrices; may also be filled from outside (a host's reduced space)
 *     struct beam_plan plan;                  everything one step needs, and nothing else
 *     struct beam_state state;                what changes from step to step
 *
 *     beam_assemble(&d, &model);
 *     beam_factor(&model, &options, &work, &plan);          once
 *     beam_reset(&plan, &state);
 *     for (;;) beam_step(&plan, &state, u, y);              once a sample
 *
 * Memory: the caller owns every struct; nothing is allocated, global, recursive or printed. Sizes are fixed below.
 * Reentrancy: a function touches only what it is given; one plan may serve any number of states.
 * Two builds of one source: beam_* is double, beamf_* is float; both link into one program (see beam_real.h). The
 * names below are always written beam_*.
 * Accuracy: a plan made in float is as good as float poles (about 1e-6 of a frequency). For the target make the plan
 * in double, call beam_narrow() and copy counts and numbers: then float steps keep frequency and decay to 1e-11.
 * Time: beam_factor() is bounded but not real-time code (milliseconds on a PC); beam_step() costs are in
 * docs/library.md. Without laws, a step has no data-dependent branch.
 */
#ifndef BEAM_H
#define BEAM_H

#include <stdint.h>
#include "beam_effect.h"
#include "beam_language.h"

BEAM_C_BEGIN

/* ---- Sizes; those with #ifndef may be set by -D, alike for every file of a program ---- */

/* BEAM_TARGET: what a controller carries, first-order or zero-order hold only; symbols are beamt_*. */
#ifdef BEAM_TARGET
#define BEAM_INPUTS  1
#define BEAM_OUTPUTS 1
#define BEAM_BASE    0 /* no motion of the clamp: an image carries none */
#define BEAM_TAPS    64
#define BEAM_HISTORY 64
#else
#define BEAM_BASE    1
#define BEAM_INPUTS  2 /* commanded inputs; the motion of the clamp is a further, inner one */
#define BEAM_OUTPUTS 4
#endif
#ifndef BEAM_PORTS
#define BEAM_PORTS 8 /* coordinates on which laws act: one per point law, 8 for a law over the span */
#endif
#ifndef BEAM_TAPS
#define BEAM_TAPS 1280 /* pool of filter taps of the band-limited hold: (2L − 1) × inputs × (outputs + 2 ports) */
#endif
#ifndef BEAM_HISTORY
#define BEAM_HISTORY 512 /* pool of remembered samples: 2L per input, delay + 2L per filter, latency per output */
#endif
#if BEAM_PORTS < 1 || BEAM_PORTS > 64
#error "BEAM_PORTS must be 1..64"
#endif
#if BEAM_TAPS < 64 || BEAM_HISTORY < 64
#error "BEAM_TAPS and BEAM_HISTORY must be at least 64"
#endif

enum {
    BEAM_N = 10,                                   /* dimension of the Galerkin space */
    BEAM_USES = 8,                                 /* effects in one model */
    BEAM_CHAIN = 4,                                /* measurement-chain effects on one output */
    BEAM_MEMORIES = 2,                             /* Maxwell branches */
    BEAM_MEMORY_STATES = 12,                       /* their ranks together */
    BEAM_BLOCKS = BEAM_N + BEAM_MEMORY_STATES / 2, /* 2 × 2 blocks of the step */
    BEAM_STATES = 2 * BEAM_BLOCKS,
    BEAM_ALL_INPUTS = BEAM_INPUTS + BEAM_BASE,
    BEAM_ROWS = BEAM_OUTPUTS + 2 * BEAM_PORTS, /* outputs, then displacement and rate of each port */
    BEAM_HALF_WIDTH = 24                       /* largest L of the band-limited hold */
};

/* ---- Errors: negative, grouped by who must act ---- */

enum beam_status {
    BEAM_OK = 0,
    /* the program that calls */
    BEAM_ERROR_ARGUMENT = -1, /* a count, kind or index outside its range */
    BEAM_ERROR_INTERVAL = -2, /* dt_s not positive and finite */
    BEAM_ERROR_CAPACITY = -3, /* more ports, taps, states or history than the sizes above */
    BEAM_ERROR_EFFECT = -4,   /* unknown effect id, or no effect */
    BEAM_ERROR_NEEDS_HOST =
        -5, /* an effect that changes the space (root, geometry, a coordinate of its own): a reduced model is needed */
    /* the owner of the model */
    BEAM_ERROR_NOT_FINITE = -20,   /* NaN or infinity in parameters or matrices */
    BEAM_ERROR_PARAMETER = -21,    /* EI, ρ ≤ 0 or cDI, γ < 0 */
    BEAM_ERROR_EFFECT_RANGE = -22, /* an effect's parameter outside its physical range */
    BEAM_ERROR_PLACE = -23,        /* a position outside the beam */
    BEAM_ERROR_ASYMMETRIC = -24,   /* M, C, K or a memory form is not symmetric */
    BEAM_ERROR_MASS = -25,         /* M is not positive definite */
    BEAM_ERROR_STIFFNESS = -26,    /* K is not positive semidefinite */
    BEAM_ERROR_MEMORY = -27,       /* a memory form is not positive semidefinite, or its τ ≤ 0 */
    BEAM_ERROR_UNSTABLE = -28,     /* a pole in the right half plane: the damping feeds energy in */
    BEAM_ERROR_DEFECTIVE = -29,    /* poles coincide without independent shapes: change the damping a little */
    BEAM_ERROR_FILTER = -30,       /* an output filter that is improper, unstable or looks ahead */
    BEAM_ERROR_PLAN = -31,         /* a received plan: counts out of range, not finite, or unstable */
    /* the device, while running */
    BEAM_ERROR_SOLVE = -40, /* the law equations did not converge in this step; outputs are the best found */
    BEAM_ERROR_STATE = -41  /* the state is no longer finite: reset */
};

enum beam_actor { BEAM_ACTOR_NOBODY, BEAM_ACTOR_CALLER, BEAM_ACTOR_MODEL, BEAM_ACTOR_DEVICE };

#define beam_status_text  BEAM_NAME(status_text)
#define beam_status_actor BEAM_NAME(status_actor)
const char *beam_status_text(enum beam_status status); /* one English clause with the remedy; never NULL */
enum beam_actor beam_status_actor(enum beam_status status);

/* ---- 1. Describe: parameters, channels, effects of the built-in geometry ---- */

/* Cubic B-splines with φ(0) = φ'(0) = 0 over the geometry of tools/galerkin_tables.c. */
enum beam_basis {
    BEAM_BASIS_UNIFORM, /* the paper's: equidistant knots, C²; modes 1, 2 off by +0.51 %, +0.30 % */
    BEAM_BASIS_PATCH    /* double knots at the patch edges (C¹ there); +0.0008 %, +0.026 %, mode 4 +0.84 % */
};

struct beam_parameters {
    beam_real EI_beam_Nm2, EI_patch_Nm2;     /* > 0 */
    beam_real rho_beam_kgpm, rho_patch_kgpm; /* > 0 */
    beam_real cDI_beam_sNm2, cDI_patch_sNm2; /* ≥ 0 */
    beam_real gamma_sNpm2;                   /* ≥ 0 */
    beam_real Ks_V;                          /* patch sensor: volt per radian of slope difference */
    beam_real KB_NmpV;                       /* patch actuator: newton metre per volt */
};

enum beam_input_kind { BEAM_INPUT_POINT_FORCE, BEAM_INPUT_PATCH_MOMENT };
enum beam_output_kind {
    BEAM_OUTPUT_DISPLACEMENT,
    BEAM_OUTPUT_VELOCITY,
    BEAM_OUTPUT_ACCELERATION, /* absolute: the clamp's acceleration is added */
    BEAM_OUTPUT_PATCH_STRAIN
};

/* One effect in use; its parameters in the order of effect->parameters. */
struct beam_use {
    const struct beam_effect *effect;
    unsigned channels; /* bit i: it sits on channel i (output, or input of a drive); 0: the effect's default channels */
    beam_real p[BEAM_EFFECT_PARAMETERS];
};

struct beam_description {
    enum beam_basis basis;
    struct beam_parameters parameters;
    int n_inputs, n_outputs, n_uses;
    struct {
        enum beam_input_kind kind;
        beam_real at_m; /* of a point force, in [0, length] */
    } input[BEAM_INPUTS];
    struct {
        enum beam_output_kind kind;
        beam_real at_m; /* not of a patch strain */
    } output[BEAM_OUTPUTS];
    struct beam_use use[BEAM_USES];
};

/* ---- 2. Model: matrices of the ten-dimensional space ---- */

struct beam_memory {
    beam_real relaxation_s;         /* τ */
    beam_real form[BEAM_N][BEAM_N]; /* E X of the force E τs/(1 + τs) X y, symmetric positive semidefinite */
};

/* One coordinate w = gᵀy of a law. The ports of one point stand together, in the order of the law's w[]. */
struct beam_port {
    int use;                  /* index of the effect whose law acts here */
    int coordinate;           /* 0 begins a point */
    beam_real weight;         /* quadrature weight × weight(x); 1 for a point law */
    beam_real vector[BEAM_N]; /* g */
};

/*
 * Filled by beam_assemble(), or from outside in any basis: the coordinates never leave the library. Linear terms of
 * effects must already be inside M, C, K and memory; `use` lists every effect with a law, drive, base, filter, map or
 * signal (others are ignored there). Units: vectors of inputs turn a command into a generalised force, vectors of
 * outputs turn coordinates into the channel's unit (K_s included).
 */
struct beam_model {
    beam_real M[BEAM_N][BEAM_N], C[BEAM_N][BEAM_N], K[BEAM_N][BEAM_N];
    int n_memories, n_inputs, n_outputs, n_ports, n_uses;
    struct beam_memory memory[BEAM_MEMORIES];
    struct {
        enum beam_input_kind kind;
        beam_real vector[BEAM_N];
    } input[BEAM_INPUTS];
    struct {
        enum beam_output_kind kind;
        beam_real vector[BEAM_N];
    } output[BEAM_OUTPUTS];
    beam_real base_load[BEAM_N]; /* −∫ρφ: generalised force per m/s² of the clamp */
    struct beam_port port[BEAM_PORTS];
    struct beam_use use[BEAM_USES];
};

#define beam_effect_find BEAM_NAME(effect_find)
#define beam_shape       BEAM_NAME(shape)
#define beam_length      BEAM_NAME(length)
#define beam_assemble    BEAM_NAME(assemble)
#define beam_model_check BEAM_NAME(model_check)

const struct beam_effect *beam_effect_find(const char *id); /* NULL when unknown */

/* out[i] = φᵢ, φᵢ' or φᵢ″ at x_m; derivative 0..2. ARGUMENT, PLACE. */
enum beam_status beam_shape(enum beam_basis basis, beam_real x_m, int derivative, beam_real out[BEAM_N]);
beam_real beam_length(void); /* m, of the built-in geometry */

/*
 * M = Σ ρ_r M_r, K = Σ EI_r K_r, C = γ G + Σ cDI_r K_r, then the effects' terms. ARGUMENT, EFFECT, NEEDS_HOST, CAPACITY,
 * NOT_FINITE, PARAMETER, EFFECT_RANGE, PLACE; BEAM_OVER_MODES terms also MASS, STIFFNESS.
 */
enum beam_status beam_assemble(const struct beam_description *description, struct beam_model *out);

/* Counts, finiteness, symmetry to rounding. (Definiteness is checked by beam_factor(), which needs it.) */
enum beam_status beam_model_check(const struct beam_model *model);

/* ---- 3. Factor: poles, and everything a step needs ---- */

/* What an input does between its samples. Laws' forces are always taken linear between samples. */
enum beam_hold {
    BEAM_HOLD_FIRST_ORDER, /* linear; no latency; a band-limited signal at f is off by about (π f/f_s)²/3 */
    BEAM_HOLD_ZERO_ORDER,  /* held, as after a D/A converter; no latency */
    BEAM_HOLD_BAND_LIMITED /* Kaiser-windowed sinc over ±L samples, flat to 0.4 f_s; latency L − 1 samples */
};

struct beam_options {
    beam_real dt_s;      /* sample interval, > 0 */
    enum beam_hold hold; /* 0: first order */
    int half_width;      /* L of the band-limited hold, 4..BEAM_HALF_WIDTH; 0: 20; errors in docs/library.md */
    int law_evaluations; /* of all laws in one step, at most; 0: 16 (2 or 3 are usual) */
};

/*
 * Poles p and shapes of s²M + sC + K + Σ Eτs/(1 + τs)X, scaled so that
 *     (…)⁻¹ = Σ sign φφᵀ/(s − p)      over all poles, a complex one also with its conjugate.
 * Complex poles come first (imaginary part > 0, ascending), then real ones (ascending). Shapes are in the model's basis.
 */
struct beam_poles {
    int n_complex, n_real;
    beam_real re[BEAM_STATES], im[BEAM_STATES]; /* 1/s */
    beam_real sign[BEAM_STATES];
    beam_real shape_re[BEAM_STATES][BEAM_N], shape_im[BEAM_STATES][BEAM_N];
};

/* Undamped modes K ψ = ω² M ψ, ascending: column j of shape is mode j with ψᵀMψ = 1; ω = 0 of a free beam's motions. */
struct beam_modes {
    beam_real omega_radps[BEAM_N];
    beam_real shape[BEAM_N][BEAM_N];
};

/* Scratch of beam_factor(); its poles may be read afterwards. 33 kB in double, 17 kB in float: keep it off small stacks. */
struct beam_work {
    struct beam_poles poles;
    struct beam_modes modes;
    beam_real damping[BEAM_N][BEAM_N]; /* modal C */
    int n_memory_states;
    beam_real memory_rate[BEAM_MEMORY_STATES]; /* 1/τ of each internal state */
    beam_real memory_vector[BEAM_MEMORY_STATES]
                           [BEAM_N]; /* its modal coupling, √(E/τ) times a column of the form's root */
    beam_real a[BEAM_STATES][BEAM_STATES], b[BEAM_STATES][BEAM_STATES], c[BEAM_STATES][BEAM_STATES];
};

/* Of anything in a plan, and places in its pools: two bytes, because a controller keeps two plans. */
typedef int16_t beam_count;

/* A ring of remembered samples inside the pool. */
struct beam_ring {
    beam_count offset, length;
};

/* One measurement-chain effect on one output. */
struct beam_link {
    beam_count use;         /* index into the plan's use[] */
    beam_count tap, n_taps; /* a filter's taps in the pool; n_taps 0: a map or signal */
    beam_count wait;        /* samples that a long delay waits beyond the taps */
    beam_count latency;     /* samples by which the link's output is late, from the input sample */
    struct beam_ring ring;
};

/* The plan as two flat arrays and the effects, so that it can be sent: every member of numbers is a beam_real, ... */
struct beam_plan_numbers {
    beam_real dt_s;
    beam_real phi[BEAM_BLOCKS][4];                 /* Φ − 1 of each 2 × 2 block, by rows */
    beam_real gamma[BEAM_ALL_INPUTS][BEAM_STATES]; /* state per input sample */
    beam_real gamma_port[BEAM_PORTS][BEAM_STATES]; /* state per law force of the last step */
    beam_real row[BEAM_ROWS][BEAM_STATES];
    beam_real compliance[BEAM_ROWS][BEAM_PORTS]; /* row per law force of this step: Gᵀ S⁻¹ G */
    beam_real weight[BEAM_PORTS];
    beam_real base_gain[BEAM_OUTPUTS];            /* 1 for an absolute acceleration */
    beam_real link_phi[BEAM_OUTPUTS][BEAM_CHAIN]; /* a filter's own pole, Φ − 1 */
    beam_real link_gamma[BEAM_OUTPUTS][BEAM_CHAIN];
    beam_real taps[BEAM_TAPS]; /* direct response, [row][input][tap], newest sample first */
};

/* ... and every member of counts is a beam_count. */
struct beam_plan_counts {
    beam_count n_blocks, n_inputs, n_outputs, n_ports, n_uses;
    beam_count base_use;     /* effect that moves the clamp, or −1; it is then input n_inputs */
    beam_count drive_input;  /* first patch_moment input, for maps; −1: none */
    beam_count n_taps;       /* of an input: 2L − 1 */
    beam_count beam_latency; /* L − 1 */
    beam_count latency;      /* of every y: y belongs to the sample `latency` steps before u */
    beam_count law_evaluations;
    beam_count port_use[BEAM_PORTS], port_coordinate[BEAM_PORTS];
    struct beam_ring input_ring[BEAM_ALL_INPUTS], command_ring, output_ring[BEAM_OUTPUTS];
    beam_count n_links[BEAM_OUTPUTS];
    struct beam_link link[BEAM_OUTPUTS][BEAM_CHAIN];
};

enum {
    BEAM_PLAN_NUMBERS = sizeof(struct beam_plan_numbers) / sizeof(beam_real),
    BEAM_PLAN_COUNTS = sizeof(struct beam_plan_counts) / sizeof(beam_count)
};

struct beam_plan {
    struct beam_plan_counts n;
    struct beam_plan_numbers x;
    struct beam_use use[BEAM_USES]; /* channels resolved */
};

#define beam_factor     BEAM_NAME(factor)
#define beam_find_poles BEAM_NAME(find_poles)
#define beam_find_modes BEAM_NAME(find_modes)
#define beam_plan_check BEAM_NAME(plan_check)
#define beam_narrow     BEAM_NAME(narrow)
#define beam_step_bound BEAM_NAME(step_bound)

/* Bounded (Cholesky, Jacobi ≤ 40 sweeps); about 3 kB of stack in double. MASS, STIFFNESS. */
enum beam_status beam_find_modes(const struct beam_model *model, struct beam_modes *out);

/*
 * Poles of the model into work->poles, modes into work->modes. Bounded: Jacobi, QR with ≤ 30
 * iterations a pole, ≤ 12 Newton steps a pole. Errors of the model's group, ARGUMENT, CAPACITY.
 */
enum beam_status beam_find_poles(const struct beam_model *model, struct beam_work *work);

/* beam_find_poles(), then the exact step for this interval and hold. Also INTERVAL, CAPACITY, EFFECT_RANGE, FILTER. */
enum beam_status beam_factor(const struct beam_model *model, const struct beam_options *options, struct beam_work *work,
                             struct beam_plan *out);

/* Is a received plan safe to run: counts in range, numbers finite, no block grows. Cost: one pass over the plan. */
enum beam_status beam_plan_check(const struct beam_plan *plan);

/*
 * Instructions of one beam_step() on a Cortex-M4F (the float build, -O2), at most: blocks, rows, taps, links, and every law
 * with all its evaluations. From counts and effects alone; the plan must have passed beam_plan_check(), or come from
 * beam_factor(). beam_bound.c has the terms, make target NAMES=costs measures them.
 */
uint32_t beam_step_bound(const struct beam_plan *plan);

#ifndef BEAM_FLOAT
/*
 * Make every number of the plan representable in 24 bits. Of the many equal descriptions of each block the one is
 * taken whose rounded eigenvalues are exact to about 1e-11, so that float steps neither drift nor grow.
 */
enum beam_status beam_narrow(struct beam_plan *plan);
#endif

/* ---- 4. Step ---- */

struct beam_state {
    uint32_t k; /* steps since reset; time is k dt_s */
    beam_real x[BEAM_STATES];
    beam_real force[BEAM_PORTS]; /* law forces at the last step */
    beam_real w_old[BEAM_PORTS]; /* law coordinates at the last step */
    beam_real z[BEAM_PORTS][BEAM_LAW_STATES];
    beam_real u_old[BEAM_INPUTS][BEAM_USES]; /* what each drive saw at the last step */
    beam_real drive_z[BEAM_INPUTS][BEAM_USES][BEAM_DRIVE_STATES];
    beam_real u_last[BEAM_ALL_INPUTS];
    beam_real link_x[BEAM_OUTPUTS][BEAM_CHAIN];
    beam_count input_at[BEAM_ALL_INPUTS], command_at, output_at[BEAM_OUTPUTS], link_at[BEAM_OUTPUTS][BEAM_CHAIN];
    beam_real history[BEAM_HISTORY];
};

#define beam_reset BEAM_NAME(reset)
#define beam_start BEAM_NAME(start)
#define beam_step  BEAM_NAME(step)

/* Rest at time 0, all inputs 0 before it. */
void beam_reset(const struct beam_plan *plan, struct beam_state *state);

/*
 * beam_reset(), then free motion from displacement y0 and rate v0 in the model's basis, relaxed memory. work: as
 * beam_factor() left it for this model; the plan must not be narrowed.
 */
void beam_start(const struct beam_model *model, const struct beam_work *work, const struct beam_plan *plan,
                const beam_real y0[BEAM_N], const beam_real v0[BEAM_N], struct beam_state *state);

/*
 * One sample: u[0 .. n_inputs−1] now, y[0 .. n_outputs−1] belonging to the sample plan->n.latency steps before.
 * Cost: docs/library.md. SOLVE, STATE, EFFECT_RANGE; y is written in every case.
 */
enum beam_status beam_step(const struct beam_plan *plan, struct beam_state *state, const beam_real u[], beam_real y[]);

BEAM_C_END

#endif /* BEAM_H */
