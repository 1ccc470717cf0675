/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"
#include "kernel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* e^(−σ T_padded): what is left of the response's start after one turn around the padded record. */
static const double wrap = 1e-9;
/* This part of the band, next to the Nyquist frequency, is faded out of the inputs. */
static const double faded_band = 0.05;
/* An input fades out over this many samples after the record; its continuation is learnt from twelve times as many. */
enum { TAIL = 64, LEARN = 12 * TAIL };

static size_t padded_size(size_t n, size_t n_tail)
{
    return fft_good_size(n > 2 * n_tail ? 2 * n : n + 2 * n_tail);
}

static size_t tail_of(enum intersample intersample)
{
    return intersample == INTERSAMPLE_BAND_LIMITED ? TAIL : 0;
}

double response_grid_rate(size_t n, enum intersample intersample)
{
    return -log(wrap) / (double)padded_size(n, tail_of(intersample));
}

enum bf_status response_grid_new(size_t n, double dt_s, enum intersample intersample, struct response_grid *out,
                                 struct bf_error *err)
{
    if (n < 2 || !(dt_s > 0.0))
        return bf_fail(err, BF_NUMERIC, "a prediction needs at least two samples and a positive sample interval");
    const size_t n_tail = tail_of(intersample), n_fft = padded_size(n, n_tail);
    double sigma = -log(wrap) / ((double)n_fft * dt_s);
    *out = (struct response_grid){.n = n,
                                  .n_tail = n_tail,
                                  .n_fft = n_fft,
                                  .m = n_fft / 2 + 1,
                                  .dt_s = dt_s,
                                  .sigma = sigma,
                                  .intersample = intersample};
    out->s = bf_alloc(out->m, sizeof *out->s);
    out->weight = bf_alloc(n + n_tail, sizeof *out->weight);
    for (size_t k = 0; k < out->m; k++)
        out->s[k] = CMPLX(sigma, 2.0 * acos(-1.0) * (double)k / ((double)n_fft * dt_s));
    if (intersample != INTERSAMPLE_BAND_LIMITED)
        out->z = bf_alloc(out->m, sizeof *out->z);
    for (size_t k = 0; k < out->m && out->z != NULL; k++)
        out->z[k] = cexp(out->s[k] * dt_s);
    for (size_t k = 0; k < n + n_tail; k++)
        out->weight[k] = exp(-sigma * dt_s * (double)k);
    return BF_OK;
}

enum bf_status response_grid_periodic(size_t n, double dt_s, double window_rate, struct response_grid *out,
                                      struct bf_error *err)
{
    static const double near_zero = 1e-3; /* of the distance of lines */
    if (n < 2 || !(dt_s > 0.0))
        return bf_fail(err, BF_NUMERIC, "a prediction needs at least two samples and a positive sample interval");
    const double first_rad = 2.0 * acos(-1.0) / ((double)n * dt_s);
    *out = (struct response_grid){.n = n,
                                  .n_fft = n,
                                  .m = n / 2 + 1,
                                  .dt_s = dt_s,
                                  .sigma = window_rate,
                                  .intersample = INTERSAMPLE_BAND_LIMITED,
                                  .periodic = true};
    out->s = bf_alloc(out->m, sizeof *out->s);
    out->weight = bf_alloc(n, sizeof *out->weight);
    for (size_t k = 0; k < out->m; k++)
        out->s[k] = CMPLX(window_rate, first_rad * (k > 0 ? (double)k : near_zero));
    for (size_t k = 0; k < n; k++)
        out->weight[k] = 1.0;
    return BF_OK;
}

void response_grid_free(struct response_grid *grid)
{
    free(grid->s);
    free(grid->z);
    free(grid->weight);
    *grid = (struct response_grid){0};
}

/* x[k], k = first … n − 1, continued by the model: x_k = Σ a_j x_(k−j). */
static void continue_series(double x[], size_t first, size_t n)
{
    size_t known = first < LEARN ? first : LEARN;
    struct ar_model model;
    ar_fit(x + first - known, known, &model);
    for (size_t k = first; k < n; k++) {
        x[k] = 0.0;
        for (size_t j = 1; j <= (size_t)model.order && j <= k; j++)
            x[k] += model.a[j - 1] * x[k - j];
    }
}

void response_tail(const struct response_grid *grid, const double u[], size_t available, double x[])
{
    size_t total = grid->n + grid->n_tail, known = available < total ? available : total;
    memcpy(x, u, known * sizeof *x);
    if (known < total)
        continue_series(x, known, total);
    for (size_t i = 0; i < grid->n_tail; i++) /* cosine fade */
        x[grid->n + i] *= 0.5 + 0.5 * cos(acos(-1.0) * (double)(i + 1) / (double)(grid->n_tail + 1));
}

void response_lead(const struct response_grid *grid, const double u[], size_t available, double x[])
{
    size_t n = available < grid->n ? available : grid->n, total = n + grid->n_tail;
    double *turned = bf_alloc(total, sizeof *turned);
    for (size_t k = 0; k < n; k++)
        turned[k] = u[n - 1 - k];
    continue_series(turned, n, total);
    for (size_t i = 0; i < grid->n_tail; i++)
        x[i] = turned[n + i] * (0.5 + 0.5 * cos(acos(-1.0) * (double)(i + 1) / (double)(grid->n_tail + 1)));
    free(turned);
}

/*
 * Content at the Nyquist frequency would ring for ever there, and e^(σt) would make that ring grow. The last part of the
 * band is faded out by a taper with all derivatives (Planck's), whose ring dies within some dozens of samples.
 */
static void fade_to_nyquist(const struct response_grid *grid, double complex U[])
{
    double first = (1.0 - faded_band) * (double)(grid->m - 1);
    for (size_t k = (size_t)ceil(first); k < grid->m; k++) {
        double x = ((double)k - first) / ((double)(grid->m - 1) - first); /* 0 … 1 */
        double taper = 1.0;
        if (x > 0.0)
            taper = x < 1.0 ? 1.0 / (1.0 + exp(1.0 / (1.0 - x) - 1.0 / x)) : 0.0;
        U[k] *= taper;
    }
}

enum bf_status response_transform(const struct response_grid *grid, const double x[], size_t count, double complex U[],
                                  struct bf_error *err)
{
    return response_transform_led(grid, x, count, NULL, U, err);
}

/*
 * A piece of a record: its input is faded on the line of the whole record, so that both see the same input, and comes back to its own line. What
 * the fade rings to before the piece's first sample stands at the end.
 */
static void fade_as_whole(const struct response_grid *grid, const struct fft *plan, double padded[], size_t count,
                          double complex U[])
{
    const double own = grid->sigma * grid->dt_s, change = grid->fade_rate - own;
    const size_t after = count + (grid->n_fft - count) / 2;
    for (size_t k = 0; k < count; k++)
        padded[k] *= exp(-change * (double)k);
    fft_forward(plan, padded, U);
    fade_to_nyquist(grid, U);
    fft_inverse(plan, U, padded);
    for (size_t k = 0; k < grid->n_fft; k++)
        padded[k] *= exp(change * ((double)k - (k < after ? 0.0 : (double)grid->n_fft)));
    fft_forward(plan, padded, U);
}

enum bf_status response_transform_led(const struct response_grid *grid, const double x[], size_t count,
                                      const double before[], double complex U[], struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(grid->n_fft, &plan, err);
    if (status != BF_OK)
        return status;
    double *padded = bf_alloc(grid->n_fft, sizeof *padded);
    for (size_t k = 0; k < count; k++)
        padded[k] = x[k] * grid->weight[k];
    for (size_t i = 0; before != NULL && i < grid->n_tail; i++) /* what was before the record stands at the end */
        padded[grid->n_fft - 1 - i] = before[i] / grid->weight[i + 1];
    const bool fades = grid->intersample == INTERSAMPLE_BAND_LIMITED && !grid->periodic;
    if (fades && grid->fade_rate > 0.0) {
        fade_as_whole(grid, plan, padded, count, U);
    } else {
        fft_forward(plan, padded, U);
        if (fades)
            fade_to_nyquist(grid, U);
    }
    free(padded);
    return BF_OK;
}

enum bf_status response_back(const struct response_grid *grid, const double complex Y[], double y[],
                             struct bf_error *err)
{
    const struct fft *plan;
    enum bf_status status = fft_get(grid->n_fft, &plan, err);
    if (status != BF_OK)
        return status;
    double *padded = bf_grow(NULL, grid->n_fft, sizeof *padded);
    fft_inverse(plan, Y, padded);
    for (size_t k = 0; k < grid->n; k++)
        y[k] = padded[k] / grid->weight[k];
    free(padded);
    return BF_OK;
}
