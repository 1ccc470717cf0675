/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A board's driver by itself, on the board or on a PC: whether it does what firmware/board.h says. A line for each group of checks; ends with
 * "driver: all passed" and status 0, or with what was wrong and its number. May be cut anywhere and started again: slot 1 keeps what the
 * first life wrote, and whatever a cut left in the others is erased and used.
 */
#include <string.h>
#include "board.h"

#ifdef DRIVER_ON_PC
#include <stdio.h>
#include <stdlib.h>
static void say(const char *text)
{
    (void)fputs(text, stdout);
    (void)fflush(stdout);
}
static void end(uint32_t status)
{
    exit((int)status);
}
#else
#include "../target/semihost.h"
#define say semihost_text
#define end semihost_exit
#endif

enum { SLOTS = 3, CHUNK = 16 /* words */, KEPT_SLOT = 1, SAMPLES = 400, ERASES = 40, ECHO = 2048 };
#define SEALED 0x5EA1ED01u

static volatile uint32_t samples, missed, begun_us, last_us, backwards;
static uint16_t largest;
static uint32_t slot_bytes, checks;

void app_sample(uint16_t sensor_code)
{
    const uint32_t now_us = board_time_us();
    backwards += samples > 0 && now_us - last_us > 0x80000000u;
    begun_us = samples == 0 ? now_us : begun_us;
    last_us = now_us;
    largest = sensor_code > largest ? sensor_code : largest;
    board_drive((uint16_t)(2000 + samples % 96));
    samples++;
}

void app_missed(uint32_t n)
{
    missed += samples > 0 ? n : 0;
}

static void must(bool good, const char *what)
{
    checks++;
    if (good)
        return;
    say("FAILED: ");
    say(what);
    say("\n");
    end(100);
}

/* ---- Memory ---- */

static uint32_t word_of(uint32_t round, uint32_t at)
{
    return (at + 1u) * 2654435761u ^ round * 2246822519u;
}

static bool all_ones(int slot)
{
    uint8_t bytes[4 * CHUNK];
    for (uint32_t at = 0; at < slot_bytes; at += sizeof bytes) {
        const uint32_t n = slot_bytes - at < sizeof bytes ? slot_bytes - at : (uint32_t)sizeof bytes;
        if (!board_nvm_read(slot, at, n, bytes))
            return false;
        for (uint32_t i = 0; i < n; i++)
            if (bytes[i] != 0xFF)
                return false;
    }
    return true;
}

static bool write_slot(int slot, uint32_t round, uint32_t end_at)
{
    uint32_t words[CHUNK];
    for (uint32_t at = 0; at < end_at; at += sizeof words) {
        const uint32_t n = end_at - at < sizeof words ? (end_at - at) / 4 : CHUNK;
        for (uint32_t i = 0; i < n; i++)
            words[i] = word_of(round, at / 4 + i);
        if (!board_nvm_program(slot, at, n, words))
            return false;
    }
    return true;
}

static bool holds(int slot, uint32_t round, uint32_t end_at)
{
    for (uint32_t at = 0; at < end_at; at += 4) {
        uint32_t word = 0;
        uint8_t bytes[4];
        if (!board_nvm_read(slot, at, sizeof bytes, bytes))
            return false;
        memcpy(&word, bytes, sizeof word);
        if (word != word_of(round, at / 4))
            return false;
    }
    return true;
}

/* What the first life wrote to slot 1 stays, whatever the others go through and whenever the power goes. */
static void keep_slot(void)
{
    uint32_t seal = 0;
    uint8_t bytes[4];
    must(board_nvm_read(KEPT_SLOT, slot_bytes - 4, 4, bytes), "the last word of a slot is read");
    memcpy(&seal, bytes, sizeof seal);
    if (seal == SEALED) {
        must(holds(KEPT_SLOT, 7, slot_bytes - 4), "a slot keeps what it holds over a start");
        say("kept     what an earlier life wrote is there\n");
        return;
    }
    seal = SEALED;
    must(board_nvm_erase(KEPT_SLOT) && all_ones(KEPT_SLOT), "an erased slot reads ones, whatever a cut had left in it");
    must(write_slot(KEPT_SLOT, 7, slot_bytes - 4) && board_nvm_program(KEPT_SLOT, slot_bytes - 4, 1, &seal),
         "a whole slot is programmed");
}

static void memory_is_used_again(int slot, int erases)
{
    for (int round = 0; round < erases; round++) {
        must(board_nvm_erase(slot), "a slot is erased");
        must(all_ones(slot), "an erased slot reads ones");
        must(write_slot(slot, (uint32_t)round, 256) && holds(slot, (uint32_t)round, 256), "words read as programmed");
    }
    must(board_nvm_erase(slot) && write_slot(slot, 99, slot_bytes) && holds(slot, 99, slot_bytes),
         "a whole slot reads as programmed");
}

static void words_lose_bits_only(void)
{
    const uint32_t first = 0xF0F0FF00u, second = 0xFF00F0FFu;
    uint32_t word = 0;
    uint8_t bytes[4], one = 0;
    must(board_nvm_erase(0) && board_nvm_program(0, 8, 1, &first), "a word is programmed");
    (void)board_nvm_program(0, 8, 1, &second); /* a flash may refuse, and must not set a bit */
    must(board_nvm_read(0, 8, 4, bytes), "a word is read");
    memcpy(&word, bytes, sizeof word);
    must((word & ~first) == 0, "no bit comes back without an erase");
    must(board_nvm_program(0, 16, 1, &first) && board_nvm_read(0, 17, 1, &one) && one == 0xFF,
         "bytes are read at any place, lowest first");
    must(board_nvm_read(0, 4, 4, bytes) && bytes[0] == 0xFF && bytes[3] == 0xFF, "neighbours stay as they are");
}

static void what_is_outside_is_refused(void)
{
    uint8_t bytes[8];
    const uint32_t words[2] = {0, 0};
    must(!board_nvm_read(-1, 0, 1, bytes) && !board_nvm_read(SLOTS, 0, 1, bytes), "there are three slots");
    must(!board_nvm_read(0, slot_bytes, 1, bytes) && !board_nvm_read(0, slot_bytes - 4, 8, bytes),
         "reading ends with the slot");
    must(!board_nvm_read(0, 4, SIZE_MAX - 2, bytes), "a length that wraps is refused");
    must(!board_nvm_program(0, slot_bytes - 4, 2, words) && !board_nvm_program(0, slot_bytes, 1, words),
         "programming ends with the slot");
    must(!board_nvm_program(0, 2, 1, words), "programming begins at a word");
    must(!board_nvm_program(0, 0, SIZE_MAX / 4 + 2, words), "a number of words that wraps is refused");
    must(!board_nvm_program(-1, 0, 1, words) && !board_nvm_program(SLOTS, 0, 1, words),
         "programming knows three slots");
    must(!board_nvm_erase(-1) && !board_nvm_erase(SLOTS), "erasing knows three slots");
}

/* ---- Samples ---- */

static void samples_come(const struct board_facts *facts)
{
    const uint32_t patience_us = 20000000u, start_us = board_time_us();
    uint8_t byte;
    board_start();
    board_alarm(true);
    while (samples < SAMPLES && board_time_us() - start_us < patience_us) {
        must(board_idle(true), "the board goes on");
        must(board_receive(0, &byte) == 0 && board_send(0, &byte) == 0, "no bytes are no bytes");
        if (samples == SAMPLES / 2) /* sampling goes on meanwhile, or what it missed is counted */
            must(board_nvm_erase(0) && write_slot(0, 3, 64), "the memory works while the board samples");
        board_alive();
    }
    board_alarm(false);
    must(samples >= SAMPLES, "samples come");
    const uint32_t counted = samples - 1 + missed, span_us = last_us - begun_us;
    const uint32_t due = (uint32_t)((uint64_t)span_us * facts->sample_mHz / 1000000000u);
    must(backwards == 0, "time goes on");
    must(counted + 2 >= due && counted <= due + 2,
         "samples and missed ones are as many as were due by the board's time");
    must(largest <= facts->sensor_code_max, "codes are within the converter's range");
}

/* What comes in goes out, when somebody is there. */
static void bytes_go_both_ways(void)
{
    uint8_t bytes[32];
    uint32_t echoed = 0, quiet_us = board_time_us();
    say("echo\n");
    while (echoed < ECHO && board_time_us() - quiet_us < 2000000u) {
        const uint32_t left = ECHO - echoed;
        const size_t n = board_receive(left < sizeof bytes ? left : sizeof bytes, bytes);
        for (size_t sent = 0; sent < n;) {
            sent += board_send(n - sent, bytes + sent);
            (void)board_idle(true);
        }
        if (n > 0)
            quiet_us = board_time_us();
        echoed += (uint32_t)n;
        board_alive();
        (void)board_idle(true);
    }
    must(echoed == 0 || echoed == ECHO, "no byte is lost on its way in or out");
    say(echoed == 0 ? "port     nobody was there\n" : "port     every byte came back\n");
}

int main(void)
{
    const struct board_facts *facts = board_init();
    must(facts != NULL, "the board is whole, and has a key");
    must(facts->key != NULL && facts->session_key != NULL, "keys");
    must(facts->sample_mHz > 0 && facts->core_Hz > 0 && facts->sensor_code_max > 0, "rate, clock, converter");
    must(facts->reset < BEAM_RESETS && facts->nvm_slot_bytes % 4 == 0 && facts->nvm_slot_bytes >= 5200,
         "reason of the start, size of a slot");
    slot_bytes = facts->nvm_slot_bytes;
    keep_slot();
    words_lose_bits_only();
    what_is_outside_is_refused();
    memory_is_used_again(2, 3);
    memory_is_used_again(0, ERASES);
    keep_slot();
    must(!board_nvm_erase_stalls(-1) && !board_nvm_erase_stalls(SLOTS), "what would stall is a slot");
    say("memory   erased, programmed, read, kept, bounded\n");
    samples_come(facts);
    say("samples  as many as were due\n");
    bytes_go_both_ways();
    say("driver: all passed\n");
    end(0);
    return 0;
}
