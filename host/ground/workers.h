/* SPDX-License-Identifier: GPL-3.0-or-later */
/* workers.h — one function on several threads, for work that shares a queue: each takes the next piece until none is left. */
#ifndef BEAMFIT_WORKERS_H
#define BEAMFIT_WORKERS_H

#include <stddef.h>

/* Threads to use when the user asked for so many; 0: one a processor. At least 1, at most 16. */
int workers_wanted(int asked);
/*
 * Runs work(queue) on at most `wanted` threads, this one among them, and not on more than there are pieces; returns when all have
 * returned. A thread that cannot be started is done without.
 */
void workers_run(int wanted, size_t n_pieces, void *(*work)(void *queue), void *queue);

#endif
