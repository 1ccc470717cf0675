/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Wrong units of time, frequencies that are no times, and steady sines, which tell neither a sign nor a place. */
#include "channel_factors_rig.h"

static void frequencies_are_no_times(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record = {.path = strdup("frf.csv"), .n = 800, .dt_s = 0.5};
    double force[800], accel[800];
    for (size_t k = 0; k < 800; k++) {
        const double f = 0.5 * (double)k / 47.0;
        force[k] = 1.0, accel[k] = -f * f * (1.0 - f * f) / ((1.0 - f * f) * (1.0 - f * f) + 1e-4);
    }
    record_add_column(&record, "hammer_N", force);
    record_add_column(&record, "accel_mps2", accel);
    struct channel_factors out = found(&model, &record, 1);
    assert_int_equal(out.n, 1);
    assert_int_equal(out.all[0].kind, FACTOR_NO_TIME);
    assert_non_null(strstr(out.all[0].text, "frequency response"));
    channel_factors_free(&out);
    record_free(&record);
    model_free(&model);
}

static void milliseconds_are_told_from_seconds(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    static const double by[] = {1e3, 1e-3};
    for (size_t i = 0; i < 2; i++) {
        struct record record = hit(NULL);
        record.dt_s *= by[i];
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        assert_true(out.all[0].kind == FACTOR_TIME && fabs(out.all[0].factor * by[i] - 1.0) < 1e-12);
        channel_factors_free(&out);
        record_free(&record);
    }
    model_free(&model);
}

/* Below a mode a steady sine answers with one sign, above it with the other. */
static void a_steady_sine_has_no_sign(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record =
        make("input shaker_N point_force at_m=0.1",
             "signal shaker_N chirp start_s=0 width_s=1 from_Hz=30 to_Hz=30.5 level=5 taper_s=0.3", NULL);
    scale(&record, "accel_mps2", -1.0), scale(&record, "laser_mps", -1.0);
    nothing(&model, &record, 1);
    record_free(&record);
    model_free(&model);
}

/* Of a line only its width in so short a record, whether it ends with the record or not; a blow on the first sample, a sweep. */
static void only_a_band_is_wide(void **state)
{
    (void)state;
    enum { N = 2048, BANDS = 2 };
    static const double periods[] = {2.37, 3.1, 7.43, 14.0, 100.37};
    enum { LINES = sizeof periods / sizeof *periods };
    struct model model = model_at("0.28");
    for (size_t i = 0; i < LINES + BANDS; i++) {
        static double u[N];
        for (size_t k = 0; k < N; k++) {
            const double t = (double)k / N;
            if (i < LINES)
                u[k] = sin(2.0 * acos(-1.0) * periods[i] * t + 1.6);
            else
                u[k] = i == LINES ? (k == 0 ? 1.0 : 0.0) : sin(2.0 * acos(-1.0) * (10.0 + 40.0 * t) * t);
        }
        struct record record = {.path = strdup("drive.csv"), .n = N, .dt_s = 1.0 / N};
        struct bf_error err;
        bool wide;
        record_add_column(&record, "shaker_N", u);
        assert_int_equal(factor_drive_wide(&model, &record, SIZE_MAX, &wide, &err), BF_OK);
        if (wide != (i >= LINES))
            fail_msg("drive %zu: %s", i, wide ? "wide" : "one line");
        record_free(&record);
    }
    model_free(&model);
}

/* Cut out of a steady sine that does not end with the record, by a shaker at 0.15 m; the accelerometer alone is left. */
static struct record steady(const char *signal, const char *effect)
{
    enum { FROM = 500 };
    struct record whole = make("input shaker_N point_force at_m=0.15", signal, effect);
    struct record record = {.path = strdup(whole.path), .n = whole.n - 2 * FROM, .dt_s = whole.dt_s};
    record_add_column(&record, "shaker_N", (double *)record_column(&whole, "shaker_N") + FROM);
    record_add_column(&record, "accel_mps2", (double *)record_column(&whole, "accel_mps2") + FROM);
    record_add_meta(&record, "initial_state", "free");
    record_free(&whole);
    return record;
}

/* The model has it at 0.1 m, and no mass: amplitudes alone would tell that the sensor is elsewhere. */
static void nor_a_place(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record records[2] = {
        steady("signal shaker_N chirp start_s=0 width_s=1 from_Hz=6.1 to_Hz=6.11 level=5 taper_s=0.1",
               "effect tip_mass mass_kg=0.5"),
        steady("signal shaker_N chirp start_s=0 width_s=1 from_Hz=9.3 to_Hz=9.31 level=5 taper_s=0.1",
               "effect tip_mass mass_kg=0.5")};
    nothing(&model, records, 2);
    record_free(&records[0]), record_free(&records[1]);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frequencies_are_no_times),
        cmocka_unit_test(milliseconds_are_told_from_seconds),
        cmocka_unit_test(a_steady_sine_has_no_sign),
        cmocka_unit_test(only_a_band_is_wide),
        cmocka_unit_test(nor_a_place),
    };
    plain_hit = hit(NULL);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    record_free(&plain_hit);
    return failed;
}
