/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "predict_work.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void source_response(const struct run *run, size_t record, const struct functional *f, double complex W[])
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    size_t m = p->grids[plan->grid].m;
    double complex *H = bf_grow(NULL, m, sizeof *H);
    memset(W, 0, m * sizeof *W);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        size_t parameter;
        if (plan->input[i] == NULL)
            continue;
        double gain = input_gain(run, i, &parameter);
        response_value(p->kernels[plan->grid], 0, f->alpha, p->inputs[plan->source[i]].alpha, H);
        for (size_t k = 0; k < m; k++)
            W[k] += gain * (H[k] * plan->U[i][k]);
    }
    free(H);
}

/* dW += scale · H · U of one input. */
static void add_path(const struct run *run, const struct record_plan *plan, const struct functional *f,
                     const struct functional *b, double scale, const double complex U[], double complex H[],
                     double complex dW[])
{
    size_t m = run->p->grids[plan->grid].m;
    response_value(run->p->kernels[plan->grid], 0, f->alpha, b->alpha, H);
    for (size_t k = 0; k < m; k++)
        dW[k] += scale * (H[k] * U[k]);
}

static void add_structural(const struct run *run, const struct record_plan *plan, const struct functional *f,
                           size_t input, size_t parameter, double complex H[], double complex dW[])
{
    const struct predictor *p = run->p;
    const struct functional *b = &p->inputs[plan->source[input]];
    size_t m = p->grids[plan->grid].m, n_poles = p->system->n_poles, gain_parameter;
    double gain = input_gain(run, input, &gain_parameter);
    response_derivative(p->kernels[plan->grid], 0, f->alpha, b->alpha, f->d_alpha + parameter * n_poles,
                        b->d_alpha + parameter * n_poles, p->system->derivative[parameter].p, H);
    for (size_t k = 0; k < m; k++)
        dW[k] += gain * (H[k] * plan->U[input][k]);
}

bool source_response_derivative(const struct run *run, size_t record, const struct functional *f, size_t parameter,
                                double complex dW[])
{
    const struct predictor *p = run->p;
    const struct record_plan *plan = &p->plans[record];
    bool structural = run_structural(run, parameter), any = structural || source_depends(run, record, parameter);
    if (!any)
        return false;
    size_t m = p->grids[plan->grid].m;
    double complex *H = bf_grow(NULL, m, sizeof *H);
    memset(dW, 0, m * sizeof *dW);
    for (size_t i = 0; i < p->model.n_inputs; i++) {
        size_t gain_parameter;
        if (plan->input[i] == NULL)
            continue;
        (void)input_gain(run, i, &gain_parameter);
        if (structural)
            add_structural(run, plan, f, i, parameter, H, dW);
        else if (gain_parameter == parameter)
            add_path(run, plan, f, &p->inputs[plan->source[i]], 1.0, plan->U[i], H, dW);
    }
    for (size_t c = 0; c < plan->n_changes; c++) {
        const struct drive_change *change = &plan->changes[c];
        size_t gain_parameter;
        if (change->parameter == parameter)
            add_path(run, plan, f, &p->inputs[plan->source[change->input]],
                     input_gain(run, change->input, &gain_parameter), change->U, H, dW);
    }
    free(H);
    return true;
}

/* A parameter of a shaken clamp. */
static bool shakes(const struct predictor *p, size_t record, size_t parameter)
{
    for (size_t e = 0; e < p->model.n_effects; e++)
        for (int s = 0; p->model.effects[e].effect->tone != NULL && s < BEAM_EFFECT_PARAMETERS; s++)
            if (parameter_map_slot(&p->map, record, e, s) == parameter)
                return true;
    return false;
}

bool source_depends(const struct run *run, size_t record, size_t parameter)
{
    const struct predictor *p = run->p;
    if (!run_wants(run, parameter))
        return false;
    if (parameter == p->map.KB)
        return true;
    for (size_t c = 0; c < p->plans[record].n_changes; c++)
        if (p->plans[record].changes[c].parameter == parameter)
            return true;
    return shakes(p, record, parameter);
}
