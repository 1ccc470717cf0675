/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A spring so stiff that it holds the beam is a rigid support, unless the records ask for its stiffness: where the form of a model is not exact, a support that gives a little stands
 * further out than the one that is there, and the records hardly tell the two apart. It is fitted with its place alone.
 */
#include "diagnose_relatives.h"
#include "diagnose_state.h"

#include <math.h>

/* Of what the beam gives there, bent from the clamp: less shows in no prediction. */
static const double gives = 1e-6;

/* Of which a support gives this part of what the beam does: a cantilever to the place gives at³/3EI. */
static double held_Npm(const struct model *model, double at_m, double part)
{
    const double EI = model->materials[model_plain_material(model)].EI.value;
    return 3.0 * EI / (part * pow(at_m, 3.0));
}

static void hold(struct parameter *p, double value)
{
    p->value = fmin(value, p->max);
    p->sd = 0.0;
    p->fixed = true;
}

/* Stiffness and damping are held, the place is free. False: records have values of their own, or the catalogue ends before the spring is rigid. */
static bool hold_support(struct model *model, struct model_effect *own)
{
    const int strength = effect_slot(own->effect, BEAM_ROLE_STRENGTH),
              place = effect_slot(own->effect, BEAM_ROLE_PLACE);
    const double at_m = own->parameters[place].value;
    if (own->parameters[strength].fixed || own->by_record[strength] || own->by_record[place] || !(at_m > 0.0) ||
        own->parameters[strength].max < held_Npm(model, at_m, search_limits.hundredth))
        return false;
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        if (slot != place)
            hold(&own->parameters[slot],
                 slot == strength ? held_Npm(model, at_m, gives) : own->effect->parameters[slot].neutral);
    return true;
}

enum bf_status diagnose_hold_supports(struct diagnose_state *w, struct bf_error *err)
{
    const struct hypothesis *best = &w->d->hypotheses[0];
    struct refit_job job = {.n_effects = best->n_effects, .n_tried = w->n_tried, .places_tried = true};
    bool any = false;
    const enum bf_status status = diagnose_on_given(w->d, best, &job.model, err);
    if (status)
        return status;
    for (size_t e = 0; e < best->n_effects; e++) {
        const bool held = hypothesis_has_support(best, best->effects[e]) &&
                          hold_support(&job.model, &job.model.effects[best->n_base + e]);
        any = any || held;
        job.along = held; /* the last effect's place is begun along the span */
    }
    job.first_new = job.model.n_effects;
    if (!any)
        model_free(&job.model);
    return any ? diagnose_try(w, &job, 1, BF_OK, 0.0) : BF_OK;
}
