/* SPDX-License-Identifier: MIT */
/* Vectors, reset, faults. A fault stills the drive and starts again: the store says with what. */
#include "../start.h"
#include "stm32f405.h"

void board_reset(void);
void board_fault(void);
void board_tick_isr(void);
void board_sample_isr(void);
void board_port_isr(void);

void board_fault(void)
{
    DAC->DHR12R1 = 2048; /* no drive */
    SCB_AIRCR = AIRCR_SYSRESETREQ;
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
                      board_fault, board_fault, 0, board_fault, board_tick_isr},
             .line = {[IRQ_ADC] = board_sample_isr, [IRQ_USART1] = board_port_isr}}; /* no other is enabled */
