/* SPDX-License-Identifier: GPL-3.0-or-later */
/* beam_case.h — the paper's beam, signals and independent references for the tests of lib/beam_*.c. */
#ifndef BEAM_CASE_H
#define BEAM_CASE_H

#include "beam.h"

enum { CASE_STATES = 2 * BEAM_N, CASE_MAX = 3 * BEAM_INPUTS + CASE_STATES };

/* B1TAPIH of the paper's Table 3, hammer at 2.54 cm and patch drive; patch voltage, accelerometer, tip speed, tip. */
struct beam_description case_description(enum beam_basis basis);

/* The same with an effect of the catalogue, or with an effect of the test's own. */
void case_add_effect(struct beam_description *d, const struct beam_effect *effect, unsigned channels, double p0,
                     double p1, double p2);

/* Model, plan and work of a description; every status must be BEAM_OK. */
struct beam_case {
    struct beam_description description;
    struct beam_model model;
    struct beam_work work;
    struct beam_options options;
    struct beam_plan plan;
    struct beam_state state;
};
void case_build(struct beam_case *c, double dt_s, enum beam_hold hold);

/* n steps; input i is u[i·n + k], output o goes to y[o·n + k]. */
void case_run(struct beam_case *c, int n, const double *u, double *y);

/* out = e^{a}, n × n, row-major, by scaling, Taylor and squaring in long double. */
void case_expm(int n, const long double *a, long double *out);

/* ẋ = A x + B u of the model (memory left out), x = (y, ẏ), by Gauss elimination on M in long double. */
void case_first_order(const struct beam_model *model, long double a[CASE_STATES][CASE_STATES],
                      long double b[CASE_STATES][BEAM_INPUTS]);

/*
 * Exact response to inputs linear between samples (hold 0) or held (hold 1): dense matrix exponential, long double.
 * Layout as case_run; initial state x0 (NULL: rest).
 */
void case_reference(const struct beam_model *model, double dt_s, int held, int n, const double *u, const double *x0,
                    double *y);

/* |a − b| ≤ tolerance, in double (cmocka's own comparison is in float). */
#define assert_close(a, b, tolerance) case_close((a), (b), (tolerance), __FILE__, __LINE__)
void case_close(double a, double b, double tolerance, const char *file, int line);

double case_rms(int n, const double *x);
double case_rms_difference(int n, const double *x, const double *y);

/* A hammer hit whose spectrum is below 1e-6 beyond `band_Hz`: a Gaussian of height 1, centred at t0_s. */
double case_hit(double t_s, double t0_s, double band_Hz);

/* Deterministic numbers, uniform in [−1, 1]. */
double case_random(unsigned *seed);

/* ---- The float library, seen from double: tests/beam_shadow.c compiled with -DBEAM_FLOAT ---- */

/* Runs a double plan's counts and numbers in float. ids: its effects in order (NULL when it has none). 0, or a status. */
int shadow_run(const int counts[], const double numbers[], const char *const ids[], const unsigned channels[],
               const double parameters[], int n_uses, int n, const double *u, double *y);

/* The same in pieces: load a plan without effects and reset, then go on from where the last call stopped. */
int shadow_load(const int counts[], const double numbers[]);
int shadow_continue(int n, const double *u, double *y);

/* n steps under case_hit() on input 0; the last `tail` values of output 0. */
int shadow_hit_tail(const int counts[], const double numbers[], int n, int tail, double dt_s, double t0_s,
                    double band_Hz, double *y);

/* beam_factor() and run in float from the paper's parameters scaled by `damping` in cDI and γ. */
int shadow_factor_run(int basis, int hold, double dt_s, double damping, int n, const double *u, double *y);

/* beam_find_poles() in float of the paper's beam with a memory; frequencies (Hz) of the complex poles. */
int shadow_poles(int basis, double memory_share, double relaxation_s, double frequency_Hz[BEAM_N], int *n_real);

#endif
