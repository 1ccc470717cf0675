/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The columns S of one candidate: what its strengths do to the prediction, at a point of its scan. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "score_probe.h"

static const double absorbed_all = 1e-7; /* what is left after projection is rounding below this share */

bool candidate_is_finite(const struct candidate *candidate, int slot)
{
    return candidate->role[slot] == CANDIDATE_INVERSE ||
           (candidate->role[slot] == CANDIDATE_STRENGTH && candidate->n_grid[slot] > 0);
}

bool candidate_is_sinusoid(const struct candidate *c)
{
    for (int i = 0; i < c->effect->n_parameters; i++)
        if (c->role[i] == CANDIDATE_PHASE)
            return true;
    return false;
}

static bool is_strength(const struct candidate *c, int slot)
{
    return c->role[slot] == CANDIDATE_STRENGTH || c->role[slot] == CANDIDATE_INVERSE;
}

/* ---- Life ---- */

enum bf_status probe_new(const struct score_base *base, const struct candidate *candidate, struct probe *out,
                         struct bf_error *err)
{
    *out = (struct probe){.base = base, .candidate = candidate};
    struct predict_options options = base->options.predict;
    options.threads = 1;
    options.quiet = true;
    enum bf_status status = candidate_model(base->model, candidate, candidate->start, &out->model, err);
    if (!status)
        status = predictor_new(&out->model, base->records, base->n_records, &options, &out->predictor, err);
    if (status)
        return status;
    out->n_refs = model_parameters(&out->model, base->names, base->n_records, &out->refs);
    out->theta = bf_alloc(out->n_refs, sizeof *out->theta);
    out->want = bf_alloc(out->n_refs, sizeof *out->want);
    out->work = bf_alloc(base->n_rows, sizeof *out->work);
    for (size_t i = 0; i < out->n_refs; i++) {
        const struct parameter_ref *ref = &out->refs[i];
        const bool own = ref->role == ROLE_EFFECT && ref->owner + 1 == out->model.n_effects;
        out->theta[i] = ref->value;
        out->want[i] = own && candidate->role[ref->slot] == CANDIDATE_STRENGTH &&
                       !candidate_is_finite(candidate, ref->slot) && !candidate_is_sinusoid(candidate);
        out->n_most += own && (is_strength(candidate, ref->slot) || candidate->role[ref->slot] == CANDIDATE_PHASE);
    }
    out->n_most = 2 * out->n_most + base->n_limited; /* a phase and a shared amplitude become sine and cosine */
    return BF_OK;
}

void probe_free(struct probe *probe)
{
    predictor_free(probe->predictor);
    free(probe->refs), free(probe->theta), free(probe->want), free(probe->work);
    model_free(&probe->model);
    *probe = (struct probe){0};
}

/* ---- Predictions ---- */

/*
 * At theta, free decays from the states nearest to the baseline's: y->y is the whole prediction, or y->jacobian that of the strengths. Those are taken where the effect does
 * nothing, wherever it is: the states are the same at every point of the scan.
 */
static enum bf_status predict(struct probe *probe, bool derivatives, struct prediction *y, struct bf_error *err)
{
    const struct score_base *base = probe->base;
    const struct predict_target target = {.weight = base->weight, .z = base->fitted};
    enum bf_status status = BF_OK;
    if (base->has_decay && !(derivatives && probe->at_states))
        status = predictor_run_solved(probe->predictor, probe->theta, &target, y, err);
    probe->at_states = derivatives && !status;
    if (!status && (derivatives || !base->has_decay))
        status = predictor_run(probe->predictor, probe->theta, derivatives ? probe->want : NULL, y, err);
    if (!status && y->n_rows != base->n_rows)
        status = bf_fail(err, BF_NUMERIC, "the prediction has other rows than the baseline's");
    return status;
}

/* The effect's parameters in theta; `neutral`: strengths are 0 where their derivative is taken. */
static void set_point(struct probe *probe, const double p[], bool neutral, double phase_rad)
{
    for (size_t i = 0; i < probe->n_refs; i++) {
        const struct parameter_ref *ref = &probe->refs[i];
        if (ref->role != ROLE_EFFECT || ref->owner + 1 != probe->model.n_effects)
            continue;
        const enum candidate_role role = probe->candidate->role[ref->slot];
        if (role == CANDIDATE_PHASE)
            probe->theta[i] = phase_rad;
        else if (role == CANDIDATE_STRENGTH && neutral && !candidate_is_finite(probe->candidate, ref->slot))
            probe->theta[i] = 0.0;
        else
            probe->theta[i] = p[ref->slot];
    }
}

/* ---- Columns ---- */

struct columns {
    struct probe *probe;
    double *S;
    struct probe_column *what;
    size_t *n;
};

/* rows[n_rows], or those of one record only. */
static void put(const struct columns *out, const double rows[], struct probe_column what)
{
    const struct score_base *base = out->probe->base;
    double *work = out->probe->work, *column = out->S + *out->n * base->n_all;
    for (size_t c = 0; c < base->n_channels; c++) {
        const struct predict_channel *channel = &base->channels[c];
        const bool shown = what.record < 0 || (size_t)what.record == channel->record;
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            work[k] = shown ? rows[k] : 0.0;
    }
    const double left = score_project(base, work, column);
    if (!(left > absorbed_all)) /* nothing there, or not finite */
        memset(column, 0, base->n_all * sizeof *column);
    out->what[(*out->n)++] = what;
}

/* rows[n_rows] = scale · (this prediction − the baseline's). */
static void difference(const struct probe *probe, const struct prediction *y, double scale, double rows[])
{
    const struct score_base *base = probe->base;
    for (size_t c = 0; c < base->n_channels; c++) {
        const struct predict_channel *channel = &base->channels[c];
        const double level = base->levels[channel->record];
        for (size_t k = channel->row; k < channel->row + channel->n; k++)
            rows[k] = scale * (level * y->y[k] - base->fitted[k]);
    }
}

static enum bf_status sinusoid(const struct columns *out, const double p[], struct bf_error *err)
{
    struct probe *probe = out->probe;
    const int slot = probe->candidate->strength;
    const double amplitude = probe->candidate->start[slot];
    double point[BEAM_EFFECT_PARAMETERS], *rows = bf_alloc(probe->base->n_rows, sizeof *rows);
    memcpy(point, p, sizeof point);
    point[slot] = amplitude;
    enum bf_status status = BF_OK;
    for (int turned = 0; turned < 2 && !status; turned++) {
        struct prediction y;
        set_point(probe, point, false, turned ? 0.5 * M_PI : 0.0);
        status = predictor_run(probe->predictor, probe->theta, NULL, &y, err);
        if (!status && y.n_rows != probe->base->n_rows)
            status = bf_fail(err, BF_NUMERIC, "the prediction has other rows than the baseline's");
        if (status)
            break;
        difference(probe, &y, 1.0 / amplitude, rows);
        for (size_t r = 0; r < probe->base->n_records; r++)
            put(out, rows, (struct probe_column){slot, (int)r, turned != 0});
    }
    free(rows);
    return status;
}

static enum bf_status finite_trial(const struct columns *out, const double p[], struct bf_error *err)
{
    struct probe *probe = out->probe;
    struct prediction y;
    set_point(probe, p, false, 0.0);
    const enum bf_status status = predict(probe, false, &y, err);
    if (status)
        return status;
    double *rows = bf_alloc(probe->base->n_rows, sizeof *rows);
    difference(probe, &y, 1.0, rows);
    put(out, rows, (struct probe_column){probe->candidate->strength, -1, false});
    free(rows);
    return BF_OK;
}

static enum bf_status derivatives(const struct columns *out, const double p[], struct bf_error *err)
{
    struct probe *probe = out->probe;
    const struct score_base *base = probe->base;
    struct prediction y;
    set_point(probe, p, true, 0.0);
    const enum bf_status status = predict(probe, true, &y, err);
    for (size_t i = 0; i < probe->n_refs && !status; i++) {
        if (!probe->want[i])
            continue;
        double *rows = y.jacobian + i * y.n_rows;
        for (size_t c = 0; c < base->n_channels; c++)
            for (size_t k = 0; k < base->channels[c].n; k++)
                rows[base->channels[c].row + k] *= base->levels[base->channels[c].record];
        put(out, rows, (struct probe_column){probe->refs[i].slot, probe->refs[i].record, false});
    }
    return status;
}

enum bf_status probe_columns(struct probe *probe, const double p[], double S[], struct probe_column what[], size_t *n,
                             struct bf_error *err)
{
    const struct score_base *base = probe->base;
    const struct columns out = {probe, S, what, n};
    *n = 0;
    probe->n_points++;
    enum bf_status status;
    if (candidate_is_sinusoid(probe->candidate))
        status = sinusoid(&out, p, err);
    else if (candidate_is_finite(probe->candidate, probe->candidate->strength))
        status = finite_trial(&out, p, err);
    else
        status = derivatives(&out, p, err);
    for (size_t j = 0; j < base->n_limited && !status; j++) {
        memcpy(S + *n * base->n_all, base->limited + j * base->n_all, base->n_all * sizeof *S);
        what[(*n)++] = (struct probe_column){-1, (int)j, false};
    }
    return status;
}
