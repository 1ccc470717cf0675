/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_linear_part.h — a hypothesis with laws as a linear model, for scores; private to explain/. */
#ifndef BEAMFIT_DIAGNOSE_LINEAR_PART_H
#define BEAMFIT_DIAGNOSE_LINEAR_PART_H

#include "diagnose_state.h"

/* The model without its laws, and the records less what the laws add to the response. */
struct linear_part {
    struct model model;
    size_t n_records;
    struct record *records;
};
enum bf_status linear_part_new(const struct diagnose_state *w, const struct hypothesis *h, struct linear_part *out,
                               struct bf_error *err);
void linear_part_free(struct linear_part *linear_part);

#endif
