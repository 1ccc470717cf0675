/* SPDX-License-Identifier: GPL-3.0-or-later */
/* hits.h — the hits of a hammer in a column of force. Private to record/. */
#ifndef BEAMFIT_HITS_H
#define BEAMFIT_HITS_H

#include <stdbool.h>
#include <stddef.h>

enum { MOST_HITS = 64 };

struct hit {
    size_t first, last, top; /* samples, both ends included; the largest */
    double peak;             /* over the offset, with its sign */
};

struct hits {
    size_t n;
    struct hit hit[MOST_HITS];
    double offset; /* of the force at rest: the median */
    double noise;  /* rms at rest, from the median of the distance */
};

/* u[n]. n 0: the force is none of a hammer (it does not rest most of the time). Hits below a tenth of the largest are none. */
void hits_find(const double u[], size_t n, struct hits *out);

#endif
