/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "response.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "predictor.h"

/* Whose system is that of the first record's beam. */
static const struct predictor *first_beam(const struct predictor *p)
{
    return p->each != NULL ? p->each[0].predictor : p;
}

size_t transfer_poles(const struct predictor *p, const double complex **poles)
{
    const struct system *s = first_beam(p)->system;
    *poles = s->p;
    return s->n_pairs;
}

struct sized {
    double size_rad;
    size_t pole;
};

static int by_size(const void *a, const void *b)
{
    const double x = ((const struct sized *)a)->size_rad, y = ((const struct sized *)b)->size_rad;
    return (x > y) - (x < y);
}

size_t transfer_poles_by_size(const struct predictor *p, size_t **order)
{
    static const double rigid = 1e-6; /* of the largest: a motion of a free beam as a whole */
    const double complex *poles;
    const size_t n = transfer_poles(p, &poles);
    struct sized *sized = bf_alloc(n + 1, sizeof *sized);
    double largest = 0.0;
    size_t kept = 0;
    for (size_t k = 0; k < n; k++)
        largest = fmax(largest, cabs(poles[k]));
    for (size_t k = 0; k < n; k++)
        if (cabs(poles[k]) > rigid * largest)
            sized[kept++] = (struct sized){cabs(poles[k]), k};
    qsort(sized, kept, sizeof *sized, by_size);
    *order = bf_alloc(kept + 1, sizeof **order);
    for (size_t k = 0; k < kept; k++)
        (*order)[k] = sized[k].pole;
    free(sized);
    return kept;
}

const double complex *transfer_pole_derivative(const struct predictor *p, size_t parameter)
{
    const struct system *s = first_beam(p)->system;
    if (p->each == NULL)
        return s->derivative[parameter].p;
    for (size_t i = 0; i < p->each[0].n_refs; i++)
        if (p->each[0].from[i] == parameter)
            return s->derivative[i].p;
    return NULL;
}

double transfer_clock(const struct predictor *p, const double **by)
{
    *by = p->geometry.clock_by;
    return p->geometry.clock;
}

/* s^ν at a pole. */
static double complex power(double complex s, int order)
{
    double complex product = 1.0;
    for (int i = 0; i < order; i++)
        product *= s;
    return product;
}

double complex transfer_residue(const struct predictor *p, const double theta[], size_t output, size_t input,
                                size_t pole, double complex d[])
{
    const struct run run = {.p = (struct predictor *)p, .theta = theta};
    const struct functional *c = &p->outputs[output], *b = &p->inputs[input];
    const int order = output_order(p->model.outputs[output].kind);
    const size_t n_poles = p->system->n_poles;
    const double complex s = p->system->p[pole], alpha = c->alpha[pole], beta = b->alpha[pole];
    const double complex path = power(s, order) * alpha * beta;
    size_t of_input, of_output;
    const double gain_in = input_gain(&run, input, &of_input), gain_out = output_gain(&run, output, &of_output);
    for (size_t j = 0; j < p->map.n && d != NULL; j++) {
        const struct pole_derivative *moved = &p->system->derivative[j];
        const size_t at = j * n_poles + pole;
        d[j] = 0.0;
        if (p->structural[j]) {
            d[j] = power(s, order) * (c->d_alpha[at] * beta + alpha * b->d_alpha[at]);
            if (moved->p != NULL && order > 0)
                d[j] += order * power(s, order - 1) * moved->p[pole] * alpha * beta;
            d[j] *= gain_in * gain_out;
        }
        d[j] += (j == of_input ? gain_out * path : 0.0) + (j == of_output ? gain_in * path : 0.0);
    }
    return gain_in * gain_out * path;
}

const struct model *transfer_model(const struct predictor *p)
{
    return &p->model;
}

const struct reduced *transfer_reduced(const struct predictor *p)
{
    return &p->reduced;
}

size_t transfer_parameters(const struct predictor *p, const struct parameter_ref **refs)
{
    *refs = p->refs;
    return p->map.n;
}

size_t transfer_records(const struct predictor *p)
{
    return p->n_records;
}

bool transfer_nonlinear(const struct predictor *p)
{
    return p->nonlinear;
}

struct transfer_record transfer_record(const struct predictor *p, size_t record)
{
    const struct record_plan *plan = &p->plans[record];
    return (struct transfer_record){.grid = &p->grids[plan->grid],
                                    .grid_index = plan->grid,
                                    .first_channel = plan->first_channel,
                                    .n_channels = plan->n_channels,
                                    .record = plan->record};
}

const double *transfer_output_functional(const struct predictor *p, size_t output, int *order)
{
    *order = output_order(p->model.outputs[output].kind);
    return p->outputs[output].g;
}

struct transfer_modes transfer_modes(const struct predictor *p, double highest_rad, size_t most)
{
    const struct system *s = p->system;
    struct transfer_modes modes = {.dimension = s->n, .omega_rad = s->omega_rad, .shape = s->modes};
    while (modes.n < s->n && modes.n < most && (modes.n == 0 || s->omega_rad[modes.n] < highest_rad))
        modes.n++;
    modes.damping = bf_alloc(modes.n, sizeof *modes.damping);
    for (size_t k = 0; k < modes.n; k++) {
        const double *phi = s->modes + k * s->n;
        for (size_t j = 0; j < s->n; j++)
            for (size_t i = 0; i < s->n; i++)
                modes.damping[k] += phi[i] * s->C[i + j * s->n] * phi[j];
    }
    return modes;
}

void transfer_motion(const struct predictor *p, const double theta[], size_t record, const double g[],
                     double complex W[])
{
    const struct record_plan *plan = &p->plans[record];
    const struct run run = {.p = (struct predictor *)p, .theta = theta};
    size_t m = p->grids[plan->grid].m;
    double complex *H = bf_alloc(m, sizeof *H), *alpha = bf_alloc(p->system->n_poles, sizeof *alpha);
    memset(W, 0, m * sizeof *W);
    system_functional(p->system, g, alpha);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        size_t parameter;
        if (plan->input[i] == NULL)
            continue;
        double gain = input_gain(&run, i, &parameter);
        response_value(p->kernels[plan->grid], 0, alpha, p->inputs[plan->source[i]].alpha, H);
        for (size_t k = 0; k < m; k++)
            W[k] += gain * (H[k] * plan->U[i][k]);
    }
    recorder_undo(plan->A, m, W); /* the beam moved before the recorder's filter */
    free(H);
    free(alpha);
}

size_t transfer_states(const struct predictor *p, size_t record, size_t *n)
{
    *n = state_unknowns(p, record);
    return p->first_state[record];
}

bool transfer_undriven(const struct predictor *p, size_t record)
{
    return p->plans[record].free_decay;
}

double complex transfer_state_shape(const struct predictor *p, const struct transfer_modes *modes, size_t mode,
                                    double complex *pole)
{
    const double *shape = modes->shape + mode * modes->dimension;
    double square = 0.0;
    *pole = 0.0;
    if (mode >= p->states.n)
        return 0.0;
    double complex *alpha = bf_alloc(p->system->n_poles, sizeof *alpha);
    system_functional(p->system, shape, alpha); /* φ ≈ c ψ: ψᵀφ = c ψᵀψ */
    for (size_t i = 0; i < modes->dimension; i++)
        square += shape[i] * shape[i];
    double complex c = p->states.sign[mode] * alpha[p->states.pole[mode]] / square;
    *pole = p->system->p[p->states.pole[mode]];
    free(alpha);
    return c;
}

void transfer_state_motion(const struct predictor *p, const double theta[], size_t record, const double g[], int order,
                           int oversample, double out[])
{
    enum { ANEW = 64 }; /* products of e^(ph) are begun anew often enough to stay exact */
    const struct record_plan *plan = &p->plans[record];
    const struct response_grid *grid = &p->grids[plan->grid];
    const struct run run = {.p = (struct predictor *)p, .theta = theta};
    size_t modes = state_modes_of(p, record), n = grid->n * (size_t)oversample;
    double h = grid->dt_s / (double)oversample;
    double complex *alpha = bf_alloc(p->system->n_poles, sizeof *alpha);
    system_functional(p->system, g, alpha);
    for (size_t i = 0; i < modes && i < p->states.n; i++) {
        const double *a = p->amplitude + p->first_state[record] + 2 * i;
        double complex pole = p->system->p[p->states.pole[i]], z = 0.0, step = cexp(pole * h);
        double complex size =
            2.0 * p->states.sign[i] * CMPLX(a[0], a[1]) * alpha[p->states.pole[i]] * state_to_beam(&run, record, pole);
        for (int k = 0; k < order; k++)
            size *= pole;
        for (size_t k = 0; k < n; k++) {
            z = k % ANEW == 0 ? cexp(pole * h * (double)k) : z * step;
            out[k] += creal(size * z);
        }
    }
    free(alpha);
}

enum bf_status transfer_chain(const struct predictor *p, const double theta[], size_t channel, double complex F[],
                              struct bf_error *err)
{
    const struct predict_channel *c = &p->channels[channel];
    const struct run run = {.p = (struct predictor *)p, .theta = theta};
    const struct response_grid *grid = &p->grids[p->plans[c->record].grid];
    size_t parameter;
    bool any;
    double gain = output_gain(&run, c->output, &parameter);
    enum bf_status status = channel_filter(&run, c->record, c->output, grid->s, grid->m, F, &any, err);
    for (size_t k = 0; k < grid->m; k++)
        F[k] *= gain;
    recorder_apply(p->plans[c->record].A, grid->m, F);
    return status;
}

bool transfer_of_all(const struct predictor *p)
{
    return p->each == NULL && !p->nonlinear;
}

bool transfer_path(const struct predictor *p, const double theta[], size_t channel, size_t input, double complex H[])
{
    struct bf_error ignored;
    const struct predict_channel *c = &p->channels[channel];
    const struct record_plan *plan = &p->plans[c->record];
    const struct run run = {.p = (struct predictor *)p, .theta = theta};
    const size_t m = p->grids[plan->grid].m;
    if (plan->free_decay || plan->periodic || plan->input[input] == NULL)
        return false;
    double complex *F = bf_alloc(m, sizeof *F);
    const bool known = transfer_chain(p, theta, channel, F, &ignored) == BF_OK;
    if (known) {
        size_t parameter;
        const double gain = input_gain(&run, input, &parameter);
        recorder_undo(plan->A, m, F); /* it has filtered the input, too */
        response_value(p->kernels[plan->grid], output_order(p->model.outputs[c->output].kind),
                       p->outputs[c->output].alpha, p->inputs[plan->source[input]].alpha, H);
        for (size_t k = 0; k < m; k++)
            H[k] *= gain * F[k];
    }
    free(F);
    return known;
}

void transfer_force(const struct predictor *p, size_t grid_index, size_t output, const double g[], double complex H[])
{
    double complex *alpha = bf_alloc(p->system->n_poles, sizeof *alpha);
    system_functional(p->system, g, alpha);
    response_value(p->kernels[grid_index], output_order(p->model.outputs[output].kind), p->outputs[output].alpha, alpha,
                   H);
    free(alpha);
}

bool transfer_stiffness_change(const struct predictor *p, const struct transfer_modes *modes, size_t parameter,
                               double *D[3])
{
    return system_modal_change(p->system, modes->n, modes->shape, parameter, D);
}

size_t transfer_gain_parameter(const struct predictor *p, size_t channel)
{
    return p->model.outputs[p->channels[channel].output].kind == OUTPUT_PATCH_STRAIN ? p->map.Ks : SIZE_MAX;
}
