/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "regression.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Directions whose eigenvalue of the Gram matrix (unit columns) is below this are not moved: minimum norm. */
static const double rank_tolerance = 1e-11;
/* The common scale of a model is free when its effect on the prediction is below this part of the parameters' own ... */
static const double scale_free = 1e-4;
/* ... and then it is held by a row this many times as heavy as the heaviest column. */
static const double scale_weight = 30.0;
/* A parameter moves by at most this in its logarithm. */
static const double largest_move = 0.7;

static const struct parameter_ref *ref_of(const struct motion *motion, size_t parameter)
{
    const struct parameter_ref *refs;
    (void)transfer_parameters(motion->predictor, &refs);
    return &refs[parameter];
}

static void fill_row_weights(const struct motion *motion, struct regression *out)
{
    out->row_weight = bf_alloc(out->n_rows, sizeof(double));
    for (size_t c = 0; c < motion->n_channels; c++)
        for (size_t k = 0; k < motion->channels[c].n; k++)
            out->row_weight[motion->channels[c].row + k] = motion->weight[c];
}

/* Free parameters whose column is not zero, or that have a prior; the initial states come after them. */
static void choose_parameters(const struct motion *motion, struct regression *out)
{
    out->parameter = bf_alloc(motion->n_parameters, sizeof(size_t));
    for (size_t j = 0; j < motion->n_parameters; j++) {
        const struct parameter *info = ref_of(motion, j)->info;
        if (!motion->free[j])
            continue;
        out->n_priors += info->prior > 0.0;
        if (info->prior > 0.0 || dense_norm(motion->n_rows, motion->jacobian + j * motion->n_rows) > 0.0)
            out->parameter[out->n_own++] = j;
    }
    out->n = out->n_own + motion->n_states;
    out->n_priors++; /* the scale's */
    out->m = out->n_rows + out->n_priors;
}

static bool scales(enum parameter_role role)
{
    return role != ROLE_RESIDUAL && role != ROLE_EFFECT;
}

/*
 * All forces of a model by one factor leave the prediction as it is, when no force or gain is known: EI, ρ, damping, K_B,
 * K_s. Equation error is smallest where the factor is zero, so the factor must not be left to it. Returns the weight of
 * a row that holds it, 0 when the records know the scale.
 */
static double scale_row_weight(const struct motion *motion)
{
    size_t n = motion->n_rows;
    double *sum = bf_alloc(n, sizeof *sum), *own = bf_alloc(n, sizeof *own), heaviest = 0.0;
    for (size_t j = 0; j < motion->n_parameters; j++) {
        if (!motion->free[j] || !scales(ref_of(motion, j)->role))
            continue;
        for (size_t c = 0; c < motion->n_channels; c++)
            for (size_t k = motion->channels[c].row; k < motion->channels[c].row + motion->channels[c].n; k++)
                own[k] = motion->weight[c] * motion->theta[j] * motion->predicted[j * n + k];
        for (size_t k = 0; k < n; k++)
            sum[k] += own[k];
        heaviest = fmax(heaviest, dense_norm(n, own));
    }
    double together = dense_norm(n, sum);
    free(sum);
    free(own);
    return together < scale_free * heaviest ? scale_weight * heaviest : 0.0;
}

/* The scale is what the priors say of it; without priors it stays: Σ (Δθ/θ)/prior² = Σ (prior value − θ)/θ/prior². */
static void fill_scale_row(const struct motion *motion, struct regression *out, double weight, size_t row)
{
    bool any = false;
    double whole = 0.0;
    for (size_t j = 0; j < out->n_own; j++)
        any = any ||
              (scales(ref_of(motion, out->parameter[j])->role) && ref_of(motion, out->parameter[j])->info->prior > 0.0);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t j = 0; j < out->n_own; j++) {
            const struct parameter_ref *ref = ref_of(motion, out->parameter[j]);
            double theta = motion->theta[out->parameter[j]], prior = ref->info->prior;
            bool mass_or_stiffness = ref->role == ROLE_EI || ref->role == ROLE_RHO;
            if (!scales(ref->role) || !(theta > 0.0) || (any ? !(prior > 0.0) : !mass_or_stiffness))
                continue;
            double part = any ? 1.0 / (prior * prior) : 1.0;
            if (pass == 0) {
                whole += part;
                continue;
            }
            out->A[j * out->m + row] = weight * part / whole / theta;
            if (any)
                out->b[row] += weight * part / whole * (ref->info->prior_value - theta) / theta;
        }
    }
}

static void fill_columns(const struct motion *motion, struct regression *out)
{
    size_t prior = out->n_rows;
    out->A = bf_alloc(out->m * out->n, sizeof(double));
    out->b = bf_alloc(out->m, sizeof(double));
    out->scale = bf_alloc(out->n, sizeof(double));
    for (size_t i = 0; i < out->n_rows; i++)
        out->b[i] = out->row_weight[i] * motion->residual[i];
    for (size_t j = 0; j < out->n_own; j++) {
        size_t parameter = out->parameter[j];
        const struct parameter *info = ref_of(motion, parameter)->info;
        double *column = out->A + j * out->m;
        for (size_t i = 0; i < out->n_rows; i++)
            column[i] = out->row_weight[i] * motion->jacobian[parameter * out->n_rows + i];
        if (info->prior > 0.0) {
            double sd = info->prior * fabs(info->prior_value);
            column[prior] = 1.0 / sd;
            out->b[prior++] = (info->prior_value - motion->theta[parameter]) / sd;
        }
    }
    for (size_t j = 0; j < motion->n_states; j++)
        for (size_t i = 0; i < out->n_rows; i++)
            out->A[(out->n_own + j) * out->m + i] = out->row_weight[i] * motion->states[j * out->n_rows + i];
    double weight = scale_row_weight(motion);
    if (weight > 0.0)
        fill_scale_row(motion, out, weight, prior);
    for (size_t j = 0; j < out->n; j++) {
        double *column = out->A + j * out->m, norm = dense_norm(out->m, column);
        out->scale[j] = norm > 0.0 ? 1.0 / norm : 0.0;
        for (size_t i = 0; i < out->m; i++)
            column[i] *= out->scale[j];
    }
}

/* AᵀA = V Λ Vᵀ: Q = A V Λ^(−1/2), x = V Λ^(−1/2) Qᵀ b. */
static enum bf_status decompose(struct regression *out, struct bf_error *err)
{
    size_t n = out->n;
    double *gram = bf_alloc(2 * n * n + n, sizeof *gram), *V = gram + n * n, *values = V + n * n;
    dense_gram(out->m, n, out->A, gram);
    enum bf_status status = n > 0 ? dense_symmetric_eigen(n, gram, NULL, values, V, err) : BF_OK;
    out->to_x = bf_alloc(n * n, sizeof(double));
    out->Q = bf_alloc(out->m * n, sizeof(double));
    for (size_t k = 0; status == BF_OK && k < n; k++) {
        if (values[k] <= rank_tolerance * values[n - 1])
            continue;
        for (size_t i = 0; i < n; i++)
            out->to_x[out->rank * n + i] = V[k * n + i] / sqrt(values[k]);
        out->rank++;
    }
    if (status == BF_OK && out->rank > 0)
        dense_gemm(false, false, out->m, out->rank, n, 1.0, out->A, out->to_x, 0.0, out->Q);
    free(gram);
    return status;
}

/* x −= Q Qᵀ x. */
static void remove_span(const struct regression *regression, double x[])
{
    double *c = bf_alloc(regression->rank, sizeof *c);
    if (regression->rank > 0) {
        dense_gemv(true, regression->m, regression->rank, 1.0, regression->Q, x, 0.0, c);
        dense_gemv(false, regression->m, regression->rank, -1.0, regression->Q, c, 1.0, x);
    }
    free(c);
}

enum bf_status regression_new(const struct motion *motion, struct regression *out, struct bf_error *err)
{
    *out = (struct regression){.n_rows = motion->n_rows};
    fill_row_weights(motion, out);
    choose_parameters(motion, out);
    fill_columns(motion, out);
    enum bf_status status = decompose(out, err);
    if (status != BF_OK) {
        regression_free(out);
        return status;
    }
    out->left = bf_alloc(out->m, sizeof(double));
    memcpy(out->left, out->b, out->m * sizeof(double));
    remove_span(out, out->left);
    out->chi_square = dense_dot(out->m, out->left, out->left);
    return BF_OK;
}

void regression_free(struct regression *regression)
{
    free(regression->parameter);
    free(regression->scale);
    free(regression->A);
    free(regression->Q);
    free(regression->to_x);
    free(regression->b);
    free(regression->left);
    free(regression->row_weight);
    *regression = (struct regression){0};
}

void regression_project(const struct regression *regression, const double rows[], double s[], double *norm)
{
    memset(s + regression->n_rows, 0, regression->n_priors * sizeof *s);
    for (size_t i = 0; i < regression->n_rows; i++)
        s[i] = regression->row_weight[i] * rows[i];
    if (norm != NULL)
        *norm = dense_norm(regression->m, s);
    remove_span(regression, s);
}

/* Stiffness, mass and gains move by a factor at most; damping may come from nothing, but stays positive. */
static double moved(const struct parameter_ref *ref, double value, double change)
{
    const struct parameter *info = ref->info;
    bool bounded = ref->role == ROLE_EI || ref->role == ROLE_RHO || ref->role == ROLE_KS || ref->role == ROLE_KB ||
                   ref->role == ROLE_INPUT_GAIN || ref->role == ROLE_OUTPUT_GAIN;
    double least = value * exp(-largest_move), most = value * exp(largest_move);
    if (!info->logarithmic || !(value > 0.0))
        value += change;
    else if (bounded)
        value = fmax(least, fmin(most, value * exp(change / value)));
    else
        value = fmax(least, value + change);
    return fmax(info->min, fmin(info->max, value));
}

void regression_move(const struct regression *regression, const struct motion *motion, const double rows[],
                     double theta[])
{
    size_t n = regression->n;
    double *b = bf_alloc(regression->m, sizeof *b), *c = bf_alloc(n, sizeof *c), *x = bf_alloc(n, sizeof *x);
    memcpy(b, regression->b, regression->m * sizeof *b);
    for (size_t i = 0; rows != NULL && i < regression->n_rows; i++)
        b[i] -= regression->row_weight[i] * rows[i];
    if (regression->rank > 0) {
        dense_gemv(true, regression->m, regression->rank, 1.0, regression->Q, b, 0.0, c);
        dense_gemv(false, n, regression->rank, 1.0, regression->to_x, c, 0.0, x);
    }
    for (size_t j = 0; j < regression->n_own; j++) {
        size_t parameter = regression->parameter[j];
        theta[parameter] = moved(ref_of(motion, parameter), theta[parameter], regression->scale[j] * x[j]);
    }
    free(b);
    free(c);
    free(x);
}

double regression_effective(const struct regression *regression, const struct motion *motion, const double x[])
{
    double square = 0.0, next = 0.0;
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        for (size_t k = channel->row; k + 1 < channel->row + channel->n; k++) {
            square += x[k] * x[k];
            next += x[k] * x[k + 1];
        }
    }
    double rho = square > 0.0 ? fabs(next / square) : 0.0;
    return fmax(1.0, (double)regression->n_rows * (1.0 - rho) / (1.0 + rho));
}
