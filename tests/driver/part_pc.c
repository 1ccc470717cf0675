/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The part of firmware/board_template on a PC: a converter, a port that hears itself, a flash in the file of the first argument; the second
 * cuts the power in the N-th operation on it: a word half programmed, a slot half erased, status 42. Time passes where it is asked for.
 */
#include "board_template/part.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <fcntl.h>
#include <unistd.h>

enum { CUT = 42, ERASE_US = 50000 };

static uint32_t now_us, next_us, interval_us, flash[PART_SLOTS][PART_SLOT_BYTES / 4],
    (*memory)[PART_SLOT_BYTES / 4] = flash;
static unsigned long operations, cut_at;
static bool converting, listens, in_interrupt;
static uint8_t held[256];
static uint32_t held_in, held_out;

/* Interrupts take place between the background's own steps. */
static void let_pass(uint32_t us)
{
    now_us += us;
    if (in_interrupt)
        return;
    in_interrupt = true;
    if (interval_us > 0 && (int32_t)(now_us - next_us) >= 0) {
        next_us += ((now_us - next_us) / interval_us + 1) * interval_us;
        board_tick_isr();
    }
    if (converting)
        board_sample_isr();
    if (listens && held_in != held_out)
        board_port_isr();
    in_interrupt = false;
}

bool part_begin(void)
{
    return true;
}

void part_identity(uint8_t device[12])
{
    for (int i = 0; i < 12; i++)
        device[i] = (uint8_t)(0x10 + i);
}

const uint8_t *part_key(void)
{
    static uint8_t key[64];
    memset(key, 1, sizeof key);
    return key;
}

uint8_t part_reset_reason(void)
{
    return BEAM_RESET_POWER;
}

uint32_t part_time_us(void)
{
    let_pass(1);
    return now_us;
}

void part_tick_begin(uint32_t us)
{
    interval_us = us;
    next_us = now_us + us;
}

void part_convert(void)
{
    converting = true;
}

bool part_converted(uint16_t *code)
{
    *code = (uint16_t)(now_us % 4096u);
    const bool was = converting;
    converting = false;
    return was;
}

void part_drive(uint16_t code)
{
    if (code > PART_CODE_MAX)
        exit(101);
}

void part_alarm(bool on)
{
    (void)on;
}

void part_watchdog_begin(void) {}
void part_watchdog_feed(void) {}

bool part_receive(uint8_t *byte)
{
    if (held_in == held_out)
        return false;
    *byte = held[held_out++ % sizeof held];
    return true;
}

void part_receive_enable(bool on)
{
    listens = on;
}

bool part_send(uint8_t byte)
{
    let_pass(1);
    if (held_in - held_out == sizeof held)
        return false;
    held[held_in++ % sizeof held] = byte;
    return true;
}

const volatile uint32_t *part_slot(int slot)
{
    return memory[slot];
}

bool part_program(int slot, uint32_t word, uint32_t value)
{
    uint32_t *at = &memory[slot][word];
    if (++operations == cut_at) {
        *at &= value | 0x5A5A5A5Au;
        _exit(CUT);
    }
    const uint32_t wanted = *at & value;
    *at = wanted;
    return *at == wanted;
}

bool part_erase(int slot)
{
    const bool cut = ++operations == cut_at;
    memset(memory[slot], 0xFF, cut ? PART_SLOT_BYTES / 2 : PART_SLOT_BYTES);
    if (cut)
        _exit(CUT);
    now_us += ERASE_US; /* nothing runs meanwhile */
    return true;
}

bool part_erase_stalls(void)
{
    return true;
}

void part_sleep(void)
{
    let_pass(100);
}

int driver_main(void);

int main(int argc, char **argv)
{
    static const char hello[] = "heard by itself";
    const int fd = argc > 1 ? open(argv[1], O_RDWR | O_CREAT | O_CLOEXEC, 0600) : -1;
    cut_at = argc > 2 ? strtoul(argv[2], NULL, 10) : 0;
    memset(flash, 0xFF, sizeof flash);
    if (fd >= 0) {
        const off_t had = lseek(fd, 0, SEEK_END);
        void *file = ftruncate(fd, sizeof flash) == 0
                         ? mmap(NULL, sizeof flash, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)
                         : MAP_FAILED;
        if (file == MAP_FAILED)
            return 1;
        memory = file;
        if (had == 0)
            memset(file, 0xFF, sizeof flash);
        (void)close(fd);
    }
    memcpy(held, hello, sizeof hello - 1);
    held_in = sizeof hello - 1;
    return driver_main();
}
