/* SPDX-License-Identifier: GPL-2.0-or-later */
/* IWDG: counts down on 32 kHz in the emulator's virtual time, resets at 0. Keys as in RM0090. */
#include <stdio.h>
#include <string.h>
#include "board.h"

enum {
    BASE = 0x40003000,
    KR = 0x00,
    PR = 0x04,
    RLR = 0x08,
    BEGIN = 0xCCCC,
    UNLOCK = 0x5555,
    RELOAD = 0xAAAA,
    TICK_NS = 31250,
    ROUND = 4096
};

static struct memory_region region;
static struct timer timer;
static uint32_t prescaler, reload = ROUND - 1;
static bool has_timer, unlocked, counts, fired;

static void at_zero(void *unused)
{
    (void)unused;
    if (!counts)
        return;
    fprintf(stderr, "[board] the watchdog resets\n");
    fired = true;
    qemu.reset(GUEST_RESET);
}

static void begin_anew(void)
{
    if (!has_timer)
        qemu.timer_init(&timer, NULL, VIRTUAL_CLOCK, NANOSECONDS, 0, at_zero, NULL);
    has_timer = true;
    qemu.timer_at(&timer, qemu.now_ns(VIRTUAL_CLOCK) + (int64_t)(reload + 1) * TICK_NS * (4 << prescaler));
}

static uint64_t watchdog_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    return at == PR ? prescaler : at == RLR ? reload : 0;
}

static void watchdog_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    if (at == PR && unlocked)
        prescaler = value > 6 ? 6 : (uint32_t)value;
    if (at == RLR && unlocked)
        reload = value & (ROUND - 1);
    if (at != KR)
        return;
    unlocked = value == UNLOCK;
    counts = counts || value == BEGIN;
    if (counts && (value == BEGIN || value == RELOAD))
        begin_anew();
}

bool watchdog_reset(void)
{
    const bool was = fired;
    fired = counts = unlocked = false;
    prescaler = 0;
    reload = ROUND - 1;
    return was;
}

void watchdog_map(void *system)
{
    static const struct memory_ops ops = {
        .read = watchdog_read, .write = watchdog_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    qemu.region_io(&region, NULL, &ops, NULL, "iwdg", 0x400);
    qemu.map(system, BASE, &region, 10);
}
