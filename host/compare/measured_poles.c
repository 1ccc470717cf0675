/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * measured_poles.c — the poles of the records themselves. In each channel, at s = iω and z = e^(iω dt), with real coefficients,
 *     Y = Σ_i U_i (Σ_k R_ik/(s − p_k) + conj. + a + b s + c s²) + Σ_k C_k/(1 − e^(p_k dt)/z) + conj. + d + e/z,
 * p common to all. The second part is the free motion of the record's beginning and end.
 */
#include "measured_poles.h"

#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "stabilisation.h"

enum {
    MOST_LINES = 32768, /* of a channel that takes part */
    MOST_STEPS = 12,    /* of Gauss and Newton */
    HALVINGS = 5,       /* of a step that does not lead down */
    ABOVE = 5           /* what lies above the band: a, b s, c s² … */
};
static const double dependent = 1e-9;     /* columns that add nothing */
static const double farthest = 0.1;       /* of its frequency, that a pole moves in a step */
static const double least_damping = 0.01; /* of what a pole seems to have, under an exponential window */
static const double settled = 1e-4;       /* of a standard error, for the last step */
static const double doubtful = 0.05;      /* relative standard error of a frequency: that is no mode */

/* What is known of one channel during the search. */
struct channel {
    size_t record, output;
    struct stabilisation_lines lines;
    double dt_s, rate; /* rate: of an exponential window */
    bool periodic;     /* then nothing rings over the ends */
};

struct search {
    size_t n_poles, n_channels;
    double complex *pole;
    struct channel *channels;
    double *G, *g; /* [(2 n)²], [2 n]: by real and imaginary part of each pole */
    double cost, rows;
};

/* ---- Columns ---- */

static size_t n_inputs(const struct channel *c)
{
    return c->lines.n_signals - 2;
}

static size_t n_columns(const struct search *s, const struct channel *c)
{
    return n_inputs(c) * (2 * s->n_poles + ABOVE) + (c->periodic ? 0 : 2 * s->n_poles + 2);
}

/* Of one line: everything that columns are made of. */
struct line {
    double complex s, delay; /* 1/z */
    double weight;
};

static struct line line_at(const struct channel *c, size_t k)
{
    const double omega = 2.0 * M_PI * (double)k * c->lines.df_Hz;
    return (struct line){.s = CMPLX(c->rate, omega),
                         .delay = cexp(CMPLX(0.0, -omega * c->dt_s)),
                         .weight = sqrt(c->lines.weight[k] * (double)c->lines.n_lines)};
}

/* rad/s, of the last line: by which columns are brought to one size. */
static double top_of(const struct channel *c)
{
    return 2.0 * M_PI * (double)c->lines.n_lines * c->lines.df_Hz;
}

/* Rows k − 1 and n_lines + k − 1 of a column: real and imaginary part, weighted. */
static void put(const struct channel *c, size_t k, double weight, double complex x, double column[])
{
    column[k - 1] = weight * creal(x);
    column[c->lines.n_lines + k - 1] = weight * cimag(x);
}

/* Two columns, of the real and the imaginary part of the coefficient of f and of its conjugate's g. */
static void put_pair(const struct channel *c, size_t k, double weight, double complex f, double complex g,
                     double columns[])
{
    put(c, k, weight, f + g, columns);
    put(c, k, weight, CMPLX(0.0, 1.0) * (f - g), columns + 2 * c->lines.n_lines);
}

static double complex ring(double complex pole, double dt_s, double complex delay)
{
    return 1.0 / (1.0 - cexp(pole * dt_s) * delay);
}

/* A[rows × columns]: by input the poles and what lies above; then what rings over the ends. */
static void fill_columns(const struct search *s, const struct channel *c, double A[])
{
    const size_t rows = 2 * c->lines.n_lines, n = s->n_poles;
    for (size_t k = 1; k <= c->lines.n_lines; k++) {
        const struct line l = line_at(c, k);
        const double top = top_of(c);
        double *at = A;
        for (size_t i = 0; i < n_inputs(c); i++) {
            const double complex u = c->lines.signal[2 + i][k];
            for (size_t p = 0; p < n; p++, at += 2 * rows)
                put_pair(c, k, l.weight, top * u / (l.s - s->pole[p]), top * u / (l.s - conj(s->pole[p])), at);
            double complex power = u;
            for (size_t p = 0; p < ABOVE; p++, at += rows, power *= l.s / top)
                put(c, k, l.weight, power, at);
        }
        for (size_t p = 0; p < n && !c->periodic; p++, at += 2 * rows)
            put_pair(c, k, l.weight, ring(s->pole[p], c->dt_s, l.delay), ring(conj(s->pole[p]), c->dt_s, l.delay), at);
        if (!c->periodic)
            put(c, k, l.weight, 1.0, at), put(c, k, l.weight, l.delay, at + rows);
    }
}

static void fill_measured(const struct channel *c, double b[])
{
    for (size_t k = 1; k <= c->lines.n_lines; k++)
        put(c, k, line_at(c, k).weight, c->lines.signal[0][k], b);
}

/* J[rows × 2 n]: derivative of the channel's lines by real and imaginary part of each pole, with coefficients x of fill_columns(). */
static void fill_derivatives(const struct search *s, const struct channel *c, const double x[], double J[])
{
    const size_t rows = 2 * c->lines.n_lines, n = s->n_poles, each = 2 * n + ABOVE;
    const double *ends = x + n_inputs(c) * each;
    for (size_t k = 1; k <= c->lines.n_lines; k++) {
        const struct line l = line_at(c, k);
        for (size_t p = 0; p < n; p++) {
            double complex f = 0.0, g = 0.0;
            const double complex gap = l.s - s->pole[p], other = l.s - conj(s->pole[p]);
            for (size_t i = 0; i < n_inputs(c); i++) {
                const double complex r = CMPLX(x[i * each + 2 * p], x[i * each + 2 * p + 1]);
                const double complex u = top_of(c) * c->lines.signal[2 + i][k];
                f += r * u / (gap * gap), g += conj(r) * u / (other * other);
            }
            if (!c->periodic) {
                const double complex r = CMPLX(ends[2 * p], ends[2 * p + 1]), e = cexp(s->pole[p] * c->dt_s);
                const double complex own = ring(s->pole[p], c->dt_s, l.delay),
                                     conjugate = ring(conj(s->pole[p]), c->dt_s, l.delay);
                f += r * c->dt_s * e * l.delay * own * own;
                g += conj(r) * c->dt_s * conj(e) * l.delay * conjugate * conjugate;
            }
            put_pair(c, k, l.weight, f, g, J + 2 * p * rows);
        }
    }
}

/* ---- One evaluation ---- */

/* X[rows × n] −= Q Qᵀ X. */
static void leave_perpendicular(size_t rows, size_t rank, const double Q[], size_t n, double X[])
{
    double *part = bf_alloc(rank * n, sizeof *part);
    dense_gemm(true, false, rank, n, rows, 1.0, Q, X, 0.0, part);
    dense_gemm(false, false, rows, n, rank, -1.0, Q, part, 1.0, X);
    free(part);
}

/* x[columns] of one channel. Adds to cost and rows, and with derivatives to G and g. */
static enum bf_status add_channel(struct search *s, const struct channel *c, double x[], bool derivatives,
                                  struct bf_error *err)
{
    const size_t rows = 2 * c->lines.n_lines, m = n_columns(s, c), n = 2 * s->n_poles;
    double *A = bf_alloc(rows * m, sizeof *A), *Q = bf_alloc(rows * m, sizeof *Q), *r = bf_alloc(rows, sizeof *r),
           *J = bf_alloc(rows * n, sizeof *J);
    size_t rank = 0;
    fill_columns(s, c, A);
    fill_measured(c, r);
    enum bf_status status = dense_least_squares(rows, m, A, r, dependent, x, NULL, err);
    if (status == BF_OK)
        status = dense_orthonormal(rows, m, A, dependent, Q, NULL, &rank, err);
    if (status == BF_OK) {
        leave_perpendicular(rows, rank, Q, 1, r);
        s->cost += dense_dot(rows, r, r);
        s->rows += (double)(rows - rank);
    }
    if (status == BF_OK && derivatives) {
        fill_derivatives(s, c, x, J);
        leave_perpendicular(rows, rank, Q, n, J);
        dense_gemm(true, false, n, n, rows, 1.0, J, J, 1.0, s->G);
        dense_gemv(true, rows, n, 1.0, J, r, 1.0, s->g);
    }
    free(A), free(Q), free(r), free(J);
    return status;
}

static enum bf_status evaluate(struct search *s, bool derivatives, struct bf_error *err)
{
    const size_t n = 2 * s->n_poles;
    enum bf_status status = BF_OK;
    s->cost = s->rows = 0.0;
    if (derivatives) {
        memset(s->G, 0, n * n * sizeof *s->G);
        memset(s->g, 0, n * sizeof *s->g);
    }
    for (size_t i = 0; i < s->n_channels && status == BF_OK; i++) {
        double *x = bf_alloc(n_columns(s, &s->channels[i]), sizeof *x);
        status = add_channel(s, &s->channels[i], x, derivatives, err);
        free(x);
    }
    return status;
}

/* ---- The search ---- */

static bool move(const double complex from[], size_t n, const double step[], double share, double complex to[])
{
    bool allowed = true;
    for (size_t p = 0; p < n; p++) {
        to[p] = from[p] + share * CMPLX(step[2 * p], step[2 * p + 1]);
        allowed = allowed && creal(to[p]) < 0.0 && cabs(to[p] - from[p]) <= farthest * cabs(from[p]);
    }
    return allowed;
}

/* One step, halved until it leads down; *done: it is none, or a small one. */
static enum bf_status step_down(struct search *s, bool *done, struct bf_error *err)
{
    const size_t n = s->n_poles;
    double *step = bf_alloc(2 * n, sizeof *step);
    double complex *from = bf_alloc(n, sizeof *from);
    memcpy(step, s->g, 2 * n * sizeof *step);
    memcpy(from, s->pole, n * sizeof *from);
    enum bf_status status = dense_cholesky_solve(2 * n, 1, s->G, step, err);
    const double before = s->cost;
    const double gain = status == BF_OK ? dense_dot(2 * n, step, s->g) : 0.0; /* twice what the step saves */
    *done = true;
    for (int h = 0; h < HALVINGS && status == BF_OK && *done; h++)
        if (move(from, n, step, pow(0.5, h), s->pole)) {
            status = evaluate(s, true, err);
            *done = !(s->cost < before);
        }
    if (*done && status == BF_OK) {
        memcpy(s->pole, from, n * sizeof *from);
        status = evaluate(s, true, err);
    } else {
        *done = gain < settled * settled * before / s->rows;
    }
    free(step), free(from);
    return status;
}

static enum bf_status refine(struct search *s, struct bf_error *err)
{
    bool done = false;
    enum bf_status status = evaluate(s, true, err);
    for (int k = 0; k < MOST_STEPS && !done && status == BF_OK; k++)
        status = step_down(s, &done, err);
    return status;
}

/* Standard errors by G⁻¹ times what a row is off, at least by its noise. */
static enum bf_status find_values(const struct search *s, struct measured_poles *out, struct bf_error *err)
{
    const size_t n = 2 * s->n_poles;
    double *V = bf_alloc(n * n, sizeof *V);
    for (size_t i = 0; i < n; i++)
        V[i * n + i] = s->cost / s->rows;
    const enum bf_status status = dense_cholesky_solve(n, n, s->G, V, err);
    for (size_t p = 0; p < s->n_poles && status == BF_OK; p++) {
        const double re = creal(s->pole[p]), im = cimag(s->pole[p]), size = cabs(s->pole[p]);
        const double v = V[2 * p * n + 2 * p], w = V[(2 * p + 1) * n + 2 * p + 1], c = V[2 * p * n + 2 * p + 1];
        const double zeta[2] = {-im * im / pow(size, 3.0), re * im / pow(size, 3.0)}; /* d(−re/size) */
        out->values[p] = (struct measured_frequency){
            .frequency_Hz = size / (2.0 * M_PI),
            .sd_Hz = sqrt(re * re * v + 2.0 * re * im * c + im * im * w) / size / (2.0 * M_PI),
            .damping_ratio = -re / size,
            .damping_sd = sqrt(zeta[0] * zeta[0] * v + 2.0 * zeta[0] * zeta[1] * c + zeta[1] * zeta[1] * w)};
    }
    free(V);
    return status;
}

/* Poles whose frequency nobody knows are of the noise: true if one was left out. */
static bool drop_doubtful(const struct search *s, const struct measured_poles *out, size_t *kept)
{
    *kept = 0;
    for (size_t p = 0; p < s->n_poles; p++)
        if (out->values[p].sd_Hz <= doubtful * out->values[p].frequency_Hz)
            s->pole[(*kept)++] = s->pole[p];
    return *kept < s->n_poles;
}

/* ---- Residues ---- */

static void keep_residues(const struct search *s, const struct channel *c, const double x[], struct measured_poles *out)
{
    const size_t n = s->n_poles, each = 2 * n + ABOVE, driven = n_inputs(c);
    for (size_t i = 0; i < (driven > 0 ? driven : 1); i++) {
        out->residues = bf_grow(out->residues, out->n_residues + 1, sizeof *out->residues);
        struct residue *r = &out->residues[out->n_residues++];
        *r = (struct residue){.record = c->record,
                              .output = c->output,
                              .input = driven > 0 ? c->lines.input[2 + i] : SIZE_MAX,
                              .of_pole = bf_alloc(n, sizeof *r->of_pole)};
        for (size_t p = 0; p < n; p++)
            r->of_pole[p] = CMPLX(x[i * each * (driven > 0) + 2 * p], x[i * each * (driven > 0) + 2 * p + 1]) *
                            (driven > 0 ? top_of(c) * c->lines.scale[2 + i] : 1.0);
    }
}

static enum bf_status find_residues(struct search *s, struct measured_poles *out, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < s->n_channels && status == BF_OK; i++) {
        double *x = bf_alloc(n_columns(s, &s->channels[i]), sizeof *x);
        status = add_channel(s, &s->channels[i], x, false, err);
        if (status == BF_OK)
            keep_residues(s, &s->channels[i], x, out);
        free(x);
    }
    return status;
}

/* ---- All ---- */

static enum bf_status take_channels(const struct comparison *all, double to_Hz, struct search *s, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    s->channels = bf_alloc(all->n_channels + 1, sizeof *s->channels);
    for (size_t i = 0; i < all->n_channels && status == BF_OK; i++) {
        const struct comparison_channel *from = &all->channels[i];
        struct channel *c = &s->channels[s->n_channels];
        if (!stabilisation_uses(all, from))
            continue;
        *c = (struct channel){.record = from->record,
                              .dt_s = from->dt_s,
                              .rate = record_window_rate(&all->records[from->record]),
                              .periodic = record_is_periodic(&all->records[from->record])};
        while (strcmp(all->model->outputs[c->output].name, from->name) != 0)
            c->output++;
        status = stabilisation_lines_take(all, from, to_Hz, &c->lines, err);
        if (c->lines.n_lines >= STABILISATION_FEWEST_LINES && c->lines.n_lines <= MOST_LINES &&
            2 * c->lines.n_lines > 2 * n_columns(s, c))
            s->n_channels++;
        else
            stabilisation_lines_free(&c->lines);
    }
    return status;
}

static void take_poles(const struct stabilisation *start, struct search *s)
{
    s->pole = bf_alloc(start->n_found + 1, sizeof *s->pole);
    for (size_t p = 0; p < start->n_found; p++) {
        const double size = 2.0 * M_PI * start->found[p].frequency_Hz, zeta = start->found[p].damping_ratio;
        s->pole[s->n_poles++] = CMPLX(-zeta * size, sqrt(1.0 - zeta * zeta) * size);
    }
    s->G = bf_alloc(4 * s->n_poles * s->n_poles + 1, sizeof *s->G);
    s->g = bf_alloc(2 * s->n_poles + 1, sizeof *s->g);
}

/* What an exponential window has added to the damping is in the poles that a stabilisation finds, and not in those that are sought. */
static void take_windows_off(struct search *s)
{
    for (size_t p = 0; p < s->n_poles && s->n_channels > 0; p++) {
        const double re = creal(s->pole[p]) + s->channels[0].rate;
        s->pole[p] = CMPLX(fmin(re, least_damping * creal(s->pole[p])), cimag(s->pole[p]));
    }
}

static void search_free(struct search *s)
{
    for (size_t i = 0; i < s->n_channels; i++)
        stabilisation_lines_free(&s->channels[i].lines);
    free(s->channels), free(s->pole), free(s->G), free(s->g);
}

enum bf_status measured_poles_find(const struct comparison *all, const struct stabilisation *start,
                                   struct measured_poles *out, struct bf_error *err)
{
    struct search s = {0};
    size_t kept;
    *out = (struct measured_poles){0};
    take_poles(start, &s);
    out->values = bf_alloc(s.n_poles + 1, sizeof *out->values);
    enum bf_status status = take_channels(all, start->to_Hz, &s, err);
    take_windows_off(&s);
    bool again = s.n_poles > 0 && s.n_channels > 0;
    while (again && status == BF_OK) {
        status = refine(&s, err);
        if (status == BF_OK)
            status = find_values(&s, out, err);
        again = status == BF_OK && drop_doubtful(&s, out, &kept) && kept > 0;
        s.n_poles = status == BF_OK ? kept : 0;
    }
    if (status == BF_OK && s.n_poles > 0 && s.n_channels > 0)
        status = find_residues(&s, out, err);
    out->n = s.n_channels > 0 ? s.n_poles : 0;
    out->pole = s.pole, s.pole = NULL;
    search_free(&s);
    return status;
}

void measured_poles_free(struct measured_poles *poles)
{
    for (size_t i = 0; i < poles->n_residues; i++)
        free(poles->residues[i].of_pole);
    free(poles->residues), free(poles->pole), free(poles->values);
    *poles = (struct measured_poles){0};
}
