/* SPDX-License-Identifier: MIT */
/* USART1: received bytes through an interrupt into a ring; bytes to send go as the transmitter takes them. */
#include "parts.h"

enum {
    RING = 128,
    PRIORITY_USART = 0x10
}; /* above the sample's: the receiver holds one byte only, 11 µs at 921600 baud */
_Static_assert((RING & (RING - 1)) == 0, "a power of two");

void board_port_isr(void);

static volatile uint8_t ring[RING];
static volatile uint32_t written, read_out; /* free-running; written by the interrupt, read_out by the background */

void port_init(void)
{
    written = read_out = 0;
    USART1->BRR = (APB2_HZ + BOARD_BAUD / 2) / BOARD_BAUD;
    USART1->CR1 = CR1_UE | CR1_TE | CR1_RE | CR1_RXNEIE;
    NVIC_IPR[IRQ_USART1] = PRIORITY_USART;
    NVIC_ISER[IRQ_USART1 / 32] = 1u << IRQ_USART1 % 32;
}

/* A full ring is left to the line: the interrupt stays off until the background has taken something. */
void board_port_isr(void)
{
    if (!(USART1->SR & (USART_RXNE | USART_ORE)))
        return;
    if (written - read_out == RING) {
        NVIC_ICER[IRQ_USART1 / 32] = 1u << IRQ_USART1 % 32;
        return;
    }
    ring[written % RING] = (uint8_t)USART1->DR; /* clears RXNE, and ORE after the status was read */
    written = written + 1;
}

size_t board_receive(size_t n, uint8_t out[])
{
    size_t taken = 0;
    for (; taken < n && read_out != written; taken++) {
        out[taken] = ring[read_out % RING];
        read_out = read_out + 1;
    }
    if (taken > 0)
        NVIC_ISER[IRQ_USART1 / 32] = 1u << IRQ_USART1 % 32;
    return taken;
}

size_t board_send(size_t n, const uint8_t bytes[])
{
    size_t sent = 0;
    for (; sent < n && (USART1->SR & USART_TXE); sent++)
        USART1->DR = bytes[sent];
    return sent;
}
