/* SPDX-License-Identifier: MIT */
/*
 * board.h — everything the application asks of a board. Nothing but board_<name>/ sees a register, a file or a pty.
 *
 * Two contexts: the sample interrupt (sample_isr, priority above the serial port's) and the background loop. What a
 * function may be called from is said beside it. No function waits without a bound.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "beam_wire.h"

/* Facts of the board, constant while it runs. */
struct board_facts {
    uint8_t device[12];         /* unique identity */
    const uint8_t *key;         /* 32 bytes, of this device, that sign its images; never leave the board */
    const uint8_t *session_key; /* 32 bytes that unlock a session; the same ones where one key does both */
    uint32_t sample_mHz;        /* sample rate, 1/1000 Hz */
    uint32_t core_Hz;           /* clock of the processor: what a step may cost follows from it and the rate */
    uint16_t sensor_code_max;   /* 4095 */
    uint16_t drive_code_zero;   /* 2048 */
    uint32_t nvm_slot_bytes;    /* capacity of one slot, a multiple of 4 */
    uint8_t reset;              /* enum beam_reset: why it started */
    uint32_t *kept;             /* BOARD_KEPT_WORDS that a reset leaves as they were; NULL: the board has none */
};
enum { BOARD_KEPT_WORDS = 5 };

/* A key that was never programmed: ones, as an erased flash reads, or zeros. */
static inline bool board_key_is_blank(const uint8_t key[32])
{
    uint8_t ones = 0xFF, zeros = 0;
    for (int i = 0; i < 32; i++) {
        ones &= key[i];
        zeros |= key[i];
    }
    return ones == 0xFF || zeros == 0;
}

/* Clocks, converter, port, memory; not yet sampling. Background, once. Returns NULL when the board is broken. */
const struct board_facts *board_init(void);

/* From now on app_sample() is called once a tick, with the finished conversion, and the watchdog watches. Background, once. */
void board_start(void);

/*
 * The application is alive: samples and the background loop go on. A board whose watchdog hears nothing for about 4 s, which
 * is longer than an erase of its flash stalls it, starts again and says BEAM_RESET_WATCHDOG. Background.
 */
void board_alive(void);

/* Drive code to the D/A, taking effect at once. Sample interrupt. */
void board_drive(uint16_t code);

/* The output that says that something is wrong: an alarm, or a fault of the sensor. Off after board_init(). Sample interrupt. */
void board_alarm(bool on);

/* Up to n received bytes; never waits. Background. */
size_t board_receive(size_t n, uint8_t out[]);

/* As many of n bytes as the port takes now; never waits longer than one byte's time. Background. */
size_t board_send(size_t n, const uint8_t bytes[]);

/* Microseconds since board_init(), modulo 2³², of a timer that goes on while the processor stands still. Any context. */
uint32_t board_time_us(void);

/*
 * Non-volatile memory: slots 0 and 1, and slot 2 for the boot counter. Erased bytes read 0xFF; a programmed word can
 * only clear bits. A program of `words` words of 4 bytes at a word offset. Background; the sample interrupt goes on
 * (the code runs from memory that an erase does not stall, or the board says in its page what it costs).
 * False: outside, or the hardware reported failure.
 */
bool board_nvm_read(int slot, uint32_t offset, size_t n, uint8_t out[]);
bool board_nvm_program(int slot, uint32_t offset, size_t words, const uint32_t data[]);
bool board_nvm_erase(int slot);

/*
 * Would the next erase of this slot stop the processor, the sample interrupt included? What the store can spare is then erased before
 * sampling begins, at power-on. Background; false: it would not, or there is no such slot.
 */
bool board_nvm_erase_stalls(int slot);

/*
 * A turn of the background loop is over. busy: there is more to do, or a frame on its way to the port: returns soon;
 * else may sleep until the next interrupt. False: power down is wished (board_host, emulators), leave the loop.
 */
bool board_idle(bool busy);

/* ---- What the board calls ---- */

/* The sample interrupt's work: one conversion finished. Bounded; see docs/target.md for its cost. */
void app_sample(uint16_t sensor_code);

/*
 * So many conversions were due and did not take place: the last sample was not finished, or nothing ran meanwhile (a flash
 * that is erased stops the processor). A board finds their number from a timer that nothing stops, not from its ticks.
 */
void app_missed(uint32_t n);

#endif /* BOARD_H */
