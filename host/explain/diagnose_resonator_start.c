/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What swings by itself: where it can act, and a model in which it begins to. */
#include "diagnose_relatives.h"
#include "diagnose_resonator.h"

#include <math.h>

static const double begin_damping = 0.02; /* ratio */

bool resonator_can_act(const struct diagnose_state *w, const struct beam_effect *effect)
{
    const struct model *model = w->d->model;
    return effect_slot(effect, BEAM_ROLE_RESONANCE) >= 0 && !model_has_effect(model, effect) &&
           (!effect->releases_root || model_is_clamped(model)) && !diagnose_leaves_out(w, effect);
}

static double flexibility_radpNm(const struct model *model)
{
    return model->length_m / model->materials[model_plain_material(model)].EI.value;
}

double resonator_whole(const struct beam_effect *effect, const struct model *model)
{
    return effect->releases_root ? flexibility_radpNm(model) : model_mass_kg(model);
}

/* Of a clamp the loss is a time, and τ = ζ/(π f). */
static double loss_of(const struct beam_effect *effect, double damping_ratio, double frequency_Hz)
{
    return effect->releases_root ? damping_ratio / (M_PI * frequency_Hz) : damping_ratio;
}

double resonator_damping_ratio(const struct beam_effect *effect, double loss, double frequency_Hz)
{
    return effect->releases_root ? loss * M_PI * frequency_Hz : loss;
}

/* Where a search of something that swings begins. */
static void begin_at(const struct model *model, double frequency_Hz, double at_m, double part, struct model_effect *own)
{
    for (int i = 0; i < own->effect->n_parameters; i++) {
        struct parameter *p = &own->parameters[i];
        p->fixed = false;
        switch (own->effect->parameters[i].role) {
        case BEAM_ROLE_STRENGTH:
            p->value = part * resonator_whole(own->effect, model);
            break;
        case BEAM_ROLE_RESONANCE:
            p->value = frequency_Hz;
            break;
        case BEAM_ROLE_LOSS:
            p->value = loss_of(own->effect, begin_damping, frequency_Hz);
            break;
        case BEAM_ROLE_PLACE:
            p->value = at_m;
            break;
        default:
            break;
        }
    }
}

bool resonator_begin(const struct model *from, const struct beam_effect *effect, double frequency_Hz, double at_m,
                     double part, struct model *out)
{
    struct bf_error ignored;
    if (model_copy(from, out, &ignored) != BF_OK)
        return false;
    size_t own = 0;
    while (own < out->n_effects && out->effects[own].effect != effect)
        own++;
    if (own == out->n_effects && model_append_effect(out, effect->id, "", &ignored) != BF_OK) {
        model_free(out);
        return false;
    }
    begin_at(from, frequency_Hz, at_m, part, &out->effects[own]);
    return true;
}
