/* SPDX-License-Identifier: GPL-3.0-or-later */
/* stabilisation.c — the free linear models of 1, 2, 3 … modes and the poles that stay where they are from one to the next. */
#include "compare.h"
#include "maths/maths.h"
#include "stabilisation.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double frequency_stays = 0.01; /* relative change from the order below, at most */
static const double damping_stays = 0.05;   /* the same of the damping ratio */
static const double most_damping = 0.2;     /* of a pole that is shown: beyond are shapes of the spectrum, no modes */
static const double band_edge = 0.98;       /* of the band: poles above are of what lies beyond */
enum { FEWEST_ORDERS = 4 };                 /* in which a pole is stable, to be named */

/* ---- Poles of one order ---- */

/* a[n + 1], a[n] = 1, minimises aᵀ M a. BF_NUMERIC: M says nothing. */
static enum bf_status solve_denominator(const struct stabilisation_sums *sums, size_t n, double a[],
                                        struct bf_error *err)
{
    double *M = bf_alloc((n + 1) * (n + 1), sizeof *M), *part = bf_alloc(n * n, sizeof *part);
    enum bf_status status = stabilisation_reduce(sums, n, M, err);
    for (size_t i = 0; i < n; i++) {
        a[i] = -M[i * (n + 1) + n];
        for (size_t j = 0; j < n; j++)
            part[i * n + j] = M[i * (n + 1) + j];
    }
    a[n] = 1.0;
    if (status == BF_OK)
        status = dense_lu_solve(n, 1, part, a, err);
    free(M), free(part);
    return status;
}

/* Zeros of Σ a_j y^j, a_n = 1, y = 1/z: eigenvalues of the companion matrix. y: [n]. */
static enum bf_status find_zeros(const double a[], size_t n, double complex y[], struct bf_error *err)
{
    double *C = bf_alloc(n * n, sizeof *C);
    for (size_t i = 0; i < n; i++) {
        C[i * n + n - 1] = -a[i];
        if (i > 0)
            C[i * n + i - 1] = 1.0;
    }
    const enum bf_status status = dense_general_eigen(n, C, y, NULL, NULL, err);
    free(C);
    return status;
}

static int by_frequency(const void *a, const void *b)
{
    const double x = ((const struct stabilisation_pole *)a)->frequency_Hz,
                 y = ((const struct stabilisation_pole *)b)->frequency_Hz;
    return (x > y) - (x < y);
}

/* Decaying, lightly damped, inside the band; s = −2 f_top log y. */
static void keep_poles(const double complex y[], size_t n, double to_Hz, struct stabilisation *out)
{
    const size_t first = out->n_poles;
    for (size_t k = 0; k < n; k++) {
        const double complex s = -2.0 * to_Hz * clog(y[k]);
        const double f_Hz = cabs(s) / (2.0 * M_PI), zeta = -creal(s) / cabs(s);
        if (cimag(s) > 0.0 && zeta > 0.0 && zeta < most_damping && f_Hz < band_edge * to_Hz) {
            out->poles = bf_grow(out->poles, out->n_poles + 1, sizeof *out->poles);
            out->poles[out->n_poles++] =
                (struct stabilisation_pole){.modes = n / 2, .frequency_Hz = f_Hz, .damping_ratio = zeta};
        }
    }
    if (out->n_poles > first)
        qsort(out->poles + first, out->n_poles - first, sizeof *out->poles, by_frequency);
}

/* What the poles [first, n_poles) have in common with those of the order below, [below, first). */
static void mark_stable(struct stabilisation *s, size_t below, size_t first)
{
    for (size_t k = first; k < s->n_poles; k++) {
        struct stabilisation_pole *pole = &s->poles[k];
        for (size_t b = below; b < first; b++) {
            const struct stabilisation_pole *last = &s->poles[b];
            if (fabs(pole->frequency_Hz / last->frequency_Hz - 1.0) > frequency_stays)
                continue;
            pole->frequency_stable = true;
            if (fabs(pole->damping_ratio / last->damping_ratio - 1.0) <= damping_stays)
                pole->stable = true;
        }
    }
}

/* ---- Columns of stable poles ---- */

/* Medians of stable poles [from, to), ascending in frequency, when they are of enough orders. */
static void name_column(const struct stabilisation_pole stable[], size_t from, size_t to, struct stabilisation *out)
{
    const size_t n = to - from;
    if (n < FEWEST_ORDERS)
        return;
    double *f_Hz = bf_alloc(n, sizeof *f_Hz), *zeta = bf_alloc(n, sizeof *zeta);
    for (size_t k = 0; k < n; k++) {
        f_Hz[k] = stable[from + k].frequency_Hz;
        zeta[k] = stable[from + k].damping_ratio;
    }
    out->found = bf_grow(out->found, out->n_found + 1, sizeof *out->found);
    out->found[out->n_found++] = (struct stabilisation_found){median(n, f_Hz), median(n, zeta), n};
    free(f_Hz), free(zeta);
}

static void find_columns(struct stabilisation *out)
{
    struct stabilisation_pole *stable = bf_alloc(out->n_poles + 1, sizeof *stable);
    size_t n = 0, from = 0;
    for (size_t k = 0; k < out->n_poles; k++)
        if (out->poles[k].stable)
            stable[n++] = out->poles[k];
    qsort(stable, n, sizeof *stable, by_frequency);
    for (size_t k = 1; k <= n; k++)
        if (k == n || stable[k].frequency_Hz > (1.0 + frequency_stays) * stable[k - 1].frequency_Hz) {
            name_column(stable, from, k, out);
            from = k;
        }
    free(stable);
}

/* ---- All ---- */

enum bf_status stabilisation_find(const struct comparison *comparison, struct stabilisation *out, struct bf_error *err)
{
    struct stabilisation_sums sums = {0};
    double a[2 * STABILISATION_MODES + 1];
    double complex y[2 * STABILISATION_MODES];
    *out = (struct stabilisation){0};
    enum bf_status status = stabilisation_sum(comparison, &sums, out, err);
    for (size_t m = 1, below = 0; status == BF_OK && sums.n > 0 && m <= STABILISATION_MODES; m++) {
        const size_t first = out->n_poles;
        status = solve_denominator(&sums, 2 * m, a, err);
        if (status == BF_OK)
            status = find_zeros(a, 2 * m, y, err);
        if (status == BF_OK) {
            keep_poles(y, 2 * m, out->to_Hz, out);
            mark_stable(out, below, first);
            out->modes = m;
        }
        below = first;
    }
    if (status == BF_OK)
        find_columns(out);
    stabilisation_sums_free(&sums);
    return status;
}

void stabilisation_free(struct stabilisation *s)
{
    free(s->poles), free(s->found), free(s->line_Hz), free(s->magnitude);
    *s = (struct stabilisation){0};
}
