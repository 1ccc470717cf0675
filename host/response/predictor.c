/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A predictor's life: made for records and a model, given a base and a window, freed. */
#include "predictor.h"
#include "predict_pieces.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* The reduced space holds the modes up to this multiple of the highest sampling frequency. */
static const double modes_to_sampling = 2.0;
enum { FEWEST_MODES = 8, MOST_MODES = 40 };

/* A record that cannot show the first mode was probably written in another unit of time. */
static void warn_of_time(const struct predictor *p)
{
    size_t first = 0;
    while (first < p->reduced.n_modes && !(p->reduced.frequency_rad[first] > 1.0)) /* rigid modes of a free beam */
        first++;
    if (first == p->reduced.n_modes)
        return;
    double f_Hz = p->reduced.frequency_rad[first] / (2.0 * M_PI);
    for (size_t r = 0; r < p->n_records; r++) {
        const struct record *record = &p->records[r];
        if (record_is_periodic(record))
            continue; /* its times are made of the lines' frequencies */
        if (0.5 / record->dt_s < f_Hz)
            bf_warn("%s: time_s steps by %.4g s, too slow for the first mode at %.4g Hz; is it in milliseconds?",
                    record->path, record->dt_s, f_Hz);
        else if ((double)record->n * record->dt_s * f_Hz < 1.0)
            bf_warn("%s: time_s covers %.4g s, less than a period of the first mode at %.4g Hz; is it in seconds?",
                    record->path, (double)record->n * record->dt_s, f_Hz);
    }
}

enum bf_status single_new(const struct model *model, const struct record records[], size_t n_records,
                          const struct predict_options *options, struct predictor **out, struct bf_error *err)
{
    struct predictor *p = bf_alloc(1, sizeof *p);
    *p = (struct predictor){.records = records, .n_records = n_records, .t_end_s = INFINITY};
    if (options != NULL)
        p->options = *options;
    if (p->options.oversample <= 0)
        p->options.oversample = model->steps_per_sample;
    p->plans = bf_alloc(n_records, sizeof *p->plans);
    p->first_state = bf_alloc(n_records + 1, sizeof *p->first_state);
    enum bf_status status = model_copy(model, &p->model, err);
    if (status == BF_OK)
        status = predictor_bind(p, err);
    if (status == BF_OK) {
        const char **names = record_base_names(records, n_records);
        size_t n = model_parameters(&p->model, names, n_records, &p->refs);
        free(names);
        p->map = parameter_map_new(&p->model, p->refs, n, n_records);
        p->structural = bf_alloc(n, sizeof *p->structural);
        geometry_new(p);
        double *theta = bf_alloc(n, sizeof *theta);
        for (size_t i = 0; i < n; i++)
            theta[i] = p->refs[i].value;
        status = single_rebase(p, theta, err);
        free(theta);
    }
    if (status == BF_OK) {
        p->in_pieces = pieces_wanted(p);
        status = single_window(p, INFINITY, err);
    }
    if (status != BF_OK) {
        single_free(p);
        return status;
    }
    if (!p->options.quiet)
        warn_of_time(p);
    *out = p;
    return BF_OK;
}

/* ---- Freeing ---- */

void kernels_new(struct predictor *p)
{
    for (size_t g = 0; g < p->n_grids; g++) {
        p->force_kernels[g] = p->kernels[g] = response_kernel_new(p->system, &p->grids[g]);
        if (!p->nonlinear || p->grids[g].intersample == INTERSAMPLE_BAND_LIMITED)
            continue;
        p->force_grids[g] = p->grids[g];
        p->force_grids[g].intersample = INTERSAMPLE_BAND_LIMITED;
        p->force_kernels[g] = response_kernel_new(p->system, &p->force_grids[g]);
    }
}

void kernels_free(struct predictor *p)
{
    for (size_t g = 0; p->kernels != NULL && g < p->n_grids; g++) {
        if (p->force_kernels[g] != p->kernels[g])
            response_kernel_free(p->force_kernels[g]);
        response_kernel_free(p->kernels[g]);
        p->kernels[g] = p->force_kernels[g] = NULL;
    }
}

static void free_grids(struct predictor *p)
{
    kernels_free(p);
    free(p->kernels);
    free(p->force_kernels);
    free(p->force_grids);
    p->kernels = p->force_kernels = NULL;
    p->force_grids = NULL;
    for (size_t g = 0; g < p->n_grids; g++)
        response_grid_free(&p->grids[g]);
    free(p->grids);
    p->grids = NULL;
    p->n_grids = 0;
}

static void free_base(struct predictor *p)
{
    kernels_free(p);
    functionals_free(&p->coordinates, p->n_coordinates);
    laws_free(p);
    functionals_free(&p->inputs, p->n_sources);
    functionals_free(&p->outputs, p->model.n_outputs);
    functionals_free(&p->base_load, 1);
    system_free(p->system);
    p->system = NULL;
    reduced_free(&p->reduced);
}

static void plan_free(struct record_plan *plan, size_t n_inputs)
{
    for (size_t i = 0; plan->U != NULL && i < n_inputs; i++) {
        free(plan->recorded[i]);
        free(plan->driven[i]);
    }
    for (size_t c = 0; c < plan->n_changes; c++)
        free(plan->changes[c].U);
    free(plan->changes);
    free(plan->A);
    free(plan->recorded);
    free(plan->driven);
    free(plan->U);
    free(plan->input);
    free(plan->source);
}

void single_free(struct predictor *p)
{
    if (p == NULL)
        return;
    free_grids(p);
    free_base(p);
    for (size_t r = 0; r < p->n_records; r++)
        plan_free(&p->plans[r], p->model.n_inputs);
    geometry_free(p);
    free(p->sources);
    free(p->structural);
    free(p->filled);
    free(p->plans);
    free(p->channels);
    free(p->refs);
    parameter_map_free(&p->map);
    free(p->y);
    free(p->jacobian);
    free(p->nuisance);
    states_free(p);
    model_free(&p->model);
    free(p);
}

size_t predictor_channels(const struct predictor *p, const struct predict_channel **out)
{
    *out = p->channels;
    return p->n_channels;
}

size_t predictor_modes(const struct predictor *p)
{
    return p->reduced.n_modes;
}

/* ---- Base and window ---- */

enum bf_status single_rebase(struct predictor *p, const double parameters[], struct bf_error *err)
{
    double dt = INFINITY;
    for (size_t r = 0; r < p->n_records; r++)
        dt = fmin(dt, p->records[r].dt_s);
    struct reduced_options options = {.n_splines = p->options.fine_splines,
                                      .top_rad = modes_to_sampling * 2.0 * acos(-1.0) / dt,
                                      .min_modes = FEWEST_MODES,
                                      .max_modes = MOST_MODES,
                                      .statics = 2,
                                      .uniform = p->options.uniform_splines};
    if (p->options.modes > 0)
        options.min_modes = options.max_modes = p->options.modes;
    free_base(p);
    predictor_use(p, parameters);
    enum bf_status status = geometry_place(p, parameters, err);
    if (status == BF_OK)
        status = reduced_new(&p->model, &options, &p->reduced, err);
    if (status == BF_OK)
        status = system_new(&p->model, &p->reduced, &p->map, &p->system, err);
    if (status == BF_OK)
        status = system_evaluate(p->system, parameters, NULL, err);
    if (status == BF_OK)
        status = geometry_rebase(p, err);
    if (status != BF_OK)
        return status;
    states_count(p);
    return laws_new(p, err);
}

/* The grid has the record's samples and, of a steady state, its window. */
static bool fits(const struct response_grid *grid, const struct record_plan *plan)
{
    const bool same_window = !plan->periodic || !not_zero(grid->sigma - record_window_rate(plan->record));
    return grid->n == plan->n && fabs(grid->dt_s - plan->record->dt_s) < 1e-12 * grid->dt_s &&
           grid->periodic == plan->periodic && same_window;
}

static enum bf_status find_grid(struct predictor *p, struct record_plan *plan, struct bf_error *err)
{
    for (size_t g = 0; g < p->n_grids; g++) {
        const struct response_grid *grid = &p->grids[g];
        if (fits(grid, plan)) {
            plan->grid = g;
            return BF_OK;
        }
    }
    p->grids = bf_grow(p->grids, p->n_grids + 1, sizeof *p->grids);
    plan->grid = p->n_grids;
    struct response_grid *grid = &p->grids[p->n_grids];
    const enum bf_status status =
        plan->periodic
            ? response_grid_periodic(plan->n, plan->record->dt_s, record_window_rate(plan->record), grid, err)
            : response_grid_new(plan->n, plan->record->dt_s, p->options.intersample, grid, err);
    if (status != BF_OK)
        return status;
    if (p->whole > 0)
        grid->fade_rate = response_grid_rate(p->whole, grid->intersample);
    p->n_grids++;
    return BF_OK;
}

static enum bf_status window_record(struct predictor *p, size_t r, struct bf_error *err)
{
    struct record_plan *plan = &p->plans[r];
    size_t available = plan->record->n - plan->start;
    double wanted = ceil(p->t_end_s / plan->record->dt_s);
    plan->n = wanted < (double)available && !plan->periodic ? (size_t)fmax(wanted, 2.0) : available;
    enum bf_status status = p->in_pieces ? BF_OK : find_grid(p, plan, err);
    if (status != BF_OK || p->in_pieces)
        return status;
    const struct response_grid *grid = &p->grids[plan->grid];
    plan->A = recorder_line(&plan->recorder, grid, plan->A);
    double *x = bf_alloc(grid->n + 2 * grid->n_tail, sizeof *x), *before = x + grid->n + grid->n_tail;
    for (size_t i = 0; status == BF_OK && i < p->model.n_inputs; i++) {
        if (plan->input[i] == NULL)
            continue;
        plan->U[i] = plan->recorded[i] = bf_grow(plan->recorded[i], grid->m, sizeof *plan->U[i]);
        response_tail(grid, plan->input[i] + plan->start, available, x);
        if (plan->free_state)
            response_lead(grid, plan->input[i] + plan->start, available, before);
        status =
            response_transform_led(grid, x, grid->n + grid->n_tail, plan->free_state ? before : NULL, plan->U[i], err);
    }
    free(x);
    return status;
}

enum bf_status single_window(struct predictor *p, double t_end_s, struct bf_error *err)
{
    free_grids(p);
    p->t_end_s = t_end_s;
    p->n_rows = 0;
    enum bf_status status = BF_OK;
    for (size_t r = 0; status == BF_OK && r < p->n_records; r++) {
        struct record_plan *plan = &p->plans[r];
        status = window_record(p, r, err);
        for (size_t c = 0; c < plan->n_channels; c++) {
            struct predict_channel *channel = &p->channels[plan->first_channel + c];
            channel->row = p->n_rows;
            channel->n = plan->n;
            p->n_rows += plan->n;
        }
    }
    p->kernels = bf_alloc(p->n_grids, sizeof(struct response_kernel *));
    p->force_kernels = bf_alloc(p->n_grids, sizeof(struct response_kernel *));
    p->force_grids = bf_alloc(p->n_grids, sizeof *p->force_grids);
    p->y = bf_grow(p->y, p->n_rows, sizeof *p->y);
    p->jacobian = bf_grow(p->jacobian, p->n_rows * p->map.n, sizeof *p->jacobian);
    p->nuisance = bf_grow(p->nuisance, p->n_rows * p->n_nuisance, sizeof *p->nuisance);
    p->states_are_clear = false;
    return status;
}

void single_rest(struct predictor *p)
{
    kernels_free(p);
    free(p->jacobian), free(p->nuisance);
    p->jacobian = p->nuisance = NULL;
}

void single_room(struct predictor *p, bool with_jacobian)
{
    if (p->nuisance == NULL) {
        p->nuisance = bf_grow(NULL, p->n_rows * p->n_nuisance, sizeof *p->nuisance);
        p->states_are_clear = false;
    }
    if (with_jacobian && p->jacobian == NULL)
        p->jacobian = bf_grow(NULL, p->n_rows * p->map.n, sizeof *p->jacobian);
}

void single_set_nuisance(struct predictor *p, const double amplitude[])
{
    memcpy(p->amplitude, amplitude, p->n_nuisance * sizeof *amplitude);
}
