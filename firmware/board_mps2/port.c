/* SPDX-License-Identifier: MIT */
/* UART0: received bytes through an interrupt into a ring; bytes to send go as the transmitter takes them. */
#include "parts.h"

enum {
    RING = 128,
    PRIORITY_UART = 0x80,
    STATE_TX_FULL = 1,
    STATE_RX_FULL = 2,
    CTRL_TX = 1,
    CTRL_RX = 2,
    CTRL_RX_INTERRUPT = 8,
    INTERRUPT_RX = 2
};
_Static_assert((RING & (RING - 1)) == 0, "a power of two");

void board_port_isr(void);

static volatile uint8_t ring[RING];
static volatile uint32_t written, read_out; /* free-running; written by the interrupt, read_out by the background */

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
    if (written - read_out == RING) {
        NVIC_ICER0 = 1u << IRQ_UART0_RX;
        return;
    }
    ring[written % RING] = (uint8_t)UART0->DATA;
    written = written + 1;
}

size_t board_receive(size_t n, uint8_t out[])
{
    size_t taken = 0;
    for (; taken < n && read_out != written; taken++) {
        out[taken] = ring[read_out % RING];
        read_out = read_out + 1;
    }
    if (UART0->STATE & STATE_RX_FULL && written - read_out < RING) { /* one that came while the ring was full */
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
