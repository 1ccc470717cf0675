/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A recording made here as a controller makes it, played again: equal, differing, gaps, rests, other images, edited. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>

#include "beam_wire.h"
#include "model_fixture.h"
#include "board/board.h"
#include "board/replay.h"
#include "test_files.h"

enum { SAMPLES = 600 };
static struct target_image image;
static struct beam_live live[SAMPLES];
static struct replay result;
static struct bf_error err;

static int make_image(void **state)
{
    (void)state;
    struct model model;
    struct target_options o = {.hold = BEAM_HOLD_ZERO_ORDER};
    struct device_key key = {{7}};
    const uint8_t device[BEAM_IMAGE_DEVICE_BYTES] = {1};
    fixture_model(&model, "  - {kind: cubic_stiffness, coefficient_Npm3: 1e4}\n  - {kind: sensor_highpass}\n");
    model.board = (struct model_board){
        .present = true, .sample_Hz = 1024.0, .sensor_per_code = 1e-3, .drive_per_code = 0.02, .noise_rms = 1e-3};
    model.board.sensor_zero_code = model.board.drive_zero_code = 2048.0;
    snprintf(model.board.sensor, sizeof model.board.sensor, "piezo_V");
    if (target_image_make(&model, &o, &image, &err) != BF_OK)
        fail_msg("%s", err.text);
    target_image_sign(&image.file, &key, device, 0x1234);
    model_free(&model);
    return 0;
}

static int free_image(void **state)
{
    (void)state;
    target_image_free(&image);
    return 0;
}

/* At rest in the first sample and in sample `rest` (0: no other). */
static void make_recording(uint32_t first_sequence, int rest)
{
    struct beam_image_run *run = bf_alloc(1, beam_image_run_bytes());
    const struct beam_image_setup *setup = &image.file.front.setup;
    uint32_t step = 0;
    beam_image_run_load(run, &image.file);
    assert_int_equal(beam_image_run_check(run, NULL, 0.0F), BEAM_IMAGE_FINE);
    for (int k = 0; k < SAMPLES; k++, step++) {
        const uint32_t drive = (uint32_t)(2048.0 + 500.0 * sin(0.1 * k)), sensor = (uint32_t)(2048 + k % 7);
        if (k == 0 || (rest > 0 && k == rest)) {
            beam_image_run_rest(run);
            step = 0;
        }
        struct beam_live *s = &live[k];
        *s = (struct beam_live){.sequence = first_sequence + (uint32_t)k, .step = step, .codes = sensor | drive << 16};
        s->input = beam_image_drive_value(setup, drive);
        s->measured = beam_image_sensor_value(setup, sensor);
        (void)beam_image_run_step(run, s->input, &s->predicted);
        s->residual = s->measured - s->predicted;
        s->status = (image.file.front.header.counter & 0xFFu) << BEAM_LIVE_COUNTER;
    }
    free(run);
}

static enum bf_status play_text(const char *text)
{
    char *path = temporary_file("live.csv", text, strlen(text));
    const enum bf_status status = replay_run(path, &image.file, &result, &err);
    unlink(path);
    free(path);
    return status;
}

/* Rows from … to − 1 but [lost_from, lost_to). */
static enum bf_status play(unsigned from, unsigned to, unsigned lost_from, unsigned lost_to)
{
    char *text = bf_alloc((size_t)SAMPLES * 200 + 200, 1);
    int n = sprintf(text, "# start: model at rest\ntime_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,"
                          "status\n");
    for (unsigned k = from; k < to; k++) {
        if (k >= lost_from && k < lost_to)
            continue;
        const struct beam_live *s = &live[k];
        n += sprintf(text + n, "%.12g,%.10g,%.10g,%.10g,%.10g,%.10g,%lu,%lu,%lu,%lu\n", k / 1024.0, (double)s->input,
                     (double)s->measured, (double)s->predicted, (double)s->residual, (double)s->ratio,
                     (unsigned long)s->sequence, (unsigned long)s->step, (unsigned long)s->codes,
                     (unsigned long)s->status);
    }
    const enum bf_status status = play_text(text);
    free(text);
    return status;
}

static void a_whole_recording_is_equal(void **state)
{
    (void)state;
    make_recording(4294967000u, 0); /* the sequence passes 2^32 on its way */
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_EQUAL);
    assert_int_equal(result.rows, SAMPLES);
    assert_int_equal(result.compared, SAMPLES);
    assert_int_equal(result.rests, 1);
    assert_int_equal(result.gaps, 0);
    assert_int_equal(result.before_rest, 0);
    assert_int_equal(result.after_gap, 0);
}

static void one_bit_differs(void **state)
{
    (void)state;
    make_recording(5, 0);
    uint32_t bits;
    memcpy(&bits, &live[300].predicted, 4);
    bits ^= 1;
    memcpy(&live[300].predicted, &bits, 4);
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_PREDICTED);
    assert_int_equal(result.step, 300);
    assert_int_equal(result.sequence, 305);
    assert_int_equal(result.line, 303);
    assert_true(result.recorded < result.computed || result.recorded > result.computed);
    assert_int_equal(result.compared, SAMPLES);
    make_recording(5, 0);
    live[77].input += 1.0F; /* not what the code stands for */
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_INPUT);
    assert_int_equal(result.step, 77);
    make_recording(5, 0);
    live[10].status |= BEAM_LIVE_SOLVE;
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_STATUS);
    make_recording(5, 0);
    live[200].codes ^= 1u << 16; /* another drive than was driven: from then on other predictions */
    live[200].input = beam_image_drive_value(&image.file.front.setup, live[200].codes >> 16);
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_PREDICTED);
    assert_true(result.step > 200 && result.step <= 202);
}

static void gaps_and_rests(void **state)
{
    (void)state;
    make_recording(5, 400);
    assert_int_equal(play(0, SAMPLES, 100, 103), BF_OK); /* nothing is known from 103 to 399 */
    assert_int_equal(result.difference, REPLAY_EQUAL);
    assert_int_equal(result.compared, 100 + 200);
    assert_int_equal(result.after_gap, 297);
    assert_int_equal(result.gaps, 1);
    assert_int_equal(result.rests, 2);
    assert_int_equal(play(50, SAMPLES, 0, 0), BF_OK); /* begins in motion */
    assert_int_equal(result.before_rest, 350);
    assert_int_equal(result.compared, 200);
    assert_int_equal(play(50, 400, 0, 0), BF_BAD_FILE); /* and no rest comes */
    assert_contains(err.text, "no sample with step 0");
    assert_int_equal(play(0, SAMPLES, 399, 401), BF_OK); /* the rest itself is lost */
    assert_int_equal(result.compared, 399);
    assert_int_equal(result.after_gap, SAMPLES - 401);
}

static void a_state_that_was_reset(void **state)
{
    (void)state;
    make_recording(5, 301);
    live[300].status |= BEAM_LIVE_RESET;
    live[300].predicted = 0.0F;
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.difference, REPLAY_EQUAL);
    assert_int_equal(result.resets, 1);
    assert_int_equal(result.compared, SAMPLES - 1);
}

static void samples_of_another_image(void **state)
{
    (void)state;
    make_recording(5, 200);
    for (int k = 0; k < 200; k++)
        live[k].status = 0x33u << BEAM_LIVE_COUNTER;
    assert_int_equal(play(0, SAMPLES, 0, 0), BF_OK);
    assert_int_equal(result.other_image, 200);
    assert_int_equal(result.compared, SAMPLES - 200);
    assert_int_equal(play(0, 200, 0, 0), BF_BAD_FILE);
    assert_contains(err.text, "ends in 51, this one's ends in 52");
}

static void what_is_no_recording(void **state)
{
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"", "has no column 'predicted'"},
        {"time_s,drive_V,piezo_V\n0,1,2\n", ":1: has no column 'predicted'"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n", "has no samples"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n0,0,0,0,0,0,1,0,0\n",
         ":2: has another number of cells"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n\n# gap\n0,0,0,x,0,0,1,0,0,0\n",
         ":4: 'x' is not a number"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n0,0,0,0,0,0,-1,0,0,0\n",
         "whole numbers"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n0,0,0,0,0,0,1,0.5,0,0\n",
         "whole numbers"},
        {"time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status\n0,0,0,0,0,0,1,0,4294967296,0\n",
         "whole numbers"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(play_text(cases[i].text), BF_BAD_FILE);
        assert_contains(err.text, cases[i].says);
    }
    assert_int_equal(replay_run("/nowhere/at/all", &image.file, &result, &err), BF_BAD_FILE);
    struct beam_image_file damaged = image.file;
    damaged.front.setup.proof_steps++;
    struct lines lines;
    lines_from_memory("some.csv", cases[2].text, strlen(cases[2].text), &lines);
    assert_int_equal(replay_lines(&lines, &damaged, &result, &err), BF_BAD_FILE);
    assert_contains(err.text, "beamfit verify");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_whole_recording_is_equal),
        cmocka_unit_test(one_bit_differs),
        cmocka_unit_test(gaps_and_rests),
        cmocka_unit_test(a_state_that_was_reset),
        cmocka_unit_test(samples_of_another_image),
        cmocka_unit_test(what_is_no_recording),
    };
    return cmocka_run_group_tests(tests, make_image, free_image);
}
