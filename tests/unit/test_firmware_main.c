/* SPDX-License-Identifier: GPL-3.0-or-later */
/* main.c: boot, samples, end, on a board whose sample interrupt comes between two turns of the background loop. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "firmware_board.h"

int firmware_main(void); /* main() of firmware/main.c, as the build of board_host names it */

enum { TURNS = 200, MISSED = 3 };

static bool broken, sampling;
static int turns;

const struct board_facts *board_init(void)
{
    return broken ? NULL : &board.facts;
}

void board_start(void)
{
    assert_int_equal(turns, 0);
    sampling = true;
}

static void ask(uint16_t n, const uint8_t packet[], uint16_t counter)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME] = {0};
    memcpy(frame + BEAM_WIRE_HEADER, packet, n);
    queue_put(&board.to_board, sxi_close(frame, n, counter), frame);
}

/* The answer's n bytes behind the response's identifier. */
static void answer(uint16_t n, void *out)
{
    uint8_t frame[BEAM_WIRE_MAX_FRAME];
    const size_t body = BEAM_WIRE_HEADER + 1u + n + (1u + n) % 2u + BEAM_WIRE_TAIL;
    assert_int_equal(queue_take(&board.to_host, body, frame), body);
    assert_int_equal(frame[0] + 256 * frame[1], 1 + n);
    assert_int_equal(frame[BEAM_WIRE_HEADER], BEAM_XCP_RES);
    memcpy(out, frame + BEAM_WIRE_HEADER + 1, n);
}

bool board_idle(bool busy)
{
    (void)busy;
    assert_true(sampling);
    board.time_us += 1000;
    app_sample((uint16_t)(2045 + 7 * turns % 6)); /* a sensor that lives */
    if (turns < MISSED)
        app_missed(1);
    if (turns == TURNS / 2) {
        ask(2, (uint8_t[]){BEAM_XCP_CONNECT, 0}, 0);
        ask(8, (uint8_t[]){BEAM_XCP_SHORT_UPLOAD, sizeof(struct beam_live), 0, 0, 0, 0, BEAM_WIRE_LIVE >> 16, 0}, 1);
        ask(8, (uint8_t[]){BEAM_XCP_SHORT_UPLOAD, sizeof(struct beam_info), 0, 0, 0, 0, BEAM_WIRE_INFO >> 16, 0}, 2);
    }
    return ++turns < TURNS;
}

static int switch_on(void **state)
{
    (void)state;
    board_reset();
    broken = sampling = false;
    turns = 0;
    return 0;
}

static void a_broken_board_is_not_started(void **state)
{
    (void)state;
    broken = true;
    assert_int_equal(firmware_main(), 1);
    assert_false(sampling);
    assert_int_equal(turns, 0);
    assert_int_equal(board.operations, 0); /* no power-on is counted either */
}

static void it_samples_and_answers_until_power_down(void **state)
{
    (void)state;
    assert_int_equal(firmware_main(), 0);
    assert_true(sampling);
    assert_int_equal(turns, TURNS);
    uint8_t connected[7];
    struct beam_live live;
    struct beam_info info;
    answer(sizeof connected, connected);
    answer(sizeof live, &live);
    answer(sizeof info, &info);
    assert_in_range(live.sequence, TURNS / 2 + MISSED, TURNS + MISSED); /* what was missed is a gap in it */
    assert_int_equal(live.codes & 0xFFFFu, 2045 + 7 * (int)(live.sequence - MISSED) % 6);
    assert_int_equal(info.missed, MISSED);
    assert_int_equal(info.running, BEAM_BOOT_BUILT_IN);
    assert_in_range(board.operations, 1, 2); /* the power-on */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_broken_board_is_not_started, switch_on),
        cmocka_unit_test_setup(it_samples_and_answers_until_power_down, switch_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
