/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * firmware_board.h — board.h in memory, for tests of the firmware: time by hand, a line of two queues, flash whose power
 * fails within an operation. Included by one file of a program: it defines the board's functions.
 */
#ifndef FIRMWARE_BOARD_H
#define FIRMWARE_BOARD_H

#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include "app.h"

enum { RIG_SLOTS = 3, RIG_SLOT_BYTES = 5424, RIG_LINE = 1 << 17 };

struct rig_queue {
    uint8_t bytes[RIG_LINE];
    size_t n, taken;
};

struct rig_board {
    struct board_facts facts;
    uint8_t key[32];
    bool stalls[RIG_SLOTS]; /* the next erase of the slot would stop the processor */
    uint32_t stalled;       /* erases that did */
    _Alignas(4) uint8_t flash[RIG_SLOTS][RIG_SLOT_BYTES];
    uint64_t operations, cut_at; /* of words programmed and slots erased; 0: no cut */
    uint32_t tear;               /* which bits of the cut word, which words of the cut slot get through */
    bool broken, deaf;           /* every operation fails; is said to be done and is not */
    jmp_buf cut;
    struct rig_queue to_board, to_host;
    size_t line_room;          /* bytes that board_send() takes at a time */
    uint32_t time_us, cost;    /* cost: how much a call of board_time_us() lets pass */
    uint32_t (*further)(void); /* what a test's own clock adds */
    uint16_t drive;
    bool alarm; /* the pin */
    unsigned alarm_changes;
    unsigned lives; /* calls of board_alive() */
    uint32_t kept[BOARD_KEPT_WORDS];
};

static struct rig_board board;

static inline void queue_put(struct rig_queue *q, size_t n, const uint8_t bytes[])
{
    if (q->taken == q->n)
        q->taken = q->n = 0;
    if (n > sizeof q->bytes - q->n)
        abort();
    memcpy(q->bytes + q->n, bytes, n);
    q->n += n;
}

static inline size_t queue_take(struct rig_queue *q, size_t n, uint8_t out[])
{
    const size_t left = q->n - q->taken;
    n = n < left ? n : left;
    memcpy(out, q->bytes + q->taken, n);
    q->taken += n;
    return n;
}

/* Blank flash, a key, 1 kHz, an open line. */
static inline void board_reset(void)
{
    memset(&board, 0, sizeof board);
    memset(board.flash, 0xFF, sizeof board.flash);
    for (int i = 0; i < 32; i++)
        board.key[i] = (uint8_t)(7 * i + 1);
    board.facts = (struct board_facts){.device = "device-no-12",
                                       .key = board.key,
                                       .session_key = board.key,
                                       .sample_mHz = 1000000,
                                       .core_Hz = 168000000,
                                       .sensor_code_max = 4095,
                                       .drive_code_zero = 2048,
                                       .nvm_slot_bytes = RIG_SLOT_BYTES,
                                       .kept = board.kept};
    board.line_room = SIZE_MAX;
    board.drive = 2048;
}

void board_drive(uint16_t code)
{
    board.drive = code;
}

void board_alarm(bool on)
{
    board.alarm = on;
    board.alarm_changes++;
}

void board_alive(void)
{
    board.lives++;
}

size_t board_receive(size_t n, uint8_t out[])
{
    return queue_take(&board.to_board, n, out);
}

size_t board_send(size_t n, const uint8_t bytes[])
{
    n = n < board.line_room ? n : board.line_room;
    queue_put(&board.to_host, n, bytes);
    return n;
}

uint32_t board_time_us(void)
{
    board.time_us += board.cost;
    return board.time_us + (board.further ? board.further() : 0);
}

static inline bool flash_is_cut(void)
{
    return ++board.operations == board.cut_at;
}

bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[])
{
    if (slot < 0 || slot >= RIG_SLOTS || offset > RIG_SLOT_BYTES || n > RIG_SLOT_BYTES - offset)
        return false;
    memcpy(out, board.flash[slot] + offset, n);
    return true;
}

bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[])
{
    if (slot < 0 || slot >= RIG_SLOTS || offset % 4 != 0 || offset > RIG_SLOT_BYTES ||
        4 * words > RIG_SLOT_BYTES - offset)
        abort(); /* the firmware never asks for it */
    for (size_t i = 0; i < words; i++) {
        uint32_t word, bits = data[i];
        const bool cut = flash_is_cut();
        if (board.broken)
            return false;
        if (cut)
            bits |= board.tear;
        if (board.deaf)
            bits = UINT32_MAX;
        memcpy(&word, board.flash[slot] + offset + 4 * i, sizeof word);
        word &= bits;
        memcpy(board.flash[slot] + offset + 4 * i, &word, sizeof word);
        if (cut)
            longjmp(board.cut, 1);
    }
    return true;
}

bool board_nvm_erase_stalls(int slot)
{
    return board.stalls[slot];
}

bool board_nvm_erase(int slot)
{
    if (slot < 0 || slot >= RIG_SLOTS)
        abort();
    board.stalled += board.stalls[slot];
    board.stalls[slot] = false;
    const bool cut = flash_is_cut();
    if (board.broken)
        return false;
    for (size_t i = 0; i < RIG_SLOT_BYTES; i++)
        if (!cut || !(board.tear >> i / 4 % 32 & 1u))
            board.flash[slot][i] = 0xFF;
    if (cut)
        longjmp(board.cut, 1);
    return true;
}

#endif
