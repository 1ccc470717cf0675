/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reconstruct_law.h"
#include "reconstruct_shape.h"
#include "reconstruct_text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

/* Points tried: so many, evenly over the span, the last at its end; then two beside the best. */
enum { POINTS = 10, BESIDE = 2, SITES = POINTS + BESIDE + 2, ROUNDS = 2 };
/* A place is known when it leaves at most this, and less than this part of what places a sixth of the span away leave. */
static const double most_left = 0.5, clearly = 0.7, apart = 1.0 / 6.0;
/* A force is a function of displacement and velocity when the best place leaves at most this unexplained. */
static const double law_leaves = 0.5;

/* ---- Places compared ---- */

/* Σ (W x)² over the rows that tell places apart. */
static double telling_square(const struct motion *motion, const double x[])
{
    double sum = 0.0;
    for (size_t c = 0; c < motion->n_channels; c++) {
        const struct predict_channel *channel = &motion->channels[c];
        if (transfer_record(motion->predictor, channel->record).n_channels < 2)
            continue;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            sum += x[k] * x[k];
    }
    return sum;
}

static bool can_tell(const struct motion *motion)
{
    for (size_t r = 0; r < motion->n_records; r++)
        if (transfer_record(motion->predictor, r).n_channels > 1)
            return true;
    return false;
}

/* left[n_rows] = the residual less what the baseline's parameters explain beside rows[n_rows]; s[m]: less rows too, W. */
static void take_baseline(const struct regression *regression, const double rows[], double s[], double left[])
{
    regression_project(regression, rows, s, NULL);
    for (size_t k = 0; k < regression->m; k++)
        s[k] = regression->left[k] - s[k];
    for (size_t k = 0; k < regression->n_rows; k++)
        left[k] = regression->row_weight[k] > 0.0 ? s[k] / regression->row_weight[k] + rows[k] : 0.0;
}

/* Any history of a force at the place, and the baseline's parameters, by turns; left[n_rows] in/out: what f̂ is made of. */
static enum bf_status fit_history(const struct regression *regression, struct site_force *force, int rounds,
                                  double left[], double *unexplained, struct bf_error *err)
{
    const struct motion *motion = force->motion;
    size_t n = motion->n_rows;
    double *rows = bf_alloc(n + regression->m, sizeof *rows), *s = rows + n;
    enum bf_status status = BF_OK;
    for (int i = 0; status == BF_OK && i < rounds; i++) {
        status = site_force_estimate(force, left, err);
        memset(rows, 0, n * sizeof *rows);
        for (size_t r = 0; status == BF_OK && r < motion->n_records; r++)
            status = motion_respond(motion, &force->paths, r, force->F[r], rows, err);
        take_baseline(regression, rows, s, left);
    }
    double whole = telling_square(motion, regression->left);
    *unexplained = can_tell(motion) && whole > 0.0 ? fmin(1.0, telling_square(motion, s) / whole) : (double)NAN;
    free(rows);
    return status;
}

static enum bf_status try_site(const struct motion *motion, const struct regression *regression,
                               struct reconstruct_site *site, struct bf_error *err)
{
    struct site_force force;
    struct site_law law;
    bool all[FEATURES];
    double *left = bf_alloc(motion->n_rows, sizeof *left);
    memcpy(left, motion->residual, motion->n_rows * sizeof *left);
    for (int i = 0; i < FEATURES; i++)
        all[i] = true;
    site_force_new(motion, site, &force);
    enum bf_status status = fit_history(regression, &force, ROUNDS, left, &site->by_history, err);
    if (status == BF_OK)
        status = site_law_fit(&force, regression, &law, err);
    if (status == BF_OK)
        site->by_law = law.chi_square > 0.0 ? 1.0 - site_law_fall(&law, all, NULL) / law.chi_square : 1.0;
    site_force_free(&force);
    free(left);
    return status;
}

static void fill_sites(const struct motion *motion, struct reconstruction *out)
{
    double length = transfer_model(motion->predictor)->length_m, from, to;
    out->sites = bf_alloc(SITES, sizeof *out->sites);
    for (int k = 1; k <= POINTS; k++)
        out->sites[out->n_sites++] = (struct reconstruct_site){.place = RECONSTRUCT_POINT, .at_m = length * k / POINTS};
    if (model_patch(transfer_model(motion->predictor), &from, &to))
        out->sites[out->n_sites++] = (struct reconstruct_site){.place = RECONSTRUCT_PATCH, .at_m = 0.5 * (from + to)};
    out->sites[out->n_sites++] = (struct reconstruct_site){.place = RECONSTRUCT_SPREAD, .at_m = 0.5 * length};
}

static int by_law(const void *a, const void *b)
{
    const struct reconstruct_site *x = a, *y = b;
    return (x->by_law > y->by_law) - (x->by_law < y->by_law);
}

static int by_history(const void *a, const void *b)
{
    const struct reconstruct_site *x = a, *y = b;
    return (x->by_history > y->by_history) - (x->by_history < y->by_history);
}

static void sort_sites(const struct motion *motion, struct reconstruction *out)
{
    qsort(out->sites, out->n_sites, sizeof *out->sites, by_law);
    out->is_law = out->sites[0].by_law <= law_leaves;
    if (!out->is_law && can_tell(motion))
        qsort(out->sites, out->n_sites, sizeof *out->sites, by_history);
    out->best = out->sites[0];
}

/* The sites in order, and with the points beside the best one. */
static enum bf_status try_beside(const struct motion *motion, const struct regression *regression,
                                 struct reconstruction *out, struct bf_error *err)
{
    double length = transfer_model(motion->predictor)->length_m, step = 0.5 * length / POINTS;
    enum bf_status status = BF_OK;
    sort_sites(motion, out);
    const struct reconstruct_site best = out->best;
    for (int side = -1; status == BF_OK && best.place == RECONSTRUCT_POINT && side <= 1; side += 2) {
        struct reconstruct_site *site = &out->sites[out->n_sites];
        *site = (struct reconstruct_site){.place = RECONSTRUCT_POINT, .at_m = best.at_m + side * step};
        if (site->at_m > length)
            continue;
        out->n_sites++;
        status = try_site(motion, regression, site, err);
    }
    sort_sites(motion, out);
    return status;
}

/* Neighbours of the best point are as good as it; others must be clearly worse. */
static bool stands_out(const struct reconstruction *out, double length)
{
    const struct reconstruct_site *best = &out->sites[0];
    double left = out->is_law ? best->by_law : best->by_history;
    if (!(left <= most_left))
        return false;
    for (size_t i = 1; i < out->n_sites; i++) {
        const struct reconstruct_site *other = &out->sites[i];
        bool neighbour = fabs(other->at_m - best->at_m) < apart * length && other->place != RECONSTRUCT_SPREAD;
        if (!neighbour && left > clearly * (out->is_law ? other->by_law : other->by_history))
            return false;
    }
    return true;
}

static enum bf_status best_records(const struct site_force *force, struct reconstruction *out, struct bf_error *err)
{
    const struct motion *motion = force->motion;
    enum bf_status status = BF_OK;
    out->records = bf_alloc(motion->n_records, sizeof *out->records);
    for (size_t r = 0; status == BF_OK && r < motion->n_records; r++) {
        const struct response_grid *grid = transfer_record(motion->predictor, r).grid;
        struct reconstruct_record *record = &out->records[out->n_records++];
        *record = (struct reconstruct_record){.record = r, .n = grid->n, .dt_s = grid->dt_s};
        record->f = bf_alloc(3 * grid->n, sizeof(double));
        record->w = record->f + grid->n;
        record->v = record->w + grid->n;
        status = response_back(grid, force->F[r], record->f, err);
        if (status == BF_OK)
            status = motion_of(motion, r, force->g, 1, record->w, record->v, NULL, err);
    }
    return status;
}

/* The residual less what the baseline explains beside the law at the place; where there is no such law, beside f̂. */
static enum bf_status best_force(const struct regression *regression, const struct reconstruction *out,
                                 const struct site_law *law, struct site_force *force, struct bf_error *err)
{
    const struct motion *motion = force->motion;
    size_t n = motion->n_rows;
    double *left = bf_alloc(2 * n + regression->m, sizeof *left), *rows = left + n, c[FEATURES], ignored;
    bool all[FEATURES];
    enum bf_status status = BF_OK;
    memcpy(left, motion->residual, n * sizeof *left);
    if (out->is_law) {
        for (int i = 0; i < FEATURES; i++)
            all[i] = true;
        (void)site_law_fall(law, all, c);
        status = site_law_rows(force, law, c, rows, err);
        take_baseline(regression, rows, rows + n, left);
    }
    if (status == BF_OK)
        status = fit_history(regression, force, out->is_law ? 1 : ROUNDS, left, &ignored, err);
    free(left);
    return status;
}

/* The best place again, with everything about it. */
static enum bf_status describe(const struct motion *motion, const struct regression *regression,
                               struct reconstruction *out, struct bf_error *err)
{
    struct site_force force;
    struct site_law law;
    out->located = stands_out(out, transfer_model(motion->predictor)->length_m);
    site_force_new(motion, &out->best, &force);
    enum bf_status status = site_law_fit(&force, regression, &law, err);
    if (status == BF_OK)
        status = best_force(regression, out, &law, &force, err);
    if (status == BF_OK)
        status = best_records(&force, out, err);
    if (status == BF_OK)
        status = reconstruct_shape(&force, &law, out, err);
    site_force_free(&force);
    if (status == BF_OK) {
        reconstruct_channels(motion, out);
        reconstruct_text(out);
    }
    return status;
}

enum bf_status reconstruct_run(const struct motion *motion, struct reconstruction *out, struct bf_error *err)
{
    struct regression regression;
    *out = (struct reconstruction){.amplitude_power = (double)NAN};
    enum bf_status status = regression_new(motion, &regression, err);
    if (status != BF_OK)
        return status;
    fill_sites(motion, out);
    for (size_t i = 0; status == BF_OK && i < out->n_sites; i++)
        status = try_site(motion, &regression, &out->sites[i], err);
    if (status == BF_OK)
        status = try_beside(motion, &regression, out, err);
    if (status == BF_OK)
        status = describe(motion, &regression, out, err);
    regression_free(&regression);
    if (status != BF_OK)
        reconstruct_free(out);
    return status;
}

void reconstruct_free(struct reconstruction *reconstruction)
{
    for (size_t r = 0; r < reconstruction->n_records; r++)
        free(reconstruction->records[r].f);
    free(reconstruction->records);
    free(reconstruction->sites);
    free(reconstruction->spectrum);
    *reconstruction = (struct reconstruction){0};
}
