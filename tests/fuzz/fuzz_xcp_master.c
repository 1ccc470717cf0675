/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Any bytes as what a board sends: the host refuses with one line of text, or has what link.h promises. The input is a run
 * of pieces, each led by one byte: below 0x80, so many bytes as they are; else so many (less 0x80, and one more) bytes as
 * the packet of a good frame, so that the fuzzer need not find sums.
 */
#include <math.h>
#include <string.h>
#include <time.h>
#include "fuzz_file.h"
#include "board/board.h"
#include "board/port_driver.h"
#include "board/xcp_frame.h"
#include "board/xcp_master.h"

static const uint8_t *next, *end;

int nanosleep(const struct timespec *asked, struct timespec *left)
{
    (void)asked, (void)left; /* waiting finds nothing */
    return 0;
}

static long fake_read(struct port *port, size_t room, uint8_t out[])
{
    (void)port;
    if (end - next < 2)
        return PORT_GONE;
    const uint8_t lead = *next++;
    size_t n = (size_t)(lead & 0x7F) + 1;
    if (n > (size_t)(end - next))
        n = (size_t)(end - next);
    if (room < BEAM_WIRE_MAX_FRAME)
        abort();
    const uint8_t *piece = next;
    next += n;
    if (lead >= 0x80)
        return (long)xcp_frame_make(0, n, piece, out);
    memcpy(out, piece, n);
    return (long)n;
}

static long fake_write(struct port *port, size_t n, const uint8_t bytes[])
{
    (void)port, (void)bytes;
    return (long)n;
}

static const struct port_driver driver = {.read = fake_read, .write = fake_write};

static void take(void *context, const struct beam_live *live)
{
    if (beam_crc32(0, offsetof(struct beam_live, crc32), (const uint8_t *)live) != live->crc32)
        abort();
    ++*(uint64_t *)context;
}

static void check(enum bf_status status, const struct bf_error *err)
{
    if (status != BF_OK && (status != err->status || err->text[0] == '\0' || strchr(err->text, '\n') != NULL))
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static struct link link;
    static struct beam_image_file image;
    const struct device_key key = {{1}};
    struct port port = {.driver = &driver, .path = (char *)"port", .baud = 1000000000};
    struct bf_error err = {BF_OK, ""};
    struct beam_image_setup setup;
    struct beam_drive drive = {0};
    struct link_download d = {0};
    uint64_t taken = 0;
    struct link_stream stream = {.live = take, .context = &taken};
    size_t packet;
    uint8_t what = n > 0 ? data[0] : 0;
    static int fds[2]; /* one end is always ready to be written to */
    if (n < 2 || (fds[1] == 0 && pipe(fds) != 0))
        return 0;
    port.fd = fds[1];
    next = data + 1;
    end = data + n;
    memset(&link, 0, sizeof link);
    link.port = &port;
    xcp_begin(&link.xcp, &port);
    link.xcp.timeout_ms = 1;
    link.xcp.busy_ms = 0;
    link.largest = link.block = 240;
    if ((what & 1) != 0)
        check(xcp_connect(&link.xcp, &packet, &err), &err);
    if ((what & 2) != 0)
        check(link_read_info(&link, &err), &err);
    if ((what & 4) != 0)
        check(link_unlock(&link, &key, "key", &err), &err);
    if ((what & 8) != 0)
        check(link_start_stream(&link, 1, &stream, &err), &err);
    if ((what & 16) != 0)
        check(link_read_setup(&link, &setup, &err), &err);
    if ((what & 32) != 0)
        check(link_start_drive(&link, &drive, &err), &err);
    if ((what & 64) != 0)
        check(link_upload(&link, BEAM_WIRE_PAGE_ACTIVE, &image, &err), &err);
    if ((what & 128) != 0) {
        target_image_sign(&image, &key, link.info.device, UINT32_MAX);
        check(link_download(&link, &image, &d, &err), &err);
    }
    for (int i = 0; i < 20; i++)
        check(link_run_stream(&link, 0, &err), &err);
    if (taken < stream.samples) /* more were taken when an attempt to start had to be repeated: its count began anew */
        abort();
    return 0;
}
