/* SPDX-License-Identifier: MIT */
/*
 * A plan in 24-bit numbers. What must survive rounding are the eigenvalues of each block, 1 + ψ with
 *     ψ = [a b; c d],  trace a + d = 2α,  determinant ad − bc = α² + s².
 * All ψ = [α + t, b; c, α − t] with −bc = s² + t² are the same block in other coordinates. A d much smaller than a
 * carries the low bits of the trace; among neighbouring b the one is taken whose rounded c gives the determinant.
 */
#include "beam_dense.h"

#ifndef BEAM_FLOAT

/* Nearest number of 24 bits (Veltkamp); ranges of a plan are far from under- and overflow. */
static beam_real narrow(beam_real x)
{
    const beam_real big = BEAM_K(536870913.0) * x; /* 2²⁹ + 1 */
    return big - (big - x);
}

/* |ψ₂₂| ≈ |α| 2⁻¹⁰, unless the block would become too skew: then the plain rotation. */
static beam_real skew_of(beam_real alpha, beam_real s)
{
    const beam_real t = alpha * (BEAM_K(1.0) - BEAM_K(1.0) / BEAM_K(1024.0));
    return beam_less(beam_fabs(t), BEAM_K(2.0) * beam_fabs(s)) ? t : BEAM_K(0.0);
}

/* New ψ, and T = [1 u; 0 v] of the change of coordinates ξ' = T ξ. */
static void narrow_block(beam_real psi[4], beam_real *u, beam_real *v)
{
    const beam_real alpha = psi[0], s = psi[2], t = skew_of(alpha, s);
    beam_real best = BEAM_K(-1.0);
    const beam_real a = narrow(alpha + t), d = narrow(BEAM_K(2.0) * alpha - a);
    /* bc from the determinant of 1 + ψ, so that an error of the trace turns the phase and not the size */
    const beam_real wanted = a * d - alpha * alpha - s * s + (a + d - BEAM_K(2.0) * alpha);
    *u = BEAM_K(0.0);
    *v = BEAM_K(1.0);
    if (!beam_less(wanted, BEAM_K(0.0))) /* half turns: nothing left to choose */
        return;
    const beam_real middle = -beam_sqrt(beam_fabs(wanted));
    for (int i = 0; i < 4096; i++) {
        const beam_real b = narrow(middle * (BEAM_K(1.0) + BEAM_K(1.2e-7) * (beam_real)i));
        const beam_real c = narrow(wanted / b);
        const beam_real error = b * c - wanted; /* > 0: the block loses a little; it must never gain */
        if (!beam_less(error, BEAM_K(0.0)) && (beam_less(best, BEAM_K(0.0)) || beam_less(error, best))) {
            best = error;
            psi[1] = b;
            psi[2] = c;
        }
    }
    psi[0] = a;
    psi[3] = d;
    *u = (a - alpha) / s; /* exact for the unrounded a, b, c */
    *v = psi[2] / s;
}

/* γ' = T γ for one block's two entries. */
static void transform_column(beam_real gamma[2], beam_real u, beam_real v)
{
    gamma[0] += u * gamma[1];
    gamma[1] *= v;
}

/* h' = h T⁻¹, T⁻¹ = [1 −u/v; 0 1/v] */
static void transform_row(beam_real row[2], beam_real u, beam_real v)
{
    row[1] = (row[1] - u * row[0]) / v;
}

static void narrow_list(int n, beam_real x[])
{
    for (int i = 0; i < n; i++)
        x[i] = narrow(x[i]);
}

enum beam_status beam_narrow(struct beam_plan *plan)
{
    const enum beam_status status = beam_plan_check(plan);
    if (status != BEAM_OK)
        return status;
    for (int block = 0; block < plan->n.n_blocks; block++) {
        beam_real *psi = plan->x.phi[block], u, v;
        const beam_real skew = beam_fabs(psi[0] - psi[3]) + beam_fabs(psi[1] + psi[2]);
        if (!beam_less(BEAM_K(0.0), beam_fabs(psi[2])) || beam_less(BEAM_K(0.0), skew))
            continue; /* real poles, or narrowed before */
        narrow_block(psi, &u, &v);
        for (int i = 0; i < BEAM_ALL_INPUTS; i++)
            transform_column(&plan->x.gamma[i][2 * block], u, v);
        for (int p = 0; p < BEAM_PORTS; p++)
            transform_column(&plan->x.gamma_port[p][2 * block], u, v);
        for (int r = 0; r < BEAM_ROWS; r++)
            transform_row(&plan->x.row[r][2 * block], u, v);
    }
    narrow_list(BEAM_PLAN_NUMBERS, (beam_real *)&plan->x);
    for (int use = 0; use < plan->n.n_uses; use++)
        narrow_list(plan->use[use].effect->n_parameters, plan->use[use].p);
    return BEAM_OK;
}

#else

/* ISO C forbids an empty translation unit. */
enum { BEAM_NARROW_IS_DOUBLE_ONLY = 1 };

#endif
