/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The scatter of rows that are no samples. Where the file states standard errors they hold, unless χ² of what the fit leaves says that they are too small; where it
 * states none, what the fit leaves tells them, over as many degrees of freedom as the rows have beside the parameters that they determine.
 */
#include <math.h>
#include <stdlib.h>

#include "line_statistics.h"
#include "maths/maths.h"

static const double dependent = 1e-10; /* columns of the Jacobian */
static const double too_small = 0.01;  /* p of χ² below which stated errors are not believed */

/* leverage[n_rows] of the rows of lines: diagonal of the projection on the columns of the Jacobian. */
static enum bf_status find_leverage(const struct fit_problem *p, double leverage[], struct bf_error *err)
{
    const size_t n = p->n_unknowns, rows = p->n_jacobian > n ? p->n_jacobian : n;
    size_t rank;
    double *A = bf_alloc(rows * n, sizeof *A), *Q = bf_alloc(rows * n, sizeof *Q);
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < p->n_jacobian; i++)
            A[i + j * rows] = p->jacobian[i + j * p->n_jacobian];
    const enum bf_status status = n > 0 ? dense_orthonormal(rows, n, A, dependent, Q, NULL, &rank, err) : BF_OK;
    for (size_t j = 0; n > 0 && !status && j < rank; j++)
        for (size_t i = 0; i < p->lines->n_rows; i++)
            leverage[i] += pow(Q[p->n_jacobian - p->lines->n_rows + i + j * rows], 2.0);
    free(A), free(Q);
    return status;
}

/* Variance of a group's rows, in units of the standard errors that they were taken to have. */
static double variance_of(const struct line_rows *lines, const struct line_group *group, const double leverage[],
                          bool *known)
{
    double square = 0.0, dof = 0.0;
    for (size_t k = group->row; k < group->row + group->n; k++) {
        square += pow(lines->residual[k], 2.0);
        dof += lines->used[k] ? 1.0 - leverage[k] : 0.0;
    }
    *known = group->stated || dof > 0.5;
    if (group->stated && (dof < 0.5 || chi_square_tail(square, dof) > too_small))
        return 1.0;
    return dof > 0.5 ? square / dof : 1.0;
}

enum bf_status lines_noise(const struct fit_problem *p, struct interval_channel channels[], bool known[],
                           struct bf_error *err)
{
    if (p->lines == NULL)
        return BF_OK;
    double *leverage = bf_alloc(p->lines->n_rows, sizeof *leverage);
    const enum bf_status status = find_leverage(p, leverage, err);
    for (size_t g = 0; g < p->lines->n_groups && !status; g++) {
        const struct line_group *group = &p->lines->groups[g];
        channels[g] = (struct interval_channel){.row = p->n_sample_rows + group->row, .n = group->n};
        known[g] = true;
        if (group->kind == LINE_MAGNITUDE) /* neighbouring lines go together where a window was used */
            ar_fit(p->lines->residual + group->row, group->n, &channels[g].noise);
        else
            channels[g].noise.sigma = sqrt(variance_of(p->lines, group, leverage, &known[g]));
    }
    free(leverage);
    return status;
}
