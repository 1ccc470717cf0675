/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include "compare/compare.h"
#include "signals.h"
#include "test_files.h"

enum { N = 4096, CHANNELS = 4, BINS = 129 };
static const double dt = 1.0 / 1024.0;
static const double mode_Hz[3] = {6.6, 38.4, 95.5};
static const char *const file[CHANNELS] = {"a/weak.csv", "a/weak.csv", "a/strong.csv", "a/strong.csv"};
static const char *const name[CHANNELS] = {"tip_mps", "accel_mps2", "tip_mps", "accel_mps2"};

/* Two records of two channels; noise of rms `noise`, white, which the estimates know. */
struct rig {
    double z[CHANNELS][N], r[CHANNELS][N], psd[CHANNELS][BINS];
    struct noise_estimate noise[CHANNELS];
    struct misfit_channel channels[CHANNELS];
};
static struct rig rig;

static void make_rig(unsigned set)
{
    uint64_t seed = signal_seed(set);
    memset(&rig, 0, sizeof rig);
    for (size_t c = 0; c < CHANNELS; c++) {
        const double level = c < 2 ? 1.0 : 10.0, noise = 0.01 * level;
        rig.noise[c] = (struct noise_estimate){.method = NOISE_LOCAL, .rms = noise, .rms_sd = 0.012 * noise};
        rig.noise[c].n_bins = BINS;
        rig.noise[c].df_Hz = 512.0 / (BINS - 1);
        rig.noise[c].psd = rig.psd[c];
        for (size_t k = 0; k < BINS; k++)
            rig.psd[c][k] = noise * noise / 512.0;
        for (size_t i = 0; i < N; i++) {
            const double t = (double)i * dt;
            for (int m = 0; m < 3; m++)
                rig.z[c][i] += level * exp(-0.7 * t) * sin(2.0 * M_PI * mode_Hz[m] * t + m);
            rig.r[c][i] = noise * signal_normal(&seed);
            rig.z[c][i] += rig.r[c][i];
        }
        rig.channels[c] = (struct misfit_channel){.file = file[c], .channel = name[c], .record = c / 2};
        rig.channels[c].n = N;
        rig.channels[c].dt_s = dt;
        rig.channels[c].measured = rig.z[c];
        rig.channels[c].residual = rig.r[c];
        rig.channels[c].noise = &rig.noise[c];
    }
}

/* Misfit in one mode of one channel: share of the mode's motion, from `from_s` on. */
static void add_misfit(size_t c, int mode, double share, double from_s)
{
    const double level = c < 2 ? 1.0 : 10.0;
    for (size_t i = (size_t)(from_s / dt); i < N; i++) {
        const double t = (double)i * dt;
        const double x = share * level * exp(-0.7 * t) * cos(2.0 * M_PI * mode_Hz[mode] * t + mode);
        rig.r[c][i] += x;
        rig.z[c][i] += x;
    }
}

static void run(struct localisation *out)
{
    struct bf_error err;
    assert_int_equal(localise_misfit(rig.channels, CHANNELS, mode_Hz, 3, out, &err), BF_OK);
}

static void noise_has_no_place(void **state)
{
    (void)state;
    size_t said = 0;
    for (unsigned set = 0; set < 50; set++) {
        struct localisation l;
        make_rig(set);
        run(&l);
        said += strstr(l.text, "Nothing above the noise") == NULL;
        assert_true(l.excess < 0.02);
        localise_free(&l);
    }
    assert_int_equal(said, 0);
}

static void the_band_is_found(void **state)
{
    (void)state;
    struct localisation l;
    make_rig(1);
    add_misfit(3, 1, 0.2, 0.0);
    run(&l);
    assert_int_equal(l.n, 1);
    assert_int_equal(l.parts[0].channel, 3);
    assert_int_equal(l.parts[0].mode, 2);
    assert_true(l.parts[0].from_Hz < 38.4 && l.parts[0].to_Hz > 38.4);
    assert_true(l.parts[0].share > 0.97 && l.parts[0].share <= 1.0 + 1e-12);
    assert_true(fabs(l.parts[0].relative - 0.2 / sqrt(1.04)) < 0.02);
    assert_int_equal(l.parts[0].amplitude, AMPLITUDE_LARGE); /* the weak record has none */
    assert_contains(l.text, "accel_mps2 of strong.csv");
    assert_contains(l.text, "grows with amplitude");
    localise_free(&l);
}

/* Shares count in units of each channel's noise: the same relative misfit everywhere is spread evenly. */
static void linear_misfit_is_everywhere(void **state)
{
    (void)state;
    struct localisation l;
    double total = 0.0;
    make_rig(2);
    for (size_t c = 0; c < CHANNELS; c++)
        add_misfit(c, 0, 0.1, 0.0);
    run(&l);
    assert_int_equal(l.n, CHANNELS);
    for (size_t i = 0; i < l.n; i++) {
        assert_true(fabs(l.parts[i].share - 0.25) < 0.02);
        assert_int_equal(l.parts[i].amplitude, AMPLITUDE_ALL);
        assert_true(i == 0 || l.parts[i].share <= l.parts[i - 1].share);
        total += l.parts[i].share;
    }
    assert_true(total > 0.98 && total < 1.0 + 1e-9); /* a little leaks into the next band */
    localise_free(&l);
}

/* Friction: its share of the motion falls as the motion grows. */
static void what_falls_with_amplitude(void **state)
{
    (void)state;
    struct localisation l;
    make_rig(3);
    add_misfit(0, 0, 0.2, 0.0);
    add_misfit(2, 0, 0.02, 0.0);
    run(&l);
    assert_int_equal(l.parts[0].channel, 0);
    assert_int_equal(l.parts[0].amplitude, AMPLITUDE_SMALL);
    localise_free(&l);
}

static void late_misfit_is_called_late(void **state)
{
    (void)state;
    struct localisation l;
    make_rig(4);
    add_misfit(2, 2, 0.3, 1.5);
    run(&l);
    assert_int_equal(l.parts[0].mode, 3);
    assert_true(l.parts[0].late_share > 0.9);
    localise_free(&l);
    make_rig(4);
    add_misfit(2, 2, 0.3, 0.0);
    run(&l);
    assert_true(fabs(l.parts[0].late_share - 0.5) < 0.1);
    localise_free(&l);
}

static void a_channel_without_noise_level_is_left_out(void **state)
{
    (void)state;
    struct localisation l;
    make_rig(5);
    add_misfit(0, 0, 0.5, 0.0);
    rig.noise[0].method = NOISE_NONE;
    run(&l);
    assert_int_equal(l.n, 0);
    localise_free(&l);
}

static void json_has_the_keys_of_the_contract(void **state)
{
    (void)state;
    struct localisation l;
    struct bf_error err;
    make_rig(6);
    add_misfit(1, 1, 0.2, 0.0);
    run(&l);
    char *text = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&text, &size);
    assert_int_equal(json_print_and_free(localise_json(&l, rig.channels), f, &err), BF_OK);
    fclose(f);
    const char *const keys[] = {"\"file\"", "\"channel\"", "\"from_Hz\"", "\"to_Hz\"", "\"share\"", "\"amplitude\""};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        assert_contains(text, keys[i]);
    assert_contains(text, "a/weak.csv");
    free(text);
    localise_free(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_has_no_place),
        cmocka_unit_test(the_band_is_found),
        cmocka_unit_test(linear_misfit_is_everywhere),
        cmocka_unit_test(what_falls_with_amplitude),
        cmocka_unit_test(late_misfit_is_called_late),
        cmocka_unit_test(a_channel_without_noise_level_is_left_out),
        cmocka_unit_test(json_has_the_keys_of_the_contract),
    };
    return cmocka_run_group_tests_name("localise", tests, NULL, NULL);
}
