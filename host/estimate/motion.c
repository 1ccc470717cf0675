/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"
#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion_modes.h"
#include "maths/maths.h"

/* Modes up to this multiple of the Nyquist frequency take part in the deviation, at most so many. */
static const double modes_to_nyquist = 1.5;
enum { MOST_MODES = 16 };
/* The power of the forces is smoothed over this many points of the Laplace line to either side (4 Hz of an 8 s line). */
enum { SMOOTH = 16 };
/* A channel whose gain is below this (relative to the record's largest |s^ν ψ G|) tells nothing. */
static const double least_response = 1e-30;

/* ---- One record: residuals to modal coordinates ---- */

struct spectral_lines {
    size_t n_channels, n_modes, m;
    double complex *R; /* [n_channels][m] residual over gain and filters, in units of its noise */
    double complex *h; /* [n_channels][n_modes][m] channel over modal force, in units of the noise */
    double complex *G; /* [n_modes][m] 1/(s² + C_kk s + ω_k²) */
    double *power;     /* [m] of a modal force, smoothed */
};

static double cabs2(double complex z)
{
    return creal(z) * creal(z) + cimag(z) * cimag(z);
}

static double complex integer_power(double complex s, int order)
{
    double complex result = 1.0;
    for (int i = 0; i < order; i++)
        result *= s;
    return result;
}

static enum bf_status fill_channel(const struct motion *motion, const double residual[],
                                   const struct response_grid *grid, size_t channel, size_t row,
                                   struct spectral_lines *l, struct bf_error *err)
{
    const struct predict_channel *c = &motion->channels[channel];
    const double complex *F = motion->chain[channel];
    double complex *R = l->R + row * l->m, *h = l->h + row * l->n_modes * l->m;
    int order;
    const double *g = transfer_output_functional(motion->predictor, c->output, &order);
    double energy = 0.0;
    for (size_t k = 0; k < c->n; k++)
        energy += grid->weight[k] * grid->weight[k];
    double noise = motion->sigma[channel] * sqrt(energy);    /* rms of a line */
    double *x = bf_alloc(grid->n + grid->n_tail, sizeof *x); /* continued, so that the record's end is no step */
    response_tail(grid, residual + c->row, c->n, x);
    enum bf_status status = response_transform(grid, x, grid->n + grid->n_tail, R, err);
    free(x);
    if (status != BF_OK)
        return status;
    for (size_t i = 0; i < l->m; i++)
        R[i] /= noise;
    for (size_t k = 0; k < l->n_modes; k++) {
        double shape = motion_shape(&motion->modes, k, g);
        for (size_t i = 0; i < l->m; i++)
            h[k * l->m + i] = shape / noise * F[i] * integer_power(grid->s[i], order) * l->G[k * l->m + i];
    }
    return BF_OK;
}

/* Φ = (mean |R|² − channels)/(mean |h|²) over bands: what the forces must have, beyond the noise. */
static void fill_power(struct spectral_lines *l)
{
    double *sums = bf_alloc(2 * (l->m + 1), sizeof *sums), *of_h = sums + l->m + 1;
    for (size_t i = 0; i < l->m; i++) {
        double r = 0.0, h = 0.0;
        for (size_t c = 0; c < l->n_channels; c++) {
            r += cabs2(l->R[c * l->m + i]);
            for (size_t k = 0; k < l->n_modes; k++)
                h += cabs2(l->h[(c * l->n_modes + k) * l->m + i]);
        }
        sums[i + 1] = sums[i] + r;
        of_h[i + 1] = of_h[i] + h;
    }
    for (size_t i = 0; i < l->m; i++) {
        size_t from = i > SMOOTH ? i - SMOOTH : 0, to = i + SMOOTH < l->m ? i + SMOOTH + 1 : l->m;
        double r = sums[to] - sums[from] - (double)(l->n_channels * (to - from)), h = of_h[to] - of_h[from];
        l->power[i] = r > 0.0 && h > least_response ? r / h : 0.0;
    }
    free(sums);
}

/* x of A x = b, A[n × n] Hermitian positive definite (in place), b in/out. */
static void hermitian_solve(size_t n, double complex A[], double complex b[])
{
    for (size_t j = 0; j < n; j++) { /* A = L Lᴴ, row by row */
        for (size_t i = j; i < n; i++) {
            double complex sum = A[i * n + j];
            for (size_t k = 0; k < j; k++)
                sum -= A[i * n + k] * conj(A[j * n + k]);
            A[i * n + j] = i == j ? csqrt(sum) : sum / A[j * n + j];
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++)
            b[i] -= A[i * n + k] * b[k];
        b[i] /= A[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++)
            b[i] -= conj(A[k * n + i]) * b[k];
        b[i] /= A[i * n + i];
    }
}

/* q = G F̂, F̂ = Φ hᴴ (Φ h hᴴ + 1)⁻¹ R, one line after the other. */
static void solve_lines(const struct spectral_lines *l, double complex q[])
{
    size_t n = l->n_channels;
    double complex *A = bf_alloc(n * n + n, sizeof *A), *v = A + n * n;
    for (size_t i = 0; i < l->m; i++) {
        for (size_t a = 0; a < n; a++) {
            v[a] = l->R[a * l->m + i];
            for (size_t b = 0; b <= a; b++) {
                double complex sum = a == b ? 1.0 : 0.0;
                for (size_t k = 0; k < l->n_modes; k++)
                    sum += l->power[i] * l->h[(a * l->n_modes + k) * l->m + i] *
                           conj(l->h[(b * l->n_modes + k) * l->m + i]);
                A[a * n + b] = sum;
            }
        }
        hermitian_solve(n, A, v); /* what is left of R in units of the noise: R − h F̂ = v */
        for (size_t k = 0; k < l->n_modes; k++) {
            double complex force = 0.0;
            for (size_t a = 0; a < n; a++)
                force += conj(l->h[(a * l->n_modes + k) * l->m + i]) * v[a];
            q[k * l->m + i] = l->power[i] * force * l->G[k * l->m + i];
        }
    }
    free(A);
}

/* The smallest forces behind a residual[n_rows] of a record, into out->q. */
static enum bf_status solve_record(const struct motion *motion, size_t record, const double residual[],
                                   struct motion_record *out, struct bf_error *err)
{
    const struct transfer_record t = transfer_record(motion->predictor, record);
    struct spectral_lines l = {.n_modes = motion->modes.n, .m = t.grid->m};
    l.R = bf_alloc(t.n_channels * l.m, sizeof *l.R);
    l.h = bf_alloc(t.n_channels * l.n_modes * l.m, sizeof *l.h);
    l.G = bf_alloc(l.n_modes * l.m, sizeof *l.G);
    l.power = bf_alloc(l.m, sizeof *l.power);
    motion_resonances(&motion->modes, t.grid, l.G);
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < t.n_channels; c++)
        if (motion->sigma[t.first_channel + c] > 0.0)
            status = fill_channel(motion, residual, t.grid, t.first_channel + c, l.n_channels++, &l, err);
    memset(out->q, 0, l.n_modes * l.m * sizeof *out->q);
    if (status == BF_OK && l.n_channels > 0) {
        fill_power(&l);
        solve_lines(&l, out->q);
    }
    free(l.R);
    free(l.h);
    free(l.G);
    free(l.power);
    return status;
}

/* q += −G ψ(g) F of each force. */
static void add_forces(const struct motion *motion, size_t record, const double g[], size_t d, const double complex F[])
{
    const struct response_grid *grid = transfer_record(motion->predictor, record).grid;
    size_t n = motion->modes.n, m = grid->m;
    double complex *G = bf_alloc(n * m, sizeof *G), *q = motion->records[record].q;
    motion_resonances(&motion->modes, grid, G);
    for (size_t k = 0; k < n; k++) {
        for (size_t j = 0; j < d; j++) {
            double shape = motion_shape(&motion->modes, k, g + j * motion->modes.dimension);
            for (size_t i = 0; i < m; i++)
                q[k * m + i] -= shape * G[k * m + i] * F[j * m + i];
        }
    }
    free(G);
}

enum bf_status motion_assume(struct motion *motion, const double g[], const struct motion_paths *paths,
                             double complex *const F[], struct bf_error *err)
{
    double *left = bf_alloc(motion->n_rows, sizeof *left);
    enum bf_status status = BF_OK;
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++)
        status = motion_respond(motion, paths, r, F[r], left, err);
    for (size_t i = 0; i < motion->n_rows; i++)
        left[i] = motion->residual[i] - left[i];
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        if (transfer_undriven(motion->predictor, r)) /* it follows the sensors already */
            continue;
        status = solve_record(motion, r, left, &motion->records[r], err);
        if (status == BF_OK)
            add_forces(motion, r, g, paths->d, F[r]);
    }
    free(left);
    return status;
}

/* ---- All records ---- */

static void fill_weights(struct motion *motion, double floor)
{
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        double relative = floor * root_mean_square(motion->residual + channel->row, channel->n);
        double size = hypot(motion->sigma[c], relative);
        if (size > 0.0)
            motion->weight[c] = 1.0 / size;
    }
}

static enum bf_status fill_chains(struct motion *motion, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t c = 0; status == BF_OK && c < motion->n_channels; c++) {
        struct transfer_record t = transfer_record(motion->predictor, motion->channels[c].record);
        motion->chain[c] = bf_alloc(t.grid->m, sizeof *motion->chain[c]);
        status = transfer_chain(motion->predictor, motion->theta, c, motion->chain[c], err);
    }
    return status;
}

static double shortest_step(const struct motion *motion)
{
    double dt = INFINITY;
    for (size_t c = 0; c < motion->n_channels; c++)
        dt = fmin(dt, motion->channels[c].dt_s);
    return dt;
}

static enum bf_status fill(struct motion *motion, double floor, struct bf_error *err)
{
    const struct parameter_ref *refs;
    struct prediction out;
    (void)transfer_parameters(motion->predictor, &refs);
    for (size_t j = 0; j < motion->n_parameters; j++)
        motion->free[j] = !refs[j].info->fixed;
    enum bf_status status = motion_solve_states(motion, err);
    if (status == BF_OK)
        status = predictor_run(motion->predictor, motion->theta, motion->free, &out, err);
    if (status != BF_OK)
        return status;
    motion->n_rows = out.n_rows;
    motion->n_states = out.n_nuisance;
    motion->states = out.nuisance;
    motion->residual = bf_alloc(out.n_rows, sizeof(double));
    for (size_t c = 0; c < motion->n_channels; c++)
        for (size_t k = 0, row = motion->channels[c].row; k < motion->channels[c].n; k++)
            motion->residual[row + k] = motion->channels[c].measured[k] - out.y[row + k];
    for (size_t i = 0; i < out.n_nuisance; i++)
        for (size_t row = 0; row < out.n_rows; row++)
            motion->residual[row] -= out.amplitude[i] * out.nuisance[i * out.n_rows + row];
    fill_weights(motion, floor);
    status = fill_chains(motion, err);
    motion->modes =
        transfer_modes(motion->predictor, modes_to_nyquist * acos(-1.0) / shortest_step(motion), MOST_MODES);
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        const struct transfer_record t = transfer_record(motion->predictor, r);
        struct motion_record *record = &motion->records[r];
        *record = (struct motion_record){.n = t.grid->n, .m = t.grid->m};
        record->q = bf_alloc(motion->modes.n * record->m, sizeof *record->q);
        status = transfer_undriven(motion->predictor, r) ? motion_follow_decay(motion, &out, r, record->q, err)
                                                         : solve_record(motion, r, motion->residual, record, err);
    }
    motion->predicted = out.jacobian;
    return status;
}

enum bf_status motion_prepare(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                              struct motion *out, struct bf_error *err)
{
    const struct parameter_ref *refs;
    *out = (struct motion){.predictor = predictor, .n_records = transfer_records(predictor), .floor = floor};
    if (transfer_nonlinear(predictor))
        return bf_fail(err, BF_USAGE,
                       "the measured motion is taken against a linear model; drop the nonlinear effects of it");
    out->n_parameters = transfer_parameters(predictor, &refs);
    out->n_channels = predictor_channels(predictor, &out->channels);
    out->theta = bf_alloc(out->n_parameters, sizeof(double));
    memcpy(out->theta, theta, out->n_parameters * sizeof(double));
    out->sigma = bf_alloc(out->n_channels, sizeof(double));
    memcpy(out->sigma, sigma, out->n_channels * sizeof(double));
    out->weight = bf_alloc(out->n_channels, sizeof(double));
    out->chain = bf_alloc(out->n_channels, sizeof(double complex *));
    out->records = bf_alloc(out->n_records, sizeof *out->records);
    out->free = bf_alloc(out->n_parameters, sizeof *out->free);
    enum bf_status status = fill(out, floor, err);
    if (status != BF_OK)
        motion_free(out);
    return status;
}

enum bf_status motion_new(struct predictor *predictor, const double theta[], const double sigma[], double floor,
                          struct motion *out, struct bf_error *err)
{
    enum bf_status status = motion_prepare(predictor, theta, sigma, floor, out, err);
    if (status != BF_OK)
        return status;
    status = motion_update_jacobian(out, err);
    if (status != BF_OK)
        motion_free(out);
    return status;
}

void motion_free(struct motion *motion)
{
    for (size_t r = 0; motion->records != NULL && r < motion->n_records; r++)
        free(motion->records[r].q);
    for (size_t c = 0; motion->chain != NULL && c < motion->n_channels; c++)
        free(motion->chain[c]);
    free(motion->records);
    free(motion->chain);
    free(motion->theta);
    free(motion->sigma);
    free(motion->weight);
    free(motion->residual);
    free(motion->modes.damping);
    free(motion->free);
    free(motion->jacobian);
    *motion = (struct motion){0};
}
