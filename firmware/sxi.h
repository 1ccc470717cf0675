/* SPDX-License-Identifier: MIT */
/*
 * sxi.h — frames of XCP on SxI, bytes in and out. beam_wire.h has the format.
 *
 * One buffer serves commands and their responses: XCP is command and answer, and a board without flow control has the
 * next command in its receiver's own memory meanwhile. Pure: no board is called, time is given.
 */
#ifndef SXI_H
#define SXI_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "beam_wire.h"

/* A frame under way to the port: bytes[sent .. n−1] are still to go. */
struct sxi_frame {
    const uint8_t *bytes;
    uint16_t n, sent;
};

struct sxi_receiver {
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    uint16_t filled;
    uint32_t last_us; /* when the last byte came */
    uint32_t bad;     /* frames dropped: length or sum */
};

/* Where the next bytes go, and how many belong to this frame at most; more must not be taken. */
size_t sxi_wanted(const struct sxi_receiver *r, uint8_t **where);

/* Forgets a frame that stopped more than 50 ms ago. Before each sxi_wanted(), at least every 2³¹ µs. */
void sxi_expire(struct sxi_receiver *r, uint32_t now_us);

/*
 * n > 0 of them have arrived at now_us. Returns the length of the packet at frame + BEAM_WIRE_HEADER when that
 * completes a good frame, else 0. The frame stays until sxi_restart().
 */
uint16_t sxi_received(struct sxi_receiver *r, size_t n, uint32_t now_us);
void sxi_restart(struct sxi_receiver *r);

/* Header, fill and sum around the n bytes (1..248) that stand at frame + BEAM_WIRE_HEADER; length of the frame. */
uint16_t sxi_close(uint8_t frame[], uint16_t n, uint16_t counter);

#endif
