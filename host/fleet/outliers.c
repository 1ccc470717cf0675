/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Units that differ from the others, and drift of a parameter against a column. */
#include "population.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* (x − μ)ᵀ V⁻¹ (x − μ), V = Σ + S; *q: parameters that the unit has; the one furthest from the mean. */
static enum bf_status distance(const struct fleet_estimates *e, const struct fleet_mixed *m, size_t i, double *square,
                               size_t *q, struct fleet_outlier *most, struct bf_error *err)
{
    const size_t p = e->p;
    double *V = bf_alloc(p * p, sizeof *V), *r = bf_alloc(p, sizeof *r), *solved = bf_alloc(p, sizeof *solved);
    size_t *at = bf_alloc(p, sizeof *at);
    *q = 0;
    *most = (struct fleet_outlier){.unit = i};
    for (size_t k = 0; k < p; k++)
        if (isfinite(e->x[i * p + k]))
            at[(*q)++] = k;
    for (size_t b = 0; b < *q; b++) {
        for (size_t a = 0; a < *q; a++)
            V[a + b * *q] = m->spread[at[a] + at[b] * p] + e->S[i * p * p + at[a] + at[b] * p];
        r[b] = solved[b] = e->x[i * p + at[b]] - m->mean[at[b]];
        const double z = r[b] / sqrt(V[b + b * *q]);
        if (fabs(z) > fabs(most->deviation))
            most->deviation = z, most->parameter = at[b];
    }
    const enum bf_status status = *q > 0 ? dense_cholesky_solve(*q, 1, V, solved, err) : BF_OK;
    *square = *q > 0 && status == BF_OK ? dense_dot(*q, r, solved) : 0.0;
    free(V), free(r), free(solved), free(at);
    return status;
}

enum standing { KEPT, LEFT_OUT, CLEARED };

/*
 * How often a unit of the fleet is as far away, exact where all units have the same errors. One that was left out of μ and Σ: Hotelling's T². One that
 * was in: the same, from its distance to what it is part of (Penny 1996, Applied Statistics 45, 73); one that was out once and came back: χ², which is too large.
 */
static double tail(double square, size_t q, size_t n_units, enum standing standing)
{
    const double n = (double)n_units, p = (double)q, rest = (n - 1.0) * (n - 1.0) - n * square;
    const double dof = standing == KEPT ? n - p - 1.0 : n - p;
    if (standing == CLEARED || q == 0 || dof < 1.0)
        return chi_square_tail(square, p);
    if (standing == KEPT)
        return rest > 0.0 ? f_tail(dof * n * square / (p * rest), p, dof) : 0.0;
    return f_tail(square * dof / (p * (n - 1.0)) * n / (n + 1.0), p, dof);
}

/* To begin with: units within five scaled median deviations of the median, and their own errors, in every parameter. */
static void start_with_the_middle(const struct fleet_estimates *e, bool use[])
{
    static const double far = 5.0;
    double *x = bf_alloc(e->n, sizeof *x);
    for (size_t i = 0; i < e->n; i++)
        use[i] = true;
    for (size_t k = 0; k < e->p; k++) {
        size_t n = 0;
        for (size_t i = 0; i < e->n; i++)
            if (isfinite(e->x[i * e->p + k]))
                x[n++] = e->x[i * e->p + k];
        double middle;
        const double scale = robust_deviation(n, x, &middle);
        for (size_t i = 0; i < e->n; i++) {
            const double sd = sqrt(e->S[(i * e->p + k) * e->p + k]), off = e->x[i * e->p + k] - middle;
            use[i] = use[i] && !(fabs(off) > far * hypot(scale, sd));
        }
    }
    free(x);
}

/*
 * All units against the fit without those that stand out; *changed: others do now. A unit that is in and seems to stand out is left out, to be judged by
 * the others alone; if it does not stand out then, it is back for good.
 */
static enum bf_status judge(const struct fleet_estimates *e, struct fleet_population *out, enum standing standing[],
                            bool *changed, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *changed = false;
    out->n_outliers = 0;
    for (size_t i = 0; i < e->n && status == BF_OK; i++) {
        struct fleet_outlier one;
        double square;
        size_t q;
        status = distance(e, &out->mixed, i, &square, &q, &one, err);
        if (status != BF_OK || q == 0)
            continue;
        one.p_value = fmin(1.0, (double)e->n * tail(square, q, out->mixed.n, standing[i]));
        const bool far = one.p_value < out->false_alarm_rate;
        if (far && standing[i] == LEFT_OUT)
            out->outliers[out->n_outliers++] = one;
        *changed = *changed || far != (standing[i] == LEFT_OUT);
        if (far != (standing[i] == LEFT_OUT))
            standing[i] = far ? LEFT_OUT : CLEARED;
    }
    return status;
}

enum bf_status population_outliers(struct fleet_population *out, bool use[], struct bf_error *err)
{
    enum { MOST_ROUNDS = 20 };
    const struct fleet_estimates *e = &out->estimates;
    enum standing *standing = bf_alloc(e->n, sizeof *standing);
    bool changed = true;
    out->outliers = bf_alloc(e->n, sizeof *out->outliers);
    start_with_the_middle(e, use);
    for (size_t i = 0; i < e->n; i++)
        standing[i] = use[i] ? KEPT : LEFT_OUT;
    enum bf_status status = BF_OK;
    for (int round = 0; round < MOST_ROUNDS && changed && status == BF_OK; round++) {
        for (size_t i = 0; i < e->n; i++)
            use[i] = standing[i] != LEFT_OUT;
        fleet_mixed_free(&out->mixed);
        status = fleet_mixed_fit(e, use, &out->mixed, err);
        if (status == BF_OK)
            status = judge(e, out, standing, &changed, err);
    }
    free(standing);
    return status;
}

/* ---- Drift ---- */

/* y = a + b (t − middle), errors sd and a scatter of their own; weighted sums of one try. */
struct line {
    double middle, slope, slope_sd, misfit; /* Σ w r² */
};

static void fit_line(size_t n, const double t[], const double y[], const double sd[], double scatter, struct line *out)
{
    double w = 0.0, wt = 0.0, wy = 0.0, tt = 0.0, ty = 0.0;
    for (size_t i = 0; i < n; i++) {
        const double weight = 1.0 / (scatter + sd[i] * sd[i]);
        w += weight, wt += weight * t[i], wy += weight * y[i];
    }
    out->middle = wt / w;
    for (size_t i = 0; i < n; i++) {
        const double weight = 1.0 / (scatter + sd[i] * sd[i]), dt = t[i] - out->middle;
        tt += weight * dt * dt, ty += weight * dt * (y[i] - wy / w);
    }
    out->slope = ty / tt;
    out->slope_sd = 1.0 / sqrt(tt);
    out->misfit = 0.0;
    for (size_t i = 0; i < n; i++) {
        const double r = y[i] - wy / w - out->slope * (t[i] - out->middle);
        out->misfit += r * r / (scatter + sd[i] * sd[i]);
    }
}

/* The scatter with which the misfit is n − 2 (Paule & Mandel 1982). */
void population_line(size_t n, const double t[], const double y[], const double sd[], struct fleet_drift *out)
{
    struct line line;
    double low = 0.0, high = 0.0;
    for (size_t i = 0; i < n; i++)
        high = fmax(high, (y[i] - y[0]) * (y[i] - y[0]));
    fit_line(n, t, y, sd, low = 1e-12 * high, &line);
    if (line.misfit > (double)n - 2.0)
        for (int k = 0; k < 100; k++) {
            const double scatter = sqrt(low * high);
            fit_line(n, t, y, sd, scatter, &line);
            if (line.misfit > (double)n - 2.0)
                low = scatter;
            else
                high = scatter;
        }
    const double ratio = line.slope / line.slope_sd;
    out->n = n;
    out->middle = line.middle, out->slope = line.slope, out->sd = line.slope_sd;
    out->p_value = f_tail(ratio * ratio, 1.0, (double)n - 2.0);
}
