/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The predictor that everybody calls: of records of one beam it is one, as in the other predict_*.c. Where a mass differs from record to record, or a sensor or a
 * blow was elsewhere, each record has one of its own; parameters are handed down to them and rows up. The transfer functions are then of the first record's system.
 */
#include "predictor.h"
#include "predict_pieces.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- Life ---- */

static size_t common_index(const struct predictor *p, const struct parameter_ref *ref, size_t record)
{
    for (size_t i = 0; i < p->map.n; i++) {
        const struct parameter_ref *other = &p->refs[i];
        if (other->role == ref->role && other->owner == ref->owner && other->slot == ref->slot &&
            (other->record < 0 || (size_t)other->record == record))
            return i;
    }
    return SIZE_MAX; /* every parameter of a record is one of all */
}

/* memory: of the beam, in samples, where records are predicted in pieces. */
static enum bf_status open_record(struct predictor *p, size_t r, double memory, struct bf_error *err)
{
    struct each_record *own = &p->each[r];
    struct predict_options options = p->options;
    struct model as_file, model;
    const struct record *record = &p->records[r];
    const char *name = record_base_name(record);
    options.quiet = true;
    options.pieces = false;
    own->pieces = p->in_pieces ? pieces_new(&p->model, record, memory, NULL) : NULL;
    if (own->pieces != NULL)
        record = &own->pieces->record;
    geometry_original(p, &as_file);
    enum bf_status status = each_model(&as_file, record, &model, err);
    if (!status) {
        own->n_refs = model_parameters(&model, &name, 1, &own->refs);
        own->from = bf_alloc(own->n_refs, sizeof *own->from);
        for (size_t i = 0; i < own->n_refs; i++)
            own->from[i] = common_index(p, &own->refs[i], r);
        status = single_new(&model, record, 1, &options, &own->predictor, err);
    }
    model_free(&model);
    model_free(&as_file);
    return status;
}

/* The common initial states, once the records' are counted. */
static void count_states(struct predictor *p)
{
    p->n_nuisance = p->states.most = 0;
    for (size_t r = 0; r < p->n_records; r++) {
        p->first_state[r] = p->n_nuisance;
        p->n_nuisance += p->each[r].predictor != NULL ? p->each[r].predictor->n_nuisance : 0;
    }
    p->first_state[p->n_records] = p->n_nuisance;
    p->amplitude = bf_grow(p->amplitude, p->n_nuisance, sizeof(double));
    memset(p->amplitude, 0, p->n_nuisance * sizeof(double));
}

enum bf_status predictor_new(const struct model *model, const struct record records[], size_t n_records,
                             const struct predict_options *options, struct predictor **out, struct bf_error *err)
{
    struct predictor *p;
    enum bf_status status = single_new(model, records, n_records, options, &p, err);
    if (status == BF_OK && (p->in_pieces || each_wanted(model, records, n_records))) {
        p->each = bf_alloc(n_records, sizeof *p->each);
        p->filled = bf_alloc(p->map.n, sizeof *p->filled);
        for (size_t r = 0; r < n_records && !status; r++)
            status = open_record(p, r, p->in_pieces ? pieces_memory(p, r, NULL) : 0.0, err);
        if (status == BF_OK) {
            count_states(p);
            status = predictor_window(p, INFINITY, err);
        }
        if (status != BF_OK)
            predictor_free(p);
    }
    if (status == BF_OK)
        *out = p;
    return status;
}

static void close_record(struct each_record *own)
{
    single_free(own->predictor);
    pieces_free(own->pieces);
    free(own->refs);
    free(own->from);
    *own = (struct each_record){.row = own->row};
}

void predictor_free(struct predictor *p)
{
    for (size_t r = 0; p != NULL && p->each != NULL && r < p->n_records; r++)
        close_record(&p->each[r]);
    if (p != NULL)
        free(p->each);
    single_free(p);
}

enum bf_status predictor_clone(const struct predictor *from, struct predictor **out, struct bf_error *err)
{
    struct model model;
    geometry_original(from, &model);
    enum bf_status status = predictor_new(&model, from->records, from->n_records, &from->options, out, err);
    model_free(&model);
    if (status == BF_OK && isfinite(from->t_end_s)) {
        status = predictor_window(*out, from->t_end_s, err);
        if (status != BF_OK)
            predictor_free(*out);
    }
    return status;
}

/* ---- Down and up ---- */

static double *hand_down(const struct each_record *own, const double theta[])
{
    double *x = bf_alloc(own->n_refs, sizeof *x);
    for (size_t i = 0; i < own->n_refs; i++)
        x[i] = own->from[i] != SIZE_MAX ? theta[own->from[i]] : own->refs[i].value;
    return x;
}

enum bf_status predictor_rebase(struct predictor *p, const double theta[], struct bf_error *err)
{
    enum bf_status status = single_rebase(p, theta, err);
    for (size_t r = 0; p->each != NULL && r < p->n_records && !status; r++) {
        double *x = hand_down(&p->each[r], theta);
        status = single_rebase(p->each[r].predictor, x, err);
        free(x);
    }
    return status;
}

enum bf_status predictor_window(struct predictor *p, double t_end_s, struct bf_error *err)
{
    enum bf_status status = single_window(p, t_end_s, err);
    for (size_t r = 0; p->each != NULL && r < p->n_records && !status; r++) {
        struct each_record *own = &p->each[r];
        own->row = p->channels[p->plans[r].first_channel].row;
        if (pieces_several(own->pieces, p->plans[r].n))
            continue;
        pieces_first(own->pieces, own->predictor);
        status = single_window(own->predictor, t_end_s, err);
    }
    return status;
}

void predictor_rest(struct predictor *p)
{
    single_rest(p);
    for (size_t r = 0; p->each != NULL && r < p->n_records; r++)
        single_rest(p->each[r].predictor);
}

void predictor_set_nuisance(struct predictor *p, const double amplitude[])
{
    single_set_nuisance(p, amplitude);
    for (size_t r = 0; p->each != NULL && r < p->n_records; r++)
        single_set_nuisance(p->each[r].predictor, amplitude + p->first_state[r]);
}

/* What one run wants: derivatives by these parameters of the record (NULL: none), kept or handed on (sink NULL: kept). */
struct errand {
    const double *x;  /* [n_refs] of the record */
    const bool *want; /* [n_refs] */
    const struct predict_sink *sink;
};

static void hand_up(struct predictor *p, size_t record, const struct prediction *y, const bool want[])
{
    const struct each_record *own = &p->each[record];
    const size_t rows = y->n_rows, first = p->first_state[record];
    memcpy(p->y + own->row, y->y, rows * sizeof *p->y);
    for (size_t k = 0; k < y->n_nuisance; k++)
        memcpy(p->nuisance + (first + k) * p->n_rows + own->row, y->nuisance + k * rows, rows * sizeof *p->nuisance);
    for (size_t i = 0; want != NULL && i < own->n_refs; i++)
        if (want[i])
            memcpy(p->jacobian + own->from[i] * p->n_rows + own->row, y->jacobian + i * rows,
                   rows * sizeof *p->jacobian);
}

/* Rows of one channel, of which the record's prediction has the derivatives from row `from` on. */
static enum bf_status hand_on(struct predictor *p, const struct each_record *own, const struct prediction *y,
                              const struct errand *errand, size_t from, struct predict_block *block,
                              struct bf_error *err)
{
    const double **column = bf_alloc(p->map.n, sizeof *column);
    for (size_t i = 0; i < own->n_refs; i++)
        if (errand->want[i])
            column[own->from[i]] = y->jacobian + i * y->n_rows + from;
    block->y = y->y + from;
    block->column = column;
    const enum bf_status status = errand->sink->take(errand->sink->context, block, err);
    free(column);
    return status;
}

/* All rows of a record that is one piece. */
static enum bf_status hand_on_record(struct predictor *p, size_t r, const struct prediction *y,
                                     const struct errand *errand, struct bf_error *err)
{
    const struct each_record *own = &p->each[r];
    const struct record_plan *plan = &p->plans[r];
    enum bf_status status = BF_OK;
    hand_up(p, r, y, NULL);
    for (size_t c = plan->first_channel; c < plan->first_channel + plan->n_channels && !status; c++) {
        struct predict_block block = {.channel = c, .row = p->channels[c].row, .n = plan->n};
        status = hand_on(p, own, y, errand, block.row - own->row, &block, err);
    }
    return status;
}

/* The rows of one piece, channel by channel. */
static enum bf_status hand_up_piece(struct predictor *p, size_t r, const struct piece *piece,
                                    const struct prediction *y, const struct errand *errand, struct bf_error *err)
{
    const struct each_record *own = &p->each[r];
    const struct record_plan *plan = &p->plans[r];
    const size_t count = piece->end - piece->from, skipped = piece->from - piece->start;
    for (size_t c = 0; c < plan->n_channels; c++) {
        const size_t to = p->channels[plan->first_channel + c].row + piece->from;
        const size_t from = own->predictor->channels[c].row + skipped;
        memcpy(p->y + to, y->y + from, count * sizeof *p->y);
        struct predict_block block = {.channel = plan->first_channel + c, .row = to, .n = count};
        const enum bf_status status = errand->sink != NULL ? hand_on(p, own, y, errand, from, &block, err) : BF_OK;
        if (status != BF_OK)
            return status;
        for (size_t i = 0; errand->sink == NULL && errand->want != NULL && i < own->n_refs; i++)
            if (errand->want[i])
                memcpy(p->jacobian + own->from[i] * p->n_rows + to, y->jacobian + i * y->n_rows + from,
                       count * sizeof *p->jacobian);
    }
    return BF_OK;
}

/* The pieces of n rows, in their order; to be freed. */
static struct piece *list_pieces(const struct pieces *pieces, size_t n, size_t *count)
{
    struct piece piece = {0}, *list = NULL;
    for (*count = 0; pieces_next(pieces, n, &piece); ++*count) {
        list = bf_grow(list, *count + 1, sizeof *list);
        list[*count] = piece;
    }
    return list;
}

/* One piece; *longer as of run_pieces(). */
static enum bf_status run_piece(struct predictor *p, size_t r, const struct piece *piece, const struct errand *errand,
                                double *longer, struct bf_error *err)
{
    struct each_record *own = &p->each[r];
    struct prediction y;
    pieces_load(own->pieces, own->predictor, p->plans[r].n, piece);
    enum bf_status status = single_window(own->predictor, INFINITY, err);
    if (status == BF_OK)
        status = single_run(own->predictor, errand->x, errand->want, &y, err);
    const double memory = status == BF_OK ? pieces_memory(own->predictor, 0, errand->x) : 0.0;
    if (memory > (double)own->pieces->early)
        *longer = memory;
    else if (status == BF_OK)
        status = hand_up_piece(p, r, piece, &y, errand, err);
    return status;
}

/*
 * One piece after the other, from the last; *longer > 0: the beam remembers more samples than the pieces begin early, which the first that is run shows,
 * and nothing is predicted.
 */
static enum bf_status run_pieces(struct predictor *p, size_t r, const struct errand *errand, double *longer,
                                 struct bf_error *err)
{
    size_t n;
    struct piece *list = list_pieces(p->each[r].pieces, p->plans[r].n, &n);
    enum bf_status status = BF_OK;
    *longer = 0.0;
    while (n-- > 0 && status == BF_OK && !(*longer > 0.0))
        status = run_piece(p, r, &list[n], errand, longer, err);
    free(list);
    return status;
}

/* Longer pieces, with room for poles that go on towards the axis. */
static enum bf_status reopen(struct predictor *p, size_t r, double memory, struct bf_error *err)
{
    static const double room = 1.25;
    close_record(&p->each[r]);
    enum bf_status status = open_record(p, r, room * memory, err);
    if (status != BF_OK || pieces_several(p->each[r].pieces, p->plans[r].n))
        return status;
    pieces_first(p->each[r].pieces, p->each[r].predictor);
    return single_window(p->each[r].predictor, p->t_end_s, err);
}

static enum bf_status run_record(struct predictor *p, size_t r, const double theta[], const bool want[],
                                 const struct predict_sink *sink, struct prediction *out, struct bf_error *err)
{
    const struct each_record *own = &p->each[r];
    struct prediction y = {0};
    double *x = hand_down(own, theta), longer = 0.0;
    bool *wanted = bf_alloc(own->n_refs, sizeof *wanted);
    for (size_t i = 0; i < own->n_refs; i++)
        wanted[i] = want != NULL && own->from[i] != SIZE_MAX && want[own->from[i]];
    const struct errand errand = {.x = x, .want = want != NULL ? wanted : NULL, .sink = sink};
    enum bf_status status;
    if (pieces_several(own->pieces, p->plans[r].n)) {
        status = run_pieces(p, r, &errand, &longer, err);
    } else {
        status = single_run(own->predictor, x, errand.want, &y, err);
        if (status == BF_OK && sink != NULL)
            status = hand_on_record(p, r, &y, &errand, err);
        else if (status == BF_OK)
            hand_up(p, r, &y, errand.want);
    }
    out->bends = out->bends || (status == BF_OK && y.bends);
    free(wanted), free(x);
    if (longer > 0.0) {
        status = reopen(p, r, longer, err);
        return status == BF_OK ? run_record(p, r, theta, want, sink, out, err) : status;
    }
    return status;
}

/* The columns that are wanted, and that were, are zero; others were never touched, so that they take no memory. */
static void clear_columns(struct predictor *p, const bool want[])
{
    for (size_t i = 0; want != NULL && i < p->map.n; i++) {
        if (want[i] || p->filled[i])
            memset(p->jacobian + i * p->n_rows, 0, p->n_rows * sizeof *p->jacobian);
        p->filled[i] = want[i];
    }
}

static enum bf_status run_each(struct predictor *p, const double theta[], const bool want[],
                               const struct predict_sink *sink, struct prediction *out, struct bf_error *err)
{
    enum bf_status status = single_run_system(p, theta, want != NULL && !p->in_pieces, out, err);
    states_clear(p);
    out->bends = false;
    if (p->in_pieces && want != NULL && sink == NULL) {
        single_room(p, true);
        clear_columns(p, want);
        out->jacobian = p->jacobian;
    }
    for (size_t r = 0; r < p->n_records && !status; r++)
        status = run_record(p, r, theta, want, sink, out, err);
    return status;
}

bool predictor_is_long(const struct predictor *p)
{
    bool several = false;
    for (size_t r = 0; p->in_pieces && r < p->n_records; r++)
        several = several || pieces_several(p->each[r].pieces, p->plans[r].n);
    return several;
}

enum bf_status predictor_run_blocks(struct predictor *p, const double theta[], const bool want[],
                                    const struct predict_sink *sink, struct prediction *out, struct bf_error *err)
{
    return run_each(p, theta, want, sink, out, err);
}

enum bf_status predictor_run(struct predictor *p, const double theta[], const bool want[], struct prediction *out,
                             struct bf_error *err)
{
    return p->each != NULL ? run_each(p, theta, want, NULL, out, err) : single_run(p, theta, want, out, err);
}

static enum bf_status settle_each(struct predictor *p, const double theta[], const struct predict_target *target,
                                  struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t r = 0; r < p->n_records && !status; r++) {
        const struct each_record *own = &p->each[r];
        const size_t first = p->first_state[r];
        const struct predict_target part = {.weight = target->weight + own->row,
                                            .z = target->z != NULL ? target->z + own->row : NULL,
                                            .start = target->start != NULL ? target->start + first : NULL,
                                            .runs = target->runs};
        double *x = hand_down(own, theta);
        status = single_settle(own->predictor, x, &part, err);
        memcpy(p->amplitude + first, own->predictor->amplitude, own->predictor->n_nuisance * sizeof *p->amplitude);
        free(x);
    }
    return status;
}

enum bf_status predictor_settle(struct predictor *p, const double theta[], const struct predict_target *target,
                                struct bf_error *err)
{
    return p->each != NULL ? settle_each(p, theta, target, err) : single_settle(p, theta, target, err);
}

enum bf_status predictor_run_solved(struct predictor *p, const double theta[], const struct predict_target *target,
                                    struct prediction *out, struct bf_error *err)
{
    enum bf_status status = predictor_settle(p, theta, target, err);
    if (status == BF_OK)
        status = predictor_run(p, theta, NULL, out, err);
    if (status != BF_OK || p->n_nuisance == 0)
        return status;
    double *a = bf_alloc(p->n_nuisance, sizeof *a);
    status = settle_last(p, target, out, a, err);
    if (status == BF_OK)
        predictor_set_nuisance(p, a);
    free(a);
    return status;
}
