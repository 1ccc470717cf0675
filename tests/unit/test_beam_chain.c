/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The measurement chain: filters against closed forms, delays, order, one latency for all. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

enum { N = 4096, OUT = BEAM_OUTPUTS };
static const double rate_Hz = 1024.0;
static struct beam_case c;
static double air_Nspm2 = 0.013; /* damping by air, so large where a test must lose its transients */
static double u[2 * N], plain[OUT * N], chained[OUT * N], expected[N];

static void excite(double band_Hz)
{
    memset(u, 0, sizeof u);
    for (int k = 0; k < N; k++)
        u[k] = case_hit(k / rate_Hz, 0.1, band_Hz);
}

/* The patch voltage without (plain) and with (chained) one effect on output 0. */
static void run_with(const struct beam_effect *effect, double p0, double p1, double p2, enum beam_hold hold)
{
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.parameters.gamma_sNpm2 = air_Nspm2;
    case_build(&c, 1.0 / rate_Hz, hold);
    case_run(&c, N, u, plain);
    case_add_effect(&c.description, effect, 1u, p0, p1, p2);
    case_build(&c, 1.0 / rate_Hz, hold);
    case_run(&c, N, u, chained);
}

/* w through the first-order section b/(s + a) + d by the exact formula for w linear between samples. */
static void section(double b, double a, double d, const double *w, double *v)
{
    const double h = 1.0 / rate_Hz, e = exp(-a * h), phi1 = (1 - e) / (a * h), phi2 = (1 - phi1) / (a * h);
    double x = 0.0;
    for (int k = 0; k < N; k++) {
        const double before = k > 0 ? w[k - 1] : 0.0;
        x = e * x + b * h * (phi1 * before + phi2 * (w[k] - before));
        v[k] = x + d * w[k];
    }
}

static void first_order_filters_are_exact_for_linear_signals(void **state)
{
    (void)state;
    excite(300.0);
    for (int decade = 0; decade < 6; decade++) {
        const double tau_s = 1e-4 * pow(7.0, decade);
        run_with(beam_effect_find("sensor_highpass"), tau_s, 0, 0, BEAM_HOLD_FIRST_ORDER);
        section(-1.0 / tau_s, 1.0 / tau_s, 1.0, plain, expected);
        assert_true(case_rms_difference(N, chained, expected) < 1e-9 * case_rms(N, plain));
        run_with(beam_effect_find("sensor_lag"), tau_s, 0, 0, BEAM_HOLD_FIRST_ORDER);
        section(1.0 / tau_s, 1.0 / tau_s, 0.0, plain, expected);
        assert_true(case_rms_difference(N, chained, expected) < 1e-9 * case_rms(N, plain));
        assert_int_equal(c.plan.n.latency, 0);
    }
}

/* Steady response to a sine at f: amplitude and phase of H by projecting the last part of the record. */
static void project(double f_Hz, const double *y, double *re, double *im)
{
    *re = *im = 0.0;
    for (int k = N / 2; k < N; k++) { /* a whole number of periods of f */
        *re += y[k] * cos(2 * acos(-1.0) * f_Hz * k / rate_Hz);
        *im -= y[k] * sin(2 * acos(-1.0) * f_Hz * k / rate_Hz);
    }
}

static void band_limited_filters_and_delays_have_the_right_response(void **state)
{
    const double tau_s = 4e-4;
    (void)state;
    air_Nspm2 = 2.0;
    for (int octave = 0; octave < 6; octave++)
        for (int kind = 0; kind < 3; kind++) {
            const double f_Hz = 10.0 * (1 << octave);
            const double omega = 2 * acos(-1.0) * f_Hz, delay_s = 3.7e-4;
            double a_re, a_im, b_re, b_im;
            for (int k = 0; k < N; k++)
                u[k] = sin(omega * k / rate_Hz);
            run_with(beam_effect_find(kind == 0   ? "sensor_lag"
                                      : kind == 1 ? "sensor_highpass"
                                                  : "sensor_delay"),
                     kind == 2 ? delay_s : tau_s, 0, 0, BEAM_HOLD_BAND_LIMITED);
            const int more = c.plan.n.latency - 19; /* the filter looks ahead in its turn */
            assert_true(more >= 18 && more <= 20);
            project(f_Hz, plain, &a_re, &a_im);
            project(f_Hz, chained, &b_re, &b_im);
            const double shift = omega * more / rate_Hz; /* undo the additional latency */
            const double t_re = b_re * cos(shift) - b_im * sin(shift), t_im = b_re * sin(shift) + b_im * cos(shift);
            const double h_re = (t_re * a_re + t_im * a_im) / (a_re * a_re + a_im * a_im);
            const double h_im = (t_im * a_re - t_re * a_im) / (a_re * a_re + a_im * a_im);
            const double wt = omega * tau_s, d = 1 + wt * wt;
            const double expected_re = kind == 0 ? 1 / d : kind == 1 ? wt * wt / d : cos(omega * delay_s);
            const double expected_im = kind == 0 ? -wt / d : kind == 1 ? wt / d : -sin(omega * delay_s);
            assert_close(h_re, expected_re, 2e-5);
            assert_close(h_im, expected_im, 2e-5);
        }
    air_Nspm2 = 0.013;
}

static void whole_sample_delays_are_shifts(void **state)
{
    (void)state;
    excite(300.0);
    for (int hold = 0; hold < 3; hold += 2)
        for (int samples = 0; samples < 80; samples += 13) {
            run_with(beam_effect_find("sensor_delay"), samples / rate_Hz, 0, 0, (enum beam_hold)hold);
            for (int k = samples; k < N; k++)
                assert_true(chained[k] == plain[k - samples]);
            for (int o = 1; o < OUT; o++) /* its neighbours are not delayed */
                assert_memory_equal(chained + o * N, plain + o * N, N * sizeof *plain);
        }
}

static void a_fraction_of_a_sample_is_interpolated_linearly_by_the_linear_hold(void **state)
{
    (void)state;
    excite(300.0);
    run_with(beam_effect_find("sensor_delay"), 5.25 / rate_Hz, 0, 0, BEAM_HOLD_FIRST_ORDER);
    for (int k = 6; k < N; k++)
        assert_close(chained[k], 0.75 * plain[k - 5] + 0.25 * plain[k - 6], 1e-12 * 4682.0);
}

static void outputs_keep_one_latency_whatever_their_chains(void **state)
{
    (void)state;
    excite(200.0);
    c.description = case_description(BEAM_BASIS_PATCH);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_BAND_LIMITED);
    case_run(&c, N, u, plain);
    const int before = c.plan.n.latency;
    case_add_effect(&c.description, beam_effect_find("sensor_lag"), 2u, 1e-3, 0, 0); /* on output 1 only */
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_BAND_LIMITED);
    case_run(&c, N, u, chained);
    const int more = c.plan.n.latency - before;
    assert_true(more > 0);
    for (int k = more; k < N; k++) /* output 0 waits for it */
        assert_true(chained[k] == plain[k - more]);
}

/* ---- Effects of the test's own: what maps and signals are told ---- */

static int leak(const double p[], double v, double drive, struct beam_sample_output *out)
{
    out->y = v + p[0] * drive;
    return 0;
}
static int clock_signal(const double p[], double t_s, double v, struct beam_sample_output *out)
{
    (void)v;
    out->y = p[0] * t_s;
    return 0;
}
static int improper(const double p[], struct beam_filter_output *out)
{
    (void)p;
    out->value.b1 = 1.0;
    out->value.a0 = 1.0;
    return 0;
}
static int growing(const double p[], struct beam_filter_output *out)
{
    (void)p;
    out->value.b0 = 1.0;
    out->value.a1 = 1.0;
    out->value.a0 = -1.0;
    return 0;
}
static int ahead(const double p[], struct beam_filter_output *out)
{
    out->value.b0 = out->value.a0 = 1.0;
    out->value.delay_s = p[0];
    return 0;
}
static int refusing(const double p[], double v, double drive, struct beam_sample_output *out)
{
    (void)p;
    (void)v;
    (void)drive;
    (void)out;
    return -1;
}
static int doubling(const double p[], double in, double before, const double z[BEAM_DRIVE_STATES],
                    struct beam_drive_output *out)
{
    out->u = p[0] * in;
    out->z[0] = z[0] + (in - before);
    return 0;
}
static int shaking(const double p[], double t_s, struct beam_sample_output *out)
{
    out->y = p[0] * sin(2 * acos(-1.0) * p[1] * t_s);
    return 0;
}
static const struct beam_effect leaking = {.id = "leak", .n_parameters = 0, .map = leak};
static const struct beam_effect ticking = {.id = "clock", .n_parameters = 0, .signal = clock_signal};
static const struct beam_effect improper_filter = {.id = "improper", .filter = improper};
static const struct beam_effect growing_filter = {.id = "growing", .filter = growing};
static const struct beam_effect ahead_filter = {.id = "ahead", .filter = ahead};
static const struct beam_effect refusing_map = {.id = "refusing", .map = refusing};
static const struct beam_effect doubling_drive = {
    .id = "doubling", .drive = doubling, .channels = BEAM_CHANNELS_PATCH_INPUT};
static const struct beam_effect shaking_base = {.id = "shaking", .base = shaking};

static void maps_and_signals_see_the_sample_they_belong_to(void **state)
{
    (void)state;
    excite(200.0);
    for (int k = 0; k < N; k++)
        u[N + k] = 1e-3 * sin(0.3 * k); /* the drive; weak, so that its leak dominates */
    for (int hold = 0; hold < 3; hold += 2) {
        run_with(&leaking, 1e6, 0, 0, (enum beam_hold)hold);
        const int late = c.plan.n.latency;
        for (int k = late; k < N; k++)
            assert_close(chained[k] - plain[k], 1e6 * u[N + k - late], 1e-6);
        run_with(&ticking, 1.0, 0, 0, (enum beam_hold)hold);
        for (int k = 0; k < N; k++)
            assert_close(chained[k], (k - late) / rate_Hz, 1e-12);
    }
}

static void links_act_in_the_order_of_the_list(void **state)
{
    (void)state;
    excite(200.0);
    for (int order = 0; order < 2; order++) {
        c.description = case_description(BEAM_BASIS_PATCH);
        for (int i = 0; i < 2; i++)
            case_add_effect(&c.description, beam_effect_find(i == order ? "sensor_saturation" : "sensor_offset"), 1u,
                            5.0, 0, 0);
        case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
        case_run(&c, N, u, chained);
        double top = 0.0;
        for (int k = 0; k < N; k++)
            top = fmax(top, chained[k]);
        assert_true(order == 0 ? top > 5.0 : top <= 5.0); /* saturate then add 5, or add then saturate at 5 */
    }
}

static void drives_change_what_reaches_the_beam(void **state)
{
    (void)state;
    memset(u, 0, sizeof u);
    for (int k = 0; k < N; k++)
        u[N + k] = case_hit(k / rate_Hz, 0.2, 200.0);
    c.description = case_description(BEAM_BASIS_PATCH);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
    case_run(&c, N, u, plain);
    case_add_effect(&c.description, &doubling_drive, 0, 2.0, 0, 0);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
    case_run(&c, N, u, chained);
    for (int i = 0; i < OUT * N; i++)
        assert_close(chained[i], 2.0 * plain[i], 1e-9 * (1.0 + fabs(plain[i])));
    assert_close(c.state.drive_z[1][0][0], u[2 * N - 1], 1e-15); /* Σ of increments is the last command */
    assert_true(c.state.drive_z[0][0][0] == 0.0);
}

/* Shaking far above ten modes' reach is not tested; far below mode 1 the beam rides along: acceleration is a_b. */
static void a_slowly_shaken_beam_rides_along(void **state)
{
    (void)state;
    memset(u, 0, sizeof u);
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.parameters.gamma_sNpm2 = 1.0; /* transients die */
    case_add_effect(&c.description, &shaking_base, 0, 1.0, 0.25, 0);
    for (int hold = 0; hold < 3; hold += 2) {
        case_build(&c, 1.0 / rate_Hz, (enum beam_hold)hold);
        case_run(&c, N, u, chained);
        for (int k = N / 2; k < N; k++)
            assert_close(chained[N + k], sin(2 * acos(-1.0) * 0.25 * (k - c.plan.n.latency) / rate_Hz), 1e-3);
    }
    /* the tip bends back: static deflection under −ρ a_b, the same as under the load itself */
    double top = 0.0;
    for (int k = N / 2; k < N; k++)
        top = fmax(top, fabs(chained[3 * N + k]));
    const double uniform =
        0.093 * pow(0.44, 4.0) / (8.0 * 0.491); /* without the patch; it adds mass and stiffness near the clamp */
    assert_close(top / uniform, 1.0, 0.2);
}

static void filters_that_cannot_be_are_refused(void **state)
{
    const struct {
        const struct beam_effect *effect;
        double p0;
        enum beam_status status;
    } cases[] = {{&improper_filter, 0, BEAM_ERROR_FILTER},
                 {&growing_filter, 0, BEAM_ERROR_FILTER},
                 {&ahead_filter, -1e-3, BEAM_ERROR_FILTER},
                 {&ahead_filter, NAN, BEAM_ERROR_FILTER},
                 {&ahead_filter, 10.0, BEAM_ERROR_CAPACITY}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        c.description = case_description(BEAM_BASIS_PATCH);
        case_add_effect(&c.description, cases[i].effect, 1u, cases[i].p0, 0, 0);
        c.options = (struct beam_options){.dt_s = 1.0 / rate_Hz};
        assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
        assert_int_equal(beam_factor(&c.model, &c.options, &c.work, &c.plan), cases[i].status);
    }
    c.description = case_description(BEAM_BASIS_PATCH);
    for (int i = 0; i < BEAM_CHAIN + 1; i++)
        case_add_effect(&c.description, &leaking, 1u, 0, 0, 0);
    assert_int_equal(beam_assemble(&c.description, &c.model), BEAM_OK);
    assert_int_equal(beam_factor(&c.model, &c.options, &c.work, &c.plan), BEAM_ERROR_CAPACITY);
    double in[2] = {0}, y[OUT];
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, &refusing_map, 1u, 0, 0, 0);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
    assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_ERROR_EFFECT_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_order_filters_are_exact_for_linear_signals),
        cmocka_unit_test(band_limited_filters_and_delays_have_the_right_response),
        cmocka_unit_test(whole_sample_delays_are_shifts),
        cmocka_unit_test(a_fraction_of_a_sample_is_interpolated_linearly_by_the_linear_hold),
        cmocka_unit_test(outputs_keep_one_latency_whatever_their_chains),
        cmocka_unit_test(maps_and_signals_see_the_sample_they_belong_to),
        cmocka_unit_test(links_act_in_the_order_of_the_list),
        cmocka_unit_test(drives_change_what_reaches_the_beam),
        cmocka_unit_test(a_slowly_shaken_beam_rides_along),
        cmocka_unit_test(filters_that_cannot_be_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
