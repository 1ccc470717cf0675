/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_parts.h — parts of a model as they begin, before a file or a fit gives them values. */
#ifndef BEAMFIT_MODEL_PARTS_H
#define BEAMFIT_MODEL_PARTS_H

#include "model.h"

/* An empty free parameter with its physical bounds: ≥ 0 unless it may be negative. */
void model_parameter_init(struct parameter *out, const char *name, const char *unit, bool may_be_negative);

/* Of a channel on a beam of this length: place held at 0, gain held at 1. */
void model_channel_init(struct channel_parameters *out, double length_m);

/* Catalogue entry of an effect's parameter as a parameter with default value, bounds and flags. */
void model_effect_parameter(const struct model *model, const struct beam_effect *effect, int slot,
                            struct parameter *out);

/* Fills residuals[] for the model's channels, value 0, where the list is still empty. */
void model_make_residuals(struct model *model);

/* Values and errors of the last fit do not describe a model that has gained or lost an effect; the line of descent stays. */
void model_forget_fit(struct model *model);

#endif
