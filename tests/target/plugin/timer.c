/* SPDX-License-Identifier: GPL-2.0-or-later */
/* TIM2, 32 bits, up, on 84 MHz: QEMU's own has another clock and no prescaler that works. */
#include <string.h>
#include "board.h"

enum { BASE = 0x40000000, CR1 = 0x00, EGR = 0x14, CNT = 0x24, PSC = 0x28, CEN = 1, UG = 1, MHZ = 84 };

static struct memory_region region;
static uint32_t registers[256];
static uint32_t prescaler; /* in use: PSC as the last update event found it */
static uint64_t held;      /* counts before `since` */
static int64_t since = -1; /* ns; −1: it stands still */

static uint64_t count(void)
{
    const uint64_t ns = since >= 0 ? (uint64_t)(qemu.now_ns(VIRTUAL_CLOCK) - since) : 0;
    return held + ns * MHZ / 1000 / (prescaler + 1);
}

static uint64_t timer_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    return at == CNT ? (uint32_t)count() : registers[at / 4];
}

static void timer_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    registers[at / 4] = (uint32_t)value;
    if (at == CR1 && !!(value & CEN) != (since >= 0)) {
        held = count();
        since = value & CEN ? qemu.now_ns(VIRTUAL_CLOCK) : -1;
    } else if (at == CNT || (at == EGR && (value & UG))) {
        held = at == CNT ? (uint32_t)value : 0;
        since = since >= 0 ? qemu.now_ns(VIRTUAL_CLOCK) : -1;
        prescaler = at == EGR ? registers[PSC / 4] & 0xFFFFu : prescaler;
    }
}

void timer_reset(void)
{
    memset(registers, 0, sizeof registers);
    prescaler = 0;
    held = 0;
    since = -1;
}

void timer_map(void *system)
{
    static const struct memory_ops ops = {
        .read = timer_read, .write = timer_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    qemu.region_io(&region, NULL, &ops, NULL, "tim2", sizeof registers);
    qemu.map(system, BASE, &region, 10);
}
