/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the controller checks of an image before it runs it, in the controller's arithmetic and in that order. */
#include "beam_image_rig.h"

static void a_good_image_is_fine(void **state)
{
    (void)state;
    assert_int_equal(beam_image_header_check(&page, device), BEAM_IMAGE_FINE);
    assert_int_equal(beam_image_check(&page, dt_s()), BEAM_IMAGE_FINE);
    assert_int_equal(beam_image_check(&page, 0.0F), BEAM_IMAGE_FINE);
    proof.progress = 0;
    assert_int_equal(beam_image_prove(&page, 100, &proof), BEAM_IMAGE_FINE);
    assert_int_equal(proof.progress, 100);
    assert_ptr_equal(page.plan.use[0].effect, beam_effect_find("cubic_stiffness"));
}

static void the_header_is_checked_in_order(void **state)
{
    (void)state;
    uint8_t other[BEAM_IMAGE_DEVICE_BYTES];
    for (int i = 0; i < BEAM_IMAGE_DEVICE_BYTES; i++) {
        memcpy(other, device, sizeof other);
        other[i] ^= 1;
        assert_int_equal(beam_image_header_check(&page, other), BEAM_IMAGE_FOREIGN_DEVICE);
    }
    page.front.header.crc32 ^= 1;
    assert_int_equal(beam_image_header_check(&page, other), BEAM_IMAGE_BAD_CRC);
    page.front.header.length += 4;
    assert_int_equal(beam_image_header_check(&page, other), BEAM_IMAGE_BAD_LENGTH);
    page.front.header.layout++;
    assert_int_equal(beam_image_header_check(&page, other), BEAM_IMAGE_BAD_LAYOUT);
    page.front.header.magic ^= 0x20;
    assert_int_equal(beam_image_header_check(&page, other), BEAM_IMAGE_BAD_MAGIC);
}

static void every_changed_byte_of_the_body_is_seen(void **state)
{
    (void)state;
    for (uint32_t at = 64; at < BEAM_IMAGE_BYTES - 32; at++) {
        uint8_t byte;
        assert_true(beam_image_read(&page, at, 1, &byte));
        byte ^= (uint8_t)(1u << at % 8);
        assert_true(beam_image_write(&page, at, 1, &byte));
        assert_int_equal(beam_image_header_check(&page, device), BEAM_IMAGE_BAD_CRC);
        byte ^= (uint8_t)(1u << at % 8);
        assert_true(beam_image_write(&page, at, 1, &byte));
    }
    assert_int_equal(beam_image_header_check(&page, device), BEAM_IMAGE_FINE);
}

static void setups_out_of_range(void **state)
{
    (void)state;
    float *numbers = (float *)&page.front.setup; /* nine of them at its beginning */
    const float nan_ = nanf(""), bad[][4] = {
                                     [0] = {0.0F, nan_, INFINITY, -INFINITY}, /* sensor_V_per_code */
                                     [1] = {70000.0F, nan_, INFINITY, -70000.0F},
                                     [2] = {0.0F, nan_, INFINITY, -INFINITY}, /* drive_V_per_code */
                                     [3] = {70000.0F, nan_, INFINITY, -70000.0F},
                                     [4] = {0.0F, nan_, INFINITY, -1.0F}, /* noise_rms */
                                     [5] = {2.0F, nan_, INFINITY, 1.0F},  /* alarm_ratio above clear_ratio */
                                     [6] = {0.0F, nan_, 3.0F, -1.0F},     /* clear_ratio */
                                     [7] = {0.0F, nan_, INFINITY, -1.0F}, /* averaging_s */
                                     [8] = {0.6F, nan_, INFINITY, -0.6F}, /* clock_relative */
                                 };
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 4; j++) {
            numbers[i] = bad[i][j];
            assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
            numbers[i] = ((const float *)&good.front.setup)[i];
        }
    const uint32_t steps[] = {0, 1025, 0xFFFFFFFFu};
    for (int i = 0; i < 3; i++) {
        page.front.setup.proof_steps = steps[i];
        assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    }
    page.front.setup.proof_steps = 1024;
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    page.front.setup.proof_amplitude = INFINITY;
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    page.front.setup.proof_amplitude = 1.0F;
    page.front.setup.proof[3] = nan_;
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    page.front.setup.proof[3] = 0.0F;
}

/* What a holder of the key might sign: every number of setup, effects and plan, of every absurd size. */
static void absurd_numbers(void **state)
{
    const float bad[] = {1e-45F, -1e-45F, 1.17549421e-38F, 1e19F, -1e38F, INFINITY, -INFINITY, nanf("")};
    (void)state;
    for (size_t j = 0; j < sizeof bad / sizeof *bad; j++) {
        for (int i = 0; i < BEAM_IMAGE_LIMITS; i++) {
            memcpy((uint8_t *)&page.front.setup + beam_image_limits[i].offset, &bad[j], sizeof bad[j]);
            assert_int_equal(beam_image_setup_outside(&page.front.setup), i);
            assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
            page.front.setup = good.front.setup;
        }
        for (int i = 0; i < BEAM_IMAGE_NUMBERS; i++) {
            float *number = (float *)&page.plan.x + i;
            const float before = *number;
            *number = bad[j];
            assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
            *number = before;
        }
        for (int u = 0; u < BEAM_USES; u++)
            for (int p = 0; p < BEAM_EFFECT_PARAMETERS; p++) {
                page.plan.use[u].p[p] = bad[j];
                assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
                page.plan.use[u].p[p] = good.plan.use[u].p[p];
            }
    }
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    page.front.setup.drive_V_per_code = 1e38F;
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    page.front.setup = good.front.setup;
    page.front.setup.noise_rms = 70000.0F * page.front.setup.sensor_V_per_code; /* more than the converter can show */
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    page.front.setup.noise_rms = 0.005F * page.front.setup.sensor_V_per_code;
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
    page.front.setup = good.front.setup;
    page.front.setup.averaging_s = 2e4F; /* 2e7 samples: no longer counted in single precision */
    assert_int_equal(check(), BEAM_IMAGE_BAD_SETUP);
}

/* The processor's control word, as -ffast-math and some start-ups leave it; what was there comes back. */
static uint32_t flush_denormals(void)
{
#ifdef __arm__
    uint32_t before;
    __asm__ volatile("vmrs %0, fpscr" : "=r"(before));
    __asm__ volatile("vmsr fpscr, %0" : : "r"(before | 1u << 24));
    return before;
#else
    const uint32_t before = __builtin_ia32_stmxcsr();
    __builtin_ia32_ldmxcsr(before | 0x8040u);
    return before;
#endif
}

static void restore(uint32_t word)
{
#ifdef __arm__
    __asm__ volatile("vmsr fpscr, %0" : : "r"(word));
#else
    __builtin_ia32_ldmxcsr(word);
#endif
}

/* Denormal numbers flushed: a motion that dies away would end in other bits, long after the proof run. */
static void another_arithmetic_is_refused(void **state)
{
    (void)state;
    assert_true(beam_arithmetic_is_exact());
    const uint32_t before = flush_denormals();
    const bool exact = beam_arithmetic_is_exact();
    const enum beam_image_fault fault = check();
    restore(before);
    assert_false(exact);
    assert_int_equal(fault, BEAM_IMAGE_BAD_ARITHMETIC);
    assert_int_equal(check(), BEAM_IMAGE_FINE);
}

static void effects_that_are_not_there(void **state)
{
    (void)state;
    page.effect[0] ^= 1;
    assert_int_equal(check(), BEAM_IMAGE_UNKNOWN_EFFECT);
    page.effect[0] = crc_of("tip_mass"); /* known, but it has no law for the plan's port */
    assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
    page.effect[0] = good.effect[0];
    page.plan.n.n_uses = 2; /* the second is nobody */
    assert_int_equal(check(), BEAM_IMAGE_UNKNOWN_EFFECT);
    const beam_count counts[] = {-1, BEAM_USES + 1, INT16_MAX, INT16_MIN};
    for (int i = 0; i < 4; i++) {
        page.plan.n.n_uses = counts[i];
        assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
    }
    page.plan.n.n_uses = 1;
    page.plan.use[0].p[1] = nanf("");
    assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
}

static void plans_that_may_not_run(void **state)
{
    (void)state;
    float *numbers = (float *)&page.plan.x;
    for (int i = 0; i < BEAM_IMAGE_NUMBERS; i++) {
        const float before = numbers[i];
        numbers[i] = i % 2 ? nanf("") : INFINITY;
        assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
        numbers[i] = before;
    }
    for (int b = 0; b < page.plan.n.n_blocks; b++) {
        static const float growing[3][4] = {
            {1e-5F, 0.0F, 0.0F, 1e-5F}, {1e-5F, -0.3F, 0.3F, 1e-5F}, {-2.1F, 0, 0, -1.0F}};
        for (int i = 0; i < 3; i++) {
            memcpy(page.plan.x.phi[b], growing[i], sizeof growing[i]);
            assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
        }
        memcpy(page.plan.x.phi[b], good.plan.x.phi[b], sizeof growing[0]);
    }
    assert_int_equal(check(), BEAM_IMAGE_FINE);
    page.plan.n.n_outputs = 0;
    assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
    page.plan.n.n_outputs = 1;
    page.plan.n.n_inputs = 0;
    page.plan.n.drive_input = -1;
    assert_int_equal(check(), BEAM_IMAGE_BAD_PLAN);
}

static void hostile_counts(void **state)
{
    static const beam_count values[] = {-1, 0, 1, 2, 17, 63, 64, 65, 1000, INT16_MAX, INT16_MIN};
    (void)state;
    beam_count *counts = (beam_count *)&page.plan.n;
    for (int i = 0; i < BEAM_IMAGE_COUNTS; i++)
        for (size_t v = 0; v < sizeof values / sizeof *values; v++) {
            counts[i] = values[v];
            if (check() == BEAM_IMAGE_FINE) { /* then it may be run: the sanitizers look on */
                proof.progress = 0;
                (void)beam_image_prove(&page, 20, &proof);
            }
            counts[i] = ((const beam_count *)&good.plan.n)[i];
        }
}

static void the_sample_interval(void **state)
{
    (void)state;
    assert_int_equal(beam_image_check(&page, dt_s() * 1.0000005F), BEAM_IMAGE_FINE);
    assert_int_equal(beam_image_check(&page, dt_s() * 1.00001F), BEAM_IMAGE_BAD_RATE);
    assert_int_equal(beam_image_check(&page, dt_s() * 0.99999F), BEAM_IMAGE_BAD_RATE);
    page.front.setup.clock_relative = 1e-3F; /* the plan's interval is then the true one of a slower controller */
    assert_int_equal(beam_image_check(&page, dt_s()), BEAM_IMAGE_BAD_RATE);
    assert_int_equal(beam_image_check(&page, dt_s() / 1.001F), BEAM_IMAGE_FINE);
}

static void every_fault_has_its_own_text(void **state)
{
    (void)state;
    for (int a = BEAM_IMAGE_FINE; a <= BEAM_IMAGE_BAD_ARITHMETIC; a++)
        for (int b = BEAM_IMAGE_FINE; b < a; b++)
            assert_string_not_equal(beam_image_fault_text((enum beam_image_fault)a),
                                    beam_image_fault_text((enum beam_image_fault)b));
    assert_non_null(beam_image_fault_text((enum beam_image_fault)99));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_good_image_is_fine, fresh),
        cmocka_unit_test_setup(the_header_is_checked_in_order, fresh),
        cmocka_unit_test_setup(every_changed_byte_of_the_body_is_seen, fresh),
        cmocka_unit_test_setup(setups_out_of_range, fresh),
        cmocka_unit_test_setup(absurd_numbers, fresh),
        cmocka_unit_test_setup(another_arithmetic_is_refused, fresh),
        cmocka_unit_test_setup(effects_that_are_not_there, fresh),
        cmocka_unit_test_setup(plans_that_may_not_run, fresh),
        cmocka_unit_test_setup(hostile_counts, fresh),
        cmocka_unit_test_setup(the_sample_interval, fresh),
        cmocka_unit_test(every_fault_has_its_own_text),
    };
    return cmocka_run_group_tests(tests, make_good, NULL);
}
