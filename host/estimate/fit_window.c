/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Stages of a fit: the window, the weights of its rows, and the reduced space. */
#include "fit_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_shares.h"
#include "maths/maths.h"

/* Root mean square of what was measured from the onset on, as the weights have it. */
static double weighed_rms(const struct fit_problem *p, size_t c)
{
    const struct predict_channel *channel = &p->channels[c];
    const double *w = p->weight + channel->row;
    double square = 0.0, sum = 0.0;
    for (size_t k = 0; k < channel->n; k++)
        if ((double)k * channel->dt_s >= p->drives[channel->record].onset_s) {
            square += w[k] * w[k] * channel->measured[k] * channel->measured[k];
            sum += w[k] * w[k];
        }
    return sum > 0.0 ? sqrt(square / sum) : 0.0;
}

double fit_problem_floor_part(const struct fit_problem *p, double floor)
{
    double least = 1.0;
    for (size_t c = 0; c < p->n_channels; c++)
        least = fmin(least, p->sigma[c] / hypot(p->sigma[c], floor * weighed_rms(p, c)));
    return least;
}

/* Rows of one channel: the decay, and the floor that keeps model error from dominating early stages. */
static void weigh_channel(struct fit_problem *p, size_t c)
{
    const struct predict_channel *channel = &p->channels[c];
    double *w = p->weight + channel->row;
    for (size_t k = 0; k < channel->n; k++) {
        const double t = (double)k * channel->dt_s - p->drives[channel->record].onset_s;
        if ((double)k * channel->dt_s >= p->horizon_s[channel->record]) {
            w[k] = 0.0;
            continue;
        }
        p->n_used++;
        w[k] = t > 0.0 && p->decay_ps > 0.0 ? exp(-p->decay_ps * t) : 1.0;
    }
    double sigma = hypot(p->sigma[c], p->floor * weighed_rms(p, c));
    if (!(sigma > 0.0))
        sigma = 1.0; /* a channel of zeros says nothing about scale */
    for (size_t k = 0; k < channel->n; k++)
        w[k] /= sigma;
}

const double fit_problem_unmoved = 1e-3;

double fit_problem_moved(const struct fit_problem *p, const double x[])
{
    double moved = 0.0;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const enum parameter_role role = p->refs[p->unknowns[i].ref].role;
        if (role != ROLE_KS && role != ROLE_KB && role != ROLE_INPUT_GAIN && role != ROLE_OUTPUT_GAIN)
            moved = fmax(moved, fabs(x[i] - p->base[i]));
    }
    return moved;
}

/* Why the reduced space is made: what else begins with it. */
enum reason {
    MOVED,
    PAIRED, /* measured frequencies go to the nearest modes */
    STAGED  /* the same, and the window is a new one */
};

static enum bf_status rebase_to(struct fit_problem *p, const double theta[], enum reason reason, struct bf_error *err)
{
    if (p->shares != NULL)
        return shares_rebase(p, theta, reason == STAGED, err);
    const enum bf_status status = p->predictor != NULL ? predictor_rebase(p->predictor, theta, err) : BF_OK;
    return status == BF_OK ? lines_rebase(p->lines, theta, reason != MOVED, err) : status;
}

static enum bf_status rebase(struct fit_problem *p, const double x[], enum reason reason, struct bf_error *err)
{
    struct bf_error ignored;
    p->held_at = HOLDS_NOTHING;
    fit_problem_to_theta(p, x, p->theta);
    enum bf_status status = rebase_to(p, p->theta, reason, err);
    if (status == BF_OK) {
        memcpy(p->base, x, p->n_unknowns * sizeof *x);
        p->based = true;
    } else if (p->based) { /* a predictor without a base cannot run: go back to the last one */
        fit_problem_to_theta(p, p->base, p->theta);
        if (rebase_to(p, p->theta, reason, &ignored) != BF_OK)
            p->stop = true;
    }
    return status;
}

enum bf_status fit_problem_rebase(struct fit_problem *p, const double x[], struct bf_error *err)
{
    return rebase(p, x, MOVED, err);
}

static void weigh_lines(struct fit_problem *p)
{
    for (size_t k = p->n_sample_rows; k < p->n_rows; k++) {
        const double weight = p->lines->used[k - p->n_sample_rows] ? 1.0 : 0.0;
        p->n_used = (size_t)((double)p->n_used + weight - p->weight[k]);
        p->weight[k] = weight;
    }
}

enum bf_status fit_problem_pair(struct fit_problem *p, const double x[], struct bf_error *err)
{
    const enum bf_status status = rebase(p, x, PAIRED, err);
    weigh_lines(p);
    return status;
}

/* Fitted rows and the Jacobian. Not compressed is a record with a level of its own: its rows are projected as a whole. */
static void make_rows(struct fit_problem *p)
{
    const size_t n = p->n_unknowns;
    fit_problem_free_rows(p);
    p->compressed = p->shares != NULL || (n > 0 && p->predictor != NULL && predictor_is_long(p->predictor));
    for (size_t r = 0; r < p->n_records && p->shares == NULL; r++)
        p->compressed = p->compressed && !p->drives[r].level;
    p->n_jacobian = p->compressed ? n + 1 + p->n_rows - p->n_sample_rows : p->n_rows;
    fit_problem_make_jacobian(p);
    p->fitted = p->compressed ? NULL : bf_grow(NULL, p->n_rows, sizeof *p->fitted);
}

/* Rows that noise alone would fill. */
static double noise_rows(const struct fit_problem *p)
{
    double sum = 0.0;
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        double largest = 0.0, rows = 0.0;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            largest = fmax(largest, p->weight[k]);
        for (size_t k = channel->row; k < channel->row + channel->n && largest > 0.0; k++)
            rows += p->weight[k] * p->weight[k];
        sum += largest > 0.0 ? rows / (largest * largest) : 0.0;
    }
    return sum;
}

/* Rows of the window, which are here, and their weights. */
static void weigh_rows(struct fit_problem *p)
{
    if (p->predictor != NULL)
        p->n_channels = predictor_channels(p->predictor, &p->channels);
    p->n_sample_rows = 0;
    for (size_t c = 0; c < p->n_channels; c++)
        p->n_sample_rows += p->channels[c].n;
    p->n_rows = p->n_sample_rows + lines_rows(p->lines);
    p->weight = bf_grow(p->weight, p->n_rows, sizeof *p->weight);
    p->residual = bf_grow(p->residual, p->n_rows, sizeof *p->residual);
    p->n_used = 0;
    memcpy(p->weighed_s, p->horizon_s, p->n_records * sizeof *p->weighed_s);
    for (size_t k = p->n_sample_rows; k < p->n_rows; k++)
        p->weight[k] = 0.0;
    weigh_lines(p);
    for (size_t c = 0; c < p->n_channels; c++)
        weigh_channel(p, c);
    p->noise_rows = noise_rows(p);
}

enum bf_status fit_problem_stage(struct fit_problem *p, double decay_ps, double floor, const double x[],
                                 struct bf_error *err)
{
    static const double last_weight = 1e-3;
    p->decay_ps = decay_ps, p->floor = floor;
    const double end = decay_ps > 0.0 ? p->latest_s - log(last_weight) / decay_ps : HUGE_VAL;
    enum bf_status status = p->predictor != NULL ? predictor_window(p->predictor, end, err) : BF_OK;
    if (!status)
        status = rebase(p, x, STAGED, err);
    if (status)
        return status;
    if (p->shares == NULL)
        weigh_rows(p);
    make_rows(p);
    return BF_OK;
}
