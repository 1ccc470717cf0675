/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Any bytes to the firmware's line, raw or in good frames, locked or unlocked, with a good image staged or not: every
 * sample is computed as it should be, and what is active is the built-in model or that good image, bit for bit.
 *
 * First byte: bit 0 unlocked, bit 1 the good image is staged, bit 2 streaming. Then records: n = 0: the line is silent for
 * 60 ms; 1..248: a good frame of the next n bytes; above: the next n − 248 bytes as they are.
 */
#include "firmware_rig.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

enum { STARTS = 8 };

static struct app start[STARTS];
static struct beam_image_file good;

static void stream(void)
{
    const int errors = RIG(BEAM_XCP_ALLOC_DAQ, 0, 1, 0) | RIG(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 1) |
                       RIG(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 1) | RIG(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 0, 0) |
                       RIG(BEAM_XCP_WRITE_DAQ, 0xFF, sizeof(struct beam_live), 0, 0, 0, 2, 0) |
                       RIG(BEAM_XCP_SET_DAQ_LIST_MODE, 0x10, 0, 0, 0, 0, 1, 0) |
                       RIG(BEAM_XCP_START_STOP_DAQ_LIST, 1, 0, 0);
    if (errors != 0)
        abort();
}

/* Every way to begin, once; each run of the fuzzer copies one. */
static void prepare(void)
{
    board_reset();
    rig_image(&good, 1.5F, 3);
    for (int i = 0; i < STARTS; i++) {
        board_reset();
        rig_boot();
        if (rig_connect() != 0 || ((i & 1) && rig_unlock() != 0))
            abort();
        if (i & 2)
            beam_image_write(pages_staging(&app.pages), 0, sizeof good, (const uint8_t *)&good);
        if (i & 4)
            stream();
        while (app.sampler.sequence < 200)
            rig_run(1);
        start[i] = app;
    }
}

/* A sample, and the background loop until it would sleep. */
static void sample(void)
{
    rig_tick();
    for (int turn = 0; turn < RIG_TURNS && app_poll(&app); turn++)
        ;
    board.to_host.taken = board.to_host.n;
}

static void run(const uint8_t *data, size_t n)
{
    for (size_t at = 0; at < n;) {
        const size_t code = data[at++], wanted = code <= BEAM_WIRE_MAX_PACKET ? code : code - BEAM_WIRE_MAX_PACKET;
        const size_t count = wanted < n - at ? wanted : n - at;
        if (count == 0)
            board.time_us += 60000;
        else if (code <= BEAM_WIRE_MAX_PACKET)
            rig_send(data + at, (uint16_t)count);
        else
            queue_put(&board.to_board, count, data + at);
        at += count;
        sample();
    }
    for (int i = 0; i < 6; i++) /* a switch that was begun is done */
        sample();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static bool prepared;
    if (!prepared)
        prepare();
    prepared = true;
    if (n == 0 || n > 4096)
        return 0;
    app = start[data[0] % STARTS];
    rig_ticks = app.sampler.sequence;
    rig_expected = *pages_active(&app.pages);
    rig_state = app.sampler.state;
    board.to_board.n = board.to_board.taken = board.to_host.n = board.to_host.taken = 0;
    board.time_us = 1000000;
    run(data + 1, n - 1);
    if (!rig_active_is(&good)) {
        struct beam_image_file built_in;
        memcpy(&built_in, built_in_image, sizeof built_in);
        if (!rig_active_is(&built_in))
            abort();
    } else if (!(data[0] & 1) || !(data[0] & 2)) {
        abort(); /* locked, or never staged */
    }
    if (app.missed != 0 || app.store.phase == STORE_ERASE)
        abort();
    return 0;
}
