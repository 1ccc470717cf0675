/* SPDX-License-Identifier: MIT */
/*
 * Slots in the flash. An erase of a sector stops every fetch from the flash for a second or two, the sample interrupt's
 * included; so a slot has a sector of its own, cut into 16 windows that are used up one after the other. "Erasing" a
 * slot programs the last word of its window, its mark (20 µs), and the next window, still blank, is the slot. Only
 * when the last window is used up is the sector erased: once in 16 times.
 *
 * The slot is the first window without a mark. A mark counts as soon as one of its bits is programmed, so a power cut
 * inside it leaves the slot either as it was or erased. A cut inside the sector's erase may leave anything, also marks;
 * windows that are not blank are then marked too before one is used.
 */
#include "parts.h"

enum {
    SECTOR_BYTES = 128 * 1024,
    WINDOW_BYTES = NVM_SLOT_BYTES + 4,
    WINDOWS = SECTOR_BYTES / WINDOW_BYTES,
    WINDOW_WORDS = WINDOW_BYTES / 4,
    FIRST_SECTOR = 9, /* boot counter (slot 2) in 9, slots 0 and 1 in 10 and 11 */
    PROGRAM_TRIES = 100000,
    ERASE_LIMIT_US = 4000000
};
#define SECTOR_9 0x080A0000u
#define BLANK    0xFFFFFFFFu

static uint8_t
    window[NVM_SLOTS]; /* WINDOWS: all used up; the slot reads as blank and is erased before it is programmed */

static unsigned sector_of(int slot)
{
    return slot == 2 ? 0u : (unsigned)slot + 1u;
}

static volatile uint32_t *word_at(int slot, unsigned which, uint32_t word)
{
    return (volatile uint32_t *)(SECTOR_9 + sector_of(slot) * SECTOR_BYTES + which * WINDOW_BYTES) + word;
}

static bool idle_without_error(void)
{
    return (FLASH->SR & (SR_BSY | SR_FAILED)) == 0;
}

static void unlock(void)
{
    if (FLASH->CR & CR_LOCK) {
        FLASH->KEYR = KEY_ONE;
        FLASH->KEYR = KEY_TWO;
    }
    FLASH->SR = SR_FAILED; /* old errors are cleared by writing ones */
}

/* Locked again; what the data cache remembers of the flash is forgotten. */
static void lock(void)
{
    FLASH->CR = CR_LOCK;
    FLASH->ACR &= ~(uint32_t)ACR_DCEN;
    FLASH->ACR |= ACR_DCRST;
    FLASH->ACR &= ~(uint32_t)ACR_DCRST;
    FLASH->ACR |= ACR_DCEN;
}

static bool program_words(volatile uint32_t *to, size_t words, const uint32_t data[])
{
    bool good = true;
    unlock();
    FLASH->CR = CR_PG | CR_PSIZE_32;
    for (size_t i = 0; i < words && good; i++) {
        const uint32_t wanted = to[i] & data[i];
        to[i] = data[i];
        for (int tries = PROGRAM_TRIES; tries > 0 && (FLASH->SR & SR_BSY); tries--) {
        }
        good = idle_without_error() && to[i] == wanted;
    }
    lock();
    return good;
}

static bool erase_sector(int slot)
{
    unlock();
    FLASH->CR = CR_SER | CR_PSIZE_32 | (FIRST_SECTOR + sector_of(slot)) << 3;
    const uint32_t begin = board_time_us();
    __asm__ volatile("cpsid i" ::
                         : "memory"); /* nothing is fetched meanwhile: no interrupt could be served, so none begins */
    FLASH->CR |= CR_STRT;
    while ((FLASH->SR & SR_BSY) && board_time_us() - begin < ERASE_LIMIT_US) {
    }
    __asm__ volatile("cpsie i" ::: "memory"); /* board_tick_isr() finds out from the timer what was missed */
    const bool good = idle_without_error();
    lock();
    window[slot] = good ? 0 : WINDOWS;
    return good;
}

static bool is_blank(int slot, unsigned which)
{
    uint32_t all = BLANK;
    for (uint32_t i = 0; i < WINDOW_WORDS; i++)
        all &= *word_at(slot, which, i);
    return all == BLANK;
}

static bool mark(int slot, unsigned which)
{
    static const uint32_t used_up = 0;
    return program_words(word_at(slot, which, WINDOW_WORDS - 1), 1, &used_up);
}

bool nvm_init(void)
{
    for (int slot = 0; slot < NVM_SLOTS; slot++) {
        window[slot] = 0;
        while (window[slot] < WINDOWS && *word_at(slot, window[slot], WINDOW_WORDS - 1) != BLANK)
            window[slot]++;
        if (window[slot] == WINDOWS && !erase_sector(slot)) /* not sampling yet: nothing is missed */
            return false;
    }
    return true;
}

static bool inside(int slot, uint32_t offset, size_t n)
{
    return slot >= 0 && slot < NVM_SLOTS && offset <= NVM_SLOT_BYTES && n <= NVM_SLOT_BYTES - offset;
}

bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[])
{
    if (!inside(slot, offset, n))
        return false;
    const volatile uint8_t *from = (const volatile uint8_t *)word_at(slot, window[slot], 0) + offset;
    for (size_t i = 0; i < n; i++)
        out[i] = window[slot] < WINDOWS ? from[i] : 0xFFu;
    return true;
}

bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    if (offset % 4 != 0 || words > NVM_SLOT_BYTES / 4 || !inside(slot, offset, 4 * words))
        return false;
    if (window[slot] == WINDOWS && !erase_sector(slot))
        return false;
    return program_words(word_at(slot, window[slot], offset / 4), words, data);
}

bool board_nvm_erase_stalls(int slot)
{
    return slot >= 0 && slot < NVM_SLOTS && window[slot] >= WINDOWS - 1 &&
           (window[slot] == WINDOWS || !is_blank(slot, WINDOWS - 1));
}

bool board_nvm_erase(int slot)
{
    if (slot < 0 || slot >= NVM_SLOTS)
        return false;
    while (window[slot] < WINDOWS && !is_blank(slot, window[slot])) {
        if (!mark(slot, window[slot]))
            return false;
        window[slot]++;
    }
    return window[slot] < WINDOWS || erase_sector(slot);
}
