/* SPDX-License-Identifier: MIT */
/*
 * Real poles with positive form. The first-order system in x = (q, q̇, h) is S ẋ = T x with symmetric
 *     S = [Ĉ 1 0; 1 0 0; 0 0 1],  T = [−K∞ 0 −Λ; 0 1 0; −Λᵀ 0 −1/τ],  K∞ = ω² + Λ τ Λᵀ,
 * so eigenvectors of different poles are S-orthogonal and x = (φ, pφ, −λᵀφ/(p + 1/τ)) has xᵀSx = φᵀQ'φ. Taking the known
 * poles out of unit vectors leaves the subspace of the wanted ones; S is definite there.
 */
#include "beam_modal.h"

#ifdef BEAM_FLOAT
#define INDEPENDENT BEAM_K(1e-3)
#else
#define INDEPENDENT BEAM_K(1e-6)
#endif

enum { Q = 0, V = BEAM_N, H = 2 * BEAM_N };

static void times_s(const struct beam_work *work, const beam_real x[BEAM_STATES], beam_real out[BEAM_STATES])
{
    for (int i = 0; i < BEAM_N; i++) {
        out[Q + i] = x[V + i];
        for (int j = 0; j < BEAM_N; j++)
            out[Q + i] += work->damping[i][j] * x[Q + j];
        out[V + i] = x[Q + i];
    }
    for (int m = 0; m < work->n_memory_states; m++)
        out[H + m] = x[H + m];
}

static void times_t(const struct beam_work *work, const beam_real x[BEAM_STATES], beam_real out[BEAM_STATES])
{
    for (int i = 0; i < BEAM_N; i++) {
        out[Q + i] = -work->modes.omega_radps[i] * work->modes.omega_radps[i] * x[Q + i];
        out[V + i] = x[V + i];
    }
    for (int m = 0; m < work->n_memory_states; m++) {
        const beam_real *lambda = work->memory_vector[m];
        beam_real projection = BEAM_K(0.0);
        for (int i = 0; i < BEAM_N; i++)
            projection += lambda[i] * x[Q + i];
        for (int i = 0; i < BEAM_N; i++)
            out[Q + i] -= lambda[i] * (projection / work->memory_rate[m] + x[H + m]);
        out[H + m] = -projection - work->memory_rate[m] * x[H + m];
    }
}

static beam_real dot(int n, const beam_real a[], const beam_real b[])
{
    beam_real sum = BEAM_K(0.0);
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* x of pole k, real and imaginary part. */
static void eigenvector(const struct beam_work *work, int k, beam_real re[BEAM_STATES], beam_real im[BEAM_STATES])
{
    const struct beam_poles *poles = &work->poles;
    const beam_real p_re = poles->re[k], p_im = poles->im[k];
    const beam_real *a = poles->shape_re[k], *b = poles->shape_im[k];
    for (int i = 0; i < BEAM_N; i++) {
        re[Q + i] = a[i];
        im[Q + i] = b[i];
        re[V + i] = p_re * a[i] - p_im * b[i];
        im[V + i] = p_re * b[i] + p_im * a[i];
    }
    for (int m = 0; m < work->n_memory_states; m++) {
        const beam_real la = dot(BEAM_N, work->memory_vector[m], a), lb = dot(BEAM_N, work->memory_vector[m], b);
        const beam_real d_re = p_re + work->memory_rate[m], size = d_re * d_re + p_im * p_im;
        re[H + m] = -(la * d_re + lb * p_im) / size;
        im[H + m] = -(lb * d_re - la * p_im) / size;
    }
}

/* u ← u − Σ x (xᵀSu)/(xᵀSx) over the known poles and their conjugates */
static void take_out_known(const struct beam_work *work, int n, beam_real u[BEAM_STATES])
{
    const struct beam_poles *poles = &work->poles;
    beam_real su[BEAM_STATES], re[BEAM_STATES], im[BEAM_STATES];
    times_s(work, u, su);
    for (int k = 0; k < poles->n_complex + poles->n_real; k++) {
        eigenvector(work, k, re, im);
        const beam_real twice = k < poles->n_complex ? BEAM_K(2.0) : poles->sign[k];
        const beam_real c_re = dot(n, re, su), c_im = dot(n, im, su);
        for (int i = 0; i < n; i++)
            u[i] -= twice * (re[i] * c_re - im[i] * c_im);
    }
}

/* u ← u − Σ uᵢ(uᵢᵀSu), then scaled to uᵀSu = 1; 0 when less than a share INDEPENDENT of `scale` is left of uᵀSu. */
static int orthonormalise(const struct beam_work *work, int n, int found, beam_real scale, beam_real u[BEAM_STATES])
{
    beam_real su[BEAM_STATES];
    for (int turn = 0; turn < 2; turn++) {
        times_s(work, u, su);
        for (int k = 0; k < found; k++) {
            const beam_real c = dot(n, work->c[k], su);
            for (int i = 0; i < n; i++)
                u[i] -= c * work->c[k][i];
        }
    }
    times_s(work, u, su);
    const beam_real after = dot(n, u, su);
    if (!beam_less(INDEPENDENT * scale, after))
        return 0;
    for (int i = 0; i < n; i++)
        u[i] /= beam_sqrt(after);
    return 1;
}

enum beam_status beam_real_poles(struct beam_work *work, int wanted)
{
    const int n = 2 * BEAM_N + work->n_memory_states;
    struct beam_poles *poles = &work->poles;
    beam_real value[BEAM_STATES], image[BEAM_STATES];
    int found = 0;
    for (int candidate = 0; candidate < n && found < wanted; candidate++) { /* h first, then q and q̇ */
        beam_real *u = work->c[found], scale = BEAM_K(1.0);
        const int unit = (candidate + H) % n;
        if (unit < H && beam_less(BEAM_K(0.0), work->modes.omega_radps[unit % BEAM_N]))
            scale = unit < V ? work->modes.omega_radps[unit] : BEAM_K(1.0) / work->modes.omega_radps[unit - V];
        for (int i = 0; i < n; i++)
            u[i] = i == unit ? BEAM_K(1.0) : BEAM_K(0.0);
        take_out_known(work, n, u);
        take_out_known(work, n, u);
        found += orthonormalise(work, n, found, scale, u);
    }
    if (found < wanted)
        return BEAM_ERROR_DEFECTIVE;
    for (int j = 0; j < wanted; j++) {
        times_t(work, work->c[j], image);
        for (int i = 0; i < wanted; i++)
            work->a[i][j] = dot(n, work->c[i], image); /* UᵀTU, with UᵀSU = 1 */
    }
    for (int i = 0; i < wanted; i++)
        for (int j = 0; j < i; j++)
            work->a[i][j] = work->a[j][i] = BEAM_K(0.5) * (work->a[i][j] + work->a[j][i]);
    if (beam_symmetric_eigen(wanted, BEAM_STATES, work->a[0], work->b[0], value) != 0)
        return BEAM_ERROR_DEFECTIVE;
    for (int k = 0; k < wanted; k++) {
        const int slot = poles->n_complex + poles->n_real++;
        poles->re[slot] = value[k];
        poles->im[slot] = BEAM_K(0.0);
        poles->sign[slot] = BEAM_K(1.0);
        for (int i = 0; i < BEAM_N; i++) {
            poles->shape_im[slot][i] = BEAM_K(0.0);
            poles->shape_re[slot][i] = BEAM_K(0.0);
            for (int j = 0; j < wanted; j++)
                poles->shape_re[slot][i] += work->b[j][k] * work->c[j][Q + i];
        }
    }
    return BEAM_OK;
}
