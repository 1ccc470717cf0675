/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_shares.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fit_message.h"
#include "fit_triangle.h"
#include "maths/maths.h"

/* What every share says. */
struct answers {
    size_t n;
    struct fit_message *message; /* [n] */
    size_t *at;                  /* [n] what was read of it */
    struct share_answer *head;   /* [n] */
};

static void answers_free(struct answers *a)
{
    for (size_t s = 0; s < a->n; s++)
        free(a->message[s].bytes);
    free(a->message), free(a->at), free(a->head);
    *a = (struct answers){0};
}

static enum bf_status next(struct answers *a, size_t s, void *bytes, size_t n, struct bf_error *err)
{
    return message_take(&a->message[s], &a->at[s], bytes, n, err);
}

/* The first share that failed, in their order, is the failure. */
static enum bf_status ask(const struct fit_shares *shares, const struct fit_message *question, struct answers *a,
                          struct bf_error *err)
{
    *a = (struct answers){.n = shares->n,
                          .message = bf_alloc(shares->n, sizeof *a->message),
                          .at = bf_alloc(shares->n, sizeof *a->at),
                          .head = bf_alloc(shares->n, sizeof *a->head)};
    enum bf_status status = shares->ask(shares->context, question, a->message, err);
    for (size_t s = 0; s < a->n && !status; s++) {
        status = next(a, s, &a->head[s], sizeof a->head[s], err);
        if (!status && a->head[s].status != BF_OK)
            status = bf_fail(err, a->head[s].status, "%.259s", a->head[s].text);
    }
    if (status)
        answers_free(a);
    return status;
}

/* x NULL: nothing moves. */
static enum bf_status ask_at(const struct fit_problem *p, enum share_what what, const double theta[], const double x[],
                             struct answers *a, struct bf_error *err)
{
    const size_t n = x != NULL ? p->n_unknowns : 0;
    const struct share_question head = {.what = what,
                                        .decay_ps = p->decay_ps,
                                        .floor = p->floor,
                                        .latest_s = p->latest_s,
                                        .n_refs = p->n_refs,
                                        .n_unknowns = n};
    struct fit_message question = {0};
    message_add(&question, &head, sizeof head);
    message_add(&question, theta, p->n_refs * sizeof *theta);
    for (size_t i = 0; i < n; i++) {
        const double slope = p->held[i] ? 0.0 : fit_problem_slope(p, i, x);
        message_add(&question, &slope, sizeof slope);
    }
    for (size_t i = 0; i < n; i++)
        message_add(&question, &p->unknowns[i].ref, sizeof p->unknowns[i].ref);
    const enum bf_status status = ask(p->shares, &question, a, err);
    free(question.bytes);
    return status;
}

/* ---- Records ---- */

static enum bf_status take_records(struct fit_shares *shares, struct answers *a, size_t s, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < a->head[s].n && !status; k++) {
        struct share_record from;
        status = next(a, s, &from, sizeof from, err);
        if (status)
            break;
        const size_t r = shares->n_records++;
        shares->records = bf_grow(shares->records, r + 1, sizeof *shares->records);
        shares->drives = bf_grow(shares->drives, r + 1, sizeof *shares->drives);
        shares->records[r] =
            (struct record){.path = bf_strdup(from.path), .n = from.n, .t0_s = from.t0_s, .dt_s = from.dt_s};
        memcpy(shares->records[r].sha256, from.sha256, sizeof shares->records[r].sha256);
        shares->drives[r] = from.drive;
    }
    return status;
}

/* As one record of all would have it: 1/scale² is the mean over channels. */
static enum bf_status take_scales(struct fit_shares *shares, struct answers *a, size_t n_refs, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    double *scale = bf_alloc(n_refs + 1, sizeof *scale), *weight = bf_alloc(n_refs + 1, sizeof *weight);
    for (size_t s = 0; s < a->n && !status; s++) {
        status = next(a, s, scale, n_refs * sizeof *scale, err);
        for (size_t i = 0; i < n_refs && !status; i++) {
            const double channels = scale[i] > 0.0 ? (double)a->head[s].n_signals : 0.0;
            weight[i] += channels;
            shares->scale[i] += scale[i] > 0.0 ? channels / (scale[i] * scale[i]) : 0.0;
        }
    }
    for (size_t i = 0; i < n_refs; i++)
        shares->scale[i] = weight[i] > 0.0 ? sqrt(weight[i] / shares->scale[i]) : 0.0;
    free(scale), free(weight);
    return status;
}

enum bf_status fit_shares_open(struct fit_shares *shares, const struct model *model, struct bf_error *err)
{
    struct answers a;
    struct parameter_ref *refs;
    struct fit_message question = {0};
    const size_t n_refs = model_parameters(model, NULL, 0, &refs);
    const struct share_question head = {.what = SHARE_RECORDS, .n_refs = n_refs};
    shares->scale = bf_alloc(n_refs + 1, sizeof *shares->scale);
    message_add(&question, &head, sizeof head);
    for (size_t i = 0; i < n_refs; i++)
        message_add(&question, &refs[i].value, sizeof refs[i].value);
    enum bf_status status = ask(shares, &question, &a, err);
    free(question.bytes), free(refs);
    if (status)
        return status;
    for (size_t s = 0; s < a.n && !status; s++)
        status = take_records(shares, &a, s, err);
    if (!status)
        status = take_scales(shares, &a, n_refs, err);
    answers_free(&a);
    return status;
}

void fit_shares_close(struct fit_shares *shares)
{
    for (size_t r = 0; r < shares->n_records; r++)
        record_free(&shares->records[r]);
    free(shares->records), free(shares->drives), free(shares->scale);
    shares->records = NULL, shares->drives = NULL, shares->scale = NULL;
    shares->n_records = 0;
}

/* ---- The problem ---- */

enum bf_status shares_rebase(struct fit_problem *p, const double theta[], bool stage, struct bf_error *err)
{
    struct answers a;
    const enum bf_status status = ask_at(p, stage ? SHARE_STAGE : SHARE_REBASE, theta, NULL, &a, err);
    if (status)
        return status;
    p->n_rows = p->n_used = p->n_signals = p->n_nuisance = 0, p->noise_rows = 0.0;
    for (size_t s = 0; s < a.n; s++) {
        const struct share_answer *head = &a.head[s];
        p->n_rows += head->n_rows, p->n_used += head->n_used, p->n_signals += head->n_signals;
        p->noise_rows += head->noise_rows;
    }
    p->n_sample_rows = p->n_rows;
    answers_free(&a);
    return BF_OK;
}

/* The share's rows below those of the shares before. */
static enum bf_status add_rows(struct triangle *t, struct answers *a, size_t s, struct bf_error *err)
{
    const size_t rows = a->head[s].n, n = t->n - 1;
    double *J = bf_alloc(rows * n, sizeof *J), *r = bf_alloc(rows, sizeof *r);
    enum bf_status status = next(a, s, J, rows * n * sizeof *J, err);
    if (!status)
        status = next(a, s, r, rows * sizeof *r, err);
    if (!status)
        status = triangle_add(t, rows, rows, J, r, err);
    free(J), free(r);
    return status;
}

enum bf_status shares_evaluate(struct fit_problem *p, const double x[], bool with_jacobian, struct bf_error *err)
{
    struct answers a;
    enum bf_status status = ask_at(p, with_jacobian ? SHARE_DERIVATIVE : SHARE_VALUE, p->theta, x, &a, err);
    p->runs++;
    if (status)
        return status;
    struct triangle t = triangle_new(p->n_unknowns);
    p->half_square = 0.0, p->n_nuisance = 0;
    for (size_t s = 0; s < a.n && !status; s++) {
        p->half_square += a.head[s].half_square;
        p->n_nuisance += a.head[s].n_nuisance;
        if (with_jacobian)
            status = add_rows(&t, &a, s, err);
    }
    if (with_jacobian && !status)
        triangle_into(&t, p->n_jacobian, p->jacobian, p->beside);
    triangle_free(&t);
    answers_free(&a);
    return status;
}

enum bf_status shares_coloured(const struct fit_problem *p, const double x[], double square[], struct bf_error *err)
{
    const size_t n = p->n_unknowns * p->n_unknowns;
    struct answers a;
    enum bf_status status = ask_at(p, SHARE_COLOURED, p->theta, x, &a, err);
    if (status)
        return status;
    double *one = bf_alloc(n, sizeof *one);
    for (size_t s = 0; s < a.n && !status; s++) {
        status = next(&a, s, one, n * sizeof *one, err);
        for (size_t i = 0; i < n && !status; i++)
            square[i] += one[i];
    }
    free(one);
    answers_free(&a);
    return status;
}

struct fit_channel_error *shares_errors(const struct fit_problem *p, size_t *n)
{
    struct answers a;
    struct bf_error err;
    struct fit_channel_error *errors = NULL;
    size_t first = 0; /* record of the share */
    *n = 0;
    enum bf_status status = ask_at(p, SHARE_ERRORS, p->theta, NULL, &a, &err);
    if (status)
        return NULL;
    for (size_t s = 0; s < a.n && !status; s++) {
        uint64_t n_records;
        status = next(&a, s, &n_records, sizeof n_records, &err);
        if (!status && n_records <= p->n_records - first)
            status = next(&a, s, p->levels + first, n_records * sizeof *p->levels, &err);
        errors = bf_grow(errors, *n + a.head[s].n, sizeof *errors);
        if (!status)
            status = next(&a, s, errors + *n, a.head[s].n * sizeof *errors, &err);
        for (size_t c = 0; c < a.head[s].n && !status; c++)
            errors[(*n)++].record += first;
        first += n_records;
    }
    answers_free(&a);
    return errors;
}
