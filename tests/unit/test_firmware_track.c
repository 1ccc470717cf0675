/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Modes that are followed beside the model: the plant is the truth simulator's, which shares no code with the firmware, and changes while
 * the board runs.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include <cmocka.h>
#include "firmware_rig.h"
#include "observed_image.h"
#include "track.h"
#include "truth.h"

enum { PERIOD = 8000 /* samples */, MODES = 3 };

static uint8_t bytes[BEAM_IMAGE_BYTES];
static struct beam_image image, silent; /* the second follows nothing */
static struct sampler sampler, beside;
static struct beam_live live;
static struct beam_tracking tracked;
static int drive_level; /* D/A codes */

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.505}\n"
                                 "  EI_patch_Nm2: {value: 0.798}\n"
                                 "  rho_beam_kgpm: {value: 0.096}\n"
                                 "  rho_patch_kgpm: {value: 0.441}\n"
                                 "  cDI_beam_sNm2: {value: 0.637e-5}\n"
                                 "  cDI_patch_sNm2: {value: 1.275e-5}\n"
                                 "  gamma_sNpm2: {value: 0.3}\n"
                                 "  KB_NmpV: {value: 0.01746}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs:\n  drive_V: {kind: patch_moment}\n"
                                 "outputs:\n  piezo_V: {kind: patch_strain}\n"
                                 "board:\n"
                                 "  sample_Hz: 1000\n"
                                 "  sensor: {output: piezo_V, per_code: 0.005, zero_code: 2048}\n"
                                 "  drive: {input: drive_V, per_code: 0.01, zero_code: 2048}\n"
                                 "  noise_rms: 0.0101\n";

/* The same beam, as the truth simulator says it. */
static const char *const truth_lines[] = {"length_m = 0.4573",
                                          "patch_m = 0.02535 0.08905",
                                          "EI_beam_Nm2 = 0.505",
                                          "EI_patch_Nm2 = 0.798",
                                          "rho_beam_kgpm = 0.096",
                                          "rho_patch_kgpm = 0.441",
                                          "cDI_beam_sNm2 = 0.637e-5",
                                          "cDI_patch_sNm2 = 1.275e-5",
                                          "gamma_sNpm2 = 0.3",
                                          "KB_NmpV = 1.746e-2",
                                          "Ks_V = 40",
                                          "input drive_V patch_moment",
                                          "output piezo_V patch_strain",
                                          "sample_rate_Hz = 1000",
                                          "filter_order = 0",
                                          "live drive_per_code=0.01 sensor_per_code=0.005 noise_rms=0.01"};

struct beam_truth {
    struct truth_spec spec;
    struct truth_plant *plant;
    double frequency_Hz[MODES], damping[MODES];
    uint16_t sensor;
};

static void truth_begin(struct beam_truth *t, const char *more, uint64_t seed)
{
    char message[TRUTH_MESSAGE] = "", line[64];
    truth_spec_default(&t->spec);
    for (size_t i = 0; i < sizeof truth_lines / sizeof *truth_lines; i++)
        assert_int_equal(truth_spec_line(&t->spec, truth_lines[i], message), 0);
    if (more[0])
        assert_int_equal(truth_spec_line(&t->spec, more, message), 0);
    (void)snprintf(line, sizeof line, "seed = %u", (unsigned)seed);
    assert_int_equal(truth_spec_line(&t->spec, line, message), 0);
    assert_int_equal(truth_modes(&t->spec, MODES, t->frequency_Hz, t->damping, message), 0);
    t->plant = truth_plant_new(&t->spec, message);
    assert_non_null(t->plant);
}

static int make_image_of(double mass_kg, uint8_t out[BEAM_IMAGE_BYTES])
{
    char path[] = "/tmp/test_firmware_track_XXXXXX", effects[80] = "effects: []\n";
    const int fd = mkstemp(path);
    FILE *f = fd < 0 ? NULL : fdopen(fd, "w");
    if (f == NULL)
        return -1;
    if (mass_kg > 0.0)
        (void)snprintf(effects, sizeof effects, "effects:\n  - {kind: tip_mass, mass_kg: {value: %.9g}}\n", mass_kg);
    const bool written = fputs(model_text, f) >= 0 && fputs(effects, f) >= 0;
    const int status = fclose(f) == 0 && written ? observed_image(path, 1.0, BEAM_IMAGE_BYTES, out) : -1;
    (void)unlink(path);
    return status;
}

static int make_image(void **state)
{
    (void)state;
    return make_image_of(0.0, bytes);
}

static int set_up(void **state)
{
    (void)state;
    memset(&sampler, 0, sizeof sampler);
    memset(&beside, 0, sizeof beside);
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, bytes);
    if (beam_image_check(&image, 0.001F) != BEAM_IMAGE_FINE || image.front.tracking.blocks == 0)
        return -1;
    silent = image;
    memset(&silent.front.tracking, 0, sizeof silent.front.tracking);
    sampler_rest(&sampler, &image);
    sampler_rest(&beside, &silent);
    drive_level = 700;
    return 0;
}

/* Size of a mode's motion at the sensor per unit of drive; the sensor has no filter. */
static double strength(const struct beam_image *of, int which)
{
    int block = 0;
    for (uint32_t blocks = of->front.tracking.blocks; (blocks & 1u) == 0 || which-- > 0; blocks >>= 1)
        block++;
    const float *psi = of->plan.x.phi[block], *gamma = &of->plan.x.gamma[0][2 * block];
    const double half = 0.5 * ((double)psi[0] + (double)psi[3]);
    const double im = sqrt((double)psi[0] * (double)psi[3] - (double)psi[1] * (double)psi[2] - half * half);
    const double im_gamma = ((half - (double)psi[0]) * (double)gamma[0] - (double)psi[1] * (double)gamma[1]) / im;
    const float *row = &of->plan.x.row[0][2 * block];
    const double row_re = (double)row[0] + (double)row[1] * (half - (double)psi[0]) / (double)psi[1];
    return hypot((double)gamma[0], im_gamma) * hypot(row_re, (double)row[1] * im / (double)psi[1]);
}

/* Chirps from 4 to 204 Hz in four seconds, then a pause of as much. */
static uint16_t drive_at(int k)
{
    const double t = 1e-3 * (k % PERIOD);
    return (uint16_t)(t >= 4.0 ? 2048 : 2048 + lround(drive_level * sin(2.0 * M_PI * (4.0 * t + 25.0 * t * t))));
}

/* So many samples; what is followed changes nothing of what the board says of its model, bit for bit. */
static void run(struct beam_truth *t, int from, int n, int push_codes)
{
    char message[TRUTH_MESSAGE];
    for (int k = from; k < from + n; k++) {
        struct beam_live other;
        const uint16_t drive = drive_at(k);
        const bool touched = push_codes > 0 && k % PERIOD >= 5000 && k % PERIOD < 5300;
        sampler_step(&sampler, &image, t->sensor, drive, 4095, &live);
        sampler_step(&beside, &silent, t->sensor, drive, 4095, &other);
        assert_memory_equal(&live, &other, offsetof(struct beam_live, crc32));
        assert_int_equal(
            truth_plant_tick(t->plant, (uint16_t)(drive + (touched ? push_codes : 0)), &t->sensor, message), 0);
    }
    track_report(&image, track_of(&image, &sampler.state), &tracked);
    assert_int_equal(tracked.modes, MODES);
}

/* How far frequency, damping and gain are off, in their standard errors. */
struct off {
    double frequency, damping, gain;
};

static struct off off_by(const struct beam_truth *t, int m, double gain)
{
    const struct beam_tracked *q = &tracked.mode[m];
    return (struct off){((double)q->frequency_Hz - t->frequency_Hz[m]) / (double)q->frequency_se_Hz,
                        ((double)q->damping - t->damping[m]) / (double)q->damping_se,
                        ((double)q->gain - gain) / (double)q->gain_se};
}

static void print_modes(const struct beam_truth *t)
{
    for (int m = 0; m < MODES; m++) {
        const struct beam_tracked *q = &tracked.mode[m];
        print_message("  mode %d: %.4f +- %.4f Hz (true %.4f), damping %.5f +- %.5f (%.5f), gain %.3f +- %.3f\n", m + 1,
                      (double)q->frequency_Hz, (double)q->frequency_se_Hz, t->frequency_Hz[m], (double)q->damping,
                      (double)q->damping_se, t->damping[m], (double)q->gain, (double)q->gain_se);
    }
}

/* ---- What it follows ---- */

/* The beam that the model describes, driven strongly, weakly, touched in every pause. */
static void the_beam_of_the_model(void **state)
{
    static const int levels[] = {700, 350, 700}, pushes[] = {0, 0, 1500};
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        struct beam_truth t = {.sensor = 2048};
        set_up(state);
        drive_level = levels[i];
        truth_begin(&t, "", 1 + i);
        run(&t, 0, 10 * PERIOD, pushes[i]);
        print_modes(&t);
        for (int m = 0; m < MODES; m++) {
            const struct off off = off_by(&t, m, 1.0);
            assert_true(fabs(off.frequency) < 2.0 && fabs(off.damping) < 2.0 && fabs(off.gain) < 2.5);
            assert_true((double)tracked.mode[m].frequency_se_Hz < 0.01 * t.frequency_Hz[m]);
        }
        truth_plant_free(t.plant);
    }
}

/* 0.1 g more at the tip in each pause, 1.8 g of a beam of 44 g at last: the first frequency falls by 7.5 %. */
static void a_mass_that_grows(void **state)
{
    enum { SAME = 6, PERIODS = 24 };
    static uint8_t heavy[BEAM_IMAGE_BYTES];
    static struct beam_image loaded;
    struct beam_truth t = {.sensor = 2048};
    double worst_frequency = 0.0, worst_damping = 0.0;
    char line[80];
    (void)state;
    for (int k = 0; k < PERIODS; k++) {
        (void)snprintf(line, sizeof line, "effect tip_mass mass_kg=%.6g", k < SAME ? 1e-9 : 1e-4 * (k - SAME + 1));
        truth_begin(&t, line, 7 + (uint64_t)k);
        run(&t, k * PERIOD, PERIOD, 0);
        for (int m = 0; m < MODES && k >= 2; m++) {
            worst_frequency = fmax(worst_frequency, fabs(off_by(&t, m, 1.0).frequency));
            worst_damping = fmax(worst_damping, fabs(off_by(&t, m, 1.0).damping));
        }
        truth_plant_free(t.plant);
    }
    print_modes(&t);
    print_message("  furthest off in %d looks: frequency %.2f, damping %.2f of their standard errors\n",
                  (PERIODS - 2) * MODES, worst_frequency, worst_damping);
    assert_true(worst_frequency < 2.0 && worst_damping < 2.0);
    assert_int_equal(make_image_of(1.8e-3, heavy), 0);
    beam_image_write(&loaded, 0, BEAM_IMAGE_BYTES, heavy);
    for (int m = 0; m < 2; m++) { /* the third's gain falls by 80 %, faster than the image lets a gain wander */
        const double gain = strength(&loaded, m) / strength(&image, m);
        print_message("  gain of mode %d: %.3f, true %.3f\n", m + 1, (double)tracked.mode[m].gain, gain);
        assert_true(fabs(off_by(&t, m, gain).gain) < 2.0);
    }
}

/* Nobody drives: of a beam at rest nothing is learnt, and the doubt remains. */
static void noise_teaches_nothing(void **state)
{
    struct beam_truth t = {.sensor = 2048};
    (void)state;
    drive_level = 0;
    truth_begin(&t, "", 5);
    run(&t, 0, 100000, 0);
    for (int m = 0; m < MODES; m++) {
        assert_true(fabs((double)tracked.mode[m].frequency_Hz / t.frequency_Hz[m] - 1.0) < 2e-3);
        assert_true((double)tracked.mode[m].frequency_se_Hz > 0.08 * t.frequency_Hz[m]);
        assert_true(tracked.mode[m].gain == 1.0F && fabsf(tracked.mode[m].gain_se - 0.3F) < 1e-6F);
    }
    assert_int_equal(tracked.samples, 100000);
    truth_plant_free(t.plant);
}

/* Whatever the sensor says: every word stays finite and within its limits. */
static void nothing_leaves_its_limits(void **state)
{
    uint32_t random = 1;
    (void)state;
    for (int k = 0; k < 400000; k++) {
        random = 1664525u * random + 1013904223u;
        const int kind = k / 50000 % 4;
        const uint16_t noise = (uint16_t)(random >> 20), square = k / 37 % 2 ? 4095 : 0;
        const uint16_t sine = (uint16_t)(2048 + lround(2000.0 * sin(2.0 * M_PI * 6.6e-3 * k)));
        const uint16_t code = kind == 0 ? noise : kind == 1 ? square : kind == 2 ? sine : 2048;
        sampler_step(&sampler, &image, code, drive_at(k), 4095, &live);
        if (k % 100 != 0)
            continue;
        track_report(&image, track_of(&image, &sampler.state), &tracked);
        assert_true(isfinite(tracked.innovation_rms));
        for (int m = 0; m < MODES; m++) {
            const struct beam_tracked *q = &tracked.mode[m];
            assert_true(q->frequency_Hz > 0.0F && q->frequency_Hz < 500.0F && q->frequency_se_Hz > 0.0F);
            assert_true(q->damping > 0.0F && q->damping < 1.0F && q->damping_se > 0.0F);
            assert_true(q->gain > 0.0F && q->gain <= 4.001F && q->gain_se > 0.0F && q->gain_se < 0.3001F);
            assert_true(isfinite(q->frequency_se_Hz) && isfinite(q->damping_se));
        }
    }
}

/* ---- What an image may ask for ---- */

static void refused(const char *what)
{
    if (beam_image_check(&image, 0.001F) != BEAM_IMAGE_BAD_SETUP)
        fail_msg("%s was taken", what);
    beam_image_write(&image, 0, BEAM_IMAGE_BYTES, bytes);
}

static void what_no_tracking_may_be(void **state)
{
    static const float wrong[] = {NAN, INFINITY, -1.0F, 1e-44F, 1e30F};
    struct beam_image_tracking *t = &image.front.tracking;
    (void)state;
    t->blocks |= 1u << 15;
    refused("a block that is not observed");
    t->blocks = image.front.observer.blocks;
    refused("eight modes");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        t->wander_s = wrong[i];
        refused("a time of wandering");
        t->kappa = wrong[i];
        refused("kappa");
        if (wrong[i] < 0.0F)
            continue;
        t->heard[1][0] = wrong[i];
        refused("how a mode is heard");
    }
    t->blocks = 1;
    refused("a mode that is heard and not followed");
    image.plan.n.output_ring[0].offset = 20;
    refused("a pool that filters need");
}

static void without_it_there_is_nothing(void **state)
{
    (void)state;
    assert_null(track_of(&silent, &sampler.state));
    track_report(&silent, NULL, &tracked);
    assert_int_equal(tracked.modes, 0);
    assert_int_equal(beam_image_bound(&image) - beam_image_bound(&silent),
                     BEAM_IMAGE_TRACK_FIXED + MODES * BEAM_IMAGE_TRACK_MODE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(the_beam_of_the_model, set_up),
        cmocka_unit_test_setup(a_mass_that_grows, set_up),
        cmocka_unit_test_setup(noise_teaches_nothing, set_up),
        cmocka_unit_test_setup(nothing_leaves_its_limits, set_up),
        cmocka_unit_test_setup(what_no_tracking_may_be, set_up),
        cmocka_unit_test_setup(without_it_there_is_nothing, set_up),
    };
    return cmocka_run_group_tests(tests, make_image, NULL);
}
