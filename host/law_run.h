/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * law_run.h — stepping the nonlinear forces of one record; shared by law_coordinates.c (the laws of a model), law_run.c
 * (setting up a record), law_step.c (the steps), law_output.c (what they do to the outputs), law_derivative*.c (their
 * derivatives), predict_law.c (all records) and nobody else.
 *
 * Unknowns are the forces f on the contact coordinates w = Gᵀx, on a grid of `oversample` steps a sample:
 *     w = w_lin + Σ_k Re(α_k q_k) + far,   q_k' = p_k q_k − Σ_c α_kc f_c,   f = law(w, w')
 * w_lin is the band-limited linear response to the inputs; q_k is stepped exactly with f held to first order; poles far
 * above the grid act through their static compliance. Each step solves f = law(w_free + S_w f, v_free + S_v f).
 */
#ifndef BEAMFIT_LAW_RUN_H
#define BEAMFIT_LAW_RUN_H

#include "law.h"
#include "predict_work.h"

enum { MOST_COORDINATES = 24 };

struct law_run {
    const struct run *run;
    size_t record;
    const struct record_plan *plan;
    const struct response_grid *grid;
    bool uses_w; /* some force depends on a coordinate itself, now or a step ago */
    size_t D, N; /* coordinates; steps */
    int oversample;
    double h_s;
    size_t n_dynamic;
    size_t *pole;           /* [n_dynamic] index into the system's poles */
    double *multiplicity;   /* [n_dynamic] 2 for a pair, 1 for a real pole */
    double complex *alpha;  /* [D][n_dynamic] */
    struct pole_step *step; /* [n_dynamic] */
    double far[MOST_COORDINATES * MOST_COORDINATES];
    double S_w[MOST_COORDINATES * MOST_COORDINATES], S_v[MOST_COORDINATES * MOST_COORDINATES];
    double *w_lin, *v_lin; /* [D][N] */
    double *f;             /* [N][D] */
    size_t failed_steps;
    /* kept for derivatives, when asked: */
    double complex *q;                   /* [N][n_dynamic] */
    double *T_w, *T_v, *T_old, *inverse; /* [N][D × D] */
    double *f_p;                         /* [N][dependencies of all laws][LAW_COORDINATES] */
    struct law_force *state;             /* [N] of the law with internal states, else NULL */
    size_t n_dependencies;
};

/* Coordinates of law e start at this row of D. */
size_t law_first_coordinate(const struct predictor *p, size_t effect);
/* First of law e's entries in f_p. */
size_t law_first_dependency(const struct predictor *p, size_t effect);

/* The coordinates' functionals and their derivatives at the parameters of the run; point laws follow their places. */
enum bf_status law_coordinates_evaluate(const struct run *run, struct bf_error *err);

/* run, record, plan and grid are set by the caller; to be freed with law_run_free() whether it fails or not. */
enum bf_status law_run_new(struct law_run *l, struct bf_error *err);
void law_run_free(struct law_run *l);
/* Forces of every step, with what the derivatives need when the run wants a Jacobian. */
enum bf_status law_run_march(struct law_run *l, struct bf_error *err);
/* Adds what the forces do to the record's rows of y and of the Jacobian. */
enum bf_status law_run_outputs(const struct law_run *l, struct bf_error *err);

/* Bins 0 … m−1 of a spectrum to N samples at the oversampled rate, and back. */
enum bf_status law_upsample(const struct law_run *l, const double complex W[], double out[], struct bf_error *err);
enum bf_status law_transform(const struct law_run *l, const double f[], size_t stride, double complex F[],
                             struct bf_error *err);

/* Adds the derivatives of the outputs to the Jacobian; F: [D][m] transforms of f. */
enum bf_status law_derivatives(const struct law_run *l, const double complex F[], struct bf_error *err);
/* Adds gain · F_o · Y to a row (y or a column) of a channel. */
enum bf_status law_add_output(const struct law_run *l, const struct predict_channel *channel, double scale,
                              const double complex filter[], const double complex Y[], double row[],
                              struct bf_error *err);

#endif
