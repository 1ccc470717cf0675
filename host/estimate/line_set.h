/* SPDX-License-Identifier: GPL-3.0-or-later */
/* line_set.h — one record of line_rows.h; between line_rows.c and the file of each kind. */
#ifndef BEAMFIT_LINE_SET_H
#define BEAMFIT_LINE_SET_H

#include "line_rows.h"

struct line_set {
    const struct record *record;
    size_t index;       /* of the record */
    struct record made; /* what the predictor is given */
    struct predictor *predictor;
    size_t n_refs, *from; /* [n_refs] the predictor's parameters among those of the fit */
    size_t first_group, n_groups;
    /* a list */
    struct frequency_list list;
    size_t *mode; /* [list.n] of each frequency, 0 the lowest; SIZE_MAX: none */
};

struct line_group *line_group_add(struct line_rows *lines, const struct line_set *set, enum line_kind kind,
                                  const char *name);
/* The next row of the last group. scale: standard error of the logarithm. */
void line_row_add(struct line_rows *lines, double measured, double scale);

/* Each kind: the record for the predictor; groups and rows; pairs; residuals and derivatives at the predictor's last run. */
enum bf_status frequencies_make(struct line_set *set, const struct model *model, struct bf_error *err);
void frequencies_add(struct line_rows *lines, struct line_set *set);
enum bf_status magnitudes_make(struct line_set *set, const struct model *model, struct bf_error *err);
void magnitudes_add(struct line_rows *lines, struct line_set *set, const struct model *model);
void frequencies_pair(struct line_rows *lines, struct line_set *set);
void magnitudes_pair(struct line_rows *lines, const struct line_set *set);
/* BF_NUMERIC: a mode that a row belongs to does not oscillate any more. x[set->n_refs]: of the run. */
enum bf_status frequencies_fill(struct line_rows *lines, const struct line_set *set, const double x[],
                                const bool want[], struct bf_error *err);

/* y: of the run. */
enum bf_status magnitudes_fill(struct line_rows *lines, const struct line_set *set, const struct prediction *y,
                               const bool want[], struct bf_error *err);

#endif
