/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The controller's image code, in the controller's arithmetic: pages, and the sliced proof run. test_beam_image_check.c has the checks. */
#include "beam_image_rig.h"

/* ---- Bytes ---- */

static void crc_is_zlibs(void **state)
{
    const uint8_t nine[] = "123456789";
    (void)state;
    assert_int_equal(beam_crc32(0, 9, nine), 0xCBF43926u);
    assert_int_equal(beam_crc32(beam_crc32(0, 4, nine), 5, nine + 4), 0xCBF43926u);
    assert_int_equal(beam_crc32(0, 0, nine), 0);
    for (int trial = 0; trial < 64; trial++) { /* against the bit by bit definition */
        uint8_t bytes[32];
        uint32_t crc = ~0u;
        for (int i = 0; i < 32; i++) {
            bytes[i] = (uint8_t)(trial * 37 + i * i * 11);
            crc ^= bytes[i];
            for (int bit = 0; bit < 8; bit++)
                crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
        }
        assert_int_equal(beam_crc32(0, 32, bytes), ~crc);
    }
}

static void effects_have_different_crcs(void **state)
{
    (void)state;
    for (int a = 0; a < beam_effects_count; a++)
        for (int b = 0; b < a; b++)
            assert_int_not_equal(crc_of(beam_effects[a]->id), crc_of(beam_effects[b]->id));
}

static void a_page_is_one_row_of_bytes(void **state)
{
    static uint8_t whole[BEAM_IMAGE_BYTES], part[BEAM_IMAGE_BYTES];
    uint32_t random = 7;
    (void)state;
    assert_true(beam_image_read(&good, 0, BEAM_IMAGE_BYTES, whole));
    assert_memory_equal(whole, "BFMI", 4);
    assert_memory_equal(whole + 256, good.effect, 4);
    assert_memory_equal(whole + 260, &good.plan.use[0].channels, 4);
    assert_memory_equal(whole + 264, good.plan.use[0].p, 16);
    assert_memory_equal(whole + 448, &good.plan.n, 2 * BEAM_IMAGE_COUNTS);
    assert_memory_equal(whole + 448 + 2 * BEAM_IMAGE_COUNTS, &good.plan.x, 4 * BEAM_IMAGE_NUMBERS);
    assert_memory_equal(whole + BEAM_IMAGE_BYTES - 32, good.code, 32);
    assert_int_equal(beam_crc32(0, BEAM_IMAGE_BYTES - 64 - 32, whole + 64), good.front.header.crc32);
    for (int trial = 0; trial < 20000; trial++) {
        random = 1664525u * random + 1013904223u;
        const uint32_t offset = random % (BEAM_IMAGE_BYTES + 1);
        random = 1664525u * random + 1013904223u;
        const uint32_t n = (random >> 8) % (trial % 2 ? 300u : BEAM_IMAGE_BYTES - offset + 1);
        if (n > BEAM_IMAGE_BYTES - offset) {
            assert_false(beam_image_read(&good, offset, n, part));
            continue;
        }
        assert_true(beam_image_read(&good, offset, n, part));
        assert_memory_equal(part, whole + offset, n);
    }
    memset(&page, 0, sizeof page); /* and written back in pieces of 7 */
    for (uint32_t at = 0; at < BEAM_IMAGE_BYTES; at += 7) {
        const uint32_t n = BEAM_IMAGE_BYTES - at < 7 ? BEAM_IMAGE_BYTES - at : 7;
        assert_true(beam_image_write(&page, at, n, whole + at));
    }
    assert_true(beam_image_read(&page, 0, BEAM_IMAGE_BYTES, part));
    assert_memory_equal(part, whole, BEAM_IMAGE_BYTES);
}

static void nothing_outside_is_touched(void **state)
{
    uint8_t byte[8] = {0};
    (void)state;
    const uint32_t offsets[] = {BEAM_IMAGE_BYTES, BEAM_IMAGE_BYTES + 1, 0x80000000u, 0xFFFFFFFFu};
    for (int i = 0; i < 4; i++) {
        assert_false(beam_image_read(&page, offsets[i], 1, byte));
        assert_false(beam_image_write(&page, offsets[i], 8, byte));
    }
    assert_false(beam_image_write(&page, BEAM_IMAGE_BYTES - 7, 8, byte));
    assert_false(beam_image_write(&page, 1, 0xFFFFFFFFu, byte));
    assert_true(beam_image_write(&page, BEAM_IMAGE_BYTES, 0, byte));
    assert_memory_equal(&page, &good, sizeof page);
}

/* ---- The proof run ---- */

static void slices_give_the_same_proof(void **state)
{
    static const uint32_t slices[] = {1, 3, 99, 100, 1000};
    (void)state;
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    for (int i = 0; i < 5; i++) {
        int calls = 0;
        enum beam_image_fault fault = BEAM_IMAGE_FINE;
        for (proof.progress = 0; fault == BEAM_IMAGE_FINE && (calls == 0 || proof.progress < 100); calls++)
            fault = beam_image_prove(&page, slices[i], &proof);
        assert_int_equal(fault, BEAM_IMAGE_FINE);
        assert_int_equal(proof.progress, 100);
        assert_int_equal(calls, (100 + slices[i] - 1) / slices[i]);
    }
    float largest = 0.0F;
    for (int i = 0; i < BEAM_IMAGE_PROOFS; i++)
        largest = fmaxf(largest, fabsf(page.front.setup.proof[i]));
    assert_true(largest > 1e-3F); /* it proves something */
}

static void a_proof_that_differs_in_one_bit(void **state)
{
    (void)state;
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    for (int i = 0; i < 4 * BEAM_IMAGE_PROOFS; i++) {
        ((uint8_t *)page.front.setup.proof)[i] ^= 1;
        proof.progress = 0;
        assert_int_equal(beam_image_prove(&page, 100, &proof), BEAM_IMAGE_BAD_PROOF);
        ((uint8_t *)page.front.setup.proof)[i] ^= 1;
    }
    page.plan.x.row[0][0] *= 1.000001F; /* another plan gives other outputs */
    proof.progress = 0;
    assert_int_equal(beam_image_prove(&page, 100, &proof), BEAM_IMAGE_BAD_PROOF);
}

static void a_state_that_overflows_is_no_proof(void **state)
{
    (void)state;
    page.front.setup.proof_amplitude = 1e14F;
    for (int s = 0; s < BEAM_STATES; s++) {
        page.plan.x.gamma[0][s] = 1e18F;
        page.plan.x.row[0][s] = s % 2 ? 1e18F : -1e18F;
    }
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    proof.progress = 0;
    assert_int_equal(beam_image_prove(&page, 100, &proof), BEAM_IMAGE_BAD_PROOF);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crc_is_zlibs),
        cmocka_unit_test(effects_have_different_crcs),
        cmocka_unit_test(a_page_is_one_row_of_bytes),
        cmocka_unit_test_setup(nothing_outside_is_touched, fresh),
        cmocka_unit_test_setup(slices_give_the_same_proof, fresh),
        cmocka_unit_test_setup(a_proof_that_differs_in_one_bit, fresh),
        cmocka_unit_test_setup(a_state_that_overflows_is_no_proof, fresh),
    };
    return cmocka_run_group_tests(tests, make_good, NULL);
}
