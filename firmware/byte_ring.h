/* SPDX-License-Identifier: MIT */
/* byte_ring.h — received bytes from a port's interrupt to the background loop: one writes, the other reads, nothing waits. For the boards. */
#ifndef BYTE_RING_H
#define BYTE_RING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BYTE_RING = 128 }; /* 1.4 ms at 921600 baud; more is left to the line, whose windows are acknowledged */
_Static_assert((BYTE_RING & (BYTE_RING - 1)) == 0, "a power of two");

struct byte_ring {
    volatile uint8_t byte[BYTE_RING];
    volatile uint32_t written, read_out; /* free-running; written by the interrupt, read_out by the background */
};

static inline bool byte_ring_full(const struct byte_ring *ring)
{
    return ring->written - ring->read_out == BYTE_RING;
}

/* The interrupt's, when it is not full. */
static inline void byte_ring_put(struct byte_ring *ring, uint8_t byte)
{
    ring->byte[ring->written % BYTE_RING] = byte;
    ring->written = ring->written + 1;
}

/* The background's; returns how many there were, at most n. */
static inline size_t byte_ring_take(struct byte_ring *ring, size_t n, uint8_t out[])
{
    size_t taken = 0;
    for (; taken < n && ring->read_out != ring->written; taken++) {
        out[taken] = ring->byte[ring->read_out % BYTE_RING];
        ring->read_out = ring->read_out + 1;
    }
    return taken;
}

#endif
