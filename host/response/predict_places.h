/* SPDX-License-Identifier: GPL-3.0-or-later */
/* predict_places.h — where effects act, as the prediction understands a model; for stages that deploy one. */
#ifndef BEAMFIT_PREDICT_PLACES_H
#define BEAMFIT_PREDICT_PLACES_H

#include "model/model.h"

/* Does effect e filter, bend or add to this output; does it act on this input or shift it? (predict_channel.c) */
bool effect_on_output(const struct model *model, size_t e, size_t output);
bool effect_on_input(const struct model *model, size_t e, size_t input);

/*
 * Patch regions and patch channels of `fixed` moved by shift_m; *out is a copy of it whose places are overwritten.
 * BF_BAD_FILE without a patch, BF_NUMERIC when a region would vanish. (predict_patch.c)
 */
enum bf_status model_shift_patch(const struct model *fixed, double shift_m, struct model *out, struct bf_error *err);

#endif
