/* SPDX-License-Identifier: MIT */
/* Counts, and their sum. */
#include "resets.h"

enum { SUM = BEAM_RESETS };
_Static_assert((int)BOARD_KEPT_WORDS == SUM + 1, "counts and their sum");

static uint32_t sum_of(const uint32_t kept[])
{
    uint32_t sum = 0x52535453; /* not the sum of zeros, nor of ones */
    for (int i = 0; i < BEAM_RESETS; i++)
        sum = (sum << 5 | sum >> 27) ^ kept[i];
    return sum;
}

void resets_count(const struct board_facts *facts)
{
    uint32_t *kept = facts->kept;
    if (!kept)
        return;
    if (facts->reset == BEAM_RESET_POWER || kept[SUM] != sum_of(kept))
        for (int i = 0; i < BEAM_RESETS; i++)
            kept[i] = 0;
    kept[facts->reset]++;
    kept[SUM] = sum_of(kept);
}

void resets_read(const struct board_facts *facts, uint32_t out[BEAM_RESETS])
{
    for (uint32_t i = 0; i < BEAM_RESETS; i++)
        out[i] = facts->kept ? facts->kept[i] : facts->reset == i;
}
