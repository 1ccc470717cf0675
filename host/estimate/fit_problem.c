/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_shares.h"
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
    const double most = isfinite(info->max) ? info->max
                        : p->released       ? HUGE_VAL
                                            : model_most_damping(p->model, &p->refs[u->ref]);
    p->lower[i] = fmax(info->min > 0.0 ? log(info->min) : -HUGE_VAL, log(fmin(value, most)) - unlimited);
    p->upper[i] = fmin(log(most), log(value) + unlimited);
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
        end = fmax(end, p->drives[r].onset_s + SAMPLES * p->records[r].dt_s);
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
        else if (u.scale == 0.0 && p->shares != NULL)
            u.scale = p->shares->scale[u.ref];
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

/* When the excitation begins, in seconds after the first sample; 0 for a free decay (its rows begin there). */
static double onset_of(const struct model *model, const struct record *record)
{
    if (record_is_free_decay(record))
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
    if (record_is_free_decay(record))
        return false;
    if (kind && strcmp(kind, "unknown_level") == 0)
        return true;
    for (size_t i = 0; i < model->n_inputs; i++)
        if (model->inputs[i].level_per_record && record_column(record, model->inputs[i].name))
            return true;
    return false;
}

static struct fit_drive drive_of(const struct model *model, const struct record *record)
{
    struct fit_drive drive = {.onset_s = onset_of(model, record),
                              .level = level_unknown(model, record),
                              .free_state = record_state_is_free(record),
                              .driven = record_is_driven(model, record)};
    for (size_t i = 0; i < model->n_inputs; i++)
        drive.n_inputs += record_column(record, model->inputs[i].name) != NULL;
    return drive;
}

/* ---- Life ---- */

enum bf_status fit_problem_new(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                               const struct record records[], size_t n_records, const char *const names[],
                               const struct parameter_ref refs[], size_t n_refs, const double sigma[],
                               struct bf_error *err)
{
    return fit_problem_new_with_lines(p, model, predictor, NULL, records, n_records, names, refs, n_refs, sigma, err);
}

/* Room for what each record and each parameter has. */
static void begin(struct fit_problem *p, const struct model *model, const struct record records[], size_t n_records,
                  const char *const names[], const struct parameter_ref refs[], size_t n_refs)
{
    *p = (struct fit_problem){.model = model,
                              .prior_scale = 1.0,
                              .records = records,
                              .n_records = n_records,
                              .n_refs = n_refs,
                              .refs = refs,
                              .names = names,
                              .rebase_limit = 0.03};
    p->unknowns = bf_alloc(n_refs, sizeof *p->unknowns);
    p->lower = bf_alloc(n_refs, sizeof *p->lower), p->upper = bf_alloc(n_refs, sizeof *p->upper);
    p->base = bf_alloc(n_refs, sizeof *p->base), p->theta = bf_alloc(n_refs, sizeof *p->theta);
    p->at = bf_alloc(n_refs, sizeof *p->at), p->explained = bf_alloc(n_refs, sizeof *p->explained);
    p->horizon_s = bf_alloc(n_records, sizeof *p->horizon_s);
    p->weighed_s = bf_alloc(n_records, sizeof *p->weighed_s);
    p->want = bf_alloc(n_refs, sizeof *p->want), p->held = bf_alloc(n_refs, sizeof *p->held);
    p->drives = bf_alloc(n_records, sizeof *p->drives);
    p->levels = bf_alloc(n_records, sizeof *p->levels);
    find_unknowns(p, model);
    for (size_t r = 0; r < n_records; r++) {
        p->horizon_s[r] = HUGE_VAL;
        p->levels[r] = 1.0;
    }
}

static void take_drive(struct fit_problem *p, size_t r, const struct fit_drive *drive)
{
    p->drives[r] = *drive;
    p->has_decay = p->has_decay || drive->free_state;
    p->latest_s = fmax(p->latest_s, drive->onset_s);
}

enum bf_status fit_problem_new_with_lines(struct fit_problem *p, const struct model *model, struct predictor *predictor,
                                          struct line_rows *lines, const struct record records[], size_t n_records,
                                          const char *const names[], const struct parameter_ref refs[], size_t n_refs,
                                          const double sigma[], struct bf_error *err)
{
    begin(p, model, records, n_records, names, refs, n_refs);
    p->predictor = predictor, p->lines = lines;
    for (size_t r = 0; r < n_records; r++) {
        const struct fit_drive drive = drive_of(model, &records[r]);
        take_drive(p, r, &drive);
    }
    if (predictor != NULL)
        p->n_channels = p->n_signals = predictor_channels(predictor, &p->channels);
    if (p->n_channels == 0 && lines == NULL)
        return bf_fail(err, BF_BAD_FILE, "no record has a column that the model names as an output");
    p->sigma = bf_alloc(p->n_channels, sizeof *p->sigma);
    if (p->n_channels > 0)
        memcpy(p->sigma, sigma, p->n_channels * sizeof *p->sigma);
    return scale_unknowns(p, err);
}

enum bf_status fit_problem_new_shared(struct fit_problem *p, const struct model *model, const struct fit_shares *shares,
                                      const char *const names[], const struct parameter_ref refs[], size_t n_refs,
                                      struct bf_error *err)
{
    begin(p, model, shares->records, shares->n_records, names, refs, n_refs);
    p->shares = shares;
    for (size_t r = 0; r < shares->n_records; r++)
        take_drive(p, r, &shares->drives[r]);
    return scale_unknowns(p, err);
}

/* What belongs to a compressed problem alone, or to none. */
void fit_problem_free_rows(struct fit_problem *p)
{
    if (p->compressed)
        free(p->beside);
    else
        free(p->fitted);
    free(p->jacobian);
    p->fitted = p->beside = p->jacobian = NULL;
}

void fit_problem_make_jacobian(struct fit_problem *p)
{
    p->jacobian = bf_grow(NULL, p->n_jacobian * (p->n_unknowns ? p->n_unknowns : 1), sizeof *p->jacobian);
    p->beside = p->compressed ? bf_alloc(p->n_jacobian, sizeof *p->beside) : p->residual;
}

void fit_problem_rest(struct fit_problem *p)
{
    p->held_at = HOLDS_NOTHING;
    free(p->jacobian);
    if (p->compressed)
        free(p->beside);
    p->jacobian = p->beside = NULL;
    if (p->predictor != NULL)
        predictor_rest(p->predictor);
}

void fit_problem_free(struct fit_problem *p)
{
    fit_problem_free_rows(p);
    free(p->unknowns), free(p->lower), free(p->upper), free(p->base), free(p->theta), free(p->want), free(p->held);
    free(p->drives), free(p->levels), free(p->sigma), free(p->weight), free(p->residual);
    free(p->coefficients), free(p->at), free(p->explained), free(p->horizon_s), free(p->weighed_s), free(p->states);
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

/* Rounding must not put a place one unit of its last digit beyond the end of the beam, where no effect has a value. */
void fit_problem_to_theta(const struct fit_problem *p, const double x[], double theta[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        const struct parameter *info = p->refs[u->ref].info;
        theta[u->ref] = fmin(fmax(u->logarithmic ? exp(x[i]) : x[i] * u->scale, info->min), info->max);
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
        x[i] *= factor, p->base[i] *= factor, p->at[i] *= factor;
        for (size_t k = 0; k < p->n_jacobian && p->held_at == HOLDS_JACOBIAN; k++)
            p->jacobian[i * p->n_jacobian + k] /= factor;
        set_prior(u, ref->info);
        set_bounds(p, i, p->theta[u->ref]);
    }
}

void fit_problem_release(struct fit_problem *p)
{
    p->released = true;
    for (size_t i = 0; i < p->n_unknowns; i++)
        set_bounds(p, i, p->theta[p->unknowns[i].ref]);
}

bool fit_problem_presses(const struct fit_problem *p, const double x[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        if (u->logarithmic && !isfinite(p->refs[u->ref].info->max) && x[i] >= p->upper[i])
            return true;
    }
    return false;
}

void fit_problem_hold(struct fit_problem *p, size_t i, bool held)
{
    p->held[i] = held;
    p->want[p->unknowns[i].ref] = !held;
    p->held_at = HOLDS_NOTHING;
}
