/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The line: frames, streaming, and everything that may come over it. The active model is watched in every sample. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <cmocka.h>
#include "firmware_rig.h"

static uint32_t random_state;

static uint32_t random_word(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

static int set_up(void **state)
{
    (void)state;
    random_state = 1;
    board_reset();
    rig_boot();
    rig_switches = 0;
    return rig_connect();
}

/* ---- Frames ---- */

static uint16_t feed(struct sxi_receiver *r, size_t n, const uint8_t bytes[], uint32_t now_us)
{
    uint16_t length = 0;
    for (size_t i = 0; i < n && length == 0;) {
        uint8_t *where;
        sxi_expire(r, now_us);
        size_t wanted = sxi_wanted(r, &where);
        assert_in_range(wanted, 1, BEAM_WIRE_MAX_FRAME);
        assert_true(where + wanted <= r->frame + sizeof r->frame);
        wanted = wanted < n - i ? wanted : n - i;
        memcpy(where, bytes + i, wanted);
        i += wanted;
        length = sxi_received(r, wanted, now_us);
    }
    return length;
}

static void test_frames_of_every_length(void **state)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME], packet[BEAM_WIRE_MAX_PACKET];
    static struct sxi_receiver r;
    (void)state;
    for (uint16_t n = 1; n <= (uint16_t)BEAM_WIRE_MAX_PACKET; n++) {
        for (int i = 0; i < n; i++)
            packet[i] = (uint8_t)random_word();
        memcpy(frame + 4, packet, n);
        const uint16_t total = sxi_close(frame, n, n);
        assert_int_equal(total, 6 + n + n % 2);
        for (int i = 0; i + 1 < total; i++) /* byte by byte */
            assert_int_equal(feed(&r, 1, frame + i, 0), 0);
        assert_int_equal(feed(&r, 1, frame + total - 1, 0), n);
        assert_memory_equal(r.frame + 4, packet, n);
        sxi_restart(&r);
        for (int bit = 0; bit < 8 * total; bit += 7) { /* one bit wrong: never taken */
            frame[bit / 8] ^= (uint8_t)(1u << bit % 8);
            assert_int_equal(feed(&r, total, frame, 0), 0);
            frame[bit / 8] ^= (uint8_t)(1u << bit % 8);
            r.filled = 0;
        }
    }
}

static void test_resynchronisation(void **state)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME] = {0};
    static struct sxi_receiver r;
    static const uint8_t lengths[][2] = {{0, 0}, {249, 0}, {255, 255}, {0, 1}, {1, 1}};
    (void)state;
    memset(&r, 0, sizeof r);
    frame[4] = BEAM_XCP_CONNECT;
    const uint16_t total = sxi_close(frame, 2, 0);
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
        assert_int_equal(feed(&r, 2, lengths[i], 0), 0);
        assert_int_equal(r.bad, 2 * i + 1);
        assert_int_equal(r.filled, 1); /* the second byte may begin a frame, until a gap */
        assert_int_equal(feed(&r, total, frame, 50001), 2);
        assert_int_equal(r.bad, 2 * i + 2);
        sxi_restart(&r);
    }
    const uint8_t zeros[101] = {0};
    assert_int_equal(feed(&r, 100, zeros, 0), 0); /* discarded one by one */
    assert_int_equal(r.filled, 1);
    sxi_restart(&r);
    assert_int_equal(feed(&r, 5, frame, 100000), 0); /* stops inside */
    assert_int_equal(feed(&r, total, frame, 150001), 2);
    sxi_restart(&r);
    assert_int_equal(feed(&r, 5, frame, 200000), 0);
    assert_int_equal(feed(&r, (size_t)total - 5, frame + 5, 250000), 2); /* 50 ms are allowed */
}

/* ---- Streaming ---- */

static void allocate(uint8_t prescaler)
{
    assert_int_equal(RIG(BEAM_XCP_FREE_DAQ), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_DAQ, 0, 1, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 2), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 1), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 1, 2), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 0, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_WRITE_DAQ, 0xFF, sizeof(struct beam_live), 0, 0, 0, 2, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 1, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0, 0, 2, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 12, 0, 2, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_DAQ_LIST_MODE, 0x10, 0, 0, 0, 0, prescaler, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_START_STOP_DAQ_LIST, 1, 0, 0), 0);
}

static struct {
    uint32_t samples, gaps, sequence, time_us;
    float measured;
} seen;

static void note(const uint8_t packet[], uint16_t n)
{
    struct beam_live live;
    uint32_t sequence;
    float measured;
    if (packet[0] == 0) {
        assert_int_equal(n, 5 + sizeof live);
        memcpy(&live, packet + 5, sizeof live);
        assert_int_equal(live.crc32, beam_crc32(0, offsetof(struct beam_live, crc32), (const uint8_t *)&live));
        if (seen.samples++ > 0 && live.sequence != seen.sequence + 1)
            seen.gaps += live.sequence - seen.sequence - 1;
        seen.sequence = live.sequence;
        seen.measured = live.measured;
        seen.time_us = xcp_u32(packet + 1);
    } else {
        assert_int_equal(packet[0], 1);
        assert_int_equal(n, 9);
        memcpy(&sequence, packet + 1, 4);
        memcpy(&measured, packet + 5, 4);
        assert_int_equal(sequence, seen.sequence); /* both tables are of one sample */
        assert_float_equal(measured, seen.measured, 0.0F);
    }
}

static void drain(void)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    for (uint16_t n; (n = rig_next(packet)) > 0;)
        if (packet[0] < BEAM_XCP_SERV)
            note(packet, n);
}

static void test_streaming(void **state)
{
    (void)state;
    for (uint8_t prescaler = 1; prescaler < 10; prescaler += 4) {
        memset(&seen, 0, sizeof seen);
        allocate(prescaler);
        uint32_t last_us = 0;
        for (int k = 0; k < 5000; k++) {
            rig_run(1);
            const uint32_t samples = seen.samples;
            drain();
            if (samples > 0 && seen.samples > samples)
                assert_int_equal(seen.time_us - last_us, 1000 * prescaler);
            last_us = seen.time_us;
        }
        assert_in_range(seen.samples, 5000 / prescaler, 5000 / prescaler + 3);
        assert_int_equal(seen.gaps, (seen.samples - 1) * (prescaler - 1u));
        assert_int_equal(app.daq.overrun, 0);
        assert_int_equal(rig_connect(), 0);
        drain();
    }
}

/* The host stops reading: what finds no room is counted, what comes later is whole; every gap is an overrun. */
static void test_host_that_stops_reading(void **state)
{
    (void)state;
    memset(&seen, 0, sizeof seen);
    allocate(1);
    rig_run(10);
    drain();
    for (int pause = 1; pause < 60; pause++) {
        board.line_room = 0;
        rig_run(pause);
        board.line_room = pause % 3 == 0 ? 1 : SIZE_MAX; /* slow for a while, in pieces of a byte */
        rig_run(100);
        board.line_room = SIZE_MAX;
        rig_run(20);
        drain();
    }
    assert_true(app.daq.overrun > 0);
    assert_int_equal(seen.gaps, app.daq.overrun);
    assert_int_equal(seen.sequence + 1, rig_ticks);
    print_message("host that stops reading: %u samples, %u lost on the line, each counted\n", seen.samples, seen.gaps);
}

/* ---- Whatever comes ---- */

static void nothing_changed(uint64_t samples)
{
    struct beam_image_file back;
    assert_int_equal(rig_switches, 0);
    assert_int_equal(rig_checked, samples);
    beam_image_read(pages_active(&app.pages), 0, sizeof back, (uint8_t *)&back);
    assert_memory_equal(&back, built_in_image, sizeof back);
    assert_int_equal(app.store.stored, 0);
}

/* Random bytes, and random bytes in good frames. */
static void test_random_bytes(void **state)
{
    const uint64_t checked = rig_checked;
    uint64_t bytes = 0, ticks = 0;
    (void)state;
    for (int i = 0; i < 40000; i++) {
        uint8_t packet[BEAM_WIRE_MAX_PACKET];
        const uint16_t n = (uint16_t)(1 + random_word() % (random_word() % 8 ? 12 : BEAM_WIRE_MAX_PACKET));
        for (int k = 0; k < n; k++)
            packet[k] = (uint8_t)(random_word() >> 7);
        if (random_word() % 4 != 0) {
            packet[0] |= 0xC0; /* a command, mostly */
            if (random_word() % 2)
                for (int k = 1; k < n; k++)
                    packet[k] &= 3;
            rig_send(packet, n);
        } else {
            queue_put(&board.to_board, n, packet);
            board.time_us += random_word() % 2 ? 60000 : 0;
        }
        bytes += n;
        rig_run(2);
        ticks += 2;
        board.to_host.taken = board.to_host.n;
    }
    nothing_changed(checked + ticks);
    print_message("random bytes: %lu, 0 models changed, %lu samples\n", (unsigned long)bytes, (unsigned long)ticks);
}

/* A frame to the board, of whose bytes some are changed or lost. How many. */
static uint64_t noisy(const uint8_t frame[], size_t n, uint32_t per_million)
{
    uint64_t hit = 0;
    for (size_t i = 0; i < n; i++) {
        uint8_t byte = frame[i];
        if (random_word() % 1000000 < per_million) {
            hit++;
            if (random_word() % 4 == 0)
                continue;
            byte ^= (uint8_t)(1 + random_word() % 255);
        }
        queue_put(&board.to_board, 1, &byte);
    }
    return hit;
}

/* What a host does that finds itself locked out, or its page moved, by a command that noise has made. */
static void begin_again(void)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    board.time_us += 60000;
    while (rig_next(packet) > 0)
        ;
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
}

static uint64_t hit, sent;

/* All of the image as a host sends it that repeats what was not answered, then the switch; until it is done. */
static void download_through_noise(const struct beam_image_file *file, uint32_t per_million)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET], frame[BEAM_WIRE_MAX_FRAME];
    const uint64_t switches = rig_switches;
    for (int pass = 0; pass < 40 && rig_switches == switches; pass++) {
        for (uint32_t done = 0; done < sizeof *file;) {
            const uint32_t count = sizeof *file - done < 240 ? (uint32_t)sizeof *file - done : 240;
            memcpy(packet, (uint8_t[]){BEAM_XCP_SHORT_DOWNLOAD, (uint8_t)count, 0, 0}, 4);
            xcp_put(4, BEAM_WIRE_IMAGE + done, packet + 4);
            memcpy(packet + 8, (const uint8_t *)file + done, count);
            const size_t n = rig_frame(packet, (uint16_t)(8 + count), frame);
            hit += noisy(frame, n, per_million);
            sent += n;
            const uint16_t answered = rig_await(packet, 120, NULL);
            if (answered > 0 && packet[0] == BEAM_XCP_RES)
                done += count;
            else
                begin_again();
        }
        rig_send((uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 1, 0, 1}, 4);
        rig_await(packet, 200, NULL);
    }
    assert_true(rig_active_is(file));
    assert_int_equal(rig_switches, switches + 1);
}

static void test_byte_noise(void **state)
{
    static const uint32_t per_million[] = {1000, 3000, 10000};
    uint32_t counter = 20;
    (void)state;
    for (int level = 0; level < 3; level++) {
        const uint64_t begun = rig_checked;
        hit = sent = 0;
        begin_again();
        allocate(1);
        for (int i = 0; i < 10; i++) {
            struct beam_image_file file;
            rig_image(&file, 1.0F + 0.1F * (float)i, counter++);
            begin_again();
            download_through_noise(&file, per_million[level]);
        }
        assert_true(hit > 0);
        print_message("byte noise %u in a million: 10 images right, %lu of %lu bytes hit, %lu samples, 0 wrong\n",
                      per_million[level], (unsigned long)hit, (unsigned long)sent,
                      (unsigned long)(rig_checked - begun));
    }
    assert_int_equal(app.missed, 0);
}

/* Two hosts write into one line, in pieces: no command of either, but no harm. */
static void test_two_hosts(void **state)
{
    const uint64_t checked = rig_checked, begun = rig_ticks;
    struct beam_image_file file;
    (void)state;
    assert_int_equal(rig_unlock(), 0);
    rig_image(&file, 2.0F, 30);
    for (int i = 0; i < 4000; i++) {
        uint8_t one[BEAM_WIRE_MAX_FRAME], two[BEAM_WIRE_MAX_FRAME], packet[BEAM_WIRE_MAX_PACKET];
        memcpy(packet, (uint8_t[]){BEAM_XCP_SHORT_DOWNLOAD, 200, 0, 0}, 4);
        xcp_put(4, (uint32_t)(BEAM_WIRE_IMAGE + random_word() % (sizeof file - 200)), packet + 4);
        memcpy(packet + 8, (const uint8_t *)&file + random_word() % (sizeof file - 200), 200);
        const size_t n = rig_frame(packet, 208, one);
        const size_t m = rig_frame((uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 3, 0, 1}, 4, two);
        size_t a = 0, b = 0;
        while (a < n || b < m) {
            size_t piece = 1 + random_word() % 90;
            if (b == m || (a < n && random_word() % 2)) {
                piece = piece < n - a ? piece : n - a;
                queue_put(&board.to_board, piece, one + a);
                a += piece;
            } else {
                piece = piece < m - b ? piece : m - b;
                queue_put(&board.to_board, piece, two + b);
                b += piece;
            }
        }
        rig_run(3);
        board.to_host.taken = board.to_host.n;
    }
    nothing_changed(checked + (rig_ticks - begun));
    board.time_us += 60000;
    rig_run(30);
    board.to_host.taken = board.to_host.n;
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_download(&file), 0); /* one alone */
    assert_true(rig_active_is(&file));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frames_of_every_length),     cmocka_unit_test(test_resynchronisation),
        cmocka_unit_test_setup(test_streaming, set_up),    cmocka_unit_test_setup(test_host_that_stops_reading, set_up),
        cmocka_unit_test_setup(test_random_bytes, set_up), cmocka_unit_test_setup(test_byte_noise, set_up),
        cmocka_unit_test_setup(test_two_hosts, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
