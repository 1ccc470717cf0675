/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A set of effects grows from the effect that came first. Another one that alone explains the records as well (a lag and a high-pass of
 * a long time constant) has its place taken: in its stead it is tried in the same set, or the set would speak for the first alone. So is an effect of the beam that
 * comes as near the modes: what a sensor's response leaves of the records may have kept it behind.
 */
#include "diagnose_relatives.h"
#include "diagnose_road.h"
#include "diagnose_state.h"

static const struct hypothesis *best_alone(const struct diagnosis *d, const struct beam_effect *effect)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects == 1 && d->hypotheses[i].effects[0] == effect)
            return &d->hypotheses[i];
    return NULL;
}

/* The set with another effect, at the values that it has alone, instead of one of its own. */
static enum bf_status exchanged(const struct hypothesis *set, const struct beam_effect *out,
                                const struct hypothesis *in, struct model *model, struct bf_error *err)
{
    enum bf_status status = model_copy(&set->model, model, err);
    if (status)
        return status;
    status = model_drop_effect(model, out->id, err);
    if (!status)
        model_take_effect(model, &in->model.effects[in->n_base]);
    if (!status)
        status = model_check(model, err);
    if (status)
        model_free(model);
    return status;
}

/*
 * Alone it takes as much as the member, of the fitted and the held-out records. Scores of single effects tell little where a large cause is in neither of them: beside a
 * sensor's lag a spring has another place than alone, where it had to imitate the lag, too.
 */
static bool takes_as_much(const struct hypothesis *other, const struct hypothesis *alone)
{
    return road_is_structural(other->effects[0]) == road_is_structural(alone->effects[0]) &&
           other->fitted.noise_ratio <= search_limits.same * alone->fitted.noise_ratio &&
           (alone->check.n_channels == 0 || other->check.noise_ratio <= search_limits.same * alone->check.noise_ratio);
}

/* Where the modes have told, an effect of the beam stands for none of the measurement, nor the reverse. */
static bool may_stand_for(const struct diagnose_state *w, const struct beam_effect *member,
                          const struct hypothesis *alone, const struct hypothesis *other)
{
    const bool of_beam = road_is_structural(member);
    if (diagnose_modes_have_told(w) && of_beam != road_is_structural(other->effects[0]))
        return false;
    return diagnose_as_good(other, alone) || takes_as_much(other, alone) ||
           (of_beam && diagnose_modes_have_refitted(w, other->effects[0]));
}

enum bf_status diagnose_exchange(struct diagnose_state *w, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    struct refit_job jobs[SEARCH_FEW];
    size_t n = 0;
    if (d->n_hypotheses == 0 || d->hypotheses[0].n_effects < 2)
        return BF_OK;
    const struct hypothesis *set = &d->hypotheses[0];
    /* up to four such refits step through time, and what the other effects do in pairs with the law is known */
    if (set->n_effects > 2 && hypothesis_has_law(set))
        return BF_OK;
    for (size_t e = 0; e < set->n_effects; e++) {
        const struct hypothesis *alone = best_alone(d, set->effects[e]);
        /* a member that takes next to nothing alone tells of no other that it does the same */
        const bool tells = alone != NULL && alone->explained >= search_limits.tenth;
        for (size_t i = 0; tells && i < d->n_hypotheses && n < SEARCH_FEW; i++) {
            const struct hypothesis *other = &d->hypotheses[i];
            if (other->n_effects != 1 || hypothesis_has_law(other) || hypothesis_has(set, other->effects[0]) ||
                !may_stand_for(w, set->effects[e], alone, other))
                continue;
            /* what alone does the same changes little else: beside a law the windows would take a minute to find that */
            jobs[n] = (struct refit_job){.n_effects = set->n_effects,
                                         .n_tried = w->n_tried,
                                         .to_the_end = true,
                                         .near = hypothesis_has_law(set)};
            if (exchanged(set, set->effects[e], other, &jobs[n].model, err) == BF_OK) {
                jobs[n].first_new =
                    jobs[n].model.n_effects - 1; /* it begins anew: its place is free, and is looked for */
                n++;
            }
        }
    }
    return diagnose_try(w, jobs, n, BF_OK, 0.0);
}
