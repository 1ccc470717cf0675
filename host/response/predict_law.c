/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The laws of a model in a prediction: the only file that knows both the predictor and the laws. The stepping of a record
 * (law_run.h) gets what it needs of the predictor as a modal system (predict_modal.h).
 */
#include <malloc.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "response.h"
#include "law.h"
#include "law_run.h"
#include "law_transfer.h"
#include "predict_modal.h"
#include "predictor.h"
#include "ground/ground.h"

/* ---- Laws and their coordinates ---- */

static enum bf_status new_coordinates(struct predictor *p, struct bf_error *err)
{
    if (p->n_coordinates > MOST_COORDINATES)
        return bf_fail(err, BF_NUMERIC, "the nonlinear effects need %zu coordinates, %d are possible; drop one",
                       p->n_coordinates, MOST_COORDINATES);
    size_t c = 0, n = p->reduced.n;
    p->coordinates = functionals_new(p->n_coordinates, n);
    for (size_t e = 0; e < p->model.n_effects; e++)
        for (size_t j = 0; j < p->laws[e].d; j++)
            memcpy(p->coordinates[c++].g, p->laws[e].g + j * n, n * sizeof(double));
    return BF_OK;
}

enum bf_status laws_new(struct predictor *p, struct bf_error *err)
{
    double dt = INFINITY;
    for (size_t r = 0; r < p->n_records; r++)
        dt = fmin(dt, p->records[r].dt_s);
    p->laws = bf_alloc(p->model.n_effects, sizeof *p->laws);
    p->n_coordinates = 0;
    p->nonlinear = false;
    p->moves = bf_alloc(p->map.n, sizeof *p->moves);
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        status = law_new(&p->model, &p->reduced, &p->map, e, acos(-1.0) / dt, &p->laws[e], err);
        p->n_coordinates += p->laws[e].d;
        p->nonlinear = p->nonlinear || p->laws[e].d > 0;
        if (p->laws[e].at_parameter != SIZE_MAX)
            p->moves[p->laws[e].at_parameter] = true;
        if (p->laws[e].width_parameter != SIZE_MAX)
            p->moves[p->laws[e].width_parameter] = true;
    }
    return status == BF_OK ? new_coordinates(p, err) : status;
}

void laws_free(struct predictor *p)
{
    for (size_t e = 0; p->laws != NULL && e < p->model.n_effects; e++)
        law_free(&p->laws[e]);
    free(p->laws);
    p->laws = NULL;
    free(p->moves);
    p->moves = NULL;
}

/* A point law whose place is a parameter: its functional follows the parameter. */
static void add_move(const struct run *run, struct functional *f, size_t parameter, const double g_move[])
{
    if (parameter == SIZE_MAX || !run_wants(run, parameter))
        return;
    size_t n_poles = run->p->system->n_poles;
    double complex *moved = bf_alloc(n_poles, sizeof *moved);
    system_functional(run->p->system, g_move, moved);
    for (size_t k = 0; k < n_poles; k++)
        f->d_alpha[parameter * n_poles + k] += moved[k];
    free(moved);
}

/* The coordinates' functionals and their derivatives at the parameters of the run; point laws follow their places. */
static enum bf_status evaluate_coordinates(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    struct functional *first = p->coordinates;
    for (size_t e = 0; e < p->model.n_effects; first += p->laws[e++].d) {
        struct law *law = &p->laws[e];
        double parameters[BEAM_EFFECT_PARAMETERS];
        if (law->d == 0)
            continue;
        parameter_map_effect(&p->map, 0, e, run->theta, parameters);
        enum bf_status status = law_move(law, &p->model, &p->reduced, parameters, err);
        if (status != BF_OK)
            return status;
        memcpy(first->g, law->g, p->reduced.n * sizeof(double)); /* a law over the span never moves: the same again */
        functionals_evaluate(p->system, run_structure(run), first, law->d);
        add_move(run, first, law->at_parameter, law->g_at);
        add_move(run, first, law->width_parameter, law->g_width);
    }
    return BF_OK;
}

void laws_add_moved(const struct run *run, const struct model *model, const struct reduced *reduced, size_t parameter,
                    double scale)
{
    struct predictor *p = run->p;
    struct functional *coordinate = p->coordinates;
    for (size_t e = 0; e < p->model.n_effects; coordinate += p->laws[e++].d) {
        double parameters[BEAM_EFFECT_PARAMETERS];
        struct bf_error err;
        if (p->laws[e].g_at == NULL) /* a law over the span keeps its modes */
            continue;
        parameter_map_effect(&p->map, 0, e, run->theta, parameters);
        if (law_move(&p->laws[e], model, reduced, parameters, &err) != BF_OK)
            continue;
        double *dg = functional_change(coordinate, p->reduced.n, parameter);
        for (size_t i = 0; i < p->reduced.n; i++)
            dg[i] += scale * p->laws[e].g[i];
    }
}

/* ---- Transfer functions ---- */

/* Rows that some record needs; the forces of laws are smooth between samples even where inputs are held. */
static void list_rows(const struct run *run, struct law_transfers *out)
{
    const struct predictor *p = run->p;
    law_transfers_new(p->system, modal_source_row(run, p->n_grids, 0), p->n_coordinates, out);
    for (size_t r = 0; r < p->n_records; r++) {
        const struct record_plan *plan = &p->plans[r];
        for (size_t i = 0; i < p->model.n_inputs; i++) {
            struct law_pair pair = {
                .by = &p->inputs[plan->source[i]], .grid = &p->grids[plan->grid], .kernel = p->kernels[plan->grid]};
            if (plan->input[i] != NULL)
                law_transfers_row(out, modal_source_row(run, plan->grid, plan->source[i]), &pair, p->coordinates);
        }
        for (size_t c = 0; c < plan->n_channels; c++) {
            size_t o = p->channels[plan->first_channel + c].output;
            struct law_pair pair = {.of = &p->outputs[o],
                                    .order = output_order(p->model.outputs[o].kind),
                                    .grid = &p->grids[plan->grid],
                                    .kernel = p->force_kernels[plan->grid]};
            law_transfers_row(out, modal_output_row(run, plan->grid, o), &pair, p->coordinates);
        }
    }
}

/* ---- All records ---- */

/* Transfer functions are independent, and so are records: each worker takes the next one. */
struct queue {
    const struct run *run;
    size_t n_laws;
    struct law_prepared *laws; /* [n_laws] */
    struct law_transfers transfers;
    atomic_size_t next_transfer, next_record;
    pthread_mutex_t lock;
    enum bf_status status; /* of the first record that failed, behind the lock */
    struct bf_error err;
};

static void *fill_transfers(void *argument)
{
    struct queue *queue = argument;
    size_t i;
    while ((i = atomic_fetch_add(&queue->next_transfer, 1)) < queue->transfers.n)
        law_transfers_fill(&queue->transfers, run_structure(queue->run), i);
    return NULL;
}

static enum bf_status step_record(const struct queue *queue, size_t record, struct bf_error *err)
{
    const struct predictor *p = queue->run->p;
    if (state_at_rest(p, record))
        return BF_OK;
    struct modal_record modal;
    struct law_run l = {
        .system = &modal.system, .n_laws = queue->n_laws, .laws = queue->laws, .oversample = p->options.oversample};
    enum bf_status status = modal_record_new(queue->run, record, queue->transfers.paths, &modal, err);
    if (status == BF_OK)
        status = law_run_new(&l, err);
    if (status == BF_OK)
        status = law_run_march(&l, err);
    if (status == BF_OK)
        status = law_run_outputs(&l, err);
    if (status == BF_OK && law_run_differentiates(&l))
        status = law_run_derivatives(&l, err);
    law_run_free(&l);
    modal_record_free(&modal);
    return status;
}

static void *step_records(void *argument)
{
    struct queue *queue = argument;
    enum bf_status status = BF_OK;
    struct bf_error err;
    size_t i;
    while (status == BF_OK && (i = atomic_fetch_add(&queue->next_record, 1)) < queue->run->p->n_records)
        status = step_record(queue, i, &err);
    (void)pthread_mutex_lock(&queue->lock);
    if (queue->status == BF_OK && status != BF_OK) {
        queue->status = status;
        queue->err = err;
    }
    (void)pthread_mutex_unlock(&queue->lock);
    return NULL;
}

/*
 * Histories of a record are some tens of megabytes, made and dropped at every run. Kept by the process they need not be
 * mapped and cleared page by page again, which is a sixth of the time.
 */
static void keep_memory(void)
{
#ifdef M_TRIM_THRESHOLD
    (void)mallopt(M_MMAP_THRESHOLD, 64 << 20);
    (void)mallopt(M_TRIM_THRESHOLD, 512 << 20);
#endif
}

static void prepare_laws(const struct run *run, struct queue *queue)
{
    const struct predictor *p = run->p;
    queue->laws = bf_alloc(p->model.n_effects, sizeof *queue->laws);
    for (size_t e = 0; e < p->model.n_effects; e++)
        if (p->laws[e].d > 0)
            law_prepare(&p->laws[e], &p->map, run->theta, &queue->laws[queue->n_laws++]);
}

enum bf_status predict_laws(const struct run *run, struct bf_error *err)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    const struct predictor *p = run->p;
    struct queue queue = {.run = run, .lock = PTHREAD_MUTEX_INITIALIZER};
    enum bf_status status = evaluate_coordinates(run, err);
    if (status != BF_OK)
        return status;
    (void)pthread_once(&once, keep_memory);
    prepare_laws(run, &queue);
    list_rows(run, &queue.transfers);
    workers_run(p->options.threads, queue.transfers.n, fill_transfers, &queue);
    workers_run(p->options.threads, p->n_records, step_records, &queue);
    if (queue.status != BF_OK)
        *err = queue.err;
    law_transfers_free(&queue.transfers);
    for (size_t e = 0; e < queue.n_laws; e++)
        law_prepared_free(&queue.laws[e]);
    free(queue.laws);
    return queue.status;
}
