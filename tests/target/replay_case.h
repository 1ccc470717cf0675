/* SPDX-License-Identifier: GPL-3.0-or-later */
/* replay_case.h — models that replay_cases writes on the host and replay_run steps on the host and on a board. */
#ifndef REPLAY_CASE_H
#define REPLAY_CASE_H

#include <stdint.h>
#include "beam.h"

enum { REPLAY_MAGIC = 0x50455242, REPLAY_NAME = 32 };

struct replay_file {
    uint32_t magic, n_cases;
};

/* Words and characters only: the file's bytes are the board's memory. */
struct replay_case {
    char name[REPLAY_NAME];
    uint32_t steps, n_uses;
    float amplitude; /* of the input: successive signed words of the generator below, as a fraction of one */
    struct {
        char id[REPLAY_NAME];
        uint32_t channels;
        float p[BEAM_EFFECT_PARAMETERS];
    } use[BEAM_USES];
    struct beam_plan_counts n;
    struct beam_plan_numbers x;
};

static inline float replay_noise(uint32_t *random)
{
    *random = *random * 1664525u + 1013904223u;
    return (float)(int32_t)*random * 4.65661287e-10F;
}

#endif
