/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_residues.c — the residues of the free linear model: how each output answers each input in each of its modes. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>

/* (αω² + βωs)/((s − p)(s − p̄)) has the residue (αω² + βωp)/(p − p̄) at p; of two real poles there is none. */
static double complex residue_of(const double x[2], const double c[2])
{
    const double omega = exp(x[0]), a = exp(x[1]), square = omega * omega - a * a;
    if (!(square > 0.0))
        return CMPLX(NAN, NAN);
    const double complex p = CMPLX(-a, sqrt(square));
    return (c[0] * omega * omega + c[1] * omega * p) / CMPLX(0.0, 2.0 * cimag(p));
}

enum bf_status attainable_residues(struct attainable_problem *p, const double x[], size_t n_inputs,
                                   double complex residue[], struct bf_error *err)
{
    struct attainable_rows *rows = bf_alloc(p->n_records, sizeof *rows);
    enum bf_status status = attainable_compress(p, x, EXTRA_NONE, rows, err);
    for (size_t o = 0; o < p->n_outputs && status == BF_OK; o++) {
        struct attainable_stack s;
        attainable_stack_new(p, rows, o, &s);
        status = attainable_stack_solve(&s, err);
        for (size_t k = 0; k < p->m && status == BF_OK; k++)
            for (size_t i = 0; i < n_inputs; i++)
                residue[(k * p->n_outputs + o) * n_inputs + i] =
                    s.column[i] != SIZE_MAX ? residue_of(x + 2 * k, s.c + s.column[i] + 2 * k) : CMPLX(NAN, NAN);
        attainable_stack_free(&s);
    }
    attainable_rows_free(rows, p->n_records);
    free(rows);
    return status;
}
