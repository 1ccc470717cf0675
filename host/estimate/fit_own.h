/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * fit_own.h — values that belong to one record alone (BEAM_PARAMETER_PER_RECORD: a hum's phase, where the hammer
 * struck) for records that were not fitted: without them a held-out record cannot be judged.
 */
#ifndef BEAMFIT_FIT_OWN_H
#define BEAMFIT_FIT_OWN_H

#include "fit.h"

struct own_values {
    const struct model *model; /* the model given, or the copy that holds the estimates too */
    struct model *copy;        /* NULL: nothing was missing */
    size_t n_notes;
    char **notes; /* one sentence per estimate, without its full stop */
};

/*
 * Estimates, by least squares on each record alone with every other parameter held, the per-record parameters of which
 * the model has no value for that record. Parameters held in the model, and those that the record does not determine,
 * stay. The model is not changed and must outlive *out. Free with own_values_free(), also after a failure.
 * Cost: three short fits in few unknowns per record; nothing when no value is missing.
 */
enum bf_status own_values_find(const struct model *model, const struct record records[], size_t n_records,
                               const struct fit_options *options, struct own_values *out, struct bf_error *err);
void own_values_free(struct own_values *own);

#endif
