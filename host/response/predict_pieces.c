/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "predict_pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is left of an earlier motion at a piece's first row. */
static const double forgotten = 1e-12;
/*
 * GUARD: samples over which the fade of the inputs next to the Nyquist frequency rings, to 1e-12 (it falls as e^(−√(4π · 0.025 n))). SHORTEST: of a piece, so
 * that its transforms are worth their while. FADE: an input fades out over so many samples after the last row, as in response_tail().
 */
enum { GUARD = 4096, SHORTEST = 65536, FADE = 64 };

double pieces_memory(const struct predictor *p, size_t record, const double theta[])
{
    double slowest = INFINITY, *base = NULL;
    for (size_t k = 0; k < p->system->n_poles; k++)
        slowest = fmin(slowest, -creal(p->system->p[k]));
    if (theta == NULL) {
        base = bf_alloc(p->map.n, sizeof *base);
        for (size_t i = 0; i < p->map.n; i++)
            base[i] = p->refs[i].value;
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        double x[BEAM_EFFECT_PARAMETERS];
        struct beam_filter_output filter = {.value = {.a1 = 0.0}};
        parameter_map_effect(&p->map, record, e, theta != NULL ? theta : base, x);
        if (p->model.effects[e].effect->filter != NULL && p->model.effects[e].effect->filter(x, &filter) == 0 &&
            not_zero(filter.value.a1))
            slowest = fmin(slowest, filter.value.a0 / filter.value.a1);
    }
    free(base);
    return slowest > 0.0 ? -log(forgotten) / (slowest * p->records[record].dt_s) : (double)INFINITY;
}

/* A third of a piece's work is for what the beam remembers. */
static double piece_length(double memory)
{
    return fmax(SHORTEST, 3.0 * (memory + GUARD));
}

static bool worth_it(const struct record *record, double memory)
{
    return 1.5 * piece_length(memory) < (double)record->n;
}

bool pieces_possible(const struct predictor *p)
{
    /* a residual of modes above is a time derivative of the input, which an input that is held has only as a whole */
    const bool local = p->options.intersample == INTERSAMPLE_BAND_LIMITED || p->model.n_residuals == 0;
    bool linear = p->options.pieces && !p->nonlinear && p->base_load == NULL && local;
    for (size_t e = 0; e < p->model.n_effects; e++)
        linear = linear && effect_is_linear(p->model.effects[e].effect);
    for (size_t r = 0; linear && r < p->n_records; r++)
        linear = !p->plans[r].free_state && !p->plans[r].free_decay && !p->plans[r].periodic;
    return linear;
}

bool pieces_wanted(const struct predictor *p)
{
    bool worth = false;
    if (!pieces_possible(p))
        return false;
    for (size_t r = 0; r < p->n_records; r++)
        worth = worth || worth_it(&p->records[r], pieces_memory(p, r, NULL));
    return worth;
}

/* Samples of the whole record from `start` on. */
static void take(struct pieces *pieces, size_t start)
{
    for (size_t c = 0; c < pieces->record.n_columns; c++) {
        const struct record_column *to = &pieces->record.columns[c];
        if (pieces->stream != NULL)
            pieces->stream->read(pieces->stream->context, to->name, start, pieces->record.n, to->x);
        else
            memcpy(to->x, record_column(pieces->whole, to->name) + start, pieces->record.n * sizeof *to->x);
    }
}

struct pieces *pieces_new(const struct model *model, const struct record *record, double memory,
                          const struct predict_stream *stream)
{
    if (!worth_it(record, memory))
        return NULL;
    struct pieces *pieces = bf_alloc(1, sizeof *pieces);
    struct record *piece = &pieces->record;
    pieces->whole = record, pieces->stream = stream;
    pieces->early = (size_t)ceil(memory) + GUARD;
    *piece = (struct record){.path = bf_strdup(record->path), .t0_s = record->t0_s, .dt_s = record->dt_s};
    piece->n = (size_t)ceil(piece_length(memory));
    for (size_t i = 0; i < model->n_inputs; i++)
        if (record_column(record, model->inputs[i].name) != NULL)
            record_add_column(piece, model->inputs[i].name, NULL);
    for (size_t o = 0; o < model->n_outputs; o++)
        if (record_column(record, model->outputs[o].name) != NULL)
            record_add_column(piece, model->outputs[o].name, NULL);
    for (size_t i = 0; i < record->n_meta; i++)
        record_add_meta(piece, record->meta[i].key, record->meta[i].value);
    take(pieces, 0);
    return pieces;
}

void pieces_free(struct pieces *pieces)
{
    if (pieces != NULL)
        record_free(&pieces->record);
    free(pieces);
}

bool pieces_several(const struct pieces *pieces, size_t n)
{
    return pieces != NULL && n + FADE > pieces->record.n;
}

bool pieces_next(const struct pieces *pieces, size_t n, struct piece *piece)
{
    const size_t length = pieces->record.n, most = pieces->whole->n;
    const size_t last = n + FADE + GUARD < most ? n + FADE + GUARD : most;
    if (piece->end >= n)
        return false;
    piece->from = piece->end;
    piece->start = piece->from > pieces->early ? piece->from - pieces->early : 0;
    if (piece->start + length >= last) {
        piece->start = last > length ? last - length : 0;
        piece->end = n;
    } else {
        piece->end = piece->start + length - GUARD;
        piece->end = piece->end < n ? piece->end : n;
    }
    return true;
}

void pieces_load(struct pieces *pieces, struct predictor *own, size_t n, const struct piece *piece)
{
    take(pieces, piece->start);
    for (size_t k = n > piece->start ? n - piece->start : 0; k < pieces->record.n; k++) {
        const size_t past = piece->start + k - n;
        const double fade = past < FADE ? 0.5 + 0.5 * cos(acos(-1.0) * (double)(past + 1) / (FADE + 1.0)) : 0.0;
        for (size_t c = 0; c < pieces->record.n_columns; c++)
            pieces->record.columns[c].x[k] *= fade;
    }
    own->whole = n;
}

void pieces_first(struct pieces *pieces, struct predictor *own)
{
    own->whole = 0;
    if (pieces != NULL)
        take(pieces, 0);
}
