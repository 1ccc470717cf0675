/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The flash controller with sectors 9..11 in a file: programming clears bits only; keys, lock, sizes and errors as in
 * RM0090. A power cut inside an operation leaves a word with some of its new zeros, or a sector with bits at random.
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include "board.h"

enum {
    FIRST_SECTOR = 9,
    SECTORS = 3,
    SECTOR = 0x20000,
    BYTES = SECTORS * SECTOR,
    KEYR = 0x04,
    SR = 0x0C,
    CR = 0x10,
    SR_EOP = 1,
    SR_WRPERR = 1 << 4,
    SR_PGPERR = 1 << 6,
    SR_PGSERR = 1 << 7,
    SR_BSY = 1 << 16,
    CR_PG = 1,
    CR_SER = 1 << 1,
    CR_STRT = 1 << 16
};
#define FLASH_AT 0x080A0000u
#define BASE     0x40023C00u
#define CR_LOCK  0x80000000u

static struct flash_options options;
static struct memory_region sectors, registers;
static uint8_t *file, *memory; /* what survives, and what the core reads */
static uint32_t cr = CR_LOCK, sr, acr, first_key;
static uint64_t operations;
static int64_t busy_until;
static uint64_t random_state;

static uint32_t random_word(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(random_state >> 32);
}

static void power_fails(const char *inside, uint32_t offset)
{
    fprintf(stderr, "[board] power fails in %s at %#x\n", inside, FLASH_AT + offset);
    board_end(77, "power failed");
}

static uint64_t flash_read(void *device, hwaddr at, unsigned size)
{
    uint32_t value = 0;
    (void)device;
    memcpy(&value, memory + at, size);
    return value;
}

static void flash_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    uint32_t word = 0;
    (void)device;
    if ((cr & CR_LOCK) || !(cr & CR_PG)) {
        sr |= SR_PGSERR;
        return;
    }
    if (size != 4 || (cr >> 8 & 3u) != 2u) {
        sr |= SR_PGPERR;
        return;
    }
    memcpy(&word, memory + at, 4);
    if (++operations == options.cut) {
        word &= (uint32_t)value | random_word();
        memcpy(file + at, &word, 4);
        power_fails("a word", (uint32_t)at);
    }
    word &= (uint32_t)value;
    memcpy(memory + at, &word, 4);
    memcpy(file + at, &word, 4);
    sr |= SR_EOP;
}

static void erase(unsigned sector)
{
    if (sector < FIRST_SECTOR || sector >= FIRST_SECTOR + SECTORS) {
        sr |= SR_WRPERR;
        return;
    }
    const uint32_t from = (sector - FIRST_SECTOR) * SECTOR;
    if (++operations == options.cut) {
        for (uint32_t i = 0; i < SECTOR; i++) {
            const uint32_t some = random_word();
            file[from + i] = (uint8_t)(file[from + i] | (some & some >> 8)); /* a quarter of its zeros */
        }
        power_fails("an erase", from);
    }
    memset(memory + from, 0xFF, SECTOR);
    memset(file + from, 0xFF, SECTOR);
    busy_until = qemu.now_ns(VIRTUAL_CLOCK) + (int64_t)options.erase_ns;
    sr |= SR_EOP;
}

static uint64_t register_read(void *device, hwaddr at, unsigned size)
{
    (void)device;
    (void)size;
    switch (at) {
    case 0:
        return acr;
    case SR:
        return sr | (qemu.now_ns(VIRTUAL_CLOCK) < busy_until ? (uint32_t)SR_BSY : 0u);
    case CR:
        return cr;
    default:
        return 0;
    }
}

static void register_write(void *device, hwaddr at, uint64_t value, unsigned size)
{
    (void)device;
    (void)size;
    switch (at) {
    case 0:
        acr = (uint32_t)value;
        break;
    case KEYR:
        if (value == 0xCDEF89ABu && first_key)
            cr &= ~CR_LOCK;
        first_key = value == 0x45670123u;
        break;
    case SR:
        sr &= ~(uint32_t)value;
        break;
    case CR:
        if (cr & CR_LOCK)
            return;
        cr = (uint32_t)value & ~(uint32_t)CR_STRT;
        if ((value & CR_SER) && (value & CR_STRT))
            erase((unsigned)(value >> 3 & 0xFu));
        break;
    default:
        break;
    }
}

bool flash_open(const struct flash_options *wanted)
{
    options = *wanted;
    random_state = options.seed * 2u + 1u;
    if (options.image == NULL) {
        file = malloc(BYTES);
        if (file != NULL)
            memset(file, 0xFF, BYTES);
        return file != NULL;
    }
    const int fd = open(options.image, O_RDWR | O_CREAT, 0644);
    if (fd < 0)
        return false;
    const off_t size = lseek(fd, 0, SEEK_END);
    if (size >= 0 && ftruncate(fd, BYTES) == 0)
        file = mmap(NULL, BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    (void)close(fd);
    if (file == NULL || file == MAP_FAILED)
        return false;
    if (size < BYTES)
        memset(file + size, 0xFF, (size_t)(BYTES - size));
    return true;
}

void flash_map(void *system)
{
    static const struct memory_ops flash_ops = {.read = flash_read,
                                                .write = flash_write,
                                                .endianness = LITTLE_ENDIAN_DEVICE,
                                                .valid = {1, 4, false, NULL},
                                                .impl = {1, 4, false}};
    static const struct memory_ops register_ops = {
        .read = register_read, .write = register_write, .endianness = LITTLE_ENDIAN_DEVICE, .impl = {4, 4, false}};
    static void *error;
    qemu.region_rom_device(&sectors, NULL, &flash_ops, NULL, "flash-9-11", BYTES, &error);
    memory = qemu.region_memory(&sectors);
    memcpy(memory, file, BYTES);
    qemu.map(system, FLASH_AT, &sectors, 10);
    qemu.region_io(&registers, NULL, &register_ops, NULL, "flash-registers", 0x400);
    qemu.map(system, BASE, &registers, 10);
}

void flash_reset(void)
{
    cr = CR_LOCK;
    sr = acr = first_key = 0;
}

uint64_t flash_operations(void)
{
    return operations;
}
