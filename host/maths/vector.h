/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * vector.h — inner loops compiled three times, for processors with vectors of 512 bits, of 256 bits and others, chosen when the
 * program starts. Off under the address sanitizer, which must be running before any choice of that kind.
 */
#ifndef BEAMFIT_VECTOR_H
#define BEAMFIT_VECTOR_H

#include <stddef.h>
#include <string.h>

#if defined __x86_64__ && defined __gnu_linux__ && !defined __SANITIZE_ADDRESS__ && !defined __clang__
#define VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VECTOR_CLONES
#endif
#define VECTOR_INLINE static inline __attribute__((always_inline))

/*
 * Four numbers at once, in functions with VECTOR_CLONES and what is inlined into them; without 256-bit vectors the
 * compiler makes two or four instructions of each. Arrays need no alignment, but a length that is a multiple.
 */
enum { VECTOR_LENGTH = 4 };
typedef double vector_real __attribute__((vector_size(32)));

VECTOR_INLINE size_t vector_round(size_t n)
{
    return (n + VECTOR_LENGTH - 1) / VECTOR_LENGTH * VECTOR_LENGTH;
}

VECTOR_INLINE void vector_load(vector_real *out, const double x[VECTOR_LENGTH])
{
    memcpy(out, x, sizeof *out);
}

VECTOR_INLINE void vector_store(double x[VECTOR_LENGTH], const vector_real *in)
{
    memcpy(x, in, sizeof *in);
}

VECTOR_INLINE double vector_sum(const vector_real *x)
{
    return ((*x)[0] + (*x)[2]) + ((*x)[1] + (*x)[3]);
}

/* Σ a_i b_i; n is a multiple of the length. */
VECTOR_INLINE double vector_dot(size_t n, const double a[], const double b[])
{
    vector_real sum = {0.0};
    for (size_t i = 0; i < n; i += VECTOR_LENGTH) {
        vector_real x, y;
        vector_load(&x, a + i);
        vector_load(&y, b + i);
        sum += x * y;
    }
    return vector_sum(&sum);
}

#endif
