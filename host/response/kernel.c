/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"
#include "kernel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Poles beyond this multiple of the largest |s| enter as a power series in s/p ... */
static const double far_ratio = 3.0;
/* ... of this many terms: (1/3)^18 = 2.6e-9 of an already small contribution. */
enum { FAR_TERMS = 18 };
/* Points finished at a time, so that a pass finds them in the cache. */
enum { CHUNK = 128 };
/* A grid of more points is not kept at the poles, which take 448 bytes a point with 14 of them, but filled by so many points for each sum. */
enum { LONG_GRID = 65536, BLOCK = 2048 };

/* ---- One pole, one step ---- */

/* φ1 = (e^a − 1)/a, φ2 = (e^a − 1 − a)/a² and their derivatives by a; power series where the formulas cancel. */
static void phi_functions(double complex a, double complex phi[2], double complex d_phi[2])
{
    if (cabs(a) > 0.5) {
        double complex e = cexp(a);
        phi[0] = (e - 1.0) / a;
        phi[1] = (phi[0] - 1.0) / a;
        d_phi[0] = (e - phi[0]) / a;
        d_phi[1] = (d_phi[0] - phi[1]) / a;
        return;
    }
    phi[0] = phi[1] = d_phi[0] = d_phi[1] = 0.0;
    double complex power = 1.0, previous = 0.0; /* a^j, j a^(j−1) */
    double factorial = 1.0;                     /* j! */
    for (int j = 0; j < 18; j++) {
        double f1 = factorial * (double)(j + 1), f2 = f1 * (double)(j + 2);
        phi[0] += power / f1;
        phi[1] += power / f2;
        d_phi[0] += previous / f1;
        d_phi[1] += previous / f2;
        previous = (double)(j + 1) * power;
        power *= a;
        factorial = f1;
    }
}

struct pole_step pole_step(double complex p, double dt_s)
{
    double complex phi[2], d_phi[2];
    phi_functions(p * dt_s, phi, d_phi);
    struct pole_step step;
    step.e = cexp(p * dt_s);
    step.g1 = dt_s * phi[1];
    step.g0 = dt_s * (phi[0] - phi[1]);
    step.d_e = dt_s * step.e;
    step.d_g1 = dt_s * dt_s * d_phi[1];
    step.d_g0 = dt_s * dt_s * (d_phi[0] - d_phi[1]);
    return step;
}

/* ---- Kernels ---- */

/* Near poles: X = 1/(s − p) (or its held form) and dX/dp on the grid, conjugates as terms of their own. */
struct term {
    size_t pole;
    bool conjugate;
};

struct response_kernel {
    const struct system *system;
    const struct response_grid *grid;
    size_t n_terms, n_far;
    struct term *terms;
    size_t *far;
    double
        *X; /* [2][n_terms][2][m]: Re X, Im X of every term, then Re dX/dp, Im dX/dp of every term; NULL: a long grid */
};

VECTOR_CLONES static void fill_band_limited(const double complex s[], size_t m, double complex p, double X[],
                                            double dX[])
{
    for (size_t k = 0; k < m; k++) {
        double re = creal(s[k]) - creal(p), im = cimag(s[k]) - cimag(p);
        double size = re * re + im * im;
        double x = re / size, y = -im / size;
        X[k] = x;
        X[m + k] = y;
        dX[k] = x * x - y * y;
        dX[m + k] = 2.0 * x * y;
    }
}

/* q_{k+1} = e q_k + g0 u_k + g1 u_{k+1}: X(z) = (g0 + g1 z)/(z − e), z = e^(s dt). */
VECTOR_CLONES static void fill_held(const struct response_grid *grid, size_t first, size_t m, double complex p,
                                    double X[], double dX[])
{
    struct pole_step step = pole_step(p, grid->dt_s);
    if (grid->intersample == INTERSAMPLE_ZERO_ORDER_HOLD) {
        step.g0 += step.g1;
        step.d_g0 += step.d_g1;
        step.g1 = step.d_g1 = 0.0;
    }
    for (size_t k = 0; k < m; k++) { /* real arithmetic: a division of complex numbers is a call */
        const double zr = creal(grid->z[first + k]), zi = cimag(grid->z[first + k]);
        const double re = zr - creal(step.e), im = zi - cimag(step.e), size = re * re + im * im;
        const double dr = re / size, di = -im / size; /* 1/(z − e) */
        const double ar = creal(step.g0) + creal(step.g1) * zr - cimag(step.g1) * zi;
        const double ai = cimag(step.g0) + creal(step.g1) * zi + cimag(step.g1) * zr;
        const double xr = ar * dr - ai * di, xi = ar * di + ai * dr;
        const double br = creal(step.d_g0) + creal(step.d_g1) * zr - cimag(step.d_g1) * zi + creal(step.d_e) * xr -
                          cimag(step.d_e) * xi;
        const double bi = cimag(step.d_g0) + creal(step.d_g1) * zi + cimag(step.d_g1) * zr + creal(step.d_e) * xi +
                          cimag(step.d_e) * xr;
        X[k] = xr;
        X[m + k] = xi;
        dX[k] = br * dr - bi * di;
        dX[m + k] = br * di + bi * dr;
    }
}

/* X[2][n_terms][2][count] of the points from `first` on. */
static void fill(const struct response_kernel *kernel, size_t first, size_t count, double X[])
{
    const struct response_grid *grid = kernel->grid;
    for (size_t t = 0; t < kernel->n_terms; t++) {
        const double complex p = kernel->system->p[kernel->terms[t].pole],
                             own = kernel->terms[t].conjugate ? conj(p) : p;
        double *x = X + t * 2 * count, *dx = x + kernel->n_terms * 2 * count;
        if (grid->intersample == INTERSAMPLE_BAND_LIMITED)
            fill_band_limited(grid->s + first, count, own, x, dx);
        else
            fill_held(grid, first, count, own, x, dx);
    }
}

struct response_kernel *response_kernel_new(const struct system *system, const struct response_grid *grid)
{
    struct response_kernel *kernel = bf_alloc(1, sizeof *kernel);
    *kernel = (struct response_kernel){.system = system, .grid = grid};
    kernel->terms = bf_alloc(system->n_all, sizeof *kernel->terms);
    kernel->far = bf_alloc(system->n_poles, sizeof *kernel->far);
    double s_max = cabs(grid->s[grid->m - 1]);
    for (size_t k = 0; k < system->n_poles; k++) {
        if (grid->intersample == INTERSAMPLE_BAND_LIMITED && cabs(system->p[k]) > far_ratio * s_max) {
            kernel->far[kernel->n_far++] = k;
            continue;
        }
        kernel->terms[kernel->n_terms++] = (struct term){.pole = k};
        if (k < system->n_pairs)
            kernel->terms[kernel->n_terms++] = (struct term){.pole = k, .conjugate = true};
    }
    if (grid->m > LONG_GRID)
        return kernel;
    kernel->X = bf_grow(NULL, kernel->n_terms * 4 * grid->m, sizeof *kernel->X); /* all of it is filled */
    fill(kernel, 0, grid->m, kernel->X);
    return kernel;
}

void response_kernel_free(struct response_kernel *kernel)
{
    if (kernel == NULL)
        return;
    free(kernel->terms);
    free(kernel->far);
    free(kernel->X);
    free(kernel);
}

/* ---- Sums over poles ---- */

/* Coefficients of every term: H += r X + q dX/dp, and a power series c of the far poles. */
struct expansion {
    double complex *r, *q; /* [n_terms] */
    double complex *H;     /* [m] the sum */
    double c[FAR_TERMS];   /* in powers of s, then of s − σ = iω */
    double constant;       /* held inputs: what multiplies u directly */
    bool derivative;
};

/* 1/(s − p) = −Σ s^j/p^(j+1);  1/(s − p)² = Σ (j + 1) s^j/p^(j+2). Conjugate pairs sum to twice the real part. */
static void add_far(struct expansion *x, double complex p, double complex r, double complex q, double multiplicity)
{
    double complex inverse = 1.0 / p, power = inverse;
    for (int j = 0; j < FAR_TERMS; j++) {
        x->c[j] += multiplicity * creal(-r * power + q * (double)(j + 1) * power * inverse);
        power *= inverse;
    }
}

static void set_term(const struct response_kernel *kernel, struct expansion *x, size_t t, double complex r,
                     double complex q)
{
    bool conjugate = kernel->terms[t].conjugate;
    x->r[t] = conjugate ? conj(r) : r;
    x->q[t] = conjugate ? conj(q) : q;
}

static double complex integer_power(double complex p, int order)
{
    double complex result = 1.0;
    for (int i = 0; i < order; i++)
        result *= p;
    return result;
}

/* With a held input s^ν acts on the state: r p^ν, and the acceleration's direct term Σ r p. */
static void held_order(int order, double complex p, double multiplicity, double complex *r, double complex *q,
                       double complex dr, double complex dp, struct expansion *x)
{
    double complex power = integer_power(p, order), value = *r;
    if (!x->derivative) {
        *r = value * power;
        if (order == 2)
            x->constant += multiplicity * creal(value * p);
        return;
    }
    double complex lower = order > 0 ? (double)order * integer_power(p, order - 1) : 0.0;
    *r = dr * power + value * lower * dp;
    *q = value * power * dp;
    if (order == 2)
        x->constant += multiplicity * creal(dr * p + value * dp);
}

/* Residues r_k = α_k β_k and q_k = r_k δp_k of pole k, or their derivative (`change`), into the expansion. */
static void expand(const struct response_kernel *kernel, int order, const double complex alpha[],
                   const double complex beta[], const struct response_change *change, struct expansion *x)
{
    const struct system *s = kernel->system;
    const bool held = kernel->grid->intersample != INTERSAMPLE_BAND_LIMITED, derivative = x->derivative;
    size_t t = 0, far = 0;
    for (size_t k = 0; k < s->n_poles; k++) {
        double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
        double complex value = alpha[k] * beta[k], r = value, q = 0.0, dr = 0.0, dp = 0.0;
        if (derivative) {
            dr = change->d_alpha[k] * beta[k] + alpha[k] * change->d_beta[k];
            dp = change->d_p != NULL ? change->d_p[k] : 0.0;
            r = held ? value : dr;
            q = value * dp;
        }
        if (held)
            held_order(order, s->p[k], multiplicity, &r, &q, dr, dp, x);
        if (far < kernel->n_far && kernel->far[far] == k) {
            add_far(x, s->p[k], r, q, multiplicity);
            far++;
            continue;
        }
        set_term(kernel, x, t++, r, q);
        if (k < s->n_pairs)
            set_term(kernel, x, t++, r, q);
    }
}

/* Σ c_j s^j = Σ d_j (s − σ)^j: synthetic division, again and again. */
static void shift_series(double c[FAR_TERMS], double sigma)
{
    for (int first = 0; first < FAR_TERMS; first++)
        for (int j = FAR_TERMS - 2; j >= first; j--)
            c[j] += sigma * c[j + 1];
}

/* On the line s = σ + iω the even powers of s − σ are real and the odd ones imaginary. */
VECTOR_CLONES static void add_series(const double c[FAR_TERMS], const double complex s[], size_t count, double re[],
                                     double im[])
{
    for (size_t i = 0; i < count; i++) {
        double omega = cimag(s[i]), square = -omega * omega, even = 0.0, odd = 0.0;
        for (int j = FAR_TERMS - 2; j >= 0; j -= 2) {
            even = even * square + c[j];
            odd = odd * square + c[j + 1];
        }
        re[i] += even;
        im[i] += odd * omega;
    }
}

static void times_power(int order, const double complex s[], size_t count, double re[], double im[])
{
    for (int o = 0; o < order; o++) {
        for (size_t i = 0; i < count; i++) {
            double sr = creal(s[i]), si = cimag(s[i]), a = re[i];
            re[i] = a * sr - im[i] * si;
            im[i] = a * si + im[i] * sr;
        }
    }
}

/* The sum over near poles at hand for `size` points from `from` on, a chunk at a time: far poles, s^order, the constant. */
static void finish_sum(const struct response_kernel *kernel, int order, const struct expansion *x, size_t from,
                       size_t size, double re[], double im[])
{
    const struct response_grid *grid = kernel->grid;
    for (size_t first = 0; first < size; first += CHUNK) {
        const size_t count = size - first < CHUNK ? size - first : CHUNK;
        if (kernel->n_far > 0)
            add_series(x->c, grid->s + from + first, count, re + first, im + first);
        if (grid->intersample == INTERSAMPLE_BAND_LIMITED)
            times_power(order, grid->s + from + first, count, re + first, im + first);
        for (size_t i = first; i < first + count; i++)
            x->H[from + i] = CMPLX(re[i] + x->constant, im[i]);
    }
}

/*
 * Column by column what multiplies Re X, Im X (and Re dX/dp, Im dX/dp): of the real part of sum i in column 2i, of its
 * imaginary part in column 2i + 1.
 */
static void fill_weights(const struct response_kernel *kernel, const struct expansion *x, size_t rows, double weights[])
{
    double *re = weights, *im = weights + rows;
    for (size_t t = 0; t < kernel->n_terms; t++, re += 2, im += 2) {
        re[0] = im[1] = creal(x->r[t]);
        im[0] = cimag(x->r[t]);
        re[1] = -im[0];
    }
    for (size_t t = 0; t < kernel->n_terms && x->derivative; t++, re += 2, im += 2) {
        re[0] = im[1] = creal(x->q[t]);
        im[0] = cimag(x->q[t]);
        re[1] = -im[0];
    }
}

/* All sums are derivatives, or none is. */
static void sum_all(const struct response_kernel *kernel, int order, struct expansion sums[], size_t n)
{
    const size_t m = kernel->grid->m, rows = (n > 0 && sums[0].derivative ? 4 : 2) * kernel->n_terms;
    const size_t block = kernel->X != NULL ? m : BLOCK;
    double *weights = bf_alloc(2 * n * rows + 1, sizeof *weights);
    double *parts = bf_grow(NULL, 2 * n * block + 1, sizeof *parts); /* [2 n][block] */
    double *filled = kernel->X != NULL ? NULL : bf_grow(NULL, kernel->n_terms * 4 * block + 1, sizeof *filled);
    for (size_t i = 0; i < n; i++) {
        fill_weights(kernel, &sums[i], rows, weights + 2 * i * rows);
        if (kernel->n_far > 0)
            shift_series(sums[i].c, kernel->grid->sigma);
    }
    for (size_t first = 0; first < m; first += block) {
        const size_t count = m - first < block ? m - first : block;
        if (filled != NULL)
            fill(kernel, first, count, filled);
        dense_gemm(false, false, count, 2 * n, rows, 1.0, filled != NULL ? filled : kernel->X, weights, 0.0, parts);
        for (size_t i = 0; i < n; i++)
            finish_sum(kernel, order, &sums[i], first, count, parts + 2 * i * count, parts + (2 * i + 1) * count);
    }
    free(weights);
    free(parts);
    free(filled);
}

void response_value(const struct response_kernel *kernel, int order, const double complex alpha[],
                    const double complex beta[], double complex H[])
{
    struct expansion x = {.H = H};
    x.r = bf_alloc(2 * kernel->n_terms, sizeof *x.r);
    x.q = x.r + kernel->n_terms;
    expand(kernel, order, alpha, beta, NULL, &x);
    sum_all(kernel, order, &x, 1);
    free(x.r);
}

void response_derivatives(const struct response_kernel *kernel, int order, const double complex alpha[],
                          const double complex beta[], const struct response_change changes[], size_t n)
{
    const size_t terms = kernel->n_terms;
    struct expansion *sums = bf_alloc(n + 1, sizeof *sums);
    double complex *residues = bf_alloc(2 * terms * n + 1, sizeof *residues);
    for (size_t i = 0; i < n; i++) {
        sums[i] = (struct expansion){
            .r = residues + 2 * i * terms, .q = residues + (2 * i + 1) * terms, .H = changes[i].H, .derivative = true};
        expand(kernel, order, alpha, beta, &changes[i], &sums[i]);
    }
    sum_all(kernel, order, sums, n);
    free(residues);
    free(sums);
}
