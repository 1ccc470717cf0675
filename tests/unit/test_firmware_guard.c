/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Who may drive and for how long; an alarm that nobody without the key silences; the latch, the pin, the event. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <cmocka.h>
#include "firmware_rig.h"

enum { DEAD_MAN = BEAM_DRIVE_DEAD_MAN_MS /* samples, at 1 kHz */ };

static uint8_t packet[BEAM_WIRE_MAX_PACKET];
static const struct beam_drive chirp = {.amplitude = 700.0F, .rate = 1u << 28, .generation = 1};

static int set_up(void **state)
{
    (void)state;
    board_reset();
    rig_boot();
    return rig_connect();
}

/* Largest distance of the D/A's code from zero over so many samples. */
static int driven(int samples)
{
    int largest = 0;
    for (int k = 0; k < samples; k++) {
        rig_run(1);
        const int off = abs((int)board.drive - 2048);
        largest = off > largest ? off : largest;
    }
    return largest;
}

static void start(uint32_t generation)
{
    struct beam_drive setting = chirp;
    setting.generation = generation;
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof setting, &setting), 0);
    assert_true(driven(100) > 600);
}

/* Every way to write it, whole or in pieces. */
static void test_nobody_drives_without_the_key(void **state)
{
    static const uint8_t ones[28] = {0, 0, 0x80, 0x3F, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    (void)state;
    for (uint32_t at = 0; at < 28; at++)
        for (uint32_t n = 1; n <= 28 - at; n++)
            assert_int_equal(rig_write(BEAM_WIRE_DRIVE + at, n, ones), BEAM_XCP_ERR_ACCESS_LOCKED);
    memcpy(packet, (uint8_t[]){BEAM_XCP_SET_MTA, 0, 0, 0, 0, 0, 4, 0}, 8);
    assert_int_equal(rig_command(packet, 8), 0);
    memcpy(packet, (uint8_t[]){BEAM_XCP_DOWNLOAD, 4, 1, 2, 3, 4}, 6);
    assert_int_equal(rig_command(packet, 6), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(driven(100), 0);
    struct beam_drive there;
    assert_int_equal(rig_read(BEAM_WIRE_DRIVE, sizeof there, &there), 0);
    assert_memory_equal(&there, &(struct beam_drive){0}, sizeof there);
}

static void ends(int stops)
{
    (void)driven(2);
    assert_int_equal(driven(500), 0);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_info().drive_stops, stops);
    struct beam_drive there;
    assert_int_equal(rig_read(BEAM_WIRE_DRIVE, sizeof there, &there), 0);
    assert_float_equal(there.amplitude, 0.0F, 0.0F);
}

/* CONNECT of anybody, DISCONNECT, a wrong key. */
static void test_a_drive_ends_with_its_session(void **state)
{
    const uint8_t wrong[32] = {0};
    (void)state;
    start(1);
    assert_int_equal(rig_connect(), 0);
    ends(1);
    start(2);
    assert_int_equal(RIG(BEAM_XCP_DISCONNECT), 0);
    ends(2);
    start(3);
    const float nothing = 0.0F; /* bytes of the next drive that is not started do not hide the one that runs */
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, 4, &nothing), 0);
    assert_int_equal(rig_connect(), 0);
    ends(3);
    assert_int_equal(rig_unlock_with(wrong), BEAM_XCP_ERR_ACCESS_LOCKED);
    (void)driven(300);
    assert_int_equal(rig_connect(), 0);
    start(4);
    struct beam_drive again = chirp;
    again.generation = 5;
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof again, &again), 0); /* pending when the session ends */
    assert_int_equal(rig_connect(), 0);
    ends(4);
}

/* The client is gone, its cable cut: the drive lasts as long as its dead-man time, and a word now and then renews it. */
static void test_dead_man(void **state)
{
    (void)state;
    start(1);
    for (int i = 0; i < 5; i++) {
        assert_true(driven(DEAD_MAN - 200) > 600);
        assert_int_equal(RIG(BEAM_XCP_GET_STATUS), 0);
    }
    assert_true(driven(DEAD_MAN - 50) > 600);
    int last = 0;
    for (int k = 1; k <= 200; k++)
        last = driven(1) > 0 ? k : last;
    assert_true(last < 100);
    assert_int_equal(driven(1000), 0);
    assert_int_equal(RIG(BEAM_XCP_GET_STATUS), 0); /* the session lives on; it may start another */
    assert_int_equal(rig_info().drive_stops, 1);
    start(9);
    const uint8_t half[] = {6, 0, 0}; /* bytes that are no command do not renew it */
    for (int i = 0; i < 40; i++) {
        queue_put(&board.to_board, sizeof half, half);
        (void)driven(DEAD_MAN / 20);
    }
    assert_int_equal(driven(1000), 0);
}

/* The line's noise is not the beam's: the rig's codes are hundreds of times the noise, so the model is wrong. */
static void alarm_comes(void)
{
    rig_run(1500);
    assert_true(app.latest.status & BEAM_LIVE_ALARM);
}

/* Resting the model every 0.7 s left 11 of 1410 samples alarmed. */
static void test_nobody_silences_the_alarm_without_the_key(void **state)
{
    struct beam_drive rest = {.flags = BEAM_DRIVE_REST};
    const uint32_t zero = 0;
    int alarmed = 0, samples = 0;
    (void)state;
    alarm_comes();
    for (int i = 0; i < 4; i++) {
        rest.generation++;
        assert_int_equal(rig_connect(), 0);
        assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof rest, &rest), BEAM_XCP_ERR_ACCESS_LOCKED);
        assert_int_equal(rig_write(BEAM_WIRE_LATCH, sizeof zero, &zero), BEAM_XCP_ERR_ACCESS_LOCKED);
        assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), BEAM_XCP_ERR_ACCESS_LOCKED);
        assert_int_equal(RIG(BEAM_XCP_COPY_CAL_PAGE, 0, 0, 0, 1), BEAM_XCP_ERR_ACCESS_LOCKED);
        assert_int_equal(RIG(BEAM_XCP_DISCONNECT), 0);
        for (int k = 0; k < 700; k++, samples++) {
            rig_run(1);
            alarmed += (app.latest.status & BEAM_LIVE_ALARM) != 0;
        }
    }
    assert_int_equal(alarmed, samples);
    assert_true(board.alarm);
    print_message("resting the model without the key: %d of %d samples alarmed\n", alarmed, samples);
}

static void test_latch(void **state)
{
    (void)state;
    struct beam_info info = rig_info();
    assert_int_equal(info.latched, 0);
    assert_int_equal(info.alarms + info.faults + info.latch_first + info.latch_last, 0);
    alarm_comes();
    info = rig_info();
    assert_int_equal(info.latched, BEAM_LIVE_ALARM);
    assert_int_equal(info.alarms, 1);
    assert_in_range(info.latch_first, 900, 1100); /* averaging_s after power-on */
    assert_int_equal(info.latch_last, info.latch_first);
    assert_true(info.sequence > info.latch_first);
    const uint32_t first = info.latch_first;

    static struct beam_image_file
        quiet; /* the same model, to which this is no noise at all: the alarm goes, the latch stays */
    struct beam_image_run *run = malloc(beam_image_run_bytes());
    memcpy(&quiet, built_in_image, sizeof quiet);
    quiet.front.setup.noise_rms = 600.0F * quiet.front.setup.sensor_V_per_code;
    assert_int_equal(beam_image_run_seal(run, &quiet, 0.001F), BEAM_IMAGE_FINE);
    free(run);
    rig_sign(&quiet, board.key, 3);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_download(&quiet), 0);
    rig_run(2000);
    assert_false(app.latest.status & BEAM_LIVE_ALARM);
    assert_false(board.alarm);
    assert_int_equal(rig_connect(), 0); /* a reconnect */
    info = rig_info();
    assert_int_equal(info.latched, BEAM_LIVE_ALARM);
    assert_int_equal(info.alarms, 1);
    assert_int_equal(info.latch_first, first);

    uint32_t word = 1;
    assert_int_equal(rig_write(BEAM_WIRE_LATCH, sizeof word, &word), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_write(BEAM_WIRE_LATCH, sizeof word, &word), 0);
    rig_run(2);
    assert_int_equal(rig_read(BEAM_WIRE_LATCH, sizeof word, &word), 0);
    assert_int_equal(word, 0);
    info = rig_info();
    assert_int_equal(info.latched + info.alarms + info.latch_first + info.latch_last, 0);
}

/* The watchdog hears of the board only while samples and the background loop both go on. */
static void test_signs_of_life(void **state)
{
    (void)state;
    rig_run(100);
    const unsigned before = board.lives;
    rig_run(50);
    assert_int_equal(board.lives - before, 50);
    rig_turns(1000); /* the converter is dead */
    assert_int_equal(board.lives - before, 50);
    for (int k = 0; k < 50; k++) /* the background loop hangs */
        rig_tick();
    assert_int_equal(board.lives - before, 50);
}

/* Starts for each reason; memory that a power-on filled with anything counts as none. */
static void test_starts_are_counted(void **state)
{
    static const uint8_t reasons[] = {BEAM_RESET_FAULT, BEAM_RESET_WATCHDOG, BEAM_RESET_PIN, BEAM_RESET_FAULT};
    uint32_t wanted[BEAM_RESETS] = {1, 0, 0, 0};
    (void)state;
    for (uint32_t garbage = 0; garbage < 64; garbage++) {
        for (uint32_t i = 0; i < BOARD_KEPT_WORDS; i++)
            board.kept[i] = garbage < 2 ? 0u - garbage : (garbage * 2654435761u) >> i;
        board.facts.reset =
            BEAM_RESET_WATCHDOG; /* the supply sagged, and the reason of power is lost: no count is believed */
        rig_boot();
        assert_int_equal(rig_connect(), 0);
        assert_int_equal(rig_info().resets[BEAM_RESET_WATCHDOG], 1);
        assert_int_equal(rig_info().resets[BEAM_RESET_FAULT], 0);
    }
    board.facts.reset = BEAM_RESET_POWER;
    rig_boot();
    for (size_t i = 0; i < sizeof reasons; i++) {
        board.facts.reset = reasons[i];
        wanted[reasons[i]]++;
        rig_boot();
        assert_int_equal(rig_connect(), 0);
        const struct beam_info info = rig_info();
        assert_int_equal(info.reset, reasons[i]);
        assert_memory_equal(info.resets, wanted, sizeof wanted);
    }
    board.facts.kept = NULL; /* a board that keeps nothing */
    rig_boot();
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_info().resets[BEAM_RESET_FAULT], 1);
    assert_int_equal(rig_info().resets[BEAM_RESET_PIN], 0);
}

/* The pin and the event follow what is on; a host that comes late is told. */
static void test_pin_and_event(void **state)
{
    uint16_t n = 0;
    (void)state;
    assert_false(board.alarm);
    while (rig_next(packet) > 0)
        ;
    for (int k = 0; k < 1500 && n == 0; k++) {
        rig_run(1);
        n = rig_next(packet);
    }
    assert_int_equal(n, 8);
    assert_memory_equal(packet, ((uint8_t[]){BEAM_XCP_EV, 0xFE, BEAM_EVENT_ALARM, 0, BEAM_LIVE_ALARM, 0, 0, 0}), 8);
    assert_true(board.alarm);
    assert_int_equal(board.alarm_changes, 1);
    rig_run(100);
    assert_int_equal(rig_next(packet), 0); /* once */
    assert_int_equal(RIG(BEAM_XCP_DISCONNECT), 0);
    rig_run(100);
    assert_int_equal(rig_next(packet), 0);
    assert_int_equal(rig_connect(), 0);
    rig_run(2);
    assert_int_equal(rig_next(packet), 8);
    assert_int_equal(packet[2], BEAM_EVENT_ALARM);
}

/* Two roles: the key that signs does not unlock, the one that unlocks does not sign. */
static void test_two_keys(void **state)
{
    static struct beam_image_file image;
    static uint8_t unlocking[32];
    (void)state;
    for (int i = 0; i < 32; i++)
        unlocking[i] = (uint8_t)(200 - 3 * i);
    board_reset();
    board.facts.session_key = unlocking;
    rig_image(&image, 0.75F, 4);
    rig_boot();
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock_with(board.key), BEAM_XCP_ERR_ACCESS_LOCKED);
    assert_int_equal(RIG(BEAM_XCP_GET_STATUS), -1); /* DISCONNECTED */
    rig_run(600);
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock_with(unlocking), 0);
    assert_int_equal(rig_download(&image), 0);
    assert_true(rig_active_is(&image));
    rig_sign(&image, unlocking, 5);
    assert_int_equal(rig_download(&image), BEAM_XCP_ERR_PAGE_NOT_VALID);
    assert_int_equal(rig_info().last_fault, BEAM_IMAGE_BAD_CODE);
    board_reset();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_nobody_drives_without_the_key, set_up),
        cmocka_unit_test_setup(test_a_drive_ends_with_its_session, set_up),
        cmocka_unit_test_setup(test_dead_man, set_up),
        cmocka_unit_test_setup(test_nobody_silences_the_alarm_without_the_key, set_up),
        cmocka_unit_test_setup(test_latch, set_up),
        cmocka_unit_test_setup(test_signs_of_life, set_up),
        cmocka_unit_test_setup(test_starts_are_counted, set_up),
        cmocka_unit_test_setup(test_pin_and_event, set_up),
        cmocka_unit_test_setup(test_two_keys, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
