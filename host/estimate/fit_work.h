/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fit_work.h — everything one fit owns while it runs; private to estimate/. */
#ifndef BEAMFIT_FIT_WORK_H
#define BEAMFIT_FIT_WORK_H

#include "estimate.h"
#include "fit_problem.h"

struct fit_work {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    const char **names;
    struct parameter_ref *refs;
    size_t n_refs;
    size_t n_sampled; /* the first records; the others are lists and spectra without phase */
    struct predictor *predictor;
    struct line_rows *lines;
    double *sigma;      /* [n_channels] weights */
    double *noise;      /* [n_channels] 0: unknown */
    double noise_doubt; /* see struct fit_result */
    struct fit_problem problem;
    double *x;
};

/* Posed, with x at the model's values. To be freed also after a failure. */
enum bf_status fit_work_new(struct fit_work *w, const struct model *model, const struct record records[],
                            size_t n_records, const struct fit_options *options, struct bf_error *err);
void fit_work_free(struct fit_work *w);

#endif
