/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

const double diagnose_at_noise = 1.025;
/*
 * Candidates whose score or trial has a p-value above this are not refitted. The limit is generous because an
 * omission is final. For scores it holds only near the noise; above, the first order means little (a
 * baseline that compensates for an effect can turn its sign), and the refinement decides.
 */
const double shortlist_highest_p = 0.05;
/* Best first-order scores that are refined; those that are too where they take this part of what the best takes. */
enum { REFINED = 5, ALSO_REFINED = 10 };
static const double also_refined = 0.3;

bool diagnose_linear_is_out(const struct diagnosis *d)
{
    return d->linearity.verdict == LINEARITY_NONLINEAR && d->attainable.modes > 0 &&
           diagnose_floor(d) > search_limits.far;
}

double shortlist_left(const struct shortlist *s, size_t i)
{
    const struct score *score = &s->scores[i];
    const double rows = (double)s->from->fit.n_rows;
    if (score->refined && isfinite(score->chi_square))
        return sqrt(score->chi_square / rows);
    double freedom;
    return sqrt(fmax(score_base_misfit(s->base, &freedom) - score->LM, rows) / rows);
}

static int by_left(const void *a, const void *b, void *context)
{
    const struct shortlist *s = context;
    const double x = shortlist_left(s, *(const size_t *)a), y = shortlist_left(s, *(const size_t *)b);
    return (x > y) - (x < y);
}

static size_t keep_likely(const struct score scores[], size_t order[], size_t n)
{
    size_t kept = 0;
    for (size_t k = 0; k < n; k++)
        if (scores[order[k]].p_value <= shortlist_highest_p)
            order[kept++] = order[k];
    return kept;
}

static size_t keep_near_modes(const struct diagnose_state *w, const struct candidate candidates[], size_t order[],
                              size_t n)
{
    size_t kept = 0;
    for (size_t k = 0; k < n; k++)
        if (!diagnose_modes_rule_out(w, candidates[order[k]].effect))
            order[kept++] = order[k];
    return kept;
}

/* The candidates of one kind with their scores, as score_run() takes them. */
struct of_kind {
    size_t n;
    struct candidate *candidates;
    struct score *scores;
    size_t *at; /* [n] index into the list */
};

static struct of_kind take_kind(const struct shortlist *s, enum effect_kind kind)
{
    struct of_kind some = {.candidates = bf_alloc(s->list.n + 1, sizeof *some.candidates),
                           .scores = bf_alloc(s->list.n + 1, sizeof *some.scores),
                           .at = bf_alloc(s->list.n + 1, sizeof *some.at)};
    for (size_t i = 0; i < s->list.n; i++)
        if (effect_kind(s->list.candidates[i].effect) == kind) {
            some.at[some.n] = i;
            some.scores[some.n] = s->scores[i];
            some.candidates[some.n++] = s->list.candidates[i];
        }
    return some;
}

/* scores[] of the list stays in the list's order. */
static void give_back(struct shortlist *s, struct of_kind *some)
{
    for (size_t i = 0; i < some->n; i++)
        s->scores[some->at[i]] = some->scores[i];
    free(some->candidates), free(some->scores), free(some->at);
}

static void score_kind(struct shortlist *s, enum effect_kind kind)
{
    struct of_kind some = take_kind(s, kind);
    size_t *order = bf_alloc(some.n + 1, sizeof *order);
    score_run(s->base, some.candidates, some.n, some.scores);
    size_t ranked = score_rank(some.candidates, some.scores, some.n, order);
    if (s->from->fitted.noise_ratio < search_limits.more)
        ranked = keep_likely(some.scores, order, ranked);
    if (s->n_effects == 1)
        ranked = keep_near_modes(s->w, some.candidates, order, ranked);
    for (size_t i = 0; i < some.n; i++)
        s->w->n_tried += some.scores[i].n_tried;
    for (size_t k = 0; k < ranked; k++)
        s->order[kind][k] = some.at[order[k]];
    s->n_order[kind] = ranked;
    give_back(s, &some);
    free(order);
}

/*
 * The first order is local: at a baseline that has bent to stand in for an effect, that effect may promise half of what others do. So all that promise a
 * comparable part are refined.
 */
static size_t n_refined(const struct shortlist *s, enum effect_kind kind)
{
    const size_t *order = s->order[kind], most = s->n_order[kind] < ALSO_REFINED ? s->n_order[kind] : ALSO_REFINED;
    double freedom;
    const double above = score_base_misfit(s->base, &freedom) - (double)s->from->fit.n_rows;
    /* a single linear effect's sign may be turned; what bends has one sign */
    const double least = s->n_effects > 1 || kind == KIND_NONLINEAR_CHAIN ? search_limits.hundredth * above : 0.0;
    size_t n = 0;
    while (n < most && s->scores[order[n]].LM >= least &&
           (n < REFINED || s->scores[order[n]].LM >= also_refined * s->scores[order[0]].LM))
        n++;
    return n;
}

enum bf_status shortlist_refine(struct shortlist *s, enum effect_kind kind, struct bf_error *err)
{
    const enum bf_status status = shortlist_score(s, kind, err);
    if (status || s->refined[kind])
        return status;
    const size_t n = n_refined(s, kind);
    score_refine_all(s->base, s->list.candidates, s->scores, s->order[kind], n, 0);
    qsort_r(s->order[kind], n, sizeof(size_t), by_left, s);
    s->refined[kind] = true;
    return BF_OK;
}

/* The model has an effect of this kind or of a costlier one. */
bool shortlist_reaches(const struct model *model, enum effect_kind kind)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (effect_kind(model->effects[e].effect) >= kind)
            return true;
    return false;
}

enum bf_status shortlist_score(struct shortlist *s, enum effect_kind kind, struct bf_error *err)
{
    struct diagnose_state *w = s->w;
    if (s->order[kind] != NULL)
        return BF_OK;
    if (s->base == NULL) {
        const struct score_options options = {.sigma = w->sigma,
                                              .threads = w->threads,
                                              .stop_at_noise = diagnose_is_far(&w->d->baseline),
                                              .predict = w->options->predict};
        enum bf_status status = BF_OK;
        s->has_law = shortlist_reaches(&s->from->model, KIND_LAW);
        if (s->has_law)
            status = linear_part_new(w, s->from, &s->linear_part, err);
        if (!status)
            status = score_base_new(s->has_law ? &s->linear_part.model : &s->from->model,
                                    s->has_law ? s->linear_part.records : w->d->records, w->d->n_records, &options,
                                    &s->base, err);
        if (status)
            return status;
        s->scores = bf_alloc(s->list.n, sizeof *s->scores);
    }
    s->order[kind] = bf_alloc(s->list.n, sizeof(size_t));
    score_kind(s, kind);
    return BF_OK;
}

bool diagnose_leaves_out(const struct diagnose_state *w, const struct beam_effect *effect)
{
    for (size_t i = 0; i < w->options->n_without; i++)
        if (strcmp(w->options->without[i], effect->id) == 0)
            return true;
    return false;
}

/* ---- Jobs ---- */

/*
 * After its few steps it is not far from the best, and takes half of what that takes: a ratio of rms values means little on a weak misfit. left, best: rms in units of the noise.
 */
bool shortlist_is_worth_refit(const struct shortlist *s, double left, double best)
{
    const double before = s->from->fitted.noise_ratio;
    return left <= search_limits.far * best &&
           left * left <= best * best + (1.0 - search_limits.half) * fmax(before * before - best * best, 0.0);
}

void shortlist_push(struct refit_job **jobs, size_t *n, const struct refit_job *job)
{
    *jobs = bf_grow(*jobs, *n + 1, sizeof **jobs);
    (*jobs)[(*n)++] = *job;
}

enum bf_status shortlist_job(const struct shortlist *s, size_t i, struct refit_job *job, struct bf_error *err)
{
    *job = (struct refit_job){.n_effects = s->n_effects, .n_tried = s->w->n_tried};
    const enum bf_status status = score_model(s->base, &s->list.candidates[i], &s->scores[i], &job->model, err);
    job->first_new = job->model.n_effects;
    return status;
}

enum bf_status shortlist_job_of(const struct shortlist *s, const struct candidate *candidate, const double p[],
                                struct refit_job *job, struct bf_error *err)
{
    *job =
        (struct refit_job){.n_effects = s->n_effects, .n_tried = s->w->n_tried, .first_new = s->from->model.n_effects};
    return candidate_model(&s->from->model, candidate, p, &job->model, err);
}

/* The score's start on a hypothesis with laws: all but the laws' own parameters as the score ended. */
static enum bf_status job_on_law(const struct shortlist *s, size_t i, struct refit_job *job, struct bf_error *err)
{
    struct model linear_part;
    enum bf_status status = shortlist_job_of(s, &s->list.candidates[i], s->scores[i].p, job, err);
    if (status)
        return status;
    status = score_model(s->base, &s->list.candidates[i], &s->scores[i], &linear_part, err);
    if (status) {
        model_free(&job->model);
        return status;
    }
    for (size_t m = 0; m < linear_part.n_materials; m++) {
        job->model.materials[m].EI.value = linear_part.materials[m].EI.value;
        job->model.materials[m].rho.value = linear_part.materials[m].rho.value;
        job->model.materials[m].cDI.value = linear_part.materials[m].cDI.value;
    }
    job->model.gamma.value = linear_part.gamma.value;
    job->model.Ks.value = linear_part.Ks.value;
    job->model.KB.value = linear_part.KB.value;
    job->first_new = job->model.n_effects;
    model_free(&linear_part);
    return BF_OK;
}

/* Every candidate of a kind from the catalogue's start, in its own time. */
static void choose_all(struct shortlist *s, enum effect_kind kind, struct refit_job **jobs, size_t *n)
{
    struct bf_error err;
    struct refit_job job;
    for (size_t i = 0; i < s->list.n; i++)
        if (effect_kind(s->list.candidates[i].effect) == kind &&
            shortlist_job_of(s, &s->list.candidates[i], s->list.candidates[i].start, &job, &err) == BF_OK)
            shortlist_push(jobs, n, &job);
}

void shortlist_choose(struct shortlist *s, enum effect_kind kind, size_t most, double best, struct refit_job **jobs,
                      size_t *n)
{
    struct bf_error err;
    struct refit_job job;
    if (s->w->options->everything) {
        choose_all(s, kind, jobs, n);
        return;
    }
    for (; s->looked[kind] < s->n_order[kind] && most > 0; s->looked[kind]++) {
        const size_t i = s->order[kind][s->looked[kind]];
        const bool promises = kind == KIND_LINEAR || s->scores[i].refined;
        const bool root =
            s->n_effects == 1 && s->looked[kind] == 0 && promises; /* of a pair, should no effect do alone */
        if (!root && !shortlist_is_worth_refit(s, shortlist_left(s, i), best))
            continue;
        if ((s->has_law ? job_on_law(s, i, &job, &err) : shortlist_job(s, i, &job, &err)) != BF_OK)
            continue;
        job.to_the_end = root;
        shortlist_push(jobs, n, &job);
        most--;
    }
}

/* ---- Begin and end ---- */

/* Where a hum or a shaking clamp may be: lines that the test of linearity has found, then those of what the hypothesis leaves. Returns how many. */
static size_t find_lines(const struct diagnosis *d, const struct hypothesis *from, size_t most, double lines_Hz[])
{
    struct misfit_channel *misfit = hypothesis_channels(d, from);
    struct residual_channel *left = bf_alloc(from->fit.n_channels + 1, sizeof *left);
    struct bf_error ignored;
    size_t n = 0, n_left = 0, more = 0;
    for (size_t i = 0; i < d->linearity.n_added && n < most; i++)
        if (d->linearity.added[i].frequency_Hz > 0.0)
            lines_Hz[n++] = d->linearity.added[i].frequency_Hz;
    for (size_t c = 0; c < from->fit.n_channels; c++)
        if (misfit[c].n > 1 && misfit[c].noise->rms > 0.0)
            left[n_left++] = (struct residual_channel){
                .r = misfit[c].residual, .n = misfit[c].n, .dt_s = misfit[c].dt_s, .scale = misfit[c].noise->rms};
    if (residual_lines(left, n_left, 0.0, INFINITY, most - n, lines_Hz + n, &more, &ignored) != BF_OK)
        more = 0;
    free(misfit), free(left);
    return n + more;
}

enum bf_status shortlist_new(struct diagnose_state *w, const struct hypothesis *from, struct shortlist **out,
                             struct bf_error *err)
{
    struct shortlist *s = *out = w->looked;
    w->looked = NULL;
    if (s != NULL && s->from == from)
        return BF_OK;
    shortlist_free(s);
    s = *out = bf_alloc(1, sizeof *s);
    enum { MOST_LINES = 8 };
    double lines[MOST_LINES];
    const size_t n_lines = find_lines(w->d, from, MOST_LINES, lines);
    const struct candidate_options options = {.without = w->options->without,
                                              .n_without = w->options->n_without,
                                              .line_Hz = lines,
                                              .n_lines = n_lines,
                                              .each_channel = true};
    *s = (struct shortlist){.w = w, .from = from, .n_effects = from->n_effects + 1};
    s->linear = diagnose_is_far(from) && diagnose_is_taken_for_linear(w->d);
    return candidate_list_new(&from->model, w->d->records, w->d->n_records, &options, &s->list, err);
}

void shortlist_free(struct shortlist *s)
{
    if (s == NULL)
        return;
    for (size_t i = 0; s->scores && i < s->list.n; i++)
        score_free(&s->scores[i]);
    for (size_t i = 0; i < s->n_trials; i++)
        trial_free(&s->trials[i]);
    free(s->scores), free(s->order[0]), free(s->order[1]), free(s->trials);
    if (s->base)
        score_base_free(s->base);
    if (s->has_law)
        linear_part_free(&s->linear_part);
    candidate_list_free(&s->list);
    free(s);
}
