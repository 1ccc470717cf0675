/* SPDX-License-Identifier: GPL-3.0-or-later */
/* link_download.c — a model to the board and back. */
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "board.h"
#include "link.h"
#include "ground/ground.h"
#include "xcp_master.h"

enum { PASSES = 8, CHECK_MS = 1000, STORE_MS = 15000, STORE_PAUSE_MS = 30, QUIET_LOOKS = 5 };

enum bf_status link_read_setup(struct link *link, struct beam_image_setup *out, struct bf_error *err)
{
    if (link_show_page(link, BEAM_WIRE_PAGE_ACTIVE, err) != BF_OK)
        return err->status;
    return link_read(link, "reading the model", BEAM_WIRE_IMAGE + offsetof(struct beam_image_front, setup), sizeof *out,
                     out, err);
}

enum bf_status link_read_tracking(struct link *link, struct beam_tracking *out, struct bf_error *err)
{
    return link_read(link, "reading the tracked modes", BEAM_WIRE_TRACKING, sizeof *out, out, err);
}

/* ---- Blocks, with a bar ---- */

enum { PIECE = 512 };

static enum bf_status interrupted(const struct link *link, struct bf_error *err)
{
    return bf_fail(err, BF_DEVICE,
                   "%s: interrupted; the board runs and keeps the model it had. Repeat the command to download",
                   port_path(link->port));
}

static enum bf_status write_staging(struct link *link, const struct beam_image_file *image, struct progress *bar,
                                    struct bf_error *err)
{
    const uint8_t *bytes = (const uint8_t *)image;
    for (size_t at = 0, n; at < sizeof *image; at += n) {
        n = sizeof *image - at < PIECE ? sizeof *image - at : PIECE;
        if (progress_interrupted())
            return interrupted(link, err);
        if (link_write(link, "writing the image", BEAM_WIRE_IMAGE + (uint32_t)at, n, bytes + at, err) != BF_OK)
            return err->status;
        progress_update(bar, 0.45 * (double)(at + n) / (double)sizeof *image, "writing");
    }
    return BF_OK;
}

static enum bf_status read_page(struct link *link, struct beam_image_file *out, struct progress *bar, double from,
                                struct bf_error *err)
{
    uint8_t *bytes = (uint8_t *)out;
    for (size_t at = 0, n; at < sizeof *out; at += n) {
        n = sizeof *out - at < PIECE ? sizeof *out - at : PIECE;
        if (link_read(link, "reading the image", BEAM_WIRE_IMAGE + (uint32_t)at, n, bytes + at, err) != BF_OK)
            return err->status;
        progress_update(bar, from + (1.0 - from) * (double)(at + n) / (double)sizeof *out, "reading back");
    }
    return BF_OK;
}

/* Until the board's CRC-32 of the page is that of what was read. */
static enum bf_status read_checked(struct link *link, int page, struct beam_image_file *out, struct progress *bar,
                                   double from, struct bf_error *err)
{
    uint32_t crc;
    if (link_show_page(link, page, err) != BF_OK)
        return err->status;
    for (int pass = 0; pass < PASSES; pass++) {
        if (progress_interrupted() && from <= 0.0)
            return bf_fail(err, BF_DEVICE, "%s: interrupted; nothing was written", port_path(link->port));
        if (read_page(link, out, bar, from, err) != BF_OK ||
            link_crc(link, BEAM_WIRE_IMAGE, sizeof *out, &crc, err) != BF_OK)
            return err->status;
        if (crc == beam_crc32(0, sizeof *out, (const uint8_t *)out))
            return BF_OK;
    }
    return bf_fail(err, BF_DEVICE, "%s: what is read is not what the board holds, %d times; check the line",
                   port_path(link->port), PASSES);
}

enum bf_status link_upload(struct link *link, int page, struct beam_image_file *out, struct bf_error *err)
{
    struct progress *bar = progress_begin("upload");
    const enum bf_status status = read_checked(link, page, out, bar, 0.0, err);
    progress_end(bar);
    return status;
}

/* ---- The board's own checks and the switch ---- */

static bool runs(const struct link *link, const struct beam_image_file *image)
{
    const struct beam_image_header *header = &image->front.header;
    return link->info.running == BEAM_BOOT_DOWNLOADED && link->info.counter == header->counter &&
           memcmp(link->info.model_sha256, header->model_sha256, sizeof header->model_sha256) == 0;
}

static enum bf_status refused_image(const struct link *link, struct bf_error *err)
{
    return bf_fail(err, BF_DEVICE, "%s: the board refused the image and runs the model it had: %s",
                   port_path(link->port), beam_image_fault_text((enum beam_image_fault)link->info.last_fault));
}

/* A lost answer leaves open what happened; the board's information says it. */
static enum bf_status switch_page(struct link *link, const struct beam_image_file *image, struct bf_error *err)
{
    const uint8_t command[4] = {BEAM_XCP_SET_CAL_PAGE, 0x01, 0, BEAM_WIRE_PAGE_STAGING};
    const uint32_t refusals = link->info.refused;
    struct xcp_answer answer = {.outcome = XCP_LOST};
    enum bf_status status = BF_OK;
    for (int i = 0; i < PASSES && status == BF_OK; i++) {
        link->xcp.patience_ms = CHECK_MS;
        status = xcp_ask_once(&link->xcp, sizeof command, command, &answer, err);
        link->xcp.patience_ms = 0;
        if (status == BF_OK)
            status = link_read_info(link, err);
        if (status != BF_OK || runs(link, image))
            return status;
        if (link->info.refused != refusals)
            return refused_image(link, err);
    }
    if (status == BF_OK && answer.outcome == XCP_REFUSED)
        return xcp_refused(&link->xcp, "to switch to the image", answer.error, err);
    return status != BF_OK ? status
                           : bf_fail(err, BF_DEVICE, "%s: the board does not switch to the image; try again",
                                     port_path(link->port));
}

static enum bf_status stage(struct link *link, const struct beam_image_file *image, struct progress *bar,
                            struct bf_error *err)
{
    uint32_t crc = 0;
    for (int pass = 0; pass < PASSES; pass++) {
        if (link_show_page(link, BEAM_WIRE_PAGE_STAGING, err) != BF_OK ||
            write_staging(link, image, bar, err) != BF_OK ||
            link_crc(link, BEAM_WIRE_IMAGE, sizeof *image, &crc, err) != BF_OK)
            return err->status;
        if (crc == beam_crc32(0, sizeof *image, (const uint8_t *)image))
            return progress_interrupted() ? interrupted(link, err) : BF_OK;
    }
    return bf_fail(err, BF_DEVICE, "%s: the image arrives damaged, %d times; check the line", port_path(link->port),
                   PASSES);
}

/* Byte by byte what runs now is what was sent. */
static enum bf_status compare(struct link *link, const struct beam_image_file *image, struct progress *bar,
                              struct bf_error *err)
{
    struct beam_image_file now;
    if (read_checked(link, BEAM_WIRE_PAGE_ACTIVE, &now, bar, 0.6, err) != BF_OK)
        return err->status;
    const unsigned char *sent = (const unsigned char *)image, *running = (const unsigned char *)&now;
    if (memcmp(running, sent, sizeof now) != 0)
        return bf_fail(err, BF_DEVICE, "%s: the running model is not the one that was sent; do not trust this board",
                       port_path(link->port));
    return BF_OK;
}

/* ---- Storing ---- */

static enum bf_status storing(struct link *link, bool *under_way, struct bf_error *err)
{
    struct xcp_answer answer;
    const uint8_t command[1] = {BEAM_XCP_GET_STATUS};
    if (xcp_expect(&link->xcp, "its status", sizeof command, command, 6, &answer, err) != BF_OK)
        return err->status;
    *under_way = (answer.data[1] & XCP_SESSION_STORE) != 0;
    return BF_OK;
}

/* Polled: an event may be lost. Done when the board says that this counter is stored. */
static enum bf_status store(struct link *link, const struct beam_image_file *image, struct bf_error *err)
{
    const uint8_t command[4] = {BEAM_XCP_SET_REQUEST, 0x01, 0, 0};
    const uint32_t errors = link->info.nvm_errors;
    const int64_t until_ms = port_clock_ms() + STORE_MS;
    struct xcp_answer answer;
    bool under_way = false;
    int quiet = QUIET_LOOKS;
    while (port_clock_ms() < until_ms) {
        if (!under_way && quiet >= QUIET_LOOKS) {
            if (xcp_ask_once(&link->xcp, sizeof command, command, &answer, err) != BF_OK)
                return err->status;
            quiet = 0;
        }
        if (storing(link, &under_way, err) != BF_OK || link_read_info(link, err) != BF_OK)
            return err->status;
        if (link->info.stored == image->front.header.counter)
            return BF_OK;
        if (link->info.nvm_errors != errors)
            break;
        quiet += !under_way;
        (void)nanosleep(&(struct timespec){.tv_nsec = STORE_PAUSE_MS * 1000000L}, NULL);
    }
    return bf_fail(
        err, BF_DEVICE,
        "%s: the model runs, but the board did not store it (%u failed writes): after power off it starts with "
        "the one before. Try again; if it stays so, its memory is worn",
        port_path(link->port), (unsigned)(link->info.nvm_errors - errors));
}

/* ---- All of it ---- */

static enum bf_status check_counter(const struct link *link, const struct beam_image_file *image, struct bf_error *err)
{
    const uint32_t counter = image->front.header.counter;
    if (counter > link->info.stored && counter > link->info.counter)
        return BF_OK;
    return bf_fail(
        err, BF_DEVICE,
        "%s: the image has counter %u, and the board has seen %u; export or sign it again with a greater one",
        port_path(link->port), (unsigned)counter,
        (unsigned)(link->info.stored > link->info.counter ? link->info.stored : link->info.counter));
}

static bool known(const struct link *link, const struct beam_image_file *image)
{
    const struct beam_image_header *header = &image->front.header;
    return link->info.running != BEAM_BOOT_BUILT_IN && link->info.counter == header->counter &&
           memcmp(link->info.model_sha256, header->model_sha256, sizeof header->model_sha256) == 0;
}

static enum bf_status download(struct link *link, const struct beam_image_file *image, struct link_download *d,
                               struct progress *bar, struct bf_error *err)
{
    d->was_running = known(link, image);
    if (!d->was_running && (check_counter(link, image, err) != BF_OK || stage(link, image, bar, err) != BF_OK ||
                            switch_page(link, image, err) != BF_OK))
        return err->status;
    if (compare(link, image, bar, err) != BF_OK)
        return err->status;
    d->was_stored = link->info.stored == image->front.header.counter;
    return d->no_store || d->was_stored ? BF_OK : store(link, image, err);
}

enum bf_status link_download(struct link *link, const struct beam_image_file *image, struct link_download *d,
                             struct bf_error *err)
{
    const int64_t start_ms = port_clock_ms();
    struct progress *bar = progress_begin("download");
    const enum bf_status status = download(link, image, d, bar, err);
    progress_end(bar);
    d->seconds = 1e-3 * (double)(port_clock_ms() - start_ms);
    return status;
}
