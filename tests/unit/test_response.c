/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Transfer functions on a grid: one oscillator in closed form, the exact step of a pole, far poles, ends of inputs. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "response/response.h"
#include "response/kernel.h"

enum { SAMPLES = 400, MOST_POLES = 4 };
static const double dt_s = 1.0 / 1024.0;

/* A system that has poles and nothing else. */
struct poles {
    struct system system;
    double complex p[MOST_POLES], alpha[MOST_POLES], beta[MOST_POLES], zero[MOST_POLES];
};

/* q″ + 2ζω q' + ω² q = u: one pair with α β = 1/(2 i ω_d). */
static void oscillator(struct poles *o, double f_Hz, double ratio)
{
    double omega = 2.0 * acos(-1.0) * f_Hz, damped = omega * sqrt(1.0 - ratio * ratio);
    memset(o, 0, sizeof *o);
    o->p[0] = CMPLX(-ratio * omega, damped);
    o->alpha[0] = 1.0;
    o->beta[0] = 1.0 / CMPLX(0.0, 2.0 * damped);
    o->system = (struct system){.n_poles = 1, .n_pairs = 1, .n_all = 2, .p = o->p};
}

static void respond(const struct poles *o, enum intersample intersample, int order, const double u[], double y[])
{
    struct response_grid grid;
    struct bf_error err;
    assert_int_equal(response_grid_new(SAMPLES, dt_s, intersample, &grid, &err), BF_OK);
    double complex *U = bf_alloc(2 * grid.m, sizeof *U), *H = U + grid.m;
    double *x = bf_alloc(grid.n + grid.n_tail, sizeof *x);
    response_tail(&grid, u, SAMPLES, x);
    assert_int_equal(response_transform(&grid, x, grid.n + grid.n_tail, U, &err), BF_OK);
    struct response_kernel *kernel = response_kernel_new(&o->system, &grid);
    response_value(kernel, order, o->alpha, o->beta, H);
    for (size_t k = 0; k < grid.m; k++)
        U[k] *= H[k];
    assert_int_equal(response_back(&grid, U, y, &err), BF_OK);
    response_kernel_free(kernel);
    free(U);
    free(x);
    response_grid_free(&grid);
}

static double worst_difference(const double a[], const double b[], size_t n)
{
    double worst = 0.0, largest = 0.0;
    for (size_t k = 0; k < n; k++) {
        worst = fmax(worst, fabs(a[k] - b[k]));
        largest = fmax(largest, fabs(b[k]));
    }
    return worst / largest;
}

/* y(t) of the ν-th derivative for a unit step at 0: (1 − e^(pt)-terms)/ω². */
static double step_response(const struct poles *o, int order, double t)
{
    double complex p = o->p[0], r = o->beta[0];
    if (t < 0.0)
        return 0.0;
    if (order == 0)
        return 2.0 * creal(r * (cexp(p * t) - 1.0) / p);
    return 2.0 * creal(r * cpow(p, order - 1) * cexp(p * t));
}

/* Held samples are a sum of steps. */
static void zero_order_hold_is_exact(void **state)
{
    (void)state;
    struct poles o;
    double u[SAMPLES], y[SAMPLES], exact[SAMPLES];
    for (int frequency = 0; frequency < 3; frequency++) {
        oscillator(&o, frequency == 0 ? 30.0 : frequency == 1 ? 300.0 : 2000.0, 0.01); /* one above the band */
        for (size_t k = 0; k < SAMPLES; k++)
            u[k] = k >= 5 ? sin(0.2 * (double)k) : 0.0;
        for (int order = 0; order < 2; order++) {
            for (size_t k = 0; k < SAMPLES; k++) {
                exact[k] = 0.0;
                for (size_t j = 0; j <= k; j++)
                    exact[k] += (u[j] - (j > 0 ? u[j - 1] : 0.0)) * step_response(&o, order, (double)(k - j) * dt_s);
            }
            respond(&o, INTERSAMPLE_ZERO_ORDER_HOLD, order, u, y);
            assert_true(worst_difference(y, exact, SAMPLES) < 1e-8);
        }
    }
}

/* Response of q to a unit ramp: 2 Re r ((e^(pt) − 1)/p² − t/p). */
static double ramp_response(const struct poles *o, int order, double t)
{
    double complex p = o->p[0], r = o->beta[0];
    if (t <= 0.0)
        return 0.0;
    if (order == 0)
        return 2.0 * creal(r * ((cexp(p * t) - 1.0) / (p * p) - t / p));
    return step_response(o, order - 1, t);
}

/* Straight lines between samples are a sum of ramps. */
static void first_order_hold_is_exact(void **state)
{
    (void)state;
    struct poles o;
    double u[SAMPLES], y[SAMPLES], exact[SAMPLES];
    for (int frequency = 0; frequency < 3; frequency++) {
        oscillator(&o, frequency == 0 ? 30.0 : frequency == 1 ? 300.0 : 2000.0, 0.01);
        for (size_t k = 0; k < SAMPLES; k++)
            u[k] = k >= 5 ? cos(0.3 * (double)k) : 0.0;
        for (int order = 0; order < 3; order++) {
            for (size_t k = 0; k < SAMPLES; k++) {
                exact[k] = 0.0;
                for (size_t j = 0; j <= k; j++) {
                    double slope = (j + 1 < SAMPLES ? u[j + 1] : u[j]) - u[j], before = u[j] - (j > 0 ? u[j - 1] : 0.0);
                    if (j == 0)
                        before = 0.0;
                    exact[k] += (slope - before) / dt_s * ramp_response(&o, order, (double)(k - j) * dt_s);
                }
            }
            respond(&o, INTERSAMPLE_FIRST_ORDER_HOLD, order, u, y);
            assert_true(worst_difference(y, exact, SAMPLES) < 1e-8);
        }
    }
}

/* A smooth pulse of 20 ms: nothing of it (1e-9) is above 512 Hz. */
static double pulse(double t_s)
{
    double x = (t_s - 0.1) / 0.012;
    return exp(-0.5 * x * x);
}

/* The exact response to a smooth input: five Gauss points on each sixteenth of a sample interval. */
static double convolution(const struct poles *o, int order, double t_s)
{
    static const double x[5] = {-0.90617984593866399280, -0.53846931010568309104, 0.0, 0.53846931010568309104,
                                0.90617984593866399280};
    static const double w[5] = {0.23692688505618908751, 0.47862867049936646804, 0.56888888888888888889,
                                0.47862867049936646804, 0.23692688505618908751};
    double h = dt_s / 16.0, sum = 0.0;
    size_t steps = (size_t)lround(t_s / h);
    double complex p = o->p[0], r = o->beta[0] * cpow(p, order);
    for (size_t k = 0; k < steps; k++) {
        for (int q = 0; q < 5; q++) {
            double t = h * ((double)k + 0.5 + 0.5 * x[q]);
            sum += 0.5 * h * w[q] * 2.0 * creal(r * cexp(p * (t_s - t))) * pulse(t);
        }
    }
    return sum + (order == 2 ? 2.0 * creal(o->beta[0] * p) * pulse(t_s) : 0.0);
}

static void band_limited_input_is_exact(void **state)
{
    (void)state;
    struct poles o;
    double u[SAMPLES], y[SAMPLES], exact[SAMPLES];
    for (size_t k = 0; k < SAMPLES; k++)
        u[k] = pulse((double)k * dt_s);
    for (int frequency = 0; frequency < 3; frequency++) {
        oscillator(&o, frequency == 0 ? 6.0 : frequency == 1 ? 40.0 : 1500.0, 0.01);
        for (int order = 0; order < 3; order++) {
            respond(&o, INTERSAMPLE_BAND_LIMITED, order, u, y);
            memset(exact, 0, sizeof exact);
            double worst = 0.0, largest = 0.0;
            for (size_t k = 12; k < SAMPLES; k += 43) {
                exact[k] = convolution(&o, order, (double)k * dt_s);
                worst = fmax(worst, fabs(y[k] - exact[k]));
                largest = fmax(largest, fabs(exact[k]));
            }
            if (worst > 1e-5 * largest)
                fail_msg("mode %d, order %d: %.3g relative", frequency, order, worst / largest);
        }
    }
}

/* ---- The exact step of a pole ---- */

/* φ_k(a) = Σ a^j/(j + k)! after scaling: φ1(2a) = φ1(a)(e^a + 1)/2 and φ2(2a) = (φ1(a)² + 2 φ2(a))/4. */
static void reference_phi(double complex a, double complex phi[2])
{
    int halvings = 0;
    for (; cabs(a) > 0.05; a *= 0.5)
        halvings++;
    double complex power = 1.0;
    double factorial = 1.0;
    phi[0] = phi[1] = 0.0;
    for (int j = 0; j < 16; j++) {
        phi[0] += power / (factorial * (double)(j + 1));
        phi[1] += power / (factorial * (double)(j + 1) * (double)(j + 2));
        factorial *= (double)(j + 1);
        power *= a;
    }
    for (; halvings > 0; halvings--, a *= 2.0) {
        double complex e = 1.0 + a * phi[0];
        phi[1] = 0.25 * (phi[0] * phi[0] + 2.0 * phi[1]);
        phi[0] = 0.5 * phi[0] * (e + 1.0);
    }
}

static void steps_of_every_size(void **state)
{
    (void)state;
    const double h = 0.01;
    for (int k = 0; k <= 60; k++) {
        for (int angle = 0; angle < 5; angle++) { /* from the negative real axis to the imaginary one */
            double size = k == 0 ? 0.0 : 1e-6 * pow(10.0, (double)k * 7.7 / 60.0);
            double complex a = size * cexp(CMPLX(0.0, acos(-1.0) * (1.0 - 0.125 * angle))), phi[2];
            struct pole_step step = pole_step(a / h, h);
            reference_phi(a, phi);
            double scale = h * (cabs(phi[0]) + cabs(phi[1]));
            assert_true(cabs(step.e - cexp(a)) < 1e-13);
            assert_true(cabs(step.g1 - h * phi[1]) <= 2e-14 * scale);
            assert_true(cabs(step.g0 - h * (phi[0] - phi[1])) <= 2e-14 * scale);
        }
    }
}

static void derivatives_of_a_step(void **state)
{
    (void)state;
    const double h = 0.01;
    for (int k = 0; k <= 40; k++) {
        double size = k == 0 ? 0.0 : 1e-3 * pow(10.0, (double)k * 4.7 / 40.0), d = 2e-3 * fmax(1.0, 0.1 * size) / h;
        double complex p = size / h * cexp(CMPLX(0.0, 0.8 * acos(-1.0)));
        struct pole_step at = pole_step(p, h), s[4];
        for (int i = 0; i < 4; i++)
            s[i] = pole_step(p + (i < 2 ? 1.0 : 2.0) * (i % 2 == 0 ? d : -d), h);
        double complex e = (8.0 * (s[0].e - s[1].e) - (s[2].e - s[3].e)) / (12.0 * d);
        double complex g0 = (8.0 * (s[0].g0 - s[1].g0) - (s[2].g0 - s[3].g0)) / (12.0 * d);
        double complex g1 = (8.0 * (s[0].g1 - s[1].g1) - (s[2].g1 - s[3].g1)) / (12.0 * d);
        assert_true(cabs(at.d_e - e) <= 1e-9 * h);
        assert_true(cabs(at.d_g0 - g0) <= 1e-9 * h * h);
        assert_true(cabs(at.d_g1 - g1) <= 1e-9 * h * h);
    }
}

/* ---- Sums ---- */

static void sum_over_near_far_and_real_poles(void **state)
{
    (void)state;
    struct poles o = {.p = {CMPLX(-3.0, 240.0), CMPLX(-900.0, 3.4e4), CMPLX(-50.0, 6e3), -200.0},
                      .alpha = {CMPLX(1.0, 0.2), CMPLX(0.4, -2.0), CMPLX(0.1, 0.3), 0.7},
                      .beta = {CMPLX(0.3, -1.0), CMPLX(5.0, 1.0), CMPLX(-0.2, 0.5), 1.1}};
    o.system = (struct system){.n_poles = 4, .n_pairs = 3, .n_all = 7, .p = o.p};
    struct response_grid grid;
    struct bf_error err;
    assert_int_equal(response_grid_new(SAMPLES, dt_s, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_OK);
    assert_true(cabs(o.p[1]) > 3.0 * cabs(grid.s[grid.m - 1]));
    struct response_kernel *kernel = response_kernel_new(&o.system, &grid);
    double complex *H = bf_alloc(grid.m, sizeof *H);
    const double complex da[] = {CMPLX(0.1, 0.0), CMPLX(0.0, 0.3), CMPLX(1.0, 1.0), 0.5};
    const double complex db[] = {CMPLX(0.0, 0.7), CMPLX(-1.0, 0.3), CMPLX(0.2, 0.1), -0.4};
    const double complex dp[] = {CMPLX(2.0, 5.0), CMPLX(-70.0, 3e2), CMPLX(4.0, -6.0), 8.0};
    /* two at once do not disturb each other */
    const struct response_change change[] = {{da, db, dp, H}, {db, da, NULL, bf_alloc(grid.m, sizeof *H)}};
    for (int order = 0; order < 3; order++) {
        for (int derivative = 0; derivative < 2; derivative++) {
            if (derivative)
                response_derivatives(kernel, order, o.alpha, o.beta, change, 2);
            else
                response_value(kernel, order, o.alpha, o.beta, H);
            for (size_t k = 0; k < grid.m; k++) {
                double complex s = grid.s[k], sum = 0.0;
                for (size_t i = 0; i < 4; i++) {
                    double complex r = o.alpha[i] * o.beta[i], dr = da[i] * o.beta[i] + o.alpha[i] * db[i];
                    double complex x = 1.0 / (s - o.p[i]), y = 1.0 / (s - conj(o.p[i]));
                    sum += derivative ? dr * x + r * dp[i] * x * x : r * x;
                    if (i < 3)
                        sum += derivative ? conj(dr) * y + conj(r * dp[i]) * y * y : conj(r) * y;
                }
                sum *= cpow(s, order);
                assert_true(cabs(H[k] - sum) <= 1e-8 * cabs(sum));
            }
        }
    }
    free(H);
    free(change[1].H);
    response_kernel_free(kernel);
    response_grid_free(&grid);
}

/* ---- Ends of records ---- */

/* An input cut in full swing: near the end the prediction must be that of the same input not cut. */
static void cut_input_does_not_ring_back(void **state)
{
    (void)state;
    struct poles o;
    double u[2 * SAMPLES], y[SAMPLES], whole[SAMPLES];
    oscillator(&o, 37.0, 0.01);
    for (size_t k = 0; k < 2 * SAMPLES; k++) {
        double t = (double)k * dt_s;
        u[k] = sin(2.0 * acos(-1.0) * 71.3 * t) * (1.0 - exp(-t / 0.02) * (1.0 + t / 0.02));
    }
    struct response_grid grid;
    struct bf_error err;
    respond(&o, INTERSAMPLE_BAND_LIMITED, 1, u, y); /* knows SAMPLES of u: continued by a model */
    assert_int_equal(response_grid_new(SAMPLES, dt_s, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_OK);
    double *known = bf_alloc(2 * (grid.n + grid.n_tail), sizeof *known), *guessed = known + grid.n + grid.n_tail;
    response_tail(&grid, u, 2 * SAMPLES, known);
    response_tail(&grid, u, SAMPLES, guessed);
    assert_true(worst_difference(guessed + SAMPLES, known + SAMPLES, grid.n_tail) < 1e-2);
    double complex *U = bf_alloc(2 * grid.m, sizeof *U), *H = U + grid.m;
    struct response_kernel *kernel = response_kernel_new(&o.system, &grid);
    assert_int_equal(response_transform(&grid, known, grid.n + grid.n_tail, U, &err), BF_OK);
    response_value(kernel, 1, o.alpha, o.beta, H);
    for (size_t k = 0; k < grid.m; k++)
        U[k] *= H[k];
    assert_int_equal(response_back(&grid, U, whole, &err), BF_OK);
    assert_true(worst_difference(y, whole, SAMPLES) < 1e-3);
    free(known);
    free(U);
    response_kernel_free(kernel);
    response_grid_free(&grid);
}

static void transform_and_back_is_the_signal(void **state)
{
    (void)state;
    struct response_grid grid;
    struct bf_error err;
    double x[SAMPLES], y[SAMPLES];
    for (size_t k = 0; k < SAMPLES; k++)
        x[k] = pulse((double)k * dt_s) * cos(1.1 * (double)k); /* nothing near the Nyquist frequency */
    assert_int_equal(response_grid_new(SAMPLES, dt_s, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_OK);
    double complex *U = bf_alloc(grid.m, sizeof *U);
    assert_int_equal(response_transform(&grid, x, SAMPLES, U, &err), BF_OK);
    assert_int_equal(response_back(&grid, U, y, &err), BF_OK);
    assert_true(worst_difference(y, x, SAMPLES) < 1e-10);
    free(U);
    response_grid_free(&grid);
}

static void short_records_are_refused(void **state)
{
    (void)state;
    struct response_grid grid;
    struct bf_error err;
    assert_int_equal(response_grid_new(1, dt_s, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_NUMERIC);
    assert_int_equal(response_grid_new(10, 0.0, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_NUMERIC);
    assert_int_equal(response_grid_new(10, NAN, INTERSAMPLE_BAND_LIMITED, &grid, &err), BF_NUMERIC);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zero_order_hold_is_exact),     cmocka_unit_test(first_order_hold_is_exact),
        cmocka_unit_test(band_limited_input_is_exact),  cmocka_unit_test(steps_of_every_size),
        cmocka_unit_test(derivatives_of_a_step),        cmocka_unit_test(sum_over_near_far_and_real_poles),
        cmocka_unit_test(cut_input_does_not_ring_back), cmocka_unit_test(transform_and_back_is_the_signal),
        cmocka_unit_test(short_records_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
