/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * truth_internal.h — what the simulator's files share.
 *
 * State x = [p (modes), v (modes), internal states]; modal coordinates q of mass-normalised modes, p_j = s_j q_j with
 * s_j = max(ω_j, 1 rad/s), v = q̇:   ẋ = A x + B u + (laws),   matrices row-major.
 */
#ifndef TRUTH_INTERNAL_H
#define TRUTH_INTERNAL_H

#include "truth.h"

#include <complex.h>

#define TRUTH_PI 3.14159265358979323846

enum truth_effect_kind {
    TRUTH_TIP_MASS,
    TRUTH_POINT_MASS,
    TRUTH_ROOT_COMPLIANCE,
    TRUTH_POINT_SPRING,
    TRUTH_POINT_DAMPER,
    TRUTH_AXIAL_LOAD,
    TRUTH_ROTARY_INERTIA,
    TRUTH_PATCH_POSITION,
    TRUTH_INPUT_POSITION,
    TRUTH_ELECTRICAL_COUPLING,
    TRUTH_SQUARE_ROOT_DAMPING,
    TRUTH_HYSTERETIC_DAMPING,
    TRUTH_VISCOELASTIC,
    TRUTH_QUADRATIC_DRAG,
    TRUTH_CUBIC_STIFFNESS,
    TRUTH_PATCH_SOFTENING,
    TRUTH_COULOMB_FRICTION,
    TRUTH_MICROSLIP,
    TRUTH_BILINEAR_STIFFNESS,
    TRUTH_LARGE_ROTATION,
    TRUTH_STOP_CONTACT,
    TRUTH_SENSOR_HIGHPASS,
    TRUTH_SENSOR_LAG,
    TRUTH_SENSOR_DELAY,
    TRUTH_SENSOR_SATURATION,
    TRUTH_SENSOR_OFFSET,
    TRUTH_FEEDTHROUGH,
    TRUTH_DRIVE_HYSTERESIS,
    TRUTH_DRIVE_SATURATION,
    TRUTH_CLOCK_ERROR,
    TRUTH_MAINS_HUM,
    TRUTH_BASE_MOTION,
    TRUTH_ATTACHED_RESONATOR,
    TRUTH_THERMAL_DRIFT,
    /* not in beamfit's catalogue */
    TRUTH_QUINTIC_SPRING,
    TRUTH_TIP_MAGNET,
    TRUTH_DRIVE_DEAD_ZONE,
    TRUTH_DELAYED_FEEDBACK,
    TRUTH_SENSOR_QUADRATIC,
    TRUTH_STIFFNESS_STEP,
    TRUTH_EFFECT_KINDS
};

/* Arrays of zeros; never NULL. */
double *truth_array(size_t n);
int truth_fail(char message[TRUTH_MESSAGE], const char *format, ...) __attribute__((format(printf, 2, 3)));

/* --- effects -------------------------------------------------------------------------------------------------- */
const struct truth_effect *truth_effect_find(const struct truth_spec *spec, enum truth_effect_kind kind);
/* Where an effect sits (its at_m; the free end when that is NaN); false: it has no place. */
bool truth_effect_place(const struct truth_spec *spec, const struct truth_effect *effect, double *at_m);
bool truth_effects_nonlinear(const struct truth_spec *spec);

/* --- finite elements ------------------------------------------------------------------------------------------ */
struct truth_mesh {
    size_t n_elements, n_dof;                          /* unknowns: (y, y') of each node */
    double *x_m;                                       /* [n_elements + 1] */
    double *EI, *rho, *cDI, *rho_gyration2, *in_patch; /* [n_elements] */
    double patch_from_m, patch_to_m;
};

void truth_mesh_make(const struct truth_spec *spec, struct truth_mesh *mesh);
void truth_mesh_free(struct truth_mesh *mesh);
/* matrix += scale ∫ weight φ_i^(d) φ_j^(d) dx; weight NULL is 1. matrix [n_dof²], weight [n_elements]. */
void truth_mesh_integrate(const struct truth_mesh *mesh, int derivative, const double *weight, double scale,
                          double *matrix);
/* row [n_dof]: φ^(d)(x) */
void truth_mesh_row(const struct truth_mesh *mesh, double x_m, int derivative, double *row);

/* Full matrices and what turns them into modal ones. */
struct truth_assembly {
    struct truth_mesh mesh;
    size_t n, kept;    /* unknowns; unknowns that the supports leave */
    double *M, *C, *K; /* [n²] */
    bool *fixed;       /* [n] */
    double *shape;     /* mass-normalised modes [n × n_modes], zero where fixed */
    size_t n_modes;
};

enum { TRUTH_STATIC = 2 + 2 * TRUTH_PORTS + TRUTH_EFFECTS, TRUTH_MODES = 400 + TRUTH_STATIC };

/* spec: a copy of the caller's; effects that move the geometry are carried out on it. omega_radps: n_modes filled. */
int truth_assembly_make(struct truth_spec *spec, struct truth_assembly *fe, double omega_radps[TRUTH_MODES],
                        char message[TRUTH_MESSAGE]);
/* Fills shape, n_modes and omega_radps of assembled matrices: spec.modes modes and the static vectors. */
int truth_basis_make(struct truth_assembly *fe, const struct truth_spec *spec, double *omega_radps,
                     char message[TRUTH_MESSAGE]);
void truth_assembly_free(struct truth_assembly *fe);
/* Φᵀ X Φ and the same of ∫ weight φ^(d) φ^(d): [n_modes²], the caller frees. */
double *truth_assembly_project(const struct truth_assembly *fe, const double *X);
double *truth_assembly_integral(const struct truth_assembly *fe, int derivative, const double *weight);
/* out [n_modes] += factor φ^(d)(x), and += factor (φ'(to) − φ'(from)) */
void truth_assembly_row(const struct truth_assembly *fe, double x_m, int derivative, double factor, double *out);
void truth_assembly_slope_difference(const struct truth_assembly *fe, double from_m, double to_m, double factor,
                                     double *out);

/* --- curves --------------------------------------------------------------------------------------------------- */
enum { TRUTH_TANH, TRUTH_ROOT, TRUTH_ARCTANGENT, TRUTH_CLIP }; /* x/√(1 + x²), 2/π atan(πx/2), cut at ±1 */
double truth_curve(double curve, double x);

/* --- linear algebra (the one file that sees LAPACKE and CBLAS) ------------------------------------------------ */
/* Lowest `count` of K φ = ω² M φ, φᵀ M φ = 1; shape [n × count]. K semi-definite is allowed. */
int truth_normal_modes(size_t n, const double *K, const double *M, size_t count, double *omega_radps, double *shape,
                       char message[TRUTH_MESSAGE]);
/* A = V diag(λ) W, W = V⁻¹; V, W [n × n] row-major. */
int truth_diagonalise(size_t n, const double *A, double complex *lambda, double complex *V, double complex *W,
                      char message[TRUTH_MESSAGE]);
/* y[rows] += A[rows × columns] x */
void truth_multiply_add(size_t rows, size_t columns, const double *A, const double *x, double *y);
/* y[columns] += Aᵀ x[rows] */
void truth_multiply_add_transposed(size_t rows, size_t columns, const double *A, const double *x, double *y);
/* Solves S x = b in place, S symmetric positive definite [n²], destroyed. */
int truth_solve_spd(size_t n, double *S, double *b);

/* --- the system ----------------------------------------------------------------------------------------------- */
struct truth_law {
    enum truth_effect_kind kind;
    double *row; /* [n_modes]: w = row·q, the force acts back through the same row */
    double p[TRUTH_PARAMETERS];
    size_t state; /* of microslip */
};

struct truth_output {
    enum truth_port_kind kind;
    double *row; /* [n_modes] */
};

struct truth_system {
    size_t n_modes, n_states, n_inputs; /* inputs of the spec, then the base acceleration */
    bool held[TRUTH_PORTS + 1];         /* an input that jumps between samples: its value inside a fine step counts */
    double *omega, *scale, *A, *B;
    double *damping; /* modal C, [n_modes²] */
    double *in_base; /* modal load of the base acceleration, [n_modes] */
    size_t n_outputs;
    struct truth_output output[TRUTH_PORTS];
    size_t n_laws;
    struct truth_law law[TRUTH_EFFECTS];
    double *K_bending; /* modal ⟨EI φ'', φ''⟩ [n_modes²], when the stiffness changes with time */
    double drift_ps, settling_s; /* EI(t) = EI (1 + drift τ (1 − e^(−t/τ)) + step H(t − step_at)), τ → ∞ unless bent */
    double step, step_at_s;
    /* quadrature over the span: two Gauss points an element */
    size_t n_points;
    double *weight, *EI_point, *rho_point, *Y, *dY, *ddY; /* rows [n_points × n_modes] */
    double drag, drag_power, rotation;
    double base_amplitude_mps2, base_phase_rad, base_radps;
};

int truth_system_make(const struct truth_spec *spec, struct truth_system *system, char message[TRUTH_MESSAGE]);
void truth_system_free(struct truth_system *system);
/* All outputs at one time from x and ẋ, base motion included. */
void truth_system_observe(const struct truth_system *system, double t_s, const double *x, const double *xdot,
                          double *y);

/* --- time ----------------------------------------------------------------------------------------------------- */
/* The fine grid t_i = t0 + i dt begins before 0 (the beam rests there) and ends after the record, so that the
 * zero-phase filter sees no edge. Inputs are held on the doubled grid t0 + i dt/2. */
struct truth_grid {
    double t0_s, dt_s;
    size_t n, oversampling, lead; /* fine samples; lead = index of t = 0 */
    size_t n_record;              /* samples of the whole record, before keep_from_s is cut */
};

void truth_grid_make(const struct truth_spec *spec, struct truth_grid *grid);
/* x [2 grid.n − 1] += the signal */
void truth_signal_add(const struct truth_signal *signal, const struct truth_spec *spec, const struct truth_grid *grid,
                      double *x);
/* What the drive amplifier and the patch make of the voltage, in place; x [n]. The state, zeros at first, goes from
 * call to call. */
struct truth_drive {
    double z[TRUTH_EFFECTS], before[TRUTH_EFFECTS]; /* of each effect of the spec */
};
void truth_drive_distort(const struct truth_spec *spec, struct truth_drive *drive, size_t n, double *x);
/* u[k]: [2 grid.n − 1] for each system input; y[k]: [grid.n] for each output, filled from grid.lead on */
int truth_solve_linear(const struct truth_system *system, const struct truth_grid *grid, double *const *u,
                       double *const *y, char message[TRUTH_MESSAGE]);
/* A complex mode over a step h: z₊ = step z + Σ begin u(0) + middle u(h/2) + end u(h), y = Re Σ out z + D u. */
struct truth_mode {
    double complex step; /* e^{λh} */
    double complex begin[TRUTH_PORTS + 1], middle[TRUTH_PORTS + 1], end[TRUTH_PORTS + 1];
    double complex out[TRUTH_PORTS];
};
/* One of each conjugate pair; mode [n_states], D [n_outputs × n_inputs]. The number of modes, 0 on failure. */
size_t truth_modes_make(const struct truth_system *system, double h, struct truth_mode *mode, double *D,
                        char message[TRUTH_MESSAGE]);
int truth_solve_ode(const struct truth_system *system, const struct truth_spec *spec, const struct truth_grid *grid,
                    double *const *u, double *const *y, char message[TRUTH_MESSAGE]);
/* CVODE from rest, fed with inputs that are constant from tick to tick. No delayed feedback. */
struct truth_ode;
struct truth_ode *truth_ode_new(const struct truth_system *system, const struct truth_spec *spec,
                                char message[TRUTH_MESSAGE]);
/* Inputs of the spec from now on, u [n_inputs − 1]. */
int truth_ode_hold(struct truth_ode *ode, const double *u);
/* To t_s; y [n_outputs] */
int truth_ode_advance(struct truth_ode *ode, double t_s, double *y);
void truth_ode_free(struct truth_ode *ode);
/* ẋ of laws and time-varying terms, added; delayed [laws]: ẇ(t − d) of the delayed feedback; sliding [laws]. */
void truth_laws_add(const struct truth_system *system, double t_s, const double *x, const double *delayed,
                    const int *sliding, double *xdot);
/* J [n_states²] += ∂ẋ/∂x of the local laws. Drag, rotation and slow stiffness are left out: Newton does without. */
void truth_laws_tangent(const struct truth_system *system, const double *x, const int *sliding, double *J);

/* --- measurement ---------------------------------------------------------------------------------------------- */
/* Sensor and line effects of one output on the fine grid, in the spec's order. drive: nominal voltage or NULL. */
void truth_chain_apply(const struct truth_spec *spec, size_t output, const struct truth_grid *grid, const double *drive,
                       double *y);
/* The same, one fine sample after the other; a link of each effect, zeros at first. Not for a delay, which looks ahead. */
struct truth_link {
    double v, before;
};
double truth_link_step(const struct truth_effect *effect, struct truth_link *link, double dt_s, double t_s,
                       double drive, double w);
/* One second-order section of a Butterworth low-pass; corner / rate of the calls, pole angle θ: s² + 2 sinθ s + 1. */
struct truth_section {
    double b, a1, a2, s1, s2;
};
enum { TRUTH_SECTIONS = 10 };
/* Sections of the spec's filter; returns their number. */
size_t truth_filter_make(const struct truth_spec *spec, size_t oversampling,
                         struct truth_section section[TRUTH_SECTIONS]);
double truth_section_step(struct truth_section *section, double in);
/* Anti-alias filter in place, then every oversampling-th sample from t = 0: record [grid.n_record]. */
void truth_acquire(const struct truth_spec *spec, const struct truth_grid *grid, double *fine, double *record);

/* --- random numbers: xoshiro256++ seeded by splitmix64 --------------------------------------------------------- */
struct truth_random {
    uint64_t s[4];
    double spare;
    bool has_spare;
};

void truth_random_seed(struct truth_random *random, uint64_t seed, uint64_t stream);
double truth_random_uniform(struct truth_random *random); /* [0, 1) */
double truth_random_normal(struct truth_random *random);  /* mean 0, variance 1 */
/* n_k = a1 n_{k−1} + a2 n_{k−2} + e_k, e of variance 1, n of the deviation that begin() works out */
struct truth_noise {
    struct truth_random *random;
    double a1, a2, deviation, before, earlier;
};
void truth_noise_begin(struct truth_noise *noise, const double ar[2], struct truth_random *random);
double truth_noise_next(struct truth_noise *noise);

#endif
