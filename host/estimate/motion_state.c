/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The motion of records that did not begin at rest. Over two periods of the first mode the baseline describes a decay well
 * even where a law bends its envelope or its frequency, so the modes' amplitudes are found in windows of that length, each a little
 * later than the last (triangles that sum to one), and the motion follows them. The first window's are the initial state of the
 * baseline; how the later ones differ from it is the deviation of the modal coordinates, which thus begins at nothing, as a response to
 * forces from rest does.
 */
#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

static const double dependent = 1e-10; /* columns that depend on others to this share are left out */
static const double periods = 2.0;     /* of the first mode, between the middles of two windows */
static const double gone = 1e-100;     /* a mode that has died before a window is not looked for there */
enum { ROWS_EACH = 4 };                /* rows of a window for each unknown, at least */

/* Samples between the middles of two windows of a record with so many unknowns. */
static size_t hop_of(const struct motion *motion, size_t record, size_t unknowns)
{
    const struct transfer_record t = transfer_record(motion->predictor, record);
    struct transfer_modes modes = transfer_modes(motion->predictor, 0.0, 1);
    double wanted = periods * 2.0 * acos(-1.0) / (modes.omega_rad[0] * t.grid->dt_s);
    double least = ceil((double)(ROWS_EACH * unknowns) / (double)t.n_channels), most = (double)t.grid->n;
    free(modes.damping);
    return (size_t)fmax(1.0, fmin(fmax(wanted, least), most));
}

/* The weight of sample k in the window about `middle`. */
static double triangle(size_t k, size_t middle, size_t hop)
{
    double distance = fabs((double)k - (double)middle) / (double)hop;
    return distance < 1.0 ? 1.0 - distance : 0.0;
}

/* One window of a record: w C a ≈ w (z − y), columns of unit length. */
struct state_window {
    const struct motion *motion;
    const struct prediction *y;
    struct transfer_record t;
    size_t first, n;       /* the record's unknowns */
    size_t middle, hop;    /* samples */
    double *A, *b, *scale; /* [m × n], [m], [n]; m = 2 hop rows of every channel */
};

static void fill_window(const struct state_window *w)
{
    size_t rows = w->y->n_rows, m = 2 * w->hop * w->t.n_channels;
    memset(w->A, 0, m * w->n * sizeof *w->A);
    memset(w->b, 0, m * sizeof *w->b);
    for (size_t c = 0; c < w->t.n_channels; c++) {
        const struct predict_channel *channel = &w->motion->channels[w->t.first_channel + c];
        double sigma = w->motion->sigma[w->t.first_channel + c];
        size_t from = w->middle > w->hop ? w->middle - w->hop : 0;
        for (size_t i = 0; i < 2 * w->hop && from + i < channel->n; i++) {
            size_t k = from + i, row = c * 2 * w->hop + i;
            double weight = triangle(k, w->middle, w->hop) / (sigma > 0.0 ? sigma : 1.0);
            w->b[row] = weight * (channel->measured[k] - w->y->y[channel->row + k]);
            for (size_t j = 0; j < w->n; j++)
                w->A[row + j * m] = weight * w->y->nuisance[(w->first + j) * rows + channel->row + k];
        }
    }
    for (size_t j = 0; j < w->n; j++) {
        double norm = dense_norm(m, w->A + j * m);
        w->scale[j] = norm > gone ? 1.0 / norm : 0.0;
        for (size_t i = 0; i < m; i++)
            w->A[i + j * m] *= w->scale[j];
    }
}

static enum bf_status solve_window(const struct state_window *w, double a[], struct bf_error *err)
{
    fill_window(w);
    enum bf_status status =
        dense_least_squares(2 * w->hop * w->t.n_channels, w->n, w->A, w->b, dependent, a, NULL, err);
    for (size_t j = 0; j < w->n; j++)
        a[j] *= w->scale[j];
    return status;
}

static void window_new(const struct motion *motion, const struct prediction *y, size_t record, struct state_window *out)
{
    *out = (struct state_window){.motion = motion, .y = y, .t = transfer_record(motion->predictor, record)};
    out->first = transfer_states(motion->predictor, record, &out->n);
    out->hop = out->n > 0 ? hop_of(motion, record, out->n) : 1;
    size_t m = 2 * out->hop * out->t.n_channels;
    out->A = bf_alloc(m * (out->n + 1) + out->n, sizeof *out->A);
    out->b = out->A + m * out->n;
    out->scale = out->b + m;
}

enum bf_status motion_solve_states(const struct motion *motion, struct bf_error *err)
{
    struct prediction y;
    enum bf_status status = predictor_run(motion->predictor, motion->theta, NULL, &y, err);
    if (status != BF_OK || y.n_nuisance == 0)
        return status;
    double *amplitude = bf_alloc(y.n_nuisance, sizeof *amplitude);
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        struct state_window w;
        window_new(motion, &y, r, &w);
        if (w.n > 0)
            status = solve_window(&w, amplitude + w.first, err);
        free(w.A);
    }
    if (status == BF_OK)
        predictor_set_nuisance(motion->predictor, amplitude);
    free(amplitude);
    return status;
}

/* x[modes][n] += triangle · the modal coordinates at amplitudes a of the record's unknowns, or at those of the predictor. */
static void add_window(const struct state_window *w, const double a[], double x[])
{
    size_t n = w->t.grid->n, from = w->middle > w->hop ? w->middle - w->hop : 0;
    for (size_t mode = 0; mode < w->motion->modes.n && 2 * mode + 1 < w->n; mode++) {
        double complex pole, shape = transfer_state_shape(w->motion->predictor, &w->motion->modes, mode, &pole);
        double complex size = 2.0 * CMPLX(a[2 * mode], a[2 * mode + 1]) * shape;
        for (size_t k = from; k < from + 2 * w->hop && k < n; k++)
            x[mode * n + k] += triangle(k, w->middle, w->hop) * creal(size * cexp(pole * (double)k * w->t.grid->dt_s));
    }
}

enum bf_status motion_follow_decay(const struct motion *motion, const struct prediction *y, size_t record,
                                   double complex q[], struct bf_error *err)
{
    struct state_window w;
    window_new(motion, y, record, &w);
    const struct response_grid *grid = w.t.grid;
    size_t n = grid->n, m = grid->m;
    double *x = bf_alloc(motion->modes.n * n, sizeof *x), *a = bf_alloc(w.n, sizeof *a);
    double *tail = bf_alloc(n + grid->n_tail, sizeof *tail);
    enum bf_status status = BF_OK;
    for (w.middle = 0; status == BF_OK && w.middle < n + w.hop; w.middle += w.hop) {
        const bool full = w.middle == 0 || w.middle + w.hop / 2 < n; /* else the amplitudes of the last are kept */
        if (full)
            status = solve_window(&w, a, err);
        for (size_t i = 0; full && i < w.n; i++)
            a[i] -= y->amplitude[w.first + i];
        add_window(&w, a, x);
    }
    for (size_t k = 0; status == BF_OK && k < motion->modes.n; k++) {
        response_tail(grid, x + k * n, n, tail);
        status = response_transform(grid, tail, n + grid->n_tail, q + k * m, err);
    }
    free(w.A);
    free(x);
    free(a);
    free(tail);
    return status;
}
