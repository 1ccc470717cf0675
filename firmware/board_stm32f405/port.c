/* SPDX-License-Identifier: MIT */
/* USART1: received bytes through an interrupt into a ring; bytes to send go as the transmitter takes them. */
#include "../byte_ring.h"
#include "parts.h"

enum { PRIORITY_USART = 0x10 }; /* above the sample's: the receiver holds one byte only, 11 µs at 921600 baud */

void board_port_isr(void);

static struct byte_ring ring;

void port_init(void)
{
    ring.written = ring.read_out = 0;
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
    if (byte_ring_full(&ring)) {
        NVIC_ICER[IRQ_USART1 / 32] = 1u << IRQ_USART1 % 32;
        return;
    }
    byte_ring_put(&ring, (uint8_t)USART1->DR); /* clears RXNE, and ORE after the status was read */
}

size_t board_receive(size_t n, uint8_t out[])
{
    const size_t taken = byte_ring_take(&ring, n, out);
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
