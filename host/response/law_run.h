/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_run.h — stepping the nonlinear forces of one record; shared by law_run.c (setting up a record),
 * law_motion.c (its linear motion, transforms), law_step*.c (the steps), law_output.c (what they do to the outputs),
 * law_derivative*.c (their derivatives), predict_law.c (all records) and nobody else.
 *
 * Unknowns are the forces f on the contact coordinates w = Gᵀx, on a grid of `oversample` steps a sample:
 *     w = w_lin + Σ_k Re(α_k q_k) + far,   q_k' = p_k q_k − Σ_c α_kc f_c,   f = law(w, w', w″)
 * w_lin is the band-limited linear response to the inputs; q_k is stepped exactly with f a polynomial through its last
 * samples (law_hold.h); poles far above the grid act through their static compliance, but on dry friction (law_run.c). Each step solves
 * f = law(w_free + S_w f, v_free + S_v f, a_free + S_a f). Accelerations a = w″ = a_lin + Σ_k Re(α_k p_k (p_k q_k − Σ_c α_kc f_c))
 * are followed where a law has inertia of its own (law_axial.h), else every member of theirs is NULL or 0.
 *
 * From an unknown initial state w_lin also has the free motion of its modes, and there were forces before the first sample and
 * there are some after the last. Forces that begin or end in a step would ring through the band-limited way to the outputs, so
 * the steps begin `lead` before the record and go on `lead` past it, with forces that are faded in and out there; in modes of
 * the band what they did before is part of the unknown state.
 */
#ifndef BEAMFIT_LAW_RUN_H
#define BEAMFIT_LAW_RUN_H

#include "response.h"
#include "law.h"
#include "law_hold.h"
#include "modal_system.h"

enum { MOST_COORDINATES = 24 };

/* Rows of P numbers: P poles, the last ones zero so that P is a multiple of the vectors' length. */
struct law_row {
    double *re, *im;
};

/* What one step does to the internal states of a law; see struct law_force. */
struct law_memory {
    double by_z[BEAM_LAW_STATES];
    double z_by_w[BEAM_LAW_STATES], z_by_v[BEAM_LAW_STATES], z_by_w_old[BEAM_LAW_STATES];
    double z_by_z[BEAM_LAW_STATES][BEAM_LAW_STATES], z_by_parameter[BEAM_LAW_STATES][LAW_DEPENDENCIES];
};

struct law_run {
    const struct modal_system *system;
    size_t n_laws;
    const struct law_prepared *laws; /* [n_laws] at the run's parameters, in the order of their coordinates */
    int oversample;                  /* steps a sample; 0: as the laws ask for */
    const struct response_grid *grid;
    bool uses_w;  /* some force depends on a coordinate itself, now or a step ago */
    bool uses_v;  /* on its rate */
    bool uses_a;  /* on its acceleration */
    size_t D, N;  /* coordinates; steps */
    size_t lead;  /* of them before the record's first sample, and as many after its last; 0: it begins at rest */
    double *fade; /* [N] factor of the forces; NULL: 1 */
    size_t held;  /* samples of f that a step uses: HOLD_LINE or HOLD_CUBIC */
    double h_s;
    double *growth; /* [N] e^(σt) */
    size_t n_dynamic, P;
    size_t *pole;                 /* [n_dynamic] index into the system's poles */
    double *multiplicity;         /* [n_dynamic] 2 for a pair, 1 for a real pole */
    struct law_hold *hold;        /* [n_dynamic] */
    struct law_row p, e;          /* [P] poles, e^(ph) */
    struct law_row g[HOLD_CUBIC]; /* [P] */
    struct law_row alpha;         /* [D][P] */
    struct law_row to_w, to_v;    /* [D][P] w = Re(to_w q): α twice for a pair; v = Re(to_v q): the same times p */
    struct law_row to_a;          /* [D][P] the same times p² */
    double *rows;                 /* owns the above */
    double far[MOST_COORDINATES * MOST_COORDINATES];
    double S_w[MOST_COORDINATES * MOST_COORDINATES], S_v[MOST_COORDINATES * MOST_COORDINATES];
    double S_a[MOST_COORDINATES * MOST_COORDINATES];
    double *w_lin, *v_lin, *a_lin; /* [D][N] */
    double *f;                     /* [N][D] */
    size_t failed_steps;
    double complex *F; /* [D][m] transforms of f, made by law_run_outputs() */
    /* kept for derivatives, when asked: */
    struct law_row q;                    /* [N][P] */
    double *T_w, *T_v, *T_old, *inverse; /* [N][D × D] */
    double *T_a;                         /* [N][D × D] */
    bool has_T_w, has_T_v;               /* forces depend on w, now or a step ago; on v */
    double *f_p;                         /* [N][dependencies of all laws][LAW_COORDINATES] */
    struct law_memory *state;            /* [N][n_laws] when a law has internal states, else NULL */
    size_t n_dependencies;
};

/* system, laws and oversample are set by the caller; to be freed with law_run_free() whether it fails or not. */
enum bf_status law_run_new(struct law_run *l, struct bf_error *err);
void law_run_free(struct law_run *l);
/* Forces of every step, with what the derivatives need when the run wants a Jacobian. */
enum bf_status law_run_march(struct law_run *l, struct bf_error *err);
/* Adds what the forces do to the record's rows of y, and what the chain's parameters do about it to the Jacobian. */
enum bf_status law_run_outputs(struct law_run *l, struct bf_error *err);
/* Adds the other derivatives, those of the forces, to the Jacobian; after law_run_outputs(). */
enum bf_status law_run_derivatives(const struct law_run *l, struct bf_error *err);

/* Does anybody ask for derivatives? */
static inline bool law_run_differentiates(const struct law_run *l)
{
    return l->system->parameters != NULL || l->system->n_states > 0;
}

/*
 * law_state.c, the free motion of a record's initial state: out[N] += the order-th time derivative of coordinate c in it; its
 * derivative by a parameter, false when that is zero; and by one of the 2 n_states unknowns.
 */
void law_state_add(const struct law_run *l, size_t c, int order, double out[]);
bool law_state_derivative_add(const struct law_run *l, size_t c, int order, size_t parameter, double out[]);
void law_state_column_add(const struct law_run *l, size_t c, int order, size_t unknown, double out[]);

/* w_lin, v_lin and a_lin of every coordinate. */
enum bf_status law_linear_motion(struct law_run *l, struct bf_error *err);
/* The motion of coordinate c on the record's shaken clamp, at the steps. */
struct clamp_question law_clamp(const struct law_run *l, size_t c, int order);
/* Bins 0 … m−1 of a spectrum to N samples at the oversampled rate, and back. */
enum bf_status law_upsample(const struct law_run *l, const double complex W[], double out[], struct bf_error *err);
enum bf_status law_transform(const struct law_run *l, const double f[], size_t stride, double complex F[],
                             struct bf_error *err);

/* Adds scale · filter · Y to rows of an output (y or a column), behind the recorder's filter. */
enum bf_status law_add_output(const struct law_run *l, double scale, const double complex filter[],
                              const double complex Y[], double row[], struct bf_error *err);

#endif
