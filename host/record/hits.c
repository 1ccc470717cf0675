/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "hits.h"

#include <math.h>
#include <stdlib.h>

#include "ground/ground.h"
#include "maths/maths.h"

static const double least_part = 0.1; /* of the largest peak: less is a filter's echo */
static const double edge_part = 0.02; /* of the largest peak: where a hit begins and ends, above the noise */
static const double over_noise = 8.0; /* of the noise at rest */
static const double busy_share = 0.1; /* of the record: a force that is off its rest for longer is no hammer's */
enum { LEAST_GAP = 8 };               /* samples between two hits: nearer, it is one with a filter's echo */

/* A run above the limit in the direction of the largest peak joins the last hit or begins one. */
static void add_run(const double u[], size_t first, size_t last, double sign, double least, struct hits *out)
{
    struct hit run = {.first = first, .last = last, .top = first};
    for (size_t k = first; k <= last; k++)
        if (sign * (u[k] - out->offset) > sign * (u[run.top] - out->offset))
            run.top = k;
    run.peak = u[run.top] - out->offset;
    struct hit *before = out->n > 0 ? &out->hit[out->n - 1] : NULL;
    if (before != NULL && first - before->last < LEAST_GAP) {
        before->last = last;
        if (fabs(run.peak) > fabs(before->peak))
            before->top = run.top, before->peak = run.peak;
    } else if (fabs(run.peak) >= least && out->n < MOST_HITS) {
        out->hit[out->n++] = run;
    }
}

void hits_find(const double u[], size_t n, struct hits *out)
{
    double most = 0.0, sign = 1.0;
    size_t busy = 0;
    *out = (struct hits){0};
    out->noise = robust_deviation(n, u, &out->offset); /* at rest, as a hammer is most of the time */
    for (size_t k = 0; k < n; k++)
        if (fabs(u[k] - out->offset) > most)
            most = fabs(u[k] - out->offset), sign = u[k] > out->offset ? 1.0 : -1.0;
    const double limit = fmax(edge_part * most, over_noise * out->noise), least = fmax(least_part * most, limit);
    if (!(most > limit) || !(most > 2.0 * over_noise * out->noise))
        return;
    for (size_t k = 0; k < n; k++)
        busy += fabs(u[k] - out->offset) > limit;
    if ((double)busy > busy_share * (double)n)
        return;
    for (size_t k = 0; k < n; k++) {
        const size_t first = k;
        while (k < n && sign * (u[k] - out->offset) > limit)
            k++;
        if (k > first)
            add_run(u, first, k - 1, sign, least, out);
    }
}
