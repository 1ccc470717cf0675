/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "slow_part.h"

#include <math.h>
#include <stdlib.h>

#include "maths/maths.h"

enum {
    ROUNDS = 3
}; /* of series and colour: the second changed four shaker records by up to 1.5 % of their rms, the third by 0.01 % */
static const double tolerance = 1e-12; /* of the rank of few orthogonal columns */

static double term(const struct slow_part *slow, size_t j, size_t k)
{
    return j == 0 ? 1.0 : cos(M_PI * (double)j * ((double)(k - slow->first) + 0.5) / (double)slow->n);
}

struct slow_part slow_part_new(size_t first, size_t n_all, double dt_s, double below_Hz)
{
    const double terms = 1.0 + 2.0 * (double)(n_all - first) * dt_s * below_Hz;
    return (struct slow_part){
        .first = first, .n = n_all - first, .n_terms = terms < SLOW_TERMS ? (size_t)terms : SLOW_TERMS};
}

void slow_part_project(const double z[], struct slow_part *slow)
{
    for (size_t j = 0; j < slow->n_terms; j++) {
        double sum = 0.0;
        for (size_t k = slow->first; k < slow->first + slow->n; k++)
            sum += z[k] * term(slow, j, k);
        slow->c[j] = sum * (j == 0 ? 1.0 : 2.0) / (double)slow->n;
    }
}

double slow_part_at(const struct slow_part *slow, size_t k)
{
    double sum = 0.0;
    for (size_t j = 0; j < slow->n_terms && k >= slow->first; j++)
        sum += slow->c[j] * term(slow, j, k);
    return sum;
}

double slow_part_power(const struct slow_part *slow, size_t from, size_t to)
{
    double sum = 0.0;
    for (size_t j = from; j < to; j++)
        sum += slow->c[j] * slow->c[j] * (j == 0 ? 1.0 : 0.5);
    return sum;
}

/* The series anew, whitened by the colour of what the present one leaves. S: [n · n_terms] by columns, b: [n]; both are overwritten. */
static enum bf_status fit_whitened(const double z[], struct slow_part *slow, double S[], double b[],
                                   struct bf_error *err)
{
    struct ar_model beside;
    const size_t n = slow->n;
    for (size_t k = 0; k < n; k++)
        b[k] = z[slow->first + k] - slow_part_at(slow, slow->first + k);
    ar_fit(b, n, &beside);
    ar_whiten(&beside, z + slow->first, n, b);
    for (size_t j = 0; j < slow->n_terms; j++) {
        for (size_t k = 0; k < n; k++)
            S[j * n + k] = term(slow, j, slow->first + k);
        ar_whiten(&beside, S + j * n, n, S + j * n);
    }
    return dense_least_squares(n, slow->n_terms, S, b, tolerance, slow->c, NULL, err);
}

enum bf_status slow_part_beside_motion(const double z[], struct slow_part *slow, struct bf_error *err)
{
    double *S = bf_alloc(slow->n * slow->n_terms, sizeof *S), *b = bf_alloc(slow->n, sizeof *b);
    enum bf_status status = BF_OK;
    for (size_t j = 0; j < SLOW_TERMS; j++)
        slow->c[j] = 0.0;
    for (int round = 0; round < ROUNDS && !status; round++)
        status = fit_whitened(z, slow, S, b, err);
    free(S), free(b);
    return status;
}
