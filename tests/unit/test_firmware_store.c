/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The store against power cuts at every operation of the flash and inside words, once and twice in a row. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include "firmware_rig.h"

static struct beam_image_file first, second, third;
static uint8_t before[RIG_SLOTS][RIG_SLOT_BYTES]; /* flash with `first` in a slot, `second` running and not stored */

enum { STORE_TICKS = 400 };

static bool store(void)
{
    if (RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0) != 0)
        return false;
    for (int i = 0; i < STORE_TICKS && app.store.phase != STORE_IDLE; i++)
        rig_run(1);
    return true;
}

static void boot_and_download(const struct beam_image_file *file)
{
    rig_boot();
    if (rig_connect() != 0 || rig_unlock() != 0 || rig_download(file) != 0)
        abort();
}

static int set_up(void **state)
{
    (void)state;
    board_reset();
    rig_image(&first, 1.25F, 5);
    rig_image(&second, 0.75F, 9);
    rig_image(&third, 0.5F, 12);
    boot_and_download(&first);
    return store() && app.store.stored == 5 ? 0 : -1;
}

static void test_store_and_boot(void **state)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    (void)state;
    rig_boot();
    assert_true(rig_active_is(&first));
    assert_int_equal(rig_connect(), 0);
    struct beam_info info = rig_info();
    assert_int_equal(info.running, BEAM_BOOT_SLOT_0);
    assert_int_equal(info.boots, 2);
    assert_int_equal(info.slot_state[0], STORE_VALID);
    assert_int_equal(info.slot_state[1], STORE_EMPTY);
    boot_and_download(&second);
    rig_send((uint8_t[]){BEAM_XCP_SET_REQUEST, 1, 0, 0}, 4);
    assert_int_equal(rig_await(packet, 10, NULL), 1);
    bool event = false;
    for (int i = 0; i < STORE_TICKS && !event; i++) {
        rig_run(1);
        while (rig_next(packet) > 0)
            event |= packet[0] == BEAM_XCP_EV && packet[1] == 0x03;
    }
    assert_true(event);
    rig_boot();
    assert_int_equal(app.running, BEAM_BOOT_SLOT_1);
    assert_true(rig_active_is(&second));
    boot_and_download(&third); /* the older slot is taken */
    assert_true(store());
    rig_boot();
    assert_int_equal(app.running, BEAM_BOOT_SLOT_0);
    assert_true(rig_active_is(&third));
}

/* Asked twice, as by a host that lost the answer: nothing is written again. */
static void test_store_twice(void **state)
{
    (void)state;
    boot_and_download(&second);
    assert_true(store());
    const uint64_t operations = board.operations;
    assert_true(store());
    assert_int_equal(board.operations, operations);
    rig_boot();
    assert_true(rig_active_is(&second));
}

/* Images that the store does not take, or that a boot does not. */
/* Erases that would stop the processor take place before sampling, but never of the slot whose image runs. */
static void test_erases_before_sampling(void **state)
{
    (void)state;
    board.stalls[0] = true; /* holds the newest image */
    board.stalls[1] = true;
    rig_boot();
    assert_true(rig_active_is(&first));
    assert_int_equal(board.stalled, 1);
    assert_true(board.stalls[0] && !board.stalls[1]);
    assert_int_equal(app.store.slot[1], STORE_EMPTY);
    boot_and_download(&second);
    assert_true(store());
    assert_int_equal(board.stalled, 1); /* the store itself had not to */
    rig_boot();                         /* now the other one is spare */
    assert_true(rig_active_is(&second));
    assert_int_equal(board.stalled, 2);
    assert_int_equal(app.store.slot[0], STORE_EMPTY);
    rig_boot();
    assert_true(rig_active_is(&second));
    assert_int_equal(board.stalled, 2);
}

static void test_what_is_not_booted(void **state)
{
    (void)state;
    boot_and_download(&second);
    assert_true(store());
    board.flash[1][700] ^= 4u; /* the newest is damaged */
    rig_boot();
    assert_true(rig_active_is(&first));
    assert_int_equal(app.store.slot[1], STORE_SPOILT);
    assert_int_equal(app.store.stored, 5);
    board.facts.device[0] ^= 1u; /* a flash from another board */
    rig_boot();
    assert_int_equal(app.running, BEAM_BOOT_BUILT_IN);
    assert_int_equal(app.pages.fault, BEAM_IMAGE_FOREIGN_DEVICE);
    assert_int_equal(app.store.stored, 0);
    board.facts.device[0] ^= 1u;
    board.facts.sample_mHz = 2000000; /* another rate: signed, so its counter stays, but it cannot run */
    rig_boot();
    assert_int_equal(app.running, BEAM_BOOT_BUILT_IN);
    assert_int_equal(app.store.stored, 5);
    board.facts.sample_mHz = 1000000;
    rig_boot();
    assert_true(rig_active_is(&first));
}

static void test_built_in_is_not_stored(void **state)
{
    (void)state;
    board_reset();
    rig_boot();
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0), BEAM_XCP_ERR_ACCESS_DENIED);
}

/* The hardware says no: reported, and the other slot stays. */
static void test_broken_flash(void **state)
{
    uint8_t packet[BEAM_WIRE_MAX_PACKET];
    (void)state;
    boot_and_download(&second);
    board.broken = true;
    rig_send((uint8_t[]){BEAM_XCP_SET_REQUEST, 1, 0, 0}, 4);
    assert_int_equal(rig_await(packet, 10, NULL), 1);
    rig_run(20);
    assert_int_equal(rig_next(packet), 8);
    assert_memory_equal(packet, ((uint8_t[]){BEAM_XCP_EV, 0xFE, BEAM_EVENT_STORE_FAILED, 0, 0, 0, 0, 0}), 8);
    struct beam_info info = rig_info();
    assert_true(info.nvm_errors > 0);
    assert_int_equal(info.stored, 5);
    rig_boot();
    assert_true(rig_active_is(&first));
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), BEAM_XCP_ERR_GENERIC); /* not counted: no seed that might come again */
}

/* The hardware says yes and does nothing: found by reading back. */
static void test_deaf_flash(void **state)
{
    (void)state;
    boot_and_download(&second);
    board.deaf = true;
    assert_true(store());
    assert_int_equal(app.store.stored, 5);
    assert_int_equal(app.store.slot[1], STORE_SPOILT);
    rig_boot();
    assert_true(rig_active_is(&first));
    assert_false(app.store.counted);
}

/* What is being written stays where it is until it is written. */
static void test_no_switch_while_storing(void **state)
{
    (void)state;
    boot_and_download(&second);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 2, 0, 1), 0);
    assert_int_equal(rig_write(BEAM_WIRE_IMAGE, sizeof third, &third), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0), 0);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), BEAM_XCP_ERR_CMD_BUSY);
    assert_int_equal(RIG(BEAM_XCP_SET_REQUEST, 1, 0, 0), BEAM_XCP_ERR_CMD_BUSY);
    uint8_t packet[BEAM_WIRE_MAX_PACKET] = {BEAM_XCP_GET_STATUS};
    assert_int_equal(rig_command(packet, 1), 0);
    assert_int_equal(packet[1], 1);
    rig_run(STORE_TICKS);
    assert_int_equal(app.store.stored, 9);
    assert_int_equal(RIG(BEAM_XCP_SET_CAL_PAGE, 1, 0, 1), 0);
    assert_true(rig_active_is(&third));
}

/* ---- Cuts ---- */

/* From power-on to the end of a store, or to the cut. Says whether the power was cut. */
static bool session(uint64_t cut_at, uint32_t tear)
{
    board.operations = 0;
    board.cut_at = cut_at;
    board.tear = tear;
    if (setjmp(board.cut) != 0)
        return true;
    boot_and_download(&second);
    store();
    return false;
}

static uint32_t random_word(uint32_t *x)
{
    *x = 1664525u * *x + 1013904223u;
    return *x ^ *x >> 15;
}

/* After any cut: the old or the new parameters, whole, and the old ones unless the store had been finished. */
static void judge(bool last)
{
    board.cut_at = 0;
    rig_boot();
    if (!rig_active_is(&first) && !(last && rig_active_is(&second)))
        fail_msg("after a cut neither the old nor the new image runs");
    rig_run(2);
}

static void test_power_cut_at_every_operation(void **state)
{
    uint32_t x = 1, boots = app.store.boots;
    uint64_t cuts = 0, switched = 0;
    (void)state;
    memcpy(before, board.flash, sizeof before);
    for (uint64_t at = 1;; at++) {
        bool was_cut = true;
        for (int variant = 0; variant < 4; variant++) { /* nothing, all, and some of the word */
            memcpy(board.flash, before, sizeof before);
            was_cut = session(at, variant == 0 ? UINT32_MAX : variant == 1 ? 0 : random_word(&x));
            if (!was_cut)
                break;
            cuts++;
            judge(true);
            switched += rig_active_is(&second);
            assert_true(app.store.boots > boots);
        }
        if (!was_cut)
            break;
    }
    assert_true(rig_active_is(&second));
    assert_true(switched > 0); /* the cut after the last bit of the record */
    print_message("power cuts: %lu, 0 images lost\n", (unsigned long)cuts);
}

/* The second cut in the session after the first, at operations all over it. */
static void test_power_cut_twice(void **state)
{
    uint32_t x = 7;
    uint64_t cuts = 0;
    (void)state;
    memcpy(before, board.flash, sizeof before);
    for (uint64_t at = 1; at < 1350; at += 3)
        for (int again = 0; again < 6; again++) {
            memcpy(board.flash, before, sizeof before);
            if (!session(at, random_word(&x)))
                break;
            if (!session(1 + random_word(&x) % (again < 2 ? 4 : 1350), random_word(&x)))
                continue;
            cuts += 2;
            judge(true);
        }
    print_message("power cuts twice in a row: %lu, 0 images lost\n", (unsigned long)cuts);
}

/* ---- Power-ons ---- */

static struct store opened;

/* Says whether the power was cut. */
static bool power_on(uint64_t cut_at, uint32_t tear)
{
    board.operations = 0;
    board.cut_at = cut_at;
    board.tear = tear;
    if (setjmp(board.cut) != 0)
        return true;
    store_open(&opened, &board.facts);
    return false;
}

/* The same power-on cut at each of its operations, and repeated; then without a cut. Counts only rise. */
static uint64_t power_on_with_cuts(uint32_t last, uint32_t *x)
{
    static uint8_t kept[RIG_SLOTS][RIG_SLOT_BYTES];
    uint64_t at = 1;
    memcpy(kept, board.flash, sizeof kept);
    for (; power_on(at, random_word(x)); at++) {
        assert_false(power_on(0, 0));
        assert_true(opened.counted);
        assert_true(opened.boots > last);
        memcpy(board.flash, kept, sizeof kept);
    }
    assert_true(opened.counted);
    assert_true(opened.boots > last);
    return at - 1;
}

/* Counted without a gap or a repetition over three rollovers of the log. */
static void test_power_ons_roll_over(void **state)
{
    enum { PER_LOG = 8 * (RIG_SLOT_BYTES - 4) };
    uint32_t last = 0, x = 3;
    uint64_t cuts = 0;
    (void)state;
    for (int log = 0; log < 3; log++) {
        memset(board.flash[2] + 4, 0, RIG_SLOT_BYTES - 4); /* nearly full: 40 bits left */
        memset(board.flash[2] + RIG_SLOT_BYTES - 4, 0xFF, 4);
        board.flash[2][RIG_SLOT_BYTES - 8] = 0xFF;
        for (int boot = 0; boot < 50; boot++) {
            cuts += power_on_with_cuts(last, &x);
            last = opened.boots;
        }
        assert_int_equal(last, PER_LOG * (log + 1) + 10);
        assert_int_equal(opened.slot[0], STORE_VALID);
    }
    print_message("power-ons counted across 3 rollovers: %lu cuts\n", (unsigned long)cuts);
}

/* The count of rollovers has an end; then no seeds are given. */
static void test_power_ons_end(void **state)
{
    (void)state;
    memset(board.flash[2], 0, RIG_SLOT_BYTES);
    memset(board.flash[0] + BEAM_IMAGE_BYTES + 16, 0, 4);
    store_open(&opened, &board.facts);
    assert_false(opened.counted);
    board.facts.nvm_slot_bytes = 4096;
    store_open(&opened, &board.facts);
    assert_false(opened.counted);
    assert_int_equal(opened.slot[0], STORE_SPOILT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_store_and_boot, set_up),
        cmocka_unit_test_setup(test_store_twice, set_up),
        cmocka_unit_test_setup(test_erases_before_sampling, set_up),
        cmocka_unit_test_setup(test_what_is_not_booted, set_up),
        cmocka_unit_test_setup(test_built_in_is_not_stored, set_up),
        cmocka_unit_test_setup(test_broken_flash, set_up),
        cmocka_unit_test_setup(test_deaf_flash, set_up),
        cmocka_unit_test_setup(test_no_switch_while_storing, set_up),
        cmocka_unit_test_setup(test_power_cut_at_every_operation, set_up),
        cmocka_unit_test_setup(test_power_cut_twice, set_up),
        cmocka_unit_test_setup(test_power_ons_roll_over, set_up),
        cmocka_unit_test_setup(test_power_ons_end, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
