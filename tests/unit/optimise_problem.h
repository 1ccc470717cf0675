/* SPDX-License-Identifier: GPL-3.0-or-later */
/* optimise_problem.h — a least-squares problem of a few unknowns, by its residual and Jacobian. */
#ifndef OPTIMISE_PROBLEM_H
#define OPTIMISE_PROBLEM_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <string.h>
#include "maths/maths.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { MOST = 8 };

/* A residual of m rows and its Jacobian J[i + j·m]; false: no value at x. */
struct problem {
    size_t m, n;
    bool (*residual)(const double x[], double r[], double J[]);
    int calls, stop_after;
};

static inline enum bf_status value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    struct problem *p = context;
    double r[MOST], J[MOST * MOST];
    p->calls++;
    if (!p->residual(x, r, J))
        return bf_fail(err, BF_NUMERIC, "no value here");
    *half_square = 0.0;
    for (size_t i = 0; i < p->m; i++)
        *half_square += 0.5 * r[i] * r[i];
    return BF_OK;
}

static inline enum bf_status derivative(void *context, const double x[], double *half_square, double gradient[],
                                        double gram[], struct bf_error *err)
{
    struct problem *p = context;
    double r[MOST], J[MOST * MOST];
    const enum bf_status status = value(context, x, half_square, err);
    if (status)
        return status;
    p->residual(x, r, J);
    for (size_t a = 0; a < p->n; a++) {
        gradient[a] = 0.0;
        for (size_t i = 0; i < p->m; i++)
            gradient[a] += J[i + a * p->m] * r[i];
        for (size_t b = 0; b < p->n; b++) {
            gram[a + b * p->n] = 0.0;
            for (size_t i = 0; i < p->m; i++)
                gram[a + b * p->n] += J[i + a * p->m] * J[i + b * p->m];
        }
    }
    return BF_OK;
}

static inline bool interrupted(void *context)
{
    const struct problem *p = context;
    return p->stop_after > 0 && p->calls >= p->stop_after;
}

static inline struct least_squares view(struct problem *p, const double *lower, const double *upper)
{
    return (struct least_squares){.n = p->n,
                                  .lower = lower,
                                  .upper = upper,
                                  .context = p,
                                  .value = value,
                                  .derivative = derivative,
                                  .interrupted = interrupted};
}

#endif
