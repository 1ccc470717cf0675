/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The sensor's own faults: each found within its number of samples, apart from a wrong model, and never in noise. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <cmocka.h>
#include "firmware_rig.h"
#include "gaussian.h"

enum { SPAN = 1000 /* samples of averaging_s */, BLOCKS_TWO = 2 * HEALTH_BLOCK };

static struct beam_image image;
static struct sampler sampler;
static struct beam_live live;
static struct beam_state twin; /* the beam, as the model has it */
static double noise_codes;

static int set_up(void **state)
{
    (void)state;
    memset(&sampler, 0, sizeof sampler);
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, built_in_image);
    const enum beam_image_fault fault = beam_image_check(&image, 0.001F);
    noise_codes = (double)(image.front.setup.noise_rms / image.front.setup.sensor_V_per_code);
    sampler_rest(&sampler, &image);
    beam_reset(&image.plan, &twin);
    return fault == BEAM_IMAGE_FINE ? 0 : -1;
}

static uint16_t limited(double code)
{
    return (uint16_t)fmax(0.0, fmin(4095.0, round(code)));
}

static uint16_t chirp(int k)
{
    const double t = 1e-3 * (k % 4000);
    return (uint16_t)(2048 + lround(400.0 * sin(2.0 * M_PI * (4.0 * t + 12.0 * t * t))));
}

/* The sensor of the beam under this drive: what the model says, `gain` times, with noise and an offset, in codes. */
static double sensor(uint16_t drive, double gain, double noise, double offset)
{
    const float u = beam_image_drive_value(&image.front.setup, drive);
    float y;
    beam_step(&image.plan, &twin, &u, &y);
    return 2048.0 + gain * (double)(y / image.front.setup.sensor_V_per_code) + noise * gaussian() + offset;
}

static uint32_t step(uint16_t code, uint16_t drive)
{
    sampler_step(&sampler, &image, code, drive, 4095, &live);
    return live.status & (BEAM_LIVE_SENSOR | BEAM_LIVE_ALARM);
}

/* A beam in order, driven or at rest; no bit may come. */
static void in_order(int samples, bool driven)
{
    for (int k = 0; k < samples; k++) {
        const uint16_t drive = driven ? chirp(k) : 2048;
        assert_int_equal(step(limited(sensor(drive, 1.0, noise_codes, 0.0)), drive), 0);
    }
}

/* 10⁶ samples of white noise, at rest and driven, from a third of a code to thirty: not one bit. */
static void test_noise_raises_nothing(void **state)
{
    static const double codes[] = {0.35, 0.6, 1.0, 2.5, 8.0, 30.0};
    (void)state;
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
        set_up(state);
        image.front.setup.noise_rms = (float)codes[i] * image.front.setup.sensor_V_per_code;
        const double square = codes[i] * codes[i] - 1.0 / 12.0; /* as export counts them */
        image.front.setup.stuck_samples =
            (uint32_t)fmax(64.0, ceil(8.0 * log(1e-12) / log(erf(0.5 / sqrt(2.0 * square)))));
        sampler_rest(&sampler, &image);
        noise_codes = sqrt(square);
        in_order(1000000, false);
        in_order(200000, true);
        print_message("noise %.2f codes, stuck after %u: 1.2e6 samples, 0 faults, 0 alarms\n", codes[i],
                      (unsigned)image.front.setup.stuck_samples);
    }
}

/* A wire that is off: the converter shows one code. Today's ratio is then 0, a perfect model. */
static void test_stuck(void **state)
{
    const int stuck = (int)image.front.setup.stuck_samples;
    (void)state;
    for (int driven = 0; driven < 2; driven++) {
        for (int code = 2040; code <= 2056; code += 8) {
            int found = -1;
            set_up(state);
            in_order(3 * SPAN, driven);
            for (int k = 0; k < 20 * SPAN; k++) {
                const uint16_t drive = driven ? chirp(k) : 2048;
                (void)sensor(drive, 1.0, 0.0, 0.0); /* the beam moves on, unseen */
                const uint32_t bits = step((uint16_t)code, drive);
                if (bits & BEAM_LIVE_STUCK && found < 0)
                    found = k + 1;
                assert_false(bits & BEAM_LIVE_ALARM);
                assert_true(found > 0 || k + 1 < stuck);
            }
            assert_true(found > 0 && found <= stuck && (live.status & BEAM_LIVE_STUCK));
            for (int k = 0; k < HEALTH_HOLD; k++) /* the wire is on again: in order after its time, and judged anew */
                step(limited(sensor(2048, 1.0, noise_codes, 0.0)), 2048);
            in_order(2 * SPAN, false);
        }
    }
    print_message("stuck: found after %d samples\n", stuck);
}

static void test_quiet(void **state)
{
    int latest = 0;
    for (int begin = 0; begin < HEALTH_BLOCK; begin += 7) {
        int found = -1;
        set_up(state);
        in_order(3 * SPAN + begin, false);
        for (int k = 0; k < 10 * SPAN; k++) {
            const uint32_t bits = step(limited(sensor(2048, 1.0, 0.08 * noise_codes, 0.0)), 2048);
            if (bits & BEAM_LIVE_QUIET && found < 0)
                found = k + 1;
            assert_false(bits & (BEAM_LIVE_ALARM | BEAM_LIVE_OFFSET | BEAM_LIVE_AT_END));
        }
        assert_true(found > 0 && found <= BLOCKS_TWO && (live.status & BEAM_LIVE_QUIET));
        latest = found > latest ? found : latest;
    }
    print_message("too quiet: found after %d samples at most\n", latest);
}

/* An input that is far beyond the range half of the time. */
static void test_at_end(void **state)
{
    int found = -1;
    (void)state;
    in_order(3 * SPAN, false);
    for (int k = 0; k < 5 * SPAN; k++) {
        const uint32_t bits = step(limited(2048.0 + 6000.0 * sin(2.0 * M_PI * k / 40.0)), 2048);
        if (bits & BEAM_LIVE_AT_END && found < 0)
            found = k + 1;
        assert_false(bits & (BEAM_LIVE_ALARM | BEAM_LIVE_QUIET | BEAM_LIVE_STUCK));
    }
    assert_true(found > 0 && found <= BLOCKS_TWO);
    print_message("at an end: found after %d samples\n", found);
}

/* From 1.7 to 400 times the noise, at rest and driven: an offset, never a wrong model; and gone again. */
static void test_offset(void **state)
{
    static const double sizes[] = {1.7, 2.4, 6.0, -20.0, 100.0, -400.0};
    int latest = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int driven = 0; driven < 2; driven++) {
            int found = -1;
            set_up(state);
            in_order(3 * SPAN, driven);
            for (int k = 0; k < 10 * SPAN; k++) {
                const uint16_t drive = driven ? chirp(k) : 2048;
                const uint32_t bits = step(limited(sensor(drive, 1.0, noise_codes, sizes[i] * noise_codes)), drive);
                if (bits && found < 0)
                    found = k + 1;
                if (bits & ~(uint32_t)BEAM_LIVE_OFFSET)
                    fail_msg("offset of %g noise: bits %x in sample %d", sizes[i], (unsigned)bits, k);
            }
            assert_true(found > 0 && found <= SPAN + SPAN / 10 && (live.status & BEAM_LIVE_OFFSET));
            assert_true(live.ratio < 1.3F);
            latest = found > latest ? found : latest;
            for (int k = 0; k < 8 * SPAN; k++)
                step(limited(sensor(2048, 1.0, noise_codes, 0.0)), 2048);
            in_order(SPAN, false);
        }
    print_message("offset: found after %d samples at most\n", latest);
}

/* A beam that answers 10 % more than the model says: the model, not the sensor; also while the sensor has an offset. */
static void test_wrong_model(void **state)
{
    for (int offset = 0; offset <= 20; offset += 20) {
        int found = -1;
        set_up(state);
        in_order(3 * SPAN, true);
        for (int k = 0; k < 10 * SPAN; k++) {
            const uint32_t bits = step(limited(sensor(chirp(k), 1.5, noise_codes, offset * noise_codes)), chirp(k));
            if (bits & BEAM_LIVE_ALARM && found < 0)
                found = k + 1;
            assert_false(bits & (BEAM_LIVE_QUIET | BEAM_LIVE_STUCK | BEAM_LIVE_AT_END));
            assert_true(offset > 0 || !(bits & BEAM_LIVE_OFFSET));
        }
        assert_true(found > SPAN / 4 && found < 6 * SPAN);
        print_message("wrong model, offset %d: alarm after %d samples\n", offset, found);
    }
}

/* What a setup may not say; and what says that nothing is judged. */
static void test_limits_of_a_setup(void **state)
{
    static const struct {
        float quiet, offset;
        uint32_t stuck;
    } wrong[] = {{-0.1F, 1.0F, 64}, {1.1F, 1.0F, 64},     {NAN, 1.0F, 64},  {0.2F, 0.0F, 64},
                 {0.2F, -1.0F, 64}, {0.2F, INFINITY, 64}, {0.2F, 1.0F, 15}, {0.2F, 1.0F, 65536}};
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        image.front.setup.quiet_ratio = wrong[i].quiet;
        image.front.setup.offset_ratio = wrong[i].offset;
        image.front.setup.stuck_samples = wrong[i].stuck;
        assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_BAD_SETUP);
    }
    image.front.setup.quiet_ratio = 0.0F;
    image.front.setup.offset_ratio = 1.0F;
    image.front.setup.stuck_samples = 0; /* neither judged */
    assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_FINE);
    sampler_rest(&sampler, &image);
    for (int k = 0; k < 3 * SPAN; k++)
        assert_int_equal(step(2048, 2048), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_noise_raises_nothing, set_up),
        cmocka_unit_test_setup(test_stuck, set_up),
        cmocka_unit_test_setup(test_quiet, set_up),
        cmocka_unit_test_setup(test_at_end, set_up),
        cmocka_unit_test_setup(test_offset, set_up),
        cmocka_unit_test_setup(test_wrong_model, set_up),
        cmocka_unit_test_setup(test_limits_of_a_setup, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
