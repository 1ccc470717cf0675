/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "truth_internal.h"

#include <math.h>

static uint64_t splitmix64(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

void truth_random_seed(struct truth_random *random, uint64_t seed, uint64_t stream)
{
    uint64_t state = seed;
    state = splitmix64(&state) ^ (stream * 0xd1342543de82ef95u);
    for (int i = 0; i < 4; i++)
        random->s[i] = splitmix64(&state);
    random->has_spare = false;
    random->spare = 0;
}

static uint64_t rotate(uint64_t x, int k)
{
    return (x << k) | (x >> (64 - k));
}

/* xoshiro256++, Blackman and Vigna */
static uint64_t next(struct truth_random *random)
{
    uint64_t *s = random->s;
    uint64_t result = rotate(s[0] + s[3], 23) + s[0];
    uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

double truth_random_uniform(struct truth_random *random)
{
    return (double)(next(random) >> 11) * 0x1p-53;
}

/* Marsaglia's polar method */
double truth_random_normal(struct truth_random *random)
{
    if (random->has_spare) {
        random->has_spare = false;
        return random->spare;
    }
    double a, b, r2;
    do {
        a = 2 * truth_random_uniform(random) - 1;
        b = 2 * truth_random_uniform(random) - 1;
        r2 = a * a + b * b;
    } while (r2 >= 1 || r2 <= 0);
    double factor = sqrt(-2 * log(r2) / r2);
    random->spare = b * factor;
    random->has_spare = true;
    return a * factor;
}

void truth_noise_begin(struct truth_noise *noise, const double ar[2], struct truth_random *random)
{
    enum { WARM_UP = 2000 };
    double a1 = ar[0], a2 = ar[1];
    *noise = (struct truth_noise){.random = random, .a1 = a1, .a2 = a2};
    noise->deviation = sqrt((1 - a2) / ((1 + a2) * ((1 - a2) * (1 - a2) - a1 * a1)));
    for (size_t i = 0; (a1 != 0 || a2 != 0) && i < WARM_UP; i++)
        truth_noise_next(noise);
}

double truth_noise_next(struct truth_noise *noise)
{
    double now = noise->a1 * noise->before + noise->a2 * noise->earlier + truth_random_normal(noise->random);
    noise->earlier = noise->before;
    noise->before = now;
    return now;
}
