/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Linear beams: exact integration of each complex mode, ż = λz + b u, with u a parabola through the two ends and the
 * middle of each fine step:   z₊ = e^{λh} z + h b Σ w_i u_i;   of a held input the middle alone.
 */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>

/* φ_k(z) = ∫₀¹ e^{z(1−s)} s^{k−1}/(k−1)! ds, k = 1, 2, 3 */
static void phi_functions(double complex z, double complex phi[4])
{
    if (cabs(z) > 1) {
        double factorial = 1;
        phi[0] = cexp(z);
        for (int k = 0; k < 3; k++) {
            phi[k + 1] = (phi[k] - 1 / factorial) / z;
            factorial *= k + 1;
        }
        return;
    }
    for (int k = 1; k <= 3; k++) {
        double factorial = 1;
        for (int i = 2; i <= k; i++)
            factorial *= i;
        double complex term = 1 / factorial;
        phi[k] = 0;
        for (int i = k + 1; i < k + 25; i++) {
            phi[k] += term;
            term *= z / i;
        }
    }
}

/* Rows of y = C x + D u: the acceleration needs ẋ = A x + B u. C [n_outputs × n_states], D [n_outputs × n_inputs] */
static void output_matrices(const struct truth_system *s, double *C, double *D)
{
    size_t n = s->n_modes, N = s->n_states, P = s->n_inputs;
    for (size_t k = 0; k < s->n_outputs; k++)
        for (size_t j = 0; j < n; j++) {
            double r = s->output[k].row[j];
            if (s->output[k].kind == TRUTH_ACCELERATION) {
                for (size_t i = 0; i < N; i++)
                    C[k * N + i] += r * s->A[(n + j) * N + i];
                for (size_t i = 0; i < P; i++)
                    D[k * P + i] += r * s->B[(n + j) * P + i];
            } else if (s->output[k].kind == TRUTH_VELOCITY) {
                C[k * N + n + j] += r;
            } else {
                C[k * N + j] += r / s->scale[j];
            }
        }
}

size_t truth_modes_make(const struct truth_system *s, double h, struct truth_mode *mode, double *D,
                        char message[TRUTH_MESSAGE])
{
    size_t N = s->n_states, P = s->n_inputs, kept = 0;
    double complex *lambda = calloc(N, sizeof *lambda), *V = calloc(N * N, sizeof *V), *W = calloc(N * N, sizeof *W);
    double *C = truth_array(s->n_outputs * N);
    if (!lambda || !V || !W)
        abort();
    output_matrices(s, C, D);
    if (truth_diagonalise(N, s->A, lambda, V, W, message) == 0)
        for (size_t m = 0; m < N; m++) {
            if (cimag(lambda[m]) < 0)
                continue;
            double twice = cimag(lambda[m]) > 0 ? 2 : 1;
            double complex phi[4];
            struct truth_mode *one = &mode[kept++]; /* of a pair, with twice its output */
            phi_functions(lambda[m] * h, phi);
            one->step = cexp(lambda[m] * h);
            for (size_t i = 0; i < P; i++) {
                double complex b = 0;
                for (size_t r = 0; r < N; r++)
                    b += W[m * N + r] * s->B[r * P + i];
                one->begin[i] = h * b * (phi[1] - 3 * phi[2] + 4 * phi[3]);
                one->middle[i] = h * b * (4 * phi[2] - 8 * phi[3]);
                one->end[i] = h * b * (4 * phi[3] - phi[2]);
                if (s->held[i]) {
                    one->begin[i] = one->end[i] = 0;
                    one->middle[i] = h * b * phi[1];
                }
            }
            for (size_t k = 0; k < s->n_outputs; k++) {
                one->out[k] = 0;
                for (size_t r = 0; r < N; r++)
                    one->out[k] += twice * C[k * N + r] * V[r * N + m];
            }
        }
    free(lambda);
    free(V);
    free(W);
    free(C);
    return kept;
}

/* Modes outside, time inside: each mode runs through the whole record and adds its part. */
static void run_mode(const struct truth_mode *m, const struct truth_grid *grid, size_t n_inputs, size_t n_outputs,
                     double *const *u, double *const *y)
{
    double step_re = creal(m->step), step_im = cimag(m->step), re = 0, im = 0;
    for (size_t i = grid->lead; i + 1 < grid->n; i++) {
        double old = re;
        re = step_re * old - step_im * im;
        im = step_im * old + step_re * im;
        for (size_t p = 0; p < n_inputs; p++) {
            const double *v = u[p] + 2 * i;
            re += creal(m->begin[p]) * v[0] + creal(m->middle[p]) * v[1] + creal(m->end[p]) * v[2];
            im += cimag(m->begin[p]) * v[0] + cimag(m->middle[p]) * v[1] + cimag(m->end[p]) * v[2];
        }
        for (size_t k = 0; k < n_outputs; k++)
            y[k][i + 1] += creal(m->out[k]) * re - cimag(m->out[k]) * im;
    }
}

int truth_solve_linear(const struct truth_system *s, const struct truth_grid *grid, double *const *u, double *const *y,
                       char message[TRUTH_MESSAGE])
{
    double *D = truth_array(s->n_outputs * s->n_inputs);
    double *zero = truth_array(s->n_states * 2), base[TRUTH_PORTS];
    struct truth_mode *mode = calloc(s->n_states, sizeof *mode);
    if (!mode)
        abort();
    size_t kept = truth_modes_make(s, grid->dt_s, mode, D, message);
    for (size_t m = 0; m < kept; m++)
        run_mode(&mode[m], grid, s->n_inputs, s->n_outputs, u, y);
    for (size_t i = grid->lead; i < grid->n; i++) {
        truth_system_observe(s, grid->t0_s + (double)i * grid->dt_s, zero, zero + s->n_states, base);
        for (size_t k = 0; k < s->n_outputs; k++) {
            y[k][i] += base[k];
            for (size_t p = 0; p < s->n_inputs; p++)
                y[k][i] += D[k * s->n_inputs + p] * u[p][s->held[p] ? 2 * i - 1 : 2 * i]; /* held: before the jump */
        }
    }
    free(D);
    free(zero);
    free(mode);
    return kept > 0 ? 0 : -1;
}
