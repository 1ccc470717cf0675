/* SPDX-License-Identifier: MIT */
/* parts.h — the registers of the mps2-an386 that this board uses, and what its files share. */
#ifndef PARTS_H
#define PARTS_H

#include "../board.h"

struct cmsdk_uart {
    volatile uint32_t DATA, STATE, CTRL, INTSTATUS, BAUDDIV;
};
/* What a file can back, and a kill leaves: 16 MB at another place on each image of the FPGA. */
#ifndef PSRAM
#define PSRAM 0x21000000u
#endif

#define UART0          ((struct cmsdk_uart *)0x40004000u)
#define SYSTICK_CSR    (*(volatile uint32_t *)0xE000E010u)
#define SYSTICK_RVR    (*(volatile uint32_t *)0xE000E014u)
#define SYSTICK_CVR    (*(volatile uint32_t *)0xE000E018u)
#define NVIC_ISER0     (*(volatile uint32_t *)0xE000E100u)
#define NVIC_ICER0     (*(volatile uint32_t *)0xE000E180u)
#define NVIC_IPR       ((volatile uint8_t *)0xE000E400u)
#define SCB_ICSR       (*(volatile uint32_t *)0xE000ED04u)
#define SCB_AIRCR      (*(volatile uint32_t *)0xE000ED0Cu)
#define SCB_SHPR       ((volatile uint8_t *)0xE000ED18u) /* [11]: SysTick */
#define FPGAIO_LED0    (*(volatile uint32_t *)0x40028000u)
#define FPGAIO_COUNTER (*(volatile uint32_t *)0x40028018u) /* up, once in PRESCALE + 1 cycles */
#define FPGAIO_SCALE   (*(volatile uint32_t *)0x4002801Cu)
#define ICSR_PENDSTSET (1u << 26)

#define WATCHDOG_LOAD (*(volatile uint32_t *)0x40008000u)
#define WATCHDOG_CONTROL                                                                                               \
    (*(volatile uint32_t *)0x40008008u) /* 1: at 0 a non-maskable interrupt, 2: the second time a reset */
#define WATCHDOG_CLEAR (*(volatile uint32_t *)0x4000800Cu)

enum { IRQ_UART0_RX = 0, NVM_SLOT_BYTES = 8 * 1024 };

void port_init(void);

/* Starts again for this reason, which the next start finds. */
_Noreturn void restart(enum beam_reset reason);

#endif
