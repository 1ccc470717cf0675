/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements on [from, to]: its share of n, at least two. */
static size_t piece_elements(double from, double to, double length, size_t n)
{
    double share = round((to - from) / length * (double)n);
    return share < 2.0 ? 2 : (size_t)share;
}

static size_t push(double *knots, size_t k, double x, int times)
{
    for (int i = 0; i < times; i++)
        knots[k++] = x;
    return k;
}

enum bf_status spline_new(double length_m, const double edges[], size_t n_edges, size_t n, struct spline *out,
                          struct bf_error *err)
{
    if (!(length_m > 0.0))
        return bf_fail(err, BF_NUMERIC, "a spline space needs a positive length, not %g m", length_m);
    size_t most = n + 4 * (n_edges + 1) + 16;
    double *knots = bf_alloc(most, sizeof *knots);
    size_t k = push(knots, 0, 0.0, 4);
    double from = 0.0;
    for (size_t e = 0; e <= n_edges; e++) {
        double to = e < n_edges ? edges[e] : length_m;
        if (!(to > from)) {
            free(knots);
            return bf_fail(err, BF_NUMERIC, "spline edges must increase inside (0, %g) m; %g does not", length_m, to);
        }
        size_t elements = piece_elements(from, to, length_m, n);
        for (size_t i = 1; i < elements; i++)
            k = push(knots, k, from + (to - from) * (double)i / (double)elements, 1);
        k = push(knots, k, to, e < n_edges ? 2 : 4);
        from = to;
    }
    *out = (struct spline){.n = k - SPLINE_ORDER, .n_knots = k, .knots = knots};
    return BF_OK;
}

void spline_free(struct spline *spline)
{
    free(spline->knots);
    *spline = (struct spline){0};
}

/* Largest i in [3, n−1] with knots[i] ≤ x and knots[i] < knots[i+1]. */
static size_t find_span(const struct spline *s, double x)
{
    size_t low = 3, high = s->n - 1;
    while (low < high) {
        size_t middle = (low + high + 1) / 2;
        if (s->knots[middle] <= x)
            low = middle;
        else
            high = middle - 1;
    }
    while (low > 3 && !(s->knots[low] < s->knots[low + 1]))
        low--;
    return low;
}

/* Cox–de Boor: b[p][j] = B_{i−p+j, degree p}(x), j = 0 … p. */
static void basis_all_degrees(const double *t, size_t i, double x, double b[4][4])
{
    b[0][0] = 1.0;
    for (size_t p = 1; p < 4; p++) {
        for (size_t j = 0; j <= p; j++) {
            const double *u = t + i - p + j; /* u[0] = t_m, m = i − p + j */
            double left = 0.0, right = 0.0;
            if (j > 0)
                left = (x - u[0]) / (u[p] - u[0]) * b[p - 1][j - 1];
            if (j < p)
                right = (u[p + 1] - x) / (u[p + 1] - u[1]) * b[p - 1][j];
            b[p][j] = left + right;
        }
    }
}

/* One differentiation: coefficients of degree-p functions from those of degree p−1 (de Boor). */
static void differentiate(const double *t, size_t i, size_t p, const double lower[4], double upper[4])
{
    for (size_t j = 0; j <= p; j++) {
        const double *u = t + i - p + j;
        double left = j > 0 ? lower[j - 1] / (u[p] - u[0]) : 0.0;
        double right = j < p ? lower[j] / (u[p + 1] - u[1]) : 0.0;
        upper[j] =
            (double)p * (left - right); /* B'_{m,p} = p (B_{m,p−1}/(t_{m+p}−t_m) − B_{m+1,p−1}/(t_{m+p+1}−t_{m+1})) */
    }
}

void spline_evaluate(const struct spline *spline, double x, struct spline_values *out)
{
    size_t i = find_span(spline, x);
    double b[4][4] = {{0}};
    basis_all_degrees(spline->knots, i, x, b);
    out->first = i - 3;
    memcpy(out->d[0], b[3], sizeof out->d[0]);
    for (size_t k = 1; k < 4; k++) {
        double values[4];
        memcpy(values, b[3 - k], sizeof values);
        for (size_t p = 4 - k; p <= 3; p++) {
            double next[4] = {0};
            differentiate(spline->knots, i, p, values, next);
            memcpy(values, next, sizeof values);
        }
        memcpy(out->d[k], values, sizeof values);
    }
}
