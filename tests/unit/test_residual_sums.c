/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Residuals in segments against the same in one piece: tests at their stated rates, shares, joined spectra and correlations. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "maths/maths.h"
#include "signals.h"

enum { SEGMENT = 4096, SEGMENTS = 8, N = SEGMENT * SEGMENTS, WINDOW = 64 };

static struct residual_sums sums_of(const double *z, const double *r, size_t n_segments)
{
    struct residual_sums sums;
    struct bf_error err;
    residual_sums_new(SEGMENT, 101, &sums);
    for (size_t s = 0; s < n_segments; s++)
        assert_int_equal(residual_sums_add(&sums, z + s * SEGMENT, r + s * SEGMENT, WINDOW, &err), BF_OK);
    assert_int_equal(sums.n, n_segments * SEGMENT);
    return sums;
}

static void false_alarms_are_nominal(void **state)
{
    (void)state;
    enum { SETS = 600 };
    static double x[4 * SEGMENT];
    int ljung_box = 0, periodogram = 0;
    for (unsigned set = 0; set < SETS; set++) {
        uint64_t seed = signal_seed(set);
        struct whiteness w;
        for (size_t i = 0; i < 4 * SEGMENT; i++)
            x[i] = signal_normal(&seed);
        struct residual_sums sums = sums_of(x, x, 4);
        residual_sums_whiteness(&sums, &w);
        ljung_box += w.ljung_box_p < 0.05;
        periodogram += w.periodogram_p < 0.05;
        residual_sums_free(&sums);
    }
    /* 5 % ± 4 standard errors (0.9 %) */
    assert_in_range(ljung_box, 0.014 * SETS, 0.086 * SETS);
    assert_in_range(periodogram, 0.014 * SETS, 0.086 * SETS);
}

static void colour_and_shares_are_those_of_the_whole(void **state)
{
    (void)state;
    static double z[N], r[N];
    const double edge[4] = {0.0, 30.0, 60.0, 256.0};
    double shares[2][3], rho[2][101];
    struct amplitude_shares amplitude[2];
    struct whiteness w[2];
    struct bf_error err;
    uint64_t seed = signal_seed(11);
    signal_ar2(&seed, 1.4, -0.9, 1.0, N, r);
    for (size_t i = 0; i < N; i++) { /* the motion swells and fades many times, the misfit with its square */
        const double size = 1.5 + sin(2.0 * M_PI * 23.0 * (double)i / N);
        z[i] = size * signal_normal(&seed);
        r[i] *= size * size;
    }
    struct residual_sums sums = sums_of(z, r, SEGMENTS);
    residual_sums_whiteness(&sums, &w[0]);
    residual_sums_bands(&sums, 1.0 / 512.0, edge, 4, shares[0]);
    residual_sums_autocorrelation(&sums, 101, rho[0]);
    residual_sums_amplitudes(&sums, &amplitude[0]);
    residual_sums_free(&sums);
    assert_int_equal(residual_whiteness(r, N, &w[1], &err), BF_OK);
    assert_int_equal(residual_band_shares(r, N, 1.0 / 512.0, edge, 4, shares[1], &err), BF_OK);
    assert_int_equal(residual_autocorrelation(r, N, 101, rho[1], &err), BF_OK);
    assert_int_equal(residual_amplitude_shares(z, r, N, WINDOW, &amplitude[1], &err), BF_OK);
    assert_true(fabs(w[0].ljung_box / w[1].ljung_box - 1.0) < 0.01);
    assert_true(fabs(w[0].periodogram_ks - w[1].periodogram_ks) < 0.005);
    for (int i = 0; i < 3; i++) {
        if (!(fabs(shares[0][i] - shares[1][i]) < 0.01)) /* the resonance is correlated over 20 of 4096 samples */
            fail_msg("band %d: %g in segments, %g in one", i, shares[0][i], shares[1][i]);
        assert_true(fabs(amplitude[0].share[i] - amplitude[1].share[i]) < 0.005);
        assert_true(fabs(amplitude[0].relative[i] / amplitude[1].relative[i] - 1.0) < 0.01);
    }
    for (int k = 0; k < 101; k++)
        assert_true(fabs(rho[0][k] - rho[1][k]) < 0.01);
}

static void nothing_has_no_shares(void **state)
{
    (void)state;
    static const double zero[SEGMENT];
    struct whiteness w;
    struct amplitude_shares amplitude;
    double rho[3];
    struct residual_sums sums = sums_of(zero, zero, 1);
    residual_sums_whiteness(&sums, &w);
    residual_sums_amplitudes(&sums, &amplitude);
    residual_sums_autocorrelation(&sums, 3, rho);
    assert_true(w.p_value >= 1.0 && rho[0] <= 0.0 && rho[2] <= 0.0);
    for (int i = 0; i < 3; i++)
        assert_true(amplitude.share[i] <= 0.0 && amplitude.relative[i] <= 0.0);
    residual_sums_free(&sums);
}

/* The input has power in one segment of three, and what follows it does so seven samples later. */
static void correlations_and_coherence_join(void **state)
{
    (void)state;
    static double u[3 * SEGMENT], y[3 * SEGMENT];
    struct input_correlation part[3], all;
    struct cross_spectrum sum = {0}, one;
    const size_t n[3] = {SEGMENT, SEGMENT, SEGMENT};
    struct bf_error err;
    uint64_t seed = signal_seed(5);
    for (size_t i = 0; i < 3 * SEGMENT; i++) {
        u[i] = (i / SEGMENT == 1 ? 10.0 : 1.0) * signal_normal(&seed);
        y[i] = signal_normal(&seed) + (i >= 7 ? 0.3 * u[i - 7] : 0.0);
    }
    for (size_t s = 0; s < 3; s++) {
        assert_int_equal(residual_input_correlation(u + s * SEGMENT, y + s * SEGMENT, SEGMENT, 50, &part[s], &err),
                         BF_OK);
        assert_int_equal(spectrum_cross(u + s * SEGMENT, y + s * SEGMENT, SEGMENT, 1.0, 256, &one, &err), BF_OK);
        cross_spectrum_join(&sum, &one);
        cross_spectrum_free(&one);
    }
    residual_input_correlations_join(part, n, 3, &all);
    assert_int_equal(all.largest_lag, 7);
    assert_true(all.p_value < 1e-9 && fabs(all.bound_lag * sqrt(3.0) / part[0].bound_lag - 1.0) < 1e-12);
    for (size_t i = 0; i < 101; i++)
        assert_true(fabs(all.rho[i] - (part[0].rho[i] + part[1].rho[i] + part[2].rho[i]) / 3.0) < 1e-14);
    assert_int_equal(sum.n_segments, 93);
    assert_true(sum.steadiness * 93.0 > 12.0 &&
                sum.steadiness * 93.0 < 26.0); /* about 31 segments of noise, of which half is steady */
    /* |H|² Σ u² over all power of y: 0.09 · 34/(1 + 0.09 · 34) */
    double mean = 0.0;
    for (size_t k = 1; k < sum.n_bins; k++)
        mean += coherence(&sum, k) / (double)(sum.n_bins - 1);
    assert_true(fabs(mean - 0.754) < 0.03);
    for (size_t s = 0; s < 3; s++)
        input_correlation_free(&part[s]);
    input_correlation_free(&all);
    cross_spectrum_free(&sum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(false_alarms_are_nominal), cmocka_unit_test(colour_and_shares_are_those_of_the_whole),
        cmocka_unit_test(nothing_has_no_shares), cmocka_unit_test(correlations_and_coherence_join)};
    return cmocka_run_group_tests_name("residual sums", tests, NULL, NULL);
}
