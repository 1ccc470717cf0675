/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * noise_memory.h — the estimates of the channels that were asked for last: one command asks for the same channel up to eight times, for
 * different purposes. Private to noise/.
 *
 * An estimate is known by what it was made of, 128 bits of all its samples, so that a channel that was changed is another one. At most
 * NOISE_REMEMBERED are kept, of some kB each; the oldest is forgotten. May be called from several threads.
 */
#ifndef BEAMFIT_NOISE_MEMORY_H
#define BEAMFIT_NOISE_MEMORY_H

#include <stdint.h>

#include "noise.h"
#include "noise_input.h"

enum { NOISE_REMEMBERED = 256 };

struct noise_key {
    uint64_t a, b;
};

/* Arguments as of noise_estimate(). O(n). */
struct noise_key noise_memory_key(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                                  size_t n_inputs, size_t from_sample);

/* *out: a copy, to be freed with noise_free(). */
bool noise_memory_find(struct noise_key key, struct noise_estimate *out);
void noise_memory_add(struct noise_key key, const struct noise_estimate *estimate);

#endif
