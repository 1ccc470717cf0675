/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A record compared piece by piece says what the record in memory says, and what cannot be taken in pieces is not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "compare_rig.h"

enum { LONG = 2 * COMPARE_HEAD + 777 };

/* The rig's model, so damped that it forgets within a piece. */
static struct model damped_model(double EI)
{
    struct model model = read_model();
    model.gamma.value = 0.5;
    model.materials[0].EI.value = EI;
    return model;
}

/* Noise drives the beam, not all the time; one of the two outputs was recorded, with 1 % of noise. */
static struct record driven_record(void)
{
    struct record record = {.path = strdup("long.csv"), .n = LONG, .dt_s = dt};
    struct model truth = damped_model(0.491);
    uint64_t seed = signal_seed(3);
    record_add_column(&record, "hammer_N", NULL);
    record_add_column(&record, "piezo_V", NULL);
    double *u = column(&record, "hammer_N"), *z = column(&record, "piezo_V");
    for (size_t k = 0; k < LONG; k++) {
        const double rising = 0.5 + (double)k / LONG;
        u[k] = (k / 40000) % 4 == 2 ? 0.0 : rising * signal_normal(&seed);
        z[k] = signal_normal(&seed);
    }
    struct comparison all = run(&truth, &record, 1, 0);
    const double size = 0.01 * signal_rms(all.channels[0].predicted, LONG);
    for (size_t k = 0; k < LONG; k++)
        z[k] = all.channels[0].predicted[k] + size * signal_normal(&seed);
    compare_free(&all);
    model_free(&truth);
    return record;
}

static void read_samples(void *context, const char *name, size_t first, size_t n, double x[])
{
    memcpy(x, record_column(context, name) + first, n * sizeof *x);
}

/* Views of the first samples. */
static struct record head_of(const struct record *record)
{
    struct record head = *record;
    head.n = COMPARE_HEAD;
    return head;
}

static struct comparison in_pieces(const struct model *model, struct record *record, struct record *head)
{
    const struct long_reader reader = {.read = read_samples, .context = record};
    struct long_record *sums;
    struct bf_error err;
    *head = head_of(record);
    if (long_record_sum(model, head, record->n, NULL, &reader, &sums, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_non_null(sums);
    struct comparison all = run(model, head, 1, 0);
    compare_take_long(&all, 0, sums);
    long_record_free(sums);
    return all;
}

static void near(double x, double y, double relative)
{
    if (!(fabs(x - y) <= relative * fabs(y)))
        fail_msg("%.15g is not %.15g within %g of it", x, y, relative);
}

static void pieces_say_what_the_whole_says(void **state)
{
    (void)state;
    struct record record = driven_record(), head;
    struct model model = damped_model(0.5);
    struct comparison whole = run(&model, &record, 1, 0), pieces = in_pieces(&model, &record, &head);
    const struct comparison_channel *a = &pieces.channels[0], *b = &whole.channels[0];
    near(a->nrmse, b->nrmse, 1e-9);
    near(a->rms, b->rms, 1e-12);
    near(a->scale, b->scale, 1e-9);
    near(a->alignment, b->alignment, 1e-9);
    near(pieces.nrmse, whole.nrmse, 1e-9);
    near(a->noise.rms, b->noise.rms, 1e-3);
    near(a->noise_ratio, b->noise_ratio, 1e-3);
    for (int i = 0; i < 3; i++)
        near(a->time_share[i], b->time_share[i], 1e-9);
    assert_int_equal(a->n_bands, b->n_bands);
    for (size_t i = 0; i < b->n_bands; i++) { /* power leaks between the bands at the ends of segments */
        assert_true(fabs(a->bands[i].share - b->bands[i].share) < 1e-3);
        assert_int_equal(a->bands[i].mode, b->bands[i].mode);
    }
    near(a->inputs[0].correlation.largest, b->inputs[0].correlation.largest,
         0.05); /* each segment in units of its own drive */
    assert_int_equal(a->inputs[0].correlation.largest_lag, b->inputs[0].correlation.largest_lag);
    for (size_t k = 0; k < 50; k++)
        assert_true(fabs(a->autocorrelation[k] - b->autocorrelation[k]) < 1e-3);
    assert_true(a->whiteness.p_value < 1e-9 && b->whiteness.p_value < 1e-9);
    assert_contains(pieces.notes[0], "long.csv is long");
    compare_free(&whole), compare_free(&pieces);
    record_free(&record);
    model_free(&model);
}

static void the_true_model_leaves_white_noise(void **state)
{
    (void)state;
    struct record record = driven_record(), head;
    struct model model = damped_model(0.491);
    struct comparison pieces = in_pieces(&model, &record, &head);
    const struct comparison_channel *c = &pieces.channels[0];
    near(c->nrmse, 0.01, 0.01);
    near(c->noise_ratio, 1.0, 0.02);
    assert_true(c->whiteness.p_value > 1e-3);
    assert_true(c->inputs[0].correlation.p_value > 1e-3);
    compare_free(&pieces);
    record_free(&record);
    model_free(&model);
}

/* NULL: it has to be in memory. */
static bool is_taken(const struct model *model, struct record *record)
{
    const struct long_reader reader = {.read = read_samples, .context = record};
    struct record head = head_of(record);
    struct long_record *sums;
    struct bf_error err;
    assert_int_equal(long_record_sum(model, &head, record->n, NULL, &reader, &sums, &err), BF_OK);
    const bool taken = sums != NULL;
    long_record_free(sums);
    return taken;
}

static void what_has_to_be_solved_for_is_not_taken(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = {.path = strdup("long.csv"), .n = LONG, .dt_s = dt};
    record_add_column(&record, "hammer_N", NULL);
    record_add_column(&record, "piezo_V", NULL);
    column(&record, "hammer_N")[3] = 1.0;
    record_add_meta(&record, "excitation", "unknown_level");
    assert_false(is_taken(&model, &record));
    strcpy(record.meta[0].key, "none");
    record_add_meta(&record, "initial_state", "free");
    assert_false(is_taken(&model, &record));
    record.n = 2 * COMPARE_HEAD - 1;
    assert_false(is_taken(&model, &record));
    record_free(&record);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pieces_say_what_the_whole_says),
                                       cmocka_unit_test(the_true_model_leaves_white_noise),
                                       cmocka_unit_test(what_has_to_be_solved_for_is_not_taken)};
    return cmocka_run_group_tests_name("compare long", tests, NULL, NULL);
}
