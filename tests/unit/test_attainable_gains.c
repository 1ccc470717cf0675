/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the free linear model makes of an input's noise, against draws of that noise. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "modes_record.h"
#include "noise/noise.h"
#include "noise/noise_input.h"

/* Power of the answer to white noise of rms 1, or to what is kept of it, mean over draws. */
static double answered(int channel, const struct column_noise *cells)
{
    enum { DRAWS = 400 };
    static double u[N], z[N];
    double sum = 0.0;
    struct bf_error err;
    for (unsigned draw = 0; draw < DRAWS; draw++) {
        uint64_t seed = signal_seed(5000 + draw);
        for (size_t i = 0; i < N; i++)
            u[i] = signal_normal(&seed);
        if (cells != NULL)
            assert_int_equal(input_noise_keep(cells, u, N, u, &err), BF_OK);
        memset(z, 0, sizeof z);
        for (int m = 0; m < MODES; m++)
            signal_add_mode(mode_Hz[m], damping[m], (channel == 1 && m == 1 ? -1.0 : 1.0) / (1.0 + m), dt, u, N, 0.0,
                            z);
        sum += pow(signal_rms(z, N), 2.0) / DRAWS;
    }
    return sum;
}

/* What gain[N/2 + 1] makes of such noise, of the power that answers it. */
static double answered_by(const double gain[], int channel, const struct column_noise *cells)
{
    double power = 0.0;
    assert_non_null(gain);
    for (size_t k = 1; k <= N / 2; k++)
        power += 2.0 / N * gain[k];
    return power / answered(channel, cells);
}

/* What a force's noise makes of a resonance is known from the records of a drive that has no line there: a hit, a sweep, a multisine. */
static void noise_is_answered_between_the_lines_of_a_drive(void **state)
{
    (void)state;
    static const int kinds[] = {0, 1, 3};
    struct model model = read_model();
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct record record = make_record(kinds[i], 1.0, 0.0, 40 + (unsigned)i);
        struct noise_channel_input inputs[2] = {{.u = record_column(&record, "drive_N")},
                                                {.u = record_column(&record, "drive_N")}};
        struct bf_error err;
        const double own[2] = {noise_share * signal_rms(record_column(&record, "tip_m"), N),
                               noise_share * signal_rms(record_column(&record, "middle_m"), N)};
        assert_int_equal(attainable_gains(&model, &record, own, inputs, 1, &err), BF_OK);
        for (int c = 0; c < 2; c++) {
            const double part = answered_by(inputs[c].gain, c, NULL);
            print_message("drive %d, channel %d: %.3f of the answer's power\n", kinds[i], c, part);
            assert_true(fabs(log(part)) < log(1.1));
            free(inputs[c].gain);
        }
        record_free(&record);
    }
    model_free(&model);
}

/* Of a cleaned sweep the noise at low frequencies is kept early, that at high ones late: the first rings for the whole record. */
static void kept_noise_is_answered_from_when_it_came(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = make_record(1, 1.0, 0.0, 47), *records[1] = {&record};
    struct clean_input_list cleaned;
    struct bf_error err;
    uint64_t seed = signal_seed(48);
    for (size_t i = 0; i < N; i++)
        record.columns[0].x[i] += 0.01 * signal_normal(&seed);
    assert_int_equal(inputs_clean(&model, records, 1, &cleaned, &err), BF_OK);
    assert_int_equal(cleaned.n, 1);
    const struct column_noise *cells = record_column_noise(&record, "drive_N");
    struct noise_channel_input inputs[2] = {{.u = record_column(&record, "drive_N"), .cells = cells},
                                            {.u = record_column(&record, "drive_N"), .cells = cells}};
    const double own[2] = {noise_share * signal_rms(record_column(&record, "tip_m"), N),
                           noise_share * signal_rms(record_column(&record, "middle_m"), N)};
    assert_int_equal(attainable_gains(&model, &record, own, inputs, 1, &err), BF_OK);
    for (int c = 0; c < 2; c++) {
        const double part = answered_by(inputs[c].gain, c, cells);
        print_message("channel %d: %.3f of the answer's power, of noise of which %.2f is kept\n", c, part,
                      cleaned.all[0].kept);
        assert_true(fabs(log(part)) < log(1.15));
        free(inputs[c].gain);
    }
    inputs_clean_free(&cleaned);
    record_free(&record);
    model_free(&model);
}

/* A free decay has no input to be noisy, and a record without the channel none to answer. */
static void what_has_no_path_has_no_gain(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record decay = make_record(2, 1.0, 0.0, 50);
    struct noise_channel_input inputs[2] = {{.u = record_column(&decay, "drive_N")},
                                            {.u = record_column(&decay, "drive_N")}};
    struct bf_error err;
    const double own[2] = {1e-6, 1e-6};
    assert_int_equal(attainable_gains(&model, &decay, own, inputs, 1, &err), BF_OK);
    assert_true(inputs[0].gain == NULL && inputs[1].gain == NULL);
    record_free(&decay);
    struct record one = make_record(0, 1.0, 0.0, 51);
    one.columns[2].name[0] = 'x'; /* middle_m */
    inputs[0].u = inputs[1].u = record_column(&one, "drive_N");
    assert_int_equal(attainable_gains(&model, &one, own, inputs, 1, &err), BF_OK);
    assert_true(inputs[0].gain != NULL && inputs[1].gain == NULL);
    free(inputs[0].gain);
    record_free(&one);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_is_answered_between_the_lines_of_a_drive),
        cmocka_unit_test(kept_noise_is_answered_from_when_it_came),
        cmocka_unit_test(what_has_no_path_has_no_gain),
    };
    return cmocka_run_group_tests_name("attainable, gains", tests, NULL, NULL);
}
