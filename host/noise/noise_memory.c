/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise_memory.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

static struct {
    struct noise_key key;
    struct noise_estimate estimate;
} kept[NOISE_REMEMBERED];
static size_t n_added; /* since the program began; the next one goes to n_added % NOISE_REMEMBERED */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

/* ---- Keys ---- */

/* Two multiplications by odd constants (of SplitMix64, Steele et al. 2014), the high bits folded back. */
static void mix(struct noise_key *key, uint64_t word)
{
    key->a = (key->a ^ word) * 0xbf58476d1ce4e5b9U;
    key->a ^= key->a >> 32;
    key->b = (key->b + word) * 0x94d049bb133111ebU;
    key->b ^= key->b >> 29;
}

static void mix_samples(struct noise_key *key, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t word;
        memcpy(&word, &x[i], sizeof word);
        mix(key, word);
    }
}

struct noise_key noise_memory_key(const double *z, size_t n, double dt_s, const struct noise_channel_input inputs[],
                                  size_t n_inputs, size_t from_sample)
{
    struct noise_key key = {n, n_inputs};
    mix(&key, from_sample);
    mix_samples(&key, &dt_s, 1);
    mix_samples(&key, z, n);
    for (size_t i = 0; i < n_inputs; i++) {
        mix_samples(&key, inputs[i].u, n);
        if (inputs[i].cells != NULL)
            mix_samples(&key, &inputs[i].cells->rms, 1);
    }
    return key;
}

/* ---- What is kept ---- */

/* NOISE_REMEMBERED: none. The lock is held. */
static size_t place_of(struct noise_key key)
{
    const size_t n = n_added < NOISE_REMEMBERED ? n_added : NOISE_REMEMBERED;
    for (size_t i = 0; i < n; i++)
        if (kept[i].key.a == key.a && kept[i].key.b == key.b)
            return i;
    return NOISE_REMEMBERED;
}

bool noise_memory_find(struct noise_key key, struct noise_estimate *out)
{
    pthread_mutex_lock(&lock);
    const size_t i = place_of(key);
    if (i < NOISE_REMEMBERED)
        *out = noise_copy(&kept[i].estimate);
    pthread_mutex_unlock(&lock);
    return i < NOISE_REMEMBERED;
}

void noise_memory_add(struct noise_key key, const struct noise_estimate *estimate)
{
    pthread_mutex_lock(&lock);
    if (place_of(key) == NOISE_REMEMBERED) {
        const size_t i = n_added++ % NOISE_REMEMBERED;
        free(kept[i].estimate.psd);
        kept[i].key = key;
        kept[i].estimate = noise_copy(estimate);
    }
    pthread_mutex_unlock(&lock);
}
