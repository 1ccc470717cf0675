/* SPDX-License-Identifier: MIT */
/*
 * part.h — what is the part's own: registers, and nothing else. A board made of this folder writes these functions in a file part.c;
 * everything above them (ticks, missed conversions, ring, bounds, order of the start-up) stands in the other files and may stay as it is.
 * tests/driver/part_pc.c is a part on a PC, against which these files are tested.
 */
#ifndef PART_H
#define PART_H

#include "../board.h"

#ifndef BOARD_SAMPLE_HZ
#define BOARD_SAMPLE_HZ 1000
#endif
enum {
    PART_CORE_HZ = 168000000, /* what part_clock() makes */
    PART_DRIVE_ZERO = 2048,   /* D/A code of no drive */
    PART_CODE_MAX = 4095,
    PART_SLOT_BYTES = 8192, /* of one slot; each must be erasable without the others */
    PART_SLOTS = 3
};

/* Clock, pins, converters, serial port with its interrupt (board_port_isr), in this order; false: the part is broken. Waits are bounded. */
bool part_begin(void);
void part_identity(uint8_t device[12]);
const uint8_t *part_key(void);   /* 64 bytes: what signs images, what unlocks sessions */
uint8_t part_reset_reason(void); /* enum beam_reset; clears what the part noted */

uint32_t part_time_us(void); /* of a free-running timer */
void part_tick_begin(
    uint32_t interval_us); /* board_tick_isr() from now on; above the port's interrupt, which is above the sample's */
void part_convert(void);   /* begin a conversion; its end raises board_sample_isr() */
bool part_converted(uint16_t *code); /* is it finished? then its code, and the flag is cleared */
void part_drive(uint16_t code);
void part_alarm(bool on);

void part_watchdog_begin(void); /* about 4 s, above the longest erase */
void part_watchdog_feed(void);

bool part_receive(uint8_t *byte); /* a byte that has come */
void part_receive_enable(bool on);
bool part_send(uint8_t byte); /* false: the transmitter takes none now */

const volatile uint32_t *part_slot(int slot);
bool part_program(int slot, uint32_t word, uint32_t value); /* clears bits; true when the word then reads so */
bool part_erase(int slot);    /* to ones; what stalls meanwhile is the board's page's to say */
bool part_erase_stalls(void); /* does the processor stand still meanwhile? */

void part_sleep(void); /* until an interrupt */

/* ---- What the part's interrupts call ---- */
void board_tick_isr(void);
void board_sample_isr(void);
void board_port_isr(void);

/* ---- Between the files of this folder ---- */
void sample_begin(void);
void port_begin(void);

#endif
