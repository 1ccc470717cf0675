/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "maths.h"

#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <arpack.h>
#include <cholmod.h>

struct sparse_factor {
    cholmod_common common;
    cholmod_factor *factor;
    cholmod_dense *work_x, *work_y, *work_e; /* kept between solves by cholmod_solve2 */
    size_t n;
};

static cholmod_sparse *banded_to_sparse(size_t n, size_t width, const double band[], cholmod_common *common)
{
    cholmod_sparse *A = cholmod_allocate_sparse(n, n, n * width, 1, 1, 1, CHOLMOD_REAL, common); /* upper stored */
    if (A == NULL)
        return NULL;
    int *column = A->p, *row = A->i;
    double *value = A->x;
    int k = 0;
    for (size_t j = 0; j < n; j++) {
        column[j] = k;
        size_t first = j + 1 > width ? j + 1 - width : 0;
        for (size_t i = first; i <= j; i++) {
            row[k] = (int)i;
            value[k++] = band[i * width + (j - i)];
        }
    }
    column[n] = k;
    return A;
}

enum bf_status sparse_factorise(size_t n, size_t width, const double band[], struct sparse_factor **out,
                                struct bf_error *err)
{
    for (size_t i = 0; i < n * width; i++)
        if (!isfinite(band[i])) /* CHOLMOD would factorise it */
            return bf_fail(err, BF_NUMERIC, "the stiffness matrix holds a number that is not finite");
    struct sparse_factor *f = bf_alloc(1, sizeof *f);
    *f = (struct sparse_factor){.n = n};
    cholmod_start(&f->common);
    f->common.print = 0;
    f->common.nmethods = 1;
    f->common.method[0].ordering = CHOLMOD_NATURAL; /* banded: the natural order has no fill outside the band */
    f->common.postorder = 0;
    f->common.final_ll = 1; /* LDLᵀ would accept an indefinite matrix */
    cholmod_sparse *A = banded_to_sparse(n, width, band, &f->common);
    if (A != NULL) {
        f->factor = cholmod_analyze(A, &f->common);
        if (f->factor != NULL)
            cholmod_factorize(A, f->factor, &f->common);
        cholmod_free_sparse(&A, &f->common);
    }
    if (f->factor == NULL || f->common.status != CHOLMOD_OK || f->factor->minor < n) {
        sparse_free(f);
        return bf_fail(err, BF_NUMERIC, "the stiffness matrix is not positive definite; check EI and the supports");
    }
    *out = f;
    return BF_OK;
}

enum bf_status sparse_solve(struct sparse_factor *f, const double b[], double x[], struct bf_error *err)
{
    double *copy = bf_alloc(f->n, sizeof *copy);
    memcpy(copy, b, f->n * sizeof *copy);
    cholmod_dense rhs = {.nrow = f->n, .ncol = 1, .nzmax = f->n, .d = f->n, .x = copy, .xtype = CHOLMOD_REAL};
    int ok = cholmod_solve2(CHOLMOD_A, f->factor, &rhs, NULL, &f->work_x, NULL, &f->work_y, &f->work_e, &f->common);
    if (ok)
        memcpy(x, f->work_x->x, f->n * sizeof *x);
    free(copy);
    return ok ? BF_OK
              : bf_fail(err, BF_NUMERIC, "a sparse triangular solve failed (CHOLMOD status %d)", f->common.status);
}

void sparse_free(struct sparse_factor *f)
{
    if (f == NULL)
        return;
    cholmod_free_dense(&f->work_x, &f->common);
    cholmod_free_dense(&f->work_y, &f->common);
    cholmod_free_dense(&f->work_e, &f->common);
    cholmod_free_factor(&f->factor, &f->common);
    cholmod_finish(&f->common);
    free(f);
}

/* ---- Modes ---- */

/* Relative error of an eigenvalue at which the iteration ends: far below what a spline space leaves. */
static const double ritz_error = 1e-11;

/* ARPACK keeps state between reverse-communication calls in static storage: one eigenproblem at a time. */
static pthread_mutex_t arpack_mutex = PTHREAD_MUTEX_INITIALIZER;

struct lanczos {
    size_t n, n_modes;
    a_int n_lanczos, ido, info;
    a_int iparam[11], ipntr[11];
    double *residual, *basis, *workd, *workl;
    a_int lworkl;
};

static struct lanczos lanczos_new(size_t n, size_t n_modes)
{
    size_t wanted = 2 * n_modes + 12 < n ? 2 * n_modes + 12 : n;
    struct lanczos l = {.n = n, .n_modes = n_modes, .n_lanczos = (a_int)wanted, .info = 1};
    l.lworkl = l.n_lanczos * (l.n_lanczos + 8);
    l.residual = bf_alloc(n, sizeof(double));
    l.basis = bf_alloc(n * wanted, sizeof(double));
    l.workd = bf_alloc(3 * n, sizeof(double));
    l.workl = bf_alloc((size_t)l.lworkl, sizeof(double));
    l.iparam[0] = 1;   /* exact shifts */
    l.iparam[2] = 300; /* restarts at most */
    l.iparam[6] = 3;   /* shift-invert */
    for (size_t i = 0; i < n; i++)
        l.residual[i] = 1.0 + 0.37 * (double)(i % 7); /* a fixed start: the same answer every time */
    return l;
}

static void lanczos_free(struct lanczos *l)
{
    free(l->residual);
    free(l->basis);
    free(l->workd);
    free(l->workl);
}

static enum bf_status lanczos_run(struct lanczos *l, struct sparse_factor *factor,
                                  void (*multiply)(const void *, const double[], double[]), const void *context,
                                  struct bf_error *err)
{
    enum bf_status status = BF_OK;
    while (status == BF_OK) {
        dsaupd_c(&l->ido, "G", (a_int)l->n, "LM", (a_int)l->n_modes, ritz_error, l->residual, l->n_lanczos, l->basis,
                 (a_int)l->n, l->iparam, l->ipntr, l->workd, l->workl, l->lworkl, &l->info);
        double *x = l->workd + l->ipntr[0] - 1, *y = l->workd + l->ipntr[1] - 1;
        if (l->ido == 2) {
            multiply(context, x, y); /* y = M x */
        } else if (l->ido == -1) {
            multiply(context, x, y); /* y = (K − σM)⁻¹ M x */
            status = sparse_solve(factor, y, y, err);
        } else if (l->ido == 1) {
            status = sparse_solve(factor, l->workd + l->ipntr[2] - 1, y, err); /* M x is already there */
        } else {
            break;
        }
    }
    if (status == BF_OK && l->info != 0)
        return bf_fail(err, BF_NUMERIC, "the eigenvalue iteration did not converge (ARPACK info %d)", (int)l->info);
    return status;
}

static void fix_sign(size_t n, double v[])
{
    double largest = 0.0;
    for (size_t i = 0; i < n; i++)
        if (v[i] * v[i] > largest * largest)
            largest = v[i];
    if (largest < 0.0)
        for (size_t i = 0; i < n; i++)
            v[i] = -v[i];
}

enum bf_status sparse_modes(struct sparse_factor *factor, size_t n, size_t n_modes, double shift,
                            void (*multiply)(const void *context, const double x[], double y[]), const void *context,
                            double values[], double vectors[], struct bf_error *err)
{
    if (n_modes + 2 > n)
        return bf_fail(err, BF_NUMERIC, "%zu modes were asked of a space of dimension %zu", n_modes, n);
    struct lanczos l = lanczos_new(n, n_modes);
    a_int *select = bf_alloc((size_t)l.n_lanczos, sizeof *select);
    pthread_mutex_lock(&arpack_mutex);
    enum bf_status status = lanczos_run(&l, factor, multiply, context, err);
    if (status == BF_OK)
        dseupd_c(true, "A", select, values, vectors, (a_int)n, shift, "G", (a_int)n, "LM", (a_int)n_modes, ritz_error,
                 l.residual, l.n_lanczos, l.basis, (a_int)n, l.iparam, l.ipntr, l.workd, l.workl, l.lworkl, &l.info);
    pthread_mutex_unlock(&arpack_mutex);
    if (status == BF_OK && (l.info != 0 || (size_t)l.iparam[4] < n_modes))
        status = bf_fail(err, BF_NUMERIC, "only %d of %zu modes converged (ARPACK info %d)", (int)l.iparam[4], n_modes,
                         (int)l.info);
    for (size_t k = 0; status == BF_OK && k < n_modes; k++)
        fix_sign(n, vectors + k * n);
    free(select);
    lanczos_free(&l);
    return status;
}
