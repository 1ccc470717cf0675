/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A sensor's curve that is not straight (saturation). It bends the signal before the recorder's filter: its harmonics
 * above the Nyquist frequency do not fold back. The channel's band-limited curve is sampled several times a sample, with
 * the recorder's filter undone where the record states one; the curve acts there, and only what it changes comes back
 * through the filter: what it leaves alone stays exact. Everything but the curve is linear in the channel, so that columns
 * of the Jacobian go the same way, multiplied by the curve's slope.
 */
#include "predictor.h"

#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/*
 * Points a sample (at four times the level, more than four change nothing); a channel is continued by up to so many
 * samples at both ends.
 */
enum { MAP_OVERSAMPLE = 4, MAP_MARGIN = 128 };

/* A channel of a record on both grids. */
struct map_grid {
    size_t n, n_fine;              /* samples of the channel; points from the first to the last */
    size_t margin, m;              /* samples; m lines of the spectrum */
    const struct fft *plan, *fine; /* transforms of the continued channel */
    double complex *A, *undo;      /* [m] the recorder's filter and what undoes it; NULL: not stated */
    double complex *X;             /* [m MAP_OVERSAMPLE] scratch */
    double *x;                     /* [lengths of the transforms] scratch */
};

static void grid_free(struct map_grid *g)
{
    free(g->A);
    free(g->X);
    free(g->x);
}

static enum bf_status grid_new(const struct record_plan *plan, size_t n, struct map_grid *g, struct bf_error *err)
{
    *g = (struct map_grid){.n = n, .n_fine = (n - 1) * MAP_OVERSAMPLE + 1};
    g->margin = n - 1 < MAP_MARGIN ? n - 1 : MAP_MARGIN;
    size_t length = fft_good_size(n + 2 * g->margin);
    g->m = length / 2 + 1;
    enum bf_status status = fft_get(length, &g->plan, err);
    if (status == BF_OK)
        status = fft_get(length * MAP_OVERSAMPLE, &g->fine, err);
    if (status != BF_OK)
        return status;
    g->X = bf_alloc(g->m * MAP_OVERSAMPLE, sizeof *g->X);
    g->x = bf_alloc(length * MAP_OVERSAMPLE, sizeof *g->x);
    if (plan->recorder.order == 0)
        return BF_OK;
    g->A = bf_alloc(2 * g->m, sizeof *g->A);
    g->undo = g->A + g->m;
    for (size_t k = 0; k < g->m; k++) {
        g->A[k] = recorder_at(&plan->recorder, (double)k / (double)length);
        g->undo[k] = recorder_inverse(g->A[k]);
    }
    return BF_OK;
}

/* The straight line through both ends of v[n], at point k of n. */
static double chord(const double v[], size_t n, double k)
{
    return v[0] + (v[n - 1] - v[0]) * k / (double)(n - 1);
}

/* x[length]: v − its chord from point `margin` on, continued at both ends by point reflections that fade out. */
static void continue_ends(const double v[], size_t n, size_t margin, size_t length, double x[])
{
    double *first = x + margin, *last = first + n - 1;
    memset(x, 0, length * sizeof *x);
    for (size_t k = 0; k < n; k++)
        first[k] = v[k] - chord(v, n, (double)k);
    for (size_t i = 1; i < margin; i++) {
        double fade = 0.5 + 0.5 * cos(acos(-1.0) * (double)i / (double)margin);
        *(first - i) = -fade * first[i];
        last[i] = -fade * *(last - i);
    }
}

/* fine[n_fine] of v[n], before the recorder's filter. */
static void go_up(const struct map_grid *g, const double v[], double fine[])
{
    continue_ends(v, g->n, g->margin, fft_size(g->plan), g->x);
    memset(g->X, 0, g->m * MAP_OVERSAMPLE * sizeof *g->X);
    fft_forward(g->plan, g->x, g->X);
    for (size_t k = 0; k < g->m; k++)
        g->X[k] *= (double)MAP_OVERSAMPLE * (g->undo != NULL ? g->undo[k] : 1.0);
    g->X[g->m - 1] *= 0.5; /* one line at the old Nyquist frequency becomes a pair */
    fft_inverse(g->fine, g->X, g->x);
    for (size_t k = 0; k < g->n_fine; k++)
        fine[k] = g->x[g->margin * MAP_OVERSAMPLE + k] + chord(v, g->n, (double)k / MAP_OVERSAMPLE);
}

/* y[n] += fine[n_fine] behind the recorder's filter. */
static void come_down(const struct map_grid *g, const double fine[], double y[])
{
    continue_ends(fine, g->n_fine, g->margin * MAP_OVERSAMPLE, fft_size(g->fine), g->x);
    fft_forward(g->fine, g->x, g->X);
    for (size_t k = 0; k < g->m; k++)
        g->X[k] *= (g->A != NULL ? g->A[k] : 1.0) / (double)MAP_OVERSAMPLE;
    fft_inverse(g->plan, g->X, g->x);
    for (size_t k = 0; k < g->n; k++)
        y[k] += g->x[g->margin + k] + chord(fine, g->n_fine, (double)(k * MAP_OVERSAMPLE));
}

bool map_bends(const struct beam_effect *effect, const double parameters[], const double v[], const double u[],
               size_t n)
{
    double slope = 0.0;
    for (size_t k = 0; k < n; k++) {
        struct beam_sample_output out = {.y_v = 1.0};
        if (effect->map(parameters, v[k], u != NULL ? u[k] : 0.0, &out) != 0)
            return false;
        if (k > 0 && (out.y_v < slope || out.y_v > slope))
            return true;
        slope = out.y_v;
    }
    return false;
}

/* A curve on the fine grid: what it changes, and the derivatives of that. */
struct bend {
    double *change, *by_v;                        /* [n_fine] */
    double *by_parameter[BEAM_EFFECT_PARAMETERS]; /* [n_fine] */
};

static enum bf_status bend_at(const struct beam_effect *effect, const double parameters[], const double v[],
                              const double u[], size_t n_fine, const struct bend *out, struct bf_error *err)
{
    for (size_t k = 0; k < n_fine; k++) {
        struct beam_sample_output at = {.y_v = 1.0};
        if (effect->map(parameters, v[k], u != NULL ? u[k] : 0.0, &at) != 0)
            return bf_fail(err, BF_NUMERIC, "effect %s: a parameter is outside its physical range", effect->id);
        out->change[k] = at.y - v[k];
        out->by_v[k] = at.y_v - 1.0;
        for (int s = 0; s < effect->n_parameters; s++)
            out->by_parameter[s][k] = at.y_p[s];
    }
    return BF_OK;
}

static bool all_zero(const double x[], size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (x[k] < 0.0 || x[k] > 0.0)
            return false;
    return true;
}

/* Columns of the record's initial state: the slope is all that a map does to them. */
static void bend_states(const struct run *run, const struct predict_channel *channel, const struct map_grid *g,
                        const struct bend *bend, double fine[])
{
    const struct predictor *p = run->p;
    size_t first = p->first_state[channel->record], n = state_unknowns(p, channel->record);
    for (size_t i = first; i < first + n; i++) {
        double *column = p->nuisance + i * p->n_rows + channel->row;
        go_up(g, column, fine);
        for (size_t k = 0; k < g->n_fine; k++)
            fine[k] *= bend->by_v[k];
        come_down(g, fine, column);
    }
}

static void bend_columns(const struct run *run, const struct predict_channel *channel, size_t e,
                         const struct map_grid *g, const struct bend *bend, double fine[])
{
    const struct parameter_map *map = &run->p->map;
    for (size_t j = 0; j < map->n; j++) {
        if (!run_wants(run, j))
            continue;
        double *column = run_column(run, j, channel);
        bool still = all_zero(column, g->n);
        if (still)
            memset(fine, 0, g->n_fine * sizeof *fine);
        else
            go_up(g, column, fine);
        for (size_t k = 0; !still && k < g->n_fine; k++)
            fine[k] *= bend->by_v[k];
        for (int s = 0; s < run->p->model.effects[e].effect->n_parameters; s++) {
            if (parameter_map_slot(map, channel->record, e, s) != j)
                continue;
            still = false;
            for (size_t k = 0; k < g->n_fine; k++)
                fine[k] += bend->by_parameter[s][k];
        }
        if (!still)
            come_down(g, fine, column);
    }
}

enum bf_status map_bend(const struct run *run, const struct predict_channel *channel, size_t e,
                        const double parameters[], const double u[], struct bf_error *err)
{
    const struct beam_effect *effect = run->p->model.effects[e].effect;
    struct map_grid g;
    enum bf_status status = grid_new(&run->p->plans[channel->record], channel->n, &g, err);
    if (status == BF_OK) {
        double *y = run->out->y + channel->row;
        double *work = bf_alloc((4 + BEAM_EFFECT_PARAMETERS) * g.n_fine, sizeof *work), *fine = work;
        double *fine_u = work + g.n_fine;
        struct bend bend = {.change = fine_u + g.n_fine, .by_v = fine_u + 2 * g.n_fine};
        for (size_t s = 0; s < BEAM_EFFECT_PARAMETERS; s++)
            bend.by_parameter[s] = work + (4 + s) * g.n_fine;
        go_up(&g, y, fine);
        if (u != NULL)
            go_up(&g, u, fine_u);
        status = bend_at(effect, parameters, fine, u != NULL ? fine_u : NULL, g.n_fine, &bend, err);
        if (status == BF_OK)
            come_down(&g, bend.change, y);
        if (status == BF_OK)
            bend_states(run, channel, &g, &bend, fine);
        if (status == BF_OK && run->want != NULL)
            bend_columns(run, channel, e, &g, &bend, fine);
        free(work);
    }
    grid_free(&g);
    return status;
}
