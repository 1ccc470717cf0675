/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_linear_unknowns.h"

#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

static const double dependent = 1e-10; /* columns that depend on others to this share are left out */

void linear_unknowns_room(struct linear_unknowns *part, size_t n)
{
    part->A = bf_grow(part->A, part->m * n, sizeof *part->A);
    part->Q = bf_grow(part->Q, part->m * n, sizeof *part->Q);
    part->R = bf_grow(part->R, n * n, sizeof *part->R);
    part->c = bf_grow(part->c, n, sizeof *part->c);
    memset(part->c, 0, n * sizeof *part->c);
}

/* Through Q: min ‖QᵀA c − Qᵀ target‖. */
enum bf_status linear_unknowns_solve(struct linear_unknowns *part, const double target[], struct bf_error *err)
{
    if (dense_cholesky_qr(part->m, part->n, part->A, dependent, part->Q, part->R)) {
        part->rank = part->n;
        dense_gemv(true, part->m, part->n, 1.0, part->Q, target, 0.0, part->c);
        dense_back_substitute(part->n, part->R, part->c);
        return BF_OK;
    }
    enum bf_status status = dense_orthonormal(part->m, part->n, part->A, dependent, part->Q, &part->rank, err);
    if (status || part->rank == 0)
        return status;
    double *QA = bf_alloc(part->rank * part->n, sizeof *QA), *Qb = bf_alloc(part->rank, sizeof *Qb);
    dense_gemm(true, false, part->rank, part->n, part->m, 1.0, part->Q, part->A, 0.0, QA);
    dense_gemv(true, part->m, part->rank, 1.0, part->Q, target, 0.0, Qb);
    status = dense_least_squares(part->rank, part->n, QA, Qb, dependent, part->c, NULL, err);
    free(QA), free(Qb);
    return status;
}

void linear_unknowns_free(struct linear_unknowns *part)
{
    free(part->nuisance), free(part->A), free(part->Q), free(part->R), free(part->c);
    *part = (struct linear_unknowns){0};
}
