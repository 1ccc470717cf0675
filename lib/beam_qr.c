/* SPDX-License-Identifier: MIT */
/*
 * Eigenvalues of a real matrix: balancing (Parlett and Reinsch 1969), Hessenberg form by elimination with pivoting
 * (Wilkinson 1965), Francis' double-shift QR (Golub and Van Loan, algorithm 7.5.1), with deflation.
 */
#include "beam_dense.h"

/* Scale rows and columns by powers of two until their norms agree within a factor of two. */
static void balance(int n, beam_matrix a)
{
    for (int round = 0; round < 20; round++) {
        int done = 1;
        for (int i = 0; i < n; i++) {
            beam_real row = BEAM_K(0.0), column = BEAM_K(0.0), f = BEAM_K(1.0);
            for (int j = 0; j < n; j++)
                if (j != i) {
                    row += beam_fabs(a[i][j]);
                    column += beam_fabs(a[j][i]);
                }
            if (!beam_less(BEAM_K(0.0), row) || !beam_less(BEAM_K(0.0), column))
                continue;
            const beam_real before = row + column;
            beam_real c = column, r = row;
            for (int step = 0; step < 60 && beam_less(c, BEAM_K(0.5) * r); step++) {
                f *= BEAM_K(2.0);
                c *= BEAM_K(2.0);
                r *= BEAM_K(0.5);
            }
            for (int step = 0; step < 60 && beam_less(BEAM_K(2.0) * r, c); step++) {
                f *= BEAM_K(0.5);
                c *= BEAM_K(0.5);
                r *= BEAM_K(2.0);
            }
            if (!beam_less(c + r, BEAM_K(0.95) * before))
                continue;
            done = 0;
            for (int j = 0; j < n; j++)
                a[i][j] /= f;
            for (int j = 0; j < n; j++)
                a[j][i] *= f;
        }
        if (done)
            return;
    }
}

static void to_hessenberg(int n, beam_matrix a)
{
    for (int m = 1; m < n - 1; m++) {
        int best = m;
        for (int i = m + 1; i < n; i++)
            if (beam_less(beam_fabs(a[best][m - 1]), beam_fabs(a[i][m - 1])))
                best = i;
        if (best != m) {
            for (int j = 0; j < n; j++) {
                const beam_real x = a[best][j];
                a[best][j] = a[m][j];
                a[m][j] = x;
            }
            for (int j = 0; j < n; j++) {
                const beam_real x = a[j][best];
                a[j][best] = a[j][m];
                a[j][m] = x;
            }
        }
        if (!beam_less(BEAM_K(0.0), beam_fabs(a[m][m - 1])))
            continue;
        for (int i = m + 1; i < n; i++) {
            const beam_real f = a[i][m - 1] / a[m][m - 1];
            for (int j = 0; j < n; j++)
                a[i][j] -= f * a[m][j];
            for (int j = 0; j < n; j++)
                a[j][m] += f * a[j][i];
            a[i][m - 1] = BEAM_K(0.0);
        }
    }
}

/* Eigenvalues of the trailing 2 × 2 block of rows e − 1, e. */
static void pair_of_block(beam_matrix a, int e, beam_real re[], beam_real im[])
{
    const beam_real half = BEAM_K(0.5) * (a[e - 1][e - 1] - a[e][e]), middle = a[e][e] + half;
    const beam_real d = half * half + a[e - 1][e] * a[e][e - 1];
    if (beam_less(d, BEAM_K(0.0))) {
        re[e - 1] = re[e] = middle;
        im[e - 1] = beam_sqrt(-d);
        im[e] = -im[e - 1];
        return;
    }
    const beam_real z = beam_less(half, BEAM_K(0.0)) ? half - beam_sqrt(d) : half + beam_sqrt(d);
    re[e - 1] = a[e][e] + z;
    re[e] = beam_less(BEAM_K(0.0), beam_fabs(z)) ? a[e][e] - a[e - 1][e] * a[e][e - 1] / z : a[e][e];
    im[e - 1] = im[e] = BEAM_K(0.0);
}

/* Householder vector v (v[0] = 1) and factor that turn x[0 .. m−1] into a multiple of e₀. */
static beam_real reflector(int m, const beam_real x[3], beam_real v[3])
{
    beam_real scale = BEAM_K(0.0), norm2 = BEAM_K(0.0);
    v[0] = BEAM_K(1.0);
    v[1] = v[2] = BEAM_K(0.0);
    for (int i = 0; i < m; i++)
        scale += beam_fabs(x[i]);
    if (!beam_less(BEAM_K(0.0), scale))
        return BEAM_K(0.0);
    for (int i = 0; i < m; i++)
        norm2 += (x[i] / scale) * (x[i] / scale);
    const beam_real first = x[0] / scale, norm = beam_sqrt(norm2);
    const beam_real pivot = beam_less(first, BEAM_K(0.0)) ? first - norm : first + norm;
    for (int i = 1; i < m; i++)
        v[i] = x[i] / scale / pivot;
    return beam_fabs(pivot) / norm; /* 2/(vᵀv) */
}

/*
 * One implicit double-shift sweep on rows l..e; the shifts are the eigenvalues of a 2 × 2 block with diagonal p, q and
 * product pq of the other two entries. Written in differences, so that a cluster of equal eigenvalues does not drown in their squares.
 */
static void sweep(beam_matrix a, int l, int e, beam_real p, beam_real q, beam_real pq)
{
    beam_real x[3], v[3];
    const beam_real to_p = p - a[l][l], to_q = q - a[l][l];
    x[0] = (to_p * to_q - pq) / a[l + 1][l] + a[l][l + 1];
    x[1] = a[l + 1][l + 1] - a[l][l] - to_p - to_q;
    x[2] = l + 2 <= e ? a[l + 2][l + 1] : BEAM_K(0.0);
    for (int k = l; k < e; k++) {
        const int m = k + 2 <= e ? 3 : 2;
        if (k > l)
            for (int i = 0; i < m; i++)
                x[i] = a[k + i][k - 1];
        const beam_real beta = reflector(m, x, v);
        for (int j = k > l ? k - 1 : l; j <= e; j++) {
            beam_real sum = BEAM_K(0.0);
            for (int i = 0; i < m; i++)
                sum += v[i] * a[k + i][j];
            for (int i = 0; i < m; i++)
                a[k + i][j] -= beta * sum * v[i];
        }
        const int last = k + 3 <= e ? k + 3 : e;
        for (int i = l; i <= last; i++) {
            beam_real sum = BEAM_K(0.0);
            for (int j = 0; j < m; j++)
                sum += v[j] * a[i][k + j];
            for (int j = 0; j < m; j++)
                a[i][k + j] -= beta * sum * v[j];
        }
    }
}

int beam_eigenvalues(int n, beam_matrix a, beam_real re[], beam_real im[])
{
    balance(n, a);
    to_hessenberg(n, a);
    beam_real norm = BEAM_K(0.0);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (beam_less(norm, beam_fabs(a[i][j])))
                norm = beam_fabs(a[i][j]);
    int e = n - 1, turns = 0;
    while (e >= 0) {
        int l = e;
        for (; l > 0; l--) {
            /* backward error of the whole: what is looked for are start values */
            const beam_real size = beam_fabs(a[l][l]) + beam_fabs(a[l - 1][l - 1]) + norm;
            if (!beam_less(BEAM_EPSILON * size, beam_fabs(a[l][l - 1])))
                break;
        }
        if (l == e) {
            re[e] = a[e][e];
            im[e] = BEAM_K(0.0);
            e -= 1;
            turns = 0;
        } else if (l == e - 1) {
            pair_of_block(a, e, re, im);
            e -= 2;
            turns = 0;
        } else {
            if (++turns > 60)
                return -1;
            beam_real p = a[e][e], q = a[e - 1][e - 1], pq = a[e][e - 1] * a[e - 1][e];
            if (turns % 10 == 0) { /* exceptional shift */
                const beam_real w = beam_fabs(a[e][e - 1]) + beam_fabs(a[e - 1][e - 2]);
                p = q = a[e][e] + BEAM_K(0.75) * w;
                pq = BEAM_K(-0.4375) * w * w;
            }
            sweep(a, l, e, p, q, pq);
        }
    }
    return 0;
}
