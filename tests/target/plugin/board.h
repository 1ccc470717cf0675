/* SPDX-License-Identifier: GPL-2.0-or-later */
/* board.h — the parts of the STM32F405 that QEMU's netduinoplus2 lacks. */
#ifndef PLUGIN_BOARD_H
#define PLUGIN_BOARD_H

#include "qemu_api.h"

extern struct qemu qemu;

/* Says what was counted, and ends the emulation at once: what the core would do next is of no interest. */
void board_end(int status, const char *why);

/* ADC1 and DAC. Samples come from `rec` (16-bit codes), or from a plant behind the stream socket `plant`, or are mid scale. */
struct adc_options {
    const char *record, *plant;
    uint64_t stop;    /* conversions after which the emulation ends, status 0; 0: never */
    const char *live; /* file that takes `live_bytes` from address `live_at` before every conversion but the first */
    uint64_t live_at, live_bytes;
    uint64_t dead;          /* conversion that does not finish, nor any after it until a reset; 0: none */
    uint64_t poke, poke_at; /* a word of ones is written to this address before the conversion poke_at, once */
};
bool adc_open(const struct adc_options *options);
void adc_reset(void);
void adc_map(void *system);
uint64_t adc_conversions(void);
void adc_close(void);

/* Flash controller and sectors 9..11, kept in a file. */
struct flash_options {
    const char *image;
    uint64_t cut, seed; /* power fails inside the cut-th operation (a word, an erase, from 1): status 77 */
    uint64_t erase_ns;  /* virtual time that an erase stays busy */
};
bool flash_open(const struct flash_options *options);
void flash_map(void *system);
void flash_reset(void);
uint64_t flash_operations(void);

/* RCC with ready bits and the reason of the last reset, and the identity words. */
void clock_map(void *system, const char *unique_id);
void clock_reset(bool by_watchdog);

/* TIM2 as a free-running counter: prescaler, update, count, in the emulator's virtual time. */
void timer_map(void *system);
void timer_reset(void);

/* IWDG on 32 kHz, in virtual time. */
void watchdog_map(void *system);
bool watchdog_reset(void); /* was it the watchdog's reset? */

/* Instructions between addresses. */
bool count_end(uint64_t address);
void count_from(qemu_plugin_id_t id, uint64_t address);
void count_report(void);

#endif
