/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_records.c — what is fitted: inputs and channels of the records on their Laplace lines. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool is_free_decay(const struct record *record)
{
    const char *excitation = record_meta(record, "excitation");
    return excitation != NULL && strcmp(excitation, "free_decay") == 0;
}

/* Residues of this record alone: its level is unknown, or a channel was elsewhere than in the others. */
static bool own_residues(const struct model *model, const struct record *record, const struct model_input *input)
{
    const char *excitation = record_meta(record, "excitation");
    return input->level_per_record || record_has_places(model, record) ||
           (excitation != NULL && strcmp(excitation, "unknown_level") == 0);
}

/* y[grid->n + n_tail]: x[n] with a run-up of `lead` samples before it and a run-out after it: it begins and ends in no step. */
static void extend(const struct response_grid *grid, const double x[], size_t n, size_t lead, double y[])
{
    double *turned = bf_alloc(n, sizeof *turned), *long_one = bf_alloc(n + 2 * grid->n_tail, sizeof *long_one);
    struct response_grid back = *grid; /* of n samples: the run-up is the run-out of the record turned round */
    back.n = n;
    for (size_t k = 0; k < n; k++)
        turned[k] = x[n - 1 - k];
    response_tail(&back, turned, n, long_one);
    for (size_t k = 0; k < lead; k++)
        y[lead - 1 - k] = long_one[n + k];
    memcpy(y + lead, x, n * sizeof *y);
    memcpy(long_one, y, (lead + n) * sizeof *y);
    response_tail(grid, long_one, lead + n, y);
    free(turned), free(long_one);
}

static enum bf_status transform(const struct attainable_record *r, const double x[], double complex **out,
                                struct bf_error *err)
{
    const size_t count = r->lead + r->n + r->grid.n_tail;
    double *y = bf_alloc(count, sizeof *y);
    *out = bf_alloc(r->grid.m, sizeof **out);
    extend(&r->grid, x, r->n, r->lead, y);
    const enum bf_status status = response_transform(&r->grid, y, count, *out, err);
    free(y);
    return status;
}

static enum bf_status add_source(struct attainable_record *r, const double u[], size_t slot, struct bf_error *err)
{
    struct attainable_source *source = &r->sources[r->n_sources++];
    source->slot = slot;
    enum bf_status status = transform(r, u, &source->U, err);
    double complex *F = bf_alloc(r->grid.m, sizeof *F);
    double *y = bf_alloc(r->grid.n, sizeof *y);
    if (status == BF_OK)
        memcpy(F, source->U, r->grid.m * sizeof *F);
    for (size_t k = 0; k < ATTAINABLE_PATHS; k++) {
        source->path[k] = bf_alloc(r->n, sizeof *source->path[k]);
        if (status == BF_OK)
            status = response_back(&r->grid, F, y, err);
        memcpy(source->path[k], k == 0 ? u : y + r->lead, r->n * sizeof *y);
        for (size_t i = 0; i < r->grid.m; i++)
            F[i] *= r->grid.s[i];
    }
    free(F), free(y);
    return status;
}

/* Its first samples are louder than noise (times `clearly`), and no trifle (a share of the rms): the noise may be underrated. */
static bool in_motion(const struct attainable_data *data, size_t n)
{
    static const double clearly = 5.0; /* times the noise: not one of 10,000 samples of noise */
    static const double trifle = 0.01; /* of the channel's rms: what it may cost to take a slight motion for rest */
    for (size_t k = 0; k < 3 && k < n; k++)
        if (fabs(data->z[k]) > fmax(clearly * data->noise, trifle * data->rms))
            return true;
    return false;
}

static size_t first_sample(const struct record *record)
{
    const char *from = record_meta(record, "free_from_s");
    double from_s = 0.0;
    if (!is_free_decay(record) || from == NULL || !number_parse(from, from + strlen(from), '.', &from_s))
        return 0;
    const double samples = ceil((from_s - record->t0_s) / record->dt_s);
    return samples > 0.0 && samples < (double)record->n ? (size_t)samples : 0;
}

static enum bf_status find_noise(const struct model *model, const struct record *record, const char *channel,
                                 double *rms, struct bf_error *err)
{
    struct noise_estimate noise;
    const enum bf_status status = noise_of_channel(model, record, channel, &noise, err);
    *rms = status == BF_OK ? noise.rms : 0.0;
    if (status == BF_OK)
        noise_free(&noise);
    return status;
}

/* What moves already has a run-up; one period of a steady state needs none. */
static enum bf_status make_grid(struct attainable_record *r, const struct record *record, struct bf_error *err)
{
    if (record_is_periodic(record)) {
        r->moving = false;
        return response_grid_periodic(r->n, record->dt_s, record_window_rate(record), &r->grid, err);
    }
    const enum bf_status status = response_grid_new(r->n, record->dt_s, INTERSAMPLE_BAND_LIMITED, &r->grid, err);
    if (status != BF_OK || !r->moving)
        return status;
    r->lead = r->grid.n_tail;
    response_grid_free(&r->grid);
    return response_grid_new(r->lead + r->n, record->dt_s, INTERSAMPLE_BAND_LIMITED, &r->grid, err);
}

enum bf_status attainable_add_record(struct attainable_problem *p, const struct model *model,
                                     const struct record *record, size_t index, const double noise_rms[],
                                     struct bf_error *err)
{
    const size_t from = first_sample(record), outputs = model->n_outputs;
    const bool decay = is_free_decay(record);
    struct attainable_record *r = &p->records[p->n_records++];
    enum bf_status status = BF_OK;
    *r = (struct attainable_record){.n = record->n - from, .moving = record_state_is_free(record)};
    r->sources = bf_alloc(model->n_inputs + 1, sizeof *r->sources);
    r->data = bf_alloc(outputs + 1, sizeof *r->data);
    for (size_t o = 0; o < outputs && status == BF_OK; o++) {
        const double *z = record_column(record, model->outputs[o].name);
        const double rms = z != NULL ? root_mean_square(z + from, r->n) : 0.0;
        if (!(rms > 0.0))
            continue;
        struct attainable_data *data = &r->data[r->n_data++];
        *data = (struct attainable_data){.record = index, .output = o, .z = z + from, .rms = rms};
        if (noise_rms != NULL)
            data->noise = noise_rms[index * outputs + o];
        else
            status = find_noise(model, record, model->outputs[o].name, &data->noise, err);
        r->moving = r->moving || in_motion(data, r->n);
    }
    p->n_channels += r->n_data;
    if (status == BF_OK)
        status = make_grid(r, record, err);
    for (size_t i = 0; i < model->n_inputs && status == BF_OK && !decay; i++) {
        const double *u = record_column(record, model->inputs[i].name);
        if (u != NULL && root_mean_square(u, r->n) > 0.0)
            status = add_source(r, u, own_residues(model, record, &model->inputs[i]) ? p->n_slots++ : i, err);
    }
    for (size_t d = 0; d < r->n_data && status == BF_OK; d++)
        status = transform(r, r->data[d].z, &r->data[d].Y, err);
    return status;
}

void attainable_problem_free(struct attainable_problem *p)
{
    for (size_t r = 0; r < p->n_records; r++) {
        struct attainable_record *record = &p->records[r];
        for (size_t i = 0; i < record->n_sources; i++) {
            for (size_t k = 0; k < ATTAINABLE_PATHS; k++)
                free(record->sources[i].path[k]);
            free(record->sources[i].U);
        }
        for (size_t d = 0; d < record->n_data; d++)
            free(record->data[d].Y);
        response_grid_free(&record->grid);
        free(record->sources), free(record->data);
    }
    free(p->records);
}
