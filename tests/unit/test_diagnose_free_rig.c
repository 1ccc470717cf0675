/* SPDX-License-Identifier: GPL-3.0-or-later */
/* When the rig is freed: at once where what a ruler and a gauge may be wrong by explains the records, else after single effects. */
#include "diagnose_rig.h"
#include "explain/diagnose_shortlist.h"

/* The sensor is nearer to the clamp than the file says: by what a ruler may be wrong, and by ten times that. */
static void a_rig_that_nobody_would_believe_comes_after_single_effects(void **state)
{
    (void)state;
    static const char *const none[] = {NULL};
    static const double off_m[] = {0.004, 0.02};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new("", 2, LONG, 0.01, none);
        struct bf_error err;
        bool freed;
        b->given.outputs[1].at_m = b->given.outputs[1].own.at.value = 0.39 - off_m[i];
        struct diagnose_state w = begun(b);
        assert_true(b->d.baseline.fitted.noise_ratio > 1.5);
        assert_int_equal(diagnose_free_rig(&w, RIG_ALONE, &freed, &err), BF_OK);
        assert_int_equal(freed, i == 0);
        if (i == 1)
            assert_int_equal(diagnose_free_rig(&w, RIG_AND_BEST, &freed, &err), BF_OK);
        assert_true(freed && b->d.baseline.fitted.noise_ratio < 1.1);
        assert_true(fabs(b->d.baseline.model.outputs[1].at_m - 0.39) < 5e-4);
        diagnose_side_free(&w.other);
        state_free(&w);
        bench_free(b);
    }
}

/* A mass, and a sensor nearer to the clamp than the file says: with the rig free the mass explains the records, but not where a spring is there, too. */
static void what_leads_is_asked_with_the_rig_free(void **state)
{
    (void)state;
    static const char *const masses[] = {"tip_mass", NULL},
                             *const truths[] = {"{kind: tip_mass, mass_kg: 0.004}",
                                                "{kind: tip_mass, mass_kg: 0.004}, {kind: point_spring, stiffness_Npm: "
                                                "20, damping_Nspm: 0, at_m: 0.2}"};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new(truths[i], 2, LONG, 0.005, masses);
        struct bf_error err;
        bool freed;
        b->given.outputs[1].at_m = b->given.outputs[1].own.at.value = 0.39 - 0.0015;
        struct diagnose_state w = begun(b);
        assert_int_equal(diagnose_first_look(&w, &err), BF_OK);
        assert_true(b->d.n_hypotheses > 0 && b->d.hypotheses[0].fitted.noise_ratio > 1.1);
        assert_int_equal(diagnose_free_rig(&w, RIG_AND_LEADER, &freed, &err), BF_OK);
        assert_int_equal(freed, i == 0);
        assert_int_equal(b->d.free_rig, i == 0);
        if (i == 0) {
            assert_true(b->d.hypotheses[0].explains);
            assert_true(fabs(b->d.hypotheses[0].model.effects[0].parameters[0].value / 0.004 - 1.0) < 0.03);
        }
        shortlist_free(w.looked);
        diagnose_side_free(&w.other);
        state_free(&w);
        bench_free(b);
    }
}

static void hit_at(struct bench *b, size_t r, double at_m)
{
    const char name[] = {'r', (char)('0' + r), '.', 'c', 's', 'v', '\0'};
    b->truth.inputs[0].at_m = b->truth.inputs[0].own.at.value = at_m;
    record_free(&b->records[r]);
    b->records[r] = blow(&b->truth, name, LONG, 0.004, 1.0, 0.005);
}

/* Each hit is beside its mark: a place of the hammer that is fitted takes the one, and predicts the other worse than the mark does. */
static void a_rig_that_predicts_worse_is_not_freed(void **state)
{
    (void)state;
    static const char *const none[] = {NULL};
    struct bench *b = bench_new("", 2, LONG, 0.005, none);
    struct bf_error err;
    bool freed;
    hit_at(b, 0, 0.054);
    hit_at(b, 1, 0.046);
    b->d = (struct diagnosis){
        .model = &b->given, .records = b->records, .n_records = 1, .checks = b->records + 1, .n_checks = 1};
    struct diagnose_state w = {.d = &b->d, .options = &b->options, .predict = &b->options.predict, .threads = 2};
    assert_int_equal(diagnose_noise(&w, &err), BF_OK);
    assert_int_equal(diagnose_baseline(&w, &err), BF_OK);
    assert_true(b->d.baseline.fitted.noise_ratio > 10.0);
    assert_int_equal(diagnose_free_rig(&w, RIG_AND_BEST, &freed, &err), BF_OK);
    assert_true(w.other.baseline.fitted.noise_ratio < 2.0);
    assert_true(w.other.baseline.check.noise_ratio > b->d.baseline.check.noise_ratio);
    assert_false(freed);
    diagnose_side_free(&w.other);
    state_free(&w);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rig_that_nobody_would_believe_comes_after_single_effects),
        cmocka_unit_test(what_leads_is_asked_with_the_rig_free),
        cmocka_unit_test(a_rig_that_predicts_worse_is_not_freed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
