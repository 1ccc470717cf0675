/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "estimate.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "ground/ground.h"
#include "score_refine.h"
#include "score_scan.h"

/* ---- From the best point to a score ---- */

static void sinusoid_start(const struct score_base *base, const struct candidate *c, const struct answer *a,
                           struct score *out)
{
    double square = 0.0;
    out->per_record = bf_alloc(base->n_records, sizeof *out->per_record);
    for (size_t r = 0; r < base->n_records; r++) {
        double sine = 0.0, cosine = 0.0;
        for (size_t j = 0; j < a->n; j++)
            if (a->what[j].slot >= 0 && a->what[j].record == (int)r)
                *(a->what[j].turned ? &cosine : &sine) = a->delta[j];
        square += sine * sine + cosine * cosine;
        out->per_record[r] = atan2(cosine, sine); /* A sin(ωt + φ) = A cos φ sin ωt + A sin φ cos ωt */
    }
    out->estimate = sqrt(square / (double)base->n_records);
    out->estimate_sd = (double)NAN;
    out->p[c->strength] = out->estimate;
}

static void start_values(const struct probe *probe, const struct answer *a, struct score *out)
{
    const struct candidate *c = probe->candidate;
    const struct score_base *base = probe->base;
    memcpy(out->p, a->p, sizeof out->p);
    out->estimate_sd = (double)NAN;
    if (candidate_is_sinusoid(c)) {
        sinusoid_start(base, c, a, out);
        return;
    }
    for (size_t j = 0; j < a->n; j++) {
        const struct probe_column *what = &a->what[j];
        double value = a->delta[j];
        if (what->slot < 0)
            continue;
        if (what->record >= 0) {
            if (!out->per_record)
                out->per_record = bf_alloc(base->n_records, sizeof *out->per_record);
            out->per_record[what->record] = fmin(fmax(value, c->lower[what->slot]), c->upper[what->slot]);
        }
        if (c->role[what->slot] == CANDIDATE_INVERSE)
            value = value > 0.0 ? a->p[what->slot] / value : c->upper[what->slot];
        else if (candidate_is_finite(c, what->slot))
            value *= a->p[what->slot];
        out->p[what->slot] = value;
        if (what->slot == c->strength && what->record <= 0) {
            const double size = dense_norm(base->n_all, a->S + j * base->n_all);
            const double unit = candidate_is_finite(c, what->slot) ? a->p[what->slot] : 1.0;
            const bool inverse = c->role[what->slot] == CANDIDATE_INVERSE;
            out->estimate = inverse ? a->delta[j] / unit : a->delta[j] * unit;
            out->estimate_sd = size > 0.0 ? (inverse ? 1.0 / unit : fabs(unit)) / size : (double)NAN;
        }
    }
}

static void into_range(const struct candidate *c, double p[])
{
    for (int i = 0; i < c->effect->n_parameters; i++) {
        const bool bad = !isfinite(p[i]) || (c->role[i] == CANDIDATE_STRENGTH && fabs(p[i]) == 0.0 && i == c->strength);
        p[i] = bad ? c->start[i] : fmin(fmax(p[i], c->lower[i]), c->upper[i]);
    }
}

/* Strengths that are not held at 0; one_sided: the only one cannot have the other sign. */
static int degrees(const struct probe *probe, const struct answer *a, bool *one_sided)
{
    size_t strengths = 0, moving = 0, limited = 0;
    double low = -INFINITY, high = INFINITY;
    for (size_t j = 0; j < a->n; j++) {
        limited += a->what[j].slot < 0 && !a->held[j];
        if (a->what[j].slot < 0)
            continue;
        strengths++;
        moving += fabs(a->delta[j]) > 0.0;
        answer_range(probe, &a->what[j], a->p, &low, &high);
    }
    *one_sided = strengths == 1 && (fabs(low) == 0.0 || fabs(high) == 0.0);
    const size_t most = a->rank > limited ? a->rank - limited : 0;
    return (int)(moving < most || most == 0 ? moving : most);
}

static void fill_score(const struct probe *probe, const struct answer *a, struct score *out)
{
    const struct score_base *base = probe->base;
    start_values(probe, a, out);
    into_range(probe->candidate, out->p);
    double rows, misfit = score_base_misfit(base, &rows);
    out->possible = true;
    out->LM = a->LM;
    bool one_sided;
    out->dof = degrees(probe, a, &one_sided);
    out->n_tried = probe->n_points;
    const double spread = fmax(1.0, (misfit - a->LM) / fmax(rows - (double)a->rank, 1.0));
    const double tail = out->dof > 0 ? chi_square_tail(a->LM / spread, (double)out->dof) : 1.0;
    out->p_value = fmin(1.0, (double)out->n_tried * (one_sided && out->dof > 0 ? 0.5 : 1.0) * tail);
    const double excess = misfit - rows;
    out->explained = excess > 2.0 * sqrt(2.0 * rows) ? fmin(fmax(a->LM / excess, 0.0), 1.0) : 0.0;
}

static void refuse(struct score *out, const char *reason)
{
    out->possible = false;
    (void)snprintf(out->reason, sizeof out->reason, "%.*s", CANDIDATE_REASON - 1, reason);
}

static void score_one(const struct score_base *base, const struct candidate *c, struct score *out)
{
    *out = (struct score){.chi_square = NAN, .estimate_sd = NAN};
    if (c->nonlinear && c->effect->law && !base->options.laws) {
        refuse(out, "its force is a law: tried along the measured motion instead");
        return;
    }
    struct probe probe;
    struct bf_error err;
    struct answer now = {0}, best = {0};
    enum bf_status status = probe_new(base, c, &probe, &err);
    if (!status) {
        answer_new(&probe, &now);
        answer_new(&probe, &best);
        status = probe_scan(&probe, &now, &best, &err);
    }
    if (status)
        refuse(out, err.text);
    else if (best.n == 0 || best.LM < 0.0)
        refuse(out, "no point of its scan has a value");
    else
        fill_score(&probe, &best, out);
    answer_free(&now), answer_free(&best);
    probe_free(&probe);
}

/* ---- All candidates, on several threads ---- */

struct queue {
    const struct score_base *base;
    const struct candidate *candidates;
    struct score *scores;
    const size_t *order; /* [n] which; NULL: all in turn */
    int steps;           /* of the refinement; −1: score */
    size_t n;
    atomic_size_t next;
    struct lowest_misfit lowest;
};

static bool interrupted(const struct score_base *base)
{
    return progress_interrupted() || (base->options.interrupted && base->options.interrupted(base->options.context));
}

static void work_on(struct queue *queue, size_t i)
{
    struct score *score = &queue->scores[i];
    const bool stop = interrupted(queue->base);
    if (queue->steps >= 0) {
        struct bf_error err;
        if (!stop) /* without a value there is nothing to refine: `refined` stays false */
            (void)score_descend(queue->base, &queue->candidates[i], queue->steps, &queue->lowest, score, &err);
    } else if (stop) {
        *score = (struct score){.chi_square = (double)NAN, .estimate_sd = (double)NAN};
        refuse(score, "interrupted");
    } else {
        score_one(queue->base, &queue->candidates[i], score);
    }
}

static void *work(void *argument)
{
    struct queue *queue = argument;
    size_t k;
    while ((k = atomic_fetch_add(&queue->next, 1)) < queue->n)
        work_on(queue, queue->order ? queue->order[k] : k);
    return NULL;
}

static void run_queue(struct queue *queue)
{
    lowest_begin(&queue->lowest);
    workers_run(queue->base->options.threads, queue->n, work, queue);
    lowest_end(&queue->lowest);
}

void score_run(const struct score_base *base, const struct candidate candidates[], size_t n, struct score scores[])
{
    struct queue queue = {.base = base, .candidates = candidates, .scores = scores, .steps = -1, .n = n};
    run_queue(&queue);
}

void score_refine_all(const struct score_base *base, const struct candidate candidates[], struct score scores[],
                      const size_t order[], size_t n, int steps)
{
    struct queue queue = {.base = base,
                          .candidates = candidates,
                          .scores = scores,
                          .order = order,
                          .steps = steps > 0 ? steps : 0,
                          .n = n};
    run_queue(&queue);
}

void score_free(struct score *score)
{
    free(score->per_record), free(score->theta);
    *score = (struct score){0};
}

/* ---- Ranking ---- */

static bool before(const struct candidate candidates[], const struct score scores[], size_t i, size_t j)
{
    static const double equal = 1e-3; /* of the larger LM */
    const double difference = scores[i].LM - scores[j].LM;
    if (fabs(difference) > equal * fmax(scores[i].LM, scores[j].LM))
        return difference > 0.0;
    return candidates[i].effect->n_parameters < candidates[j].effect->n_parameters;
}

size_t score_rank(const struct candidate candidates[], const struct score scores[], size_t n, size_t order[])
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        if (!scores[i].possible)
            continue;
        size_t at = count++;
        while (at > 0 && before(candidates, scores, i, order[at - 1])) {
            order[at] = order[at - 1];
            at--;
        }
        order[at] = i;
    }
    return count;
}
