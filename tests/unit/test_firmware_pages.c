/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A new model: taken when everything is right, and otherwise nothing is changed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <cmocka.h>
#include "firmware_rig.h"

static struct beam_image_file first, second;

/* Power-on with a blank flash, a first signed image running, a session unlocked. */
static int set_up(void **state)
{
    (void)state;
    board_reset();
    rig_boot();
    rig_switches = 0;
    rig_image(&first, 1.25F, 5);
    rig_image(&second, 0.75F, 9);
    return rig_connect() == 0 && rig_unlock() == 0 && rig_download(&first) == 0 && rig_active_is(&first) ? 0 : -1;
}

static void test_download_runs_next(void **state)
{
    (void)state;
    assert_int_equal(rig_switches, 1);
    struct beam_info info = rig_info();
    assert_int_equal(info.running, BEAM_BOOT_DOWNLOADED);
    assert_int_equal(info.counter, 5);
    assert_int_equal(info.stored, 0);
    rig_run(300);
    assert_int_equal(rig_download(&second), 0);
    assert_true(rig_active_is(&second));
    rig_run(1);
    assert_int_equal(app.latest.status >> BEAM_LIVE_COUNTER, 9);
    assert_false(app.latest.status & BEAM_LIVE_BUILT_IN);

    uint8_t packet[BEAM_WIRE_MAX_PACKET] = {BEAM_XCP_GET_CAL_PAGE, 1, 0};
    assert_int_equal(rig_command(packet, 3), 0); /* the ECU's page is always 0 */
    assert_int_equal(packet[3], 0);
    struct beam_image_file back;
    assert_int_equal(rig_read(BEAM_WIRE_IMAGE, sizeof back, &back), 0); /* XCP's access went with the image */
    assert_memory_equal(&back, &second, sizeof back);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_read(BEAM_WIRE_IMAGE, sizeof back, &back), 0); /* the old one's memory is staged now */
    assert_memory_equal(&back, &first, sizeof back);
}

/* Refused with this fault, and nothing has changed. */
static void refuse(const struct beam_image_file *file, enum beam_image_fault fault)
{
    const uint64_t switches = rig_switches;
    const uint32_t refused = app.pages.refused;
    assert_int_equal(rig_download(file), BEAM_XCP_ERR_PAGE_NOT_VALID);
    assert_int_equal(app.pages.fault, fault);
    assert_int_equal(app.pages.refused, refused + 1);
    assert_int_equal(rig_switches, switches);
    assert_true(rig_active_is(&first));
}

static void test_refusals(void **state)
{
    struct beam_image_file file = second;
    (void)state;
    file.front.header.magic ^= 1u;
    refuse(&file, BEAM_IMAGE_BAD_MAGIC);
    file = second;
    file.front.header.layout++;
    refuse(&file, BEAM_IMAGE_BAD_LAYOUT);
    file = second;
    file.front.header.length -= 4;
    refuse(&file, BEAM_IMAGE_BAD_LENGTH);
    file = second;
    file.numbers.phi[3][1] += 1e-3F;
    refuse(&file, BEAM_IMAGE_BAD_CRC);
    file = second;
    file.front.header.device[11] ^= 1u;
    refuse(&file, BEAM_IMAGE_FOREIGN_DEVICE);
    refuse(&first, BEAM_IMAGE_OLD_COUNTER); /* replayed */
    file = second;
    rig_sign(&file, board.key, 4);
    refuse(&file, BEAM_IMAGE_OLD_COUNTER);
    file = second;
    rig_sign(&file, (const uint8_t[32]){0}, 9);
    refuse(&file, BEAM_IMAGE_BAD_CODE);
    file = second;
    file.front.setup.noise_rms = NAN;
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_BAD_SETUP);
    file = second;
    file.counts.n_uses = 1;
    file.front.use[0].effect = 0x12345678;
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_UNKNOWN_EFFECT);
    file = second;
    file.numbers.row[0][0] = NAN;
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_BAD_PLAN);
    file = second;
    file.numbers.phi[2][0] += 0.5F; /* unstable */
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_BAD_PLAN);
    file = second;
    file.numbers.dt_s = 0.00101F;
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_BAD_RATE);
    file = second;
    file.front.setup.proof[2] = nextafterf(file.front.setup.proof[2], 1.0F);
    rig_sign(&file, board.key, 9);
    refuse(&file, BEAM_IMAGE_BAD_PROOF);
    assert_int_equal(rig_download(&second), 0); /* and the next good one is taken */
}

/* One bit of every byte of the staged image. */
static void test_every_byte_tampered(void **state)
{
    (void)state;
    assert_int_equal(rig_download(&second), 0);
    first = second; /* what must stay */
    rig_image(&second, 2.0F, 10);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_write(BEAM_WIRE_IMAGE, sizeof second, &second), 0);
    uint64_t tried = 0;
    for (uint32_t i = 0; i < BEAM_IMAGE_BYTES; i++, tried++) {
        uint8_t *byte = (uint8_t *)&second + i;
        const uint8_t was = *byte;
        *byte = (uint8_t)(was ^ 1u << i % 8);
        beam_image_write(pages_staging(&app.pages), i, 1, byte);
        assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), BEAM_XCP_ERR_PAGE_NOT_VALID);
        *byte = was;
        beam_image_write(pages_staging(&app.pages), i, 1, byte);
    }
    assert_true(rig_active_is(&first));
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), 0);
    print_message("tampered: %lu images, 0 taken\n", (unsigned long)tried);
}

/* An attacker who also mends the CRC still lacks the code. */
static void test_every_word_tampered_with_its_sum(void **state)
{
    (void)state;
    for (uint32_t i = 64; i < BEAM_IMAGE_BYTES - 32; i += 4) {
        struct beam_image_file file = second;
        uint8_t *bytes = (uint8_t *)&file;
        bytes[i] ^= 1u;
        file.front.header.crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - 96, bytes + 64);
        beam_image_write(pages_staging(&app.pages), 0, BEAM_IMAGE_BYTES, bytes);
        assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), BEAM_XCP_ERR_PAGE_NOT_VALID);
        assert_int_equal(app.pages.fault, BEAM_IMAGE_BAD_CODE);
    }
    assert_true(rig_active_is(&first));
}

/* The bytes of a whole session's download, cut after each one; then the cable is back and everything is repeated. */
static void test_download_cut_at_every_byte(void **state)
{
    static uint8_t bytes[16384];
    size_t n = 0;
    uint8_t packet[BEAM_WIRE_MAX_PACKET] = {BEAM_XCP_SET_CAL_PAGE, 2, 0, 1};
    (void)state;
    n += rig_frame(packet, 4, bytes);
    for (uint32_t done = 0; done < sizeof second;) {
        const uint32_t count = sizeof second - done < 240 ? (uint32_t)sizeof second - done : 240;
        memcpy(packet, (uint8_t[]){BEAM_XCP_SHORT_DOWNLOAD, (uint8_t)count, 0, 0}, 4);
        xcp_put(4, BEAM_WIRE_IMAGE + done, packet + 4);
        memcpy(packet + 8, (const uint8_t *)&second + done, count);
        n += rig_frame(packet, (uint16_t)(8 + count), bytes + n);
        done += count;
    }
    memcpy(packet, (uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 1, 0, 1}, 4);
    n += rig_frame(packet, 4, bytes + n);
    const uint64_t switches = rig_switches, checked = rig_checked;
    for (size_t cut = 0; cut < n; cut++) {
        queue_put(&board.to_board, cut, bytes);
        rig_turns((int)(cut / 2) + 200);
        rig_run(4);
        assert_int_equal(rig_switches, switches);
        while (rig_next(packet) > 0)
            ;
        board.time_us += 60000; /* the line was silent */
        assert_int_equal(rig_connect(), 0);
        assert_int_equal(rig_unlock(), 0);
    }
    assert_true(rig_active_is(&first));
    assert_int_equal(rig_download(&second), 0);
    assert_true(rig_active_is(&second));
    print_message("download: %lu cuts, 0 models lost, %lu samples\n", (unsigned long)n,
                  (unsigned long)(rig_checked - checked));
}

static void test_locked_and_protected(void **state)
{
    (void)state;
    assert_int_equal(rig_connect(), 0); /* locks */
    const uint8_t byte = 1;
    assert_int_equal(rig_write(BEAM_WIRE_IMAGE, 1, &byte), BEAM_XCP_ERR_WRITE_PROTECTED); /* page 0 */
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_write(BEAM_WIRE_IMAGE, 1, &byte), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(RIG(BEAM_XCP_COPY_CAL_PAGE, 0, 0, 0, 1), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(RIG(BEAM_XCP_COPY_CAL_PAGE, 0, 1, 0, 0), BEAM_XCP_ERR_WRITE_PROTECTED);
    assert_int_equal(RIG(BEAM_XCP_COPY_CAL_PAGE, 0, 0, 0, 1), 0);
    struct beam_image_file back;
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_read(BEAM_WIRE_IMAGE, sizeof back, &back), 0);
    assert_memory_equal(&back, &first, sizeof back);
}

/* A switch that nobody waits for any more: SYNCH gives it up; a repeated question is answered once. */
static void test_switch_given_up(void **state)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    (void)state;
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_write(BEAM_WIRE_IMAGE, sizeof second, &second), 0);
    uint64_t given_up = 0;
    for (int turns = 4; turns < 60; turns++) {
        const uint64_t switches = rig_switches;
        memcpy(packet, (uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 1, 0, 1}, 4);
        rig_send(packet, 4);
        for (int t = 0; t < turns; t++) {
            rig_turns(1);
            if (t % RIG_TURNS == 0)
                rig_tick();
        }
        if (rig_switches > switches)
            break;
        memcpy(packet, (uint8_t[]){BEAM_XCP_GET_STATUS}, 1);
        assert_int_equal(rig_command(packet, 1), BEAM_XCP_ERR_CMD_BUSY);
        if (rig_switches > switches)
            break;
        memcpy(packet, (uint8_t[]){BEAM_XCP_SYNCH}, 1);
        const int answer = rig_command(packet, 1);
        if (answer == 0) /* the switch was faster */
            break;
        assert_int_equal(answer, 0x100);
        rig_run(20);
        assert_int_equal(rig_next(packet), 0);
        assert_int_equal(rig_switches, switches);
        assert_true(rig_active_is(&first));
        given_up++;
    }
    assert_true(given_up > 5);
    if (!rig_active_is(&second)) {
        rig_send((uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 1, 0, 1}, 4);
        rig_send((uint8_t[]){BEAM_XCP_SET_CAL_PAGE, 1, 0, 1}, 4); /* an impatient host */
        assert_int_equal(rig_await(packet, 100, NULL), 1);
        assert_int_equal(packet[0], BEAM_XCP_RES);
        rig_run(20);
        assert_int_equal(rig_next(packet), 0);
    }
    assert_true(rig_active_is(&second));
}

static uint32_t slow_step(void)
{
    return app.pages.phase == PAGES_PROOF ? 760 * app.pages.scratch.proof.progress : 0;
}

/* A step that takes more than its share of the interval is found out in the proof run; so is one that finds no time. */
static void test_slow_model(void **state)
{
    (void)state;
    board.further = slow_step;
    refuse(&second, BEAM_IMAGE_TOO_SLOW);
    assert_int_equal(app.pages.slow_steps, PAGES_SLOW_STEPS_MAX);
    board.further = NULL;
    board.cost = 400;
    refuse(&second, BEAM_IMAGE_TOO_SLOW);
    board.cost = 0;
    assert_int_equal(rig_download(&second), 0);
}

/* The bound alone, before any step of it: what the clock leaves is one instruction too few, or enough. */
static void test_bound(void **state)
{
    (void)state;
    const uint32_t bound = beam_step_bound(&pages_active(&app.pages)->plan);
    struct beam_info info = rig_info();
    assert_int_equal(info.step_bound, bound);
    assert_int_equal(info.core_Hz, 168000000);
    assert_int_equal(info.step_budget, 168000000 / 2000 - BEAM_IMAGE_INTERRUPT);
    board.facts.core_Hz = 2000 * (bound + BEAM_IMAGE_INTERRUPT) - 2;
    refuse(&second, BEAM_IMAGE_TOO_SLOW);
    assert_int_equal(rig_info().step_budget, bound - 1);
    board.facts.core_Hz += 2;
    assert_int_equal(rig_download(&second), 0);

    assert_int_equal(RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0), 0); /* stored: a board with a slower clock does not start it */
    rig_run(400);
    rig_boot();
    assert_true(rig_active_is(&second));
    board.facts.core_Hz -= 2;
    rig_boot();
    assert_int_equal(rig_connect(), 0);
    info = rig_info();
    assert_int_equal(info.running, BEAM_BOOT_BUILT_IN);
    assert_int_equal(info.last_fault, BEAM_IMAGE_TOO_SLOW);
}

static uint32_t one_long_step(void)
{
    return app.pages.phase == PAGES_PROOF && app.pages.scratch.proof.progress > 100 ? 313 : 0;
}

/* The longest step of the proof run is kept with the image that it belongs to. */
static void test_longest_step(void **state)
{
    (void)state;
    board.further = one_long_step;
    assert_int_equal(rig_download(&second), 0);
    board.further = NULL;
    assert_int_equal(rig_info().proof_us, 313);
    rig_image(&first, 1.5F, 11);
    assert_int_equal(rig_download(&first), 0);
    assert_int_equal(rig_info().proof_us, 0);
}

static void test_a_hundred_downloads_while_streaming(void **state)
{
    (void)state;
    assert_int_equal(RIG(BEAM_XCP_FREE_DAQ), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_DAQ, 0, 1, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_ODT, 0, 0, 0, 1), 0);
    assert_int_equal(RIG(BEAM_XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 1), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_DAQ_PTR, 0, 0, 0, 0, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_WRITE_DAQ, 0xFF, sizeof(struct beam_live), 0, 0, 0, 2, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_DAQ_LIST_MODE, 0x10, 0, 0, 0, 0, 1, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_START_STOP_DAQ_LIST, 1, 0, 0), 0);
    const uint64_t switches = rig_switches, checked = rig_checked;
    for (uint32_t i = 0; i < 100; i++) {
        struct beam_image_file file;
        rig_image(&file, 1.0F + 0.01F * (float)i, 100 + i);
        assert_int_equal(rig_download(&file), 0);
        assert_true(rig_active_is(&file));
    }
    const struct beam_info info = rig_info();
    assert_int_equal(info.overrun, 0);
    assert_int_equal(info.missed, 0);
    assert_int_equal(rig_switches - switches, 100);
    print_message("downloads while streaming: 100, samples %lu, missed 0\n", (unsigned long)(rig_checked - checked));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_download_runs_next, set_up),
        cmocka_unit_test_setup(test_refusals, set_up),
        cmocka_unit_test_setup(test_every_byte_tampered, set_up),
        cmocka_unit_test_setup(test_every_word_tampered_with_its_sum, set_up),
        cmocka_unit_test_setup(test_download_cut_at_every_byte, set_up),
        cmocka_unit_test_setup(test_locked_and_protected, set_up),
        cmocka_unit_test_setup(test_switch_given_up, set_up),
        cmocka_unit_test_setup(test_slow_model, set_up),
        cmocka_unit_test_setup(test_bound, set_up),
        cmocka_unit_test_setup(test_longest_step, set_up),
        cmocka_unit_test_setup(test_a_hundred_downloads_while_streaming, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
