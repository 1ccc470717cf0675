/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "board/board.h"
#include "board/xcp_frame.h"

static void feed(struct xcp_receiver *r, size_t n, const uint8_t bytes[])
{
    while (n > 0) {
        size_t room;
        uint8_t *to = xcp_receiver_room(r, &room);
        assert_true(room >= BEAM_WIRE_MAX_FRAME);
        const size_t part = n < room ? n : room;
        memcpy(to, bytes, part);
        xcp_receiver_added(r, part);
        bytes += part;
        n -= part;
    }
}

/* Written out by hand from the format: CONNECT, and three bytes with their fill. */
static void frames_are_these_bytes(void **state)
{
    (void)state;
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    const uint8_t connect[] = {0x02, 0x00, 0x34, 0x12, 0xFF, 0x00, 0x35, 0x13};
    const uint8_t odd[] = {0x03, 0x00, 0x00, 0x00, 0xF5, 0xFF, 0x80, 0x00, 0x78, 0x00};
    assert_int_equal(xcp_frame_make(0x1234, 2, (const uint8_t[]){0xFF, 0x00}, frame), sizeof connect);
    assert_memory_equal(frame, connect, sizeof connect);
    assert_int_equal(xcp_frame_make(0, 3, (const uint8_t[]){0xF5, 0xFF, 0x80}, frame), sizeof odd);
    assert_memory_equal(frame, odd, sizeof odd);
}

static void every_length_survives_byte_by_byte(void **state)
{
    (void)state;
    struct xcp_receiver r = {0};
    uint8_t packet[BEAM_WIRE_MAX_PACKET], frame[BEAM_WIRE_MAX_FRAME], got[BEAM_WIRE_MAX_PACKET];
    for (size_t length = 1; length <= BEAM_WIRE_MAX_PACKET; length++) {
        size_t n = 0;
        for (size_t i = 0; i < length; i++)
            packet[i] = (uint8_t)(length * 31 + i * 7);
        const size_t size = xcp_frame_make((uint16_t)length, length, packet, frame);
        assert_int_equal(size, xcp_frame_size(length));
        for (size_t i = 0; i < size; i++) {
            feed(&r, 1, frame + i);
            assert_int_equal(xcp_receiver_next(&r, got, &n), i + 1 == size);
        }
        assert_int_equal(n, length);
        assert_memory_equal(got, packet, length);
    }
    assert_int_equal(r.resyncs, 0);
    assert_int_equal(r.frames, BEAM_WIRE_MAX_PACKET);
}

/* One flipped bit anywhere: that frame is lost, and both its neighbours arrive. */
static void one_flipped_bit_costs_one_frame(void **state)
{
    (void)state;
    enum { LENGTH = 41 };
    uint8_t line[3][BEAM_WIRE_MAX_FRAME], bytes[4 * BEAM_WIRE_MAX_FRAME], got[BEAM_WIRE_MAX_PACKET];
    uint8_t packet[LENGTH];
    const size_t size = xcp_frame_size(LENGTH);
    for (uint8_t f = 0; f < 3; f++) {
        for (size_t i = 0; i < LENGTH; i++)
            packet[i] = (uint8_t)(100 * f + i);
        xcp_frame_make(f, LENGTH, packet, line[f]);
    }
    for (size_t bit = 0; bit < 8 * size; bit++) {
        struct xcp_receiver r = {0};
        size_t n, frames = 0;
        uint8_t first[3];
        for (size_t f = 0; f < 3; f++)
            memcpy(bytes + f * size, line[f], size);
        bytes[size + bit / 8] ^= (uint8_t)(1u << bit % 8);
        feed(&r, 3 * size, bytes);
        for (;;) {
            while (xcp_receiver_next(&r, got, &n)) {
                assert_true(frames < 3 && n == LENGTH);
                first[frames++] = got[0];
            }
            if (r.end == r.start)
                break;
            xcp_receiver_gap(&r); /* a length made longer waits for bytes that never come */
        }
        assert_int_equal(frames, 2);
        assert_int_equal(first[0], 0);
        assert_int_equal(first[1], 200);
        assert_true(r.resyncs >= 1);
    }
}

static void impossible_lengths_are_no_frames(void **state)
{
    (void)state;
    struct xcp_receiver r = {0};
    uint8_t got[BEAM_WIRE_MAX_PACKET], frame[BEAM_WIRE_MAX_FRAME];
    size_t n;
    const uint8_t zero[] = {0, 0, 0, 0, 0, 0}, long_one[] = {0xF9, 0, 0, 0, 1, 2, 3};
    feed(&r, sizeof zero, zero);
    feed(&r, sizeof long_one, long_one);
    feed(&r, xcp_frame_make(7, 1, (const uint8_t[]){0xFC}, frame), frame);
    while (!xcp_receiver_next(&r, got, &n)) {
        assert_true(r.end > r.start);
        xcp_receiver_gap(&r);
    }
    assert_int_equal(n, 1);
    assert_int_equal(got[0], 0xFC);
    assert_true(r.junk_bytes >= sizeof zero + sizeof long_one - 3);
}

/* Damaged bytes, lost bytes, extra bytes: whatever comes out came in, and most of it comes. */
static void noise_lets_the_good_frames_through(void **state)
{
    (void)state;
    enum { FRAMES = 4000, LENGTH = 24 };
    struct xcp_receiver r = {0};
    uint8_t packet[LENGTH], frame[BEAM_WIRE_MAX_FRAME], got[BEAM_WIRE_MAX_PACKET];
    size_t good = 0, wrong = 0, n;
    unsigned random = 12345;
    for (unsigned f = 0; f < FRAMES; f++) {
        for (size_t i = 0; i < LENGTH; i++)
            packet[i] = (uint8_t)(f >> (i % 2 ? 8 : 0)); /* each packet is its number, over and over */
        const size_t size = xcp_frame_make((uint16_t)f, LENGTH, packet, frame);
        for (size_t i = 0; i < size; i++) {
            random = random * 1664525u + 1013904223u;
            const unsigned what = random >> 8 & 0xFFF;
            if (what == 0)
                continue;
            if (what < 8)
                frame[i] ^= (uint8_t)(1u << what);
            feed(&r, 1, frame + i);
            if (what == 8)
                feed(&r, 1, (const uint8_t[]){0x55});
        }
        while (xcp_receiver_next(&r, got, &n)) {
            int same = n == LENGTH;
            for (size_t i = 2; same && i < LENGTH; i++)
                same = got[i] == got[i - 2];
            good += same == 1;
            wrong += same == 0;
        }
    }
    assert_true(good > FRAMES * 8 / 10);
    assert_true(wrong <= 3); /* two flips in one bit column pass the sum */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_these_bytes),
        cmocka_unit_test(every_length_survives_byte_by_byte),
        cmocka_unit_test(one_flipped_bit_costs_one_frame),
        cmocka_unit_test(impossible_lengths_are_no_frames),
        cmocka_unit_test(noise_lets_the_good_frames_through),
    };
    return cmocka_run_group_tests_name("xcp_frame", tests, NULL, NULL);
}
