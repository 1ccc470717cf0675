/* SPDX-License-Identifier: GPL-3.0-or-later */
/* add_effect.h — an effect added to a model, or refused with the model left as it was. */
#ifndef BEAMFIT_ADD_EFFECT_H
#define BEAMFIT_ADD_EFFECT_H

#include "model/model.h"

/* channel "": the effect's default channels. BF_USAGE: no such effect, or a model with it has a fault. */
static inline enum bf_status add_effect(struct model *model, const char *id, const char *channel, struct bf_error *err)
{
    struct model trial;
    enum bf_status status = model_copy(model, &trial, err);
    if (status == BF_OK)
        status = model_append_effect(&trial, id, channel, err);
    if (status == BF_OK && model_check(&trial, err) != BF_OK)
        status = err->status = BF_USAGE;
    model_free(&trial);
    return status == BF_OK ? model_append_effect(model, id, channel, err) : status;
}

#endif
