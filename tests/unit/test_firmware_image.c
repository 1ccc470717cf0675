/* SPDX-License-Identifier: GPL-3.0-or-later */
/* beam_image_file.h: the controller's own checks and steps behind plain bytes, on the built-in image. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_image_file.h"
#include "built_in.h"

static const float dt_s = 0.001F;
static struct beam_image_file file;
static struct beam_image_run *run;

static int make_run(void **state)
{
    (void)state;
    memcpy(&file, built_in_image, sizeof file);
    run = malloc(beam_image_run_bytes());
    return run ? 0 : -1;
}

static int free_run(void **state)
{
    (void)state;
    free(run);
    return 0;
}

static enum beam_image_fault checked(const uint8_t device[BEAM_IMAGE_DEVICE_BYTES])
{
    beam_image_run_load(run, &file);
    return beam_image_run_check(run, device, dt_s);
}

static void the_built_in_image_passes_for_its_own_device_only(void **state)
{
    uint8_t other[BEAM_IMAGE_DEVICE_BYTES];
    (void)state;
    memcpy(other, file.front.header.device, sizeof other);
    assert_int_equal(checked(NULL), BEAM_IMAGE_FINE);
    assert_int_equal(checked(other), BEAM_IMAGE_FINE);
    other[0] ^= 1u;
    assert_int_equal(checked(other), BEAM_IMAGE_FOREIGN_DEVICE);
    assert_int_equal(beam_image_run_header(run, other), BEAM_IMAGE_FOREIGN_DEVICE);
    assert_int_equal(beam_image_run_header(run, NULL), BEAM_IMAGE_FINE);
}

static void a_changed_byte_fails_the_header_and_a_changed_plan_the_check(void **state)
{
    (void)state;
    file.numbers.row[0][0] *= 1.5F;
    assert_int_equal(checked(NULL), BEAM_IMAGE_BAD_CRC);
    assert_int_equal(beam_image_run_header(run, NULL), BEAM_IMAGE_BAD_CRC);
    file.front.header.crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - 96, (const uint8_t *)&file + 64);
    assert_int_equal(checked(NULL), BEAM_IMAGE_BAD_PROOF);
    file.front.header.magic ^= 1u;
    assert_int_equal(checked(NULL), BEAM_IMAGE_BAD_MAGIC);
}

static void sealing_proves_a_changed_plan_and_refuses_an_impossible_one(void **state)
{
    (void)state;
    file.numbers.row[0][0] *= 1.5F;
    assert_int_equal(beam_image_run_seal(run, &file, dt_s), BEAM_IMAGE_FINE);
    assert_int_equal(checked(NULL), BEAM_IMAGE_FINE);
    assert_memory_not_equal(&file, built_in_image, sizeof file);
    assert_int_equal(beam_image_run_seal(run, &file, 2.0F * dt_s), BEAM_IMAGE_BAD_RATE);
    file.counts.n_blocks = BEAM_BLOCKS + 1;
    assert_int_equal(beam_image_run_seal(run, &file, dt_s), BEAM_IMAGE_BAD_PLAN);
}

static void rest_and_steps_are_the_controller_s(void **state)
{
    struct beam_image page;
    struct beam_state beam;
    (void)state;
    assert_int_equal(checked(NULL), BEAM_IMAGE_FINE);
    memset(&page, 0, sizeof page);
    assert_true(beam_image_write(&page, 0, BEAM_IMAGE_BYTES, built_in_image));
    assert_int_equal(beam_image_check(&page, dt_s), BEAM_IMAGE_FINE);
    for (int round = 0; round < 2; round++) { /* the second from rest again */
        beam_image_run_rest(run);
        beam_reset(&page.plan, &beam);
        float moved = 0.0F;
        for (int k = 0; k < 500; k++) {
            const float u[BEAM_INPUTS] = {k < 20 ? 30.0F : 0.0F};
            float y = 0.0F, expected[BEAM_OUTPUTS];
            assert_int_equal(beam_image_run_step(run, u[0], &y), BEAM_OK);
            assert_int_equal(beam_step(&page.plan, &beam, u, expected), BEAM_OK);
            assert_memory_equal(&y, &expected[0], sizeof y);
            moved += y * y;
        }
        assert_true(moved > 0.0F);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(the_built_in_image_passes_for_its_own_device_only, make_run, free_run),
        cmocka_unit_test_setup_teardown(a_changed_byte_fails_the_header_and_a_changed_plan_the_check, make_run,
                                        free_run),
        cmocka_unit_test_setup_teardown(sealing_proves_a_changed_plan_and_refuses_an_impossible_one, make_run,
                                        free_run),
        cmocka_unit_test_setup_teardown(rest_and_steps_are_the_controller_s, make_run, free_run),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
