/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * evidence.h — how strongly data prefer one residual to another, with noise that is not white.
 *
 * A channel's noise is either a smooth spectrum (noise.h) or an autoregressive model (residual.h); `whitener` makes of it
 * a linear map after which noise is independent, of variance 1. Then χ² = Σ w², the log-likelihood ratio of two nested models
 * is half the difference of their χ², and information criteria count samples by n_eff instead of n. docs/diagnose.md says
 * how the false alarms of this were measured. No function keeps state: all may run in several threads.
 */
#ifndef BEAMFIT_EVIDENCE_H
#define BEAMFIT_EVIDENCE_H

#include "noise.h"
#include "maths/residual.h"

/* One channel of one record and what a model leaves of it: views, nothing is owned. */
struct misfit_channel {
    const char *file;    /* as the user gave it */
    const char *channel; /* name of the output */
    size_t record;       /* index into the caller's records */
    size_t n;
    double dt_s;
    const double *measured, *residual; /* [n] z and r = z − ŷ */
    const struct noise_estimate
        *noise; /* never NULL; method NOISE_NONE: the channel is left out where noise is needed */
};

/* ---- Whitening ---- */

/* The noise of a channel as an autoregressive model: exact and causal, so that whitened rows have no wrap-around. */
struct whitener {
    struct ar_model ar;
    double n_eff_share; /* independent samples a sample, 0 … 1: (∫S df)²/(f_N ∫S² df); 1 for white noise */
};

/*
 * From the smooth spectrum of a recording's noise (autocovariance of the spectrum, Levinson's recursion, order at which
 * the spectrum is reproduced to 1 % or 40). BF_NUMERIC when the estimate holds no noise.
 */
enum bf_status whitener_from_noise(const struct noise_estimate *noise, struct whitener *out, struct bf_error *err);
/* From a residual that is believed to be noise: Burg, order by BIC. r = 0: sigma 0, nothing is divided out. */
void whitener_from_residual(const double *r, size_t n, struct whitener *out);
/* w: [n] may be x. Serves residuals and Jacobian columns alike. O(n order). */
void whitener_apply(const struct whitener *whitener, const double *x, size_t n, double *w);

/* ---- χ² of residuals ---- */

struct misfit {
    double chi_square; /* Σ over channels of the whitened Σ w² */
    size_t n;          /* rows */
    double n_eff;      /* effective number of independent rows */
};

/* whiteners: one a channel; residual as in channels[]. Channels whose whitener has sigma 0 are left out. O(n order). */
void misfit_measure(const struct misfit_channel channels[], const struct whitener whiteners[], size_t n_channels,
                    struct misfit *out);

/* ---- One model against a richer one that contains it ---- */

struct evidence {
    double
        two_delta_log_likelihood; /* (χ²_poor − χ²_rich)/max(1, χ²_rich/n_rich): what is left is not counted as noise */
    double scale;                 /* that maximum; far above 1: neither model is right, p-values mean little */
    double p_value;               /* of the likelihood ratio, before any correction for search */
    double bic_gain;              /* 2ΔlogL − g ln n_eff − 2 g ln(tried); > 0 favours the richer model */
    double fall_share; /* 1 − χ²_rich/χ²_poor: significance without size is no reason to add an effect */
};

/*
 * poor and rich: of the same rows and whiteners. added: g ≥ 1 parameters the richer one has more, one_sided of them
 * (≤ g, at most 1 counted) are held at a bound by the poorer. tried: candidates that were looked at, ≥ 1.
 */
void evidence_compare(const struct misfit *poor, const struct misfit *rich, size_t added, size_t one_sided,
                      size_t tried, struct evidence *out);

/* Below this share of the floor a fall is ignored, whatever its significance: the floor itself is known to about 1.2 %. */
extern const double evidence_least_fall;

/* P(2ΔlogL ≥ x) when nothing is there: χ²_g, or with a one-sided parameter ½ χ²_{g−1} + ½ χ²_g (Self & Liang 1987). */
double likelihood_ratio_tail(double x, size_t added, size_t one_sided);
/* Holm's step-down: adjusted[i] ≤ α exactly when hypothesis i falls at family-wise error α. p, adjusted: [n], may be the same. */
void holm_adjust(const double p[], size_t n, double adjusted[]);

#endif
