/* SPDX-License-Identifier: MIT */
/* LEN u16 | CTR u16 | packet | fill | SUM u16. */
#include "sxi.h"

static uint16_t word_at(const uint8_t bytes[])
{
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

static void put_word(uint8_t bytes[], uint16_t value)
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)(value >> 8);
}

static uint16_t padded(uint16_t n)
{
    return (uint16_t)(n + (n & 1u));
}

static uint16_t sum_of(const uint8_t frame[], uint16_t n)
{
    uint16_t sum = 0;
    for (uint16_t i = 0; i < n; i = (uint16_t)(i + 2))
        sum = (uint16_t)(sum + word_at(frame + i));
    return sum;
}

static bool length_is_good(const struct sxi_receiver *r)
{
    const uint16_t n = word_at(r->frame);
    return n >= 1 && n <= BEAM_WIRE_MAX_PACKET;
}

size_t sxi_wanted(const struct sxi_receiver *r, uint8_t **where)
{
    *where = (uint8_t *)r->frame + r->filled;
    if (r->filled < 2) /* the length alone: a wrong one is discarded byte by byte */
        return (size_t)(2 - r->filled);
    return (size_t)(BEAM_WIRE_HEADER + padded(word_at(r->frame)) + BEAM_WIRE_TAIL - r->filled);
}

void sxi_restart(struct sxi_receiver *r)
{
    r->filled = 0;
}

void sxi_expire(struct sxi_receiver *r, uint32_t now_us)
{
    if (r->filled == 0 || now_us - r->last_us <= 1000u * BEAM_WIRE_GAP_MS)
        return;
    r->filled = 0;
    r->bad++;
}

uint16_t sxi_received(struct sxi_receiver *r, size_t n, uint32_t now_us)
{
    r->last_us = now_us;
    r->filled = (uint16_t)(r->filled + n);
    if (r->filled == 2 && !length_is_good(r)) { /* the first byte goes, the second may begin a frame */
        r->frame[0] = r->frame[1];
        r->filled = 1;
        r->bad++;
    }
    if (r->filled < 2)
        return 0;
    const uint16_t length = word_at(r->frame), body = (uint16_t)(BEAM_WIRE_HEADER + padded(length));
    if (r->filled < body + BEAM_WIRE_TAIL)
        return 0;
    if (sum_of(r->frame, body) == word_at(r->frame + body))
        return length;
    r->bad++;
    r->filled = 0;
    return 0;
}

uint16_t sxi_close(uint8_t frame[], uint16_t n, uint16_t counter)
{
    const uint16_t body = (uint16_t)(BEAM_WIRE_HEADER + padded(n));
    put_word(frame, n);
    put_word(frame + 2, counter);
    if (n & 1u)
        frame[body - 1] = 0;
    put_word(frame + body, sum_of(frame, body));
    return (uint16_t)(body + BEAM_WIRE_TAIL);
}
