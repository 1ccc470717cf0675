/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Free linear models of each record beside that of all: two beams are told from one. The reference is the noise that was added. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "noise/noise.h"
#include "signals.h"
#include "linear_modes.h"

/* Of a hit, by the sum of exactly sampled modes; `faster` times as fast: the same samples of another beam. */
static struct record make_record(double faster, unsigned number)
{
    static double u[N], z[N];
    struct record record = {.path = strdup("test.csv"), .n = N, .dt_s = dt / faster};
    uint64_t seed = signal_seed(number);
    memset(z, 0, sizeof z);
    for (size_t i = 0; i < N; i++)
        u[i] = exp(-0.5 * pow(((double)i - 60.0) / 2.0, 2.0));
    for (int m = 0; m < MODES; m++)
        signal_add_mode(mode_Hz[m], damping[m], 1.0 / (1.0 + m), dt, u, N, 0.0, z);
    const double rms = signal_rms(z, N);
    for (size_t i = 0; i < N; i++)
        z[i] += noise_share * rms * signal_normal(&seed);
    record_add_column(&record, "drive_N", u);
    record_add_column(&record, "tip_m", z);
    return record;
}

/* n records, the second of a beam `faster` times as fast. */
static struct attainable of_records(size_t n, double faster)
{
    struct record records[2] = {make_record(1.0, 61), make_record(faster, 62)};
    struct model model = read_model();
    struct attainable a;
    struct bf_error err;
    assert_int_equal(attainable_find(&model, records, n, NULL, &a, &err), BF_OK);
    assert_true(isnan(a.each_noise_ratio) && isnan(a.each_nrmse) && !attainable_differs(&a)); /* not asked yet */
    assert_int_equal(attainable_each(&model, records, n, NULL, &a, &err), BF_OK);
    model_free(&model);
    record_free(&records[0]);
    record_free(&records[1]);
    return a;
}

static void records_of_two_beams_end_at_their_noise_one_by_one(void **state)
{
    (void)state;
    struct attainable a = of_records(2, 1.2);
    assert_true(a.noise_ratio > 10.0);
    assert_true(fabs(a.each_noise_ratio - 1.0) < 0.05);
    assert_true(fabs(a.each_nrmse / noise_share - 1.0) < 0.05);
    assert_true(attainable_differs(&a));
    attainable_free(&a);
}

static void of_one_beam_and_of_one_record_nothing_is_asked(void **state)
{
    (void)state;
    for (size_t n = 1; n <= 2; n++) {
        struct attainable a = of_records(n, 1.0);
        assert_true(fabs(a.noise_ratio - 1.0) < 0.05);
        assert_true(isnan(a.each_noise_ratio) && isnan(a.each_nrmse) && !attainable_differs(&a));
        attainable_free(&a);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(records_of_two_beams_end_at_their_noise_one_by_one),
        cmocka_unit_test(of_one_beam_and_of_one_record_nothing_is_asked),
    };
    return cmocka_run_group_tests_name("attainable, each record alone", tests, NULL, NULL);
}
