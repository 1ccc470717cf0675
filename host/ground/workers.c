/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <pthread.h>
#include <unistd.h>

enum { MOST_WORKERS = 16 };

int workers_wanted(int asked)
{
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const long wanted = asked > 0 ? asked : processors;
    return wanted < 1 ? 1 : wanted > MOST_WORKERS ? MOST_WORKERS : (int)wanted;
}

void workers_run(int wanted, size_t n_pieces, void *(*work)(void *queue), void *queue)
{
    pthread_t threads[MOST_WORKERS] = {0};
    size_t most = (size_t)workers_wanted(wanted), started = 0;
    most = most < n_pieces ? most : n_pieces;
    while (started + 1 < most && pthread_create(&threads[started], NULL, work, queue) == 0)
        started++;
    (void)work(queue);
    for (size_t i = 0; i < started; i++)
        (void)pthread_join(threads[i], NULL);
}
