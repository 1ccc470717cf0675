/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <malloc.h>
#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>

enum { MOST_WORKERS = 16 };

/* Transfer functions are independent, and so are records: each worker takes the next one. */
struct law_queue {
    const struct run *run;
    struct law_transfers *transfers;
    size_t n; /* tasks */
    enum bf_status (*task)(const struct law_queue *queue, size_t i, struct bf_error *err);
    atomic_size_t next;
};

struct law_worker {
    struct law_queue *queue;
    enum bf_status status;
    struct bf_error err;
};

static enum bf_status fill_transfer(const struct law_queue *queue, size_t i, struct bf_error *err)
{
    (void)err;
    law_transfers_fill(queue->run, queue->transfers, i);
    return BF_OK;
}

static enum bf_status predict_record(const struct law_queue *queue, size_t record, struct bf_error *err)
{
    const struct run *run = queue->run;
    const struct predictor *p = run->p;
    if (p->plans[record].free_decay)
        return bf_fail_at(
            err, p->records[record].path, 0,
            "a free decay cannot be predicted with a nonlinear effect; drop the effect or record the force");
    struct law_run l = {.run = run,
                        .record = record,
                        .plan = &p->plans[record],
                        .grid = &p->grids[p->plans[record].grid],
                        .transfers = queue->transfers};
    enum bf_status status = law_run_new(&l, err);
    if (status == BF_OK)
        status = law_run_march(&l, err);
    if (status == BF_OK)
        status = law_run_outputs(&l, err);
    law_run_free(&l);
    return status;
}

static void *work(void *argument)
{
    struct law_worker *worker = argument;
    struct law_queue *queue = worker->queue;
    size_t i;
    while (worker->status == BF_OK && (i = atomic_fetch_add(&queue->next, 1)) < queue->n)
        worker->status = queue->task(queue, i, &worker->err);
    return NULL;
}

static size_t worker_count(const struct predictor *p, size_t n_tasks)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t most = p->options.threads > 0 ? (size_t)p->options.threads : cores > 0 ? (size_t)cores : 1;
    most = most < MOST_WORKERS ? most : MOST_WORKERS;
    return most < n_tasks ? most : n_tasks;
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

static enum bf_status run_queue(struct law_queue *queue, struct bf_error *err)
{
    struct law_worker workers[MOST_WORKERS];
    pthread_t threads[MOST_WORKERS];
    size_t n = worker_count(queue->run->p, queue->n), started = 0;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < MOST_WORKERS; i++)
        workers[i] = (struct law_worker){.queue = queue, .status = BF_OK};
    while (started + 1 < n && pthread_create(&threads[started], NULL, work, &workers[started + 1]) == 0)
        started++;
    (void)work(&workers[0]);
    for (size_t i = 0; i < started; i++)
        (void)pthread_join(threads[i], NULL);
    for (size_t i = 0; i <= started && status == BF_OK; i++) {
        status = workers[i].status;
        if (status != BF_OK)
            *err = workers[i].err;
    }
    return status;
}

enum bf_status predict_laws(const struct run *run, struct bf_error *err)
{
    enum bf_status status = law_coordinates_evaluate(run, err);
    if (status != BF_OK)
        return status;
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    struct law_transfers transfers;
    (void)pthread_once(&once, keep_memory);
    law_transfers_new(run, &transfers);
    struct law_queue fill = {.run = run, .transfers = &transfers, .n = transfers.n, .task = fill_transfer};
    status = run_queue(&fill, err);
    struct law_queue records = {.run = run, .transfers = &transfers, .n = run->p->n_records, .task = predict_record};
    if (status == BF_OK)
        status = run_queue(&records, err);
    law_transfers_free(run, &transfers);
    return status;
}
