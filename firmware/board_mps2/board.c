/* SPDX-License-Identifier: MIT */
/*
 * QEMU's mps2-an386 (Cortex-M4F) as a board without a converter. Its 16 MB PSRAM, which a file can back, stands for
 * what a real board has outside the core:
 *     +0x000000  three slots of non-volatile memory
 *     +0x700000  struct provision: identity and key, put there by the loader
 *     +0x800000  struct record: the sensor's codes, repeated for ever; without one the sensor reads mid scale
 */
#include "parts.h"

#ifndef BOARD_SAMPLE_HZ
#define BOARD_SAMPLE_HZ 1000
#endif

enum {
    CORE_HZ = 25000000,
    TICK_CYCLES = CORE_HZ / BOARD_SAMPLE_HZ,
    TICK_US = 1000000 / BOARD_SAMPLE_HZ,
    CODE_MAX = 4095,
    CODE_ZERO = 2048,
    PRIORITY_TICK = 0x40
};
#define PROVISION_MAGIC 0x504D4642u /* "BFMP" */
#define RECORD_MAGIC    0x524D4642u /* "BFMR" */

struct provision {
    uint32_t magic;
    uint8_t device[12], key[32], session_key[32]; /* the last one blank: the first does both */
};
struct record {
    uint32_t magic, n;
    uint16_t code[];
};
#define PROVISION     ((const volatile struct provision *)(PSRAM + 0x700000u))
#define RECORD        ((const volatile struct record *)(PSRAM + 0x800000u))
#define WAKEFUL       (*(const volatile uint32_t *)0x2001FF00u) /* as on the STM32: an emulator that wants no sleep */
#define WAKEFUL_MAGIC 0x5EEDu

void board_tick_isr(void);

static struct board_facts facts;
static struct {
    uint32_t magic, reason;
} last __attribute__((section(".noinit")));
#define LAST_MAGIC 0x5453414Cu /* "LAST": what restart() wrote, and not what memory holds at power-on */
static uint32_t kept[BOARD_KEPT_WORDS] __attribute__((section(".noinit")));
static uint32_t tick_us; /* when the last tick was due */
static volatile bool sampling;
static uint32_t next;

const struct board_facts *board_init(void)
{
    if (PROVISION->magic != PROVISION_MAGIC)
        return NULL;
    for (int i = 0; i < 12; i++)
        facts.device[i] = PROVISION->device[i];
    facts.key = (const uint8_t *)PROVISION->key;
    facts.session_key = (const uint8_t *)PROVISION->session_key;
    if (board_key_is_blank(facts.session_key))
        facts.session_key = facts.key;
    facts.reset = (uint8_t)(last.magic == LAST_MAGIC && last.reason < BEAM_RESETS ? last.reason : BEAM_RESET_POWER);
    facts.kept = kept;
    last.magic = 0;
    facts.sample_mHz = BOARD_SAMPLE_HZ * 1000u;
    facts.core_Hz = CORE_HZ;
    facts.sensor_code_max = CODE_MAX;
    facts.drive_code_zero = CODE_ZERO;
    facts.nvm_slot_bytes = NVM_SLOT_BYTES;
    sampling = false;
    FPGAIO_SCALE = CORE_HZ / 1000000 - 1;
    FPGAIO_COUNTER = 0;
    SCB_SHPR[11] = PRIORITY_TICK;
    SYSTICK_RVR = TICK_CYCLES - 1;
    SYSTICK_CVR = 0;
    SYSTICK_CSR = 7; /* core clock, interrupt, on */
    port_init();
    return &facts;
}

void board_start(void)
{
    WATCHDOG_LOAD = 4u * CORE_HZ;
    WATCHDOG_CONTROL = 3;
    tick_us = board_time_us();
    sampling = true;
}

void board_alive(void)
{
    WATCHDOG_CLEAR = 1; /* also loads it again */
}

void restart(enum beam_reset reason)
{
    last.reason = reason;
    last.magic = LAST_MAGIC;
    __asm__ volatile("dsb");
    SCB_AIRCR = 0x05FA0004u;
    for (;;) { /* the reset comes at once */
    }
}

void board_tick_isr(void)
{
    if (!sampling)
        return;
    const uint32_t passed = (board_time_us() - tick_us + TICK_US / 8) / TICK_US;
    if (passed == 0)
        return;
    tick_us += passed * TICK_US;
    if (passed > 1) /* a sample took longer than its interval: SysTick's pending bit is one tick, however many passed */
        app_missed(passed - 1);
    uint16_t code = CODE_ZERO;
    if (RECORD->magic == RECORD_MAGIC && RECORD->n > 0) {
        if (next >= RECORD->n)
            next = 0;
        code = RECORD->code[next++];
    }
    app_sample(code < CODE_MAX ? code : CODE_MAX);
}

void board_drive(uint16_t code)
{
    (void)code; /* nothing is driven: the record was made before */
}

/* The first of the board's lights. */
void board_alarm(bool on)
{
    FPGAIO_LED0 = on ? 1u : 0u;
}

uint32_t board_time_us(void)
{
    return FPGAIO_COUNTER;
}

bool board_idle(bool busy)
{
    if (!busy && WAKEFUL != WAKEFUL_MAGIC)
        __asm__ volatile("wfi");
    return true;
}
