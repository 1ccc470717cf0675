/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A stand-in often needs a value that nobody would believe: a Maxwell branch twice as stiff as the beam, kilonewtons of tension in a cantilever, a hundred
 * kilograms on a beam of one, hum that happens to have the beam's own frequency, a sensor too slow for the beam's first mode. The fit itself knows no prior of an effect; here the value has one.
 */
#include "plausible.h"

#include <math.h>

#include "beam/beam.h"
#include "estimate/estimate.h"

/* Of EI or of the buckling load: up to this part nothing is said; e times as much, and more, is improbable as a normal logarithm of deviation 1. */
static const double usual_share = 0.1;
/* Times the beam's mass: up to this a mass is one that somebody puts on a beam; one that is far heavier holds it, as a support does. */
static const double usual_mass = 3.0;
/* Tones are spread evenly over the logarithm of the frequency: one within this share of a pole is judged by how near it is. */
static const double neighbourhood = 0.1;

static double stiffest(const struct model *model)
{
    double EI = 0.0;
    for (size_t m = 0; m < model->n_materials; m++)
        EI = fmax(EI, model->materials[m].EI.value);
    return EI;
}

/* π² EI/(μ l)² */
static double buckling_load(const struct model *model)
{
    static const double effective_length[] = {[SUPPORT_CLAMPED_FREE] = 2.0,
                                              [SUPPORT_CLAMPED_CLAMPED] = 0.5,
                                              [SUPPORT_PINNED_PINNED] = 1.0,
                                              [SUPPORT_FREE_FREE] = 1.0};
    const double length_m = effective_length[model->support] * (double)model_place(model).length_m;
    return M_PI * M_PI * stiffest(model) / (length_m * length_m);
}

/* Up to which a force along the beam is one that somebody makes. At a free end nothing pulls but the weight of the beam and of what hangs on it. */
static double usual_tension(const struct model *model)
{
    static const double gravity_mps2 = 9.80665;
    const bool held = model->support == SUPPORT_PINNED_PINNED || model->support == SUPPORT_CLAMPED_CLAMPED;
    const double bends = usual_share * buckling_load(model);
    return held ? bends : fmin(bends, (1.0 + usual_mass) * gravity_mps2 * model_mass_kg(model));
}

static double beyond(double value, double usual)
{
    const double log_ratio = log(fmax(fabs(value) / usual, 1.0));
    return 0.5 * log_ratio * log_ratio;
}

double sds_from_prior(const struct parameter *parameter, double value)
{
    const double ratio = value / parameter->prior_value;
    return (parameter->logarithmic && ratio > 0.0 ? log(ratio) : ratio - 1.0) / parameter->prior;
}

static double longest_record_s(const struct diagnosis *d)
{
    double longest_s = 0.0;
    for (size_t r = 0; r < d->n_records; r++)
        longest_s = fmax(longest_s, (double)d->records[r].n * d->records[r].dt_s);
    return longest_s;
}

/*
 * What of a Maxwell branch does not relax within the longest record is bending stiffness, whatever it is called, and the prior of EI speaks of it, too:
 * −log of the prior at EI and this stiffness together, less what EI alone costs in the fit.
 */
static double nats_of_memory(const struct diagnosis *d, const struct model *model, const struct beam_term *term)
{
    const struct parameter *EI = &model->materials[model_plain_material(model)].EI;
    if (!(EI->prior > 0.0) || term->value.memory <= 0)
        return 0.0;
    const double stays = (double)term->value.memory * exp(-longest_record_s(d) / (double)term->value.relaxation_s);
    const double alone = sds_from_prior(EI, EI->value), together = sds_from_prior(EI, EI->value + stays);
    return fmax(0.5 * (together * together - alone * alone), 0.0);
}

static double nats_of_term(const struct diagnosis *d, const struct model *model, const struct beam_term *term)
{
    const bool plain = term->place.weight == BEAM_WEIGHT_ONE || term->place.weight == BEAM_WEIGHT_PATCH;
    if (plain && term->place.kind == BEAM_OVER_CURVATURE)
        return fmax(beyond((double)(term->value.stiffness + term->value.memory), usual_share * stiffest(model)),
                    nats_of_memory(d, model, term));
    if (plain && term->place.kind == BEAM_OVER_SLOPE)
        return beyond((double)term->value.stiffness, usual_tension(model));
    if (term->place.kind == BEAM_AT_POINT)
        return beyond((double)term->value.mass, usual_mass * model_mass_kg(model));
    return 0.0;
}

/* At the values that the effect has in the model. Returns how many; 0: it has none there. */
static int terms_of(const struct model *model, const struct model_effect *own,
                    struct beam_term terms[BEAM_EFFECT_TERMS])
{
    const struct beam_place place = model_place(model);
    beam_real p[BEAM_EFFECT_PARAMETERS] = {0};
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        p[slot] = (beam_real)own->parameters[slot].value;
    return own->effect->terms != NULL && own->effect->terms(p, &place, terms) == 0 ? own->effect->n_terms : 0;
}

static double nats_of_terms(const struct diagnosis *d, const struct model *model, const struct model_effect *own)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    const int n = terms_of(model, own, terms);
    double nats = 0.0;
    for (int t = 0; t < n; t++)
        nats += nats_of_term(d, model, &terms[t]);
    return nats;
}

bool diagnose_decays(const struct diagnosis *d, double frequency_Hz, double damping_ratio)
{
    return beam_mode_decays(frequency_Hz, damping_ratio, longest_record_s(d));
}

/*
 * The poles are those of the free linear model: what the records have, whatever the beam's model makes of it. One that does not decay is no mode: in free
 * decays it is the tone itself.
 */
static double nats_of_tone(const struct diagnosis *d, double frequency_Hz)
{
    double nats = 0.0;
    for (size_t k = 0; k < d->attainable.modes; k++) {
        const struct attainable_pole *pole = &d->attainable.poles[k];
        if (!diagnose_decays(d, pole->frequency_Hz, pole->damping_ratio))
            continue;
        const double away = fabs(frequency_Hz - pole->frequency_Hz) + fabs(pole->damping_ratio) * pole->frequency_Hz;
        nats = fmax(nats, log(neighbourhood * frequency_Hz / fmax(away, 1e-9 * frequency_Hz)));
    }
    return nats;
}

static double nats_of_tones(const struct diagnosis *d, const struct model_effect *own)
{
    double nats = 0.0;
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        if (own->effect->parameters[slot].role == BEAM_ROLE_FREQUENCY)
            nats += nats_of_tone(d, own->parameters[slot].value);
    return nats;
}

/*
 * Nobody measures with a sensor that loses the beam's first mode: what it passes of it, less than half, has a normal logarithm, too. In free decays, whose scale nobody
 * knows, the fit has nothing against it.
 */
static double nats_of_filter(const struct diagnosis *d, const struct model_effect *own)
{
    static const double usual_loss = 2.0;
    beam_real p[BEAM_EFFECT_PARAMETERS] = {0};
    struct beam_filter_output out = {0};
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        p[slot] = (beam_real)own->parameters[slot].value;
    const size_t first = modes_rigid(d->mode_Hz, d->n_modes);
    if (own->effect->filter == NULL || d->n_modes == first || own->effect->filter(p, &out) != 0)
        return 0.0;
    const double omega = 2.0 * M_PI * d->mode_Hz[first];
    const double passed = hypot((double)out.value.b0, omega * (double)out.value.b1) /
                          hypot((double)out.value.a0, omega * (double)out.value.a1);
    return beyond(1.0 / fmax(passed, 1e-12), usual_loss);
}

double implausible_nats(const struct diagnosis *d, const struct hypothesis *h)
{
    double nats = 0.0;
    for (size_t i = 0; i < h->n_effects && h->n_base + i < h->model.n_effects; i++) {
        const struct model_effect *own = &h->model.effects[h->n_base + i];
        nats += nats_of_terms(d, &h->model, own) + nats_of_tones(d, own) + nats_of_filter(d, own);
    }
    return nats;
}

static bool attracts(const struct model *model, const struct model_effect *own)
{
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    const int n = terms_of(model, own, terms);
    for (int t = 0; t < n; t++)
        if (terms[t].place.kind == BEAM_AT_POINT && (double)terms[t].value.stiffness < 0.0)
            return true;
    return false;
}

/* Bouc and Wen's loop dissipates where |ζ| ≤ β (Erlicher and Point 2004); where ζ is far above β it is a bent line, which no drive's hysteresis is. */
static bool hardly_slips(const struct model_effect *own)
{
    static const double far_above = 10.0;
    double level[BEAM_EFFECT_PARAMETERS] = {0.0}; /* β, ζ */
    int n = 0;
    for (int slot = 0; slot < own->effect->n_parameters; slot++)
        if (own->effect->parameters[slot].role == BEAM_ROLE_LEVEL)
            level[n++] = own->parameters[slot].value;
    return own->effect->drive != NULL && n == 2 && fabs(level[1]) > far_above * fabs(level[0]);
}

/* A beam does not carry thirty times its mass: what is as heavy holds it, and is a support. */
static bool holds(const struct model *model, const struct model_effect *own)
{
    static const double far_heavier = 30.0;
    struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
    const int n = terms_of(model, own, terms);
    for (int t = 0; t < n; t++)
        if (terms[t].place.kind == BEAM_AT_POINT && (double)terms[t].value.mass > far_heavier * model_mass_kg(model))
            return true;
    return false;
}

static bool has_tone(const struct hypothesis *h)
{
    for (size_t i = 0; i < h->n_effects; i++)
        for (int slot = 0; slot < h->effects[i]->n_parameters; slot++)
            if (h->effects[i]->parameters[slot].role == BEAM_ROLE_FREQUENCY)
                return true;
    return false;
}

bool tone_replaces_mode(const struct hypothesis *h)
{
    enum { MODES = 3, POINTS = 2 }; /* two motions as a whole, at most */
    struct modes modes;
    struct bf_error ignored;
    double frequency_Hz[MODES];
    if (!has_tone(h) || modes_compute(&h->model, MODES, 0.0, POINTS, &modes, &ignored) != BF_OK)
        return false;
    for (size_t m = 0; m < modes.n; m++)
        frequency_Hz[m] = modes.mode[m].undamped_Hz;
    const size_t first = modes_rigid(frequency_Hz, modes.n);
    const bool is_dead = first < modes.n && modes.mode[first].damping_ratio >= beam_mode_limits.damping;
    modes_free(&modes);
    return is_dead;
}

const char *stand_in_reason(const struct hypothesis *h)
{
    if (h->tone_replaces_mode)
        return "the first mode of its beam does not ring: the tone does in its place";
    for (size_t i = 0; i < h->n_effects && h->n_base + i < h->model.n_effects; i++) {
        const struct model_effect *own = &h->model.effects[h->n_base + i];
        if (attracts(&h->model, own))
            return "its spring attracts: a magnet, or something else that makes the beam softer";
        if (holds(&h->model, own))
            return "its mass is more than thirty times the beam's: a support, which holds the beam there";
        if (hardly_slips(own))
            return "its hysteresis has no loop: a bent line, as a dead zone or a saturation is";
    }
    return NULL;
}

bool is_stand_in(const struct hypothesis *h)
{
    return stand_in_reason(h) != NULL;
}
