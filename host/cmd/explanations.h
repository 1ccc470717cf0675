/* SPDX-License-Identifier: GPL-3.0-or-later */
/* explanations.h — the models whose curves a page compares, each evaluated on the same records. */
#ifndef BEAMFIT_EXPLANATIONS_H
#define BEAMFIT_EXPLANATIONS_H

#include "explain/explain.h"
#include "show/show.h"

/* Starts empty ({0}). */
struct explanations {
    const struct record *records; /* [n_records], the last n_held_out of which are held out */
    size_t n_records, n_held_out;
    struct predict_options predict;
    size_t n, before, after;
    struct explanation *all; /* [n] */
    struct comparison **comparisons;
    char **names;
    int *hypothesis; /* [n] of the diagnosis; −1: none of its own */
};

/* records must outlive *out. */
void explanations_begin(struct explanations *out, const struct record records[], size_t n_records, size_t n_held_out,
                        const struct predict_options *predict);
/* One more, which is then `after`. model must outlive *e. Errors as compare_run(). */
enum bf_status explanations_add(struct explanations *e, const char *name, const struct model *model,
                                struct bf_error *err);
/*
 * The nearest ancestors of the model of history_of(), oldest first; those that cannot be evaluated on these records are left out. The nearest that
 * was fitted is then `before`.
 */
void explanations_add_ancestors(struct explanations *e, const struct history *history);
/* Its baseline and its best refitted hypotheses; `after` is the best one and `before` the baseline, when effects are named. */
void explanations_add_diagnosis(struct explanations *e, const struct diagnosis *diagnosis);

struct curves explanations_curves(const struct explanations *e, size_t most_channels);
void explanations_free(struct explanations *e);

#endif
