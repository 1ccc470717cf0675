/* SPDX-License-Identifier: GPL-3.0-or-later */
/* residual_sums.c — a residual judged from sums over segments of one length, which are all that stays in memory. */
#include "residual_parts.h"
#include "spectrum.h"

#include <math.h>
#include <stdlib.h>

enum { TO_AN_OCTAVE = RESIDUAL_AMPLITUDES / RESIDUAL_OCTAVES }; /* levels of the motion's power */

void residual_sums_new(size_t segment, size_t n_lags, struct residual_sums *out)
{
    *out = (struct residual_sums){.segment = segment, .n_lags = n_lags};
    out->power = bf_alloc(segment / 2 + 1, sizeof *out->power);
    out->product = bf_alloc(n_lags, sizeof *out->product);
    out->amplitude = bf_alloc(RESIDUAL_AMPLITUDES, sizeof *out->amplitude);
}

void residual_sums_free(struct residual_sums *sums)
{
    free(sums->power);
    free(sums->product);
    free(sums->amplitude);
    *sums = (struct residual_sums){0};
}

static size_t level_of(double power)
{
    const double level = power > 0.0 ? floor(TO_AN_OCTAVE * (log2(power) + 0.5 * RESIDUAL_OCTAVES)) : 0.0;
    return (size_t)fmin(fmax(level, 0.0), RESIDUAL_AMPLITUDES - 1.0);
}

static void add_amplitudes(struct residual_sums *sums, const double *z, const double *r, size_t window_n)
{
    double *power = bf_alloc(sums->segment, sizeof *power);
    residual_running_power(z, sums->segment, window_n, power);
    for (size_t i = 0; i < sums->segment; i++) {
        struct residual_amplitude *a = &sums->amplitude[level_of(power[i])];
        a->n += 1.0;
        a->motion += z[i] * z[i];
        a->misfit += r[i] * r[i];
    }
    free(power);
}

enum bf_status residual_sums_add(struct residual_sums *sums, const double *z, const double *r, size_t window_n,
                                 struct bf_error *err)
{
    double *power = bf_alloc(sums->segment / 2 + 1, sizeof *power), *product = bf_alloc(sums->n_lags, sizeof *product);
    enum bf_status status = residual_power(r, sums->segment, power, err);
    if (status == BF_OK)
        status = correlate(r, r, sums->segment, sums->n_lags, product, err);
    if (status == BF_OK) {
        for (size_t k = 0; k <= sums->segment / 2; k++)
            sums->power[k] += power[k];
        for (size_t k = 0; k < sums->n_lags; k++)
            sums->product[k] += product[k];
        add_amplitudes(sums, z, r, window_n);
        sums->n += sums->segment;
        sums->n_segments++;
    }
    free(power), free(product);
    return status;
}

void residual_sums_autocorrelation(const struct residual_sums *sums, size_t n_lags, double *rho)
{
    for (size_t k = 0; k < n_lags; k++) /* fewer pairs are in one segment the longer the lag is */
        rho[k] = sums->product[0] > 0.0
                     ? sums->product[k] / sums->product[0] * (double)sums->segment / (double)(sums->segment - k)
                     : 0.0;
}

void residual_sums_whiteness(const struct residual_sums *sums, struct whiteness *out)
{
    double rho[RESIDUAL_LJUNG_BOX + 1];
    *out = (struct whiteness){.ljung_box_p = 1.0, .periodogram_p = 1.0, .p_value = 1.0, .correlation_bound = 1.0};
    if (sums->n == 0 || !(sums->product[0] > 0.0))
        return;
    residual_sums_autocorrelation(sums, RESIDUAL_LJUNG_BOX + 1, rho);
    residual_judge_whiteness(rho, RESIDUAL_LJUNG_BOX, sums->n, sums->power, sums->segment, out);
}

void residual_sums_bands(const struct residual_sums *sums, double dt_s, const double *edge_Hz, size_t n_edges,
                         double *share)
{
    residual_power_bands(sums->power, sums->segment, dt_s, edge_Hz, n_edges, share);
}

void residual_sums_amplitudes(const struct residual_sums *sums, struct amplitude_shares *out)
{
    const double third = (double)sums->n / 3.0;
    double size[3] = {0}, total = 0.0, below = 0.0;
    *out = (struct amplitude_shares){0};
    for (size_t i = 0; i < RESIDUAL_AMPLITUDES; i++) {
        const struct residual_amplitude *a = &sums->amplitude[i];
        for (int group = 0; group < 3 && a->n > 0.0; group++) { /* a level on the border of two groups is split */
            const double from = fmax(below, group * third), to = fmin(below + a->n, (group + 1) * third);
            const double part = to > from ? (to - from) / a->n : 0.0;
            out->share[group] += part * a->misfit;
            size[group] += part * a->motion;
        }
        below += a->n;
        total += a->misfit;
    }
    for (int i = 0; i < 3; i++) {
        out->relative[i] = size[i] > 0.0 ? sqrt(out->share[i] / size[i]) : 0.0;
        out->share[i] = total > 0.0 ? out->share[i] / total : 0.0;
    }
}
