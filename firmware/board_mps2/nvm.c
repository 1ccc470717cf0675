/* SPDX-License-Identifier: MIT */
/* Slots in the PSRAM: programming can only clear bits, as in a flash, one word after the other. */
#include "parts.h"

enum { SLOTS = 3, WORDS = NVM_SLOT_BYTES / 4 };
#define SLOT_0 PSRAM

static volatile uint32_t *words_of(int slot)
{
    return (volatile uint32_t *)(SLOT_0 + (uint32_t)slot * NVM_SLOT_BYTES);
}

static bool inside(int slot, uint32_t offset, size_t n)
{
    return slot >= 0 && slot < SLOTS && offset <= NVM_SLOT_BYTES && n <= NVM_SLOT_BYTES - offset;
}

bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[])
{
    if (!inside(slot, offset, n))
        return false;
    const volatile uint8_t *from = (const volatile uint8_t *)words_of(slot) + offset;
    for (size_t i = 0; i < n; i++)
        out[i] = from[i];
    return true;
}

bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    if (offset % 4 != 0 || words > WORDS || !inside(slot, offset, 4 * words))
        return false;
    volatile uint32_t *to = words_of(slot) + offset / 4;
    for (size_t i = 0; i < words; i++)
        to[i] &= data[i];
    return true;
}

/* Memory: the sample interrupt goes on. */
bool board_nvm_erase_stalls(int slot)
{
    (void)slot;
    return false;
}

bool board_nvm_erase(int slot)
{
    if (!inside(slot, 0, 0))
        return false;
    for (uint32_t i = 0; i < WORDS; i++)
        words_of(slot)[i] = 0xFFFFFFFFu;
    return true;
}
