/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "predict_modal.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "predictor.h"

/* A parameter of a shaken clamp. */
static bool shakes(const struct predictor *p, size_t record, size_t parameter)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        for (int s = 0; p->model.effects[e].effect->tone != NULL && s < BEAM_EFFECT_PARAMETERS; s++)
            if (parameter_map_slot(&p->map, record, e, s) == parameter)
                return true;
    return false;
}

/* Gain, drive or tone of an input of this record depends on the parameter: beside what the system does. */
static bool input_depends(const struct predictor *p, size_t record, size_t parameter)
{
    const struct record_plan *plan = &p->plans[record];
    if (is_input_gain(p, parameter))
        return true;
    for (size_t c = 0; c < plan->n_changes; c++)
        if (plan->changes[c].parameter == parameter)
            return true;
    return shakes(p, record, parameter);
}

/* Rows of the transfer functions: on each grid the sources, then the outputs. */
size_t modal_source_row(const struct run *run, size_t grid, size_t source)
{
    const struct predictor *p = run->p;
    return grid * (p->n_sources + p->model.n_outputs) + source;
}

size_t modal_output_row(const struct run *run, size_t grid, size_t output)
{
    return modal_source_row(run, grid, run->p->n_sources + output);
}

static void list_parameters(const struct run *run, size_t record, struct modal_record *out)
{
    const struct predictor *p = run->p;
    if (run->want == NULL)
        return;
    out->parameters = bf_alloc(p->map.n, sizeof *out->parameters);
    for (size_t j = 0; j < p->map.n; j++)
        out->parameters[j] = (struct modal_parameter){.wanted = run_wants(run, j),
                                                      .structural = run_structural(run, j),
                                                      .of_input = run_wants(run, j) && input_depends(p, record, j)};
}

static void list_inputs(const struct run *run, size_t record, const struct modal_path paths[], struct modal_record *out)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    out->inputs = bf_alloc(p->model.n_inputs, sizeof *out->inputs);
    struct modal_change *change = out->input_changes = bf_alloc(plan->n_changes, sizeof *change);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        struct modal_input *input = &out->inputs[out->system.n_inputs];
        if (plan->input[i] == NULL)
            continue;
        out->system.n_inputs++;
        input->U = plan->U[i];
        input->gain = input_gain(run, i, &input->gain_parameter);
        input->paths = paths + p->n_coordinates * modal_source_row(run, plan->grid, plan->source[i]);
        input->changes = change;
        for (size_t c = 0; c < plan->n_changes; c++) {
            if (plan->changes[c].input != i)
                continue;
            *change++ =
                (struct modal_change){.parameter = plan->changes[c].parameter, .scale = 1.0, .d = plan->changes[c].U};
            input->n_changes++;
        }
    }
}

/* The chain behind an output as its own parameters change it: the gain and the filters. */
static void list_chain(const struct run *run, const struct predict_channel *channel, size_t gain_parameter,
                       const struct response_grid *grid, struct modal_output *out)
{
    const struct predictor *p = run->p;
    double complex *dF = NULL;
    for (size_t j = 0; run->want != NULL && j < p->map.n; j++) {
        struct modal_change change = {.parameter = j, .scale = 1.0, .d = out->filter};
        if (!run_wants(run, j))
            continue;
        if (j != gain_parameter) {
            dF = dF != NULL ? dF : bf_alloc(grid->m, sizeof *dF);
            if (!channel_filter_derivative(run, channel->record, channel->output, j, grid->s, grid->m, dF))
                continue;
            change.scale = out->gain;
            change.d = dF;
            dF = NULL;
        }
        out->changes = bf_grow(out->changes, out->n_changes + 1, sizeof *out->changes);
        out->changes[out->n_changes++] = change;
    }
    free(dF);
}

static enum bf_status list_outputs(const struct run *run, size_t record, const struct modal_path paths[],
                                   struct modal_record *out, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    enum bf_status status = BF_OK;
    const struct response_grid *grid = out->system.grid;
    out->outputs = bf_alloc(plan->n_channels, sizeof *out->outputs);
    for (size_t i = 0; status == BF_OK && i < plan->n_channels; i++) {
        const struct predict_channel *channel = &p->channels[plan->first_channel + i];
        struct modal_output *output = &out->outputs[out->system.n_outputs++];
        double complex *filter = bf_alloc(grid->m, sizeof *filter);
        size_t gain_parameter;
        bool filtered;
        output->filter = filter;
        output->gain = output_gain(run, channel->output, &gain_parameter);
        output->paths = paths + p->n_coordinates * modal_output_row(run, plan->grid, channel->output);
        output->y = run->out->y + channel->row;
        output->jacobian = run->want != NULL ? run_column(run, 0, channel) : NULL;
        output->states = p->nuisance + p->first_state[record] * p->n_rows + channel->row;
        status = channel_filter(run, record, channel->output, grid->s, grid->m, filter, &filtered, err);
        if (status == BF_OK)
            list_chain(run, channel, gain_parameter, grid, output);
    }
    return status;
}

/* d(to_beam) along dp, to_beam being no analytic function of the pole. */
static double complex to_beam_change(const struct run *run, size_t record, double complex pole, double complex dp)
{
    const double step = 1e-5 * cabs(pole) / fmax(cabs(dp), 1e-300);
    return (state_to_beam(run, record, pole + step * dp) - state_to_beam(run, record, pole - step * dp)) / (2.0 * step);
}

static void list_states(const struct run *run, size_t record, struct modal_record *out)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    const struct state_modes *modes = &p->states;
    size_t n = state_modes_of(p, record), n_parameters = p->map.n;
    out->states = bf_alloc(n, sizeof *out->states);
    for (size_t i = 0; i < n && i < modes->n; i++) {
        struct modal_state *state = &out->states[out->system.n_states++];
        double complex pole = p->system->p[modes->pole[i]];
        const double *a = p->amplitude + p->first_state[record] + 2 * i;
        *state = (struct modal_state){.pole = modes->pole[i],
                                      .amplitude = CMPLX(a[0], a[1]),
                                      .to_beam = modes->sign[i] * state_to_beam(run, record, pole)};
        if (plan->A == NULL || run->want == NULL)
            continue;
        state->d_to_beam = bf_alloc(n_parameters, sizeof *state->d_to_beam);
        for (size_t j = 0; j < n_parameters; j++)
            if (run_structural(run, j) && p->system->derivative[j].p != NULL)
                state->d_to_beam[j] =
                    modes->sign[i] * to_beam_change(run, record, pole, p->system->derivative[j].p[modes->pole[i]]);
    }
}

enum bf_status modal_record_new(const struct run *run, size_t record, const struct modal_path paths[],
                                struct modal_record *out, struct bf_error *err)
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    *out = (struct modal_record){.system = {.system = p->system,
                                            .n_coordinates = p->n_coordinates,
                                            .coordinates = p->coordinates,
                                            .n_parameters = p->map.n,
                                            .grid = &p->grids[plan->grid],
                                            .recorder = plan->A,
                                            .free_state = plan->free_state,
                                            .t0_s = (double)plan->start * p->grids[plan->grid].dt_s,
                                            .n_rows = run->out->n_rows}};
    list_parameters(run, record, out);
    list_inputs(run, record, paths, out);
    list_states(run, record, out);
    enum bf_status status = list_outputs(run, record, paths, out, err);
    out->system.clamp = clamp_new(run, record, &out->clamp) ? &out->clamp : NULL;
    out->system.parameters = out->parameters;
    out->system.inputs = out->inputs;
    out->system.outputs = out->outputs;
    out->system.states = out->states;
    return status;
}

void modal_record_free(struct modal_record *record)
{
    for (size_t i = 0; i < record->system.n_outputs; i++) {
        struct modal_output *output = &record->outputs[i];
        for (size_t c = 0; c < output->n_changes; c++)
            if (output->changes[c].d != output->filter)
                free((void *)output->changes[c].d);
        free(output->changes);
        free((void *)output->filter);
    }
    for (size_t i = 0; i < record->system.n_states; i++)
        free(record->states[i].d_to_beam);
    free(record->states);
    free(record->parameters);
    free(record->inputs);
    free(record->input_changes);
    free(record->outputs);
    clamp_free(&record->clamp);
}
