/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The host's side of the line in one process with a stream running; the board is board_host, beside the program BEAMFIT. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "board/board.h"
#include "board/link.h"
#include "system/board.h"
#include "board/xcp_frame.h"
#include "board/xcp_master.h"

static const char key_text[32] = "beamfit test key, 32 bytes long";

struct rig {
    char dir[64];
    struct board board;
    struct line line;
    struct link link;
    struct device_key key;
    struct beam_image_file image; /* of the model that the board begins with, to be signed */
    struct bf_error err;
    /* of the stream */
    struct link_stream stream;
    uint32_t newest;
    uint64_t lost;
    uint8_t counter; /* of the model that the newest sample saw, lowest byte */
    float drawn;     /* largest input */
};

static void take(void *context, const struct beam_live *live)
{
    struct rig *rig = context;
    if (rig->stream.samples > 1)
        rig->lost += live->sequence - rig->newest - 1;
    rig->newest = live->sequence;
    rig->counter = (uint8_t)(live->status >> BEAM_LIVE_COUNTER);
    rig->drawn = fmaxf(rig->drawn, live->input);
}

static void assert_fine(const struct rig *rig, enum bf_status status)
{
    if (status != BF_OK)
        fail_msg("%s", rig->err.text);
}

static int setup(void **state)
{
    struct rig *rig = calloc(1, sizeof *rig);
    make_directory(rig->dir);
    write_key(rig->dir, "key", key_text);
    memcpy(rig->key.bytes, key_text, sizeof key_text);
    board_start(&rig->board, rig->dir, (const char *[]){"--key", "key", NULL});
    rig->stream = (struct link_stream){.live = take, .context = rig};
    *state = rig;
    return 0;
}

static int teardown(void **state)
{
    struct rig *rig = *state;
    link_close(&rig->link);
    line_stop(&rig->line);
    board_stop(&rig->board);
    remove_directory(rig->dir);
    free(rig);
    return 0;
}

static void open_link(struct rig *rig, const struct line_faults *faults)
{
    line_start(&rig->line, rig->board.port, faults);
    assert_fine(rig, link_open(rig->line.port, 921600, &rig->link, &rig->err));
    assert_fine(rig, link_upload(&rig->link, BEAM_WIRE_PAGE_ACTIVE, &rig->image, &rig->err));
    assert_fine(rig, link_unlock(&rig->link, &rig->key, "key", &rig->err));
}

static enum bf_status download(struct rig *rig, uint32_t counter)
{
    struct link_download d = {0};
    target_image_sign(&rig->image, &rig->key, rig->link.info.device, counter);
    return link_download(&rig->link, &rig->image, &d, &rig->err);
}

/* One model after the other under a stream that loses nothing, and a board that misses nothing. */
static void downloads_while_streaming(void **state)
{
    struct rig *rig = *state;
    enum { DOWNLOADS = 25 };
    open_link(rig, &(struct line_faults){.seed = 1});
    assert_fine(rig, link_start_stream(&rig->link, 1, &rig->stream, &rig->err));
    for (uint32_t i = 1; i <= DOWNLOADS; i++) {
        assert_fine(rig, download(rig, i));
        assert_int_equal(rig->link.info.counter, i);
        assert_int_equal(rig->link.info.stored, i);
        assert_fine(rig, link_run_stream(&rig->link, 100, &rig->err));
        assert_int_equal(rig->counter, i);
    }
    link_stop_stream(&rig->link);
    assert_fine(rig, link_read_info(&rig->link, &rig->err));
    assert_int_equal(rig->link.info.missed, 0);
    /* none on the line: the board says which found no room, the receiver what a pause of this machine broke in two */
    const uint64_t broken = rig->link.xcp.receiver.junk_bytes / xcp_frame_size(1 + sizeof(struct beam_live));
    assert_in_range(rig->lost, 0, rig->link.info.overrun + broken);
    assert_int_equal(rig->stream.crc_failures, 0);
    assert_true(rig->stream.samples > 100);
}

static void noise_both_ways_while_streaming(void **state)
{
    struct rig *rig = *state;
    open_link(rig, &(struct line_faults){.noise = 1e-3, .seed = 2});
    assert_fine(rig, link_start_stream(&rig->link, 1, &rig->stream, &rig->err));
    for (uint32_t i = 1; i <= 3; i++) {
        assert_fine(rig, download(rig, i));
        assert_int_equal(rig->link.info.counter, i);
        assert_int_equal(rig->link.info.stored, i);
    }
    assert_true(rig->stream.samples > 100);
    assert_true(rig->lost > 0);
    assert_true(rig->link.xcp.receiver.resyncs > 0 && rig->link.xcp.counts.repeats + rig->link.xcp.counts.synchs > 0);
    link_stop_stream(&rig->link);
    assert_fine(rig, link_read_info(&rig->link, &rig->err));
    assert_int_equal(rig->link.info.missed, 0);
    assert_int_equal(rig->link.info.refused, 0);
}

/* ---- Images that must not run, signed with the right key where a thief could not ---- */

static void seal(struct beam_image_file *image)
{
    const uint8_t *bytes = (const uint8_t *)image;
    const size_t from = sizeof image->front.header, to = offsetof(struct beam_image_file, code);
    image->front.header.crc32 = beam_crc32(0, (uint32_t)(to - from), bytes + from);
}

static void make_layout(struct rig *rig)
{
    rig->image.front.header.layout++;
}

static void make_setup(struct rig *rig)
{
    rig->image.front.setup.noise_rms = -1.0F;
    seal(&rig->image);
}

static void make_nan(struct rig *rig)
{
    rig->image.numbers.row[0][0] = NAN;
    seal(&rig->image);
}

static void make_unstable(struct rig *rig)
{
    for (int i = 0; i < 4; i++)
        rig->image.numbers.phi[0][i] *= 1.5F;
    seal(&rig->image);
}

static void make_proof(struct rig *rig)
{
    rig->image.front.setup.proof[3] *= 1.0000002F;
    seal(&rig->image);
}

static void make_crc(struct rig *rig)
{
    rig->image.front.header.crc32 ^= 1;
}

static void make_rate(struct rig *rig)
{
    rig->image.numbers.dt_s *= 1.01F;
    seal(&rig->image);
}

static void assert_refused(struct rig *rig, enum beam_image_fault fault)
{
    static struct beam_image_file before, after;
    const struct beam_image_file sent = rig->image;
    struct link_download d = {0};
    const uint32_t refused = rig->link.info.refused;
    assert_fine(rig, link_upload(&rig->link, BEAM_WIRE_PAGE_ACTIVE, &before, &rig->err));
    rig->image = sent;
    assert_int_equal(link_download(&rig->link, &rig->image, &d, &rig->err), BF_DEVICE);
    if (strstr(rig->err.text, beam_image_fault_text(fault)) == NULL)
        fail_msg("fault %d wanted: %s", (int)fault, rig->err.text);
    assert_int_equal(rig->link.info.refused, refused + 1);
    assert_fine(rig, link_upload(&rig->link, BEAM_WIRE_PAGE_ACTIVE, &after, &rig->err));
    assert_memory_equal(&before, &after, sizeof before);
}

static void bad_images_are_refused_in_words(void **state)
{
    struct rig *rig = *state;
    static const struct {
        void (*make)(struct rig *rig);
        enum beam_image_fault fault;
    } bad[] = {{make_layout, BEAM_IMAGE_BAD_LAYOUT}, {make_setup, BEAM_IMAGE_BAD_SETUP},
               {make_nan, BEAM_IMAGE_BAD_PLAN},      {make_unstable, BEAM_IMAGE_BAD_PLAN},
               {make_proof, BEAM_IMAGE_BAD_PROOF},   {make_crc, BEAM_IMAGE_BAD_CRC},
               {make_rate, BEAM_IMAGE_BAD_RATE}};
    open_link(rig, &(struct line_faults){.seed = 3});
    const struct beam_image_file good = rig->image;
    assert_fine(rig, download(rig, 1));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        rig->image = good;
        bad[i].make(rig);
        target_image_sign(&rig->image, &rig->key, rig->link.info.device, 2);
        assert_refused(rig, bad[i].fault);
    }
    rig->image = good; /* changed after it was signed; signed for another; signed with another key */
    target_image_sign(&rig->image, &rig->key, rig->link.info.device, 2);
    rig->image.code[31] ^= 0x80;
    assert_refused(rig, BEAM_IMAGE_BAD_CODE);
    target_image_sign(&rig->image, &rig->key, (const uint8_t *)"board_host_2", 2);
    assert_refused(rig, BEAM_IMAGE_FOREIGN_DEVICE);
    struct device_key other = rig->key;
    other.bytes[0] ^= 1;
    target_image_sign(&rig->image, &other, rig->link.info.device, 2);
    assert_refused(rig, BEAM_IMAGE_BAD_CODE);
    rig->image = good;
    assert_int_equal(download(rig, 1), BF_OK); /* it runs already */
    rig->image.front.header.model_sha256[0] ^= 1;
    assert_int_equal(download(rig, 1), BF_DEVICE); /* another one, with a counter that was used */
    assert_non_null(strstr(rig->err.text, "counter 1"));
    rig->image = good;
    assert_fine(rig, download(rig, 2));
}

/* ---- Memory ---- */

static void what_is_not_to_be_written_is_not(void **state)
{
    struct rig *rig = *state;
    const uint8_t bytes[4] = {1, 2, 3, 4};
    open_link(rig, &(struct line_faults){.seed = 4});
    assert_fine(rig, link_show_page(&rig->link, BEAM_WIRE_PAGE_ACTIVE, &rig->err));
    assert_int_equal(link_write(&rig->link, "a test", BEAM_WIRE_IMAGE, 4, bytes, &rig->err), BF_DEVICE);
    assert_int_equal(link_write(&rig->link, "a test", BEAM_WIRE_LIVE, 4, bytes, &rig->err), BF_DEVICE);
    assert_int_equal(link_write(&rig->link, "a test", BEAM_WIRE_INFO, 4, bytes, &rig->err), BF_DEVICE);
    assert_int_equal(link_write(&rig->link, "a test", 0x00F00000, 4, bytes, &rig->err), BF_DEVICE);
    assert_non_null(strstr(rig->err.text, "refused a test"));
    assert_fine(rig, link_read_info(&rig->link, &rig->err));
}

static void a_locked_board_takes_nothing(void **state)
{
    struct rig *rig = *state;
    struct link_download d = {0};
    open_link(rig, &(struct line_faults){.seed = 5});
    size_t packet;
    assert_fine(rig, xcp_connect(&rig->link.xcp, &packet, &rig->err)); /* locks */
    target_image_sign(&rig->image, &rig->key, rig->link.info.device, 1);
    assert_int_equal(link_download(&rig->link, &rig->image, &d, &rig->err), BF_DEVICE);
    assert_non_null(strstr(rig->err.text, "locked"));
}

static void a_drive_starts_and_is_read_back(void **state)
{
    struct rig *rig = *state;
    const struct beam_drive wanted = {.amplitude = 100.0F, .rate = 1u << 26, .sweep = 5, .period = 1000, .burst = 900};
    struct beam_drive now;
    open_link(rig, &(struct line_faults){.seed = 6});
    assert_fine(rig, link_start_drive(&rig->link, &wanted, &rig->err));
    assert_fine(rig, link_read_drive(&rig->link, &now, &rig->err));
    assert_memory_equal(&now, &wanted, offsetof(struct beam_drive, generation));
    assert_fine(rig, link_start_stream(&rig->link, 3, &rig->stream, &rig->err));
    for (int i = 0; i < 500 && rig->stream.samples < 100; i++)
        assert_fine(rig, link_run_stream(&rig->link, 20, &rig->err));
    assert_true(rig->stream.samples >= 100);
    assert_float_equal(rig->drawn, 100.0F * rig->image.front.setup.drive_V_per_code, 0.05F * rig->drawn);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(downloads_while_streaming),       CASE(noise_both_ways_while_streaming),
        CASE(bad_images_are_refused_in_words), CASE(what_is_not_to_be_written_is_not),
        CASE(a_locked_board_takes_nothing),    CASE(a_drive_starts_and_is_read_back),
    };
    return cmocka_run_group_tests_name("link", tests, NULL, NULL);
}
