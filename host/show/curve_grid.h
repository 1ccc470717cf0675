/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * curve_grid.h — a curve of any length as few numbers: whole where most happens, extremes of buckets elsewhere; 16 bits a number.
 * Private to show/.
 */
#ifndef BEAMFIT_CURVE_GRID_H
#define BEAMFIT_CURVE_GRID_H

#include <stddef.h>
#include "ground/ground.h"

/* Points at first, first + step, ...; with step 1 they are samples, else each two are the extremes of 2·step samples. */
struct curve_segment {
    size_t first, step, points;
};

enum { CURVE_SEGMENTS = 3 };

/* Which of n samples are kept, alike for every curve over the same abscissa. */
struct curve_grid {
    size_t n, n_segments;
    struct curve_segment segments[CURVE_SEGMENTS];
};

/* At most about `most` points (>= 64): all n samples, or the half of `most` from sample whole_from on, and buckets on either side. */
void curve_grid_choose(size_t n, size_t most, size_t whole_from, struct curve_grid *out);
size_t curve_grid_points(const struct curve_grid *grid);

/* [{"first", "step", "n"}] in samples. */
struct json *curve_grid_json(const struct curve_grid *grid);

/*
 * {"scale", "data"}: value = scale × number, numbers as base64 of little-endian 16-bit integers, −32768: no value. decibels: y is an
 * amplitude, and value = 10^(scale × number/20); to 0.01 dB.
 */
struct json *curve_json(const struct curve_grid *grid, const double y[], bool decibels);

#endif
