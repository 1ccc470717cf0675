/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The model file's board block, steps_per_sample, and the noise that a fit leaves: read, refused, printed anew, kept by an edit. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model_yaml.h"

#define GOOD /* 9 lines */                                                                                             \
    "format: beamfit-model/1\nbeam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"                                 \
    "parameters:\n  {EI_beam_Nm2: 0.495, EI_patch_Nm2: 1.05, rho_beam_kgpm: 0.09, rho_patch_kgpm: 0.3, Ks_V: 60, "     \
    "KB_NmpV: 1}\n"                                                                                                    \
    "inputs:\n  drive_V: {kind: patch_moment}\noutputs:\n  piezo_V: {kind: patch_strain}\neffects: []\n"

static void reads(const char *text, struct model *model)
{
    struct bf_error err = {0};
    if (model_read_text("m.yaml", text, strlen(text), model, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
}

static void the_whole_block(void **state)
{
    (void)state;
    struct model m;
    reads(GOOD "board:\n  sample_Hz: 1024   # as the board's switch says\n"
               "  sensor: {output: piezo_V, per_code: -0.001, zero_code: 2047.5}\n"
               "  drive: {input: drive_V, per_code: 0.02, zero_code: 2048}\n"
               "  noise_rms: 0.002\n  alarm_ratio: 4\n  clear_ratio: 2.5\n  averaging_s: 0.5\n",
          &m);
    const struct model_board *b = &m.board;
    assert_true(b->present);
    assert_true(b->sample_Hz == 1024.0 && b->noise_rms == 0.002 && b->alarm_ratio == 4.0 && b->clear_ratio == 2.5);
    assert_true(b->averaging_s == 0.5 && b->sensor_per_code == -0.001 && b->sensor_zero_code == 2047.5);
    assert_true(b->drive_per_code == 0.02 && b->drive_zero_code == 2048.0);
    assert_string_equal(b->sensor, "piezo_V");
    assert_string_equal(b->drive, "drive_V");
    char *text = model_to_text(&m); /* a new file says the same */
    struct model again;
    reads(text, &again);
    assert_memory_equal(&again.board, &m.board, sizeof m.board);
    free(text);
    model_free(&again);
    m.Ks.value = 61.0; /* an edit leaves the block and its comment alone */
    text = model_edit_text(m.document, strlen(m.document), &m);
    assert_non_null(text);
    assert_non_null(strstr(text, "sample_Hz: 1024   # as the board's switch says\n"));
    assert_non_null(strstr(text, "Ks_V: 61"));
    free(text);
    model_free(&m);
}

/* A key of the root that a fit may add, change and take out again. */
static void steps_per_sample(void **state)
{
    (void)state;
    static const struct {
        const char *text, *message;
    } bad[] = {
        {"steps_per_sample: 0\n", "m.yaml:10: steps_per_sample is 0; write a whole number from 1 to 64"},
        {"steps_per_sample: 65\n", "m.yaml:10: steps_per_sample is 65;"},
        {"steps_per_sample: 2.5\n", "m.yaml:10: steps_per_sample is 2.5;"},
        {"steps_per_sample: [8]\n", "m.yaml:10: "},
    };
    struct model m, again;
    struct bf_error err;
    reads(GOOD, &m);
    assert_int_equal(m.steps_per_sample, 0);
    for (int steps = 32; steps >= 0; steps -= 16) { /* added, changed, taken out */
        m.steps_per_sample = steps;
        char *text = model_edit_text(m.document, strlen(m.document), &m);
        assert_non_null(text);
        free(m.document);
        m.document = text;
        reads(text, &again);
        assert_int_equal(again.steps_per_sample, steps);
        model_free(&again);
    }
    assert_string_equal(m.document, GOOD);
    model_free(&m);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[1024];
        (void)snprintf(text, sizeof text, "%s%s", GOOD, bad[i].text);
        assert_int_equal(model_read_text("m.yaml", text, strlen(text), &m, &err), BF_BAD_FILE);
        if (strncmp(err.text, bad[i].message, strlen(bad[i].message)) != 0)
            fail_msg("%s", err.text);
    }
}

static void parts_and_nothing(void **state)
{
    static const char *const blocks[] = {
        "board:\n",
        "board: {}\n",
        "board: {sensor: {}, drive: {}}\n",
        "board: {noise_rms: 0.1}\n",
        "board: {sensor: {per_code: 0.5}}\n",
        "board: {sensor: {zero_code: 5}}\n",
        "board: {drive: {input: drive_V}}\n",
    };
    (void)state;
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
        char text[1024];
        struct model m, again;
        (void)snprintf(text, sizeof text, "%s%s", GOOD, blocks[i]);
        reads(text, &m);
        assert_int_equal(m.board.present, i >= 3);
        char *printed = model_to_text(&m);
        reads(printed, &again);
        assert_memory_equal(&again.board, &m.board, sizeof m.board);
        free(printed);
        model_free(&again);
        model_free(&m);
    }
}

static void what_is_refused(void **state)
{
    static const struct {
        const char *block, *says;
    } cases[] = {
        {"board: 5\n", "m.yaml:10: "},
        {"board:\n  sample_Hz: -1\n", "m.yaml:11: sample_Hz is -1; it must be above 0"},
        {"board: {sample_Hz: 1e9}\n", "and smaller"},
        {"board: {sample_Hz: fast}\n", "'fast', not a number"},
        {"board: {rate: 5}\n", "unknown key 'rate'"},
        {"board: {sensor: piezo_V}\n", "sensor"},
        {"board: {sensor: {output: piezo}}\n",
         "no output of the model; name one of its outputs; did you mean 'piezo_V'"},
        {"board: {drive: {input: piezo_V}}\n", "no input of the model"},
        {"board: {drive: {output: piezo_V}}\n", "unknown key 'output'"},
        {"board: {sensor: {per_code: 0}}\n", "how much of the channel's unit one code is worth"},
        {"board: {sensor: {per_code: .inf}}\n", "per_code"},
        {"board: {drive: {zero_code: 70000}}\n", "the code that stands for 0"},
        {"board: {noise_rms: 0}\n", "above 0"},
        {"board: {alarm_ratio: -3}\n", "above 0"},
        {"board: {averaging_s: [1]}\n", "averaging_s"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        struct model m;
        struct bf_error err = {0};
        (void)snprintf(text, sizeof text, "%s%s", GOOD, cases[i].block);
        assert_int_equal(model_read_text("m.yaml", text, strlen(text), &m, &err), BF_BAD_FILE);
        if (!strstr(err.text, cases[i].says) || !strchr(err.text, ';'))
            fail_msg("%s: wanted '%s … ; remedy', got '%s'", cases[i].block, cases[i].says, err.text);
    }
}

static void the_noise_of_a_fit(void **state)
{
    (void)state;
    struct model m, again;
    reads(GOOD "fit:\n  records:\n    - {file: a.csv, channels: [{name: piezo_V, nrmse: 0.01, noise_ratio: 1.1, "
               "noise_rms: 0.00213}]}\n",
          &m);
    assert_true(m.fit.records[0].channels[0].noise_rms == 0.00213);
    m.fit.present = true;
    char *text = model_to_text(&m);
    reads(text, &again);
    assert_true(again.fit.records[0].channels[0].noise_rms == 0.00213);
    free(text);
    model_free(&again);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_whole_block), cmocka_unit_test(steps_per_sample),   cmocka_unit_test(parts_and_nothing),
        cmocka_unit_test(what_is_refused), cmocka_unit_test(the_noise_of_a_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
