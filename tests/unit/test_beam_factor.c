/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The exact step against a dense matrix exponential, and what the holds do to a band-limited signal. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <cmocka.h>
#include "beam_case.h"

enum { N = 512, OUT = BEAM_OUTPUTS };
static const double rate_Hz = 1024.0;
static struct beam_case c;

static double *numbers(int n)
{
    double *x = calloc((size_t)n, sizeof *x);
    assert_non_null(x);
    return x;
}

static void add_damper(double damping_Nspm)
{
    case_add_effect(&c.description, beam_effect_find("point_damper"), 0, damping_Nspm, beam_length(), 0);
}

/* Random inputs; every output within `tolerance` of its rms. */
static void compare_with_exponential(double dt_s, enum beam_hold hold, double tolerance)
{
    double *u = numbers(2 * N), *y = numbers(OUT * N), *expected = numbers(OUT * N);
    unsigned seed = 1;
    case_build(&c, dt_s, hold);
    for (int k = 0; k < 2 * N; k++)
        u[k] = case_random(&seed);
    case_run(&c, N, u, y);
    case_reference(&c.model, dt_s, hold == BEAM_HOLD_ZERO_ORDER, N, u, NULL, expected);
    for (int o = 0; o < OUT; o++)
        assert_true(case_rms_difference(N, y + o * N, expected + o * N) < tolerance * case_rms(N, expected + o * N));
    free(u);
    free(y);
    free(expected);
}

static void the_step_is_the_matrix_exponential(void **state)
{
    (void)state;
    for (int basis = 0; basis < 2; basis++)
        for (int hold = 0; hold < 2; hold++) {
            c.description = case_description((enum beam_basis)basis);
            compare_with_exponential(1.0 / rate_Hz, (enum beam_hold)hold, 1e-9);
        }
}

static void also_with_overdamped_poles_and_tiny_or_long_steps(void **state)
{
    (void)state;
    for (int damped = 0; damped < 2; damped++)
        for (int power = 0; power < 4; power++) {
            const double dt_s = 1e-6 * pow(30.0, power);
            c.description = case_description(BEAM_BASIS_PATCH);
            if (damped)
                add_damper(60.0);
            compare_with_exponential(dt_s, BEAM_HOLD_FIRST_ORDER, 1e-8);
        }
}

static void free_motion_from_any_state_is_the_exponential(void **state)
{
    double x0[CASE_STATES], *u = numbers(2 * N), *y = numbers(OUT * N), *expected = numbers(OUT * N);
    unsigned seed = 4;
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    add_damper(0.2);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
    for (int i = 0; i < CASE_STATES; i++)
        x0[i] = case_random(&seed) * (i < BEAM_N ? 1e-3 : 1.0);
    beam_start(&c.model, &c.work, &c.plan, x0, x0 + BEAM_N, &c.state);
    case_run(&c, N, u, y);
    case_reference(&c.model, 1.0 / rate_Hz, 0, N, u, x0, expected);
    for (int o = 0; o < OUT; o++)
        assert_true(case_rms_difference(N, y + o * N, expected + o * N) < 1e-9 * case_rms(N, expected + o * N));
    free(u);
    free(y);
    free(expected);
}

/* A force held for ever ends at the static deflection; memory has then relaxed and bears nothing. */
static void a_constant_force_ends_at_the_static_deflection(void **state)
{
    double phi[BEAM_N], stiff[BEAM_N][BEAM_N], in[2] = {1.0, 0.0}, y[OUT];
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.input[0].at_m = 0.3;
    case_add_effect(&c.description, beam_effect_find("viscoelastic"), 0, 0.1, 0.01, 0);
    case_build(&c, 0.01, BEAM_HOLD_FIRST_ORDER);
    assert_int_equal(c.plan.n.n_blocks, BEAM_N + BEAM_N / 2);
    for (int k = 0; k < 20000; k++)
        assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
    for (int i = 0; i < BEAM_N; i++) {
        phi[i] = c.model.input[0].vector[i];
        for (int j = 0; j < BEAM_N; j++)
            stiff[i][j] = c.model.K[i][j];
    }
    for (int j = 0; j < BEAM_N; j++)
        for (int i = j + 1; i < BEAM_N; i++) {
            const double f = stiff[i][j] / stiff[j][j];
            for (int k = j; k < BEAM_N; k++)
                stiff[i][k] -= f * stiff[j][k];
            phi[i] -= f * phi[j];
        }
    double tip = 0.0;
    for (int i = BEAM_N - 1; i >= 0; i--) {
        for (int k = i + 1; k < BEAM_N; k++)
            phi[i] -= stiff[i][k] * phi[k];
        phi[i] /= stiff[i][i];
        tip += phi[i] * c.model.output[3].vector[i];
    }
    assert_close(y[3] / tip, 1.0, 1e-6);
    assert_close(y[1], 0.0, 1e-5);
    assert_close(y[2], 0.0, 1e-6);
}

/* The memory starts relaxed: released from y0, its first pull is that of K and all of E X. */
static void a_relaxed_memory_is_where_a_long_hold_leaves_it(void **state)
{
    double y0[BEAM_N], v0[BEAM_N] = {0}, in[2] = {0}, free_y[OUT], held_y[OUT];
    struct beam_state held;
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, beam_effect_find("viscoelastic"), 0, 0.1, 0.01, 0);
    case_build(&c, 0.01, BEAM_HOLD_ZERO_ORDER);
    for (int i = 0; i < BEAM_N; i++)
        y0[i] = 0.0;
    /* static deflection under the patch moment, from the poles: −Σ sign φ φᵀb/p */
    const struct beam_poles *p = &c.work.poles;
    for (int k = 0; k < p->n_complex + p->n_real; k++) {
        double b_re = 0, b_im = 0;
        for (int i = 0; i < BEAM_N; i++) {
            b_re += p->shape_re[k][i] * c.model.input[1].vector[i];
            b_im += p->shape_im[k][i] * c.model.input[1].vector[i];
        }
        const double size = p->re[k] * p->re[k] + p->im[k] * p->im[k];
        const double g_re = (b_re * p->re[k] + b_im * p->im[k]) / size,
                     g_im = (b_im * p->re[k] - b_re * p->im[k]) / size;
        for (int i = 0; i < BEAM_N; i++)
            y0[i] -= (k < p->n_complex ? 2.0 : p->sign[k]) * (p->shape_re[k][i] * g_re - p->shape_im[k][i] * g_im);
    }
    in[1] = 1.0;
    for (int k = 0; k < 20000; k++)
        assert_int_equal(beam_step(&c.plan, &c.state, in, held_y), BEAM_OK);
    held = c.state;
    beam_start(&c.model, &c.work, &c.plan, y0, v0, &c.state);
    in[1] = 0.0;
    c.state.u_last[1] = 1.0; /* both are let go after this step */
    for (int k = 0; k < 50; k++) {
        assert_int_equal(beam_step(&c.plan, &c.state, in, free_y), BEAM_OK);
        assert_int_equal(beam_step(&c.plan, &held, in, held_y), BEAM_OK);
        for (int o = 0; o < OUT; o++)
            assert_close(free_y[o], held_y[o], 1e-6 * (o == 1 ? 10.0 : 1.0) * (1e-9 + fabs(held_y[o])) + 1e-9);
    }
}

/* Converged response to a hit, sampled at rate_Hz: linear between samples 32 and 64 times as fine, extrapolated. */
static void converged(double band_Hz, int n, double *y)
{
    double *fine[2];
    for (int pass = 0; pass < 2; pass++) {
        const int fold = 32 << pass, m = n * fold;
        double *u = numbers(2 * m);
        fine[pass] = numbers(OUT * m);
        for (int k = 0; k < m; k++)
            u[k] = case_hit(k / rate_Hz / fold, 0.05, band_Hz);
        case_reference(&c.model, 1.0 / rate_Hz / fold, 0, m, u, NULL, fine[pass]);
        free(u);
    }
    for (int o = 0; o < OUT; o++)
        for (int k = 0; k < n; k++)
            y[o * n + k] = (4.0 * fine[1][(o * n + k) * 64] - fine[0][(o * n + k) * 32]) / 3.0;
    free(fine[0]);
    free(fine[1]);
}

static double hold_error(double band_Hz, enum beam_hold hold, int half_width, int n, const double *expected)
{
    double *u = numbers(2 * n), *y = numbers(OUT * n), worst = 0.0;
    c.options.half_width = half_width;
    case_build(&c, 1.0 / rate_Hz, hold);
    c.options.half_width = 0;
    for (int k = 0; k < n; k++)
        u[k] = case_hit(k / rate_Hz, 0.05, band_Hz);
    case_run(&c, n, u, y);
    const int late = c.plan.n.latency;
    for (int o = 0; o < OUT; o++)
        worst = fmax(worst,
                     case_rms_difference(n - late, y + o * n + late, expected + o * n) / case_rms(n, expected + o * n));
    free(u);
    free(y);
    return worst;
}

static void the_band_limited_hold_is_below_1e_4_for_every_hammer_tip(void **state)
{
    enum { SHORT = 320 };
    double *expected = numbers(OUT * SHORT);
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    for (int tip = 1; tip <= 4; tip++) {
        const double band_Hz = 100.0 * tip;
        converged(band_Hz, SHORT, expected);
        const double first_order = hold_error(band_Hz, BEAM_HOLD_FIRST_ORDER, 0, SHORT, expected);
        const double short_one = hold_error(band_Hz, BEAM_HOLD_BAND_LIMITED, 12, SHORT, expected);
        const double usual = hold_error(band_Hz, BEAM_HOLD_BAND_LIMITED, 0, SHORT, expected);
        const double longest = hold_error(band_Hz, BEAM_HOLD_BAND_LIMITED, 24, SHORT, expected);
        print_message("hit below %.0f Hz at 1024 Hz: first order %.2g, L = 12 %.2g, 20 %.2g, 24 %.2g of rms\n", band_Hz,
                      first_order, short_one, usual, longest);
        assert_true(usual < 1e-4);
        assert_true(longest < 1e-5);
        assert_true(usual < 0.1 * short_one && short_one < 0.1 * first_order);
        assert_int_equal(c.plan.n.latency, 23);
    }
    free(expected);
}

static void wrong_options_are_named(void **state)
{
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    struct beam_options o = {.dt_s = 0.0};
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_INTERVAL);
    o.dt_s = NAN;
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_INTERVAL);
    o = (struct beam_options){.dt_s = 1e-3, .hold = (enum beam_hold)7};
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_ARGUMENT);
    o = (struct beam_options){.dt_s = 1e-3, .hold = BEAM_HOLD_BAND_LIMITED, .half_width = BEAM_HALF_WIDTH + 1};
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_ARGUMENT);
    o.half_width = 3;
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_ARGUMENT);
    o = (struct beam_options){.dt_s = 1e-3, .law_evaluations = -1};
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_ARGUMENT);
    /* drag has eight ports: 47 taps × 2 inputs × (4 + 16) rows do not fit */
    case_add_effect(&c.description, beam_effect_find("quadratic_drag"), 0, 0.05, 0, 0);
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    o = (struct beam_options){.dt_s = 1e-3, .hold = BEAM_HOLD_BAND_LIMITED, .half_width = 24};
    assert_int_equal(beam_factor(&c.model, &o, &c.work, &c.plan), BEAM_ERROR_CAPACITY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_step_is_the_matrix_exponential),
        cmocka_unit_test(also_with_overdamped_poles_and_tiny_or_long_steps),
        cmocka_unit_test(free_motion_from_any_state_is_the_exponential),
        cmocka_unit_test(a_constant_force_ends_at_the_static_deflection),
        cmocka_unit_test(a_relaxed_memory_is_where_a_long_hold_leaves_it),
        cmocka_unit_test(the_band_limited_hold_is_below_1e_4_for_every_hammer_tip),
        cmocka_unit_test(wrong_options_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
