/* SPDX-License-Identifier: MIT */
/*
 * beam_math.h — exp, log, tanh, sin, cos of the float builds, so that every machine rounds them alike: the C libraries
 * of a PC and of a controller do not. Included by beam_real.h only; code says beam_exp() and so on.
 * Only float additions, multiplications, divisions and integers; no branch but on the argument, no table in RAM.
 * Largest error over all floats, in units of the last place, from tests/unit/test_beam_math.c:
 *     exp 1    log 1    tanh 1.5    sin, cos 2.7 (huge arguments included)
 */
#ifndef BEAM_MATH_H
#define BEAM_MATH_H

#include "beam_language.h"

BEAM_C_BEGIN

#define beam_math_exp  BEAM_NAME(math_exp)
#define beam_math_log  BEAM_NAME(math_log)
#define beam_math_tanh BEAM_NAME(math_tanh)
#define beam_math_sin  BEAM_NAME(math_sin)
#define beam_math_cos  BEAM_NAME(math_cos)

float beam_math_exp(float x); /* 0 below −103.98, infinite above 88.73 */
float beam_math_log(float x); /* −infinite at 0, NaN below */
float beam_math_tanh(float x);
float beam_math_sin(float x); /* rad; NaN of an infinity */
float beam_math_cos(float x);

BEAM_C_END

#endif /* BEAM_MATH_H */
