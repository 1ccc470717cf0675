/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_law.h"

#include <stdlib.h>
#include <string.h>
#include "estimate.h"
#include "refit_law.h"
#include "trial_roles.h"

static enum bf_status refit_baseline(const struct fit_problem *p, const struct predict_options *predict,
                                     const struct model *model, size_t e, double baseline[], struct bf_error *err)
{
    struct refit_result result;
    const struct refit_options options = {.sigma = p->sigma, .first_new = model->n_effects, .predict = *predict};
    const enum bf_status status = refit_run(model, p->records, p->n_records, &options, &result, err);
    for (size_t i = 0, next = 0; i < p->n_refs && !status; i++)
        if (p->refs[i].role != ROLE_EFFECT || p->refs[i].owner != e)
            baseline[i] = result.value[next++];
    refit_free(&result);
    return status;
}

enum bf_status fit_without_law(const struct fit_problem *p, const struct predict_options *predict,
                               const double theta0[], double baseline[], bool *possible, struct bf_error *err)
{
    const size_t e = law_only(p->model, 0);
    struct model model;
    *possible = false;
    memcpy(baseline, theta0, p->n_refs * sizeof *baseline);
    if (e == p->model->n_effects || !trial_possible(p->model->effects[e].effect))
        return BF_OK;
    enum bf_status status = law_drop(p, e, theta0, &model, err);
    if (!status) {
        status = refit_baseline(p, predict, &model, e, baseline, err);
        model_free(&model);
    }
    *possible = !status;
    return status == BF_NUMERIC ? BF_OK : status; /* the other starts remain */
}
