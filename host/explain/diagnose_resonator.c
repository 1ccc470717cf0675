/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A mode that no bending beam has. Something that swings by itself has a mass, a frequency, a damping and a place: enough to take a part of
 * almost any misfit, near or far from a mode. So it is tried last, where nothing else is sure, and it stays only when it
 * is a mode: within the band, lightly damped, and leaving nothing where no other pair of effects does, or clearly less than every other explanation.
 * What does not decay within the longest record is no mode: something drives it (a support that moves, hum).
 */
#include "diagnose_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "beam/beam.h"
#include "ground/ground.h"

/* All that is set by hand. */
static const struct resonator_limits {
    double lead;        /* rms: it leaves less than this part of what any other explanation leaves */
    double damping;     /* ratio: above, it is a damper and no mode */
    double decay;       /* logarithm of the amplitude over the longest record: less, and it is a steady tone */
    double below_first; /* of the first mode: below, it stands still */
    double part;        /* of the beam's mass: where a search begins */
} limits = {.lead = 0.7, .damping = 0.3, .decay = 0.1, .below_first = 0.3, .part = 0.01};
enum { FREQUENCIES = 8, PLACES = 2 };
static const double places[PLACES] = {1.0, 0.6}; /* of the length */

/* The model's own resonators take what another one would. */
static bool is_worth_trying(const struct diagnosis *d)
{
    return d->n_modes > 0 && own_index(d->model, d->model->n_effects) == 0 && !diagnose_is_complete(d) &&
           d->linearity.verdict != LINEARITY_NONLINEAR;
}

static bool has_resonator(const struct hypothesis *h)
{
    for (size_t e = 0; e < h->n_effects; e++)
        if (effect_has_own(h->effects[e]))
            return true;
    return false;
}

/* The modes in the band and the middles between them, the lowest first. Returns how many. */
static size_t start_frequencies(const struct diagnosis *d, double frequency_Hz[FREQUENCIES])
{
    size_t n = 0;
    if (d->n_modes > 0)
        frequency_Hz[n++] = 0.6 * d->mode_Hz[0];
    for (size_t m = 0; m < d->n_modes && n < FREQUENCIES; m++) {
        frequency_Hz[n++] = d->mode_Hz[m];
        if (m + 1 < d->n_modes && n < FREQUENCIES)
            frequency_Hz[n++] = sqrt(d->mode_Hz[m] * d->mode_Hz[m + 1]);
    }
    return n;
}

static double beam_mass_kg(const struct model *model)
{
    double mass = 0.0;
    for (size_t r = 0; r < model->n_regions; r++)
        for (size_t m = 0; m < model->n_materials; m++)
            if (strcmp(model->materials[m].name, model->regions[r].name) == 0)
                mass += model->materials[m].rho.value * (model->regions[r].to_m - model->regions[r].from_m);
    return mass;
}

static bool job_at(const struct diagnose_state *w, const struct beam_effect *effect, double frequency_Hz, double at_m,
                   struct refit_job *job)
{
    struct bf_error ignored;
    const struct model *from = &w->d->baseline.model;
    *job = (struct refit_job){.n_effects = 1, .n_tried = w->n_tried, .places_tried = true};
    if (model_copy(from, &job->model, &ignored) != BF_OK)
        return false;
    if (model_append_effect(&job->model, effect->id, "", &ignored) != BF_OK) {
        model_free(&job->model);
        return false;
    }
    struct parameter *p = job->model.effects[job->model.n_effects - 1].parameters;
    for (int i = 0; i < effect->n_parameters; i++) {
        p[i].fixed = false;
        if (effect->parameters[i].role == BEAM_ROLE_STRENGTH)
            p[i].value = limits.part * beam_mass_kg(from);
        else if (effect->parameters[i].role == BEAM_ROLE_RESONANCE)
            p[i].value = frequency_Hz;
        else if (effect->parameters[i].role == BEAM_ROLE_PLACE)
            p[i].value = at_m;
    }
    job->first_new = job->model.n_effects;
    return true;
}

static enum bf_status try_all(struct diagnose_state *w, const struct beam_effect *effect)
{
    struct refit_job jobs[FREQUENCIES * PLACES];
    double frequency_Hz[FREQUENCIES];
    const size_t n_frequencies = start_frequencies(w->d, frequency_Hz);
    const double last_m = model_last_place_m(w->d->model);
    size_t n = 0;
    w->n_tried += n_frequencies * PLACES;
    for (size_t f = 0; f < n_frequencies; f++)
        for (size_t a = 0; a < PLACES; a++)
            n += job_at(w, effect, frequency_Hz[f], places[a] * last_m, &jobs[n]);
    return diagnose_try(w, jobs, n, BF_OK, 0.0);
}

static double value_of(const struct hypothesis *h, enum beam_role role)
{
    const struct model_effect *own = &h->model.effects[h->n_base];
    for (int i = 0; i < own->effect->n_parameters; i++)
        if (own->effect->parameters[i].role == role)
            return own->parameters[i].value;
    return (double)NAN;
}

/* Explanations without a resonator. */
struct others {
    double least;  /* that one of them leaves, in units of the noise */
    bool explains; /* one with so few parameters as a pair leaves nothing that matters */
};

static struct others others_leave(const struct diagnosis *d)
{
    struct others others = {.least = d->baseline.fitted.noise_ratio};
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (has_resonator(h))
            continue;
        others.least = fmin(others.least, h->fitted.noise_ratio);
        others.explains = others.explains || (h->explains && h->n_effects <= 2);
    }
    return others;
}

static bool stands_out(const struct hypothesis *h, const struct others *others)
{
    return (h->explains && !others->explains) || h->fitted.noise_ratio <= limits.lead * others->least;
}

static bool is_mode(const struct diagnosis *d, const struct hypothesis *h, const struct others *others)
{
    const double f_Hz = value_of(h, BEAM_ROLE_RESONANCE), damping = value_of(h, BEAM_ROLE_LOSS);
    double band_Hz = 0.0, longest_s = 0.0;
    for (size_t r = 0; r < d->n_records; r++) {
        band_Hz = fmax(band_Hz, 0.5 / d->records[r].dt_s);
        longest_s = fmax(longest_s, (double)d->records[r].n * d->records[r].dt_s);
    }
    return stands_out(h, others) && damping < limits.damping &&
           damping * 2.0 * M_PI * f_Hz * longest_s > limits.decay && f_Hz > limits.below_first * d->mode_Hz[0] &&
           f_Hz < band_Hz;
}

/* What is no mode is no explanation either. */
static void drop_others(struct diagnosis *d)
{
    const struct others others = others_leave(d);
    size_t kept = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        struct hypothesis *h = &d->hypotheses[i];
        if (has_resonator(h) && !is_mode(d, h, &others))
            hypothesis_free(h);
        else
            d->hypotheses[kept++] = *h;
    }
    d->n_hypotheses = kept;
}

/* A refit takes a limited number of steps, too few where its frequency had far to go. The best one is refitted from where it stopped. */
static enum bf_status to_the_end(struct diagnose_state *w, struct bf_error *err)
{
    const struct diagnosis *d = w->d;
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        if (!has_resonator(&d->hypotheses[i]))
            continue;
        struct refit_job job = {
            .n_effects = 1, .n_tried = w->n_tried, .places_tried = true, .to_the_end = true, .near = true};
        const enum bf_status status = model_copy(&d->hypotheses[i].model, &job.model, err);
        job.first_new = job.model.n_effects;
        return diagnose_try(w, &job, status == BF_OK ? 1 : 0, status, 0.0);
    }
    return BF_OK;
}

enum bf_status diagnose_resonator(struct diagnose_state *w, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    if (!is_worth_trying(w->d))
        return BF_OK;
    for (int i = 0; i < beam_effects_count && status == BF_OK; i++)
        if (effect_has_own(beam_effects[i]) && !diagnose_leaves_out(w, beam_effects[i]))
            status = try_all(w, beam_effects[i]);
    if (status == BF_OK)
        status = to_the_end(w, err);
    drop_others(w->d);
    diagnose_rank(w->d, w->n_tried);
    return status;
}
