/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The bytes of an image: the plan in them, who may change them, files of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "target_image_rig.h"

/* ---- The bytes ---- */

/* Every number of the double plan is the float in the bytes, and both step alike. */
static void the_bytes_are_the_plan(void **state)
{
    static struct target_image image;
    (void)state;
    make("  - {kind: quadratic_drag}\n  - {kind: sensor_highpass}\n", &image);
    const struct beam_plan *p = &image.plan;
    const struct beam_image_file *f = &image.file;
    assert_int_equal(p->n.n_blocks, f->counts.n_blocks);
    assert_int_equal(p->n.n_ports, f->counts.n_ports);
    assert_int_equal(f->counts.n_ports, 8);
    assert_int_equal(f->counts.n_links[0], 1);
    assert_int_equal(p->n.link[0][0].tap, f->counts.link[0][0].tap);
    for (int b = 0; b < p->n.n_blocks; b++)
        for (int i = 0; i < 4; i++)
            assert_true(p->x.phi[b][i] == (double)f->numbers.phi[b][i]);
    for (int s = 0; s < BEAM_STATES; s++) {
        assert_true(p->x.gamma[0][s] == (double)f->numbers.gamma[0][s]);
        for (int r = 0; r < 1 + 2 * p->n.n_ports; r++)
            assert_true(p->x.row[r][s] == (double)f->numbers.row[r][s]);
        for (int q = 0; q < p->n.n_ports; q++)
            assert_true(p->x.gamma_port[q][s] == (double)f->numbers.gamma_port[q][s]);
    }
    for (int r = 0; r < 1 + 2 * p->n.n_ports; r++)
        for (int q = 0; q < p->n.n_ports; q++)
            assert_true(p->x.compliance[r][q] == (double)f->numbers.compliance[r][q]);
    for (int t = 0; t < BEAM_IMAGE_TAPS; t++)
        assert_true(p->x.taps[t] == (double)f->numbers.taps[t]);
    assert_true(p->x.link_phi[0][0] == (double)f->numbers.link_phi[0][0]);
    assert_true(p->x.link_gamma[0][0] == (double)f->numbers.link_gamma[0][0]);
    assert_true(image.float_error < 1e-5 && image.float_error > 0.0);
    assert_true(image.held_error < 1e-2);
    for (size_t k = 0; k < image.in_band; k++)
        assert_true(fabs(image.relative_error[k]) < 1e-6);
    assert_int_equal(image.in_band, 6);
    assert_string_equal(image.effects[0].fate, "a law at 8 points over the span");
    assert_string_equal(image.effects[1].fate, "a filter on piezo_V");
    target_image_free(&image);
}

/* A refused image is described too (verify --json): its counts may be anything, and so may the numbers. */
static void hostile_counts_are_described(void **state)
{
    static struct target_image image;
    (void)state;
    make("", &image);
    const beam_count hostile[] = {INT16_MIN, -1, 0, BEAM_BLOCKS + 1, INT16_MAX};
    for (size_t i = 0; i < sizeof hostile / sizeof hostile[0]; i++) {
        image.file.counts.n_blocks = hostile[i];
        image.file.counts.n_uses = hostile[i];
        char text[400];
        struct json *root = target_image_file_json(&image.file);
        assert_non_null(strstr(json_words(json_member(root, "step"), 5, text, sizeof text), "none: "));
        json_discard(root);
    }
    target_image_free(&image);
}

static void the_interval_is_the_true_one(void **state)
{
    static struct target_image image;
    (void)state;
    make("  - {kind: clock_error, relative: 0.002}\n", &image);
    assert_true(fabs((double)image.file.numbers.dt_s * rate_Hz - 1.002) < 1e-6);
    const struct target_controller same = {.stored = -1, .sample_Hz = rate_Hz};
    assert_int_equal(target_image_check(&image.file, &same), BEAM_IMAGE_FINE);
    const struct target_controller other = {.stored = -1, .sample_Hz = 1000.0};
    assert_int_equal(target_image_check(&image.file, &other), BEAM_IMAGE_BAD_RATE);
    target_image_free(&image);
}

/* ---- Signing: every byte counts ---- */

static const uint8_t device[BEAM_IMAGE_DEVICE_BYTES] = {0xAA, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0xFF};

static void tampering_with_any_byte_is_refused(void **state)
{
    static struct target_image image;
    struct device_key key = {{1, 2, 3}}, other = key;
    (void)state;
    make("  - {kind: cubic_stiffness}\n", &image);
    assert_false(target_image_is_signed(&image.file));
    target_image_sign(&image.file, &key, device, 7);
    assert_true(target_image_is_signed(&image.file));
    const struct target_controller own = {.key = &key, .device = device, .stored = 6, .sample_Hz = rate_Hz};
    assert_int_equal(target_image_check(&image.file, &own), BEAM_IMAGE_FINE);
    uint8_t *bytes = (uint8_t *)&image.file;
    for (size_t i = 0; i < BEAM_IMAGE_BYTES; i++) {
        const uint8_t keep = bytes[i];
        bytes[i] ^= (uint8_t)(1u << (i * 5 % 8));
        assert_int_not_equal(target_image_check(&image.file, &own), BEAM_IMAGE_FINE);
        bytes[i] = keep;
    }
    /* a liar who also corrects the CRC-32 is caught by the code */
    image.file.front.setup.noise_rms *= 2.0F;
    image.file.front.header.crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - 64 - 32, bytes + 64);
    assert_int_equal(target_image_check(&image.file, &own), BEAM_IMAGE_BAD_CODE);
    image.file.front.setup.noise_rms /= 2.0F;
    image.file.front.header.crc32 = beam_crc32(0, BEAM_IMAGE_BYTES - 64 - 32, bytes + 64);
    assert_int_equal(target_image_check(&image.file, &own), BEAM_IMAGE_FINE);
    other.bytes[31] ^= 1;
    const struct target_controller stranger = {.key = &other, .device = device, .stored = 6};
    assert_int_equal(target_image_check(&image.file, &stranger), BEAM_IMAGE_BAD_CODE);
    const uint8_t elsewhere[BEAM_IMAGE_DEVICE_BYTES] = {0xAB};
    const struct target_controller foreign = {.key = &key, .device = elsewhere, .stored = 6};
    assert_int_equal(target_image_check(&image.file, &foreign), BEAM_IMAGE_FOREIGN_DEVICE);
    const struct target_controller newer = {.key = &key, .device = device, .stored = 7};
    assert_int_equal(target_image_check(&image.file, &newer), BEAM_IMAGE_OLD_COUNTER);
    target_image_free(&image);
}

/* ---- Files ---- */

static void files_of_another_size(void **state)
{
    struct beam_image_file file;
    struct bf_error err;
    char *bytes = bf_alloc(BEAM_IMAGE_BYTES + 1, 1);
    (void)state;
    for (int i = -1; i <= 1; i++) {
        const int size = BEAM_IMAGE_BYTES + i;
        char *path = temporary_file("some.bfi", bytes, (size_t)size);
        assert_int_equal(target_image_read(path, &file, &err), i == 0 ? BF_OK : BF_BAD_FILE);
        if (i != 0)
            assert_contains(err.text, i < 0 ? "fewer than 5060" : "more than 5060");
        unlink(path);
        free(path);
    }
    assert_int_equal(target_image_read("/nowhere/at/all", &file, &err), BF_BAD_FILE);
    assert_int_equal(target_image_read("/tmp", &file, &err), BF_BAD_FILE);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_bytes_are_the_plan),       cmocka_unit_test(hostile_counts_are_described),
        cmocka_unit_test(the_interval_is_the_true_one), cmocka_unit_test(tampering_with_any_byte_is_refused),
        cmocka_unit_test(files_of_another_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
