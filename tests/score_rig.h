/* SPDX-License-Identifier: GPL-3.0-or-later */
/* score_rig.h — two hammer records of a beam that may have an effect, and the scores of candidates. Include after cmocka.h. */
#ifndef SCORE_RIG_H
#define SCORE_RIG_H

#include <stdlib.h>
#include <string.h>
#include "fit_rig.h"
#include "estimate/estimate.h"
#include "add_effect.h"

enum { RECORDS = 2, CHANNELS = 2 * RECORDS };

/* Two hammer records of a beam that may have an effect, and a baseline without it. */
struct rig {
    struct model model;
    struct record records[RECORDS];
    double sigma[CHANNELS];
    struct candidate_list list;
    struct score_base *base;
    struct score *scores;
};

static inline void rig_records(struct rig *r)
{
    memset(r, 0, sizeof *r);
    make_model(&truth, &r->model);
    make_record("a.csv", 0.05, 1.0, &r->records[0], r->sigma);
    make_record("b.csv", 0.1, 3.0, &r->records[1], r->sigma + 2);
}

/* The noise stays, the motion is that of the beam with the effect. */
static inline void rig_effect(struct rig *r, const char *id, const double p[], size_t n)
{
    struct bf_error err;
    const char *names[RECORDS] = {"a.csv", "b.csv"};
    struct prediction y;
    double *without = NULL;
    for (int with = 0; with < 2; with++) {
        struct model model;
        struct predictor *predictor;
        struct parameter_ref *refs;
        make_model(&truth, &model);
        if (with) {
            assert_int_equal(add_effect(&model, id, "", &err), BF_OK);
            for (size_t i = 0; i < n; i++)
                model.effects[0].parameters[i].value = p[i];
        }
        assert_int_equal(predictor_new(&model, r->records, RECORDS, NULL, &predictor, &err), BF_OK);
        const size_t n_refs = model_parameters(&model, names, RECORDS, &refs);
        double *theta = calloc(n_refs, sizeof *theta);
        for (size_t i = 0; i < n_refs; i++)
            theta[i] = refs[i].value;
        assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
        const struct predict_channel *channels;
        predictor_channels(predictor, &channels);
        for (size_t c = 0; c < CHANNELS; c++) {
            double *z = r->records[channels[c].record].columns[1 + c % 2].x;
            for (size_t k = 0; with && without && k < SAMPLES; k++)
                z[k] += y.y[channels[c].row + k] - without[channels[c].row + k];
        }
        if (!with) {
            without = calloc(y.n_rows, sizeof *without);
            memcpy(without, y.y, y.n_rows * sizeof *without);
        }
        free(theta), free(refs);
        predictor_free(predictor);
        model_free(&model);
    }
    free(without);
}

/* The baseline at its optimum: a score is a linearisation there. */
static inline void rig_fit(struct rig *r)
{
    struct bf_error err;
    struct fit_result fit;
    const struct fit_options options = {.quiet = true, .never_search = true, .sigma = r->sigma};
    assert_int_equal(fit_run(&r->model, r->records, RECORDS, &options, &fit, &err), BF_OK);
    fit_into_model(&fit, r->records, &(struct fit_check){0}, &r->model);
    fit_free(&fit);
}

static inline void rig_score(struct rig *r, const struct candidate_options *candidates)
{
    struct bf_error err;
    const struct score_options options = {.sigma = r->sigma, .threads = 2};
    assert_int_equal(candidate_list_new(&r->model, r->records, RECORDS, candidates, &r->list, &err), BF_OK);
    assert_int_equal(score_base_new(&r->model, r->records, RECORDS, &options, &r->base, &err), BF_OK);
    r->scores = calloc(r->list.n, sizeof *r->scores);
    score_run(r->base, r->list.candidates, r->list.n, r->scores);
}

static inline void rig_free(struct rig *r)
{
    for (size_t i = 0; i < r->list.n; i++)
        score_free(&r->scores[i]);
    free(r->scores);
    score_base_free(r->base);
    candidate_list_free(&r->list);
    for (size_t i = 0; i < RECORDS; i++)
        record_free(&r->records[i]);
    model_free(&r->model);
}

static inline size_t index_of(const struct rig *r, const char *id)
{
    for (size_t i = 0; i < r->list.n; i++)
        if (strcmp(r->list.candidates[i].effect->id, id) == 0)
            return i;
    fail_msg("no candidate %s", id);
    return 0;
}

static inline size_t best_of(const struct rig *r)
{
    size_t *order = calloc(r->list.n, sizeof *order);
    assert_true(score_rank(r->list.candidates, r->scores, r->list.n, order) > 0);
    const size_t best = order[0];
    free(order);
    return best;
}

#endif
