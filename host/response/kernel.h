/* SPDX-License-Identifier: GPL-3.0-or-later */
/* kernel.h — private to response/: what its files share of kernel. */
#ifndef BEAMFIT_KERNEL_PRIVATE_H
#define BEAMFIT_KERNEL_PRIVATE_H

#include "response.h"

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
