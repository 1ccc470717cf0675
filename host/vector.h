/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * vector.h — inner loops compiled twice, for processors with and without 256-bit vectors, chosen when the program
 * starts. Off under the address sanitizer, which must be running before any choice of that kind.
 */
#ifndef BEAMFIT_VECTOR_H
#define BEAMFIT_VECTOR_H

#if defined __x86_64__ && defined __gnu_linux__ && !defined __SANITIZE_ADDRESS__ && !defined __clang__
#define VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define VECTOR_CLONES
#endif
#define VECTOR_INLINE static inline __attribute__((always_inline))

#endif
