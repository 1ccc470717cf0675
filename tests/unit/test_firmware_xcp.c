/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The slave's commands one by one: what they answer, what they refuse. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include "firmware_rig.h"

static uint8_t packet[BEAM_WIRE_MAX_PACKET];

/* Command into `packet`, the response in its place. */
#define ASK(...)                                                                                                       \
    (memcpy(packet, (uint8_t[]){__VA_ARGS__}, sizeof((uint8_t[]){__VA_ARGS__})),                                       \
     rig_command(packet, (uint16_t)sizeof((uint8_t[]){__VA_ARGS__})))

static int set_up(void **state)
{
    (void)state;
    board_reset();
    rig_boot();
    return rig_connect();
}

static void test_session(void **state)
{
    (void)state;
    assert_int_equal(ASK(BEAM_XCP_DISCONNECT), 0);
    rig_send((uint8_t[]){BEAM_XCP_GET_STATUS}, 1);
    rig_run(20);
    assert_int_equal(rig_next(packet), 0); /* silent */
    assert_int_equal(ASK(BEAM_XCP_CONNECT, 0), 0);
    const uint8_t connect[8] = {0xFF, 0x05, 0x80, 248, 248, 0, 1, 1};
    assert_memory_equal(packet, connect, 8);
    assert_int_equal(ASK(BEAM_XCP_GET_STATUS), 0);
    assert_int_equal(packet[1], 0);
    assert_int_equal(packet[2], BEAM_XCP_RESOURCE_CAL_PAG);
    assert_int_equal(ASK(BEAM_XCP_SYNCH), 0x100);
    assert_int_equal(ASK(BEAM_XCP_GET_COMM_MODE_INFO), 0);
    for (uint8_t type = 0; type < 2; type++) {
        assert_int_equal(ASK(BEAM_XCP_GET_ID, type), 0);
        assert_int_equal(packet[1], 1);
        assert_int_equal(xcp_u32(packet + 4), 7);
        assert_memory_equal(packet + 8, "beamfit", 7);
    }
    assert_int_equal(ASK(BEAM_XCP_GET_ID, 2), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(0x12), BEAM_XCP_ERR_CMD_UNKNOWN);
    assert_int_equal(ASK(BEAM_XCP_SHORT_UPLOAD, 4, 0), BEAM_XCP_ERR_CMD_SYNTAX);
    assert_int_equal(ASK(BEAM_XCP_SET_REQUEST, 2, 0, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
}

static void test_memory(void **state)
{
    struct beam_image_file file;
    struct beam_live live;
    const struct beam_info info = rig_info();
    (void)state;
    assert_int_equal(info.image_bytes, BEAM_IMAGE_BYTES);
    assert_memory_equal(info.device, board.facts.device, 12);
    assert_int_equal(info.sample_mHz, 1000000);
    assert_int_equal(info.running, BEAM_BOOT_BUILT_IN);
    assert_int_equal(rig_read(BEAM_WIRE_IMAGE, sizeof file, &file), 0);
    assert_memory_equal(&file, built_in_image, sizeof file);
    assert_int_equal(rig_read(BEAM_WIRE_LIVE, sizeof live, &live), 0);
    assert_int_equal(live.crc32, beam_crc32(0, offsetof(struct beam_live, crc32), (const uint8_t *)&live));
    assert_true(live.status & BEAM_LIVE_BUILT_IN);

    assert_int_equal(ASK(BEAM_XCP_SET_MTA, 0, 0, 0, 0, 0, 1, 0), 0); /* the image */
    assert_int_equal(ASK(BEAM_XCP_UPLOAD, 247), 0);
    assert_memory_equal(packet + 1, built_in_image, 247);
    assert_int_equal(ASK(BEAM_XCP_UPLOAD, 10), 0);
    assert_memory_equal(packet + 1, built_in_image + 247, 10);
    assert_int_equal(ASK(BEAM_XCP_UPLOAD, 248), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_UPLOAD, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_MTA, 0, 0, 0, 0, 0, 1, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_BUILD_CHECKSUM, 0, 0, 0, BEAM_IMAGE_BYTES & 255, BEAM_IMAGE_BYTES >> 8, 0, 0), 0);
    assert_int_equal(packet[1], 9);
    assert_int_equal(xcp_u32(packet + 4), beam_crc32(0, BEAM_IMAGE_BYTES, built_in_image));
    assert_int_equal(ASK(BEAM_XCP_BUILD_CHECKSUM, 0, 0, 0, 1, 0, 0, 0),
                     BEAM_XCP_ERR_ACCESS_DENIED); /* behind its end */
    assert_int_equal(ASK(BEAM_XCP_BUILD_CHECKSUM, 0, 0, 0, 0, 0, 0, 1), BEAM_XCP_ERR_OUT_OF_RANGE);
    static const uint32_t nowhere[] = {0,
                                       BEAM_WIRE_IMAGE - 1,
                                       BEAM_WIRE_IMAGE + BEAM_IMAGE_BYTES - 3,
                                       BEAM_WIRE_LIVE + 45,
                                       BEAM_WIRE_INFO + (uint32_t)sizeof(struct beam_info) - 3,
                                       BEAM_WIRE_DRIVE + 25,
                                       UINT32_MAX,
                                       UINT32_MAX - 3,
                                       0x20000000,
                                       0x08000000};
    for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; i++) {
        assert_int_equal(rig_read(nowhere[i], 4, packet), BEAM_XCP_ERR_ACCESS_DENIED);
        assert_int_equal(rig_write(nowhere[i], 4, packet), BEAM_XCP_ERR_ACCESS_DENIED);
    }
    assert_int_equal(rig_write(BEAM_WIRE_LIVE, 4, packet), BEAM_XCP_ERR_WRITE_PROTECTED);
    assert_int_equal(rig_write(BEAM_WIRE_INFO, 4, packet), BEAM_XCP_ERR_WRITE_PROTECTED);
    assert_int_equal(ASK(BEAM_XCP_SHORT_UPLOAD, 4, 0, 1, 0, 0, 1, 0), BEAM_XCP_ERR_ACCESS_DENIED); /* extension 1 */
    assert_int_equal(ASK(BEAM_XCP_SHORT_DOWNLOAD, 2, 0, 0, 0, 0, 4, 0, 1),
                     BEAM_XCP_ERR_OUT_OF_RANGE); /* one byte came */
    assert_int_equal(rig_unlock(), 0);           /* the drive */
    assert_int_equal(ASK(BEAM_XCP_SET_MTA, 0, 0, 0, 0, 0, 4, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_DOWNLOAD, 4, 0, 0, 0x80, 0x3F), 0);
    assert_int_equal(ASK(BEAM_XCP_DOWNLOAD, 4, 1, 2, 3, 4), 0);
    struct beam_drive drive;
    assert_int_equal(rig_read(BEAM_WIRE_DRIVE, sizeof drive, &drive), 0);
    assert_float_equal(drive.amplitude, 1.0F, 0.0F);
    assert_int_equal(drive.rate, 0x04030201);
}

static void test_pages_info(void **state)
{
    (void)state;
    assert_int_equal(ASK(BEAM_XCP_GET_PAG_PROCESSOR_INFO), 0);
    assert_int_equal(packet[1], 1);
    assert_int_equal(ASK(BEAM_XCP_GET_SEGMENT_INFO, 0, 0, 0, 0), 0);
    assert_int_equal(xcp_u32(packet + 4), BEAM_WIRE_IMAGE);
    assert_int_equal(ASK(BEAM_XCP_GET_SEGMENT_INFO, 0, 0, 1, 0), 0);
    assert_int_equal(xcp_u32(packet + 4), BEAM_IMAGE_BYTES);
    assert_int_equal(ASK(BEAM_XCP_GET_SEGMENT_INFO, 1, 0, 0, 0), 0);
    assert_int_equal(packet[1], 2);
    assert_int_equal(ASK(BEAM_XCP_GET_SEGMENT_INFO, 2, 0, 0, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_GET_SEGMENT_INFO, 0, 1, 0, 0), BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_GET_PAGE_INFO, 0, 0, 0), 0);
    assert_int_equal(packet[1], 0x0F);
    assert_int_equal(ASK(BEAM_XCP_GET_PAGE_INFO, 0, 0, 1), 0);
    assert_int_equal(packet[1], 0x3F);
    assert_int_equal(ASK(BEAM_XCP_GET_PAGE_INFO, 0, 0, 2), BEAM_XCP_ERR_PAGE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_GET_PAGE_INFO, 0, 1, 0), BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_GET_CAL_PAGE, 3, 0), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_GET_CAL_PAGE, 1, 1), BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 0, 0, 1), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 0x11, 0, 1), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 2, 1, 1), BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 2, 0, 2), BEAM_XCP_ERR_PAGE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 0x82, 7, 1), 0); /* all segments */
    assert_int_equal(ASK(BEAM_XCP_GET_CAL_PAGE, 2, 0), 0);
    assert_int_equal(packet[3], 1);
    assert_int_equal(ASK(BEAM_XCP_SET_CAL_PAGE, 3, 0, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_GET_CAL_PAGE, 2, 0), 0);
    assert_int_equal(packet[3], 0);
    assert_int_equal(ASK(BEAM_XCP_COPY_CAL_PAGE, 1, 0, 0, 1), BEAM_XCP_ERR_SEGMENT_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_COPY_CAL_PAGE, 0, 2, 0, 1), BEAM_XCP_ERR_PAGE_NOT_VALID);
}

static void test_seed_and_key(void **state)
{
    uint8_t seeds[64][16], wrong[32] = {0};
    (void)state;
    assert_int_equal(ASK(BEAM_XCP_UNLOCK, 16, 0), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 4), 0); /* DAQ is open */
    assert_int_equal(packet[1], 0);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 1, 1), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 2), BEAM_XCP_ERR_OUT_OF_RANGE);
    for (int i = 0; i < 64; i++) { /* over power-ons too */
        if (i % 8 == 7) {
            rig_boot();
            assert_int_equal(rig_connect(), 0);
        }
        assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 1), 0);
        assert_int_equal(packet[1], 16);
        memcpy(seeds[i], packet + 2, 16);
        for (int j = 0; j < i; j++)
            assert_memory_not_equal(seeds[i], seeds[j], 16);
    }
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(ASK(BEAM_XCP_GET_STATUS), 0);
    assert_int_equal(packet[2], 0);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 1), 0); /* nothing to unlock */
    assert_int_equal(packet[1], 0);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock_with(wrong), BEAM_XCP_ERR_ACCESS_LOCKED);
    rig_send((uint8_t[]){BEAM_XCP_GET_STATUS}, 1); /* DISCONNECTED: silence, and no stream */
    rig_run(100);
    assert_int_equal(rig_next(packet), 0);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_info().wrong_keys, 1);
}

/* After each wrong key the wait is twice as long, up to 8 s; CONNECT does not shorten it, the right key ends it. */
static void test_delay_after_wrong_key(void **state)
{
    const uint8_t wrong[32] = {0};
    uint32_t delay_ms = 250;
    (void)state;
    for (int i = 0; i < 7; i++) {
        assert_int_equal(rig_unlock_with(wrong), BEAM_XCP_ERR_ACCESS_LOCKED);
        const uint32_t begun_us = board.time_us;
        uint32_t waited_ms = 0;
        for (; rig_connect() == 0 && ASK(BEAM_XCP_GET_SEED, 0, 1) != 0; waited_ms++) {
            assert_int_equal(packet[1], BEAM_XCP_ERR_ACCESS_LOCKED);
            rig_run(20);
            waited_ms = (board.time_us - begun_us) / 1000;
        }
        assert_in_range(waited_ms, delay_ms - 25, delay_ms + 25);
        delay_ms = delay_ms < 8000 ? 2 * delay_ms : 8000;
    }
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock_with(wrong), BEAM_XCP_ERR_ACCESS_LOCKED);
    rig_run(300);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_info().wrong_keys, 8);
}

/* A key for another seed, a short key, a key twice. */
static void test_key_is_for_one_seed(void **state)
{
    uint8_t kept[18];
    (void)state;
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_connect(), 0);
    struct authentic a;
    uint8_t seed[17] = {1}, code[32];
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 1), 0);
    memcpy(seed + 1, packet + 2, 16);
    authentic_begin(&a, board.key);
    authentic_feed(&a, 17, seed);
    authentic_end(&a, code);
    kept[0] = BEAM_XCP_UNLOCK;
    kept[1] = 16;
    memcpy(kept + 2, code, 16);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 1), 0); /* another one since */
    memcpy(packet, kept, 18);
    assert_int_equal(rig_command(packet, 18), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(rig_connect(), 0);
    memcpy(packet, kept, 18);
    assert_int_equal(rig_command(packet, 18), BEAM_XCP_ERR_SEQUENCE);
    rig_run(300);
    assert_int_equal(ASK(BEAM_XCP_GET_SEED, 0, 1), 0);
    assert_int_equal(ASK(BEAM_XCP_UNLOCK, 16, 1, 2, 3), BEAM_XCP_ERR_ACCESS_LOCKED);
}

static void test_daq_commands(void **state)
{
    (void)state;
    assert_int_equal(ASK(BEAM_XCP_GET_DAQ_PROCESSOR_INFO), 0);
    assert_memory_equal(packet, ((uint8_t[]){0xFF, 0x13, 2, 0, 1, 0, 0, 0}), 8);
    assert_int_equal(ASK(BEAM_XCP_GET_DAQ_RESOLUTION_INFO), 0);
    assert_memory_equal(packet, ((uint8_t[]){0xFF, 1, 48, 0, 0, 0x34, 1, 0}), 8);
    assert_int_equal(ASK(BEAM_XCP_GET_DAQ_EVENT_INFO, 0, 0, 0), 0);
    assert_memory_equal(packet, ((uint8_t[]){0xFF, 4, 2, 6, 100, 4, 0}), 7); /* 100 × 10 µs */
    assert_int_equal(ASK(BEAM_XCP_UPLOAD, 6), 0);
    assert_memory_equal(packet + 1, "sample", 6);
    assert_int_equal(ASK(BEAM_XCP_GET_DAQ_EVENT_INFO, 0, 1, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    rig_run(10);
    assert_int_equal(ASK(BEAM_XCP_GET_DAQ_CLOCK), 0);
    assert_in_range(xcp_u32(packet + 4), 1000, board.time_us);

    assert_int_equal(ASK(BEAM_XCP_FREE_DAQ), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 1), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 1), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_DAQ, 0, 3, 0), BEAM_XCP_ERR_MEMORY_OVERFLOW);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_DAQ, 0, 2, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_DAQ, 0, 2, 0), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 2, 0, 1), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 5), BEAM_XCP_ERR_MEMORY_OVERFLOW);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 3), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 1), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 1, 0, 2), BEAM_XCP_ERR_MEMORY_OVERFLOW);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 1, 0, 1), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 3, 1), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 17), BEAM_XCP_ERR_MEMORY_OVERFLOW);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 2), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 2), BEAM_XCP_ERR_SEQUENCE);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 1, 0, 0, 2), 0);
    assert_int_equal(ASK(BEAM_XCP_ALLOC_ODT, 0, 1, 0, 1), BEAM_XCP_ERR_SEQUENCE);

    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0, 0, 2, 0), BEAM_XCP_ERR_DAQ_CONFIG); /* no pointer */
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 0, 2), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 3, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 2, 0, 0, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 1, 0, 0, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 3, 4, 0, 0, 0, 2, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 49, 0, 0, 0, 2, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 45, 0, 2, 0), BEAM_XCP_ERR_ACCESS_DENIED);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0, 0, 3, 0), BEAM_XCP_ERR_ACCESS_DENIED);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0xFF, 0xFF, 1, 0), BEAM_XCP_ERR_ACCESS_DENIED);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 48, 0, 0, 0, 2, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 1, 0, 0, 0, 2, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0, 0, 2, 0), BEAM_XCP_ERR_DAQ_CONFIG); /* behind the end */
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_LIST_MODE, 2, 1, 0, 0, 0, 1, 0), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_LIST_MODE, 0, 1, 0, 1, 0, 1, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_LIST_MODE, 0, 1, 0, 0, 0, 0, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_LIST_MODE, 0, 1, 0, 0, 0, 1, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 1, 1, 0), BEAM_XCP_ERR_DAQ_CONFIG); /* 49 bytes in a frame */
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 1, 0, 0, 1), 0);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_PTR, 0, 1, 0, 0, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 40, 0, 0, 0, 2, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 8, 0, 0, 0, 2, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 1, 2, 0), BEAM_XCP_ERR_OUT_OF_RANGE);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 3, 1, 0), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 2, 0, 0),
                     BEAM_XCP_ERR_DAQ_CONFIG); /* the other is not written */
    assert_int_equal(ASK(BEAM_XCP_START_STOP_SYNCH, 3), BEAM_XCP_ERR_MODE_NOT_VALID);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 2, 1, 0), 0);
    assert_int_equal(packet[1], 3); /* its first packet identifier */
    assert_int_equal(ASK(BEAM_XCP_START_STOP_SYNCH, 1), 0);
    assert_int_equal(ASK(BEAM_XCP_GET_STATUS), 0);
    assert_int_equal(packet[1], 0x40);
    assert_int_equal(ASK(BEAM_XCP_WRITE_DAQ, 0xFF, 4, 0, 0, 0, 2, 0), BEAM_XCP_ERR_DAQ_ACTIVE);
    assert_int_equal(ASK(BEAM_XCP_SET_DAQ_LIST_MODE, 0, 1, 0, 0, 0, 1, 0), BEAM_XCP_ERR_DAQ_ACTIVE);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 2, 1, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_SYNCH, 2), 0);
    assert_int_equal(ASK(BEAM_XCP_GET_STATUS), 0);
    assert_int_equal(packet[1], 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 1, 1, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 0, 1, 0), 0);
    assert_int_equal(ASK(BEAM_XCP_START_STOP_DAQ_LIST, 1, 1, 0), 0);
    assert_int_equal(rig_connect(), 0); /* stops it */
    assert_int_equal(ASK(BEAM_XCP_GET_STATUS), 0);
    assert_int_equal(packet[1], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_session, set_up),
        cmocka_unit_test_setup(test_memory, set_up),
        cmocka_unit_test_setup(test_pages_info, set_up),
        cmocka_unit_test_setup(test_seed_and_key, set_up),
        cmocka_unit_test_setup(test_delay_after_wrong_key, set_up),
        cmocka_unit_test_setup(test_key_is_for_one_seed, set_up),
        cmocka_unit_test_setup(test_daq_commands, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
