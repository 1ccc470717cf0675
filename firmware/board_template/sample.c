/* SPDX-License-Identifier: MIT */
/*
 * The tick starts a conversion; its end runs app_sample(). How many conversions did not take place is found from the free-running timer: of
 * all the ticks that pass while the processor stands still, one is pending.
 */
#include "part.h"

enum { TICK_US = 1000000 / BOARD_SAMPLE_HZ };

static uint32_t tick_us; /* when the last tick was due */
static volatile enum { OFF, WAITING, CONVERTING, STEPPING } phase;

void sample_begin(void)
{
    phase = OFF;
}

void board_start(void)
{
    part_watchdog_begin();
    tick_us = part_time_us();
    phase = WAITING;
    part_tick_begin(TICK_US);
}

void board_alive(void)
{
    part_watchdog_feed();
}

void board_tick_isr(void)
{
    if (phase == OFF)
        return;
    const uint32_t passed = (part_time_us() - tick_us + TICK_US / 8) / TICK_US;
    if (passed == 0) /* one that came late has already stood for it */
        return;
    tick_us += passed * TICK_US;
    const uint32_t missed = passed - 1 + (phase != WAITING);
    if (missed > 0)
        app_missed(missed);
    if (phase != STEPPING) { /* a lost conversion is started again */
        phase = CONVERTING;
        part_convert();
    }
}

void board_sample_isr(void)
{
    uint16_t code;
    if (!part_converted(&code) || phase != CONVERTING)
        return;
    phase = STEPPING;
    app_sample(code);
    phase = WAITING;
}

void board_drive(uint16_t code)
{
    part_drive(code);
}

uint32_t board_time_us(void)
{
    return part_time_us();
}
