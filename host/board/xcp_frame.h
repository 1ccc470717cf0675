/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * xcp_frame.h — packets in frames of XCP on SxI (beam_wire.h), and finding them again in a stream of any bytes.
 *
 * A frame whose length is impossible or whose sum is wrong is dropped one byte at a time, so that a good frame behind a
 * damaged one is found. The sum is weak (two flips in one bit column pass): what matters is checked again by CRC-32.
 */
#ifndef BEAMFIT_XCP_FRAME_H
#define BEAMFIT_XCP_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "beam_wire.h"

/* Bytes of the frame of an n-byte packet, n in 1..BEAM_WIRE_MAX_PACKET. */
size_t xcp_frame_size(size_t n);
/* Returns the frame's size. counter: of the sender's frames. */
size_t xcp_frame_make(uint16_t counter, size_t n, const uint8_t packet[], uint8_t frame[BEAM_WIRE_MAX_FRAME]);

enum { XCP_RECEIVER_BYTES = 4096 };
struct xcp_receiver {
    size_t start, end;
    bool lost;           /* the last byte was dropped: a run of dropped bytes counts once */
    uint64_t frames;     /* good ones */
    uint64_t resyncs;    /* runs of bytes that were no frame */
    uint64_t junk_bytes; /* in those runs */
    uint8_t buffer[XCP_RECEIVER_BYTES];
};

/* Zero is a valid start. Where to read to: at least BEAM_WIRE_MAX_FRAME bytes after xcp_receiver_next() said false. */
uint8_t *xcp_receiver_room(struct xcp_receiver *receiver, size_t *room);
void xcp_receiver_added(struct xcp_receiver *receiver, size_t n);
/* The next packet, copied; false: more bytes are needed. */
bool xcp_receiver_next(struct xcp_receiver *receiver, uint8_t packet[BEAM_WIRE_MAX_PACKET], size_t *n);
/* The line has been silent: a frame begun will not be finished. Drop its first byte, so that what it hid is found. */
void xcp_receiver_gap(struct xcp_receiver *receiver);
/* Forgets all bytes, keeps the counts. */
void xcp_receiver_clear(struct xcp_receiver *receiver);

#endif
