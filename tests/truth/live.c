/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The beam in lock step with a controller: converters, one sample interval at a time. A linear beam is stepped by its
 * complex modes, exactly for a held drive; any other by CVODE, started anew at each jump of the drive.
 */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct truth_plant {
    struct truth_spec spec;
    struct truth_system system;
    struct truth_drive drive;
    struct truth_link link[TRUTH_EFFECTS];
    struct truth_section section[TRUTH_SECTIONS];
    size_t n_sections, oversampling;
    double dt_s;   /* of a fine step */
    uint64_t step; /* fine steps since the beginning */
    double u[TRUTH_PORTS + 1], sensor;
    struct truth_ode *ode; /* NULL: linear */
    struct truth_mode *mode;
    double complex *z; /* [n_kept] */
    size_t n_kept;
    double *D; /* [n_outputs × n_inputs] */
    double *rest;
    struct truth_random random;
    struct truth_noise noise;
};

static int refuse(const struct truth_spec *spec, char *message)
{
    if (spec->n_inputs < 1 || spec->n_outputs < 1)
        return truth_fail(message, "lock step needs an input and an output");
    if (spec->filter_order > 0 && !spec->filter_causal)
        return truth_fail(message, "lock step: a filter cannot run backwards: filter_order 0, or filter_causal 1");
    if (truth_effect_find(spec, TRUTH_SENSOR_DELAY) || truth_effect_find(spec, TRUTH_DELAYED_FEEDBACK))
        return truth_fail(message,
                          "lock step knows no delays: sensor_delay and delayed_feedback need the whole record");
    return 0;
}

/* The drive is the only input that jumps; the clamp moves smoothly. */
static int make_linear(struct truth_plant *p, char *message)
{
    const struct truth_system *s = &p->system;
    p->mode = calloc(s->n_states, sizeof *p->mode);
    p->z = calloc(s->n_states, sizeof *p->z);
    p->D = truth_array(s->n_outputs * s->n_inputs);
    p->rest = truth_array(2 * s->n_states);
    if (!p->mode || !p->z)
        abort();
    p->n_kept = truth_modes_make(s, p->dt_s, p->mode, p->D, message);
    return p->n_kept > 0 ? 0 : -1;
}

struct truth_plant *truth_plant_new(const struct truth_spec *spec, char message[TRUTH_MESSAGE])
{
    struct truth_plant *p = calloc(1, sizeof *p);
    struct truth_grid grid;
    if (!p)
        abort();
    p->spec = *spec;
    truth_grid_make(spec, &grid);
    p->dt_s = grid.dt_s;
    p->oversampling = grid.oversampling;
    p->n_sections = truth_filter_make(spec, grid.oversampling, p->section);
    truth_random_seed(&p->random, spec->seed, 1);
    truth_noise_begin(&p->noise, spec->noise_ar, &p->random);
    int status = refuse(spec, message);
    status = status == 0 ? truth_system_make(spec, &p->system, message) : status;
    for (size_t k = 0; k < spec->n_inputs; k++)
        p->system.held[k] = true;
    if (status == 0 && (spec->force_ode || truth_effects_nonlinear(spec)))
        status = (p->ode = truth_ode_new(&p->system, &p->spec, message)) ? 0 : -1;
    else if (status == 0)
        status = make_linear(p, message);
    if (status == 0)
        return p;
    truth_plant_free(p);
    return NULL;
}

static double base_at(const struct truth_system *s, double t_s)
{
    return s->base_amplitude_mps2 * sin(s->base_radps * t_s + s->base_phase_rad);
}

static double linear_step(struct truth_plant *p, double t_s)
{
    const struct truth_system *s = &p->system;
    size_t base = s->n_inputs - 1;
    double begin = base_at(s, t_s - p->dt_s), middle = base_at(s, t_s - p->dt_s / 2), y[TRUTH_PORTS];
    p->u[base] = base_at(s, t_s);
    truth_system_observe(s, t_s, p->rest, p->rest + s->n_states, y);
    for (size_t m = 0; m < p->n_kept; m++) {
        const struct truth_mode *mode = &p->mode[m];
        double complex z = mode->step * p->z[m] + mode->begin[base] * begin + mode->middle[base] * middle +
                           mode->end[base] * p->u[base];
        for (size_t k = 0; k < base; k++)
            z += mode->middle[k] * p->u[k];
        p->z[m] = z;
        y[0] += creal(mode->out[0] * z);
    }
    for (size_t k = 0; k < s->n_inputs; k++)
        y[0] += p->D[k] * p->u[k];
    return y[0];
}

/* Sensor effects and anti-alias filter of the first output. */
static double measure(struct truth_plant *p, double t_s, double nominal, double y)
{
    for (size_t e = 0; e < p->spec.n_effects; e++)
        if (p->spec.effect[e].output == TRUTH_ALL_CHANNELS || p->spec.effect[e].output == 0)
            y = truth_link_step(&p->spec.effect[e], &p->link[e], p->dt_s, t_s, nominal, y);
    for (size_t k = 0; k < p->n_sections; k++)
        y = truth_section_step(&p->section[k], y);
    return y;
}

static uint16_t convert(struct truth_plant *p)
{
    const struct truth_live *live = &p->spec.live;
    double y = p->sensor * p->spec.output[0].gain;
    if (live->noise_rms > 0)
        y += live->noise_rms * truth_noise_next(&p->noise) / p->noise.deviation;
    return (uint16_t)fmin(fmax(nearbyint(live->sensor_zero_code + y / live->sensor_per_code), 0), live->code_max);
}

int truth_plant_tick(struct truth_plant *p, uint16_t drive_code, uint16_t *sensor_code, char message[TRUTH_MESSAGE])
{
    double nominal = (drive_code - p->spec.live.drive_zero_code) * p->spec.live.drive_per_code;
    bool patch = p->spec.input[0].kind == TRUTH_PATCH_MOMENT;
    p->u[0] = nominal;
    if (patch)
        truth_drive_distort(&p->spec, &p->drive, 1, &p->u[0]);
    if (p->ode && truth_ode_hold(p->ode, p->u) < 0)
        return truth_fail(message, "CVODE cannot start anew");
    for (size_t i = 0; i < p->oversampling; i++) {
        double t_s = (double)++p->step * p->dt_s, y[TRUTH_PORTS];
        if (!p->ode)
            y[0] = linear_step(p, t_s);
        else if (truth_ode_advance(p->ode, t_s, y) < 0)
            return truth_fail(message, "CVODE stopped at %g s", t_s);
        p->sensor = measure(p, t_s, patch ? nominal : 0, y[0]);
    }
    *sensor_code = convert(p);
    return 0;
}

double truth_plant_sensor(const struct truth_plant *p)
{
    return p->sensor;
}

void truth_plant_free(struct truth_plant *p)
{
    if (!p)
        return;
    truth_ode_free(p->ode);
    truth_system_free(&p->system);
    free(p->mode);
    free(p->z);
    free(p->D);
    free(p->rest);
    free(p);
}
