/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Some of the records of a fit, where they are: what they say of θ. */
#include "fit_message.h"
#include "fit_work.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fit_coloured.h"
#include "fit_result.h"
#include "fit_triangle.h"

struct fit_share {
    struct fit_work work;
};

/* A question that was read, and where it goes to. */
struct errand {
    struct share_question head;
    double *theta, *slope; /* [n_refs], [n_unknowns] */
    size_t *ref;           /* [n_unknowns] */
    struct fit_message *out;
    size_t n; /* of the answer */
};

/* ---- Life ---- */

static enum bf_status check(const struct model *model, const struct record records[], size_t n_records,
                            struct bf_error *err)
{
    struct parameter_ref *refs;
    const char **names = record_base_names(records, n_records);
    const size_t n = model_parameters(model, names, n_records, &refs);
    enum bf_status status = BF_OK;
    if (model_has_law(model))
        status = bf_fail(err, BF_USAGE,
                         "the model has a nonlinear law; many records are fitted of linear models only: "
                         "use `beamfit fit` with some of them");
    for (size_t i = 0; i < n && !status; i++)
        if (refs[i].record >= 0)
            status = bf_fail(err, BF_USAGE,
                             "%s has a value for each record; many records are fitted of models that are the same in "
                             "all: use `beamfit fit` with some of them",
                             refs[i].label);
    for (size_t r = 0; r < n_records && !status; r++)
        if (records[r].kind != RECORD_SAMPLES)
            status = bf_fail(err, BF_USAGE, "%s: is no recording over time; `beamfit fit` takes such beside others",
                             records[r].path);
    free(refs), free(names);
    return status;
}

enum bf_status fit_share_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct fit_options *options, struct fit_share **out, struct bf_error *err)
{
    struct fit_options own = *options;
    own.shares = NULL;
    *out = bf_alloc(1, sizeof **out);
    enum bf_status status = check(model, records, n_records, err);
    if (!status)
        status = fit_work_new(&(*out)->work, model, records, n_records, &own, err);
    if (!status)
        fit_problem_rest(&(*out)->work.problem);
    return status;
}

void fit_share_free(struct fit_share *share)
{
    if (share != NULL)
        fit_work_free(&share->work);
    free(share);
}

/* ---- Answers ---- */

static enum bf_status tell_records(struct fit_share *share, struct errand *errand, struct bf_error *err)
{
    const struct fit_work *w = &share->work;
    double *scale = bf_alloc(w->n_refs + 1, sizeof *scale);
    for (size_t r = 0; r < w->n_records; r++) {
        const struct record *record = &w->records[r];
        struct share_record to = {
            .n = record->n, .t0_s = record->t0_s, .dt_s = record->dt_s, .drive = w->problem.drives[r]};
        (void)snprintf(to.path, sizeof to.path, "%s", record->path);
        (void)snprintf(to.sha256, sizeof to.sha256, "%s", record->sha256);
        message_add(errand->out, &to, sizeof to);
    }
    for (size_t i = 0; i < w->problem.n_unknowns; i++)
        scale[w->problem.unknowns[i].ref] = w->problem.unknowns[i].scale;
    message_add(errand->out, scale, w->n_refs * sizeof *scale);
    errand->n = w->n_records;
    free(scale);
    return errand->head.n_refs == w->n_refs
               ? BF_OK
               : bf_fail(err, BF_NUMERIC, "%s: other parameters than in other records", w->records[0].path);
}

/* The question's unknown of this one, or n_unknowns. */
static size_t asked(const struct errand *errand, size_t ref)
{
    size_t k = 0;
    while (k < errand->head.n_unknowns && errand->ref[k] != ref)
        k++;
    return k;
}

/* θ, and which derivatives are wanted. */
static void set(struct fit_work *w, const struct errand *errand)
{
    struct fit_problem *p = &w->problem;
    memcpy(p->theta, errand->theta, w->n_refs * sizeof *p->theta);
    fit_problem_to_x(p, errand->theta, w->x);
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const size_t k = asked(errand, p->unknowns[i].ref);
        const bool held = k == errand->head.n_unknowns || errand->slope[k] == 0.0;
        if (held != p->held[i])
            fit_problem_hold(p, i, held);
    }
}

/* What a derivative by own unknown i is times, to be one by the asker's k. */
static double factor(const struct fit_work *w, const struct errand *errand, size_t i, size_t k)
{
    return errand->slope[k] / fit_problem_slope(&w->problem, i, w->x);
}

/* [J r] of the share as few rows. */
static enum bf_status compress(const struct fit_problem *p, struct triangle *t, struct bf_error *err)
{
    enum { BLOCK = 1024 };
    enum bf_status status = BF_OK;
    for (size_t row = 0; row < p->n_jacobian && !status; row += BLOCK) {
        const size_t some = p->n_jacobian - row < BLOCK ? p->n_jacobian - row : BLOCK;
        status = triangle_add(t, some, p->n_jacobian, p->jacobian + row, p->beside + row, err);
    }
    return status;
}

static enum bf_status tell_derivative(struct fit_share *share, struct errand *errand, struct bf_error *err)
{
    const struct fit_work *w = &share->work;
    const size_t rows = w->problem.n_unknowns + 1, n = errand->head.n_unknowns;
    struct triangle t = triangle_new(w->problem.n_unknowns);
    double *J = bf_alloc(rows * n, sizeof *J);
    const enum bf_status status = compress(&w->problem, &t, err);
    for (size_t i = 0; i < w->problem.n_unknowns; i++) {
        const size_t k = asked(errand, w->problem.unknowns[i].ref);
        for (size_t j = 0; j < rows && k < n; j++)
            J[j + k * rows] = factor(w, errand, i, k) * t.R[j + i * rows];
    }
    message_add(errand->out, J, rows * n * sizeof *J);
    message_add(errand->out, t.R + (rows - 1) * rows, rows * sizeof *t.R);
    errand->n = rows;
    free(J);
    triangle_free(&t);
    return status;
}

static enum bf_status tell_coloured(struct fit_share *share, struct errand *errand, struct bf_error *err)
{
    struct fit_work *w = &share->work;
    struct fit_problem *p = &w->problem;
    const size_t own = p->n_unknowns, n = errand->head.n_unknowns;
    struct interval_channel *channels = bf_alloc(p->n_channels, sizeof *channels);
    double *square = bf_alloc(own * own, sizeof *square), *out = bf_alloc(n * n, sizeof *out);
    fit_noise_models(p, channels);
    const enum bf_status status = fit_coloured_square(p, w->x, channels, p->n_channels, square, err);
    for (size_t i = 0; i < own; i++)
        for (size_t j = 0; j < own; j++) {
            const size_t k = asked(errand, p->unknowns[i].ref), l = asked(errand, p->unknowns[j].ref);
            if (k < n && l < n)
                out[k + l * n] = factor(w, errand, i, k) * factor(w, errand, j, l) * square[i + j * own];
        }
    message_add(errand->out, out, n * n * sizeof *out);
    free(channels), free(square), free(out);
    return status;
}

static void tell_errors(const struct fit_share *share, struct errand *errand)
{
    const struct fit_work *w = &share->work;
    const uint64_t n_records = w->n_records;
    struct fit_channel_error *errors = fit_channel_errors(&w->problem, w->noise, &errand->n);
    message_add(errand->out, &n_records, sizeof n_records);
    message_add(errand->out, w->problem.levels, w->n_records * sizeof *w->problem.levels);
    message_add(errand->out, errors, errand->n * sizeof *errors);
    free(errors);
}

static enum bf_status answer(struct fit_share *share, struct errand *errand, struct bf_error *err)
{
    struct fit_work *w = &share->work;
    struct fit_problem *p = &w->problem;
    const enum share_what what = errand->head.what;
    double square;
    if (what == SHARE_RECORDS)
        return tell_records(share, errand, err);
    set(w, errand);
    if (what == SHARE_STAGE) {
        p->latest_s = errand->head.latest_s;
        return fit_problem_stage(p, errand->head.decay_ps, errand->head.floor, w->x, err);
    }
    if (what == SHARE_REBASE)
        return fit_problem_rebase(p, w->x, err);
    enum bf_status status =
        fit_problem_evaluate(p, w->x, what == SHARE_DERIVATIVE || what == SHARE_COLOURED, &square, err);
    if (!status && what == SHARE_DERIVATIVE)
        status = tell_derivative(share, errand, err);
    if (!status && what == SHARE_COLOURED)
        status = tell_coloured(share, errand, err);
    if (!status && what == SHARE_ERRORS)
        tell_errors(share, errand);
    return status;
}

static enum bf_status read_question(const struct fit_message *question, struct errand *errand, struct bf_error *err)
{
    size_t at = 0;
    enum bf_status status = message_take(question, &at, &errand->head, sizeof errand->head, err);
    const size_t n = errand->head.n_unknowns, n_refs = errand->head.n_refs;
    errand->theta = bf_alloc(n_refs, sizeof *errand->theta);
    errand->slope = bf_alloc(n, sizeof *errand->slope), errand->ref = bf_alloc(n, sizeof *errand->ref);
    if (!status)
        status = message_take(question, &at, errand->theta, n_refs * sizeof *errand->theta, err);
    if (!status)
        status = message_take(question, &at, errand->slope, n * sizeof *errand->slope, err);
    return status ? status : message_take(question, &at, errand->ref, n * sizeof *errand->ref, err);
}

void fit_share_answer(struct fit_share *share, const struct fit_message *question, struct fit_message *out)
{
    const struct fit_problem *p = &share->work.problem;
    struct errand errand = {.out = out};
    struct share_answer head = {.status = BF_OK};
    struct bf_error err = {BF_OK, ""};
    *out = (struct fit_message){0};
    message_add(out, &head, sizeof head);
    head.status = read_question(question, &errand, &err);
    if (head.status == BF_OK)
        head.status = answer(share, &errand, &err);
    (void)snprintf(head.text, sizeof head.text, "%.259s", err.text);
    head.half_square = p->half_square, head.noise_rows = p->noise_rows;
    head.n_rows = p->n_rows, head.n_used = p->n_used, head.n_signals = p->n_channels, head.n_nuisance = p->n_nuisance;
    head.n = errand.n;
    memcpy(out->bytes, &head, sizeof head);
    fit_problem_rest(&share->work.problem);
    free(errand.theta), free(errand.slope), free(errand.ref);
}
