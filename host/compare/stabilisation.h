/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * stabilisation.h — normal equations of the free linear models of every order. Private to compare/.
 *
 * In each channel, with v = e^(−iπ f/f_top) and real coefficients:
 *     A(v) Y = Σ_i B_i(v) U_i + C(v),     A common to all channels and records, all of one degree.
 * C is what rings in from before the record and out of it at its end. f_top is that of STABILISATION, so that the bands of records
 * of other rates and lengths agree.
 */
#ifndef BEAMFIT_STABILISATION_H
#define BEAMFIT_STABILISATION_H

#include "compare.h"

/* Signals of a channel: its spectrum, 1, and its inputs'. */
enum {
    STABILISATION_SIGNALS = 2 + COMPARE_INPUTS,
    STABILISATION_LAGS = 2 * STABILISATION_MODES,
    STABILISATION_FEWEST_LINES = 64 /* of a channel in the band */
};

/* One channel in the frequency domain. Lines 1 … n_lines, without the offset; all but the first signal are scaled to one size. */
struct stabilisation_lines {
    size_t n_lines, n_signals;
    double df_Hz;
    double _Complex *signal[STABILISATION_SIGNALS]; /* [n_lines + 1]; [1] is constant */
    double scale[STABILISATION_SIGNALS];            /* by which a signal was multiplied */
    size_t input[STABILISATION_SIGNALS];            /* of the model, from [2] on */
    double *weight; /* [n_lines + 1] over the power of the error of |Y|, and over n_lines */
};

/* A channel of a fitted record that is long enough and moves. */
bool stabilisation_uses(const struct comparison *all, const struct comparison_channel *c);
/* Up to to_Hz. Free with stabilisation_lines_free(), also after a failure. */
enum bf_status stabilisation_lines_take(const struct comparison *all, const struct comparison_channel *c, double to_Hz,
                                        struct stabilisation_lines *l, struct bf_error *err);
void stabilisation_lines_free(struct stabilisation_lines *l);

/* Σ_k w_k Re(conj(a_k) b_k v_k^lag), lag = −LAGS … LAGS at index lag + LAGS. */
struct stabilisation_channel {
    size_t n_signals;
    double sum[STABILISATION_SIGNALS][STABILISATION_SIGNALS][2 * STABILISATION_LAGS + 1];
};

struct stabilisation_sums {
    size_t n;
    struct stabilisation_channel *channels; /* [n] */
};

/* Sums of all channels of the records that are not held out; band and mean spectrum into `out`. No channel that can be used: n is 0. */
enum bf_status stabilisation_sum(const struct comparison *comparison, struct stabilisation_sums *sums,
                                 struct stabilisation *out, struct bf_error *err);
void stabilisation_sums_free(struct stabilisation_sums *sums);

/* M[(n + 1)²], both triangles: Σ ‖A Y − …‖² = aᵀ M a with B and C eliminated from each channel. n ≤ LAGS. */
enum bf_status stabilisation_reduce(const struct stabilisation_sums *sums, size_t n, double M[], struct bf_error *err);

#endif
