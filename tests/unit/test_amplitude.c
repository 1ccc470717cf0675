/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include "compare/compare.h"
#include "model_fixture.h"
#include "signals.h"
#include "test_files.h"

enum { N = 4096, BINS = 129, HIT = 102 };
static const double dt = 1.0 / 1024.0;
static double frequency_Hz[2] = {8.0, 38.4};

/*
 * A hit at sample HIT, then two modes. Mode 2 has f = f₀ (1 + hardening A²) and ζ = ζ₀ + drag A, integrated sample by
 * sample; the prediction has neither.
 */
static void ring(double hardening, double drag, double noise, double *measured, double *predicted)
{
    uint64_t seed = signal_seed(5);
    double phase = 0.0, A = 1.0;
    for (size_t i = 0; i < N; i++) {
        const double t = (double)i * dt - HIT * dt, w = 2.0 * M_PI * frequency_Hz[1];
        const double low = 0.7 * exp(-0.002 * 2.0 * M_PI * 8.0 * t) * sin(2.0 * M_PI * 8.0 * t);
        predicted[i] = i < HIT ? 0.0 : low + exp(-0.003 * w * t) * sin(w * t);
        measured[i] = (i < HIT ? 0.0 : low + A * sin(phase)) + noise * signal_normal(&seed);
        if (i >= HIT) {
            phase += w * dt * (1.0 + hardening * A * A);
            A *= exp(-(0.003 + drag * A) * w * dt);
        }
    }
}

static void run(double hardening, double drag, double noise, bool driven, struct amplitude_curves *out)
{
    static double u[N], z[N], y[N], psd[BINS];
    struct model model;
    struct record record = {.n = N, .dt_s = dt};
    struct bf_error err;
    fixture_model(&model, "");
    memset(u, 0, sizeof u);
    for (size_t i = driven ? 0 : HIT - 4; i < (driven ? (size_t)N : HIT); i++)
        u[i] = 1.0;
    ring(hardening, drag, noise, z, y);
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "piezo_V", z);
    for (size_t k = 0; k < BINS; k++)
        psd[k] = noise * noise / 512.0;
    struct comparison_channel channel = {.name = "piezo_V", .n = N, .dt_s = dt, .predicted = y};
    channel.measured = record_column(&record, "piezo_V");
    channel.noise = (struct noise_estimate){.method = NOISE_LOCAL, .rms = noise, .n_bins = BINS, .psd = psd};
    channel.noise.df_Hz = 512.0 / (BINS - 1);
    const struct comparison comparison = {.model = &model,
                                          .records = &record,
                                          .n_records = 1,
                                          .n_modes = 2,
                                          .frequency_Hz = frequency_Hz,
                                          .n_channels = 1,
                                          .channels = &channel};
    assert_int_equal(amplitude_measure(&comparison, out, &err), BF_OK);
    record_free(&record);
    model_free(&model);
}

static const struct amplitude_curve *mode_of(const struct amplitude_curves *curves, size_t mode)
{
    for (size_t i = 0; i < curves->n; i++)
        if (curves->curves[i].mode == mode)
            return &curves->curves[i];
    fail_msg("no curve of mode %zu", mode);
    return NULL;
}

static void a_linear_decay_is_flat(void **state)
{
    (void)state;
    struct amplitude_curves a;
    run(0.0, 0.0, 1e-3, false, &a);
    const struct amplitude_curve *c = mode_of(&a, 2);
    for (size_t i = 0; i < c->n; i++) {
        assert_true(fabs(c->frequency_Hz[i] - 38.4) < 6.0 * c->frequency_sd_Hz[i] + 2e-3);
        assert_true(fabs(c->damping_ratio[i] - 0.003) < 6.0 * c->damping_sd[i] + 1e-5);
        assert_true(fabs(c->model_frequency_Hz[i] - 38.4) < 2e-3);
        assert_true(fabs(c->model_damping_ratio[i] - 0.003) < 1e-5);
        assert_true(i == 0 || c->amplitude[i] < c->amplitude[i - 1]);
    }
    assert_true(fabs(c->frequency_drift) < 6.0 * c->frequency_drift_sd);
    assert_string_equal(a.text, "");
    amplitude_free(&a);
}

static void standard_errors_are_right(void **state)
{
    (void)state;
    struct amplitude_curves a;
    run(0.0, 0.0, 2e-2, false, &a);
    const struct amplitude_curve *c = mode_of(&a, 2);
    double square = 0.0, damping = 0.0;
    for (size_t i = 0; i < c->n; i++) {
        square += pow((c->frequency_Hz[i] - 38.4) / c->frequency_sd_Hz[i], 2.0) / (double)c->n;
        damping += pow((c->damping_ratio[i] - 0.003) / c->damping_sd[i], 2.0) / (double)c->n;
    }
    assert_true(c->n >= 8);
    assert_true(square > 0.3 && square < 3.0);
    assert_true(damping > 0.3 && damping < 3.0);
    amplitude_free(&a);
}

static void a_hardening_mode_is_measured(void **state)
{
    (void)state;
    struct amplitude_curves a;
    run(0.01, 0.0, 1e-3, false, &a);
    const struct amplitude_curve *c = mode_of(&a, 2);
    for (size_t i = 0; i < c->n; i++) {
        const double truth = 38.4 * (1.0 + 0.01 * c->amplitude[i] * c->amplitude[i]);
        assert_true(fabs(c->frequency_Hz[i] - truth) < 0.02);
        assert_true(fabs(c->model_frequency_Hz[i] - 38.4) < 2e-3);
    }
    assert_true(c->frequency_drift > 0.003 && c->frequency_drift < 0.012);
    assert_true(fabs(mode_of(&a, 1)->frequency_drift) < 1e-3);
    assert_contains(a.text, "frequency of mode 2 rises");
    amplitude_free(&a);
}

static void damping_that_grows_is_measured(void **state)
{
    (void)state;
    struct amplitude_curves a;
    run(0.0, 0.004, 1e-3, false, &a);
    const struct amplitude_curve *c = mode_of(&a, 2);
    for (size_t i = 0; i < c->n; i++)
        assert_true(fabs(c->damping_ratio[i] - 0.003 - 0.004 * c->amplitude[i]) < 3e-4);
    assert_true(c->damping_drift > 0.001);
    assert_contains(a.text, "damping of mode 2 rises");
    amplitude_free(&a);
}

static void a_record_driven_to_its_end_has_no_curve(void **state)
{
    (void)state;
    struct amplitude_curves a;
    run(0.0, 0.0, 1e-3, true, &a);
    assert_int_equal(a.n, 0);
    amplitude_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_linear_decay_is_flat),
        cmocka_unit_test(standard_errors_are_right),
        cmocka_unit_test(a_hardening_mode_is_measured),
        cmocka_unit_test(damping_that_grows_is_measured),
        cmocka_unit_test(a_record_driven_to_its_end_has_no_curve),
    };
    return cmocka_run_group_tests_name("amplitude", tests, NULL, NULL);
}
