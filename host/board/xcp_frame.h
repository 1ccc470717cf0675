/* SPDX-License-Identifier: GPL-3.0-or-later */
/* xcp_frame.h — frames made, and packets found in the bytes that arrive. */
#ifndef BEAMFIT_XCP_FRAME_H
#define BEAMFIT_XCP_FRAME_H

#include "board.h"

/* Bytes of the frame of an n-byte packet, n in 1..BEAM_WIRE_MAX_PACKET. */
size_t xcp_frame_size(size_t n);

/* Returns the frame's size. counter: of the sender's frames. */
size_t xcp_frame_make(uint16_t counter, size_t n, const uint8_t packet[], uint8_t frame[BEAM_WIRE_MAX_FRAME]);

/* Zero is a valid start. Where to read to: at least BEAM_WIRE_MAX_FRAME bytes after xcp_receiver_next() said false. */
uint8_t *xcp_receiver_room(struct xcp_receiver *receiver, size_t *room);
void xcp_receiver_added(struct xcp_receiver *receiver, size_t n);

/* The next packet, copied; false: more bytes are needed. */
bool xcp_receiver_next(struct xcp_receiver *receiver, uint8_t packet[BEAM_WIRE_MAX_PACKET], size_t *n);

/* The line has been silent: a frame begun will not be finished. Drop its first byte, so that what it hid is found. */
void xcp_receiver_gap(struct xcp_receiver *receiver);

#endif
