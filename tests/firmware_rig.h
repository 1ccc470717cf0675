/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * firmware_rig.h — the whole firmware on the board of firmware_board.h, a host of a few lines, and images to send.
 * rig_tick() computes every sample a second time from a copy of the image that was active when it began to run, and stops
 * the program when a bit of the prediction differs: whatever a test does to the line, the active model is watched.
 * Switches are counted in rig_switches.
 */
#ifndef FIRMWARE_RIG_H
#define FIRMWARE_RIG_H

#include <stdio.h>
#include "beam_image_file.h"
#include "built_in.h"
#include "firmware_board.h"

enum { RIG_TURNS = 8 };

static struct app app;
static struct beam_image rig_expected; /* what is running */
static struct beam_state rig_state;
static uint64_t rig_ticks;   /* since power-on */
static uint64_t rig_checked; /* samples compared, all power-ons */
static uint64_t rig_switches;
static uint16_t rig_counter;

/* ---- Time ---- */

static inline uint16_t rig_code(uint64_t k)
{
    return (uint16_t)(2048 + (int)(k * 7919 % 1601) - 800);
}

static inline void rig_expect(const struct beam_image *image)
{
    rig_expected = *image;
    beam_reset(&rig_expected.plan, &rig_state);
}

/* One sample; the model in rig_expected must give this prediction, bit for bit. */
static inline void rig_tick(void)
{
    const float u[BEAM_INPUTS] = {((float)app.drive_code - rig_expected.front.setup.drive_zero_code) *
                                  rig_expected.front.setup.drive_V_per_code};
    const struct beam_image *before = pages_active(&app.pages);
    float y[BEAM_OUTPUTS];
    uint32_t wanted, got;
    if (beam_step(&rig_expected.plan, &rig_state, u, y) != BEAM_OK)
        abort();
    board.time_us += 1000;
    app_tick(&app, rig_code(rig_ticks++));
    memcpy(&wanted, y, sizeof wanted);
    memcpy(&got, &app.latest.predicted, sizeof got);
    if (got != wanted || app.latest.step + 1 != rig_state.k || app.latest.sequence + 1 != rig_ticks)
        abort();
    rig_checked++;
    if (pages_active(&app.pages) != before) {
        rig_switches++;
        rig_expect(pages_active(&app.pages));
    } else if (app.sampler.state.k == 0) { /* a drive that begins at rest */
        beam_reset(&rig_expected.plan, &rig_state);
    }
}

static inline void rig_turns(int n)
{
    for (int i = 0; i < n; i++)
        app_poll(&app);
}

static inline void rig_run(int ticks)
{
    for (int i = 0; i < ticks; i++) {
        rig_tick();
        rig_turns(RIG_TURNS);
    }
}

/* Power-on with the flash as it is. */
static inline void rig_boot(void)
{
    board.to_board.n = board.to_board.taken = board.to_host.n = board.to_host.taken = 0;
    rig_ticks = 0;
    app_init(&app, &board.facts);
    rig_expect(pages_active(&app.pages));
}

/* ---- Images ---- */

static inline void rig_sign(struct beam_image_file *file, const uint8_t key[32], uint32_t counter)
{
    struct authentic a;
    const uint8_t *bytes = (const uint8_t *)file;
    file->front.header.counter = counter;
    memcpy(file->front.header.device, board.facts.device, BEAM_IMAGE_DEVICE_BYTES);
    file->front.header.crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - 96, bytes + 64);
    authentic_begin(&a, key);
    authentic_feed(&a, BEAM_IMAGE_BYTES - BEAM_IMAGE_CODE_BYTES, bytes);
    authentic_end(&a, file->code);
}

/* Like the built-in image, but with a sensor `gain` times as strong; proved and signed. */
static inline void rig_image(struct beam_image_file *file, float gain, uint32_t counter)
{
    struct beam_image_run *run = malloc(beam_image_run_bytes());
    memcpy(file, built_in_image, sizeof *file);
    for (int i = 0; i < BEAM_STATES; i++)
        file->numbers.row[0][i] *= gain;
    file->numbers.taps[0] *= gain;
    if (!run || beam_image_run_seal(run, file, 0.001F) != BEAM_IMAGE_FINE)
        abort();
    free(run);
    rig_sign(file, board.key, counter);
}

/* ---- Host ---- */

static inline size_t rig_frame(const uint8_t packet[], uint16_t n, uint8_t frame[BEAM_WIRE_MAX_FRAME])
{
    memcpy(frame + BEAM_WIRE_HEADER, packet, n);
    return sxi_close(frame, n, rig_counter++);
}

static inline void rig_send(const uint8_t packet[], uint16_t n)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    queue_put(&board.to_board, rig_frame(packet, n, frame), frame);
}

/* The next whole frame's packet that the board has sent; its length, 0 when there is none. */
static inline uint16_t rig_next(uint8_t packet[BEAM_WIRE_MAX_PACKET])
{
    struct rig_queue *q = &board.to_host;
    if (q->n - q->taken < BEAM_WIRE_HEADER)
        return 0;
    const uint8_t *frame = q->bytes + q->taken;
    const uint16_t n = xcp_u16(frame), body = (uint16_t)(BEAM_WIRE_HEADER + n + (n & 1u));
    uint16_t sum = 0;
    if (n < 1 || n > BEAM_WIRE_MAX_PACKET)
        abort();
    if (q->n - q->taken < (size_t)body + BEAM_WIRE_TAIL)
        return 0;
    for (int i = 0; i < body; i += 2)
        sum = (uint16_t)(sum + xcp_u16(frame + i));
    if (sum != xcp_u16(frame + body))
        abort();
    memcpy(packet, frame + BEAM_WIRE_HEADER, n);
    q->taken += (size_t)body + BEAM_WIRE_TAIL;
    return n;
}

/* Runs until a response (or ERR) has come, for `ticks` samples at most; DAQ packets and events go to `other`, if any. */
static inline uint16_t rig_await(uint8_t packet[BEAM_WIRE_MAX_PACKET], int ticks,
                                 void (*other)(const uint8_t packet[], uint16_t n))
{
    for (int i = 0; i < ticks; i++) {
        rig_run(1);
        for (uint16_t n; (n = rig_next(packet)) > 0;) {
            if (packet[0] >= BEAM_XCP_ERR)
                return n;
            if (other)
                other(packet, n);
        }
    }
    return 0;
}

/* Command and response in one buffer; 0 when fine, else the XCP error, −1 without an answer. */
static inline int rig_command(uint8_t packet[BEAM_WIRE_MAX_PACKET], uint16_t n)
{
    rig_send(packet, n);
    const uint16_t got = rig_await(packet, 10000, NULL);
    return got == 0 ? -1 : packet[0] == BEAM_XCP_RES ? 0 : packet[1] == 0 ? 0x100 : packet[1];
}

#define RIG(...) rig_command((uint8_t[BEAM_WIRE_MAX_PACKET]){__VA_ARGS__}, (uint16_t)sizeof((uint8_t[]){__VA_ARGS__}))

static inline int rig_connect(void)
{
    return RIG(BEAM_XCP_CONNECT, 0);
}

static inline int rig_unlock_with(const uint8_t key[32])
{
    struct authentic a;
    uint8_t packet[BEAM_WIRE_MAX_PACKET] = {BEAM_XCP_GET_SEED, 0, BEAM_XCP_RESOURCE_CAL_PAG}, seed[17] = {1}, code[32];
    const int error = rig_command(packet, 3);
    if (error != 0 || packet[1] == 0)
        return error;
    memcpy(seed + 1, packet + 2, 16);
    authentic_begin(&a, key);
    authentic_feed(&a, sizeof seed, seed);
    authentic_end(&a, code);
    packet[0] = BEAM_XCP_UNLOCK;
    packet[1] = 16;
    memcpy(packet + 2, code, 16);
    return rig_command(packet, 18);
}

static inline int rig_unlock(void)
{
    return rig_unlock_with(board.key);
}

static inline int rig_read(uint32_t address, uint32_t n, void *out)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET], *to = out;
    for (uint32_t done = 0; done < n;) {
        const uint32_t count = n - done < 240 ? n - done : 240;
        packet[0] = BEAM_XCP_SHORT_UPLOAD;
        packet[1] = (uint8_t)count;
        packet[2] = packet[3] = 0;
        xcp_put(4, address + done, packet + 4);
        const int error = rig_command(packet, 8);
        if (error != 0)
            return error;
        memcpy(to + done, packet + 1, count);
        done += count;
    }
    return 0;
}

static inline int rig_write(uint32_t address, uint32_t n, const void *bytes)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    for (uint32_t done = 0; done < n;) {
        const uint32_t count = n - done < 240 ? n - done : 240;
        packet[0] = BEAM_XCP_SHORT_DOWNLOAD;
        packet[1] = (uint8_t)count;
        packet[2] = packet[3] = 0;
        xcp_put(4, address + done, packet + 4);
        memcpy(packet + 8, (const uint8_t *)bytes + done, count);
        const int error = rig_command(packet, (uint16_t)(8 + count));
        if (error != 0)
            return error;
        done += count;
    }
    return 0;
}

static inline struct beam_info rig_info(void)
{
    struct beam_info info;
    if (rig_read(BEAM_WIRE_INFO, sizeof info, &info) != 0)
        abort();
    return info;
}

/* Stage and switch, connected and unlocked. What the board said to the switch. */
static inline int rig_download(const struct beam_image_file *file)
{
    int error = RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1);
    if (error == 0)
        error = rig_write(BEAM_WIRE_IMAGE, sizeof *file, file);
    if (error != 0)
        abort();
    return RIG(BEAM_XCP_SET_CAL_PAGE, 3, 0, 1);
}

/* Is this image page 0, bit for bit? */
static inline bool rig_active_is(const struct beam_image_file *file)
{
    uint8_t there[BEAM_IMAGE_BYTES];
    beam_image_read(pages_active(&app.pages), 0, sizeof there, there);
    return memcmp(there, (const uint8_t *)file, sizeof there) == 0;
}

#endif
