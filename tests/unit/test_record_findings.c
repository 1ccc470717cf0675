/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What is wrong with a record before any model: a hit of the truth simulator's beam, spoilt in each way a laboratory does. */
#include "truth_hit.h"

#include <stdio.h>

#include "record/record.h"
#include "signals.h"
#include "test_files.h"

enum { RATE = 2048, HIT = 1024 }; /* the hit is at 0.5 s */

/* effect: a line of a spec, or NULL. Noise of the answer 0.4 %, of the force 0.01 N. */
static struct record make(const char *const effects[], size_t n_effects)
{
    struct truth_spec spec;
    uint64_t seed = signal_seed(3);
    paper_rig(&spec);
    spec.n_inputs = spec.n_outputs = spec.n_signals = 0;
    spec.sample_rate_Hz = RATE;
    spec.duration_s = 2;
    say(&spec, "input hammer_N point_force at_m=0.0254");
    say(&spec, "output accel_mps2 acceleration at_m=0.0214");
    say(&spec, "signal hammer_N raised_cosine start_s=0.5 width_s=0.004 level=20");
    for (size_t i = 0; i < n_effects; i++)
        say(&spec, effects[i]);
    struct record record = hit_of(&spec);
    double *u = (double *)record_column(&record, "hammer_N");
    for (size_t k = 0; k < record.n; k++)
        u[k] += 0.05 + 0.01 * signal_normal(&seed);
    return record;
}

static double *column(const struct record *record, const char *name)
{
    double *x = (double *)record_column(record, name);
    assert_non_null(x);
    return x;
}

static struct record_findings look(const struct record *record)
{
    struct record_findings out;
    record_findings_find(record, record_is_force, record_is_signal, NULL, &out);
    return out;
}

/* The only finding, of this kind and in this column. */
static const struct record_finding *only(const struct record *record, const struct record_findings *all,
                                         enum record_finding_kind kind, const char *name)
{
    if (all->n != 1)
        fail_msg("%zu findings; %s", all->n, all->n > 0 ? all->all[all->n - 1].text : "");
    assert_int_equal(all->all[0].kind, kind);
    assert_string_equal(record->columns[all->all[0].column].name, name);
    return &all->all[0];
}

static void a_good_hit_has_nothing(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    struct record_findings all = look(&record);
    if (all.n != 0)
        fail_msg("%s", all.all[0].text);
    record_findings_free(&all);
    record_free(&record);
}

static void a_second_hit_is_named_with_its_sample(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *u = column(&record, "hammer_N");
    for (size_t k = 0; k < 8; k++)
        u[HIT + 60 + k] += 3.0 * sin(pi * (double)(k + 1) / 9.0); /* 15 % of the first, 29 ms later */
    struct record_findings all = look(&record);
    const struct record_finding *f = only(&record, &all, FINDING_HITS, "hammer_N");
    assert_true(f->n == 2 && f->sample >= HIT + 62 && f->sample <= HIT + 65);
    assert_true(f->value > 0.12 && f->value < 0.2);
    assert_contains(f->text, "2 hits");
    record_findings_free(&all);
    record_free(&record);
}

static void an_overload_is_counted(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *z = column(&record, "accel_mps2"), most = 0.0;
    size_t count = 0, first = 0;
    for (size_t k = 0; k < record.n; k++)
        most = fmax(most, z[k]);
    for (size_t k = record.n; k-- > 0;)
        if (z[k] > 0.3 * most)
            z[k] = 0.3 * most;
    for (size_t k = 0; k + 2 < record.n && first == 0; k++)
        if (z[k] >= 0.3 * most && z[k + 1] >= 0.3 * most && z[k + 2] >= 0.3 * most)
            first = k;
    for (size_t k = 0; k < record.n; k++)
        count += z[k] >= 0.3 * most;
    struct record_findings all = look(&record);
    const struct record_finding *f = only(&record, &all, FINDING_OVERLOAD, "accel_mps2");
    assert_true(fabs(f->value / (0.3 * most) - 1) < 1e-12);
    assert_int_equal(f->sample, first);
    assert_true(f->n >= 3 && f->n <= count);
    record_findings_free(&all);
    record_free(&record);
}

static void a_hit_at_the_end_and_a_force_window_are_seen(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *u = column(&record, "hammer_N");
    for (size_t k = HIT + 100; k < record.n; k++)
        u[k] = 0.0;
    struct record_findings all = look(&record);
    const struct record_finding *f = only(&record, &all, FINDING_WINDOW, "hammer_N");
    assert_int_equal(f->sample, HIT + 100);
    record_findings_free(&all);
    record_free(&record);

    record = make(NULL, 0);
    record.n = HIT + 5; /* 8.2 samples long */
    all = look(&record);
    f = only(&record, &all, FINDING_OPEN_END, "hammer_N");
    assert_true(f->sample >= HIT - 8 && f->sample <= HIT + 3);
    record_findings_free(&all);
    record_free(&record);
}

/* The noise of 0.01 N would part two samples at a short hit's top. */
static void a_short_clipped_hit_is_an_overload(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *u = column(&record, "hammer_N"), second = 0.0;
    size_t top = 0;
    for (size_t k = 0; k < record.n; k++)
        top = u[k] > u[top] ? k : top;
    for (size_t k = 0; k < record.n; k++)
        second = k != top && u[k] > second ? u[k] : second;
    u[top] = second;
    struct record_findings all = look(&record);
    assert_int_equal(only(&record, &all, FINDING_OVERLOAD, "hammer_N")->n, 2);
    record_findings_free(&all);
    record_free(&record);
}

static void a_window_at_the_hit_s_end_is_seen_by_the_noise_before(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *u = column(&record, "hammer_N");
    for (size_t k = HIT + 12; k < record.n; k++)
        u[k] = 0.0;
    struct record_findings all = look(&record);
    assert_int_equal(only(&record, &all, FINDING_WINDOW, "hammer_N")->sample, HIT + 12);
    record_findings_free(&all);
    record_free(&record);
}

static void a_record_that_begins_within_the_hit_is_seen(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    for (size_t c = 0; c < record.n_columns; c++)
        memmove(record.columns[c].x, record.columns[c].x + HIT + 4, (record.n - HIT - 4) * sizeof(double));
    record.n -= HIT + 4;
    struct record_findings all = look(&record);
    assert_contains(only(&record, &all, FINDING_OPEN_BEGIN, "hammer_N")->text, "begins within a hit");
    record_findings_free(&all);
    record_free(&record);
}

static void a_channel_that_no_hit_moves_is_named(void **state)
{
    (void)state;
    uint64_t seed = signal_seed(9);
    for (int constant = 0; constant < 2; constant++) {
        struct record record = make(NULL, 0);
        double *z = column(&record, "accel_mps2");
        for (size_t k = 0; k < record.n; k++)
            z[k] = constant ? 0.25 : 0.01 * signal_normal(&seed);
        struct record_findings all = look(&record);
        assert_contains(only(&record, &all, FINDING_NO_ANSWER, "accel_mps2")->text, "no answer");
        record_findings_free(&all);
        record_free(&record);
    }
}

static void hum_before_the_hit_is_named_with_its_harmonics(void **state)
{
    (void)state;
    static const char *const hums[] = {
        "effect mains_hum channel=accel_mps2 amplitude=0.5 frequency_Hz=49.95 phase_rad=0.3",
        "effect mains_hum channel=accel_mps2 amplitude=0.3 frequency_Hz=149.85 phase_rad=1"};
    struct record record = make(hums, 2);
    struct record_findings all = look(&record);
    const struct record_finding *f = only(&record, &all, FINDING_HUM, "accel_mps2");
    assert_int_equal(f->n_lines, 2);
    near(f->mains_Hz, 49.95, 0.002);
    near(f->line[0].amplitude, 0.5, 0.05);
    near(f->line[1].frequency_Hz, 149.85, 0.002);
    near(f->line[1].amplitude, 0.3, 0.08);
    assert_contains(f->text, "kind: mains_hum, channel: accel_mps2");
    record_findings_free(&all);
    record_free(&record);
}

static void a_gate_leaves_the_hit_alone(void **state)
{
    (void)state;
    struct record record = make(NULL, 0);
    double *u = column(&record, "hammer_N"), *kept = calloc(record.n, sizeof *kept), sum = 0.0;
    char said[200];
    struct bf_error err;
    memcpy(kept, u, record.n * sizeof *kept);
    assert_int_equal(record_gate(&record, "hammer_N", 0.0, 0.0, said, &err), BF_OK);
    for (size_t k = 0; k < record.n; k++) {
        sum += u[k];
        if (k < HIT - 8 || k > HIT + 20)
            assert_true(!(fabs(u[k]) > 0.0));
        if (k >= HIT + 1 && k <= HIT + 7)
            near(u[k], kept[k] - 0.05, 0.02);
    }
    near(sum / RATE, 20 * 0.004 / 2, 0.02); /* the impulse of a raised cosine */
    assert_contains(said, "1 hit;");
    assert_int_equal(record_gate(&record, "none_N", 0.0, 0.0, said, &err), BF_USAGE);
    assert_int_equal(record_gate(&record, "hammer_N", 7.0, 8.0, said, &err), BF_USAGE);
    for (size_t k = 0; k < record.n; k++)
        u[k] = sin(0.1 * (double)k); /* a shaker */
    assert_int_equal(record_gate(&record, "hammer_N", 0.0, 0.0, said, &err), BF_USAGE);
    assert_contains(err.text, "FROM:TO");
    free(kept);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_hit_has_nothing),
        cmocka_unit_test(a_second_hit_is_named_with_its_sample),
        cmocka_unit_test(an_overload_is_counted),
        cmocka_unit_test(a_hit_at_the_end_and_a_force_window_are_seen),
        cmocka_unit_test(a_short_clipped_hit_is_an_overload),
        cmocka_unit_test(a_window_at_the_hit_s_end_is_seen_by_the_noise_before),
        cmocka_unit_test(a_record_that_begins_within_the_hit_is_seen),
        cmocka_unit_test(a_channel_that_no_hit_moves_is_named),
        cmocka_unit_test(hum_before_the_hit_is_named_with_its_harmonics),
        cmocka_unit_test(a_gate_leaves_the_hit_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
