/* SPDX-License-Identifier: MIT */
/*
 * Three slots, each in memory that is erased without the others. Where an erase stops the processor and sectors are large, cut a sector into
 * windows, as board_stm32f405/nvm.c does: most erases are then a mark.
 */
#include "part.h"

static bool inside(int slot, uint32_t offset, size_t n)
{
    return slot >= 0 && slot < PART_SLOTS && offset <= PART_SLOT_BYTES && n <= PART_SLOT_BYTES - offset;
}

bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[])
{
    if (!inside(slot, offset, n))
        return false;
    const volatile uint8_t *from = (const volatile uint8_t *)part_slot(slot) + offset;
    for (size_t i = 0; i < n; i++)
        out[i] = from[i];
    return true;
}

bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    if (offset % 4 != 0 || words > PART_SLOT_BYTES / 4 || !inside(slot, offset, 4 * words))
        return false;
    for (size_t i = 0; i < words; i++)
        if (!part_program(slot, offset / 4 + (uint32_t)i, data[i]))
            return false;
    return true;
}

bool board_nvm_erase(int slot)
{
    return inside(slot, 0, 0) && part_erase(slot);
}

bool board_nvm_erase_stalls(int slot)
{
    return inside(slot, 0, 0) && part_erase_stalls();
}
