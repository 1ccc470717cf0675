/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which unknowns the initial states of records have, and the modes that they belong to. */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "recorder.h"

/* Modes above this part of the sampling frequency are not seen. */
static const double band_part = 0.45;

static bool in_band(const struct predictor *p, size_t record, size_t pole)
{
    double frequency_Hz = cimag(p->system->p[pole]) / (2.0 * acos(-1.0));
    return frequency_Hz * p->records[record].dt_s < band_part;
}

/* Poles are not sorted: the pairs by ascending frequency, the lowest `limit` of them. */
static size_t lowest_poles(const struct predictor *p, size_t limit, size_t out[])
{
    size_t count = 0;
    for (size_t k = 0; k < p->system->n_pairs; k++) {
        size_t at = count;
        while (at > 0 && cimag(p->system->p[out[at - 1]]) > cimag(p->system->p[k])) {
            out[at] = out[at - 1];
            at--;
        }
        out[at] = k;
        count++;
    }
    return count < limit ? count : limit;
}

bool filter_remembers(const struct predictor *p, size_t e, size_t output)
{
    const struct beam_effect *effect = p->model.effects[e].effect;
    struct beam_filter_output filter = {.value = {.a1 = 0.0}};
    double start[BEAM_EFFECT_PARAMETERS] = {0};
    for (int s = 0; s < effect->n_parameters; s++)
        start[s] = effect->parameters[s].start;
    return effect->filter != NULL && effect_on_output(&p->model, e, output) && effect->filter(start, &filter) == 0 &&
           not_zero(filter.value.a1);
}

size_t recorder_unknowns(const struct predictor *p, size_t record)
{
    return p->plans[record].n_channels * p->plans[record].n_rings;
}

static size_t filter_unknowns(const struct predictor *p, size_t record)
{
    const struct record_plan *plan = &p->plans[record];
    size_t n = recorder_unknowns(p, record);
    for (size_t c = 0; c < plan->n_channels; c++)
        for (size_t e = 0; e < p->model.n_effects; e++)
            n += filter_remembers(p, e, p->channels[plan->first_channel + c].output);
    return n;
}

size_t whole_unknowns(const struct predictor *p, size_t record)
{
    return p->model.support == SUPPORT_FREE_FREE ? WHOLE_TERMS * p->plans[record].n_channels : 0;
}

static size_t modes_in_band(const struct predictor *p, size_t record)
{
    size_t *poles = bf_alloc(p->system->n_poles, sizeof *poles);
    size_t n = 0, pairs = lowest_poles(p, p->system->n_pairs, poles);
    while (n < pairs && in_band(p, record, poles[n]))
        n++;
    free(poles);
    return n;
}

void states_count(struct predictor *p)
{
    struct state_modes *states = &p->states;
    if (p->amplitude !=
        NULL) /* the number of unknowns of a fit does not change when a mode crosses the edge of the band */
        return;
    for (size_t r = 0; r < p->n_records; r++) {
        p->first_state[r] = p->n_nuisance;
        if (!p->plans[r].free_state)
            continue;
        size_t modes = modes_in_band(p, r);
        states->most = modes > states->most ? modes : states->most;
        p->n_nuisance += 2 * modes + filter_unknowns(p, r) + whole_unknowns(p, r);
    }
    p->first_state[p->n_records] = p->n_nuisance;
    p->amplitude = bf_alloc(p->n_nuisance, sizeof(double));
    states->pole = bf_alloc(states->most, sizeof *states->pole);
    states->sign = bf_alloc(states->most, sizeof *states->sign);
    states->reference = bf_alloc(states->most * p->model.n_outputs, sizeof *states->reference);
}

void states_free(struct predictor *p)
{
    free(p->amplitude);
    free(p->first_state);
    free(p->states.pole);
    free(p->states.sign);
    free(p->states.reference);
}

void states_find(struct predictor *p)
{
    struct state_modes *states = &p->states;
    size_t *poles = bf_alloc(p->system->n_poles, sizeof *poles), n_outputs = p->model.n_outputs;
    states->n = lowest_poles(p, states->most, poles); /* none where each record has its own */
    for (size_t i = 0; i < states->n; i++) {
        double complex *reference = states->reference + i * n_outputs;
        double along = 0.0;
        states->pole[i] = poles[i];
        for (size_t o = 0; o < n_outputs; o++)
            along += creal(conj(reference[o]) * p->outputs[o].alpha[poles[i]]);
        states->sign[i] = along < 0.0 ? -1.0 : 1.0;
        for (size_t o = 0; o < n_outputs; o++)
            reference[o] = states->sign[i] * p->outputs[o].alpha[poles[i]];
    }
    free(poles);
}

size_t state_unknowns(const struct predictor *p, size_t record)
{
    return p->first_state[record + 1] - p->first_state[record];
}

void states_clear(struct predictor *p)
{
    if (!p->states_are_clear)
        memset(p->nuisance, 0, p->n_rows * p->n_nuisance * sizeof *p->nuisance);
    for (size_t r = 0; r < p->n_records && p->states_are_clear; r++) {
        size_t first;
        const size_t n = predict_rows_of(p->channels, p->n_channels, r, &first);
        for (size_t i = p->first_state[r]; i < p->first_state[r + 1]; i++)
            memset(p->nuisance + i * p->n_rows + first, 0, n * sizeof *p->nuisance);
    }
    p->states_are_clear = true;
}

size_t state_modes_of(const struct predictor *p, size_t record)
{
    const size_t others = filter_unknowns(p, record) + whole_unknowns(p, record);
    return p->plans[record].free_state ? (state_unknowns(p, record) - others) / 2 : 0;
}

bool states_bend(const struct predictor *p)
{
    bool bend = p->nonlinear;
    for (size_t e = 0; e < p->model.n_effects; e++)
        bend = bend || p->model.effects[e].effect->map != NULL;
    return bend && p->n_nuisance > 0;
}

bool state_at_rest(const struct predictor *p, size_t record)
{
    size_t first = p->first_state[record], n = 2 * state_modes_of(p, record);
    for (size_t i = first; i < first + n; i++)
        if (not_zero(p->amplitude[i]))
            return false;
    return p->plans[record].free_decay;
}

double complex state_to_beam(const struct run *run, size_t record, double complex pole)
{
    const struct record_plan *plan = &run->p->plans[record];
    if (plan->A == NULL)
        return 1.0;
    return recorder_inverse(recorder_at_pole(&plan->recorder, run->p->grids[plan->grid].dt_s, pole));
}

void states_take_out(const struct run *run)
{
    const struct predictor *p = run->p;
    for (size_t c = 0; c < p->n_channels; c++) {
        const struct predict_channel *channel = &p->channels[c];
        size_t first = p->first_state[channel->record], n = state_unknowns(p, channel->record);
        for (size_t i = first; i < first + n; i++)
            add_scaled(channel->n, -p->amplitude[i], p->nuisance + i * p->n_rows + channel->row, p->y + channel->row);
    }
}
