/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a person reads of a verdict, from invented errors of invented refits. */
#include "invented_refits.h"

/* Evidence counts modes and records alike: what takes most of the power in one of them would not be told. */
static void what_takes_most_is_told_whatever_its_evidence(void **state)
{
    static const char *const ids[] = {"axial_load", "rotary_inertia", "clock_error", "point_mass"};
    static struct model_effect of_the_model; /* words name its channel */
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[4];
        for (size_t k = 0; k < 4; k++) {
            const bool takes = k == 3 && i == 0;
            h[k] = refit(ids[k], NULL, 1, takes ? 50.0 : 97.0, takes ? 60.0 : 98.0);
            h[k].model.effects = &of_the_model;
            test_free(h[k].left);
            h[k].left = left_by(k == 3 ? 99.0 : 80.0);
        }
        decide(&d, *state, 100.0, 100.0, h, 4);
        char *text = diagnose_words(&d);
        assert_int_equal(d.verdict, VERDICT_UNKNOWN);
        assert_string_equal(d.hypotheses[3].effects[0]->id, "point_mass");
        if ((strstr(text, ". Most is taken by point_mass, 75 % of the misfit (held out: 64 %)") != NULL) != (i == 0))
            fail_msg("%s", text);
        free(text);
        done(&d);
    }
}

/* What is named leaves much, and the explanation that it was found in leaves nothing: a reader has to be told. */
static void one_of_a_pair_is_named_with_its_company(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "sensor_lag", 2, 1.0, 1.0),
                             refit("tip_mass", "sensor_delay", 2, 1.002, 1.002), refit("tip_mass", NULL, 1, 16.0, 17.0),
                             refit("sensor_lag", NULL, 1, 25.0, 26.0)};
    static struct model_effect of_the_model[2]; /* words name their channels */
    for (size_t i = 0; i < 4; i++)
        h[i].model.effects = of_the_model;
    decide(&d, *state, 30.0, 30.0, h, 4);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "tip_mass");
    char *text = diagnose_words(&d);
    if (strstr(text, "It was found in the best explanation, tip_mass + sensor_lag, which takes ") == NULL ||
        strstr(text, "leaves 1 times the noise (held out: 1); that sensor_lag is there, too, has the probability 0.") ==
            NULL)
        fail_msg("%s", text);
    free(text);
    done(&d);
}

/* What is not linear feels the recorder's filter: which one was taken is told where no record says. */
static void the_filter_that_was_taken_is_told(void **state)
{
    for (int stated = 0; stated < 2; stated++) {
        struct diagnosis d;
        struct record record = {.path = "r.csv", .n = 10, .dt_s = 1e-3};
        struct model_effect law = {.effect = effect_by_id("cubic_stiffness")};
        struct hypothesis h[] = {refit("cubic_stiffness", NULL, 1, 1.0, 1.0), refit("sensor_lag", NULL, 1, 25.0, 26.0)};
        for (size_t i = 0; i < 2; i++)
            h[i].model.effects = &law;
        h[0].model.n_effects = 1;
        record_add_meta(&record, "excitation", "recorded");
        if (stated)
            record_add_meta(&record, RECORD_FILTER, "none");
        (void)record_assume_filter(&record);
        decide(&d, *state, 30.0, 30.0, h, 2);
        d.records = &record;
        d.n_records = 1;
        char *text = diagnose_words(&d);
        assert_true(d.n_named == 1);
        if ((strstr(text, "r.csv does not state it; what was taken is Butterworth order 6 at 390 Hz") != NULL) ==
            stated)
            fail_msg("%s", text);
        free(text);
        record.path = NULL;
        record_free(&record);
        done(&d);
    }
}

/* Hum is all that is left of a good model: no physics is missing, and the hum is told. With as much left of anything else there is. */
static void hum_alone_is_told_of_a_complete_model(void **state)
{
    for (int hum = 0; hum < 2; hum++) {
        struct diagnosis d;
        decide(&d, *state, 1.3, 1.3, NULL, 0);
        const double left = hum ? 1.0 : 1.3;
        without_hum(&d.baseline.fitted, left), without_hum(&d.baseline.check, left);
        diagnose_decide(&d);
        assert_int_equal(d.verdict, hum ? VERDICT_COMPLETE : VERDICT_UNKNOWN);
        char *text = diagnose_words(&d);
        if ((strstr(text, ", but for hum 1: a steady line of the mains is in the records") != NULL) != (hum == 1))
            fail_msg("%s", text);
        free(text);
        done(&d);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_takes_most_is_told_whatever_its_evidence),
        cmocka_unit_test(one_of_a_pair_is_named_with_its_company),
        cmocka_unit_test(the_filter_that_was_taken_is_told),
        cmocka_unit_test(hum_alone_is_told_of_a_complete_model),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
