/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>

enum { MOST_WORKERS = 16 };

/* Records are independent: each worker takes the next one. */
struct law_queue {
    const struct run *run;
    atomic_size_t next; /* index of the next record */
};

struct law_worker {
    struct law_queue *queue;
    enum bf_status status;
    struct bf_error err;
};

static enum bf_status predict_record(const struct run *run, size_t record, struct bf_error *err)
{
    const struct predictor *p = run->p;
    if (p->plans[record].free_decay)
        return bf_fail_at(
            err, p->records[record].path, 0,
            "a free decay cannot be predicted with a nonlinear effect; drop the effect or record the force");
    struct law_run l = {
        .run = run, .record = record, .plan = &p->plans[record], .grid = &p->grids[p->plans[record].grid]};
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
    size_t record;
    while (worker->status == BF_OK &&
           (record = atomic_fetch_add(&worker->queue->next, 1)) < worker->queue->run->p->n_records)
        worker->status = predict_record(worker->queue->run, record, &worker->err);
    return NULL;
}

static size_t worker_count(const struct predictor *p)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    size_t most = p->options.threads > 0 ? (size_t)p->options.threads : cores > 0 ? (size_t)cores : 1;
    most = most < MOST_WORKERS ? most : MOST_WORKERS;
    return most < p->n_records ? most : p->n_records;
}

enum bf_status predict_laws(const struct run *run, struct bf_error *err)
{
    enum bf_status status = law_coordinates_evaluate(run, err);
    if (status != BF_OK)
        return status;
    struct law_queue queue = {.run = run};
    struct law_worker workers[MOST_WORKERS] = {{.queue = &queue}};
    pthread_t threads[MOST_WORKERS];
    size_t n = worker_count(run->p), started = 0;
    for (size_t i = 0; i < n; i++)
        workers[i] = (struct law_worker){.queue = &queue, .status = BF_OK};
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
