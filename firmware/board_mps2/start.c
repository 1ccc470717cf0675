/* SPDX-License-Identifier: MIT */
/* Vectors, reset, faults: a fault starts again, and so does the watchdog. */
#include "../start.h"
#include "parts.h"

void board_reset(void);
void board_fault(void);
void board_tick_isr(void);
void board_port_isr(void);
void board_watchdog_isr(void);

void board_fault(void)
{
    restart(BEAM_RESET_FAULT);
}

/* The watchdog, the first time that it comes to 0. */
void board_watchdog_isr(void)
{
    restart(BEAM_RESET_WATCHDOG);
}

void board_reset(void)
{
    start_program();
}

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*core[15])(void);
    void (*line[32])(void);
} vectors = {.stack = &board_stack_top,
             .core = {board_reset, board_watchdog_isr, board_fault, board_fault, board_fault, board_fault, 0, 0, 0, 0,
                      board_fault, board_fault, 0, board_fault, board_tick_isr},
             .line = {[IRQ_UART0_RX] = board_port_isr}}; /* no other is enabled */
