/* SPDX-License-Identifier: MIT */
/* UART0: received bytes through an interrupt into a ring; bytes to send go as the transmitter takes them. */
#include "../byte_ring.h"
#include "parts.h"

enum {
    PRIORITY_UART = 0x80,
    STATE_TX_FULL = 1,
    STATE_RX_FULL = 2,
    CTRL_TX = 1,
    CTRL_RX = 2,
    CTRL_RX_INTERRUPT = 8,
    INTERRUPT_RX = 2
};

void board_port_isr(void);

static struct byte_ring ring;

void port_init(void)
{
    UART0->BAUDDIV = 25000000 / 921600;
    UART0->CTRL = CTRL_TX | CTRL_RX | CTRL_RX_INTERRUPT;
    (void)UART0->DATA; /* QEMU delivers the first byte at once only after this */
    NVIC_IPR[IRQ_UART0_RX] = PRIORITY_UART;
    NVIC_ISER0 = 1u << IRQ_UART0_RX;
}

/* A full ring is left to the line: the interrupt stays off until the background has taken something. */
void board_port_isr(void)
{
    UART0->INTSTATUS = INTERRUPT_RX;
    if (!(UART0->STATE & STATE_RX_FULL))
        return;
    if (byte_ring_full(&ring)) {
        NVIC_ICER0 = 1u << IRQ_UART0_RX;
        return;
    }
    byte_ring_put(&ring, (uint8_t)UART0->DATA);
}

size_t board_receive(size_t n, uint8_t out[])
{
    const size_t taken = byte_ring_take(&ring, n, out);
    if (UART0->STATE & STATE_RX_FULL && !byte_ring_full(&ring)) { /* one that came while the ring was full */
        NVIC_ICER0 = 1u << IRQ_UART0_RX;
        board_port_isr();
    }
    NVIC_ISER0 = 1u << IRQ_UART0_RX;
    return taken;
}

size_t board_send(size_t n, const uint8_t bytes[])
{
    size_t sent = 0;
    for (; sent < n && !(UART0->STATE & STATE_TX_FULL); sent++)
        UART0->DATA = bytes[sent];
    return sent;
}
