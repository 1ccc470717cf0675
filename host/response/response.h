/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * response.h — transfer functions H(s) = s^ν Σ_k α_k β_k/(s − p_k) on a line s = σ + iω of the Laplace plane.
 *
 * A record of n samples is a signal on [0, n·dt); with σ > 0 its transform decays over the zero-padded length, so the
 * discrete transform does not wrap a ringing response around: forward with e^(−σt), multiply by H, back, times e^(σt).
 * Between samples the input is band limited (exact), or held to order zero or one (then 1/(s − p) is replaced by the
 * exact discrete response of the held input).
 */
#ifndef BEAMFIT_RESPONSE_H
#define BEAMFIT_RESPONSE_H

#include <complex.h>
#include "predict.h"
#include "beam/system.h"

struct response_grid {
    size_t n;           /* samples of a record */
    size_t n_tail;      /* input samples after the record that an input may be continued by, see response_tail() */
    size_t n_fft;       /* ≥ 2n and ≥ n + 2 n_tail */
    size_t m;           /* n_fft/2 + 1 points */
    double dt_s, sigma; /* sigma: 1/s */
    enum intersample intersample;
    double complex *s; /* [m] */
    double *weight;    /* [n + n_tail] e^(−σ t) */
};

enum bf_status response_grid_new(size_t n, double dt_s, enum intersample intersample, struct response_grid *out,
                                 struct bf_error *err);
void response_grid_free(struct response_grid *grid);

/* U[m] of x[count] · e^(−σt), zero-padded; count ≤ n + n_tail. */
enum bf_status response_transform(const struct response_grid *grid, const double x[], size_t count, double complex U[],
                                  struct bf_error *err);
/*
 * x[n + n_tail]: an input of `available` ≥ n samples, continued past the record's last one so that it does not end in a
 * step: a step would ring backwards into the record, because between samples the input is band limited. The samples after
 * a window are taken as they are; after the record's end an autoregressive model (Burg) continues it; both fade out.
 */
void response_tail(const struct response_grid *grid, const double u[], size_t available, double x[]);
/* y[n] from Y[m]: inverse transform times e^(σt). */
enum bf_status response_back(const struct response_grid *grid, const double complex Y[], double y[],
                             struct bf_error *err);

/* The partial fractions of a system at its poles, sampled on a grid. */
struct response_kernel;
struct response_kernel *response_kernel_new(const struct system *system, const struct response_grid *grid);
void response_kernel_free(struct response_kernel *kernel);

/*
 * H[m] = s^order Σ α_k β_k/(s − p_k) over all poles (α, β one of each conjugate pair: [n_poles]).
 * Cost: about 20 flops a pole and point.
 */
void response_value(const struct response_kernel *kernel, int order, const double complex alpha[],
                    const double complex beta[], double complex H[]);

/* One direction in which α, β and the poles move, and the derivative of H along it. */
struct response_change {
    const double complex *d_alpha, *d_beta; /* [n_poles] */
    const double complex *d_p;              /* [n_poles]; NULL: the poles stay */
    double complex *H;                      /* [m] out */
};
/* All n at once: they share what is read of the kernel. Cost: about 40 flops a pole, point and direction. */
void response_derivatives(const struct response_kernel *kernel, int order, const double complex alpha[],
                          const double complex beta[], const struct response_change changes[], size_t n);

/*
 * Exact step of one pole over dt with the input held to first order: q' = p q + u gives
 * q(dt) = e^(p dt) q + g0 u(0) + g1 u(dt). Accurate for every p dt, 0 included; d* are derivatives by p.
 */
struct pole_step {
    double complex e, g0, g1, d_e, d_g0, d_g1;
};
struct pole_step pole_step(double complex p, double dt_s);

#endif
