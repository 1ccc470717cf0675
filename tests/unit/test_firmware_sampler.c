/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One sample: which sample is compared with which, running mean, alarm, what is not finite; the drive and its causality. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <cmocka.h>
#include "firmware_rig.h"

static struct beam_image image;
static struct sampler sampler;
static struct beam_live live;

static int set_up(void **state)
{
    (void)state;
    memset(&sampler, 0, sizeof sampler);
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, built_in_image);
    const enum beam_image_fault fault = beam_image_check(&image, 0.001F);
    sampler_rest(&sampler, &image);
    return fault == BEAM_IMAGE_FINE ? 0 : -1;
}

static void step(uint16_t sensor, uint16_t drive)
{
    sampler_step(&sampler, &image, sensor, drive, 4095, &live);
}

static uint16_t chirp(int k)
{
    return (uint16_t)(2048 + lround(500.0 * sin(1e-4 * k * k)));
}

static uint16_t code_of(float volt)
{
    return (uint16_t)lroundf(2048.0F + volt / image.front.setup.sensor_V_per_code);
}

/* A sensor that the model predicts to the rounding of its codes, `latency` samples after they were taken. */
static void test_same_sample(void **state)
{
    (void)state;
    for (int latency = 0; latency < 4; latency += 3) {
        static struct beam_state twin;
        struct beam_image plain = image;
        float largest = 0.0F, largest_residual = 0.0F;
        if (latency > 0) { /* the output waits in its ring; a use keeps the step from its short cut */
            image.plan.n.n_uses = 1;
            image.plan.use[0] = (struct beam_use){.effect = beam_effect_find("sensor_offset")};
            image.plan.n.latency = (beam_count)latency;
            image.plan.n.command_ring = (struct beam_ring){0, (beam_count)(latency + 1)};
            image.plan.n.output_ring[0] = (struct beam_ring){10, (beam_count)(latency + 1)};
            assert_int_equal(beam_plan_check(&image.plan), BEAM_OK);
        }
        beam_reset(&plain.plan, &twin);
        sampler_rest(&sampler, &image);
        for (int k = 0; k < 2000; k++) {
            const float u = ((float)chirp(k) - 2048.0F) * plain.front.setup.drive_V_per_code;
            float y;
            beam_step(&plain.plan, &twin, &u, &y);
            step(code_of(y), chirp(k));
            if (k > latency) {
                largest = fmaxf(largest, fabsf(live.predicted));
                largest_residual = fmaxf(largest_residual, fabsf(live.residual));
            }
            assert_float_equal(live.input, u, 0.0F);
            assert_int_equal(live.step, k);
            assert_int_equal(live.codes & 0xFFFFu, code_of(y)); /* the newest, whatever the latency */
            assert_int_equal(live.codes >> 16, chirp(k));
        }
        assert_true(largest > 0.05F);
        assert_true(largest_residual < 0.51F * image.front.setup.sensor_V_per_code);
    }
}

/* What is in ROM would pass every check of a download but those of its owner. */
static void test_built_in_proves_itself(void **state)
{
    static const uint8_t nobody[BEAM_IMAGE_DEVICE_BYTES];
    static struct beam_image_proof proof;
    (void)state;
    assert_int_equal(beam_image_header_check(&image, nobody), BEAM_IMAGE_FINE);
    assert_int_equal(image.front.header.counter, 0);
    proof.progress = 0;
    assert_int_equal(beam_image_prove(&image, image.front.setup.proof_steps, &proof), BEAM_IMAGE_FINE);
    assert_int_equal(proof.progress, image.front.setup.proof_steps);
}

/* Plain mean and variance until the time constant has passed, exponential then. */
static void test_running_mean(void **state)
{
    double sum = 0.0, squares = 0.0, mean = 0.0, variance = 0.0;
    (void)state;
    for (int k = 1; k <= 5000; k++) {
        step((uint16_t)(2048 + k * 37 % 101 - 48), 2048);
        const double r = (double)live.residual, off = r - mean;
        sum += r;
        squares += r * r;
        mean = k < 1000 ? sum / k : mean + off / 1000.0;
        variance = k < 1000 ? squares / k - mean * mean : 0.999 * (variance + off * off / 1000.0);
        assert_float_equal(live.ratio, (float)(sqrt(fmax(variance, 0.0)) / 0.002), 1e-4F * live.ratio + 1e-4F);
    }
}

static void test_alarm_with_hysteresis(void **state)
{
    const int noise = 2; /* codes: 0.8 of noise_rms */
    (void)state;
    for (int k = 0; k < 990; k++) { /* loud from the start: judged when the mean spans its time */
        step((uint16_t)(2048 + (k % 2 ? 12 : -12)), 2048);
        assert_false(live.status & BEAM_LIVE_ALARM);
    }
    for (int k = 0; k < 20; k++)
        step((uint16_t)(2048 + (k % 2 ? 12 : -12)), 2048);
    assert_true(live.status & BEAM_LIVE_ALARM);
    int changes = 0;
    bool was = true;
    for (int k = 0; k < 6000; k++) {
        step((uint16_t)(2048 + (k % 2 ? noise : -noise)), 2048);
        const bool is = live.status & BEAM_LIVE_ALARM;
        changes += is != was;
        if (is != was)
            assert_true(live.ratio < 2.0F && live.ratio > 1.98F);
        was = is;
    }
    assert_int_equal(changes, 1);
    for (int k = 0; k < 3000; k++) { /* 2.46 of noise_rms, between the two thresholds: stays off */
        step((uint16_t)(2048 + (k % 2 ? 6 : -6)), 2048);
        assert_false(live.status & BEAM_LIVE_ALARM);
    }
}

static void test_clipped(void **state)
{
    (void)state;
    step(0, 2048);
    assert_true(live.status & BEAM_LIVE_CLIPPED);
    step(4095, 2048);
    assert_true(live.status & BEAM_LIVE_CLIPPED);
    step(1, 2048);
    assert_false(live.status & BEAM_LIVE_CLIPPED);
}

/* A state that is not finite lasts one sample, is said, and leaves no NaN behind. */
static void test_not_finite(void **state)
{
    static const float spoilt[] = {NAN, INFINITY, -INFINITY, 3e38F, 1e30F};
    (void)state;
    for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
        for (int k = 0; k < 50; k++)
            step(2050, chirp(k));
        const uint32_t sequence = live.sequence;
        sampler.state.x[4] = sampler.state.x[5] = spoilt[i];
        step(2050, 2048);
        assert_true(live.status & BEAM_LIVE_RESET);
        assert_true(isfinite(live.predicted) && isfinite(live.residual) && isfinite(live.ratio));
        assert_int_equal(live.sequence, sequence + 1);
        step(2050, 2048);
        assert_false(live.status & BEAM_LIVE_RESET);
        assert_int_equal(live.step, 0);
        assert_int_equal(live.sequence, sequence + 2);
        assert_float_equal(live.predicted, 0.0F, 0.0F);
    }
}

static void test_long_run_stays_bounded(void **state)
{
    float last_quarter = 0.0F, first_quarter = 0.0F;
    (void)state;
    for (int k = 0; k < 1000000; k++) { /* a tone at the first resonance's neighbourhood, held amplitude */
        step(2048, (uint16_t)(2048 + (k / 70 % 2 ? 300 : -300)));
        if (k < 250000)
            first_quarter = fmaxf(first_quarter, fabsf(live.predicted));
        else if (k >= 750000)
            last_quarter = fmaxf(last_quarter, fabsf(live.predicted));
    }
    assert_true(last_quarter > 0.1F * first_quarter && last_quarter <= 1.001F * first_quarter);
}

/* ---- The drive ---- */

static void test_sine(void **state)
{
    double worst = 0.0;
    (void)state;
    for (uint64_t phase = 0; phase < 1ull << 32; phase += 65521) {
        const double error =
            drive_sine((uint32_t)phase) / 2147483648.0 - sin(2.0 * M_PI * (double)phase / 4294967296.0);
        worst = fmax(worst, fabs(error));
    }
    assert_true(worst < 1.0 / (1 << 19));
    assert_int_equal(drive_sine(0), 0);
    assert_int_equal(drive_sine(0x40000000), -drive_sine(0xC0000000));
    for (uint32_t p = 1; p < 0x40000000; p += 1000003) { /* odd and symmetric in every bit */
        assert_int_equal(drive_sine(p), -drive_sine(-p));
        assert_int_equal(drive_sine(p), drive_sine(0x80000000u - p));
    }
}

static void test_chirp(void **state)
{
    const struct beam_drive setting = {
        .amplitude = 1000.5F, .rate = 40000000, .sweep = 3000, .period = 700, .burst = 500};
    struct drive drive;
    (void)state;
    drive_start(&drive, &setting, 2048);
    for (uint32_t n = 0; n < 2100; n++) {
        const uint32_t k = n % 700, phase = setting.rate * k + setting.sweep * (k * (k - 1) / 2);
        const double u = k < 500 ? 1000.5 * sin(2.0 * M_PI * phase / 4294967296.0) : 0.0;
        assert_true(fabs(drive_next(&drive) - 2048 - u) < 0.51);
    }
    const struct beam_drive once = {.amplitude = 2047.0F, .rate = 1u << 30, .burst = 3};
    drive_start(&drive, &once, 2048);
    static const uint16_t codes[] = {2048, 4095, 2048, 2048, 2048};
    for (int k = 0; k < 5; k++)
        assert_int_equal(drive_next(&drive), codes[k]);
    const struct beam_drive none = {.amplitude = 0.0F, .rate = 1u << 30};
    drive_start(&drive, &none, 1234);
    for (int k = 0; k < 5; k++)
        assert_int_equal(drive_next(&drive), 1234);
    assert_false(drive_valid(&(struct beam_drive){.amplitude = NAN}));
    assert_false(drive_valid(&(struct beam_drive){.amplitude = -1.0F}));
    assert_false(drive_valid(&(struct beam_drive){.amplitude = 2047.5F}));
    assert_true(drive_valid(&(struct beam_drive){.amplitude = 2047.0F}));
}

/* The code that the live sample names is the one at the D/A; with REST its first one is step 0. */
static void test_drive_over_the_line(void **state)
{
    struct beam_drive setting = {.amplitude = 500.0F, .rate = 1u << 30, .flags = BEAM_DRIVE_REST, .generation = 7};
    (void)state;
    board_reset();
    rig_boot();
    assert_int_equal(rig_connect(), 0);
    assert_int_equal(rig_unlock(), 0);
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof setting - 4, &setting), 0);
    rig_run(5);
    assert_int_equal(board.drive, 2048); /* not before its generation is written */
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE + 24, 4, &setting.generation), 0);
    static const uint16_t turn[4] = {2048, 2548, 2048, 1548};
    while (app.latest.step != 0)
        rig_run(1);
    for (uint32_t k = 0; k < 12; k++) {
        assert_int_equal(app.latest.step, k);
        assert_int_equal(board.drive, turn[k % 4]);
        assert_int_equal(app.latest.codes >> 16, turn[k % 4]);
        rig_run(1);
    }
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof setting, &setting), 0); /* the same generation: nothing begins */
    rig_run(5);
    assert_true(app.latest.step > 12);
    setting.amplitude = NAN;
    setting.generation = 8;
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof setting, &setting), BEAM_XCP_ERR_OUT_OF_RANGE);
    struct beam_drive there;
    assert_int_equal(rig_read(BEAM_WIRE_DRIVE, sizeof there, &there), 0);
    assert_float_equal(there.amplitude, 500.0F, 0.0F);
    assert_int_equal(there.generation, 7);
    setting.amplitude = 0.0F;
    setting.flags = 0;
    assert_int_equal(rig_write(BEAM_WIRE_DRIVE, sizeof setting, &setting), 0);
    rig_run(3);
    assert_int_equal(board.drive, 2048);
    assert_true(app.latest.step > 12); /* not put to rest */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_built_in_proves_itself, set_up),
        cmocka_unit_test_setup(test_same_sample, set_up),
        cmocka_unit_test_setup(test_running_mean, set_up),
        cmocka_unit_test_setup(test_alarm_with_hysteresis, set_up),
        cmocka_unit_test_setup(test_clipped, set_up),
        cmocka_unit_test_setup(test_not_finite, set_up),
        cmocka_unit_test_setup(test_long_run_stays_bounded, set_up),
        cmocka_unit_test(test_sine),
        cmocka_unit_test(test_chirp),
        cmocka_unit_test(test_drive_over_the_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
