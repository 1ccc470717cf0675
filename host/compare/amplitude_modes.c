/* SPDX-License-Identifier: GPL-3.0-or-later */
/* amplitude_modes.c — which modes a decay is made of, and why a record has none. */
#include "compare.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

const char *amplitude_no_decay(const struct amplitude_curves *curves, size_t record)
{
    for (size_t i = 0; i < curves->n; i++)
        if (curves->curves[i].record == record)
            return NULL;
    if (record >= curves->n_records || curves->free_stretches[record] == 0)
        return "something drives the beam to the end of the record, or rests for less than 256 samples";
    return "where nothing drives, the motion is too short to part a mode from its neighbours, too near the noise, or "
           "its "
           "modes are more than a fifth off the model's";
}

struct ranked {
    size_t mode;
    double amplitude;
};

static int by_amplitude(const void *a, const void *b)
{
    const double x = ((const struct ranked *)a)->amplitude, y = ((const struct ranked *)b)->amplitude;
    return (x < y) - (x > y);
}

static int by_mode(const void *a, const void *b)
{
    const size_t x = *(const size_t *)a, y = *(const size_t *)b;
    return (x > y) - (x < y);
}

/* Modes that have a curve there, each once, with their largest amplitudes; all: [curves->n + 1]. */
static size_t rank(const struct amplitude_curves *curves, const char *channel, size_t record, size_t also,
                   struct ranked all[])
{
    size_t n = 0, m;
    for (size_t i = 0; i < curves->n; i++) {
        const struct amplitude_curve *c = &curves->curves[i];
        if (strcmp(c->channel, channel) != 0 || (record != SIZE_MAX && c->record != record))
            continue;
        for (m = 0; m < n && all[m].mode != c->mode; m++)
            continue;
        if (m == n)
            all[n++] = (struct ranked){.mode = c->mode};
        for (size_t k = 0; k < c->n; k++)
            all[m].amplitude = fmax(all[m].amplitude, c->mode == also ? HUGE_VAL : c->amplitude[k]);
    }
    return n;
}

size_t amplitude_dominant(const struct amplitude_curves *curves, const char *channel, size_t record, size_t also,
                          size_t mode[], size_t most)
{
    struct ranked *all = bf_alloc(curves->n + 1, sizeof *all);
    const size_t n = rank(curves, channel, record, also, all), kept = n < most ? n : most;
    qsort(all, n, sizeof *all, by_amplitude);
    for (size_t i = 0; i < kept; i++)
        mode[i] = all[i].mode;
    qsort(mode, kept, sizeof *mode, by_mode);
    free(all);
    return kept;
}
