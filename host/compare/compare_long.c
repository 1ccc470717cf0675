/* SPDX-License-Identifier: GPL-3.0-or-later */
/* compare_long.c — a record compared piece by piece: sums over segments stand for its samples. */
#include "compare_parts.h"
#include "compare_predict.h"
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SEGMENT = 131072 }; /* samples, about: as long as the pieces of which the noise of a record in memory is told */

/* One input beside one output, segment by segment. */
struct long_input {
    struct cross_spectrum spectrum; /* n_bins 0: none yet */
    size_t n_parts, *n;             /* [n_parts] samples of each */
    struct input_correlation *part;
};

struct long_channel {
    size_t output;                               /* of the model */
    double measured, product, predicted, misfit; /* Σ z², Σ z y, Σ y², Σ r² */
    double third[3];                             /* Σ r² in the thirds of the record */
    struct noise_estimate noise;
    struct residual_sums residual;
    struct long_input *inputs; /* [model->n_inputs] */
};

struct long_record {
    const struct model *model;
    const struct record *head; /* this and the reader: while the sums are made */
    const struct long_reader *reader;
    size_t n, segment, n_segments; /* the last segment has what is over, too */
    size_t n_channels;
    struct long_channel *channels;
    size_t done, held;  /* segments; samples of the one that is being filled */
    double **predicted; /* [model->n_outputs][longest segment] */
    struct progress *bar;
};

static size_t length_of(const struct long_record *l, size_t segment)
{
    return segment + 1 < l->n_segments ? l->segment : l->n - segment * l->segment;
}

/* ---- One segment ---- */

/* Views of one segment. */
struct segment {
    size_t first, n;
    struct record record; /* the inputs and outputs */
    const double *z;      /* the output that is looked at */
    double *r;
};

static void add_samples(const struct long_record *l, const struct segment *s, const double *y, struct long_channel *c)
{
    for (size_t k = 0; k < s->n; k++) {
        const double z = s->z[k], r = z - y[k];
        c->measured += z * z;
        c->product += z * y[k];
        c->predicted += y[k] * y[k];
        c->misfit += r * r;
        c->third[3 * (s->first + k) / l->n] += r * r;
        s->r[k] = r;
    }
}

static enum bf_status add_input(const struct long_record *l, const struct segment *s, const double *u,
                                struct long_input *input, struct bf_error *err)
{
    struct cross_spectrum spectrum;
    if (!(root_mean_square(u, l->segment) > 0.0))
        return BF_OK;
    enum bf_status status = spectrum_cross(u, s->z, l->segment, l->head->dt_s, 0, &spectrum, err);
    if (status != BF_OK)
        return status;
    cross_spectrum_join(&input->spectrum, &spectrum);
    cross_spectrum_free(&spectrum);
    input->n = bf_grow(input->n, input->n_parts + 1, sizeof *input->n);
    input->part = bf_grow(input->part, input->n_parts + 1, sizeof *input->part);
    status = residual_input_correlation(u, s->r, l->segment, COMPARE_INPUT_LAGS, &input->part[input->n_parts], err);
    if (status == BF_OK)
        input->n[input->n_parts++] = l->segment;
    return status;
}

static enum bf_status add_channel(const struct long_record *l, struct segment *s, struct long_channel *c,
                                  struct bf_error *err)
{
    struct noise_estimate noise;
    const char *name = l->model->outputs[c->output].name;
    s->z = record_column(&s->record, name);
    add_samples(l, s, l->predicted[c->output], c);
    enum bf_status status = noise_of_channel(l->model, &s->record, name, &noise, err);
    if (status != BF_OK)
        return status;
    noise_join(&c->noise, &noise);
    noise_free(&noise);
    status = residual_sums_add(&c->residual, s->z, s->r, l->segment / COMPARE_WINDOWS, err);
    for (size_t i = 0; i < l->model->n_inputs && status == BF_OK; i++) {
        const double *u = record_column(&s->record, l->model->inputs[i].name);
        if (u != NULL)
            status = add_input(l, s, u, &c->inputs[i], err);
    }
    return status;
}

static void read_into(const struct long_record *l, const char *name, size_t first, struct record *segment)
{
    record_add_column(segment, name, NULL);
    l->reader->read(l->reader->context, name, first, segment->n, segment->columns[segment->n_columns - 1].x);
}

static enum bf_status add_segment(struct long_record *l, struct bf_error *err)
{
    struct segment s = {.first = l->done * l->segment, .n = l->held};
    enum bf_status status = BF_OK;
    s.record = (struct record){.path = bf_strdup(l->head->path), .n = s.n, .dt_s = l->head->dt_s};
    s.record.t0_s = l->head->t0_s + (double)s.first * s.record.dt_s;
    for (size_t i = 0; i < l->model->n_inputs; i++)
        if (record_column(l->head, l->model->inputs[i].name) != NULL)
            read_into(l, l->model->inputs[i].name, s.first, &s.record);
    for (size_t c = 0; c < l->n_channels; c++)
        read_into(l, l->model->outputs[l->channels[c].output].name, s.first, &s.record);
    s.r = bf_alloc(s.n, sizeof *s.r);
    for (size_t c = 0; c < l->n_channels && status == BF_OK; c++)
        status = add_channel(l, &s, &l->channels[c], err);
    free(s.r);
    record_free(&s.record);
    l->done++, l->held = 0;
    progress_update(l->bar, (double)l->done / (double)l->n_segments, record_base_name(l->head));
    return status;
}

/* ---- All of them ---- */

static void read_column(void *context, const char *column, size_t first, size_t n, double x[])
{
    const struct long_record *l = context;
    if (record_column(l->head, column) != NULL)
        l->reader->read(l->reader->context, column, first, n, x);
    else
        memset(x, 0, n * sizeof *x);
}

static enum bf_status take_rows(void *context, size_t first, size_t n, const double *const y[], struct bf_error *err)
{
    struct long_record *l = context;
    enum bf_status status = BF_OK;
    (void)first; /* in their order */
    for (size_t taken = 0; taken < n && status == BF_OK;) {
        const size_t room = length_of(l, l->done) - l->held, more = n - taken < room ? n - taken : room;
        for (size_t c = 0; c < l->n_channels; c++) {
            const size_t o = l->channels[c].output;
            memcpy(l->predicted[o] + l->held, y[o] + taken, more * sizeof **y);
        }
        taken += more, l->held += more;
        if (l->held == length_of(l, l->done))
            status = add_segment(l, err);
    }
    return status;
}

static struct long_record *sums_new(const struct model *model, const struct record *head, size_t n,
                                    const struct long_reader *reader)
{
    struct long_record *l = bf_alloc(1, sizeof *l);
    *l = (struct long_record){.model = model, .head = head, .reader = reader, .n = n, .n_segments = n / SEGMENT};
    l->segment = n / l->n_segments;
    l->channels = bf_alloc(model->n_outputs, sizeof *l->channels);
    l->predicted = bf_alloc(model->n_outputs, sizeof *l->predicted);
    for (size_t o = 0; o < model->n_outputs; o++) {
        if (record_column(head, model->outputs[o].name) == NULL)
            continue;
        struct long_channel *c = &l->channels[l->n_channels++];
        c->output = o;
        c->inputs = bf_alloc(model->n_inputs, sizeof *c->inputs);
        residual_sums_new(l->segment, COMPARE_LAGS + 1, &c->residual);
        l->predicted[o] = bf_alloc(length_of(l, l->n_segments - 1), sizeof **l->predicted);
    }
    return l;
}

/* The model's values are the record's, and nothing of it is solved for. */
static enum bf_status is_known(const struct model *model, const struct record *head,
                               const struct predict_options *options, bool *known, struct bf_error *err)
{
    struct own_values own;
    struct fit_options fit = {.quiet = true};
    *known = false;
    if (record_state_is_free(head) || excitation_level_unknown(model, head))
        return BF_OK;
    if (options != NULL)
        fit.predict = *options;
    const enum bf_status status = own_values_find(model, head, 1, &fit, &own, err);
    *known = status == BF_OK && own.n_notes == 0;
    own_values_free(&own);
    return status;
}

/* The inputs of a head, as predict_streamed() wants it; names and metadata are borrowed. */
static struct record inputs_of(const struct model *model, const struct record *head, size_t n)
{
    struct record out = *head;
    out.n = n, out.n_columns = 0;
    out.columns = bf_alloc(head->n_columns, sizeof *out.columns);
    for (size_t i = 0; i < model->n_inputs; i++)
        for (size_t c = 0; c < head->n_columns; c++)
            if (strcmp(head->columns[c].name, model->inputs[i].name) == 0)
                out.columns[out.n_columns++] = head->columns[c];
    return out;
}

enum bf_status long_record_sum(const struct model *model, const struct record *head, size_t n,
                               const struct predict_options *options, const struct long_reader *reader,
                               struct long_record **out, struct bf_error *err)
{
    bool possible;
    *out = NULL;
    enum bf_status status = n >= 2 * COMPARE_HEAD ? is_known(model, head, options, &possible, err) : BF_OK;
    if (n < 2 * COMPARE_HEAD || status != BF_OK || !possible)
        return status;
    struct long_record *l = sums_new(model, head, n, reader);
    const struct predict_options none = {0};
    const struct predict_stream stream = {.read = read_column, .take = take_rows, .context = l};
    struct record inputs = inputs_of(model, head, n);
    l->bar = progress_begin("compare");
    status = predict_streamed(model, &inputs, options != NULL ? options : &none, &stream, &possible, err);
    progress_end(l->bar);
    l->head = NULL, l->reader = NULL;
    free(inputs.columns);
    if (status != BF_OK || !possible)
        long_record_free(l);
    else
        *out = l;
    return status;
}

void long_record_free(struct long_record *l)
{
    if (l == NULL)
        return;
    for (size_t c = 0; c < l->n_channels; c++) {
        struct long_channel *channel = &l->channels[c];
        for (size_t i = 0; i < l->model->n_inputs; i++) {
            struct long_input *input = &channel->inputs[i];
            for (size_t p = 0; p < input->n_parts; p++)
                input_correlation_free(&input->part[p]);
            cross_spectrum_free(&input->spectrum);
            free(input->n), free(input->part);
        }
        noise_free(&channel->noise);
        residual_sums_free(&channel->residual);
        free(channel->inputs);
    }
    for (size_t o = 0; o < l->model->n_outputs; o++)
        free(l->predicted[o]);
    free(l->channels), free(l->predicted);
    free(l);
}

/* ---- Into a comparison ---- */

static void take_inputs(const struct long_record *l, const struct long_channel *from, struct comparison_channel *c)
{
    for (size_t i = 0; i < c->n_inputs; i++)
        input_correlation_free(&c->inputs[i].correlation);
    c->n_inputs = 0;
    for (size_t i = 0; i < l->model->n_inputs && c->n_inputs < COMPARE_INPUTS; i++) {
        const struct long_input *input = &from->inputs[i];
        if (input->n_parts == 0)
            continue;
        struct comparison_input *to = &c->inputs[c->n_inputs++];
        *to = (struct comparison_input){.name = l->model->inputs[i].name};
        compare_set_coherence(&input->spectrum, to);
        residual_input_correlations_join(input->part, input->n, input->n_parts, &to->correlation);
    }
}

static void take_bands(const struct comparison *all, const struct long_channel *from, struct comparison_channel *c)
{
    const size_t room = compare_edges_room(all);
    double *edge = bf_alloc(room, sizeof *edge), *share = bf_alloc(room, sizeof *share);
    const size_t n_edges = residual_band_edges(all->frequency_Hz, all->n_modes, c->dt_s, edge);
    residual_sums_bands(&from->residual, c->dt_s, edge, n_edges, share);
    compare_set_bands(all, c, edge, n_edges, share);
    free(edge), free(share);
}

static void take_channel(const struct comparison *all, const struct long_record *l, const struct long_channel *from,
                         struct comparison_channel *c)
{
    c->rms = sqrt(from->measured / (double)l->n);
    c->residual_rms = sqrt(from->misfit / (double)l->n);
    c->nrmse = from->measured > 0.0 ? sqrt(from->misfit / from->measured) : from->misfit > 0.0 ? HUGE_VAL : 0.0;
    noise_free(&c->noise);
    c->noise = noise_copy(&from->noise);
    c->noise_ratio = c->noise.rms > 0.0 ? c->residual_rms / c->noise.rms : nan("");
    compare_set_scale(c, from->measured, from->product, from->predicted);
    c->warning[0] = '\0';
    (void)factor_scale_words(all->model, c, true, c->warning);
    for (int i = 0; i < 3; i++)
        c->time_share[i] = from->misfit > 0.0 ? from->third[i] / from->misfit : 0.0;
    residual_sums_amplitudes(&from->residual, &c->amplitude);
    residual_sums_whiteness(&from->residual, &c->whiteness);
    residual_sums_autocorrelation(&from->residual, c->n_autocorrelation, c->autocorrelation);
    take_bands(all, from, c);
    take_inputs(l, from, c);
}

static void note(struct comparison *all, const struct record *head, const struct long_record *l)
{
    char text[512];
    (void)snprintf(
        text, sizeof text,
        "%.200s is long: errors, noise, bands and tests are of all %zu samples; poles, decays, wrong signs or "
        "units, repeats and what is attainable are of the first %zu (%.4g s)",
        record_base_name(head), l->n, head->n, (double)head->n * head->dt_s);
    all->notes = bf_grow(all->notes, all->n_notes + 1, sizeof *all->notes);
    all->notes[all->n_notes++] = bf_strdup(text);
}

void compare_take_long(struct comparison *comparison, size_t record, const struct long_record *l)
{
    for (size_t i = 0; i < comparison->n_channels; i++) {
        struct comparison_channel *c = &comparison->channels[i];
        for (size_t j = 0; c->record == record && j < l->n_channels; j++)
            if (strcmp(c->name, l->model->outputs[l->channels[j].output].name) == 0)
                take_channel(comparison, l, &l->channels[j], c);
    }
    note(comparison, &comparison->records[record], l);
    compare_totals(comparison);
}
