/* SPDX-License-Identifier: GPL-3.0-or-later */
/* ar_autocovariance.h — the autocovariance of an autoregressive model by the Yule–Walker equations. */
#ifndef BEAMFIT_AR_AUTOCOVARIANCE_H
#define BEAMFIT_AR_AUTOCOVARIANCE_H

#include "dense_solve.h"
#include "maths/maths.h"

/* c[n_lags] at lags 0, 1, …: c_k − Σ a_i c_|k−i| = σ² for k = 0, 0 for k = 1 … order; then the recursion of the model. */
static inline void ar_autocovariance(const struct ar_model *model, size_t n_lags, double c[])
{
    const size_t order = (size_t)model->order, n = order + 1;
    double A[(AR_MAX + 1) * (AR_MAX + 1)] = {0}, first[AR_MAX + 1] = {model->sigma * model->sigma};
    for (size_t k = 0; k < n; k++) {
        A[k + k * n] += 1.0;
        for (size_t i = 1; i <= order; i++)
            A[k + (k > i ? k - i : i - k) * n] -= model->a[i - 1];
    }
    dense_solve(n, A, first);
    for (size_t lag = 0; lag < n_lags; lag++) {
        c[lag] = lag <= order ? first[lag] : 0.0;
        for (size_t i = 1; lag > order && i <= order; i++)
            c[lag] += model->a[i - 1] * c[lag - i];
    }
}

#endif
