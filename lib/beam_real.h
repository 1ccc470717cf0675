/* SPDX-License-Identifier: MIT */
/*
 * beam_real.h — the one place that decides what a number is.
 *
 * The same source is compiled three times:
 *   (nothing)      beam_real = double          symbols beam_*    the host's arithmetic
 *   BEAM_FLOAT     beam_real = float           symbols beamf_*   the target's arithmetic, also linked on the host
 *   BEAM_COMPLEX   beam_real = double _Complex symbols beamc_*   tests only: complex-step derivatives of the effects
 *
 * Rules for code in lib/: write constants as BEAM_K(0.5), call beam_sqrt() and friends, compare with
 * beam_less(a, b), never with <, and never name float or double (beam_math.c, of the float builds only, may).
 */
#ifndef BEAM_REAL_H
#define BEAM_REAL_H

#include <math.h>

#if defined BEAM_FLOAT && defined BEAM_COMPLEX
#error "define at most one of BEAM_FLOAT and BEAM_COMPLEX"
#endif
#if defined BEAM_TARGET && !defined BEAM_FLOAT
#error "BEAM_TARGET, the controller's sizes, goes with BEAM_FLOAT"
#endif

#if defined BEAM_FLOAT

typedef float beam_real;
#define BEAM_K(c) (c##F)
#ifdef BEAM_TARGET
#define BEAM_NAME(name) beamt_##name
#else
#define BEAM_NAME(name) beamf_##name
#endif
#define beam_sqrt(x)    sqrtf(x)
#define beam_fabs(x)    fabsf(x)
#define beam_tanh(x)    beam_math_tanh(x)
#define beam_exp(x)     beam_math_exp(x)
#define beam_log(x)     beam_math_log(x)
#define beam_sin(x)     beam_math_sin(x)
#define beam_cos(x)     beam_math_cos(x)
#define beam_less(a, b) ((a) < (b))
#define beam_finite(x)  (isfinite(x))
#include "beam_math.h" /* the C libraries' own differ from machine to machine */

#elif defined BEAM_COMPLEX

#include <complex.h>
typedef double _Complex beam_real;
#define BEAM_K(c)       (c)
#define BEAM_NAME(name) beamc_##name
#define beam_sqrt(x)    csqrt(x)
#define beam_fabs(x)    (creal(x) < 0.0 ? -(x) : (x))
#define beam_tanh(x)    ctanh(x)
#define beam_exp(x)     cexp(x)
#define beam_log(x)     clog(x)
#define beam_sin(x)     csin(x)
#define beam_cos(x)     ccos(x)
#define beam_less(a, b) (creal(a) < creal(b))
#define beam_finite(x)  (isfinite(creal(x)))

#else

typedef double beam_real;
#define BEAM_K(c)       (c)
#define BEAM_NAME(name) beam_##name
#define beam_sqrt(x)    sqrt(x)
#define beam_fabs(x)    fabs(x)
#define beam_tanh(x)    tanh(x)
#define beam_exp(x)     exp(x)
#define beam_log(x)     log(x)
#define beam_sin(x)     sin(x)
#define beam_cos(x)     cos(x)
#define beam_less(a, b) ((a) < (b))
#define beam_finite(x)  (isfinite(x))

#endif

#endif /* BEAM_REAL_H */
