/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The noise of records: a channel by the model's names, the open cases of another simulator, doubts of several channels. */
#include "noise_rig.h"

#include <stdio.h>

#include "test_files.h"

static void a_channel_of_a_model(void **state)
{
    (void)state;
    static double u[N], z[N];
    struct model model = {0};
    struct model_input input = {.name = "hammer_N"};
    struct record record = {.path = (char *)"x.csv", .n = N, .dt_s = dt};
    struct noise_estimate with, alone;
    struct bf_error err;
    uint64_t seed = signal_seed(1100);
    fill_drive(RANDOM, 0, &seed, u);
    respond(u, 0.0, z);
    const double truth = 0.01 * signal_rms(z, N);
    for (size_t i = 0; i < N; i++)
        z[i] += truth * signal_normal(&seed);
    model.n_inputs = 1;
    model.inputs = &input;
    struct record_column columns[2] = {{.name = (char *)"hammer_N", .x = u}, {.name = (char *)"piezo_V", .x = z}};
    record.n_columns = 2;
    record.columns = columns;
    assert_int_equal(noise_of_channel(&model, &record, "piezo_V", &with, &err), BF_OK);
    assert_true(fabs(with.rms / truth - 1.0) < 0.05);
    struct record_meta meta[2] = {{(char *)"excitation", (char *)"free_decay"}, {(char *)"free_from_s", (char *)"0.5"}};
    record.meta = meta;
    record.n_meta = 2; /* without its input some of the response to random drive looks like noise */
    assert_int_equal(noise_of_channel(&model, &record, "piezo_V", &alone, &err), BF_OK);
    assert_true(alone.rms > 1.05 * with.rms);
    noise_free(&alone);
    record.n_meta = 0;
    assert_int_equal(noise_of_channel(&model, &record, "piezo_V", &alone, &err), BF_OK); /* remembered */
    assert_true(alone.n_bins == with.n_bins && fabs(alone.rms / with.rms - 1.0) < 1e-15);
    for (size_t k = 0; k < with.n_bins; k++)
        assert_true(fabs(alone.psd[k] / with.psd[k] - 1.0) < 1e-15);
    noise_free(&alone);
    for (size_t i = 0; i < N; i++)
        z[i] *= 2.0; /* another channel in the same place */
    assert_int_equal(noise_of_channel(&model, &record, "piezo_V", &alone, &err), BF_OK);
    assert_true(fabs(alone.rms / with.rms - 2.0) < 1e-6);
    noise_free(&alone);
    noise_free(&with);
    assert_int_equal(noise_of_channel(&model, &record, "none", &alone, &err), BF_BAD_FILE);
    assert_contains(err.text, "x.csv");
    assert_contains(err.text, "none");
}

/* ---- The open cases: 0.4 % of each channel's rms, whatever the beam does ---- */

static double open_ratio(const char *path, const char *input, const char *output)
{
    struct record record;
    struct bf_error err;
    assert_int_equal(record_read(path, &record, &err), BF_OK);
    const double *z = record_column(&record, output);
    const double ratio = estimate(z, record.n, record_column(&record, input), 0) / (0.004 * signal_rms(z, record.n));
    record_free(&record);
    return ratio;
}

static void open_cases(void **state)
{
    (void)state;
    static const char *const cases[8] = {"o0_clean",          "o1_tip_mass",        "o2_root_compliance",
                                         "o3_quadratic_drag", "o4_sensor_highpass", "o5_coulomb_friction",
                                         "o6_stop_contact",   "o7_viscoelastic"};
    static const struct {
        const char *record, *input, *output;
    } channels[6] = {{"train1", "hammer_N", "piezo_V"},   {"train2", "hammer_N", "piezo_V"},
                     {"train3", "drive_V", "accel_mps2"}, {"train3", "drive_V", "tip_mps"},
                     {"train4", "drive_V", "accel_mps2"}, {"train4", "drive_V", "tip_mps"}};
    double mean = 0.0, square = 0.0;
    int n = 0, far = 0;
    for (int c = 0; c < 8; c++)
        for (int i = 0; i < 6; i++) {
            char name[128];
            (void)snprintf(name, sizeof name, "data/open/%s/%s.csv", cases[c], channels[i].record);
            char *path = shared_file(name);
            if (path == NULL) {
                skip();
                return;
            }
            const double ratio = open_ratio(path, channels[i].input, channels[i].output);
            free(path);
            const bool linear = c != 3 && c != 5 && c != 6;
            if (linear) {
                mean += ratio;
                square += (ratio - 1.0) * (ratio - 1.0);
                n++;
            }
            far += fabs(ratio - 1.0) > 0.12;
            if (fabs(ratio - 1.0) > (linear ? 0.05 : 0.3))
                fail_msg("%s %s: %.3f of the truth", name, channels[i].output, ratio);
        }
    assert_true(fabs(mean / n - 1.0) < 0.01);
    assert_true(sqrt(square / n) < 0.02);
    assert_true(far <= 1);
}

/* Errors of one record's channels are one error; those of records are independent. */
static void doubts_of_one_record_add_up(void **state)
{
    (void)state;
    static const double doubt[4] = {0.3, 0.3, 0.3, 0.3};
    static const size_t one[4] = {2, 2, 2, 2}, two[4] = {0, 1, 0, 1}, four[4] = {0, 1, 2, 3};
    assert_true(fabs(noise_ratio_doubt(doubt, one, 4) - 0.3) < 1e-12);
    assert_true(fabs(noise_ratio_doubt(doubt, two, 4) - 0.3 / sqrt(2.0)) < 1e-12);
    assert_true(fabs(noise_ratio_doubt(doubt, four, 4) - 0.15) < 1e-12);
    assert_true(noise_ratio_doubt(NULL, NULL, 0) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_channel_of_a_model),
        cmocka_unit_test(open_cases),
        cmocka_unit_test(doubts_of_one_record_add_up),
    };
    return cmocka_run_group_tests_name("noise of records", tests, NULL, NULL);
}
