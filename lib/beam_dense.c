/* SPDX-License-Identifier: MIT */
/* Cholesky, Jacobi and Gauss elimination (Golub and Van Loan, Matrix Computations, sections 4.2, 8.5, 3.4). */
#include "beam_dense.h"

int beam_cholesky(int n, int stride, beam_real *a)
{
    for (int j = 0; j < n; j++) {
        const beam_real diagonal = a[j * stride + j];
        beam_real pivot = diagonal;
        for (int k = 0; k < j; k++)
            pivot -= a[j * stride + k] * a[j * stride + k];
        if (!beam_less((beam_real)n * BEAM_EPSILON * diagonal, pivot))
            return -1;
        pivot = beam_sqrt(pivot);
        a[j * stride + j] = pivot;
        for (int i = j + 1; i < n; i++) {
            beam_real sum = a[i * stride + j];
            for (int k = 0; k < j; k++)
                sum -= a[i * stride + k] * a[j * stride + k];
            a[i * stride + j] = sum / pivot;
        }
    }
    return 0;
}

void beam_lower_solve(int n, int stride, const beam_real *l, beam_real x[])
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= l[i * stride + k] * x[k];
        x[i] /= l[i * stride + i];
    }
}

void beam_lower_transposed_solve(int n, int stride, const beam_real *l, beam_real x[])
{
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= l[k * stride + i] * x[k];
        x[i] /= l[i * stride + i];
    }
}

/* Rotate two vectors of a matrix into each other; step: from entry to entry. */
static void rotate(int n, beam_real *x, int step, beam_real *y, beam_real c, beam_real s)
{
    for (int k = 0; k < n; k++) {
        const beam_real p = x[k * step], q = y[k * step];
        x[k * step] = c * p - s * q;
        y[k * step] = s * p + c * q;
    }
}

static void sort_columns(int n, int stride, beam_real *v, beam_real d[])
{
    for (int i = 0; i < n; i++) {
        int least = i;
        for (int j = i + 1; j < n; j++)
            if (beam_less(d[j], d[least]))
                least = j;
        const beam_real value = d[least];
        d[least] = d[i];
        d[i] = value;
        for (int k = 0; k < n; k++) {
            const beam_real x = v[k * stride + least];
            v[k * stride + least] = v[k * stride + i];
            v[k * stride + i] = x;
        }
    }
}

/* Turns a_pq to 0; 0 when it is small already. */
static int annihilate(int n, int stride, beam_real *a, beam_real *v, int p, int q, beam_real floor)
{
    const beam_real app = a[p * stride + p], aqq = a[q * stride + q], apq = a[p * stride + q];
    const beam_real size = beam_sqrt(beam_fabs(app)) * beam_sqrt(beam_fabs(aqq));
    if (!beam_less(BEAM_EPSILON * size + floor, beam_fabs(apq)))
        return 0;
    const beam_real half = (aqq - app) / (BEAM_K(2.0) * apq); /* cot 2θ */
    const beam_real root = beam_sqrt(BEAM_K(1.0) + half * half);
    const beam_real t = BEAM_K(1.0) / (beam_less(half, BEAM_K(0.0)) ? half - root : half + root);
    const beam_real c = BEAM_K(1.0) / beam_sqrt(BEAM_K(1.0) + t * t), s = t * c;
    rotate(n, a + p, stride, a + q, c, s);
    rotate(n, a + p * stride, 1, a + q * stride, c, s);
    rotate(n, v + p, stride, v + q, c, s);
    a[p * stride + q] = a[q * stride + p] = BEAM_K(0.0);
    return 1;
}

int beam_symmetric_eigen(int n, int stride, beam_real *a, beam_real *v, beam_real d[])
{
    beam_real norm = BEAM_K(0.0);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            v[i * stride + j] = i == j ? BEAM_K(1.0) : BEAM_K(0.0);
            norm += beam_fabs(a[i * stride + j]);
        }
    const beam_real floor = BEAM_EPSILON * BEAM_EPSILON * norm; /* of a singular matrix */
    for (int sweep = 0; sweep < 40; sweep++) {
        int turned = 0;
        for (int p = 0; p < n - 1; p++)
            for (int q = p + 1; q < n; q++)
                turned |= annihilate(n, stride, a, v, p, q, floor);
        if (!turned) {
            for (int i = 0; i < n; i++)
                d[i] = a[i * stride + i];
            sort_columns(n, stride, v, d);
            return 0;
        }
    }
    return -1;
}

static beam_real size2(beam_real re, beam_real im)
{
    return re * re + im * im;
}

void beam_complex_solve(int n, beam_real a_re[BEAM_N][BEAM_N], beam_real a_im[BEAM_N][BEAM_N], beam_real x_re[],
                        beam_real x_im[])
{
    beam_real largest = BEAM_K(0.0);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (beam_less(largest, size2(a_re[i][j], a_im[i][j])))
                largest = size2(a_re[i][j], a_im[i][j]);
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j + 1; i < n; i++)
            if (beam_less(size2(a_re[best][j], a_im[best][j]), size2(a_re[i][j], a_im[i][j])))
                best = i;
        for (int k = 0; k < n; k++) {
            const beam_real re = a_re[best][k], im = a_im[best][k];
            a_re[best][k] = a_re[j][k];
            a_im[best][k] = a_im[j][k];
            a_re[j][k] = re;
            a_im[j][k] = im;
        }
        const beam_real swap_re = x_re[best], swap_im = x_im[best];
        x_re[best] = x_re[j];
        x_im[best] = x_im[j];
        x_re[j] = swap_re;
        x_im[j] = swap_im;
        beam_real pivot2 = size2(a_re[j][j], a_im[j][j]);
        if (!beam_less(BEAM_EPSILON * BEAM_EPSILON * BEAM_EPSILON * BEAM_EPSILON * largest, pivot2)) {
            a_re[j][j] = BEAM_EPSILON * BEAM_EPSILON * beam_sqrt(largest);
            a_im[j][j] = BEAM_K(0.0);
            pivot2 = a_re[j][j] * a_re[j][j];
        }
        const beam_real inv_re = a_re[j][j] / pivot2, inv_im = -a_im[j][j] / pivot2;
        a_re[j][j] = inv_re; /* the inverse stays on the diagonal */
        a_im[j][j] = inv_im;
        for (int i = j + 1; i < n; i++) {
            const beam_real f_re = a_re[i][j] * inv_re - a_im[i][j] * inv_im;
            const beam_real f_im = a_re[i][j] * inv_im + a_im[i][j] * inv_re;
            for (int k = j + 1; k < n; k++) {
                a_re[i][k] -= f_re * a_re[j][k] - f_im * a_im[j][k];
                a_im[i][k] -= f_re * a_im[j][k] + f_im * a_re[j][k];
            }
            x_re[i] -= f_re * x_re[j] - f_im * x_im[j];
            x_im[i] -= f_re * x_im[j] + f_im * x_re[j];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        beam_real re = x_re[i], im = x_im[i];
        for (int k = i + 1; k < n; k++) {
            re -= a_re[i][k] * x_re[k] - a_im[i][k] * x_im[k];
            im -= a_re[i][k] * x_im[k] + a_im[i][k] * x_re[k];
        }
        x_re[i] = re * a_re[i][i] - im * a_im[i][i];
        x_im[i] = re * a_im[i][i] + im * a_re[i][i];
    }
}

int beam_real_solve(int n, beam_real a[BEAM_PORTS][BEAM_PORTS], beam_real x[BEAM_PORTS])
{
    for (int j = 0; j < n; j++) {
        int best = j;
        for (int i = j + 1; i < n; i++)
            if (beam_less(beam_fabs(a[best][j]), beam_fabs(a[i][j])))
                best = i;
        if (!beam_less(BEAM_K(0.0), beam_fabs(a[best][j])))
            return -1;
        for (int k = j; k < n; k++) {
            const beam_real swap = a[best][k];
            a[best][k] = a[j][k];
            a[j][k] = swap;
        }
        const beam_real swap = x[best];
        x[best] = x[j];
        x[j] = swap;
        for (int i = j + 1; i < n; i++) {
            const beam_real f = a[i][j] / a[j][j];
            for (int k = j + 1; k < n; k++)
                a[i][k] -= f * a[j][k];
            x[i] -= f * x[j];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= a[i][k] * x[k];
        x[i] /= a[i][i];
    }
    return 0;
}
