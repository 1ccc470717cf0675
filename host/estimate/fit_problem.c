/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

static const double onset_share = 0.01; /* of the input's peak */
static const double unlimited = 14.0;   /* a logarithm moves this far (a factor of 1e6) where the file sets no bound */

/* ---- Unknowns ---- */

/* 0: to be told by the data. */
static double scale_of(const struct model *model, const struct parameter_ref *ref)
{
    const double value = fabs(ref->value);
    if (ref->role == ROLE_RESIDUAL)
        return 0.0;
    if (ref->role != ROLE_EFFECT)
        return value > 0.0 ? value : 1.0;
    const struct beam_parameter_info *info = &model->effects[ref->owner].effect->parameters[ref->slot];
    if (info->role == BEAM_ROLE_PLACE)
        return 0.1 * model->length_m;
    const double start = isfinite(info->start) ? fabs(info->start) : 0.0;
    const double scale = fmax(value, start);
    return scale > 0.0 ? scale : 1.0;
}

static void set_prior(struct unknown *u, const struct parameter *info)
{
    u->prior = 0.0;
    if (!(info->prior > 0.0))
        return;
    const double center = info->prior_value;
    if (u->logarithmic) {
        u->prior = info->prior;
        u->prior_x = log(center > 0.0 ? center : info->value);
    } else {
        u->prior = info->prior * (fabs(center) > 0.0 ? fabs(center) / u->scale : 1.0);
        u->prior_x = center / u->scale;
    }
}

static void set_bounds(struct fit_problem *p, size_t i, double value)
{
    const struct unknown *u = &p->unknowns[i];
    const struct parameter *info = p->refs[u->ref].info;
    if (!u->logarithmic) {
        p->lower[i] = info->min / u->scale;
        p->upper[i] = info->max / u->scale;
        return;
    }
    p->lower[i] = fmax(info->min > 0.0 ? log(info->min) : -HUGE_VAL, log(value) - unlimited);
    p->upper[i] = fmin(info->max > 0.0 ? log(info->max) : HUGE_VAL, log(value) + unlimited);
}

static void find_unknowns(struct fit_problem *p, const struct model *model)
{
    for (size_t r = 0; r < p->n_refs; r++) {
        const struct parameter_ref *ref = &p->refs[r];
        p->theta[r] = ref->value;
        p->want[r] = !ref->info->fixed;
        if (ref->info->fixed)
            continue;
        struct unknown *u = &p->unknowns[p->n_unknowns];
        *u = (struct unknown){
            .ref = r, .logarithmic = ref->info->logarithmic && ref->value > 0.0, .scale = scale_of(model, ref)};
        p->n_unknowns++;
    }
}

/* ‖z‖/‖dŷ/dθ‖ over the channels that θ moves, each channel in units of its own rms; 0 when it moves none. */
static double scale_by_data(const struct fit_problem *p, const double column[])
{
    double moved = 0.0, channels = 0.0;
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        const double size = dense_norm(channel->n, channel->measured);
        const double slope = dense_norm(channel->n, column + channel->row);
        if (!(slope > 0.0) || !(size > 0.0))
            continue;
        moved += slope * slope / (size * size);
        channels += 1.0;
    }
    return moved > 0.0 ? sqrt(channels / moved) : 0.0;
}

/* Scales that the data tell, from the first samples after the excitation; then priors and bounds in x. */
static enum bf_status scale_unknowns(struct fit_problem *p, struct bf_error *err)
{
    enum { SAMPLES = 256 };
    bool open = false;
    double end = 0.0;
    for (size_t i = 0; i < p->n_unknowns; i++)
        open = open || p->unknowns[i].scale == 0.0;
    open = open && p->predictor != NULL;
    for (size_t r = 0; r < p->n_records && p->records[r].kind == RECORD_SAMPLES; r++)
        end = fmax(end, p->onset_s[r] + SAMPLES * p->records[r].dt_s);
    struct prediction y = {0};
    enum bf_status status = open ? predictor_window(p->predictor, end, err) : BF_OK;
    if (!status && open)
        status = predictor_run(p->predictor, p->theta, p->want, &y, err);
    if (status)
        return status;
    if (p->predictor != NULL)
        p->n_channels = predictor_channels(p->predictor, &p->channels);
    size_t kept = 0;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        struct unknown u = p->unknowns[i];
        if (u.scale == 0.0 && open)
            u.scale = scale_by_data(p, y.jacobian + u.ref * y.n_rows);
        p->want[u.ref] = u.scale > 0.0;
        if (u.scale == 0.0)
            continue;
        u.least_scale = u.scale;
        set_prior(&u, p->refs[u.ref].info);
        p->unknowns[kept] = u;
        set_bounds(p, kept++, p->theta[u.ref]);
    }
    p->n_unknowns = kept;
    return BF_OK;
}

/* ---- Records ---- */

static bool is_decay(const struct record *record)
{
    const char *kind = record_meta(record, "excitation");
    return kind && strcmp(kind, "free_decay") == 0;
}

/* When the excitation begins, in seconds after the first sample; 0 for a free decay (its rows begin there). */
static double onset_of(const struct model *model, const struct record *record)
{
    if (is_decay(record))
        return 0.0;
    size_t first = record->n;
    for (size_t i = 0; i < model->n_inputs; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        double peak = 0.0;
        for (size_t k = 0; u && k < record->n; k++)
            peak = fmax(peak, fabs(u[k]));
        for (size_t k = 0; u && peak > 0.0 && k < first; k++)
            if (fabs(u[k]) > onset_share * peak)
                first = k;
    }
    return first < record->n ? (double)first * record->dt_s : 0.0;
}

static bool level_unknown(const struct model *model, const struct record *record)
{
    const char *kind = record_meta(record, "excitation");
    if (is_decay(record))
        return false;
    if (kind && strcmp(kind, "unknown_level") == 0)
        return true;
    for (size_t i = 0; i < model->n_inputs; i++)
        if (model->inputs[i].level_per_record && record_column(record, model->inputs[i].name))
            return true;
    return false;
}

enum bf_status fit_problem_new(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                               const struct record records[], size_t n_records, const char *const names[],
                               const struct parameter_ref refs[], size_t n_refs, const double sigma[],
                               struct bf_error *err)
{
    return fit_problem_new_with_lines(p, model, predictor, NULL, records, n_records, names, refs, n_refs, sigma, err);
}

enum bf_status fit_problem_new_with_lines(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                                          struct line_rows *lines, const struct record records[], size_t n_records,
                                          const char *const names[], const struct parameter_ref refs[], size_t n_refs,
                                          const double sigma[], struct bf_error *err)
{
    *p = (struct fit_problem){.model = model,
                              .lines = lines,
                              .prior_scale = 1.0,
                              .records = records,
                              .n_records = n_records,
                              .predictor = predictor,
                              .n_refs = n_refs,
                              .refs = refs,
                              .names = names,
                              .rebase_limit = 0.03};
    p->unknowns = bf_alloc(n_refs, sizeof *p->unknowns);
    p->lower = bf_alloc(n_refs, sizeof *p->lower), p->upper = bf_alloc(n_refs, sizeof *p->upper);
    p->base = bf_alloc(n_refs, sizeof *p->base), p->theta = bf_alloc(n_refs, sizeof *p->theta);
    p->at = bf_alloc(n_refs, sizeof *p->at), p->explained = bf_alloc(n_refs, sizeof *p->explained);
    p->horizon_s = bf_alloc(n_records, sizeof *p->horizon_s);
    p->want = bf_alloc(n_refs, sizeof *p->want), p->held = bf_alloc(n_refs, sizeof *p->held);
    p->level = bf_alloc(n_records, sizeof *p->level), p->onset_s = bf_alloc(n_records, sizeof *p->onset_s);
    p->levels = bf_alloc(n_records, sizeof *p->levels);
    find_unknowns(p, model);
    for (size_t r = 0; r < n_records; r++) {
        p->onset_s[r] = onset_of(model, &records[r]);
        p->horizon_s[r] = HUGE_VAL;
        p->level[r] = level_unknown(model, &records[r]);
        p->levels[r] = 1.0;
        p->has_decay = p->has_decay || record_state_is_free(&records[r]);
    }
    if (predictor != NULL)
        p->n_channels = predictor_channels(predictor, &p->channels);
    if (p->n_channels == 0 && lines == NULL)
        return bf_fail(err, BF_BAD_FILE, "no record has a column that the model names as an output");
    p->sigma = bf_alloc(p->n_channels, sizeof *p->sigma);
    if (p->n_channels > 0)
        memcpy(p->sigma, sigma, p->n_channels * sizeof *p->sigma);
    return scale_unknowns(p, err);
}

/* What belongs to a compressed problem alone, or to none. */
static void free_rows(struct fit_problem *p)
{
    if (p->compressed)
        free(p->beside);
    else
        free(p->fitted);
    free(p->jacobian);
    p->fitted = p->beside = p->jacobian = NULL;
}

void fit_problem_free(struct fit_problem *p)
{
    free_rows(p);
    free(p->unknowns), free(p->lower), free(p->upper), free(p->base), free(p->theta), free(p->want), free(p->held);
    free(p->level), free(p->onset_s), free(p->levels), free(p->sigma), free(p->weight), free(p->residual);
    free(p->coefficients), free(p->at), free(p->explained), free(p->horizon_s), free(p->states);
    *p = (struct fit_problem){0};
}

/* ---- x and θ ---- */

void fit_problem_to_x(const struct fit_problem *p, const double theta[], double x[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        x[i] = u->logarithmic ? log(theta[u->ref]) : theta[u->ref] / u->scale;
    }
}

void fit_problem_to_theta(const struct fit_problem *p, const double x[], double theta[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        theta[u->ref] = u->logarithmic ? exp(x[i]) : x[i] * u->scale;
    }
}

double fit_problem_slope(const struct fit_problem *p, size_t i, const double x[])
{
    return p->unknowns[i].logarithmic ? exp(x[i]) : p->unknowns[i].scale;
}

void fit_problem_rescale(struct fit_problem *p, double x[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        struct unknown *u = &p->unknowns[i];
        const struct parameter_ref *ref = &p->refs[u->ref];
        if (u->logarithmic || ref->role != ROLE_EFFECT)
            continue;
        const struct beam_parameter_info *info = &p->model->effects[ref->owner].effect->parameters[ref->slot];
        const double scale = fmax(u->least_scale, fabs(x[i]) * u->scale), factor = u->scale / scale;
        if (info->role == BEAM_ROLE_PLACE || info->flags & BEAM_PARAMETER_PER_RECORD || !isfinite(scale))
            continue;
        u->scale = scale;
        x[i] *= factor, p->base[i] *= factor;
        set_prior(u, ref->info);
        set_bounds(p, i, p->theta[u->ref]);
        p->at_valid = false;
    }
}

void fit_problem_hold(struct fit_problem *p, size_t i, bool held)
{
    p->held[i] = held;
    p->want[p->unknowns[i].ref] = !held;
    p->at_valid = false;
}

/* ---- Stages ---- */

/* Rows of one channel: the decay, and the floor that keeps model error from dominating early stages. */
static void weigh_channel(struct fit_problem *p, size_t c)
{
    const struct predict_channel *channel = &p->channels[c];
    double *w = p->weight + channel->row;
    double square = 0.0, sum = 0.0;
    for (size_t k = 0; k < channel->n; k++) {
        const double t = (double)k * channel->dt_s - p->onset_s[channel->record];
        if ((double)k * channel->dt_s >= p->horizon_s[channel->record]) {
            w[k] = 0.0;
            continue;
        }
        p->n_used++;
        w[k] = t > 0.0 && p->decay_ps > 0.0 ? exp(-p->decay_ps * t) : 1.0;
        if (t >= 0.0) {
            square += w[k] * w[k] * channel->measured[k] * channel->measured[k];
            sum += w[k] * w[k];
        }
    }
    const double rms = sum > 0.0 ? sqrt(square / sum) : 0.0;
    double sigma = sqrt(p->sigma[c] * p->sigma[c] + p->floor * p->floor * rms * rms);
    if (!(sigma > 0.0))
        sigma = 1.0; /* a channel of zeros says nothing about scale */
    for (size_t k = 0; k < channel->n; k++)
        w[k] /= sigma;
}

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

static enum bf_status rebase_to(struct fit_problem *p, const double theta[], bool pair, struct bf_error *err)
{
    const enum bf_status status = p->predictor != NULL ? predictor_rebase(p->predictor, theta, err) : BF_OK;
    return status == BF_OK ? lines_rebase(p->lines, theta, pair, err) : status;
}

static enum bf_status rebase(struct fit_problem *p, const double x[], bool pair, struct bf_error *err)
{
    struct bf_error ignored;
    p->at_valid = false;
    fit_problem_to_theta(p, x, p->theta);
    enum bf_status status = rebase_to(p, p->theta, pair, err);
    if (status == BF_OK) {
        memcpy(p->base, x, p->n_unknowns * sizeof *x);
        p->based = true;
    } else if (p->based) { /* a predictor without a base cannot run: go back to the last one */
        fit_problem_to_theta(p, p->base, p->theta);
        if (rebase_to(p, p->theta, pair, &ignored) != BF_OK)
            p->stop = true;
    }
    return status;
}

enum bf_status fit_problem_rebase(struct fit_problem *p, const double x[], struct bf_error *err)
{
    return rebase(p, x, false, err);
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
    const enum bf_status status = rebase(p, x, true, err);
    weigh_lines(p);
    return status;
}

/* Fitted rows and the Jacobian. Not compressed is a record with a level of its own: its rows are projected as a whole. */
static void make_rows(struct fit_problem *p)
{
    const size_t n = p->n_unknowns;
    free_rows(p);
    p->compressed = n > 0 && p->predictor != NULL && predictor_is_long(p->predictor);
    for (size_t r = 0; r < p->n_records; r++)
        p->compressed = p->compressed && !p->level[r];
    p->n_jacobian = p->compressed ? n + 1 + p->n_rows - p->n_sample_rows : p->n_rows;
    p->jacobian = bf_grow(NULL, p->n_jacobian * (n ? n : 1), sizeof *p->jacobian);
    p->beside = p->compressed ? bf_alloc(p->n_jacobian, sizeof *p->beside) : p->residual;
    p->fitted = p->compressed ? NULL : bf_grow(NULL, p->n_rows, sizeof *p->fitted);
}

enum bf_status fit_problem_stage(struct fit_problem *p, double decay_ps, double floor, const double x[],
                                 struct bf_error *err)
{
    static const double last_weight = 1e-3;
    double latest = 0.0;
    for (size_t r = 0; r < p->n_records; r++)
        latest = fmax(latest, p->onset_s[r]);
    p->decay_ps = decay_ps, p->floor = floor;
    const double end = decay_ps > 0.0 ? latest - log(last_weight) / decay_ps : HUGE_VAL;
    enum bf_status status = p->predictor != NULL ? predictor_window(p->predictor, end, err) : BF_OK;
    if (!status)
        status = rebase(p, x, true, err);
    if (status)
        return status;
    if (p->predictor != NULL)
        p->n_channels = predictor_channels(p->predictor, &p->channels);
    p->n_sample_rows = 0;
    for (size_t c = 0; c < p->n_channels; c++)
        p->n_sample_rows += p->channels[c].n;
    p->n_rows = p->n_sample_rows + lines_rows(p->lines);
    p->weight = bf_grow(p->weight, p->n_rows, sizeof *p->weight);
    p->residual = bf_grow(p->residual, p->n_rows, sizeof *p->residual);
    make_rows(p);
    p->n_used = 0;
    for (size_t k = p->n_sample_rows; k < p->n_rows; k++)
        p->weight[k] = 0.0;
    weigh_lines(p);
    for (size_t c = 0; c < p->n_channels; c++)
        weigh_channel(p, c);
    return BF_OK;
}
