/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A long record predicted piece by piece, its samples elsewhere. */
#include "predict_pieces.h"

#include <math.h>
#include <stdlib.h>

enum { SHOWN = 8192 }; /* samples that show whether a record is predicted in pieces */

/* A record of n samples of the inputs, with room for every output. */
static struct record first_samples(const struct model *model, const struct record *head,
                                   const struct predict_stream *stream, size_t n)
{
    struct record out = {.path = bf_strdup(head->path), .n = n, .t0_s = head->t0_s, .dt_s = head->dt_s};
    for (size_t c = 0; c < head->n_columns; c++) {
        record_add_column(&out, head->columns[c].name, NULL);
        stream->read(stream->context, head->columns[c].name, 0, n, out.columns[c].x);
    }
    for (size_t o = 0; o < model->n_outputs; o++)
        record_add_column(&out, model->outputs[o].name, NULL);
    for (size_t i = 0; i < head->n_meta; i++)
        record_add_meta(&out, head->meta[i].key, head->meta[i].value);
    return out;
}

/* How long the beam remembers, in samples; INFINITY: its records are not predicted in pieces. */
static enum bf_status find_memory(const struct model *model, const struct record *first,
                                  const struct predict_options *options, double *memory, struct bf_error *err)
{
    struct predictor *p;
    struct predict_options pieces = *options;
    pieces.pieces = true;
    *memory = (double)INFINITY;
    if (each_wanted(model, first, 1))
        return BF_OK;
    const enum bf_status status = single_new(model, first, 1, &pieces, &p, err);
    if (status != BF_OK)
        return status;
    if (pieces_possible(p))
        *memory = pieces_memory(p, 0, NULL);
    single_free(p);
    return BF_OK;
}

static enum bf_status run_piece(struct pieces *pieces, struct predictor *own, const struct piece *piece, size_t n,
                                const double theta[], struct bf_error *err)
{
    const struct predict_stream *stream = pieces->stream;
    struct prediction y;
    pieces_load(pieces, own, n, piece);
    enum bf_status status = single_window(own, INFINITY, err);
    if (status == BF_OK)
        status = single_run(own, theta, NULL, &y, err);
    if (status != BF_OK)
        return status;
    const double **rows = bf_alloc(own->model.n_outputs, sizeof *rows);
    for (size_t c = 0; c < own->n_channels; c++)
        rows[own->channels[c].output] = y.y + own->channels[c].row + (piece->from - piece->start);
    status = stream->take(stream->context, piece->from, piece->end - piece->from, rows, err);
    free(rows);
    return status;
}

static enum bf_status run_pieces(const struct model *model, struct pieces *pieces, size_t n,
                                 const struct predict_options *options, struct bf_error *err)
{
    struct predict_options quiet = *options;
    struct predictor *own;
    struct piece piece = {0};
    quiet.quiet = true, quiet.pieces = false;
    enum bf_status status = single_new(model, &pieces->record, 1, &quiet, &own, err);
    if (status != BF_OK)
        return status;
    double *theta = bf_alloc(own->map.n, sizeof *theta);
    for (size_t i = 0; i < own->map.n; i++)
        theta[i] = own->refs[i].value;
    while (status == BF_OK && pieces_next(pieces, n, &piece))
        status = run_piece(pieces, own, &piece, n, theta, err);
    free(theta);
    single_free(own);
    return status;
}

enum bf_status predict_streamed(const struct model *model, const struct record *head,
                                const struct predict_options *options, const struct predict_stream *stream, bool *done,
                                struct bf_error *err)
{
    double memory;
    struct record first = first_samples(model, head, stream, head->n < SHOWN ? head->n : SHOWN);
    enum bf_status status = find_memory(model, &first, options, &memory, err);
    struct record all = first; /* the samples are not looked at: the stream has them */
    all.n = head->n;
    struct pieces *pieces = status == BF_OK ? pieces_new(model, &all, memory, stream) : NULL;
    *done = pieces != NULL;
    if (pieces != NULL)
        status = run_pieces(model, pieces, head->n, options, err);
    pieces_free(pieces);
    record_free(&first);
    return status;
}
