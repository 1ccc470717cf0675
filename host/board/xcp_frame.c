/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board.h"
#include "xcp_frame.h"

#include <string.h>

static unsigned word(const uint8_t bytes[])
{
    return bytes[0] | (unsigned)bytes[1] << 8;
}

static void put_word(uint8_t bytes[], unsigned x)
{
    bytes[0] = (uint8_t)(x & 0xFF);
    bytes[1] = (uint8_t)(x >> 8 & 0xFF);
}

static unsigned sum_of(size_t n, const uint8_t bytes[])
{
    unsigned sum = 0;
    for (size_t i = 0; i + 1 < n; i += 2)
        sum += word(bytes + i);
    return sum & 0xFFFF;
}

size_t xcp_frame_size(size_t n)
{
    return BEAM_WIRE_HEADER + n + (n & 1) + BEAM_WIRE_TAIL;
}

size_t xcp_frame_make(uint16_t counter, size_t n, const uint8_t packet[], uint8_t frame[BEAM_WIRE_MAX_FRAME])
{
    const size_t size = xcp_frame_size(n);
    put_word(frame, (unsigned)n);
    put_word(frame + 2, counter);
    memcpy(frame + BEAM_WIRE_HEADER, packet, n);
    if (n & 1)
        frame[BEAM_WIRE_HEADER + n] = 0;
    put_word(frame + size - BEAM_WIRE_TAIL, sum_of(size - BEAM_WIRE_TAIL, frame));
    return size;
}

uint8_t *xcp_receiver_room(struct xcp_receiver *r, size_t *room)
{
    if (r->start > 0) {
        memmove(r->buffer, r->buffer + r->start, r->end - r->start);
        r->end -= r->start;
        r->start = 0;
    }
    *room = XCP_RECEIVER_BYTES - r->end;
    return r->buffer + r->end;
}

void xcp_receiver_added(struct xcp_receiver *r, size_t n)
{
    r->end += n;
}

static void drop_byte(struct xcp_receiver *r)
{
    r->resyncs += !r->lost;
    r->junk_bytes++;
    r->start++;
    r->lost = true;
}

bool xcp_receiver_next(struct xcp_receiver *r, uint8_t packet[BEAM_WIRE_MAX_PACKET], size_t *n)
{
    while (r->end - r->start >= BEAM_WIRE_HEADER) {
        const uint8_t *frame = r->buffer + r->start;
        const size_t length = word(frame);
        if (length == 0 || length > BEAM_WIRE_MAX_PACKET) {
            drop_byte(r);
            continue;
        }
        const size_t size = xcp_frame_size(length), body = size - BEAM_WIRE_TAIL;
        if (r->end - r->start < size)
            return false;
        if (sum_of(body, frame) != word(frame + body)) {
            drop_byte(r);
            continue;
        }
        memcpy(packet, frame + BEAM_WIRE_HEADER, length);
        *n = length;
        r->start += size;
        r->lost = false;
        r->frames++;
        return true;
    }
    return false;
}

void xcp_receiver_gap(struct xcp_receiver *r)
{
    if (r->end > r->start)
        drop_byte(r);
}
