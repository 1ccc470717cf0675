/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "evidence.h"
#include "noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SPECTRUM_POINTS = 512 };            /* between 0 and Nyquist, where the smooth spectrum is integrated */
static const double spectrum_match = 0.01; /* an order is high enough when it reproduces every point to this share */
const double evidence_least_fall = 0.01;

/* ---- Whitening ---- */

static double psd_at(const struct noise_estimate *noise, double f_Hz)
{
    const double bin = fmin(f_Hz / noise->df_Hz, (double)(noise->n_bins - 1));
    const size_t below = (size_t)bin, above = below + 1 < noise->n_bins ? below + 1 : below;
    const double part = bin - (double)below;
    return (1.0 - part) * noise->psd[below] + part * noise->psd[above];
}

/* One order up: a of order m from a of order m − 1; variance of the innovation is updated. false: not positive definite. */
static bool levinson_step(const double *c, int m, double *a, double *variance)
{
    double k = c[m], old[AR_MAX];
    for (int i = 0; i < m - 1; i++)
        k -= a[i] * c[m - 1 - i];
    k /= *variance;
    if (!(fabs(k) < 1.0))
        return false;
    memcpy(old, a, sizeof old);
    for (int i = 0; i < m - 1; i++)
        a[i] = old[i] - k * old[m - 2 - i];
    a[m - 1] = k;
    *variance *= 1.0 - k * k;
    return true;
}

/* Largest relative difference of the model's spectrum from s[SPECTRUM_POINTS]; frequencies in cycles per sample. */
static double spectrum_distance(const struct ar_model *ar, const double *s)
{
    double worst = 0.0;
    for (size_t j = 0; j < SPECTRUM_POINTS; j += 8)
        worst = fmax(worst, fabs(ar_psd(ar, 1.0, 0.5 * ((double)j + 0.5) / SPECTRUM_POINTS) / s[j] - 1.0));
    return worst;
}

static double independent_share(const double *s)
{
    double sum = 0.0, squares = 0.0;
    for (size_t j = 0; j < SPECTRUM_POINTS; j++) {
        sum += s[j];
        squares += s[j] * s[j];
    }
    return squares > 0.0 ? sum * sum / (SPECTRUM_POINTS * squares) : 1.0;
}

enum bf_status whitener_from_noise(const struct noise_estimate *noise, struct whitener *out, struct bf_error *err)
{
    *out = (struct whitener){.n_eff_share = 1.0};
    if (noise->method == NOISE_NONE || noise->n_bins < 2 || !(noise->rms > 0.0))
        return bf_fail(err, BF_NUMERIC, "a channel without a noise level cannot be whitened");
    const double nyquist_Hz = noise->df_Hz * (double)(noise->n_bins - 1);
    double s[SPECTRUM_POINTS], c[AR_MAX + 1] = {0}, power = 0.0, a[AR_MAX] = {0};
    for (size_t j = 0; j < SPECTRUM_POINTS; j++) { /* one-sided, per cycle and sample */
        s[j] = 2.0 * nyquist_Hz * psd_at(noise, nyquist_Hz * ((double)j + 0.5) / SPECTRUM_POINTS);
        power += 0.5 * s[j] / SPECTRUM_POINTS;
    }
    for (size_t j = 0; j < SPECTRUM_POINTS; j++) {
        s[j] *= noise->rms * noise->rms / power;
        for (int k = 0; k <= AR_MAX; k++)
            c[k] += 0.5 * s[j] / SPECTRUM_POINTS * cos(M_PI * k * ((double)j + 0.5) / SPECTRUM_POINTS);
    }
    double variance = c[0];
    out->n_eff_share = independent_share(s);
    out->ar.sigma = sqrt(variance);
    for (int m = 1; m <= AR_MAX && spectrum_distance(&out->ar, s) > spectrum_match; m++) {
        if (!levinson_step(c, m, a, &variance))
            break;
        out->ar.order = m;
        out->ar.sigma = sqrt(variance);
        memcpy(out->ar.a, a, sizeof a);
    }
    return BF_OK;
}

void whitener_apply(const struct whitener *whitener, const double *x, size_t n, double *w)
{
    ar_whiten(&whitener->ar, x, n, w);
}

/* ---- χ² ---- */

void misfit_measure(const struct misfit_channel channels[], const struct whitener whiteners[], size_t n_channels,
                    struct misfit *out)
{
    *out = (struct misfit){0};
    for (size_t c = 0; c < n_channels; c++) {
        const size_t n = channels[c].n;
        if (!(whiteners[c].ar.sigma > 0.0))
            continue;
        double *w = bf_alloc(n, sizeof *w);
        whitener_apply(&whiteners[c], channels[c].residual, n, w);
        for (size_t i = 0; i < n; i++)
            out->chi_square += w[i] * w[i];
        out->n += n;
        out->n_eff += whiteners[c].n_eff_share * (double)n;
        free(w);
    }
}

double likelihood_ratio_tail(double x, size_t added, size_t one_sided)
{
    if (!(x > 0.0))
        return 1.0;
    const double whole = chi_square_tail(x, (double)added);
    if (one_sided == 0 || added == 0)
        return whole;
    return 0.5 * whole + (added > 1 ? 0.5 * chi_square_tail(x, (double)(added - 1)) : 0.0);
}

void evidence_compare(const struct misfit *poor, const struct misfit *rich, size_t added, size_t one_sided,
                      size_t tried, struct evidence *out)
{
    const double g = (double)added, n_eff = fmax(rich->n_eff, 2.0);
    *out = (struct evidence){.scale = 1.0};
    if (rich->n > 0)
        out->scale = fmax(1.0, rich->chi_square / (double)rich->n);
    out->two_delta_log_likelihood = (poor->chi_square - rich->chi_square) / out->scale;
    out->p_value = likelihood_ratio_tail(out->two_delta_log_likelihood, added, one_sided);
    out->bic_gain = out->two_delta_log_likelihood - g * log(n_eff) - 2.0 * g * log(tried > 1 ? (double)tried : 1.0);
    out->fall_share = poor->chi_square > 0.0 ? 1.0 - rich->chi_square / poor->chi_square : 0.0;
}

/* ---- Many hypotheses ---- */

struct ranked {
    double p;
    size_t index;
};

static int by_p(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->p < y->p || x->p > y->p)
        return x->p < y->p ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

void holm_adjust(const double p[], size_t n, double adjusted[])
{
    struct ranked *ranks = bf_alloc(n, sizeof *ranks);
    double highest = 0.0;
    for (size_t i = 0; i < n; i++)
        ranks[i] = (struct ranked){isfinite(p[i]) ? p[i] : 1.0, i};
    qsort(ranks, n, sizeof *ranks, by_p);
    for (size_t k = 0; k < n; k++) {
        highest = fmax(highest, fmin(1.0, (double)(n - k) * ranks[k].p));
        adjusted[ranks[k].index] = highest;
    }
    free(ranks);
}
