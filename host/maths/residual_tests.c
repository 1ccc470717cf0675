/* SPDX-License-Identifier: GPL-3.0-or-later */
/* residual_tests.c — whiteness, correlation with the input, and the distributions they need. */
#include "maths.h"
#include "residual_parts.h"
#include "spectrum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Regularised upper incomplete gamma function Q(a, x): series below a + 1, continued fraction (Lentz) above. */
static double gamma_upper(double a, double x)
{
    const double scale = exp(a * log(x) - x - lgamma(a));
    if (x < a + 1.0) {
        double term = 1.0 / a, sum = term;
        for (int n = 1; n < 10000 && term > 1e-17 * sum; n++) {
            term *= x / (a + n);
            sum += term;
        }
        return fmax(0.0, 1.0 - scale * sum);
    }
    const double tiny = 1e-300;
    double b = x + 1.0 - a, c = 1.0 / tiny, d = 1.0 / b, h = d;
    for (int n = 1; n < 10000; n++) {
        const double an = n * (a - n);
        b += 2.0;
        d = 1.0 / (fabs(an * d + b) > tiny ? an * d + b : tiny);
        c = fabs(b + an / c) > tiny ? b + an / c : tiny;
        h *= d * c;
        if (fabs(d * c - 1.0) < 1e-15)
            break;
    }
    return scale * h;
}

double chi_square_tail(double x, double dof)
{
    if (!(x > 0.0) || !(dof > 0.0))
        return 1.0;
    return isfinite(x) ? gamma_upper(0.5 * dof, 0.5 * x) : 0.0;
}

/* Continued fraction of the incomplete beta function (Lentz; Abramowitz & Stegun 26.5.8), x below (a + 1)/(a + b + 2). */
static double beta_fraction(double a, double b, double x)
{
    const double tiny = 1e-300;
    double c = 1.0, d = 1.0 - (a + b) * x / (a + 1.0), h;
    d = 1.0 / (fabs(d) > tiny ? d : tiny);
    h = d;
    for (int k = 1; k < 10000; k++) {
        const double m = k, even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
                     odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / (fabs(1.0 + even * d) > tiny ? 1.0 + even * d : tiny);
        c = fabs(1.0 + even / c) > tiny ? 1.0 + even / c : tiny;
        h *= d * c;
        d = 1.0 / (fabs(1.0 + odd * d) > tiny ? 1.0 + odd * d : tiny);
        c = fabs(1.0 + odd / c) > tiny ? 1.0 + odd / c : tiny;
        h *= d * c;
        if (fabs(d * c - 1.0) < 1e-15)
            break;
    }
    return h;
}

/* P(F > x) = I_z(below/2, above/2), z = below/(below + above x). */
double f_tail(double x, double above, double below)
{
    if (!(x > 0.0) || !(above > 0.0) || !(below > 0.0))
        return 1.0;
    const double a = 0.5 * below, b = 0.5 * above, z = below / (below + above * x), y = above * x / (below + above * x);
    const double front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(z) + b * log(y));
    if (!isfinite(x))
        return 0.0;
    return z < (a + 1.0) / (a + b + 2.0) ? front * beta_fraction(a, b, z) / a
                                         : 1.0 - front * beta_fraction(b, a, y) / b;
}

/* Two-sided quantile of the normal distribution: P(|N| > q) = alpha, 0 < alpha < 1. */
static double normal_two_sided(double alpha)
{
    double low = 0.0, high = 40.0;
    for (int i = 0; i < 100; i++) {
        const double q = 0.5 * (low + high);
        if (erfc(q / sqrt(2.0)) > alpha)
            low = q;
        else
            high = q;
    }
    return 0.5 * (low + high);
}

/* Upper tail of Kolmogorov's distribution for n points, with Stephens' (1970) correction. */
static double kolmogorov_tail(double distance, double n)
{
    const double root = sqrt(n), lambda = distance * (root + 0.12 + 0.11 / root);
    double sum = 0.0;
    if (lambda < 0.2)
        return 1.0;
    for (int k = 1; k <= 100; k++)
        sum += (k % 2 ? 2.0 : -2.0) * exp(-2.0 * k * k * lambda * lambda);
    return fmin(1.0, fmax(0.0, sum));
}

enum bf_status residual_autocorrelation(const double *r, size_t n, size_t n_lags, double *rho, struct bf_error *err)
{
    enum bf_status status = correlate(r, r, n, n_lags, rho, err);
    if (status != BF_OK)
        return status;
    const double zero = rho[0];
    for (size_t k = 0; k < n_lags; k++)
        rho[k] = zero > 0.0 ? rho[k] / zero : 0.0;
    return BF_OK;
}

/* Bartlett: distance of the cumulative periodogram from the diagonal, over the bins between 0 and Nyquist; `times` periodograms are summed. */
static void cumulative_periodogram(const double power[], size_t m, double times, struct whiteness *out)
{
    const size_t bins = (m - 1) / 2;
    double total = 0.0, sum = 0.0, distance = 0.0;
    for (size_t k = 1; k <= bins; k++)
        total += power[k];
    for (size_t k = 1; k < bins; k++) { /* the last point is 1 by construction */
        sum += power[k];
        const double u = sum / total;
        distance = fmax(distance,
                        fmax(fabs(u - (double)k / (double)(bins - 1)), fabs(u - (double)(k - 1) / (double)(bins - 1))));
    }
    out->periodogram_ks = distance;
    out->periodogram_p = kolmogorov_tail(distance, times * (double)(bins - 1));
}

void residual_judge_whiteness(const double rho[], size_t lags, size_t n, const double power[], size_t m,
                              struct whiteness *out)
{
    *out = (struct whiteness){.lags = lags, .correlation_bound = normal_two_sided(0.05) / sqrt((double)n)};
    cumulative_periodogram(power, m, (double)n / (double)m, out);
    for (size_t k = 1; k <= lags; k++)
        out->ljung_box += (double)n * ((double)n + 2.0) * rho[k] * rho[k] / (double)(n - k);
    out->ljung_box_p = chi_square_tail(out->ljung_box, (double)lags);
    out->p_value = fmin(1.0, 2.0 * fmin(out->ljung_box_p, out->periodogram_p));
}

enum bf_status residual_whiteness(const double *r, size_t n, struct whiteness *out, struct bf_error *err)
{
    *out = (struct whiteness){.ljung_box_p = 1.0, .periodogram_p = 1.0, .p_value = 1.0, .correlation_bound = 1.0};
    if (n < 20 || !(root_mean_square(r, n) > 0.0))
        return BF_OK;
    double rho[RESIDUAL_LJUNG_BOX + 1], *power = bf_alloc(n / 2 + 1, sizeof *power);
    const size_t lags = n / 5 < RESIDUAL_LJUNG_BOX ? n / 5 : RESIDUAL_LJUNG_BOX;
    enum bf_status status = residual_autocorrelation(r, n, lags + 1, rho, err);
    if (status == BF_OK)
        status = residual_power(r, n, power, err);
    if (status == BF_OK)
        residual_judge_whiteness(rho, lags, n, power, n, out);
    free(power);
    return status;
}

/* Largest lag at which the input is still correlated with itself. */
static enum bf_status input_alike(const double *u, size_t n, size_t n_lags, long *alike, struct bf_error *err)
{
    static const double correlated = 0.1;
    double *rho = bf_alloc(n_lags + 1, sizeof *rho);
    const enum bf_status status = residual_autocorrelation(u, n, n_lags + 1, rho, err);
    *alike = 0;
    for (size_t k = 1; k <= n_lags && status == BF_OK; k++)
        if (fabs(rho[k]) > correlated)
            *alike = (long)k;
    free(rho);
    return status;
}

/* Bounds for n samples, the largest |ρ|, and how likely chance is to reach it. */
static void judge_correlation(size_t n, struct input_correlation *out)
{
    const double lags = 2.0 * (double)out->n_lags + 1.0;
    out->bound_lag = normal_two_sided(0.01) / sqrt((double)n);
    out->bound_all = normal_two_sided(1.0 - pow(0.99, 1.0 / lags)) / sqrt((double)n);
    for (size_t i = 0; i < 2 * out->n_lags + 1; i++)
        if (fabs(out->rho[i]) > out->largest) {
            out->largest = fabs(out->rho[i]);
            out->largest_lag = (long)i - (long)out->n_lags;
        }
    const double one = erfc(out->largest * sqrt(0.5 * (double)n));
    out->p_value = one < 1.0 ? -expm1(lags * log1p(-one)) : 1.0;
}

enum bf_status residual_input_correlation(const double *u, const double *r, size_t n, size_t n_lags,
                                          struct input_correlation *out, struct bf_error *err)
{
    *out = (struct input_correlation){.n_lags = n_lags, .p_value = 1.0};
    if (n < 4 || n_lags >= n / 2)
        return bf_fail(err, BF_NUMERIC, "%zu lags need a record of more than %zu samples", n_lags, 2 * n_lags);
    out->rho = bf_alloc(2 * n_lags + 1, sizeof *out->rho);
    struct ar_model colour;
    ar_fit(r, n, &colour);
    double *wu = bf_alloc(n, sizeof *wu), *wr = bf_alloc(n, sizeof *wr), *c = bf_alloc(n_lags + 1, sizeof *c);
    ar_whiten(&colour, u, n, wu);
    ar_whiten(&colour, r, n, wr);
    const double size = root_mean_square(wu, n) * root_mean_square(wr, n) * (double)n;
    enum bf_status status = size > 0.0 ? correlate(wr, wu, n, n_lags + 1, c, err) : BF_OK; /* Σ r_t u_{t+k}: lag −k */
    for (size_t k = 0; k <= n_lags && size > 0.0 && status == BF_OK; k++)
        out->rho[n_lags - k] = c[k] / size;
    if (size > 0.0 && status == BF_OK)
        status = correlate(wu, wr, n, n_lags + 1, c, err);
    for (size_t k = 0; k <= n_lags && size > 0.0 && status == BF_OK; k++)
        out->rho[n_lags + k] = c[k] / size;
    if (size > 0.0 && status == BF_OK)
        status = input_alike(wu, n, n_lags, &out->alike, err);
    judge_correlation(n, out);
    free(wu);
    free(wr);
    free(c);
    if (status != BF_OK)
        input_correlation_free(out);
    return status;
}

void residual_input_correlations_join(const struct input_correlation parts[], const size_t n[], size_t n_parts,
                                      struct input_correlation *out)
{
    size_t all = 0;
    *out = (struct input_correlation){.n_lags = parts[0].n_lags, .p_value = 1.0};
    const size_t room = 2 * out->n_lags + 1;
    out->rho = bf_alloc(room, sizeof *out->rho);
    for (size_t p = 0; p < n_parts; p++)
        all += n[p];
    for (size_t p = 0; p < n_parts; p++) {
        out->alike = parts[p].alike > out->alike ? parts[p].alike : out->alike;
        for (size_t i = 0; i < room; i++)
            out->rho[i] += parts[p].rho[i] * (double)n[p] / (double)all;
    }
    judge_correlation(all, out);
}

void input_correlation_free(struct input_correlation *correlation)
{
    free(correlation->rho);
    *correlation = (struct input_correlation){0};
}
