/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "maths/maths.h"
#include "ar_autocovariance.h"
#include "signals.h"

static void nrmse_of_known_signals(void **state)
{
    (void)state;
    const double z[4] = {3.0, -4.0, 0.0, 0.0}, y[4] = {3.0, -4.0, 0.0, 5.0}, zero[4] = {0};
    assert_true(fabs(residual_nrmse(z, y, 4) - 1.0) < 1e-15);
    assert_true(residual_nrmse(z, z, 4) <= 0.0);
    assert_true(residual_nrmse(zero, zero, 4) <= 0.0);
    assert_true(isinf(residual_nrmse(zero, y, 4)));
    assert_true(fabs(root_mean_square(z, 4) - 2.5) < 1e-15);
    assert_true(root_mean_square(z, 0) <= 0.0);
}

/* The median does not see two wild values of nine; the deviation is that of a normal variable with the same median distance. */
static void medians_do_not_see_wild_values(void **state)
{
    (void)state;
    double odd[] = {3.0, -1e9, 1.0, 5.0, 2.0, 4.0, 1e9, 2.5, 3.5}, even[] = {4.0, 1.0, 3.0, 2.0}, middle;
    const double kept[] = {0.0, 1.0, 2.0, 3.0, 1e9};
    assert_true(fabs(median(9, odd) - 3.0) < 1e-15);
    assert_true(fabs(median(4, even) - 2.5) < 1e-15);
    assert_true(isnan(median(0, NULL)));
    assert_true(fabs(robust_deviation(5, kept, &middle) - 1.0 / 0.6744897501960817) < 1e-12);
    assert_true(fabs(middle - 2.0) < 1e-15);
    enum { MANY = 20000 };
    static double x[MANY];
    uint64_t seed = signal_seed(5);
    for (size_t i = 0; i < MANY; i++)
        x[i] = 7.0 + 0.3 * signal_normal(&seed) * (i % 20 == 0 ? 100.0 : 1.0);
    assert_true(fabs(robust_deviation(MANY, x, &middle) / 0.3 - 1.0) < 0.1);
    assert_true(fabs(middle - 7.0) < 0.02);
}

static void distributions_match_tables(void **state)
{
    (void)state;
    /* Abramowitz & Stegun, tables 26.8 and 26.5 */
    assert_true(fabs(chi_square_tail(3.841458820694124, 1.0) - 0.05) < 1e-12);
    assert_true(fabs(chi_square_tail(37.652484133, 25.0) - 0.05) < 1e-9);
    assert_true(fabs(chi_square_tail(11.523975372, 25.0) - 0.99) < 1e-9);
    assert_true(fabs(chi_square_tail(4.0, 2.0) - exp(-2.0)) < 1e-15);
    assert_true(chi_square_tail(0.0, 3.0) >= 1.0 && chi_square_tail(INFINITY, 3.0) <= 0.0);
    assert_true(chi_square_tail(1e4, 10.0) >= 0.0 && chi_square_tail(1e4, 10.0) < 1e-300);
}

/* Closed forms: F(2, m), F(1, 1); many degrees of freedom below are χ². */
static void f_tail_is_the_tables(void **state)
{
    (void)state;
    assert_true(fabs(f_tail(4.102821015, 2.0, 10.0) - 0.05) < 1e-9);
    for (double x = 0.01; x < 1e4; x *= 3.0) {
        assert_true(fabs(f_tail(x, 2.0, 7.0) / pow(1.0 + 2.0 * x / 7.0, -3.5) - 1.0) < 1e-11);
        assert_true(fabs(f_tail(x, 1.0, 1.0) - (1.0 - 2.0 / M_PI * atan(sqrt(x)))) < 1e-13);
    }
    assert_true(fabs(f_tail(2.0, 5.0, 1e9) / chi_square_tail(10.0, 5.0) - 1.0) < 1e-6);
    assert_true(f_tail(0.0, 3.0, 4.0) >= 1.0 && f_tail(INFINITY, 3.0, 4.0) <= 0.0);
}

static void ar_model_is_recovered(void **state)
{
    (void)state;
    enum { N = 20000 };
    double *x = malloc(N * sizeof *x);
    uint64_t seed = signal_seed(1);
    struct ar_model model;
    signal_ar2(&seed, 1.5, -0.85, 0.3, N, x);
    ar_fit(x, N, &model);
    assert_int_equal(model.order, 2);
    assert_true(fabs(model.a[0] - 1.5) < 0.02 && fabs(model.a[1] + 0.85) < 0.02);
    assert_true(fabs(model.sigma / 0.3 - 1.0) < 0.02);
    free(x);
}

static void white_noise_has_order_zero(void **state)
{
    (void)state;
    double x[2000];
    int zero = 0;
    for (unsigned s = 0; s < 50; s++) {
        uint64_t seed = signal_seed(s);
        struct ar_model model;
        signal_ar2(&seed, 0.0, 0.0, 2.0, 2000, x);
        ar_fit(x, 2000, &model);
        zero += model.order == 0;
        assert_true(fabs(model.sigma / 2.0 - 1.0) < 0.08);
    }
    assert_true(zero >= 45);
}

static void ar_of_nothing_and_of_constants(void **state)
{
    (void)state;
    double x[64] = {0};
    struct ar_model model;
    ar_fit(x, 0, &model);
    assert_int_equal(model.order, 0);
    ar_fit(x, 64, &model);
    assert_true(model.order == 0 && model.sigma <= 0.0);
    ar_whiten(&model, x, 64, x); /* must not divide by zero */
    assert_true(x[10] >= 0.0 && x[10] <= 0.0);
    for (int i = 0; i < 64; i++)
        x[i] = sin(0.5 * i); /* perfectly predictable */
    ar_fit(x, 64, &model);
    assert_true(isfinite(model.sigma) && model.sigma >= 0.0);
    for (int i = 0; i < AR_MAX; i++)
        assert_true(isfinite(model.a[i]));
}

/* Against the Yule–Walker equations and the closed form of AR(2) variance; the density integrates to the variance. */
static void covariance_and_density_agree(void **state)
{
    (void)state;
    const struct ar_model m = {.order = 2, .a = {1.2, -0.7}, .sigma = 0.5};
    double c[40], sum = 0.0;
    ar_autocovariance(&m, 40, c);
    const double phi1 = 1.2, phi2 = -0.7;
    const double variance = 0.25 * (1.0 - phi2) / ((1.0 + phi2) * ((1.0 - phi2) * (1.0 - phi2) - phi1 * phi1));
    assert_true(fabs(c[0] / variance - 1.0) < 1e-12);
    assert_true(fabs(c[1] - phi1 / (1.0 - phi2) * c[0]) < 1e-12);
    for (int k = 2; k < 40; k++)
        assert_true(fabs(c[k] - phi1 * c[k - 1] - phi2 * c[k - 2]) < 1e-12);
    const double dt = 0.01, df = 50.0 / 20000.0;
    for (int k = 0; k < 20000; k++)
        sum += ar_psd(&m, dt, ((double)k + 0.5) * df) * df;
    assert_true(fabs(sum / c[0] - 1.0) < 1e-6);
    const struct ar_model white = {.order = 0, .sigma = 3.0};
    ar_autocovariance(&white, 3, c);
    assert_true(fabs(c[0] - 9.0) < 1e-12 && fabs(c[1]) <= 0.0 && fabs(c[2]) <= 0.0);
}

/* W C Wᵀ = 1, exactly, the first samples included. */
static void whitening_is_exact(void **state)
{
    (void)state;
    enum { N = 12 };
    const struct ar_model m = {.order = 3, .a = {0.9, -0.4, 0.2}, .sigma = 1.7};
    double c[N], w[N][N], product[N][N];
    ar_autocovariance(&m, N, c);
    for (int j = 0; j < N; j++) { /* row j: W applied to column j of C */
        double column[N];
        for (int i = 0; i < N; i++)
            column[i] = c[abs(i - j)];
        ar_whiten(&m, column, N, w[j]);
    }
    for (int i = 0; i < N; i++) {
        double row[N];
        for (int j = 0; j < N; j++)
            row[j] = w[j][i];
        ar_whiten(&m, row, N, row); /* in place */
        memcpy(product[i], row, sizeof row);
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            assert_true(fabs(product[i][j] - (i == j ? 1.0 : 0.0)) < 1e-12);
}

static void whiteness_false_alarms_are_nominal(void **state)
{
    (void)state;
    enum { SETS = 2000, N = 500 };
    double x[N];
    int both = 0, ljung_box = 0, periodogram = 0, outside = 0, lags = 0;
    struct bf_error err;
    for (unsigned s = 0; s < SETS; s++) {
        uint64_t seed = signal_seed(s);
        struct whiteness w;
        double rho[11];
        for (size_t i = 0; i < N; i++)
            x[i] = signal_normal(&seed);
        assert_int_equal(residual_whiteness(x, N, &w, &err), BF_OK);
        both += w.p_value < 0.05;
        ljung_box += w.ljung_box_p < 0.05;
        periodogram += w.periodogram_p < 0.05;
        assert_int_equal(residual_autocorrelation(x, N, 11, rho, &err), BF_OK);
        for (int k = 1; k <= 10; k++, lags++)
            outside += fabs(rho[k]) > w.correlation_bound;
        assert_true(fabs(w.correlation_bound * sqrt((double)N) - 1.959963984540054) < 1e-12);
    }
    /* 5 % ± 4 standard errors (0.5 %) of the simulation */
    assert_in_range(ljung_box, 0.03 * SETS, 0.07 * SETS);
    assert_in_range(periodogram, 0.03 * SETS, 0.07 * SETS);
    assert_in_range(both, 0.02 * SETS, 0.06 * SETS);
    assert_in_range(outside, 0.04 * lags, 0.06 * lags);
}

static void whiteness_sees_colour_and_tones(void **state)
{
    (void)state;
    double x[2000];
    struct whiteness w;
    struct bf_error err;
    uint64_t seed = signal_seed(7);
    signal_ar2(&seed, 0.2, 0.0, 1.0, 2000, x);
    assert_int_equal(residual_whiteness(x, 2000, &w, &err), BF_OK);
    assert_true(w.p_value < 1e-6);
    for (size_t i = 0; i < 2000; i++)
        x[i] = signal_normal(&seed) + 0.45 * sin(0.8 * (double)i);
    assert_int_equal(residual_whiteness(x, 2000, &w, &err), BF_OK);
    assert_true(w.periodogram_p < 1e-3);
}

static void whiteness_of_too_little(void **state)
{
    (void)state;
    double x[30] = {1.0, -1.0};
    struct whiteness w;
    struct bf_error err;
    assert_int_equal(residual_whiteness(x, 19, &w, &err), BF_OK);
    assert_true(w.p_value >= 1.0);
    x[0] = x[1] = 0.0;
    assert_int_equal(residual_whiteness(x, 30, &w, &err), BF_OK);
    assert_true(w.p_value >= 1.0);
}

/* Coloured residual, coloured input, unrelated: the bounds hold because both are whitened. */
static void input_correlation_false_alarms(void **state)
{
    (void)state;
    enum { SETS = 300, N = 1000, LAGS = 40 };
    double u[N], r[N];
    int any = 0, single = 0;
    struct bf_error err;
    for (unsigned s = 0; s < SETS; s++) {
        uint64_t seed = signal_seed(s);
        struct input_correlation c;
        signal_ar2(&seed, 0.8, 0.0, 1.0, N, u);
        signal_ar2(&seed, 1.3, -0.6, 1.0, N, r);
        assert_int_equal(residual_input_correlation(u, r, N, LAGS, &c, &err), BF_OK);
        any += c.p_value < 0.01;
        assert_int_equal(c.p_value<0.01, c.largest> c.bound_all);
        for (size_t i = 0; i < 2 * LAGS + 1; i++)
            single += fabs(c.rho[i]) > c.bound_lag;
        assert_true(fabs(c.bound_lag * sqrt((double)N) - 2.575829303548901) < 1e-12);
        input_correlation_free(&c);
    }
    assert_true(any <= 9); /* 3 expected; P(more than 9) < 1e-3 */
    assert_in_range(single, 0.005 * SETS * (2 * LAGS + 1), 0.014 * SETS * (2 * LAGS + 1));
}

static void input_correlation_finds_the_lag(void **state)
{
    (void)state;
    enum { N = 1000 };
    double u[N], r[N];
    struct input_correlation c;
    struct bf_error err;
    uint64_t seed = signal_seed(11);
    for (size_t i = 0; i < N; i++) {
        u[i] = signal_normal(&seed);
        r[i] = signal_normal(&seed);
    }
    for (size_t i = 7; i < N; i++)
        r[i] += 0.5 * u[i - 7];
    assert_int_equal(residual_input_correlation(u, r, N, 20, &c, &err), BF_OK);
    assert_int_equal(c.largest_lag, 7);
    assert_true(c.p_value < 1e-9);
    double sum = 0.0;
    for (size_t i = 7; i < N; i++)
        sum += u[i - 7] * r[i];
    assert_true(c.rho[27] > 0.3 && fabs(c.rho[27] - sum / (N * signal_rms(u, N) * signal_rms(r, N))) < 0.05);
    input_correlation_free(&c);
    memset(u, 0, sizeof u);
    assert_int_equal(residual_input_correlation(u, r, N, 20, &c, &err), BF_OK);
    assert_true(c.p_value >= 1.0 && c.largest <= 0.0);
    input_correlation_free(&c);
    assert_int_equal(residual_input_correlation(u, r, 40, 20, &c, &err), BF_NUMERIC);
    assert_null(c.rho);
}

/* r = response of an oscillator to u, moved by `later` samples; noise of 1e-3. */
static void respond(const double u[], size_t n, long later, uint64_t *seed, double r[])
{
    double w = 0.0, w1 = 0.0, w2 = 0.0;
    for (size_t i = 0; i < n; i++)
        r[i] = 1e-3 * signal_normal(seed);
    for (size_t i = 0; i < n; i++) {
        w = u[i] + 1.6 * w1 - 0.95 * w2;
        w2 = w1;
        w1 = w;
        if ((long)i + later >= 0 && (long)i + later < (long)n)
            r[(long)i + later] += w;
    }
}

/* A hit is no white input: the residual after it must not be said to run ahead; one that does must. */
static void only_a_residual_that_runs_ahead_is_said_to(void **state)
{
    (void)state;
    enum { N = 2000, LAGS = 100 };
    double hit[N] = {0}, white[N], r[N];
    struct input_correlation c;
    struct bf_error err;
    uint64_t seed = signal_seed(31);
    for (size_t i = 0; i < N; i++) {
        white[i] = signal_normal(&seed);
        hit[i] = i >= 100 && i < 105 ? sin(M_PI * (double)(i - 100) / 5.0) : 0.0;
    }
    for (long later = 0; later < 3; later++) {
        const double *u = later == 0 ? white : hit;
        respond(u, N, later, &seed, r);
        assert_int_equal(residual_input_correlation(u, r, N, LAGS, &c, &err), BF_OK);
        assert_true(c.p_value < 1e-6 && c.largest_lag >= -c.alike);
        input_correlation_free(&c);
        respond(u, N, -40, &seed, r);
        assert_int_equal(residual_input_correlation(u, r, N, LAGS, &c, &err), BF_OK);
        assert_true(c.p_value < 1e-6 && c.largest_lag < -c.alike);
        input_correlation_free(&c);
    }
}

static void band_shares_add_up(void **state)
{
    (void)state;
    enum { N = 1001 };
    double r[N], share[4], sum = 0.0;
    const double edges[5] = {0.0, 5.0, 20.0, 30.0, 50.0};
    struct bf_error err;
    for (size_t i = 0; i < N; i++) {
        const double t = 0.01 * (double)i;
        r[i] = 2.0 * sin(2.0 * M_PI * 10.0 * t) + sin(2.0 * M_PI * 40.0 * t);
    }
    assert_int_equal(residual_band_shares(r, N, 0.01, edges, 5, share, &err), BF_OK);
    for (int i = 0; i < 4; i++)
        sum += share[i];
    assert_true(fabs(sum - 1.0) < 1e-12);
    assert_true(fabs(share[1] - 0.8) < 0.01 && fabs(share[3] - 0.2) < 0.01);
    memset(r, 0, sizeof r);
    assert_int_equal(residual_band_shares(r, N, 0.01, edges, 5, share, &err), BF_OK);
    assert_true(share[0] <= 0.0 && share[3] <= 0.0);
}

static void band_edges_lie_between_modes(void **state)
{
    (void)state;
    const double f[5] = {6.6, 38.4, 95.5, 178.7, 305.2};
    double edge[12];
    assert_int_equal(residual_band_edges(f, 5, 1.0 / 1024.0, edge), 6);
    assert_true(edge[0] <= 0.0 && fabs(edge[1] - sqrt(6.6 * 38.4)) < 1e-12 && fabs(edge[5] - 512.0) < 1e-12);
    assert_int_equal(residual_band_edges(f, 5, 1.0 / 256.0, edge), 4); /* modes above 128 Hz make no edge */
    assert_true(fabs(edge[3] - 128.0) < 1e-12);
    /* a free beam: the rounding of its rigid motions makes no edge */
    const double free_beam[5] = {0.0, 3e-4, 26.7, 69.0, 138.0};
    assert_int_equal(residual_band_edges(free_beam, 5, 1.0 / 1024.0, edge), 4);
    assert_true(fabs(edge[1] - sqrt(26.7 * 69.0)) < 1e-9);
    const size_t octaves = residual_band_edges(NULL, 0, 1.0 / 1024.0, edge);
    assert_int_equal(octaves, 10);
    assert_true(fabs(edge[1] - 2.0) < 1e-12 && fabs(edge[8] - 256.0) < 1e-12 && fabs(edge[9] - 512.0) < 1e-12);
}

static void shares_by_time_and_amplitude(void **state)
{
    (void)state;
    enum { N = 900 };
    double z[N], r[N], share[3];
    struct amplitude_shares a;
    struct bf_error err;
    for (size_t i = 0; i < N; i++) { /* motion of amplitudes 9, 3, 1; a misfit that grows with its square */
        const double size = i < 300 ? 9.0 : i < 600 ? 3.0 : 1.0;
        z[i] = size * sin(0.5 * (double)i);
        r[i] = 0.01 * size * size * cos(0.5 * (double)i);
    }
    residual_time_shares(r, N, share);
    assert_true(fabs(share[0] + share[1] + share[2] - 1.0) < 1e-12 && share[0] > 0.98);
    assert_int_equal(residual_amplitude_shares(z, r, N, 31, &a, &err), BF_OK);
    assert_true(fabs(a.relative[0] - 0.01) < 0.002);
    assert_true(fabs(a.relative[1] - 0.03) < 0.005);
    assert_true(fabs(a.relative[2] - 0.09) < 0.005);
    assert_true(a.share[2] > 0.95);
    assert_int_equal(residual_amplitude_shares(z, r, 2, 31, &a, &err), BF_NUMERIC);
}

/*
 * A clamp that shakes at 3.8 Hz moves a beam of 5.6 Hz, too, and what a model leaves rings at the higher modes: sharper lines than the one that is looked
 * for, which is the largest. The other channel has another scale, and hum far below its ringing.
 */
static void lines_are_the_largest_and_the_most_prominent(void **state)
{
    (void)state;
    enum { M = 3000 };
    static double a[M], b[M];
    struct bf_error err;
    const double dt = 1.0 / 1024.0, damping = 0.15;
    uint64_t seed = signal_seed(44);
    for (size_t i = 0; i < M; i++) {
        const double t = (double)i * dt, fall = exp(-damping * t);
        a[i] = sin(2.0 * M_PI * 3.8 * t) + fall * (0.5 * sin(2.0 * M_PI * 5.6 * t) + 0.1 * sin(2.0 * M_PI * 34.0 * t)) +
               0.08 * fall * (sin(2.0 * M_PI * 91.0 * t) + sin(2.0 * M_PI * 175.0 * t) + sin(2.0 * M_PI * 290.0 * t)) +
               1e-3 * signal_normal(&seed);
        b[i] = 1e3 * (a[i] + 0.01 * sin(2.0 * M_PI * 50.0 * t));
    }
    const struct residual_channel channels[2] = {{a, M, dt, 1e-3}, {b, M, dt, 1.0}};
    double lines_Hz[10];
    size_t n;
    bool low = false, hum = false;
    assert_int_equal(residual_lines(channels, 2, 0.0, INFINITY, 10, lines_Hz, &n, &err), BF_OK);
    assert_int_equal(n, 10);
    for (size_t i = 0; i < n; i++) {
        low = low || (i < 6 && fabs(lines_Hz[i] - 3.8) < 0.1);
        hum = hum || fabs(lines_Hz[i] - 50.0) < 0.1;
    }
    assert_true(low && hum);
    assert_int_equal(residual_lines(channels, 2, 80.0, 200.0, 2, lines_Hz, &n, &err), BF_OK);
    assert_int_equal(n, 2);
    assert_true(lines_Hz[0] > 80.0 && lines_Hz[0] < 200.0 && lines_Hz[1] > 80.0 && lines_Hz[1] < 200.0);
    assert_int_equal(residual_lines(channels, 0, 0.0, INFINITY, 10, lines_Hz, &n, &err), BF_OK);
    assert_int_equal(n, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nrmse_of_known_signals),
        cmocka_unit_test(medians_do_not_see_wild_values),
        cmocka_unit_test(distributions_match_tables),
        cmocka_unit_test(f_tail_is_the_tables),
        cmocka_unit_test(ar_model_is_recovered),
        cmocka_unit_test(white_noise_has_order_zero),
        cmocka_unit_test(ar_of_nothing_and_of_constants),
        cmocka_unit_test(covariance_and_density_agree),
        cmocka_unit_test(whitening_is_exact),
        cmocka_unit_test(whiteness_false_alarms_are_nominal),
        cmocka_unit_test(whiteness_sees_colour_and_tones),
        cmocka_unit_test(whiteness_of_too_little),
        cmocka_unit_test(input_correlation_false_alarms),
        cmocka_unit_test(input_correlation_finds_the_lag),
        cmocka_unit_test(only_a_residual_that_runs_ahead_is_said_to),
        cmocka_unit_test(band_shares_add_up),
        cmocka_unit_test(band_edges_lie_between_modes),
        cmocka_unit_test(shares_by_time_and_amplitude),
        cmocka_unit_test(lines_are_the_largest_and_the_most_prominent),
    };
    return cmocka_run_group_tests_name("residual", tests, NULL, NULL);
}
