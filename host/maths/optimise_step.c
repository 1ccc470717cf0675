/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "optimise_step.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Work space of one subspace solve; every array has room for n (or n²) numbers. */
struct subspace {
    size_t *index; /* free unknowns */
    double *g, *H, *values, *vectors, *along, *p;
};

static struct subspace subspace_new(size_t n)
{
    return (struct subspace){.index = bf_alloc(n, sizeof(size_t)),
                             .g = bf_alloc(n, sizeof(double)),
                             .H = bf_alloc(n * n, sizeof(double)),
                             .values = bf_alloc(n, sizeof(double)),
                             .vectors = bf_alloc(n * n, sizeof(double)),
                             .along = bf_alloc(n, sizeof(double)),
                             .p = bf_alloc(n, sizeof(double))};
}

static void subspace_free(struct subspace *s)
{
    free(s->index), free(s->g), free(s->H), free(s->values), free(s->vectors), free(s->along), free(s->p);
}

/* ‖p(λ)‖ with p = −Σ v (vᵀg)/(d + λ) over the directions that count. */
static double step_norm(size_t m, const double values[], const double along[], double least, double lambda)
{
    double sum = 0.0;
    for (size_t i = 0; i < m; i++)
        if (values[i] > least)
            sum += pow(along[i] / (values[i] + lambda), 2.0);
    return sqrt(sum);
}

/* λ ≥ 0 with ‖p(λ)‖ ≤ radius, by bisection in log λ: the norm falls monotonically. */
static double damping_for(size_t m, const double values[], const double along[], double least, double radius)
{
    if (step_norm(m, values, along, least, 0.0) <= radius)
        return 0.0;
    double low = 1e-20 * values[m - 1], high = values[m - 1];
    while (step_norm(m, values, along, least, high) > radius)
        high *= 16.0;
    for (int i = 0; i < 80 && high > 1.001 * low; i++) {
        const double middle = sqrt(low * high);
        if (step_norm(m, values, along, least, middle) > radius)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* Solves in the m free unknowns; the held ones have moved by p already, which changes the gradient seen here. */
static enum bf_status solve_free(const struct quadratic *q, struct subspace *s, size_t m, double p[],
                                 struct bf_error *err)
{
    for (size_t a = 0; a < m; a++) {
        const size_t i = s->index[a];
        double g = q->g[i];
        for (size_t j = 0; j < q->n; j++)
            g += q->H[i + j * q->n] * p[j]; /* p is 0 for the free ones */
        s->g[a] = g;
        for (size_t b = 0; b < m; b++)
            s->H[a + b * m] = q->H[i + s->index[b] * q->n];
    }
    const enum bf_status status = dense_symmetric_eigen(m, s->H, NULL, s->values, s->vectors, err);
    if (status)
        return status;
    const double least = fmax(q->rank * s->values[m - 1], 0.0);
    dense_gemv(true, m, m, 1.0, s->vectors, s->g, 0.0, s->along);
    const double lambda = damping_for(m, s->values, s->along, least, q->radius);
    for (size_t i = 0; i < m; i++)
        s->along[i] = s->values[i] > least ? -s->along[i] / (s->values[i] + lambda) : 0.0;
    dense_gemv(false, m, m, 1.0, s->vectors, s->along, 0.0, s->p);
    for (size_t a = 0; a < m; a++)
        p[s->index[a]] = s->p[a];
    return BF_OK;
}

enum bf_status quadratic_step(const struct quadratic *q, double p[], struct bf_error *err)
{
    struct subspace s = subspace_new(q->n);
    bool *held = bf_alloc(q->n, sizeof *held);
    double *fixed = bf_alloc(q->n, sizeof *fixed);
    for (size_t i = 0; i < q->n; i++) {
        held[i] = (q->low[i] >= 0.0 && q->g[i] > 0.0) || (q->high[i] <= 0.0 && q->g[i] < 0.0);
        fixed[i] = 0.0;
    }
    enum bf_status status = BF_OK;
    for (bool again = true; again && !status;) {
        size_t m = 0;
        for (size_t i = 0; i < q->n; i++) {
            p[i] = held[i] ? fixed[i] : 0.0;
            if (!held[i])
                s.index[m++] = i;
        }
        again = false;
        if (m == 0)
            break;
        status = solve_free(q, &s, m, p, err);
        for (size_t i = 0; i < q->n && !status; i++) {
            if (held[i] || (p[i] >= q->low[i] && p[i] <= q->high[i]))
                continue;
            held[i] = again = true;
            fixed[i] = p[i] < q->low[i] ? q->low[i] : q->high[i];
        }
    }
    subspace_free(&s);
    free(held), free(fixed);
    return status;
}

double quadratic_fall(size_t n, const double g[], const double H[], const double p[])
{
    double linear = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++) {
        double Hp = 0.0;
        for (size_t j = 0; j < n; j++)
            Hp += H[i + j * n] * p[j];
        linear += g[i] * p[i];
        square += p[i] * Hp;
    }
    return fmax(-linear - 0.5 * square, 0.0);
}

void quadratic_room(const struct least_squares *problem, const double x[], double low[], double high[])
{
    for (size_t i = 0; i < problem->n; i++) {
        low[i] = problem->lower ? fmin(problem->lower[i] - x[i], 0.0) : -HUGE_VAL;
        high[i] = problem->upper ? fmax(problem->upper[i] - x[i], 0.0) : HUGE_VAL;
    }
}

enum bf_status optimise_decrement(const struct least_squares *problem, const double x[], const double gradient[],
                                  const double gram[], double rank, double *decrement, double step[],
                                  struct bf_error *err)
{
    const size_t n = problem->n;
    double *low = bf_alloc(n, sizeof *low), *high = bf_alloc(n, sizeof *high), *p = bf_alloc(n, sizeof *p);
    quadratic_room(problem, x, low, high);
    for (size_t i = 0; i < n; i++) { /* a bound further off says nothing about stationarity here */
        low[i] = low[i] < 0.0 ? -HUGE_VAL : 0.0;
        high[i] = high[i] > 0.0 ? HUGE_VAL : 0.0;
    }
    const struct quadratic q = {.n = n,
                                .g = gradient,
                                .H = gram,
                                .low = low,
                                .high = high,
                                .radius = INFINITY,
                                .rank = rank > 0.0 ? rank : QUADRATIC_RANK};
    const enum bf_status status = quadratic_step(&q, p, err);
    *decrement = status ? 0.0 : quadratic_fall(n, gradient, gram, p);
    if (step)
        memcpy(step, p, n * sizeof *p);
    free(low), free(high), free(p);
    return status;
}
