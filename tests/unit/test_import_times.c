/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Times of a run as laboratories have them: jittered stamps, gaps, two loggers of one run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "signals.h"
#include "test_import.h"

static const double pi = 3.14159265358979323846;

/* Four sines, all below 0.35 of 400 Hz. */
static double tones(double t)
{
    static const double Hz[] = {11.3, 47.1, 90.2, 130.7};
    double x = 0.0;
    for (size_t i = 0; i < 4; i++)
        x += sin(2.0 * pi * Hz[i] * t + Hz[i]);
    return x;
}

static double ringing(double t)
{
    return t > 0.2 ? exp(-2.0 * (t - 0.2)) * sin(2.0 * pi * 37.0 * (t - 0.2)) : 0.0;
}

static double edge(double t)
{
    return t < 0.199 ? 0.0 : t > 0.201 ? 5.0 : 2500.0 * (t - 0.199);
}

/* A table in memory, `room` bytes a line. */
struct table {
    char *text;
    size_t n, room;
};

static void put_line(struct table *table, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put_line(struct table *table, const char *format, ...)
{
    va_list arguments;
    if (table->room - table->n < 200) {
        table->room = 2 * table->room + 1000;
        table->text = realloc(table->text, table->room);
        assert_non_null(table->text);
    }
    va_start(arguments, format);
    table->n += (size_t)vsnprintf(table->text + table->n, table->room - table->n, format, arguments);
    va_end(arguments);
}

static char *read_table(struct table *table, const char *name, struct import_file *file)
{
    char *path = reads(name, table->text, table->n, file);
    free(table->text);
    *table = (struct table){0};
    return path;
}

static const struct import_choice all = {.from_s = (double)NAN, .to_s = (double)NAN, .free_from_s = (double)NAN};

/* 2000 stamps at 500 Hz on average; a hole of `gap_s` after the thousandth, the stamp `back` runs backwards. */
static char *jittered(double gap_s, size_t back, struct import_file *file)
{
    struct table table = {0};
    uint64_t seed = signal_seed(7);
    double t = 3.0;
    put_line(&table, "time_ms,accel_mps2\n");
    for (size_t k = 0; k < 2000; k++) {
        const double jitter = 0.3 * signal_normal(&seed);
        t += 0.002 * (1.0 + fmax(fmin(jitter, 0.9), -0.9)) + (k == 1000 ? gap_s : 0.0);
        put_line(&table, "%.8f,%.12f\n", 1e3 * t - (k == back ? 50.0 : 0.0), tones(t));
    }
    return read_table(&table, "jitter.csv", file);
}

static void jittered_stamps_give_the_signal_that_was_there(void **state)
{
    (void)state;
    struct import_file file;
    struct record record;
    struct bf_error err = {.text = ""};
    char *path = jittered(0.0, SIZE_MAX, &file);
    struct import_choice choice = all;
    assert_int_equal(import_record(&file, &choice, &record, &err), BF_BAD_FILE);
    assert_contains(err.text, "--resample 400");
    choice.resample_Hz = 400;
    if (import_record(&file, &choice, &record, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(fabs(record.dt_s * 400 - 1) < 1e-12 && record.t0_s > 3.0 && record.n > 1580);
    double worst = 0.0;
    for (size_t k = 16; k < record.n - 16; k++)
        worst = fmax(worst, fabs(record.columns[0].x[k] - tones(record.t0_s + (double)k * record.dt_s)));
    if (!(worst < 2e-3)) /* of 4 */
        fail_msg("off by %g", worst);
    assert_contains(record_meta(&record, "resampled"), "band-limited: nothing above 200 Hz");
    assert_contains(record_meta(&record, "resampled"), "2000 stamps");
    record_free(&record);
    import_free(&file);
    free(path);
}

static void what_no_stamp_tells_is_refused(void **state)
{
    (void)state;
    static const struct {
        double gap_s, rate_Hz;
        size_t back;
        enum bf_status status;
        const char *says;
    } cases[] = {
        {0.05, 400, SIZE_MAX, BF_BAD_FILE, "without a sample"},
        {0.0, 490, SIZE_MAX, BF_USAGE, "--resample 400"},
        {0.0, 400, 500, BF_BAD_FILE, ":502: channel 'time_ms', sample 501: time runs backwards"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct import_file file;
        struct record record;
        struct bf_error err = {.text = ""};
        struct import_choice choice = all;
        char *path = jittered(cases[i].gap_s, cases[i].back, &file);
        choice.resample_Hz = cases[i].rate_Hz;
        assert_int_equal(import_record(&file, &choice, &record, &err), cases[i].status);
        assert_contains(err.text, cases[i].says);
        import_free(&file);
        free(path);
    }
}

/* A logger whose zero is `late` seconds after the run's, from 0 to 2 s of the run. */
static char *logger(const char *name, const char *header, double rate_Hz, double late, double (*signal)(double),
                    struct import_file *file)
{
    struct table table = {0};
    put_line(&table, "%s\n", header);
    for (size_t k = 0; (double)k / rate_Hz <= 2.0; k++)
        put_line(&table, "%.9f,%.12f,%.9f\n", (double)k / rate_Hz - late, signal((double)k / rate_Hz),
                 edge((double)k / rate_Hz));
    return read_table(&table, name, file);
}

static void two_loggers_become_one_record(void **state)
{
    (void)state;
    static const struct {
        double rate_Hz, late;
        bool by_trigger;
        double within;
    } cases[] = {
        {2000, 0.0, false, 1e-11},                            /* the same samples */
        {1250, 0.0, false, 2e-4},                             /* another rate, one clock */
        {5000, 0.0, false, 2e-4},    {2000, 0.3, true, 1e-6}, /* its own zero, in step */
        {1250, 0.31377, true, 0.03}, /* the edge tells its time to 0.1 ms: 37 Hz move 2 % of a radian */
    };
    static const char *const columns[2] = {"trigger_V", "start_V"};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct import_file files[2];
        struct record record;
        struct bf_error err = {.text = ""};
        char *a = logger("a.csv", "time_s,hammer_N,trigger_V", 2000, 0.0, tones, &files[0]);
        char *b = logger("b.csv", "time_s,tip_mps,start_V", cases[i].rate_Hz, cases[i].late, ringing, &files[1]);
        if (import_joined(files, &all, cases[i].by_trigger ? columns : NULL, &record, &err) != BF_OK)
            fail_msg("%s", err.text);
        const double *x = record_column(&record, "tip_mps");
        assert_true(x != NULL && fabs(record.dt_s * 2000 - 1) < 1e-9);
        assert_true((record_column(&record, "start_V") == NULL) == cases[i].by_trigger);
        double worst = 0.0;
        for (size_t k = 0; k < record.n; k++) {
            const double t = record.t0_s + (double)k * record.dt_s;
            if (t > 0.23 && t < 1.9) /* not at the onset, which is no band-limited signal */
                worst = fmax(worst, fabs(x[k] - ringing(t)));
        }
        if (!(worst < cases[i].within))
            fail_msg("case %zu: off by %g", i, worst);
        assert_non_null(record_meta(&record, "joined"));
        assert_contains(record_meta(&record, "source_2"), "b.csv");
        record_free(&record);
        import_free(&files[0]), import_free(&files[1]);
        free(a), free(b);
    }
}

static void what_cannot_be_joined_is_said(void **state)
{
    (void)state;
    static const char *const no_edge[2] = {"trigger_V", "tip_mps"}, *const no_column[2] = {"trigger_V", "start"};
    static const struct {
        double late;
        const char *const *trigger;
        struct import_pick pick[3];
        size_t n_picks;
        const char *says;
    } cases[] = {
        {50.0, NULL, {{0}}, 0, "no time in common"},
        {0.0, no_column, {{0}}, 0, "no column made of"},
        {0.0, no_edge, {{0}}, 0, "no edge after a quiet beginning"},
        {0.0, NULL, {{"hammer_N", NULL}, {"trigger_V", NULL}}, 2, "no --channel is of"},
        {0.0, NULL, {{"hammer_N", "x_V"}, {"2:start_V", "x_V"}}, 2, "2:x_V=NEW"},
        {0.0, NULL, {{"hammer_N", NULL}, {"2:other", NULL}}, 2, "other"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct import_file files[2];
        struct record record;
        struct bf_error err = {.text = ""};
        struct import_choice choice = all;
        choice.picks = cases[i].pick, choice.n_picks = cases[i].n_picks;
        char *a = logger("a.csv", "time_s,hammer_N,trigger_V", 2000, 0.0, tones, &files[0]);
        char *b = logger("b.csv", "time_s,tip_mps,start_V", 2000, cases[i].late, tones, &files[1]);
        assert_int_equal(import_joined(files, &choice, cases[i].trigger, &record, &err), BF_USAGE);
        assert_contains(err.text, cases[i].says);
        import_free(&files[0]), import_free(&files[1]);
        free(a), free(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jittered_stamps_give_the_signal_that_was_there),
        cmocka_unit_test(what_no_stamp_tells_is_refused),
        cmocka_unit_test(two_loggers_become_one_record),
        cmocka_unit_test(what_cannot_be_joined_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
