/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Repeated hits of the truth simulator's beam: their scatter is the noise, and the one that was hit elsewhere stands out. */
#include "truth_hit.h"

#include <stdio.h>

#include "noise/noise.h"
#include "signals.h"

static const char model_text[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.35}\n"
    "parameters: {EI_beam_Nm2: 100, rho_beam_kgpm: 1.2}\n"
    "inputs: {hammer_N: {kind: point_force, at_m: 0.30}}\n"
    "outputs: {accel_mps2: {kind: acceleration, at_m: 0.28}, laser_mps: {kind: velocity, at_m: 0.2}}\n";

enum { HITS = 4 };

/* Hits of other strength, at other times, of other length. */
static struct record hit(unsigned k, double at_m, double noise)
{
    struct truth_spec spec;
    char line[160];
    uint64_t seed = signal_seed(20 + k);
    truth_spec_default(&spec);
    spec.length_m = 0.35;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, 0.35, 100.0, 1.21, 6e-4, 3e-6};
    spec.gamma_sNpm2 = 2.0;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = 1.0 + 0.1 * k;
    spec.modes = 20;
    (void)snprintf(line, sizeof line, "input hammer_N point_force at_m=%.3f", at_m);
    say(&spec, line);
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    say(&spec, "output laser_mps velocity at_m=0.2");
    (void)snprintf(line, sizeof line, "signal hammer_N raised_cosine start_s=%.3f width_s=0.002 level=%u",
                   0.05 + 0.0133 * k, 40 + 10 * k);
    say(&spec, line);
    struct record record = hit_of(&spec);
    for (size_t c = 0; c < record.n_columns; c++) {
        double *x = (double *)record_column(&record, record.columns[c].name), most = 0.0;
        if (strcmp(record.columns[c].name, "hammer_N") == 0)
            continue;
        for (size_t i = 0; i < record.n; i++)
            most = fmax(most, fabs(x[i]));
        for (size_t i = 0; i < record.n; i++)
            x[i] += noise * most * signal_normal(&seed);
    }
    return record;
}

static struct model read_model(void)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("test.yaml", model_text, sizeof model_text - 1, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

static struct repeatability found(const struct record records[], size_t n, const double noise_rms[])
{
    struct model model = read_model();
    struct repeatability out;
    struct bf_error err;
    if (repeatability_find(&model, records, n, noise_rms, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    model_free(&model);
    return out;
}

/* Noise of s of the peak is s √(Σ w²)/√(Σ z² w²) of the signal under the window; twice the noise, twice the scatter. */
static void the_scatter_is_the_noise(void **state)
{
    (void)state;
    double nrmse[3][2];
    for (int level = 0; level < 3; level++) {
        struct record records[HITS];
        for (unsigned k = 0; k < HITS; k++)
            records[k] = hit(k, 0.30, 0.002 * level);
        struct repeatability out = found(records, HITS, NULL);
        assert_int_equal(out.n, 2);
        for (size_t c = 0; c < 2; c++) {
            assert_int_equal(out.all[c].n_records, HITS);
            assert_false(out.all[c].repeats.stands_out && level > 0);
            nrmse[level][c] = out.all[c].repeats.nrmse;
        }
        repeatability_free(&out);
        for (size_t k = 0; k < HITS; k++)
            record_free(&records[k]);
    }
    for (size_t c = 0; c < 2; c++) {
        assert_true(nrmse[0][c] < 1e-3); /* the method's own error */
        assert_true(nrmse[1][c] > 0.004 && nrmse[1][c] < 0.04);
        assert_true(fabs(nrmse[2][c] / nrmse[1][c] - 2.0) < 0.05);
    }
}

static void a_hit_elsewhere_stands_out(void **state)
{
    (void)state;
    struct record records[HITS];
    for (unsigned k = 0; k < HITS; k++)
        records[k] = hit(k, k == 2 ? 0.27 : 0.30, 0.002);
    struct repeatability out = found(records, HITS, NULL);
    assert_int_equal(out.n, 2);
    for (size_t c = 0; c < 2; c++) {
        assert_true(out.all[c].repeats.stands_out && out.all[c].repeats.odd == 2);
        assert_true(out.all[c].repeats.odd_nrmse > 0.05 && out.all[c].repeats.others_nrmse < 0.04);
    }
    repeatability_free(&out);
    for (size_t k = 0; k < HITS; k++)
        record_free(&records[k]);
}

/* In units of the noise the scatter is 1, and it is told how much stronger one hit is than another. */
static void scatter_counts_in_the_noise(void **state)
{
    (void)state;
    struct record records[HITS];
    double rms[HITS][2];
    for (unsigned k = 0; k < HITS; k++) {
        records[k] = hit(k, 0.30, 0.004);
        struct record clean = hit(k, 0.30, 0.0);
        for (size_t c = 0; c < 2; c++) {
            static const char *const names[2] = {"accel_mps2", "laser_mps"};
            const double *z = record_column(&records[k], names[c]), *y = record_column(&clean, names[c]);
            double sum = 0.0;
            for (size_t i = 0; i < clean.n; i++)
                sum += (z[i] - y[i]) * (z[i] - y[i]);
            rms[k][c] = sqrt(sum / (double)clean.n);
        }
        record_free(&clean);
    }
    struct repeatability out = found(records, HITS, &rms[0][0]);
    for (size_t c = 0; c < 2; c++) {
        assert_true(fabs(out.all[c].noise_ratio - 1.0) < 0.15); /* some 200 samples under the window, 3 times */
        assert_true(fabs(out.all[c].strongest / out.all[c].weakest - 70.0 / 40.0) < 0.2); /* peaks between samples */
    }
    rms[1][0] = 0.0;
    repeatability_free(&out);
    out = found(records, HITS, &rms[0][0]);
    assert_true(isnan(out.all[0].noise_ratio) && !isnan(out.all[1].noise_ratio)); /* one unknown */
    repeatability_free(&out);
    for (size_t k = 0; k < HITS; k++)
        record_free(&records[k]);
}

/* One hit, a free decay, a hit whose place the record states: nothing repeats. */
static void what_is_no_repetition_is_left_alone(void **state)
{
    (void)state;
    struct record records[3] = {hit(0, 0.30, 0.002), hit(1, 0.30, 0.002), hit(2, 0.30, 0.002)};
    record_add_meta(&records[1], "excitation", "free_decay");
    record_add_meta(&records[2], "hammer_N.at_m", "0.2");
    struct repeatability out = found(records, 3, NULL);
    assert_int_equal(out.n, 0);
    repeatability_free(&out);
    for (size_t k = 0; k < 3; k++)
        record_free(&records[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_scatter_is_the_noise),
        cmocka_unit_test(scatter_counts_in_the_noise),
        cmocka_unit_test(a_hit_elsewhere_stands_out),
        cmocka_unit_test(what_is_no_repetition_is_left_alone),
    };
    return cmocka_run_group_tests_name("repeatability", tests, NULL, NULL);
}
