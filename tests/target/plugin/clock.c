/* SPDX-License-Identifier: GPL-2.0-or-later */
/* RCC whose oscillators are ready as soon as they are switched on, and that says why it was reset; the unique identity. */
#include <stdlib.h>
#include <string.h>
#include "board.h"

enum {
    RCC_BASE = 0x40023800,
    CR = 0x00,
    CFGR = 0x08,
    CSR = 0x74,
    RMVF = 1 << 24,
    PIN = 1 << 26,
    POWER = 1 << 27,
    SOFTWARE = 1 << 28,
    WATCHDOG = 1 << 29,
    HSION = 1 << 0,
    HSEON = 1 << 16,
    PLLON = 1 << 24,
    IDENTITY_BASE = 0x1FFF7A10,
    IDENTITY_BYTES = 12
};

static struct memory_region rcc_region, identity_region;
static uint32_t rcc_register[64] = {HSION};
static uint32_t reasons = PIN | POWER;
static bool was_used;
static uint8_t identity[16];

static uint64_t rcc_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    const uint32_t value = rcc_register[at / 4];
    if (at == CR) /* each ready bit stands above its switch */
        return value | (value & (HSION | HSEON | PLLON)) << 1;
    if (at == CSR)
        return reasons;
    if (at == CFGR) /* SWS says what SW asks */
        return (value & ~0xCu) | (value & 3u) << 2;
    return value;
}

static void rcc_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    was_used = true;
    if (at == CSR && (value & RMVF))
        reasons = 0;
    rcc_register[at / 4] = (uint32_t)value;
}

/* The emulator also resets once before anything runs. */
void clock_reset(bool by_watchdog)
{
    if (was_used)
        reasons |= (uint32_t)PIN | (uint32_t)(by_watchdog ? WATCHDOG : SOFTWARE);
    memset(rcc_register, 0, sizeof rcc_register);
    rcc_register[CR / 4] = HSION;
    was_used = false;
}

static uint64_t identity_read(void *device, hwaddr at, unsigned size)
{
    uint64_t value = 0;
    (void)device;
    memcpy(&value, identity + at, size);
    return value;
}

static void identity_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)at;
    (void)value;
    (void)size;
}

void clock_map(void *system, const char *unique_id)
{
    static const struct memory_ops rcc_ops = {
        .read = rcc_read, .write = rcc_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    static const struct memory_ops identity_ops = {
        .read = identity_read, .write = identity_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {1, 4, false}};
    for (size_t i = 0; i < IDENTITY_BYTES && strlen(unique_id) >= 2 * i + 2; i++) {
        const char digits[3] = {unique_id[2 * i], unique_id[2 * i + 1]};
        identity[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
    qemu.region_io(&rcc_region, NULL, &rcc_ops, NULL, "rcc", sizeof rcc_register);
    qemu.map(system, RCC_BASE, &rcc_region, 10);
    qemu.region_io(&identity_region, NULL, &identity_ops, NULL, "identity", IDENTITY_BYTES);
    qemu.map(system, IDENTITY_BASE, &identity_region, 10);
}
