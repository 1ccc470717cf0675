/* SPDX-License-Identifier: GPL-3.0-or-later */
/* gaussian.h — normal numbers, the same in every run: xorshift64 and Box–Muller. */
#ifndef TESTS_GAUSSIAN_H
#define TESTS_GAUSSIAN_H

#include <math.h>
#include <stdint.h>

static uint64_t random_word = 88172645463325252u;

static double uniform(void)
{
    random_word ^= random_word << 13;
    random_word ^= random_word >> 7;
    random_word ^= random_word << 17;
    return ((double)(random_word >> 11) + 0.5) / 9007199254740992.0;
}

static double gaussian(void)
{
    return sqrt(-2.0 * log(uniform())) * cos(2.0 * M_PI * uniform());
}

#endif
