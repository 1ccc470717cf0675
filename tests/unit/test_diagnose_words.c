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
                             refit("tip_mass", "sensor_delay", 2, 1.0002, 1.0002),
                             refit("tip_mass", NULL, 1, 16.0, 17.0), refit("sensor_lag", NULL, 1, 25.0, 26.0)};
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

/* The fitted records are left at the noise: that something remains of the held-out ones is said, and where it is in the fitted ones is not. */
static void what_only_held_out_records_show_is_told(void **state)
{
    static struct model_effect of_the_model; /* words name its channel */
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("tip_mass", NULL, 1, i == 0 ? 1.0 : 2.0, 2.0)};
        h[0].model.effects = &of_the_model;
        decide(&d, *state, 30.0, 30.0, h, 1);
        d.remains.n = 1;
        (void)snprintf(d.remains.text, sizeof d.remains.text, "It is there.");
        char *text = diagnose_words(&d);
        d.remains.n = 0;
        if ((strstr(text, "left at the noise, held-out ones at ") != NULL) != (i == 0) ||
            (strstr(text, "It is there.") != NULL) != (i == 1))
            fail_msg("%s", text);
        free(text);
        done(&d);
    }
}

/* Both of a pair are told with what they are. */
static void a_named_pair_is_told_in_words(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "sensor_lag", 2, 1.0, 1.0), refit("tip_mass", NULL, 1, 16.0, 17.0),
                             refit("sensor_lag", NULL, 1, 25.0, 26.0)};
    static struct model_effect of_the_model[2]; /* words name their channels */
    for (size_t i = 0; i < 3; i++)
        h[i].model.effects = of_the_model;
    decide(&d, *state, 30.0, 30.0, h, 3);
    assert_int_equal(d.n_named, 2);
    char *text = diagnose_words(&d), *begin;
    assert_int_not_equal(asprintf(&begin, "Missing: tip_mass + sensor_lag (%s; %s), with probability 0.",
                                  effect_by_id("tip_mass")->title, effect_by_id("sensor_lag")->title),
                         -1);
    if (strstr(text, begin) == NULL)
        fail_msg("%s", text);
    free(text), free(begin);
    done(&d);
}

/* What takes nearly all and is not named is told with the reason. */
static void a_stand_in_is_told_with_its_reason(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("drive_hysteresis", NULL, 3, 1.3, 1.3), refit("axial_load", NULL, 1, 29.0, 29.0)};
    fixture_model(&h[0].model, "  - {kind: drive_hysteresis, share: 0.7, slip_pV: 1e-6, shape_pV: 2.6}\n");
    static struct model_effect of_the_model[1]; /* words name their channels */
    h[1].model.effects = of_the_model;
    decide(&d, *state, 30.0, 30.0, h, 2);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    char *text = diagnose_words(&d);
    if (strstr(text, "(no cause as it is: its hysteresis has no loop") == NULL)
        fail_msg("%s", text);
    free(text);
    for (size_t i = 0; i < 2; i++)
        if (d.hypotheses[i].model.n_effects > 0)
            model_free(&d.hypotheses[i].model);
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

/* The second harmonic of a drive at 25 Hz is a steady line at 50 Hz: where laws take it all, and none more than the others, something is missing. */
static void a_line_that_something_else_explains_is_no_hum(void **state)
{
    static const char *const laws[] = {"cubic_stiffness",  "quadratic_drag",     "large_rotation",
                                       "coulomb_friction", "bilinear_stiffness", "stop_contact"};
    enum { LAWS = sizeof laws / sizeof *laws };
    for (int explained = 0; explained < 2; explained++) {
        struct diagnosis d;
        struct hypothesis h[LAWS];
        static struct model_effect of_the_model;
        for (size_t k = 0; k < LAWS; k++) {
            h[k] = refit(laws[k], NULL, 1, explained ? 1.01 : 1.299, explained ? 1.01 : 1.299);
            h[k].model.effects = &of_the_model;
        }
        decide(&d, *state, 1.3, 1.3, h, LAWS);
        without_hum(&d.baseline.fitted, 1.0), without_hum(&d.baseline.check, 1.0);
        diagnose_decide(&d);
        assert_int_equal(d.verdict, explained ? VERDICT_UNKNOWN : VERDICT_COMPLETE);
        done(&d);
    }
}

/* A baseline that the lack of a cause has driven far off is computed badly there, and well where the cause is: both are told. */
static void the_computation_is_told_where_it_was_asked(void **state)
{
    static const double as_given[] = {0.0, 0.2};
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct predict_channel channel = {0};
        struct record record = {.path = "r.csv"};
        decide(&d, *state, 30.0, 30.0, NULL, 0);
        d.records = &record;
        d.baseline.fit.channels = &channel;
        d.converged = true;
        d.numerics = (struct numerics){.change = i == 0 ? 2.0 : 600.0, .as_given = as_given[i]};
        char *text = diagnose_words(&d);
        if (strstr(text, i == 0
                             ? "The computation itself is off by 2 times the noise on piezo_V of r.csv, far less than "
                               "the misfit."
                             : "off by 6e+02 times the noise on piezo_V of r.csv where the fit of the model as it "
                               "is has ended; at the values as given by 0.2, far less than the misfit.") == NULL)
            fail_msg("%s", text);
        free(text);
        done(&d);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_takes_most_is_told_whatever_its_evidence),
        cmocka_unit_test(what_only_held_out_records_show_is_told),
        cmocka_unit_test(one_of_a_pair_is_named_with_its_company),
        cmocka_unit_test(a_named_pair_is_told_in_words),
        cmocka_unit_test(a_stand_in_is_told_with_its_reason),
        cmocka_unit_test(the_filter_that_was_taken_is_told),
        cmocka_unit_test(hum_alone_is_told_of_a_complete_model),
        cmocka_unit_test(a_line_that_something_else_explains_is_no_hum),
        cmocka_unit_test(the_computation_is_told_where_it_was_asked),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
