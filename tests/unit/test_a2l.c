/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The A2L file: begins and ends match, addresses are those of beam_wire.h. (tests/conformance imports it with pya2ldb.) */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <ctype.h>

#include "board/board.h"
#include "beam_wire.h"
#include "test_files.h"

static char text[1 << 16];

static void write_and_read(double sample_Hz)
{
    struct target_image image = {.sensor_unit = "V", .drive_unit = "V"};
    struct bf_error err;
    char path[300];
    image.board.sample_Hz = sample_Hz;
    snprintf(image.board.sensor, sizeof image.board.sensor, "piezo_V");
    snprintf(image.board.drive, sizeof image.board.drive, "drive_V");
    snprintf(path, sizeof path, "%s/some.a2l", temporary_directory());
    assert_int_equal(a2l_write(path, &image, &err), BF_OK);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    assert_true(feof(f));
    fclose(f);
    unlink(path);
}

/* Every /begin NAME has its /end NAME, in order; quotes are closed. */
static void blocks_match(void **state)
{
    (void)state;
    static char open[16][40];
    int depth = 0, blocks = 0, quotes = 0;
    write_and_read(1000.0);
    for (const char *c = text; *c; c++) {
        quotes += *c == '"';
        if (strncmp(c, "/begin ", 7) == 0) {
            assert_true(depth < 16);
            assert_int_equal(sscanf(c + 7, "%39s", open[depth++]), 1);
            blocks++;
        } else if (strncmp(c, "/end ", 5) == 0) {
            char name[40];
            assert_int_equal(sscanf(c + 5, "%39s", name), 1);
            assert_true(depth > 0);
            assert_string_equal(name, open[--depth]);
        }
        assert_true(isprint((unsigned char)*c) || *c == '\n');
    }
    assert_int_equal(depth, 0);
    assert_int_equal(quotes % 2, 0);
    assert_true(blocks > 50);
}

static void addresses_are_the_wires(void **state)
{
    char expected[160];
    (void)state;
    write_and_read(1000.0);
    snprintf(expected, sizeof expected, "INTERN 0x%08X 0x%X", (unsigned)BEAM_WIRE_IMAGE, (unsigned)BEAM_IMAGE_BYTES);
    assert_contains(text, expected);
    static const struct {
        const char *begin;
        size_t address;
    } members[] = {
        {"MEASUREMENT live_predicted \"the model's prediction of the sensor\" FLOAT32_IEEE cm_sensor 0 0 -1e12 1e12\n"
         "      ECU_ADDRESS 0x%08lX\n",
         BEAM_WIRE_LIVE + offsetof(struct beam_live, predicted)},
        {"MEASUREMENT info_missed \"conversions that were due and did not take place\" ULONG NO_COMPU_METHOD 0 0 0 "
         "4294967295\n      ECU_ADDRESS 0x%08lX\n",
         BEAM_WIRE_INFO + offsetof(struct beam_info, missed)},
        {"CHARACTERISTIC drive_amplitude \"of the chirp, in codes of the D/A\" VALUE 0x%08lX rl_f32",
         BEAM_WIRE_DRIVE + offsetof(struct beam_drive, amplitude)},
        {"CHARACTERISTIC image_noise_rms \"expected residual\" VALUE 0x%08lX rl_f32 0 cm_sensor",
         BEAM_WIRE_IMAGE + offsetof(struct beam_image_front, setup) + offsetof(struct beam_image_setup, noise_rms)},
    };
    for (size_t i = 0; i < sizeof members / sizeof *members; i++) {
        snprintf(expected, sizeof expected, members[i].begin, (unsigned long)members[i].address);
        assert_contains(text, expected);
    }
    assert_contains(text, "XCP_ON_SxI 0x0101 921600 ASYNCH_FULL_DUPLEX_MODE PARITY_NONE ONE_STOP_BIT "
                          "HEADER_LEN_CTR_WORD CHECKSUM_WORD");
    assert_contains(text, "500 248 248 BYTE_ORDER_MSB_LAST");
}

static void the_sample_interval_in_xcps_units(void **state)
{
    (void)state;
    write_and_read(1000.0);
    assert_contains(text, "\"sample\" 0 DAQ 2 100 4 0"); /* 100 × 10 µs */
    write_and_read(10000.0);
    assert_contains(text, "\"sample\" 0 DAQ 2 100 3 0"); /* 100 × 1 µs */
    write_and_read(256.0);
    assert_contains(text, "\"sample\" 0 DAQ 2 39 5 0"); /* 39 × 100 µs */
}

static void an_unwritable_file(void **state)
{
    struct target_image image = {.sensor_unit = "V", .drive_unit = "V"};
    struct bf_error err;
    (void)state;
    image.board.sample_Hz = 1000.0;
    assert_int_equal(a2l_write("/nowhere/at/all.a2l", &image, &err), BF_BAD_FILE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_match),
        cmocka_unit_test(addresses_are_the_wires),
        cmocka_unit_test(the_sample_interval_in_xcps_units),
        cmocka_unit_test(an_unwritable_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
