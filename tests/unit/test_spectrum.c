/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <pthread.h>
#include <string.h>
#include "signals.h"
#include "maths/maths.h"
#include "maths/spectrum.h"

static const struct fft *plan_for(size_t n)
{
    const struct fft *plan;
    struct bf_error err;
    assert_int_equal(fft_get(n, &plan, &err), BF_OK);
    assert_int_equal(fft_size(plan), n);
    return plan;
}

static void good_sizes_are_even_and_smooth(void **state)
{
    (void)state;
    for (size_t n = 0; n < 3000; n++) {
        const size_t good = fft_good_size(n);
        size_t rest = good;
        assert_true(good >= n && good >= 2 && good % 2 == 0);
        for (size_t p = 2; p <= 5; p++)
            while (rest % p == 0)
                rest /= p;
        assert_int_equal(rest, 1);
        assert_true(n < 2 || good < 2 * n);
    }
    assert_int_equal(fft_good_size(4096), 4096);
    assert_int_equal(fft_good_size(4097), 4320);
}

/* Against the definition, at sizes with and without small factors, at any alignment. */
static void forward_is_the_definition(void **state)
{
    (void)state;
    const size_t sizes[] = {1, 2, 3, 30, 31, 100};
    uint64_t seed = signal_seed(1);
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        const size_t n = sizes[s];
        double memory[102];
        double complex X[52];
        for (size_t shift = 0; shift < 2; shift++) {
            double *x = memory + shift;
            for (size_t i = 0; i < n; i++)
                x[i] = signal_normal(&seed);
            fft_forward(plan_for(n), x, X + shift);
            for (size_t k = 0; k <= n / 2; k++) {
                double complex sum = 0.0;
                for (size_t m = 0; m < n; m++)
                    sum += x[m] * cexp(CMPLX(0.0, -2.0 * M_PI * (double)(k * m) / (double)n));
                assert_true(cabs(sum - X[k + shift]) < 1e-12 * (double)n);
            }
        }
    }
}

static void parseval_and_inverse(void **state)
{
    (void)state;
    const size_t n = 1080;
    double x[1080], back[1080], energy = 0.0, spectral = 0.0;
    double complex X[541], kept[541];
    uint64_t seed = signal_seed(2);
    for (size_t i = 0; i < n; i++) {
        x[i] = signal_normal(&seed);
        energy += x[i] * x[i];
    }
    memcpy(back, x, sizeof x);
    fft_forward(plan_for(n), x, X);
    assert_memory_equal(back, x, sizeof x);
    for (size_t k = 0; k <= n / 2; k++)
        spectral += (k == 0 || k == n / 2 ? 1.0 : 2.0) * creal(X[k] * conj(X[k])) / (double)n;
    assert_true(fabs(spectral / energy - 1.0) < 1e-13);
    memcpy(kept, X, sizeof X);
    fft_inverse(plan_for(n), X, back);
    assert_memory_equal(kept, X, sizeof X);
    for (size_t i = 0; i < n; i++)
        assert_true(fabs(back[i] - x[i]) < 1e-13 * 10.0);
}

static void impossible_sizes_are_refused(void **state)
{
    (void)state;
    const struct fft *plan;
    struct bf_error err;
    assert_int_equal(fft_get(0, &plan, &err), BF_NUMERIC);
    assert_null(plan);
    assert_int_equal(fft_get(SIZE_MAX, &plan, &err), BF_NUMERIC);
    assert_non_null(strstr(err.text, "samples"));
}

static void *many_plans(void *failed)
{
    double x[600];
    double complex X[301];
    struct bf_error err;
    for (size_t i = 0; i < 600; i++)
        x[i] = (double)(i % 17);
    for (size_t n = 300; n < 600; n += 3) {
        const struct fft *plan;
        double back[600];
        if (fft_get(n, &plan, &err) != BF_OK)
            *(int *)failed = 1;
        fft_forward(plan, x, X);
        fft_inverse(plan, X, back);
        for (size_t i = 0; i < n; i++)
            if (fabs(back[i] - x[i]) > 1e-12)
                *(int *)failed = 1;
    }
    return NULL;
}

static void threads_share_plans(void **state)
{
    (void)state;
    pthread_t threads[4];
    int failed[4] = {0};
    for (int i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, many_plans, &failed[i]), 0);
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(failed[i], 0);
    }
}

static void a_sinusoid_shows_its_amplitude(void **state)
{
    (void)state;
    const enum window windows[] = {WINDOW_NONE, WINDOW_HANN, WINDOW_BLACKMAN_HARRIS};
    double x[1000], amplitude[501];
    struct bf_error err;
    for (size_t i = 0; i < 1000; i++)
        x[i] = 3.0 * sin(2.0 * M_PI * 100.0 * (double)i / 1000.0 + 0.7) + 1e-3 * cos(2.0 * M_PI * 0.3 * (double)i);
    for (int w = 0; w < 3; w++) {
        assert_int_equal(spectrum_amplitude(x, 1000, windows[w], amplitude, &err), BF_OK);
        assert_true(fabs(amplitude[100] - 3.0) < 1e-12);
        assert_true(fabs(amplitude[300] - 1e-3) < (w == 0 ? 1e-12 : 1e-6));
        assert_true(amplitude[150] < 2e-4 * 3.0);
    }
}

/* The one-sided density integrates to the variance; a pure tone's too. */
static void density_integrates_to_variance(void **state)
{
    (void)state;
    static double x[8192];
    struct cross_spectrum s;
    struct bf_error err;
    uint64_t seed = signal_seed(3);
    signal_ar2(&seed, 1.2, -0.6, 1.0, 8192, x);
    for (size_t i = 0; i < 8192; i++)
        x[i] += 5.0; /* a mean must not matter */
    assert_int_equal(spectrum_cross(x, NULL, 8192, 0.01, 512, &s, &err), BF_OK);
    double sum = 0.0, variance = 0.0;
    for (size_t k = 0; k < s.n_bins; k++)
        sum += s.pxx[k] * s.df_Hz;
    for (size_t i = 0; i < 8192; i++)
        variance += (x[i] - 5.0) * (x[i] - 5.0) / 8192.0;
    assert_true(fabs(sum / variance - 1.0) < 0.05);
    assert_true(fabs(s.df_Hz - 100.0 / 512.0) < 1e-12);
    assert_int_equal(s.n_segments, 31);
    assert_true(s.averages > 25.0 && s.averages <= 31.0);
    assert_null(s.pxy);
    assert_true(coherence(&s, 3) >= 0.0 && coherence(&s, 3) <= 0.0);
    cross_spectrum_free(&s);
}

/* y = x + noise of ratio q: coherence 1/(1 + q²) in every bin; none below the bound by chance only. */
static void coherence_of_a_known_ratio(void **state)
{
    (void)state;
    enum { N = 65536 };
    double *x = malloc(N * sizeof *x), *y = malloc(N * sizeof *y), mean = 0.0;
    struct cross_spectrum s;
    struct bf_error err;
    uint64_t seed = signal_seed(4);
    for (size_t i = 0; i < N; i++) {
        x[i] = signal_normal(&seed);
        y[i] = x[i] + 0.5 * signal_normal(&seed);
    }
    assert_int_equal(spectrum_cross(x, y, N, 1.0, 256, &s, &err), BF_OK);
    for (size_t k = 1; k + 1 < s.n_bins; k++)
        mean += coherence(&s, k) / (double)(s.n_bins - 2);
    assert_true(fabs(mean - 0.8) < 0.01);
    cross_spectrum_free(&s);
    int above = 0;
    for (size_t i = 0; i < N; i++)
        y[i] = signal_normal(&seed);
    assert_int_equal(spectrum_cross(x, y, N, 1.0, 2048, &s, &err), BF_OK);
    for (size_t k = 1; k + 1 < s.n_bins; k++)
        above += coherence(&s, k) > coherence_bound(&s, 0.05);
    const double share = above / (double)(s.n_bins - 2);
    assert_true(share > 0.03 && share < 0.07);
    cross_spectrum_free(&s);
    free(x);
    free(y);
}

static void default_segments_and_short_records(void **state)
{
    (void)state;
    double x[100] = {0};
    struct cross_spectrum s;
    struct bf_error err;
    x[3] = 1.0;
    assert_int_equal(spectrum_cross(x, x, 100, 1.0, 0, &s, &err), BF_OK);
    assert_true(s.n_segments >= 7 && s.n_segments <= 10);
    cross_spectrum_free(&s);
    assert_int_equal(spectrum_cross(x, x, 5, 1.0, 0, &s, &err), BF_OK);
    assert_true(coherence_bound(&s, 0.05) >= 1.0);
    cross_spectrum_free(&s);
    assert_int_equal(spectrum_cross(x, x, 3, 1.0, 0, &s, &err), BF_NUMERIC);
    assert_int_equal(spectrum_cross(x, x, 100, 1.0, 101, &s, &err), BF_NUMERIC);
}

/* A record that begins and ends in motion: exact on the samples, right between them away from the ends. */
static void resampling_is_band_limited(void **state)
{
    (void)state;
    enum { N = 700, L = 4 };
    double x[N], y[N * L], worst = 0.0;
    struct bf_error err;
    for (size_t i = 0; i < N; i++)
        x[i] = sin(0.9 * (double)i + 0.3) + 0.5 * cos(0.11 * (double)i) + 2.0;
    assert_int_equal(resample_band_limited(x, N, L, y, &err), BF_OK);
    for (size_t i = 0; i < N; i++)
        assert_true(fabs(y[L * i] - x[i]) < 1e-12);
    for (size_t i = 100 * L; i < (N - 100) * L; i++) {
        const double t = (double)i / L;
        worst = fmax(worst, fabs(y[i] - (sin(0.9 * t + 0.3) + 0.5 * cos(0.11 * t) + 2.0)));
    }
    assert_true(worst < 5e-3);
    assert_int_equal(resample_band_limited(x, N, 1, y, &err), BF_OK);
    for (size_t i = 0; i < N; i++)
        assert_true(fabs(y[i] - x[i]) < 1e-12);
}

static void correlation_is_the_sum(void **state)
{
    (void)state;
    double x[50], y[50], c[50];
    struct bf_error err;
    uint64_t seed = signal_seed(5);
    for (size_t i = 0; i < 50; i++) {
        x[i] = signal_normal(&seed);
        y[i] = signal_normal(&seed);
    }
    assert_int_equal(correlate(x, y, 50, 50, c, &err), BF_OK);
    for (size_t lag = 0; lag < 50; lag++) {
        double sum = 0.0;
        for (size_t t = 0; t + lag < 50; t++)
            sum += x[t] * y[t + lag];
        assert_true(fabs(sum - c[lag]) < 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_sizes_are_even_and_smooth),
        cmocka_unit_test(forward_is_the_definition),
        cmocka_unit_test(parseval_and_inverse),
        cmocka_unit_test(impossible_sizes_are_refused),
        cmocka_unit_test(threads_share_plans),
        cmocka_unit_test(a_sinusoid_shows_its_amplitude),
        cmocka_unit_test(density_integrates_to_variance),
        cmocka_unit_test(coherence_of_a_known_ratio),
        cmocka_unit_test(default_segments_and_short_records),
        cmocka_unit_test(resampling_is_band_limited),
        cmocka_unit_test(correlation_is_the_sum),
    };
    return cmocka_run_group_tests_name("spectrum", tests, NULL, NULL);
}
