/* SPDX-License-Identifier: MIT */
/* Received bytes through an interrupt into a ring; bytes to send go as the transmitter takes them. Nothing waits. */
#include "../byte_ring.h"
#include "part.h"

static struct byte_ring ring;

void port_begin(void)
{
    ring.written = ring.read_out = 0;
    part_receive_enable(true);
}

/* A full ring is left to the line: the interrupt stays off until the background has taken something. */
void board_port_isr(void)
{
    uint8_t byte;
    if (byte_ring_full(&ring)) {
        part_receive_enable(false);
        return;
    }
    if (part_receive(&byte)) {
        byte_ring_put(&ring, byte);
    }
}

size_t board_receive(size_t n, uint8_t out[])
{
    const size_t taken = byte_ring_take(&ring, n, out);
    if (taken > 0)
        part_receive_enable(true);
    return taken;
}

size_t board_send(size_t n, const uint8_t bytes[])
{
    size_t sent = 0;
    while (sent < n && part_send(bytes[sent]))
        sent++;
    return sent;
}
