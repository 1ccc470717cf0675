/* SPDX-License-Identifier: MIT */
/* beam_language.h — what lets a program in C++ include the public headers. */
#ifndef BEAM_LANGUAGE_H
#define BEAM_LANGUAGE_H

#ifdef __cplusplus
#define BEAM_C_BEGIN                 extern "C" {
#define BEAM_C_END                   }
#define BEAM_ASSERT(condition, text) static_assert(condition, text)
#define BEAM_NAMELESS                __extension__ /* structs without a name are C's */
#else
#define BEAM_C_BEGIN
#define BEAM_C_END
#define BEAM_NAMELESS
#define BEAM_ASSERT(condition, text) _Static_assert(condition, text)
#endif

#endif
