/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Long runs, energy, float against double, and that the fast path is the general one. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

#if defined __SANITIZE_ADDRESS__
enum { LONG = 300000 };
#else
enum { LONG = 10000000 };
#endif
enum { N = 4096, OUT = BEAM_OUTPUTS };
static struct beam_case c;
static struct beam_plan narrowed;
static double u[2 * N], in_double[OUT * N], in_float[OUT * N];

static void without_damping(struct beam_description *d)
{
    d->parameters.cDI_beam_sNm2 = d->parameters.cDI_patch_sNm2 = d->parameters.gamma_sNpm2 = 0.0;
}

/* Free motion of an undamped beam: every pair turns by ωΔt a step and keeps its size, for ten million steps. */
static void ten_million_steps_do_not_drift(void **state)
{
    const double in[2] = {0}, dt_s = 1.0 / 1024.0;
    double y[OUT], v0[BEAM_N] = {0}, y0[BEAM_N] = {0};
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.n_inputs = c.description.n_outputs = 1;
    without_damping(&c.description);
    case_build(&c, dt_s, BEAM_HOLD_FIRST_ORDER);
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            y0[i] += c.work.modes.shape[i][j] / c.work.modes.omega_radps[j];
    beam_start(&c.model, &c.work, &c.plan, y0, v0, &c.state);
    const struct beam_state first = c.state;
    for (int k = 0; k < LONG; k++)
        assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
    for (int b = 0; b < BEAM_N; b++) {
        const double a = c.work.modes.omega_radps[b] * dt_s;
        const double *x = c.state.x + 2 * b, *s = first.x + 2 * b;
        const double turn = remainder(fmod(a, 2 * acos(-1.0)) * LONG, 2 * acos(-1.0));
        const double phase = remainder(atan2(x[1], x[0]) - atan2(s[1], s[0]) - turn, 2 * acos(-1.0));
        assert_close(hypot(x[0], x[1]) / hypot(s[0], s[1]), 1.0, 1e-8);
        assert_close(phase, 0.0, 4e-16 * LONG * (1.0 + a)); /* rounding of ω itself */
    }
    assert_int_equal(c.state.k, LONG);
}

/* The same in float, whole plan narrowed: the amplitude of the sum of all modes, near the end, against double. */
static void float_does_not_drift_either(void **state)
{
    enum { TAIL = 4096 };
    const double dt_s = 1.0 / 1024.0;
    double y[OUT];
    static double tail_double[TAIL], last_float[TAIL];
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.n_inputs = c.description.n_outputs = 1;
    without_damping(&c.description);
    c.description.input[0].at_m = 0.44; /* mode 1 and 2 dominate the patch voltage */
    case_build(&c, dt_s, BEAM_HOLD_FIRST_ORDER);
    narrowed = c.plan;
    assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
    for (int k = 0; k < LONG; k++) {
        const double in[2] = {case_hit(k * dt_s, 0.2, 100.0), 0};
        assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
        if (k >= LONG - TAIL)
            tail_double[k - LONG + TAIL] = y[0];
    }
    assert_int_equal(shadow_hit_tail((const int *)&narrowed.n, (const double *)&narrowed.x, LONG, TAIL, dt_s, 0.2,
                                     100.0, last_float),
                     BEAM_OK);
    const double error = case_rms_difference(TAIL, tail_double, last_float) / case_rms(TAIL, tail_double);
    const double size = case_rms(TAIL, last_float) / case_rms(TAIL, tail_double);
    print_message("undamped, after %d steps at 1024 Hz: float is off by %.2g of rms, its amplitude by %.2g\n", LONG,
                  error, size - 1.0);
    assert_close(size, 1.0, 3e-3);
    assert_true(error < 2e-2);
}

/* With the paper's damping, driven all the time: the difference of float and double does not grow. */
static void float_stays_with_double_under_steady_drive(void **state)
{
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    narrowed = c.plan;
    assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
    double error = 0.0;
    const int rounds = LONG > 1000000 ? 250 : 10;
    assert_int_equal(shadow_load((const int *)&narrowed.n, (const double *)&narrowed.x), BEAM_OK);
    for (int round = 0; round < rounds; round++) {
        for (int k = 0; k < N; k++) {
            const double t = (round * N + k) / 1024.0;
            u[k] = sin(2 * acos(-1.0) * 6.6461 * t) + sin(2 * acos(-1.0) * 38.37 * t);
            u[N + k] = sin(2 * acos(-1.0) * 95.7 * t);
        }
        case_run(&c, N, u, in_double);
        assert_int_equal(shadow_continue(N, u, in_float), BEAM_OK);
        error = 0.0;
        for (int o = 0; o < OUT; o++)
            error = fmax(error,
                         case_rms_difference(N, in_float + o * N, in_double + o * N) / case_rms(N, in_double + o * N));
        assert_true(error < 1e-4);
    }
    print_message("driven at resonance for %d steps: float is off by %.2g of rms\n", rounds * N, error);
}

static void float_is_within_1e_4_on_a_hammer_record(void **state)
{
    (void)state;
    memset(u, 0, sizeof u);
    for (int k = 0; k < N; k++)
        u[k] = case_hit(k / 1024.0, 0.1, 400.0);
    for (int hold = 0; hold < 3; hold++) {
        double worst = 0.0;
        c.description = case_description(BEAM_BASIS_PATCH);
        case_build(&c, 1.0 / 1024.0, (enum beam_hold)hold);
        case_run(&c, N, u, in_double);
        narrowed = c.plan;
        assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
        assert_int_equal(
            shadow_run((const int *)&narrowed.n, (const double *)&narrowed.x, NULL, NULL, NULL, 0, N, u, in_float),
            BEAM_OK);
        for (int o = 0; o < OUT; o++)
            worst = fmax(worst,
                         case_rms_difference(N, in_float + o * N, in_double + o * N) / case_rms(N, in_double + o * N));
        print_message("hold %d, hammer record at 1024 Hz: float is off by %.2g of rms\n", hold, worst);
        assert_true(worst < 1e-5);
        /* factored in float as well: float poles, good for a look */
        assert_int_equal(shadow_factor_run(1, hold, 1.0 / 1024.0, 1.0, N, u, in_float), BEAM_OK);
        for (int o = 0; o < OUT; o++)
            assert_true(case_rms_difference(N, in_float + o * N, in_double + o * N) <
                        3e-3 * case_rms(N, in_double + o * N));
    }
}

static void effects_run_in_float_as_in_double(void **state)
{
    const struct {
        const char *id;
        unsigned channels;
        double p[BEAM_EFFECT_PARAMETERS], tolerance;
    } cases[] = {{"cubic_stiffness", 0, {1e6, 0.44}, 1e-4},
                 {"quadratic_drag", 0, {0.5}, 1e-4},
                 {"viscoelastic", 0, {0.02, 5e-3}, 1e-4},
                 {"sensor_highpass", 1, {0.05}, 1e-4},
                 {"sensor_lag", 1, {1e-3}, 1e-4},
                 {"sensor_delay", 1, {1.3e-3}, 1e-4},
                 {"hysteretic_damping", 0, {0.01}, 1e-4},
                 {"coulomb_friction", 0, {0.005, 0.05}, 1e-4},
                 {"stop_contact", 0, {2000.0, 1e-4, 0.44}, 1e-3}};
    (void)state;
    memset(u, 0, sizeof u);
    for (int k = 0; k < N; k++)
        u[k] = case_hit(k / 8192.0, 0.1, 400.0);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double worst = 0.0;
        const struct beam_effect *effect = beam_effect_find(cases[i].id);
        c.description = case_description(BEAM_BASIS_PATCH);
        case_add_effect(&c.description, effect, cases[i].channels, cases[i].p[0], cases[i].p[1], cases[i].p[2]);
        case_build(&c, 1.0 / 8192.0, BEAM_HOLD_FIRST_ORDER);
        case_run(&c, N, u, in_double);
        narrowed = c.plan;
        assert_int_equal(beam_narrow(&narrowed), BEAM_OK);
        assert_int_equal(shadow_run((const int *)&narrowed.n, (const double *)&narrowed.x, &cases[i].id,
                                    &narrowed.use[0].channels, cases[i].p, 1, N, u, in_float),
                         BEAM_OK);
        for (int o = 0; o < OUT; o++)
            worst = fmax(worst,
                         case_rms_difference(N, in_float + o * N, in_double + o * N) / case_rms(N, in_double + o * N));
        print_message("%s: float is off by %.2g of rms\n", cases[i].id, worst);
        assert_true(worst < cases[i].tolerance);
    }
}

static void energy_falls_in_every_mode(void **state)
{
    const double in[2] = {0};
    double y[OUT], v0[BEAM_N] = {0}, y0[BEAM_N] = {0};
    (void)state;
    for (int power = 0; power < 7; power++) { /* unconditionally stable: up to 7290 s */
        const double dt_s = 1e-5 * pow(30.0, power);
        c.description = case_description(BEAM_BASIS_PATCH);
        case_build(&c, dt_s, BEAM_HOLD_FIRST_ORDER);
        for (int i = 0; i < BEAM_N; i++)
            for (int j = 0; j < BEAM_N; j++)
                y0[i] += c.work.modes.shape[i][j] / c.work.modes.omega_radps[j];
        beam_start(&c.model, &c.work, &c.plan, y0, v0, &c.state);
        for (int k = 0; k < 1000; k++) {
            double before[BEAM_N];
            for (int b = 0; b < BEAM_N; b++)
                before[b] = hypot(c.state.x[2 * b], c.state.x[2 * b + 1]);
            assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
            for (int b = 0; b < BEAM_N; b++)
                assert_true(hypot(c.state.x[2 * b], c.state.x[2 * b + 1]) <=
                            before[b] * (exp(c.work.poles.re[b] * dt_s) * (1 + 1e-12) + 1e-15) + 1e-300);
        }
    }
}

static int silent(const double p[], double t_s, double v, struct beam_sample_output *out)
{
    (void)p;
    (void)t_s;
    out->y = v;
    return 0;
}
static const struct beam_effect silence = {.id = "silence", .signal = silent};

static void the_fast_path_is_the_general_one_bit_for_bit(void **state)
{
    unsigned seed = 9;
    (void)state;
    for (int k = 0; k < 2 * N; k++)
        u[k] = case_random(&seed);
    for (int inputs = 0; inputs <= 2; inputs++)
        for (int outputs = 0; outputs <= OUT; outputs++) {
            c.description = case_description(BEAM_BASIS_PATCH);
            c.description.n_inputs = inputs;
            c.description.n_outputs = outputs;
            case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
            case_run(&c, N, u, in_double);
            case_add_effect(&c.description, &silence, 1u, 0, 0, 0);
            case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
            case_run(&c, N, u, in_float);
            assert_memory_equal(in_double, in_float, (size_t)(outputs * N) * sizeof *in_double);
        }
}

static void reset_and_a_second_state_repeat_the_run(void **state)
{
    unsigned seed = 10;
    (void)state;
    for (int k = 0; k < 2 * N; k++)
        u[k] = case_random(&seed);
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, beam_effect_find("quadratic_drag"), 0, 0.5, 0, 0);
    case_add_effect(&c.description, beam_effect_find("sensor_delay"), 1u, 2e-3, 0, 0);
    c.options.half_width = 8;
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_BAND_LIMITED);
    c.options.half_width = 0;
    case_run(&c, N, u, in_double);
    beam_reset(&c.plan, &c.state);
    case_run(&c, N, u, in_float);
    assert_memory_equal(in_double, in_float, sizeof in_double);
}

static void a_poisoned_input_is_reported(void **state)
{
    double in[2] = {NAN, 0}, y[OUT];
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_ERROR_STATE);
    in[0] = 0.0;
    assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_ERROR_STATE); /* it stays, until … */
    beam_reset(&c.plan, &c.state);
    assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_million_steps_do_not_drift),
        cmocka_unit_test(float_does_not_drift_either),
        cmocka_unit_test(float_stays_with_double_under_steady_drive),
        cmocka_unit_test(float_is_within_1e_4_on_a_hammer_record),
        cmocka_unit_test(effects_run_in_float_as_in_double),
        cmocka_unit_test(energy_falls_in_every_mode),
        cmocka_unit_test(the_fast_path_is_the_general_one_bit_for_bit),
        cmocka_unit_test(reset_and_a_second_state_repeat_the_run),
        cmocka_unit_test(a_poisoned_input_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
