/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_private.h — private to model/: what its files share of model. */
#ifndef BEAMFIT_MODEL_PRIVATE_H
#define BEAMFIT_MODEL_PRIVATE_H

#include "model.h"

/* Adds an effect with neutral-near start values (parameters[].start of the catalogue). channel "" = default. */
enum bf_status model_add_effect(struct model *model, const char *id, const char *channel, struct bf_error *err);

/* Fills residuals[] for the model's channels, value 0, where the list is still empty. */
void model_make_residuals(struct model *model);

#endif
