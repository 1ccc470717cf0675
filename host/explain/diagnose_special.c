/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * What explains the records best may be more general than its cause: a point mass at the free end is a tip mass, a spring without stiffness a damper. The
 * special case is refitted from the values of the general one, which are its own if it is the cause, wherever its own search has ended: alone, and in the
 * best set. So is another first-order response of the sensor with the time constant that was found: a low-pass and a
 * high-pass both leave a transient that dies away with it, and in free decays the two differ in nothing else.
 */
#include "diagnose_relatives.h"
#include "diagnose_state.h"

#include <string.h>

/* The best explanation of so many effects at most, wherever it stands; NULL: there is none. */
static const struct hypothesis *best_of(const struct diagnosis *d, size_t most)
{
    const struct hypothesis *best = NULL;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        if (d->hypotheses[i].n_effects <= most && (best == NULL || d->hypotheses[i].score > best->score))
            best = &d->hypotheses[i];
    return best;
}

/* The general one's effects, but the special case in the place of one of them. */
static bool is_that(const struct hypothesis *h, const struct hypothesis *general, size_t e,
                    const struct beam_effect *special)
{
    bool same = h->n_effects == general->n_effects;
    for (size_t i = 0; i < general->n_effects && same; i++)
        same = hypothesis_has(h, i == e ? special : general->effects[i]);
    return same;
}

/* Its refit has come down as far already. */
static bool does_as_well(const struct diagnosis *d, const struct hypothesis *general, size_t e,
                         const struct beam_effect *special)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (is_that(h, general, e, special) &&
            h->fitted.noise_ratio <= search_limits.mate * general->fitted.noise_ratio)
            return true;
    }
    return false;
}

/* One that differs from record to record goes on to. */
static void take_value(const struct model_effect *from, int slot, struct model_effect *to, int own)
{
    to->parameters[own].value = from->parameters[slot].value;
    to->by_record[own] = from->by_record[slot];
    for (size_t k = 0; k < from->n_per_record; k++)
        if (from->per_record[k].parameter == slot)
            effect_set_record_value(to, own, from->per_record[k].record, from->per_record[k].value, 0.0);
}

/* Parameters of the same name keep their values. */
static void take_values(const struct model_effect *from, struct model_effect *to)
{
    for (int i = 0; i < to->effect->n_parameters; i++)
        for (int j = 0; j < from->effect->n_parameters; j++)
            if (strcmp(to->effect->parameters[i].name, from->effect->parameters[j].name) == 0)
                take_value(from, j, to, i);
}

/* Another response of a sensor with a time constant of the same name. */
static bool has_its_time_constant(const struct beam_effect *one, const struct beam_effect *other)
{
    if (one == other || one->filter == NULL || other->filter == NULL)
        return false;
    for (int i = 0; i < one->n_parameters; i++)
        for (int j = 0; j < other->n_parameters; j++)
            if (one->parameters[i].role == BEAM_ROLE_TIME &&
                strcmp(one->parameters[i].name, other->parameters[j].name) == 0)
                return true;
    return false;
}

static enum bf_status special_model(const struct hypothesis *general, size_t e, const struct beam_effect *special,
                                    struct model *model, struct bf_error *err)
{
    const struct model_effect *own = &general->model.effects[general->n_base + e];
    enum bf_status status = model_copy(&general->model, model, err);
    if (status)
        return status;
    status = model_drop_effect(model, general->effects[e]->id, err);
    if (!status)
        status = model_append_effect(model, special->id, own->channel, err);
    if (!status) {
        take_values(own, &model->effects[model->n_effects - 1]);
        status = model_check(model, err);
    }
    if (status)
        model_free(model);
    return status;
}

static bool is_worth_trying(const struct diagnose_state *w, const struct hypothesis *general, size_t e,
                            const struct beam_effect *special)
{
    const bool related = diagnose_special_case(special, general->effects[e], w->d->model) ||
                         has_its_time_constant(special, general->effects[e]);
    const bool known =
        general->n_effects == 1 && (diagnose_modes_have_refitted(w, special) || diagnose_modes_rule_out(w, special));
    return related && !known && !diagnose_leaves_out(w, special) && !model_has_effect(&general->model, special) &&
           !does_as_well(w->d, general, e, special);
}

static void try_special_cases(struct diagnose_state *w, const struct hypothesis *general)
{
    struct refit_job jobs[SEARCH_FEW];
    size_t n = 0;
    for (size_t e = 0; general != NULL && e < general->n_effects; e++)
        for (int i = 0; i < beam_effects_count && n < SEARCH_FEW; i++) {
            struct bf_error ignored;
            if (!is_worth_trying(w, general, e, beam_effects[i]))
                continue;
            jobs[n] = (struct refit_job){.n_effects = general->n_effects, .n_tried = w->n_tried, .near = true};
            if (special_model(general, e, beam_effects[i], &jobs[n].model, &ignored) == BF_OK) {
                jobs[n].first_new = jobs[n].model.n_effects;
                n++;
            }
        }
    (void)diagnose_try(w, jobs, n, BF_OK, 0.0);
}

void diagnose_special_cases(struct diagnose_state *w)
{
    try_special_cases(w, best_of(w->d, 1));
}

/* The best single effect may have come to its values since: beside a freed rig, or in a second look. */
void diagnose_special_sets(struct diagnose_state *w)
{
    try_special_cases(w, best_of(w->d, 1));
    const struct hypothesis *best = best_of(w->d, DIAGNOSE_EFFECTS);
    if (best != NULL && best->n_effects > 1)
        try_special_cases(w, best);
}
