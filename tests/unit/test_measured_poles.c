/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The poles that records of the truth simulator's beams show, against closed form, their standard errors, and shapes of several places. */
#include "truth_hit.h"

#include <stdio.h>

#include "compare/compare.h"
#include "signals.h"
#include "steel_strip.h"

enum { ROVING = 4 };

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.35}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 52.1}\n"
                                 "  rho_beam_kgpm: {value: 0.97}\n"
                                 "  cDI_beam_sNm2: {value: 1.1e-4}\n"
                                 "  gamma_sNpm2: {value: 1.3}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.30}}\n"
                                 "outputs:\n"
                                 "  accel_mps2: {kind: acceleration, at_m: 0.28, gain: 0.5}\n"
                                 "  laser_mps: {kind: velocity, at_m: 0.20}\n"
                                 "  tip_m: {kind: displacement, at_m: 0.35}\n"
                                 "effects: []\n";

/* Of the named outputs' columns as the simulator has them; the accelerometer's is halved, as the model's gain says. */
static struct record hit(double at_m, double duration_s)
{
    struct truth_spec spec;
    char line[160];
    truth_spec_default(&spec);
    spec.length_m = length;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, length, EI, rho, cDI, 3e-6};
    spec.gamma_sNpm2 = viscous;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = duration_s;
    spec.modes = 20;
    (void)snprintf(line, sizeof line, "input hammer_N point_force at_m=%.3f", at_m);
    say(&spec, line);
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    say(&spec, "output laser_mps velocity at_m=0.20");
    say(&spec, "output tip_m displacement at_m=0.35");
    say(&spec, "signal hammer_N raised_cosine start_s=0.1 width_s=0.002 level=40");
    struct record record = hit_of(&spec);
    double *x = (double *)record_column(&record, "accel_mps2");
    for (size_t i = 0; i < record.n; i++)
        x[i] *= 0.5;
    return record;
}

/* noise: of each channel's largest value. */
static void add_noise(struct record *record, double noise, unsigned draw)
{
    uint64_t seed = signal_seed(40 + draw);
    for (size_t c = 0; c < record->n_columns; c++) {
        double *x = record->columns[c].x, most = 0.0;
        if (strcmp(record->columns[c].name, "hammer_N") == 0)
            continue;
        for (size_t i = 0; i < record->n; i++)
            most = fmax(most, fabs(x[i]));
        for (size_t i = 0; i < record->n; i++)
            x[i] += noise * most * signal_normal(&seed);
    }
}

/* text: the model, or one that is off. */
static struct pole_table table_of(const char *text, struct record records[], size_t n)
{
    struct model model;
    struct comparison all;
    struct stabilisation stable;
    struct pole_table table;
    struct bf_error err;
    if (model_read_text("strip.yaml", text, strlen(text), &model, &err) != BF_OK ||
        compare_run(&model, records, n, 0, NULL, &all, &err) != BF_OK ||
        stabilisation_find(&all, &stable, &err) != BF_OK || pole_table_of_records(&all, &stable, &table, &err) != BF_OK)
        fail_msg("%s", err.text);
    stabilisation_free(&stable);
    compare_free(&all);
    model_free(&model);
    return table;
}

/* Frequencies and damping ratios are off by about their standard errors: mean square of 72 of them. */
static void errors_are_what_they_are_said_to_be(void **state)
{
    (void)state;
    enum { DRAWS = 12 };
    double sum = 0.0;
    struct record clean = hit(0.30, 2.0);
    for (unsigned d = 0; d < DRAWS; d++) {
        struct record record = {.path = strdup("hit.csv"), .n = clean.n, .dt_s = clean.dt_s};
        for (size_t c = 0; c < clean.n_columns; c++)
            record_add_column(&record, clean.columns[c].name, clean.columns[c].x);
        add_noise(&record, 0.003, d);
        struct pole_table table = table_of(model_text, &record, 1);
        assert_int_equal(table.n, STRIP_MODES);
        for (size_t m = 0; m < STRIP_MODES; m++) {
            const struct measured_frequency *one = &table.pairs[m].measured;
            assert_int_equal(table.pairs[m].mode, m + 1);
            assert_true(one->sd_Hz > 0.0 && one->damping_sd > 0.0);
            sum += pow((one->frequency_Hz - mode_rad(m) / (2.0 * pi)) / one->sd_Hz, 2.0);
            sum += pow((one->damping_ratio - mode_damping(m)) / one->damping_sd, 2.0);
        }
        pole_table_free(&table);
        record_free(&record);
    }
    print_message("mean square of errors over standard errors %.2f\n", sum / (2 * STRIP_MODES * DRAWS));
    assert_true(sum / (2 * STRIP_MODES * DRAWS) > 0.6 &&
                sum / (2 * STRIP_MODES * DRAWS) < 1.6); /* χ² of 72: 1 ± 0.17 */
    record_free(&clean);
}

static double least_mac(const struct pole_table *table)
{
    double least = 1.0;
    for (size_t i = 0; i < table->n; i++) {
        print_message("mode %zu, MAC %.6f\n", table->pairs[i].mode, table->pairs[i].mac);
        least = fmin(least, table->pairs[i].mac);
    }
    return least;
}

/* Three sensors of three kinds, one with a gain. Where one of them is said to be elsewhere, its shapes are not the beam's. */
static void sensors_tell_shapes(void **state)
{
    (void)state;
    struct record record = hit(0.30, 2.0);
    add_noise(&record, 2e-4, 0); /* of the largest deflection, of which mode 3 has little */
    struct pole_table table = table_of(model_text, &record, 1);
    assert_int_equal(table.places, 3);
    assert_true(least_mac(&table) > 0.9995);
    pole_table_free(&table);
    char *wrong = strdup(model_text), *place = strstr(wrong, "at_m: 0.20");
    place[strlen("at_m: 0.2")] = '9'; /* 0.29 */
    table = table_of(wrong, &record, 1);
    assert_true(least_mac(&table) < 0.95);
    pole_table_free(&table);
    free(wrong);
    record_free(&record);
}

/* One sensor, and a hammer that moves from record to record, as the records say. */
static void a_roving_hammer_tells_shapes(void **state)
{
    (void)state;
    static const double at_m[ROVING] = {0.12, 0.19, 0.25, 0.33};
    struct record records[ROVING];
    for (size_t r = 0; r < ROVING; r++) {
        struct record whole = hit(at_m[r], 2.0);
        char text[16];
        records[r] = (struct record){.path = strdup("hit.csv"), .n = whole.n, .dt_s = whole.dt_s};
        record_add_column(&records[r], "hammer_N", record_column(&whole, "hammer_N"));
        record_add_column(&records[r], "laser_mps", record_column(&whole, "laser_mps"));
        (void)snprintf(text, sizeof text, "%.2f", at_m[r]);
        record_add_meta(&records[r], "hammer_N.at_m", text);
        add_noise(&records[r], 0.002, (unsigned)r);
        record_free(&whole);
    }
    struct pole_table table = table_of(model_text, records, ROVING);
    assert_int_equal(table.places, ROVING);
    assert_true(least_mac(&table) > 0.9999);
    pole_table_free(&table);
    table = table_of(model_text, records, 1);
    assert_true(table.n == STRIP_MODES && isnan(table.pairs[0].mac)); /* one place has no shape */
    pole_table_free(&table);
    for (size_t r = 0; r < ROVING; r++)
        record_free(&records[r]);
}

static void a_free_decay_has_poles_and_shapes(void **state)
{
    (void)state;
    struct record whole = hit(0.30, 2.0), decay = {.path = strdup("decay.csv"), .dt_s = whole.dt_s};
    const size_t from = 614;
    decay.n = whole.n - from;
    for (size_t c = 0; c < whole.n_columns; c++)
        if (strcmp(whole.columns[c].name, "hammer_N") != 0)
            record_add_column(&decay, whole.columns[c].name, whole.columns[c].x + from);
    record_add_meta(&decay, "excitation", "free_decay");
    add_noise(&decay, 0.0005, 0);
    struct pole_table table = table_of(model_text, &decay, 1);
    assert_true(table.n >= 2 && table.places == 3);
    for (size_t m = 0; m < 2; m++) {
        assert_true(fabs(table.pairs[m].measured.frequency_Hz * 2.0 * pi / mode_rad(m) - 1.0) < 1e-4);
        assert_true(fabs(table.pairs[m].measured.damping_ratio / mode_damping(m) - 1.0) < 0.02);
        assert_true(table.pairs[m].mac > 0.999);
    }
    pole_table_free(&table);
    record_free(&decay), record_free(&whole);
}

/* Hits averaged under an exponential window: its damping is not among that of the poles. */
static void a_window_is_taken_off(void **state)
{
    (void)state;
    struct record hits[2] = {hit(0.30, 1.5), hit(0.30, 1.4)}, lines, period;
    struct average average;
    struct bf_error err;
    const struct average_options how = {.window_s = 0.15};
    for (unsigned k = 0; k < 2; k++)
        add_noise(&hits[k], 0.001, k);
    assert_int_equal(record_average(hits, 2, &how, &lines, &average, &err), BF_OK);
    average_free(&average);
    assert_int_equal(record_from_response(&lines, &period, &err), BF_OK);
    struct pole_table table = table_of(model_text, &period, 1);
    assert_int_equal(table.n, STRIP_MODES);
    for (size_t m = 0; m < STRIP_MODES; m++)
        assert_true(fabs(table.pairs[m].measured.damping_ratio / mode_damping(m) - 1.0) <
                    0.05); /* 1/0.15 s is 10 times that of mode 1 */
    assert_true(least_mac(&table) > 0.999);
    pole_table_free(&table);
    record_free(&lines), record_free(&period), record_free(&hits[0]), record_free(&hits[1]);
}

static void noise_has_no_poles(void **state)
{
    (void)state;
    struct record record = hit(0.30, 1.0);
    add_noise(&record, 100.0, 0);
    struct pole_table table = table_of(model_text, &record, 1);
    assert_int_equal(table.n, 0);
    pole_table_free(&table);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_what_they_are_said_to_be),
        cmocka_unit_test(sensors_tell_shapes),
        cmocka_unit_test(a_roving_hammer_tells_shapes),
        cmocka_unit_test(a_free_decay_has_poles_and_shapes),
        cmocka_unit_test(a_window_is_taken_off),
        cmocka_unit_test(noise_has_no_poles),
    };
    return cmocka_run_group_tests_name("measured_poles", tests, NULL, NULL);
}
