/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Some function of displacement and velocity at a place: a regression of the residual on features of the measured motion. */
#include "reconstruct_law.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Points a sample at which the features are formed: products of motions stay below the band that folds back. */
enum { OVERSAMPLE = 2 };
/* A feature that turns within this part of the largest motion is as good as a step; a hinge opens at this part. */
static const double step_w = 0.03, step_v[LADDER] = {0.03, 1e-3, 3e-5}, hinge[LADDER] = {0.3, 0.06, 0.015};
/* Eigenvalues of the Gram matrix of unit columns below this are directions that the records do not tell apart. */
static const double blurred = 1e-7;

void reconstruct_features(double w, double v, double out[FEATURES])
{
    double *even = out + ODD_W, *rate = even + EVEN_W, size = fabs(w);
    out[0] = w;
    out[1] = w * w * w;
    out[2] = w * w * out[1];
    out[3] = tanh(w / step_w);
    even[0] = size;
    even[1] = w * w;
    even[2] = even[1] * even[1];
    rate[0] = v;
    rate[1] = v * fabs(v);
    rate[2] = v * v * v;
    for (int i = 0; i < LADDER; i++) {
        even[3 + i] = fmax(0.0, size - hinge[i]);
        out[4 + i] = copysign(even[3 + i], w);
        rate[3 + i] = tanh(v / step_v[i]);
    }
}

/* w and v of every record, [n · OVERSAMPLE] each. Free each w. */
static enum bf_status motions(const struct site_force *force, double **w, double **v, struct site_law *law,
                              struct bf_error *err)
{
    const struct motion *motion = force->motion;
    enum bf_status status = BF_OK;
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        size_t steps = motion->records[r].n * OVERSAMPLE;
        w[r] = bf_alloc(2 * steps, sizeof *w[r]);
        v[r] = w[r] + steps;
        status = motion_of(motion, r, force->g, OVERSAMPLE, w[r], v[r], NULL, err);
        for (size_t k = 0; law != NULL && k < steps; k++) {
            law->w = fmax(law->w, fabs(w[r][k]));
            law->v = fmax(law->v, fabs(v[r][k]));
        }
    }
    return status;
}

/* rows = −H f, f = Σ c_i feature_i. */
static enum bf_status respond(const struct site_force *force, const struct site_law *law, double **w, double **v,
                              const double c[FEATURES], double rows[], struct bf_error *err)
{
    const struct motion *motion = force->motion;
    enum bf_status status = BF_OK;
    memset(rows, 0, motion->n_rows * sizeof *rows);
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        size_t steps = motion->records[r].n * OVERSAMPLE;
        double *f = bf_alloc(steps, sizeof *f), values[FEATURES];
        double complex *F = bf_alloc(motion->records[r].m, sizeof *F);
        for (size_t k = 0; k < steps; k++) {
            reconstruct_features(law->w > 0.0 ? w[r][k] / law->w : 0.0, law->v > 0.0 ? v[r][k] / law->v : 0.0, values);
            for (int i = 0; i < FEATURES; i++)
                f[k] += c[i] * values[i];
        }
        status = motion_transform(motion, r, f, 1, OVERSAMPLE, F, err);
        if (status == BF_OK)
            status = motion_respond(motion, &force->paths, r, F, rows, err);
        free(f);
        free(F);
    }
    return status;
}

static void free_motions(size_t n, double **w, double **v)
{
    for (size_t r = 0; r < n; r++)
        free(w[r]);
    free(w);
    free(v);
}

enum bf_status site_law_fit(const struct site_force *force, const struct regression *regression, struct site_law *out,
                            struct bf_error *err)
{
    const struct motion *motion = force->motion;
    size_t m = regression->m;
    double **w = bf_alloc(motion->n_records, sizeof *w), **v = bf_alloc(motion->n_records, sizeof *v);
    double *S = bf_alloc(m * FEATURES, sizeof *S), *rows = bf_alloc(motion->n_rows, sizeof *rows);
    *out = (struct site_law){.chi_square = regression->chi_square};
    enum bf_status status = motions(force, w, v, out, err);
    for (int i = 0; status == BF_OK && i < FEATURES; i++) {
        double c[FEATURES] = {0}, *s = S + (size_t)i * m;
        c[i] = 1.0;
        status = respond(force, out, w, v, c, rows, err);
        regression_project(regression, rows, s, NULL);
        out->norm[i] = dense_norm(m, s);
        for (size_t k = 0; k < m; k++)
            s[k] /= out->norm[i] > 0.0 ? out->norm[i] : 1.0;
        out->product[i] = dense_dot(m, s, regression->left);
    }
    dense_gram(m, FEATURES, S, out->gram);
    free_motions(motion->n_records, w, v);
    free(S);
    free(rows);
    return status;
}

double site_law_fall(const struct site_law *law, const bool use[FEATURES], double c[FEATURES])
{
    double gram[FEATURES * FEATURES], values[FEATURES], V[FEATURES * FEATURES], fall = 0.0;
    size_t column[FEATURES] = {0}, n = 0;
    struct bf_error ignored;
    for (size_t i = 0; i < FEATURES; i++)
        if (use[i] && law->norm[i] > 0.0)
            column[n++] = i;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            gram[i + j * n] = law->gram[column[i] + column[j] * FEATURES];
    if (c != NULL)
        memset(c, 0, FEATURES * sizeof *c);
    if (n == 0 || dense_symmetric_eigen(n, gram, NULL, values, V, &ignored) != BF_OK)
        return 0.0;
    for (size_t k = 0; k < n; k++) {
        double along = 0.0;
        if (values[k] <= blurred * values[n - 1])
            continue;
        for (size_t i = 0; i < n; i++)
            along += V[i + k * n] * law->product[column[i]];
        fall += along * along / values[k];
        for (size_t i = 0; c != NULL && i < n; i++)
            c[column[i]] += V[i + k * n] * along / (values[k] * law->norm[column[i]]);
    }
    return fmin(fall, law->chi_square);
}

enum bf_status site_law_rows(const struct site_force *force, const struct site_law *law, const double c[FEATURES],
                             double rows[], struct bf_error *err)
{
    size_t n = force->motion->n_records;
    double **w = bf_alloc(n, sizeof *w), **v = bf_alloc(n, sizeof *v);
    enum bf_status status = motions(force, w, v, NULL, err);
    if (status == BF_OK)
        status = respond(force, law, w, v, c, rows, err);
    free_motions(n, w, v);
    return status;
}
