/* SPDX-License-Identifier: MIT */
/* Vectors, reset, faults of a Cortex-M with an FPU; the part's own interrupt numbers go into `line`. A fault stills the drive and starts again. */
#include "../start.h"
#include "part.h"

#define SCB_AIRCR  (*(volatile uint32_t *)0xE000ED0Cu)
#define RESET_WORD 0x05FA0004u
enum { IRQ_SAMPLE = 0, IRQ_PORT = 1, IRQ_COUNT };

void board_reset(void);
void board_fault(void);

void board_fault(void)
{
    part_drive(PART_DRIVE_ZERO);
    SCB_AIRCR = RESET_WORD;
    for (;;) { /* the reset comes within microseconds */
    }
}

void board_reset(void)
{
    start_program();
}

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*core[15])(void);
    void (*line[IRQ_COUNT])(void);
} vectors = {.stack = &board_stack_top,
             .core = {board_reset, board_fault, board_fault, board_fault, board_fault, board_fault, 0, 0, 0, 0,
                      board_fault, board_fault, 0, board_fault, board_tick_isr}, /* SysTick */
             .line = {[IRQ_SAMPLE] = board_sample_isr, [IRQ_PORT] = board_port_isr}};
