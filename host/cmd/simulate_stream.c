/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "simulate_stream.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct stream {
    const struct simulation *s;
    const struct record_spool *spool;
    struct record head;         /* of what is written */
    size_t n_inputs;            /* its first columns */
    struct record_writer *file; /* NULL: not begun */
    double *square;             /* [n_outputs] */
    struct progress *bar;
};

/* n_columns: there is none of this name. */
static size_t column_of(const struct record *record, const char *name)
{
    size_t i = 0;
    while (i < record->n_columns && strcmp(record->columns[i].name, name) != 0)
        i++;
    return i;
}

static void add_name(struct record *head, const char *name)
{
    const size_t n = head->n;
    head->n = 0; /* a column without samples */
    record_add_column(head, name, NULL);
    head->n = n;
}

static void add_inputs(const struct model *model, const struct record *from, struct record *head)
{
    for (size_t i = 0; i < model->n_inputs; i++)
        if (column_of(from, model->inputs[i].name) < from->n_columns)
            add_name(head, model->inputs[i].name);
}

void simulation_head(const struct simulation *s, const struct record *from, struct record *head)
{
    const char *filter = record_meta(from, RECORD_FILTER);
    *head = (struct record){.path = bf_strdup(s->output), .n = from->n, .t0_s = from->t0_s, .dt_s = from->dt_s};
    record_add_meta(head, "simulated_by", "beamfit simulate");
    record_add_meta(head, "model", s->model_path);
    record_add_meta(head, "input", s->input);
    record_add_meta(head, RECORD_FILTER, filter != NULL ? filter : "none"); /* what was simulated has no other */
    add_inputs(s->model, from, head);
    for (size_t o = 0; o < s->model->n_outputs; o++)
        add_name(head, s->model->outputs[o].name);
}

static void read_input(void *context, const char *column, size_t first, size_t n, double x[])
{
    const struct stream *t = context;
    record_spool_column(t->spool, column, first, n, x);
}

static enum bf_status write_rows(void *context, size_t first, size_t n, const double *const y[], struct bf_error *err)
{
    struct stream *t = context;
    const size_t n_outputs = t->s->model->n_outputs;
    double *inputs = bf_alloc(t->n_inputs * n, sizeof *inputs);
    const double **x = bf_alloc(t->head.n_columns, sizeof *x);
    enum bf_status status = BF_OK;
    if (t->file == NULL) {
        t->file = bf_alloc(1, sizeof *t->file);
        status = record_writer_open(t->s->output, &t->head, t->s->digits, t->file, err);
    }
    for (size_t i = 0; i < t->n_inputs; i++) {
        read_input(t, t->head.columns[i].name, first, n, inputs + i * n);
        x[i] = inputs + i * n;
    }
    for (size_t o = 0; o < n_outputs; o++) {
        x[t->n_inputs + o] = y[o];
        for (size_t k = 0; k < n; k++)
            t->square[o] += y[o][k] * y[o][k];
    }
    if (status == BF_OK)
        status = record_writer_add(t->file, n, x, err);
    if (status == BF_OK && record_spool_failed(t->spool))
        status = bf_fail_at(err, t->s->input, 0, "its samples cannot be read again from beside the output");
    progress_update(t->bar, (double)(first + n) / (double)t->head.n, NULL);
    free(inputs), free(x);
    return status;
}

/* The record as the predictor sees it: what the recorder did to it, and the inputs' names. */
static void make_stage(const struct simulation *s, const struct record *from, struct record *out)
{
    const char *filter = record_meta(from, RECORD_FILTER);
    *out = (struct record){.path = bf_strdup(from->path), .n = from->n, .t0_s = from->t0_s, .dt_s = from->dt_s};
    add_inputs(s->model, from, out);
    if (filter != NULL)
        record_add_meta(out, RECORD_FILTER, filter);
}

enum bf_status simulate_streamed(const struct simulation *s, const struct record_spool *spool, double rms[], bool *done,
                                 struct bf_error *err)
{
    struct record stage;
    struct stream t = {.s = s, .spool = spool, .square = bf_alloc(s->model->n_outputs, sizeof(double))};
    const struct predict_stream stream = {.read = read_input, .take = write_rows, .context = &t};
    make_stage(s, &spool->record, &stage);
    simulation_head(s, &spool->record, &t.head);
    t.n_inputs = stage.n_columns;
    *done = false;
    t.bar = progress_begin("simulate");
    enum bf_status status = predict_streamed(s->model, &stage, &s->predict, &stream, done, err);
    progress_end(t.bar);
    if (status == BF_OK && *done)
        status = record_writer_commit(t.file, err);
    if (t.file != NULL)
        record_writer_abort(t.file);
    for (size_t o = 0; o < s->model->n_outputs; o++)
        rms[o] = sqrt(t.square[o] / (double)stage.n);
    free(t.file), free(t.square);
    record_free(&stage), record_free(&t.head);
    return status;
}
