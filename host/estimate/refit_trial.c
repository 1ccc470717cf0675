/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A start of a nonlinear effect by equation error: trial_run(), along the motion that the recordings tell. */
#include <stdlib.h>
#include <string.h>
#include "estimate.h"
#include "refit_law.h"
#include "trial_roles.h"

size_t law_only(const struct model *model, size_t first_effect)
{
    size_t found = model->n_effects, laws = 0;
    for (size_t e = 0; e < model->n_effects; e++) {
        if (!model->effects[e].effect->law)
            continue;
        laws++;
        if (e >= first_effect)
            found = e;
    }
    return laws == 1 ? found : model->n_effects;
}

enum bf_status law_drop(const struct fit_problem *p, size_t e, const double theta[], struct model *out,
                        struct bf_error *err)
{
    const enum bf_status status = model_copy(p->model, out, err);
    if (status)
        return status;
    model_set_parameters(out, p->refs, p->n_refs, theta, NULL, p->names);
    free(out->effects[e].per_record);
    for (out->n_effects--; e < out->n_effects; e++)
        out->effects[e] = out->effects[e + 1];
    return BF_OK;
}

/* The parameters of the smaller model are those of the larger in the same order, without those of effect e. */
static void merge(const struct fit_problem *p, size_t e, const double small[], const double law[], double theta[])
{
    size_t next = 0;
    for (size_t i = 0; i < p->n_refs; i++) {
        const struct parameter_ref *ref = &p->refs[i];
        if (ref->role != ROLE_EFFECT || ref->owner != e)
            theta[i] = small[next++];
        else if (!ref->info->fixed)
            theta[i] = law[ref->slot];
    }
}

static enum bf_status try_law(const struct fit_problem *p, const struct predict_options *predict,
                              const struct model *model, size_t e, const double small[], double theta[], bool *possible,
                              struct bf_error *err)
{
    static const double floor = MOTION_FLOOR;
    const struct trial_options options = {.rounds = 3};
    struct predict_options silent = *predict;
    struct predictor *predictor = NULL;
    struct motion motion;
    struct trial trial;
    silent.quiet = true;
    enum bf_status status = predictor_new(model, p->records, p->n_records, &silent, &predictor, err);
    if (status)
        return status;
    status = motion_new(predictor, small, p->sigma, floor, &motion, err);
    if (!status) {
        status = trial_run(&motion, p->model->effects[e].effect, &options, &trial, err);
        if (!status) {
            *possible = trial.possible;
            if (trial.possible)
                merge(p, e, trial.theta, trial.p, theta);
            trial_free(&trial);
        }
        motion_free(&motion);
    }
    predictor_free(predictor);
    return status;
}

enum bf_status law_trial(const struct fit_problem *p, const struct predict_options *predict, size_t first_effect,
                         const double baseline[], const double theta0[], double theta[], bool *possible,
                         struct bf_error *err)
{
    const size_t e = law_only(p->model, first_effect);
    struct model model;
    *possible = false;
    if (e == p->model->n_effects || !trial_possible(p->model->effects[e].effect))
        return BF_OK;
    enum bf_status status = law_drop(p, e, theta0, &model, err);
    if (!status) {
        double *small = bf_alloc(p->n_refs, sizeof *small);
        size_t n = 0;
        for (size_t i = 0; i < p->n_refs; i++)
            if (p->refs[i].role != ROLE_EFFECT || p->refs[i].owner != e)
                small[n++] = baseline[i];
        memcpy(theta, theta0, p->n_refs * sizeof *theta);
        status = try_law(p, predict, &model, e, small, theta, possible, err);
        model_free(&model);
        free(small);
    }
    return status == BF_NUMERIC ? BF_OK : status; /* the other starts remain */
}
