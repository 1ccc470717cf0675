/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include "noise/noise.h"
#include "noise/linearity_added.h"
#include "model_fixture.h"
#include "signals.h"
#include "test_files.h"

/* BEAMFIT_SETS sets instead of 12: the calibration of docs/diagnose.md is `BEAMFIT_SETS=400 test_linearity`. */
enum { N = 4096, RECORDS = 4 };
static const double dt = 1.0 / 1024.0;
static const double mode_Hz[5] = {6.6, 38.4, 95.5, 178.7, 305.2};
static const double damping[5] = {0.0017, 0.001, 0.0015, 0.0025, 0.004};

/* What is wrong with a simulated path; everything 0: nothing. */
struct fault {
    double square, even; /* y += square · w|w|/scale, y += even · |w| */
    double hum, offset, drift;
    double colour; /* of the noise, AR(1) */
};

static void fill_input(size_t record, double level, double *u)
{
    memset(u, 0, N * sizeof *u);
    for (size_t i = 0; i < N; i++) {
        const double t = (double)i * dt, since = t - 0.1, width = record == 0 ? 0.012 : 0.008;
        if (record < 2 && since > 0.0 && since < width)
            u[i] = level * (0.5 - 0.5 * cos(2.0 * M_PI * since / width));
        else if (record >= 2)
            u[i] = level * fmin(1.0, 10.0 * t) * sin(2.0 * M_PI * (4.0 + 42.0 * t) * t);
    }
}

static void respond(const double *u, int channel, const struct fault *fault, uint64_t *seed, double *y)
{
    static double e[N];
    memset(y, 0, N * sizeof *y);
    for (int m = 0; m < 5; m++)
        signal_add_mode(mode_Hz[m], damping[m], ((m + channel) % 2 ? -1.0 : 1.0) / (1.0 + m + channel), dt, u, N, 0.0,
                        y);
    const double noise = 0.004 * signal_rms(y, N), phase = 6.0 * signal_uniform(seed);
    signal_ar2(seed, fault->colour, 0.0, sqrt(1.0 - fault->colour * fault->colour), N, e);
    for (size_t i = 0; i < N; i++) {
        const double t = (double)i * dt, w = y[i];
        y[i] += fault->square * w * fabs(w) + fault->even * fabs(w) + noise * e[i];
        y[i] += fault->hum * sin(2.0 * M_PI * 49.97 * t + phase) + fault->offset + fault->drift * (t / (N * dt) - 0.5);
    }
}

/* hammer_N to piezo_V at levels[0], [1]; drive_V to tip_mps at levels[2], [3]. */
static void make_records(const struct fault *fault, const double levels[RECORDS], unsigned set, struct record *out)
{
    static double u[N], y[N];
    uint64_t seed = signal_seed(set + 40);
    for (size_t r = 0; r < RECORDS; r++) {
        out[r] = (struct record){.n = N, .dt_s = dt};
        fill_input(r, levels[r], u);
        record_add_column(&out[r], r < 2 ? "hammer_N" : "drive_V", u);
        respond(u, r < 2 ? 0 : 1, fault, &seed, y);
        record_add_column(&out[r], r < 2 ? "piezo_V" : "tip_mps", y);
    }
}

static void run(const struct fault *fault, const double levels[RECORDS], unsigned set, struct linearity *out)
{
    struct model model;
    struct record records[RECORDS];
    struct bf_error err;
    fixture_model(&model, "");
    make_records(fault, levels, set, records);
    assert_int_equal(linearity_test(&model, records, RECORDS, NULL, out, &err), BF_OK);
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&records[r]);
    model_free(&model);
}

static const double usual[RECORDS] = {1.0, 10.0, 1.0, 10.0};

static size_t sets_wanted(void)
{
    const char *text = getenv("BEAMFIT_SETS");
    const int wanted = text != NULL ? (int)strtol(text, NULL, 10) : 0;
    return wanted > 0 ? (size_t)wanted : 12;
}

static void check_linear(double colour)
{
    const size_t sets = sets_wanted();
    double n = 0.0, mean = 0.0, square = 0.0, highest = 0.0, worst = 0.0;
    size_t alarms = 0, added = 0;
    for (unsigned set = 0; set < sets; set++) {
        struct linearity l;
        run(&(struct fault){.colour = colour}, usual, set, &l);
        assert_int_equal(l.n_pairs, 2);
        for (size_t i = 0; i < l.n_pairs; i++) {
            n += 1.0;
            mean += l.pairs[i].ratio;
            square += l.pairs[i].ratio * l.pairs[i].ratio;
            highest = fmax(highest, l.pairs[i].ratio);
            worst = fmax(worst, l.pairs[i].worst_ratio);
        }
        alarms += l.verdict == LINEARITY_NONLINEAR;
        added += l.n_added;
        linearity_free(&l);
    }
    mean /= n;
    const double sd = sqrt(square / n - mean * mean);
    print_message(
        "linear, noise AR(1) %.1f, %zu sets: ratio %.3f, sd %.3f, highest %.3f, highest third of an octave %.2f; "
        "%zu called nonlinear, %zu added signals\n",
        colour, sets, mean, sd, highest, worst, alarms, added);
    assert_true(fabs(mean - 1.0) < (colour > 0.0 ? 0.10 : 0.03)); /* the smooth spectrum of steep noise, see docs */
    assert_true(sd < 0.04);
    assert_true((double)alarms <= 0.02 * (double)sets);
    assert_true((double)added <= 0.02 * (double)sets);
}

/* Ringing past the end of the record, hits of different shape. */
static void linear_records_agree(void **state)
{
    (void)state;
    check_linear(0.0);
    check_linear(0.8);
}

static void a_square_law_shows(void **state)
{
    (void)state;
    struct linearity l;
    run(&(struct fault){.square = 0.002}, usual, 1, &l);
    assert_int_equal(l.verdict, LINEARITY_NONLINEAR);
    for (size_t i = 0; i < l.n_pairs; i++) {
        assert_true(l.pairs[i].nonlinear);
        assert_true(l.pairs[i].ratio > 1.3);
        assert_true(l.pairs[i].record[0] < l.pairs[i].record[1]); /* weak first */
        assert_true(l.pairs[i].level[1] > 4.0 * l.pairs[i].level[0]);
    }
    assert_false(l.pairs[l.pairs[0].output == 0].same_shape && l.pairs[l.pairs[0].output != 0].same_shape);
    assert_contains(l.text, "No linear time-invariant system");
    linearity_free(&l);
}

static const struct linearity_pair *pair_of(const struct linearity *l, size_t output)
{
    for (size_t i = 0; i < l->n_pairs; i++)
        if (l->pairs[i].output == output)
            return &l->pairs[i];
    fail_msg("no pair of output %zu", output);
    return NULL;
}

/* |w| is of degree 1: two levels of one chirp do not show it, a chirp of opposite sign does. */
static void degree_one_shows_only_with_opposite_signs(void **state)
{
    (void)state;
    struct linearity l;
    const double opposite[RECORDS] = {1.0, 10.0, 1.0, -10.0};
    run(&(struct fault){.even = 0.2}, usual, 2, &l);
    assert_false(pair_of(&l, 2)->nonlinear);
    assert_true(pair_of(&l, 2)->same_shape);
    linearity_free(&l);
    run(&(struct fault){.even = 0.2}, opposite, 2, &l);
    assert_true(pair_of(&l, 2)->nonlinear);
    assert_true(pair_of(&l, 2)->opposite);
    linearity_free(&l);
}

static void hum_is_told_apart(void **state)
{
    (void)state;
    struct linearity l;
    run(&(struct fault){.hum = 0.3}, usual, 3, &l);
    assert_int_equal(l.verdict, LINEARITY_ADDITIVE);
    assert_true(l.pairs[0].ratio > 2.0);
    size_t seen = l.n_added;
    for (size_t i = 0; i < l.n_pairs; i++)
        if (l.pairs[i].n_added > 0) {
            seen++;
            assert_true(fabs(l.pairs[i].added_Hz - 49.97) < 0.05);
        }
    assert_true(seen >= 2);
    for (size_t i = 0; i < l.n_added; i++) {
        assert_true(fabs(l.added[i].frequency_Hz - 49.97) < 0.02);
        assert_true(fabs(l.added[i].amplitude / 0.3 - 1.0) < 0.1);
        assert_true(l.added[i].sd > 0.0);
    }
    linearity_free(&l);
}

static void offset_and_drift_are_told_apart(void **state)
{
    (void)state;
    struct linearity l;
    run(&(struct fault){.offset = 0.5, .drift = 0.4}, usual, 4, &l);
    assert_int_equal(l.verdict, LINEARITY_ADDITIVE);
    size_t offsets = 0, drifts = 0;
    for (size_t i = 0; i < l.n_added; i++) {
        assert_true(l.added[i].frequency_Hz < 1e-9);
        assert_true(fabs(l.added[i].amplitude - (l.added[i].drift ? 0.4 : 0.5)) < 0.05);
        offsets += !l.added[i].drift;
        drifts += l.added[i].drift;
    }
    assert_true(offsets >= 3 && drifts >= 2);
    linearity_free(&l);
}

static void one_level_cannot_tell(void **state)
{
    (void)state;
    struct linearity l;
    const double equal[RECORDS] = {1.0, 1.0, 3.0, 3.0};
    run(&(struct fault){0}, equal, 5, &l);
    assert_int_equal(l.verdict, LINEARITY_CANNOT_TELL);
    linearity_free(&l);
    struct model model;
    struct record records[RECORDS];
    struct bf_error err;
    fixture_model(&model, "");
    make_records(&(struct fault){0}, usual, 5, records);
    assert_int_equal(linearity_test(&model, records, 1, NULL, &l, &err), BF_OK);
    assert_int_equal(l.verdict, LINEARITY_CANNOT_TELL);
    assert_int_equal(l.n_pairs, 0);
    linearity_free(&l);
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&records[r]);
    model_free(&model);
}

/* A line of the drive is no hum, noise has no lines, and a short or constant series says nothing. */
static void what_is_no_added_signal(void **state)
{
    (void)state;
    static double x[N], u[N];
    struct linearity_added found[8];
    const double *const inputs[1] = {u};
    uint64_t seed = signal_seed(11);
    for (size_t i = 0; i < N; i++) {
        u[i] = sin(2.0 * M_PI * 60.0 * (double)i * dt);
        x[i] = 0.01 * signal_normal(&seed) + u[i];
    }
    assert_int_equal(linearity_find_added(x, N, dt, inputs, 1, found, 8), 0);
    assert_int_equal(linearity_find_added(x, N, dt, NULL, 0, found, 8), 1);
    size_t in_noise = 0;
    for (int set = 0; set < 100; set++) {
        for (size_t i = 0; i < N; i++)
            x[i] = signal_normal(&seed);
        in_noise += linearity_find_added(x, N, dt, NULL, 0, found, 8);
    }
    assert_int_equal(in_noise, 0);
    assert_int_equal(linearity_find_added(x, 100, dt, NULL, 0, found, 8), 0);
    memset(x, 0, sizeof x);
    assert_int_equal(linearity_find_added(x, N, dt, NULL, 0, found, 8), 0);
}

/* Hum in what a model leaves: its power, and nothing of a mode that decays, of a line elsewhere, or of one that an input has. */
static void hum_is_told_from_what_a_beam_does(void **state)
{
    (void)state;
    enum { HUM, DECAY, ELSEWHERE, DRIVEN, KINDS };
    static double x[N], u[N];
    struct model model;
    fixture_model(&model, "");
    for (int kind = 0; kind < KINDS; kind++) {
        uint64_t seed = signal_seed(61);
        for (size_t i = 0; i < N; i++) {
            const double t = (double)i * dt, hum = sin(2.0 * M_PI * 50.02 * t + 1.0);
            u[i] = kind == DRIVEN ? hum : 0.0;
            x[i] = signal_normal(&seed);
            x[i] += kind == ELSEWHERE ? sin(2.0 * M_PI * 81.0 * t) : kind == DECAY ? 3.0 * exp(-2.0 * t) * hum : hum;
        }
        struct record record = {.path = strdup("test.csv"), .n = N, .dt_s = dt};
        record_add_column(&record, model.inputs[0].name, u);
        const double power = mains_power(&model, &record, x, N);
        if (kind == HUM)
            assert_true(fabs(power - 0.5) < 0.05);
        else
            assert_true(power == 0.0);
        record_free(&record);
    }
    model_free(&model);
}

static void check_case(const char *name, enum linearity_verdict expected)
{
    struct model model;
    struct record records[RECORDS];
    struct linearity l;
    struct bf_error err;
    char path[128];
    size_t n = 0;
    snprintf(path, sizeof path, "data/open/%s/model.yaml", name);
    char *file = shared_file(path);
    if (file == NULL)
        skip();
    assert_int_equal(model_read(file, &model, &err), BF_OK);
    free(file);
    for (; n < RECORDS; n++) {
        snprintf(path, sizeof path, "data/open/%s/train%zu.csv", name, n + 1);
        file = shared_file(path);
        assert_non_null(file);
        assert_int_equal(record_read(file, &records[n], &err), BF_OK);
        free(file);
    }
    assert_int_equal(linearity_test(&model, records, RECORDS, NULL, &l, &err), BF_OK);
    if (l.verdict != expected)
        fail_msg("%s: %s", name, l.text);
    linearity_free(&l);
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&records[r]);
    model_free(&model);
}

static void open_cases(void **state)
{
    (void)state;
    check_case("o0_clean", LINEARITY_LINEAR);
    check_case("o2_root_compliance", LINEARITY_LINEAR);
    check_case("o3_quadratic_drag", LINEARITY_NONLINEAR);
    check_case("o5_coulomb_friction", LINEARITY_NONLINEAR);
    check_case("o6_stop_contact", LINEARITY_NONLINEAR);
    check_case("o7_viscoelastic", LINEARITY_LINEAR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_records_agree),
        cmocka_unit_test(a_square_law_shows),
        cmocka_unit_test(degree_one_shows_only_with_opposite_signs),
        cmocka_unit_test(hum_is_told_apart),
        cmocka_unit_test(offset_and_drift_are_told_apart),
        cmocka_unit_test(one_level_cannot_tell),
        cmocka_unit_test(what_is_no_added_signal),
        cmocka_unit_test(hum_is_told_from_what_a_beam_does),
        cmocka_unit_test(open_cases),
    };
    return cmocka_run_group_tests_name("linearity", tests, NULL, NULL);
}
