/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The observer of an exported image: a beam that moves when the board is switched on, that is touched, or whose sensor has an offset, is no
 * wrong model; a wrong model is one, and noise raises nothing.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdio.h>
#include <cmocka.h>
#include "firmware_rig.h"
#include "gaussian.h"
#include "observed_image.h"

enum { SPAN = 1000 /* samples of averaging_s */ };

static uint8_t bytes[BEAM_IMAGE_BYTES], stiffer[BEAM_IMAGE_BYTES];
static struct beam_image image, beam; /* what the board believes, what it hears */
static struct beam_state moving;
static struct sampler sampler;
static struct beam_live live;
static double noise_codes;

static int make_images(void **state)
{
    const char *top = getenv("TOP");
    char path[4096];
    (void)state;
    (void)snprintf(path, sizeof path, "%s/data/live/model.yaml", top ? top : ".");
    return observed_image(path, 1.0, sizeof bytes, bytes) == 0 &&
                   observed_image(path, 1.03, sizeof stiffer, stiffer) == 0
               ? 0
               : -1;
}

static int set_up(void **state)
{
    (void)state;
    memset(&sampler, 0, sizeof sampler);
    memset(&moving, 0, sizeof moving);
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, bytes);
    beam_image_write(&beam, 0, BEAM_IMAGE_BYTES, bytes);
    noise_codes = 0.0;
    if (beam_image_check(&image, 0.001F) != BEAM_IMAGE_FINE || beam_image_check(&beam, 0.001F) != BEAM_IMAGE_FINE)
        return -1;
    noise_codes = (double)(image.front.setup.noise_rms / image.front.setup.sensor_V_per_code);
    sampler_rest(&sampler, &image);
    beam_reset(&beam.plan, &moving);
    return 0;
}

static uint16_t chirp(int k)
{
    const double t = 1e-3 * (k % 4000);
    return (uint16_t)(2048 + lround(700.0 * sin(2.0 * M_PI * (4.0 * t + 25.0 * t * t))));
}

/* One sample of a beam under this drive, pushed as by so many volts at the patch. */
static uint32_t step(uint16_t drive, double push_V, double offset_codes)
{
    const float u = beam_image_drive_value(&image.front.setup, drive) + (float)push_V;
    float y;
    beam_step(&beam.plan, &moving, &u, &y);
    const double code =
        2048.0 + (double)(y / image.front.setup.sensor_V_per_code) + noise_codes * gaussian() + offset_codes;
    sampler_step(&sampler, &image, (uint16_t)fmax(0.0, fmin(4095.0, round(code))), drive, 4095, &live);
    return live.status;
}

/* The image that was made has what its proof and its checks want. */
static void it_proves_itself(void **state)
{
    static struct beam_image_proof proof;
    (void)state;
    proof.progress = 0;
    assert_true(image.front.observer.blocks != 0);
    assert_int_equal(beam_image_prove(&image, image.front.setup.proof_steps, &proof), BEAM_IMAGE_FINE);
    image.front.observer.gain[1][0] *= 1.001F;
    proof.progress = 0;
    assert_int_equal(beam_image_prove(&image, image.front.setup.proof_steps, &proof), BEAM_IMAGE_BAD_PROOF);
}

static void what_no_observer_may_be(void **state)
{
    const struct beam_image_observer good = image.front.observer;
    struct beam_image_observer *o = &image.front.observer;
    (void)state;
    o->blocks |= 1u << 31;
    assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_BAD_SETUP);
    *o = good;
    o->blocks = 0x3FF; /* ten blocks, eight gains */
    assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_BAD_SETUP);
    static const float wrong[] = {NAN, INFINITY, -1.0F, 1e30F, 1e-44F};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        for (int member = 0; member < 3; member++) {
            *o = good;
            float *const members[] = {&o->gain_offset, &o->disturbance_s, &o->innovation_rms};
            *members[member] = wrong[i];
            if (member == 2 && wrong[i] >= 1e30F && isfinite(wrong[i]))
                continue;
            assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_BAD_SETUP);
        }
    *o = good;
    o->gain[0][1] = NAN;
    assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_BAD_SETUP);
    memset(&image.front.tracking, 0, sizeof image.front.tracking); /* wants observed blocks */
    *o = (struct beam_image_observer){.blocks = 0};                /* none at all */
    assert_int_equal(beam_image_check(&image, 0.001F), BEAM_IMAGE_FINE);
}

/* 10⁶ samples of white noise at rest, 2·10⁵ driven: nothing. */
static void noise_raises_nothing(void **state)
{
    double square = 0.0;
    (void)state;
    for (int k = 0; k < 1200000; k++) {
        const uint32_t status = step(k < 1000000 ? 2048 : chirp(k), 0.0, 0.0);
        assert_false(status & (BEAM_LIVE_ALARM | BEAM_LIVE_DISTURBED | BEAM_LIVE_SENSOR));
        square += (double)live.innovation * (double)live.innovation;
    }
    const double rms = sqrt(square / 1200000.0), stated = (double)image.front.observer.innovation_rms;
    print_message("innovation %.5g rms, stated %.5g; 1.2e6 samples, 0 alarms\n", rms, stated);
    assert_true(fabs(rms / stated - 1.0) < 0.02);
}

/* Switched on while the beam moves: as it swings after a drive that the board knew nothing of. */
static void a_beam_that_moves_at_power_on(void **state)
{
    static const double volts[] = {2.0, 10.0, 20.0};
    for (size_t i = 0; i < sizeof volts / sizeof *volts; i++) {
        int alarmed = 0, disturbed = 0;
        double loudest = 0.0;
        set_up(state);
        for (int k = 0; k < 3000; k++) /* at the first resonance */
            step(2048, volts[i] * sin(2.0 * M_PI * 6.8e-3 * k), 0.0);
        sampler_rest(&sampler, &image);
        for (int k = 0; k < 20 * SPAN; k++) {
            const uint32_t status = step(2048, 0.0, 0.0);
            alarmed += (status & BEAM_LIVE_ALARM) != 0;
            disturbed += (status & BEAM_LIVE_DISTURBED) != 0;
            loudest = fmax(loudest, (double)live.ratio);
        }
        print_message("moving at power-on, ratio up to %.3g: %d samples alarmed, %d disturbed\n", loudest, alarmed,
                      disturbed);
        assert_int_equal(alarmed, 0);
        assert_true(loudest < 3.5 || disturbed > 100);
    }
}

/* Touched now and then while it is driven, half a second each time. */
static void a_beam_that_is_touched(void **state)
{
    int alarmed = 0;
    double loudest = 0.0;
    (void)state;
    for (int k = 0; k < 60 * SPAN; k++) {
        const int since = k % (20 * SPAN) - 5 * SPAN;
        const double push = since >= 0 && since < 300 ? 20.0 * sin(M_PI * since / 300.0) : 0.0;
        const uint32_t status = step(chirp(k), push, 0.0);
        alarmed += (status & BEAM_LIVE_ALARM) != 0;
        loudest = fmax(loudest, (double)live.ratio);
    }
    print_message("touched three times in a minute, ratio up to %.3g: %d samples alarmed\n", loudest, alarmed);
    assert_true(loudest > 6.0 && alarmed == 0);
}

/* 6 codes of 4096, as an amplifier drifts; on from the first sample, or suddenly. */
static void an_offset_of_the_sensor(void **state)
{
    for (int late = 0; late < 2; late++) {
        int alarmed = 0;
        set_up(state);
        for (int k = 0; k < 20 * SPAN; k++)
            alarmed += (step(chirp(k), 0.0, late && k < 5 * SPAN ? 0.0 : 6.0) & BEAM_LIVE_ALARM) != 0;
        assert_int_equal(alarmed, 0);
        assert_true(live.status & BEAM_LIVE_OFFSET);
        assert_true(live.innovation_ratio < 1.3F);
    }
}

/* A stiffness that is 3 % off, driven: an alarm, and it stays. */
static void a_wrong_model(void **state)
{
    int first = -1, alarmed = 0;
    (void)state;
    beam_image_write(&beam, 0, BEAM_IMAGE_BYTES, stiffer);
    assert_int_equal(beam_image_check(&beam, 0.001F), BEAM_IMAGE_FINE);
    for (int k = 0; k < 40 * SPAN; k++)
        if (step(chirp(k), 0.0, 0.0) & BEAM_LIVE_ALARM) {
            first = first < 0 ? k : first;
            alarmed += k >= 30 * SPAN;
        }
    print_message("EI 3 %% off: alarm after %d samples, ratio %.3g, innovation's %.3g\n", first, (double)live.ratio,
                  (double)live.innovation_ratio);
    assert_true(first > 0 && first < 20 * SPAN && alarmed == 10 * SPAN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(it_proves_itself, set_up),
        cmocka_unit_test_setup(what_no_observer_may_be, set_up),
        cmocka_unit_test_setup(noise_raises_nothing, set_up),
        cmocka_unit_test_setup(a_beam_that_moves_at_power_on, set_up),
        cmocka_unit_test_setup(a_beam_that_is_touched, set_up),
        cmocka_unit_test_setup(an_offset_of_the_sensor, set_up),
        cmocka_unit_test_setup(a_wrong_model, set_up),
    };
    return cmocka_run_group_tests(tests, make_images, NULL);
}
