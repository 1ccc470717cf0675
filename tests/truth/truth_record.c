/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Simulation as a whole, noise and ADC, and the CSV. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void truth_grid_make(const struct truth_spec *spec, struct truth_grid *grid)
{
    enum { MARGIN = 96 }; /* samples beyond each end: the filter's ringing falls below 1e-12 within them */
    const struct truth_effect *clock = truth_effect_find(spec, TRUTH_CLOCK_ERROR);
    size_t over = spec->oversampling;
    if (over == 0) {
        over = (size_t)ceil(16384 / spec->sample_rate_Hz);
        over = over < 16 ? 16 : over;
    }
    double interval_s = (1 + (clock ? clock->parameter[0] : 0)) / spec->sample_rate_Hz;
    grid->oversampling = over;
    grid->n_record = (size_t)llround(spec->duration_s * spec->sample_rate_Hz);
    grid->lead = MARGIN * over;
    grid->n = (grid->n_record + 2 * MARGIN) * over + 1;
    grid->dt_s = interval_s / (double)over;
    grid->t0_s = -(double)grid->lead * grid->dt_s;
}

/* Fine signals: nominal inputs, what reaches the beam, outputs. */
struct fine {
    double *nominal[TRUTH_PORTS], *u[TRUTH_PORTS + 1], *y[TRUTH_PORTS];
};

static void fine_make(const struct truth_spec *spec, const struct truth_grid *grid, struct fine *fine)
{
    size_t n = 2 * grid->n - 1;
    const struct truth_effect *base = truth_effect_find(spec, TRUTH_BASE_MOTION);
    *fine = (struct fine){0};
    for (size_t k = 0; k < spec->n_inputs; k++) {
        struct truth_drive drive = {0};
        fine->nominal[k] = truth_array(n);
        for (size_t i = 0; i < spec->n_signals; i++)
            if (spec->signal[i].input == k)
                truth_signal_add(&spec->signal[i], spec, grid, fine->nominal[k]);
        for (size_t i = 1; spec->linear_hold && i < n; i += 2)
            fine->nominal[k][i] = (fine->nominal[k][i - 1] + fine->nominal[k][i + 1]) / 2;
        fine->u[k] = truth_array(n);
        memcpy(fine->u[k], fine->nominal[k], n * sizeof(double));
        if (spec->input[k].kind == TRUTH_PATCH_MOMENT)
            truth_drive_distort(spec, &drive, n, fine->u[k]);
    }
    fine->u[spec->n_inputs] = truth_array(n);
    for (size_t i = 2 * grid->lead; base && i < n; i++)
        fine->u[spec->n_inputs][i] =
            base->parameter[0] *
            sin(2 * TRUTH_PI * base->parameter[2] * (grid->t0_s + (double)i * grid->dt_s / 2) + base->parameter[1]);
    for (size_t k = 0; k < spec->n_outputs; k++)
        fine->y[k] = truth_array(grid->n);
}

static void fine_free(struct fine *fine)
{
    for (size_t k = 0; k < TRUTH_PORTS; k++) {
        free(fine->nominal[k]);
        free(fine->u[k]);
        free(fine->y[k]);
    }
    free(fine->u[TRUTH_PORTS]);
}

static void add_channel(const struct truth_spec *spec, const struct truth_grid *grid, const struct truth_port *port,
                        bool is_input, double *fine, struct truth_record *record)
{
    struct truth_channel *channel = &record->channel[record->n_channels++];
    size_t skip = grid->n_record - record->n;
    double *samples = truth_array(grid->n_record);
    truth_acquire(spec, grid, fine, samples);
    *channel = (struct truth_channel){.is_input = is_input, .x = truth_array(record->n)};
    channel->noise = port->noise >= 0 ? port->noise : is_input ? spec->input_noise : spec->noise;
    memcpy(channel->name, port->name, sizeof channel->name);
    for (size_t i = 0; i < record->n; i++)
        channel->x[i] = port->gain * samples[skip + i];
    free(samples);
}

/* The voltage that a sensor's wires saw, on the doubled grid; where it jumps, before the jump. NULL: no drive. */
static double *wire_voltage(const struct truth_spec *spec, const struct truth_grid *grid, const struct fine *fine,
                            const bool held[])
{
    double *drive = NULL;
    for (size_t k = 0; k < spec->n_inputs; k++) {
        if (spec->input[k].kind != TRUTH_PATCH_MOMENT)
            continue;
        size_t n = 2 * grid->n - 1, late = held[k] ? 1 : 0;
        free(drive);
        drive = truth_array(n);
        memcpy(drive + late, fine->nominal[k], (n - late) * sizeof *drive);
    }
    return drive;
}

static void collect(const struct truth_spec *spec, const struct truth_grid *grid, struct fine *fine, const bool held[],
                    struct truth_record *record)
{
    double *drive = wire_voltage(spec, grid, fine, held);
    size_t skip = (size_t)llround(spec->keep_from_s * spec->sample_rate_Hz);
    record->n = grid->n_record - (skip < grid->n_record ? skip : grid->n_record - 1);
    record->rate_Hz = spec->sample_rate_Hz;
    for (size_t k = 0; k < spec->n_outputs; k++)
        truth_chain_apply(spec, k, grid, drive, fine->y[k]);
    free(drive);
    for (size_t k = 0; k < spec->n_inputs; k++) {
        if (spec->input[k].omitted)
            continue;
        for (size_t i = 0; i < grid->n; i++) /* from the doubled grid, in place */
            fine->nominal[k][i] = fine->nominal[k][2 * i];
        add_channel(spec, grid, &spec->input[k], true, fine->nominal[k], record);
    }
    for (size_t k = 0; k < spec->n_outputs; k++)
        add_channel(spec, grid, &spec->output[k], false, fine->y[k], record);
}

int truth_simulate(const struct truth_spec *spec, struct truth_record *clean, char message[TRUTH_MESSAGE])
{
    struct truth_system system;
    struct truth_grid grid;
    struct fine fine;
    *clean = (struct truth_record){0};
    if (truth_system_make(spec, &system, message) != 0) {
        truth_system_free(&system);
        return -1;
    }
    for (size_t i = 0; i < spec->n_signals; i++)
        if (spec->signal[i].kind == TRUTH_HELD)
            system.held[spec->signal[i].input] = true;
    truth_grid_make(spec, &grid);
    fine_make(spec, &grid, &fine);
    int status = spec->force_ode || truth_effects_nonlinear(spec)
                     ? truth_solve_ode(&system, spec, &grid, fine.u, fine.y, message)
                     : truth_solve_linear(&system, &grid, fine.u, fine.y, message);
    if (status == 0)
        collect(spec, &grid, &fine, system.held, clean);
    fine_free(&fine);
    truth_system_free(&system);
    return status;
}

int truth_modes(const struct truth_spec *spec, size_t n, double frequency_Hz[], double damping_ratio[],
                char message[TRUTH_MESSAGE])
{
    struct truth_system system;
    int status = n <= spec->modes ? truth_system_make(spec, &system, message)
                                  : truth_fail(message, "only %zu modes are kept", spec->modes);
    if (n > spec->modes)
        return status;
    for (size_t j = 0; status == 0 && j < n; j++) {
        frequency_Hz[j] = system.omega[j] / (2 * TRUTH_PI);
        damping_ratio[j] = system.omega[j] > 0 ? system.damping[j * system.n_modes + j] / (2 * system.omega[j]) : 0;
    }
    truth_system_free(&system);
    return status;
}

static double rms(size_t n, const double *x)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / (double)n);
}

static void add_noise(const struct truth_spec *spec, double level, struct truth_random *random, size_t n, double *x)
{
    struct truth_noise noise;
    truth_noise_begin(&noise, spec->noise_ar, random);
    for (size_t i = 0; i < n; i++)
        x[i] += level * truth_noise_next(&noise) / noise.deviation;
}

/* Rounds to full scale / 2^(bits − 1), full scale = headroom × the largest value. */
static void quantise(const struct truth_spec *spec, size_t n, double *x)
{
    double largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(x[i]));
    double step = spec->adc_headroom * largest / ldexp(1, (int)spec->adc_bits - 1);
    for (size_t i = 0; step > 0 && i < n; i++)
        x[i] = step * nearbyint(x[i] / step) + 0.0; /* no −0 */
}

void truth_measure(const struct truth_spec *spec, const struct truth_record *clean, uint64_t seed,
                   struct truth_record *out)
{
    *out = *clean;
    for (size_t c = 0; c < clean->n_channels; c++) {
        struct truth_channel *channel = &out->channel[c];
        struct truth_random random;
        channel->x = truth_array(clean->n);
        memcpy(channel->x, clean->channel[c].x, clean->n * sizeof(double));
        truth_random_seed(&random, seed, c + 1);
        if (channel->noise > 0)
            add_noise(spec, channel->noise * rms(clean->n, channel->x), &random, clean->n, channel->x);
        if (spec->adc_bits > 0 && (spec->adc_inputs || !channel->is_input))
            quantise(spec, clean->n, channel->x);
    }
}

const double *truth_record_channel(const struct truth_record *record, const char *name)
{
    for (size_t c = 0; c < record->n_channels; c++)
        if (strcmp(record->channel[c].name, name) == 0)
            return record->channel[c].x;
    return NULL;
}

void truth_record_free(struct truth_record *record)
{
    for (size_t c = 0; c < record->n_channels; c++)
        free(record->channel[c].x);
    *record = (struct truth_record){0};
}
