/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "board.h"
#include "link.h"
#include "port.h"
#include "xcp_master.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

enum { LEAST_BLOCK = 48, EASY_BLOCKS = 4, MOST_LOSSES = 60, SHORT_HEADER = 8, PASSES = 6 };

static void put_u32(uint8_t bytes[4], uint32_t x)
{
    for (int i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(x >> 8 * i);
}

/* ---- Memory ---- */

static void adapt(struct link *link, bool lost)
{
    if (lost) {
        link->block = link->block / 2 > LEAST_BLOCK ? link->block / 2 : LEAST_BLOCK;
        link->easy = 0;
    } else if (++link->easy >= EASY_BLOCKS) {
        link->block = 2 * link->block < link->largest ? 2 * link->block : link->largest;
        link->easy = 0;
    }
}

/* One block of the size that suits the line; *done: its bytes. Exactly one of out and in is given. */
static enum bf_status transfer_block(struct link *link, const char *what, uint32_t address, size_t n, uint8_t out[],
                                     const uint8_t in[], size_t *done, struct bf_error *err)
{
    struct xcp_answer answer;
    int refused = -1;
    for (int losses = 0; losses < MOST_LOSSES;) {
        const size_t block = n < link->block ? n : link->block;
        uint8_t command[BEAM_WIRE_MAX_PACKET] = {in != NULL ? BEAM_XCP_SHORT_DOWNLOAD : BEAM_XCP_SHORT_UPLOAD,
                                                 (uint8_t)block};
        put_u32(command + 4, address);
        if (in != NULL)
            memcpy(command + SHORT_HEADER, in, block);
        if (xcp_ask_once(&link->xcp, SHORT_HEADER + (in != NULL ? block : 0), command, &answer, err) != BF_OK)
            return err->status;
        if (answer.outcome == XCP_REFUSED) {
            if (answer.error == refused)
                return xcp_refused(&link->xcp, what, answer.error, err);
            refused = answer.error;
            continue;
        }
        const bool fits = answer.outcome == XCP_DONE && (in != NULL || answer.n == block + 1);
        adapt(link, !fits);
        if (fits) {
            if (out != NULL)
                memcpy(out, answer.data + 1, block);
            *done = block;
            return BF_OK;
        }
        losses++;
        refused = -1;
    }
    return bf_fail(err, BF_DEVICE, "%s: the line damages nearly everything; check cable, ground and --baud",
                   port_path(link->port));
}

enum bf_status link_read(struct link *link, const char *what, uint32_t address, size_t n, void *out,
                         struct bf_error *err)
{
    for (size_t at = 0, done = 0; at < n; at += done)
        if (transfer_block(link, what, address + (uint32_t)at, n - at, (uint8_t *)out + at, NULL, &done, err) != BF_OK)
            return err->status;
    return BF_OK;
}

enum bf_status link_write(struct link *link, const char *what, uint32_t address, size_t n, const void *bytes,
                          struct bf_error *err)
{
    for (size_t at = 0, done = 0; at < n; at += done)
        if (transfer_block(link, what, address + (uint32_t)at, n - at, NULL, (const uint8_t *)bytes + at, &done, err) !=
            BF_OK)
            return err->status;
    return BF_OK;
}

/* The address is set anew for each try, because the board moves it. */
enum bf_status link_crc(struct link *link, uint32_t address, size_t n, uint32_t *crc, struct bf_error *err)
{
    struct xcp_answer answer = {.outcome = XCP_LOST};
    uint8_t set[8] = {BEAM_XCP_SET_MTA}, build[8] = {BEAM_XCP_BUILD_CHECKSUM};
    put_u32(set + 4, address);
    put_u32(build + 4, (uint32_t)n);
    for (int i = 0; i < link->xcp.tries; i++) {
        if (xcp_expect(&link->xcp, "an address", sizeof set, set, 1, &answer, err) != BF_OK ||
            xcp_ask_once(&link->xcp, sizeof build, build, &answer, err) != BF_OK)
            return err->status;
        if (answer.outcome == XCP_DONE && answer.n >= 8) {
            memcpy(crc, answer.data + 4, sizeof *crc);
            return BF_OK;
        }
    }
    if (answer.outcome == XCP_REFUSED)
        return xcp_refused(&link->xcp, "a checksum", answer.error, err);
    return bf_fail(err, BF_DEVICE, "%s: no checksum from the board; try again", port_path(link->port));
}

enum bf_status link_show_page(struct link *link, int page, struct bf_error *err)
{
    struct xcp_answer answer;
    const uint8_t command[4] = {BEAM_XCP_SET_CAL_PAGE, 0x02, 0, (uint8_t)page}; /* access by XCP */
    return xcp_expect(&link->xcp, "a page", sizeof command, command, 1, &answer, err);
}

/* ---- Who it is ---- */

/* What changes while one looks. */
static struct beam_info steady(struct beam_info info)
{
    info.missed = info.overrun = info.frames_bad = info.worst_step_us = info.sequence = 0;
    info.latched = info.alarms = info.faults = info.latch_first = info.latch_last = 0;
    return info;
}

/* Twice alike: nothing but the line's weak sum protects it. */
enum bf_status link_read_info(struct link *link, struct bf_error *err)
{
    struct beam_info last, kept, now;
    if (link_read(link, "reading its information", BEAM_WIRE_INFO, sizeof last, &last, err) != BF_OK)
        return err->status;
    for (int i = 0; i < PASSES; i++) {
        if (link_read(link, "reading its information", BEAM_WIRE_INFO, sizeof link->info, &link->info, err) != BF_OK)
            return err->status;
        kept = steady(last);
        now = steady(link->info);
        if (memcmp(&kept, &now, sizeof now) == 0)
            return BF_OK;
        last = link->info;
    }
    return bf_fail(err, BF_DEVICE, "%s: the board's information reads differently each time; check the line",
                   port_path(link->port));
}

const char *link_running_name(uint32_t running)
{
    static const char *const names[] = {"built in", "slot 0", "slot 1", "downloaded"};
    return running < sizeof names / sizeof *names ? names[running] : "?";
}

const char *link_slot_name(uint32_t state)
{
    static const char *const names[] = {"empty", "valid", "spoilt"};
    return state < sizeof names / sizeof *names ? names[state] : "?";
}

const char *link_sensor_fault(uint32_t status)
{
    return status & BEAM_LIVE_STUCK    ? "stuck"
           : status & BEAM_LIVE_AT_END ? "at its end"
           : status & BEAM_LIVE_QUIET  ? "too quiet"
           : status & BEAM_LIVE_OFFSET ? "offset"
                                       : "";
}

enum bf_status link_open(const char *path, long baud, struct link *link, struct bf_error *err)
{
    size_t packet = 0;
    memset(link, 0, sizeof *link);
    if (port_open(path, baud, &link->port, err) != BF_OK)
        return err->status;
    xcp_begin(&link->xcp, link->port);
    enum bf_status status = port_flush(link->port, err);
    if (status == BF_OK)
        status = xcp_connect(&link->xcp, &packet, err);
    link->largest = status == BF_OK ? (packet - SHORT_HEADER) & ~(size_t)3 : LEAST_BLOCK;
    link->block = link->largest;
    if (status == BF_OK)
        status = link_read_info(link, err);
    if (status == BF_OK && (link->info.image_layout != BEAM_IMAGE_LAYOUT || link->info.image_bytes != BEAM_IMAGE_BYTES))
        status = bf_fail(err, BF_DEVICE,
                         "%s: the board takes images of layout %u with %u bytes, this program makes layout %d with %d; "
                         "update one of them",
                         path, (unsigned)link->info.image_layout, (unsigned)link->info.image_bytes, BEAM_IMAGE_LAYOUT,
                         BEAM_IMAGE_BYTES);
    if (status == BF_OK && link->info.sample_mHz == 0)
        status = bf_fail(err, BF_DEVICE, "%s: the board says that it does not sample; update its firmware", path);
    if (status != BF_OK) {
        port_close(link->port);
        link->port = NULL;
    }
    return status;
}

void link_close(struct link *link)
{
    if (link->port == NULL)
        return;
    xcp_disconnect(&link->xcp);
    port_close(link->port);
    link->port = NULL;
}

/* ---- Seed and key ---- */

/* *open: it is not locked (any more). */
static enum bf_status get_seed(struct link *link, uint8_t seed[BEAM_XCP_SEED_BYTES], bool *open, struct bf_error *err)
{
    enum { WAIT_MS = 15000 };
    const uint8_t command[3] = {BEAM_XCP_GET_SEED, 0, BEAM_XCP_RESOURCE_CAL_PAG};
    struct xcp_answer answer;
    const int64_t until_ms = port_clock_ms() + WAIT_MS;
    do { /* after a wrong key the board answers nobody for a while */
        if (xcp_ask(&link->xcp, sizeof command, command, &answer, err) != BF_OK)
            return err->status;
        if (answer.outcome == XCP_REFUSED && answer.error == BEAM_XCP_ERR_ACCESS_LOCKED)
            (void)nanosleep(&(struct timespec){.tv_nsec = 100000000L}, NULL);
    } while (answer.outcome == XCP_REFUSED && answer.error == BEAM_XCP_ERR_ACCESS_LOCKED && port_clock_ms() < until_ms);
    if (answer.outcome == XCP_REFUSED)
        return xcp_refused(&link->xcp, "a seed", answer.error, err);
    *open = answer.n >= 2 && answer.data[1] == 0;
    if (!*open && (answer.n != 2 + BEAM_XCP_SEED_BYTES || answer.data[1] != BEAM_XCP_SEED_BYTES))
        return bf_fail(err, BF_DEVICE, "%s: the board's seed has another size; update the firmware or this program",
                       port_path(link->port));
    if (!*open)
        memcpy(seed, answer.data + 2, BEAM_XCP_SEED_BYTES);
    return BF_OK;
}

enum bf_status link_unlock(struct link *link, const struct device_key *key, const char *key_path, struct bf_error *err)
{
    const uint8_t resource = BEAM_XCP_RESOURCE_CAL_PAG;
    uint8_t seed[BEAM_XCP_SEED_BYTES], code[DEVICE_CODE_BYTES], command[2 + BEAM_XCP_KEY_BYTES];
    struct xcp_answer answer;
    bool open = false;
    size_t packet;
    for (int i = 0; i < link->xcp.tries; i++) {
        if (get_seed(link, seed, &open, err) != BF_OK || open)
            return open ? BF_OK : err->status;
        device_key_code(key, &resource, 1, seed, sizeof seed, code);
        command[0] = BEAM_XCP_UNLOCK;
        command[1] = BEAM_XCP_KEY_BYTES;
        memcpy(command + 2, code, BEAM_XCP_KEY_BYTES);
        memset(code, 0, sizeof code);
        if (xcp_ask_once(&link->xcp, sizeof command, command, &answer, err) != BF_OK)
            return err->status;
        if (answer.outcome == XCP_DONE)
            return BF_OK;
        if (answer.outcome == XCP_REFUSED && answer.error == BEAM_XCP_ERR_ACCESS_LOCKED)
            return bf_fail(err, BF_DEVICE,
                           "%s: the board does not accept the key of %s; give this board's own key file",
                           port_path(link->port), key_path);
        if (answer.outcome == XCP_REFUSED && xcp_connect(&link->xcp, &packet, err) != BF_OK) /* a damaged command */
            return err->status;
    }
    return bf_fail(err, BF_DEVICE, "%s: the board did not answer the key; check the line", port_path(link->port));
}

/* ---- Latch ---- */

enum bf_status link_acknowledge(struct link *link, struct bf_error *err)
{
    enum { LOOKS = 100 };
    const uint32_t any = 1;
    if (link_write(link, "acknowledging its alarms", BEAM_WIRE_LATCH, sizeof any, &any, err) != BF_OK ||
        link_read_info(link, err) != BF_OK)
        return err->status;
    const uint32_t then = link->info.sequence;
    for (int i = 0; i < LOOKS && link->info.sequence - then < 2; i++) /* the sample after this one forgets */
        if (link_read_info(link, err) != BF_OK)
            return err->status;
    return BF_OK;
}

/* ---- Drive ---- */

enum bf_status link_read_drive(struct link *link, struct beam_drive *out, struct bf_error *err)
{
    return link_read(link, "reading the drive", BEAM_WIRE_DRIVE, sizeof *out, out, err);
}

enum bf_status link_start_drive(struct link *link, const struct beam_drive *drive, struct bf_error *err)
{
    const size_t body = offsetof(struct beam_drive, generation);
    struct beam_drive now;
    for (int i = 0; i < PASSES; i++) {
        if (link_write(link, "setting the drive", BEAM_WIRE_DRIVE, body, drive, err) != BF_OK ||
            link_read_drive(link, &now, err) != BF_OK)
            return err->status;
        if (memcmp(&now, drive, body) != 0)
            continue;
        now.generation++;
        link->driving = drive->amplitude > 0.0F;
        link->told_ms = port_clock_ms();
        return link_write(link, "starting the drive", BEAM_WIRE_DRIVE + (uint32_t)body, sizeof now.generation,
                          &now.generation, err);
    }
    return bf_fail(err, BF_DEVICE, "%s: the board does not keep the drive it is given; check the line",
                   port_path(link->port));
}
