/* SPDX-License-Identifier: MIT */
/* start.h — what every Cortex-M with an FPU does after a reset, whatever is around it. For the boards' vectors. */
#ifndef START_H
#define START_H

#include "sections.h"

#define START_CPACR  (*(volatile uint32_t *)0xE000ED88u)
#define START_FPDSCR (*(volatile uint32_t *)0xE000EF3Cu)

int main(void);

/* FPU, arithmetic, memory, main(). */
static inline _Noreturn void start_program(void)
{
    START_CPACR |= 0xFu << 20; /* the FPU, before any instruction of its */
    __asm__ volatile("dsb\n isb");
    START_FPDSCR = 0; /* interrupts and background alike: to nearest, denormal numbers kept, as on the host */
    __asm__ volatile("vmsr fpscr, %0" : : "r"(0));
    sections_init();
    (void)main();
    for (;;) /* nothing that could run: a broken board, no provision, or main() has ended */
        __asm__ volatile("wfi");
}

#endif
