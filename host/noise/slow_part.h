/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * slow_part.h — the slowest part of a channel as a half-range cosine series over a stretch of it: Σ_j c_j cos(π j (k − first + ½)/n), j < n_terms,
 * c_0 its mean. Private to noise/.
 */
#ifndef BEAMFIT_SLOW_PART_H
#define BEAMFIT_SLOW_PART_H

#include <stddef.h>

#include "ground/ground.h"

enum { SLOW_TERMS = 24 };

struct slow_part {
    size_t first, n; /* of the stretch, samples */
    size_t n_terms;  /* 1 … SLOW_TERMS */
    double c[SLOW_TERMS];
};

/* The terms up to below_Hz of samples first … n_all − 1; c stays zero. */
struct slow_part slow_part_new(size_t first, size_t n_all, double dt_s, double below_Hz);

/* By orthogonality: right where what is beside it begins and ends at rest. O(n n_terms). */
void slow_part_project(const double z[], struct slow_part *slow);

/*
 * By least squares, whitened by an autoregressive model of what is beside it. Of a motion that goes on over both ends the orthogonal terms have 2/(π f n) of its
 * amplitude; a model of its lines and rings takes them out. BF_NUMERIC: no solution. O(n n_terms²).
 */
enum bf_status slow_part_beside_motion(const double z[], struct slow_part *slow, struct bf_error *err);

/* At sample k of the channel; 0 before the stretch. */
double slow_part_at(const struct slow_part *slow, size_t k);
/* Mean square of the terms [from, to). */
double slow_part_power(const struct slow_part *slow, size_t from, size_t to);

#endif
