/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The verdict, from invented errors of invented refits. The examples are clear ones, so that they hold whatever cases the table was fitted to. */
#include "invented_refits.h"

static void a_good_model_is_complete(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 0.9999, 1.0)};
    decide(&d, *state, 1.0, 1.0, h, 1);
    assert_int_equal(d.verdict, VERDICT_COMPLETE);
    assert_int_equal(d.n_named, 0);
    assert_true(isnan(d.probability));
    done(&d);
}

/* What the spring's stiffness takes of what the damper leaves, the axial load takes of the whole misfit too. */
static void a_special_case_is_named_where_its_general_form_takes_no_more_than_luck(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_spring", NULL, 3, 2.4, 2.6), refit("point_damper", NULL, 2, 3.0, 3.1),
                             refit("axial_load", NULL, 1, 15.0, 15.5)};
    decide(&d, *state, 22.0, 23.0, h, 3);
    d.attainable = (struct attainable){.modes = 4, .nrmse = 0.1, .noise_ratio = 2.4};
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "point_damper");
    assert_ptr_equal(d.hypotheses[0].effects[0], effect_by_id("point_damper"));
    assert_true(fabs(d.hypotheses[0].probability - d.probability) < 1e-12);
    done(&d);
}

static void a_general_form_that_takes_much_more_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.01, 1.01), refit("point_damper", NULL, 2, 4.0, 4.1),
                             refit("axial_load", NULL, 1, 15.0, 15.5)};
    decide(&d, *state, 22.0, 23.0, h, 3);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "point_spring");
    done(&d);
}

/* An offset in one of the fitted records: the held-out ones are at their noise without it, and stay there, or they are not. */
static void what_held_out_records_do_not_show_is_named(void **state)
{
    static const double held_out[] = {1.0134, 1.6};
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("sensor_offset", NULL, 2, 0.98, held_out[i])};
        decide(&d, *state, 5.2, 1.0128, h, 1);
        assert_int_equal(d.verdict, i == 0 ? VERDICT_MISSING : VERDICT_UNKNOWN);
        assert_true(isnan(d.hypotheses[0].held_out_explained)); /* there is nothing to explain */
        done(&d);
    }
}

/* All of a misfit, by predicting nothing: the channel was not connected. Where half of the signal is left it has explained the other half. */
static void what_silences_a_channel_explains_nothing(void **state)
{
    double measured[] = {1.0, -1.0, 0.5, -0.5};
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        double residual[4];
        struct predict_channel channel = {.n = 4, .measured = measured};
        struct hypothesis h[] = {refit("sensor_lag", NULL, 1, 1.01, 1.02), refit("axial_load", NULL, 1, 150.0, 150.0)};
        for (size_t k = 0; k < 4; k++)
            residual[k] = measured[k] * (i == 0 ? 0.999 : 0.5);
        h[0].fit.n_channels = 1, h[0].fit.channels = &channel, h[0].fit.residual = residual;
        decide(&d, *state, 200.0, 200.0, h, 2);
        assert_int_equal(d.verdict == VERDICT_MISSING, i == 1);
        done(&d);
    }
}

/* All but a thousandth of fitted and held-out records, by a refit that has come to its end: above the noise, but nothing far behind it need be brought to its own. */
static void what_takes_all_but_a_thousandth_is_far_ahead(void **state)
{
    static const struct {
        double fitted, check;
        bool converged, ahead;
    } cases[] = {{4.0, 4.0, true, true}, {4.0, 4.0, false, false}, {9.0, 4.0, true, false}, {4.0, 9.0, true, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("tip_mass", NULL, 1, cases[i].fitted, cases[i].check)};
        h[0].fit.converged = cases[i].converged;
        decide(&d, *state, 200.0, 200.0, h, 1);
        assert_false(diagnose_explained(&d, 1));
        assert_int_equal(diagnose_far_ahead(&d, 1), cases[i].ahead);
        done(&d);
    }
}

/* A spring, or a shaking clamp: what the clamp explains beside the spring speaks for both. */
static void each_of_several_is_told_without_the_others(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.60, 1.60),
                             refit("point_spring", "base_motion", 6, 1.52, 1.52),
                             refit("base_motion", NULL, 3, 1.72, 1.72), refit("axial_load", NULL, 1, 20.0, 20.0)};
    bool clamp = false;
    decide(&d, *state, 40.0, 40.0, h, 4);
    assert_int_equal(d.verdict, VERDICT_AMBIGUOUS);
    for (size_t i = 0; i < d.n_hypotheses; i++) {
        const struct hypothesis *one = &d.hypotheses[i];
        assert_true(one->n_effects == 1 || (i > 0 && !one->rival));
        clamp = clamp || (one->n_effects == 1 && one->effects[0] == effect_by_id("base_motion") && one->rival &&
                          one->score < d.hypotheses[0].score - 1.0);
    }
    assert_true(clamp);
    done(&d);
}

static void significance_without_size_names_nothing(void **state)
{
    struct diagnosis d;
    /* Δχ² = 96 of 24000: p far below any level, and 0.2 % of the noise's rms */
    struct hypothesis h[] = {refit("viscoelastic", NULL, 2, 0.998, 0.998)};
    decide(&d, *state, 1.0, 1.0, h, 1);
    assert_int_equal(d.verdict, VERDICT_COMPLETE);
    done(&d);
}

static void one_clear_explanation_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("root_compliance", NULL, 2, 31.0, 33.0),
                             refit("quadratic_drag", NULL, 1, 1.01, 1.02)};
    decide(&d, *state, 37.0, 28.0, h, 2);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "quadratic_drag");
    assert_true(d.probability > 0.9);
    assert_true(d.hypotheses[0].explains);
    done(&d);
}

/*
 * A cause of a measured beam does not end at the noise; that nothing else comes near it is what names it, where a free linear model
 * leaves nearly as much.
 */
static void what_stands_out_is_named_though_it_leaves_much(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 5.0, 5.0), refit("root_compliance", NULL, 2, 70.0, 75.0),
                             refit("axial_load", NULL, 1, 72.0, 80.0)};
    decide(&d, *state, 100.0, 100.0, h, 3);
    d.attainable = (struct attainable){.modes = 4, .nrmse = 0.1, .noise_ratio = 4.0};
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_string_equal(d.named[0], "tip_mass");
    assert_false(d.hypotheses[0].explains);
    assert_true(fabs(d.hypotheses[0].explained - (1.0 - 24.0 / 9999.0)) < 1e-9);
    done(&d);
}

/* Less than half of the misfit, though as much as any linear model and more than any other effect: what is missing is something else. */
static void what_takes_a_little_is_not_named(void **state)
{
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        const double left = i == 0 ? 70.8 : 70.6; /* 0.499 and 0.502 of the power are taken */
        struct hypothesis h[] = {refit("clock_error", NULL, 1, left, left), refit("axial_load", NULL, 1, 100.0, 100.0)};
        decide(&d, *state, 100.0, 100.0, h, 2);
        d.baseline.fitted.nrmse = 0.1;
        d.attainable = (struct attainable){.modes = 4, .nrmse = 1e-3 * left, .noise_ratio = left};
        diagnose_decide(&d);
        assert_true(d.decisions[0].probability > 0.8);
        assert_int_equal(d.verdict, i == 0 ? VERDICT_UNKNOWN : VERDICT_MISSING);
        done(&d);
    }
}

/* Stand-ins: each takes a little, none more than the others. */
static void none_of_a_crowd_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("root_compliance", NULL, 2, 15.0, 17.0), refit("axial_load", NULL, 1, 15.2, 17.0),
                             refit("viscoelastic", NULL, 2, 15.3, 17.1),    refit("point_spring", NULL, 3, 15.1, 17.1),
                             refit("rotary_inertia", NULL, 1, 15.4, 17.2),  refit("clock_error", NULL, 1, 15.5, 17.3)};
    decide(&d, *state, 20.0, 20.0, h, 6);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(d.n_named, 0);
    assert_true(d.hypotheses[0].probability < 0.5);
    done(&d);
}

static void two_that_explain_alike_are_ambiguous(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("hysteretic_damping", NULL, 1, 1.00001, 1.0),
                             refit("square_root_damping", NULL, 1, 1.0, 1.0),
                             refit("viscoelastic", NULL, 2, 60.0, 60.0)};
    decide(&d, *state, 90.0, 80.0, h, 3);
    assert_true(d.verdict == VERDICT_AMBIGUOUS || d.verdict == VERDICT_UNKNOWN);
    assert_true(d.n_decisions >= 2);
    assert_true(d.decisions[1].probability >= d.decisions[0].probability);
    done(&d);
}

/* A mass at a free place is listed as what it is a special case of where that does as well. */
static void of_several_each_is_listed_as_its_special_case(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_mass", NULL, 2, 1.02, 1.02), refit("root_compliance", NULL, 2, 1.02, 1.02),
                             refit("tip_mass", NULL, 1, 1.021, 1.021), refit("axial_load", NULL, 1, 60.0, 60.0)};
    decide(&d, *state, 90.0, 80.0, h, 4);
    assert_int_equal(d.verdict, VERDICT_AMBIGUOUS);
    bool tip = false, point = false;
    for (size_t i = 0; i < d.n_named; i++)
        tip = tip || strcmp(d.named[i], "tip_mass") == 0, point = point || strcmp(d.named[i], "point_mass") == 0;
    assert_true(tip && !point);
    for (size_t i = 0; i < d.n_hypotheses; i++) {
        const struct hypothesis *one = &d.hypotheses[i];
        const bool listed = i == 0 || one->rival, mass = strcmp(one->effects[0]->id, "tip_mass") == 0;
        assert_true(!mass || (listed && one->probability > 0.1));
        assert_true(!listed || strcmp(one->effects[0]->id, "point_mass") != 0);
    }
    done(&d);
}

static void held_out_records_break_a_tie(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("hysteretic_damping", NULL, 1, 1.0, 1.5),
                             refit("square_root_damping", NULL, 1, 1.0, 1.0)};
    decide(&d, *state, 9.0, 8.0, h, 2);
    assert_string_equal(d.hypotheses[0].effects[0]->id, "square_root_damping");
    assert_true(d.hypotheses[0].score > d.hypotheses[1].score + 10.0);
    done(&d);
}

static void the_simpler_of_a_family_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_mass", NULL, 2, 0.99999, 1.0), refit("tip_mass", NULL, 1, 1.0, 1.0)};
    decide(&d, *state, 88.0, 90.0, h, 2);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "tip_mass");
    done(&d);
}

/* With its place on the bound a point mass has one unknown, and the same misfit as a tip mass. */
static void a_place_at_the_free_end_does_not_make_the_larger_of_a_family(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_mass", NULL, 1, 1.0, 1.0), refit("tip_mass", NULL, 1, 1.0, 1.0)};
    decide(&d, *state, 12.4, 12.4, h, 2);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "tip_mass");
    done(&d);
}

static void what_fits_and_predicts_worse_is_not_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("viscoelastic", NULL, 2, 1.02, 7.0)};
    decide(&d, *state, 5.0, 6.5, h, 1);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(d.n_named, 0);
    done(&d);
}

/* The subset is among the hypotheses: a second effect has to be worth its parameters. */
static void a_second_effect_that_adds_nothing_is_not_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "sensor_lag", 2, 1.0399, 1.05), refit("tip_mass", NULL, 1, 1.04, 1.05)};
    decide(&d, *state, 30.0, 30.0, h, 2);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    done(&d);
}

static void a_pair_that_one_effect_cannot_replace_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "sensor_lag", 2, 1.0, 1.0), refit("tip_mass", NULL, 1, 16.0, 17.0),
                             refit("sensor_lag", NULL, 1, 25.0, 26.0)};
    decide(&d, *state, 30.0, 30.0, h, 3);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 2);
    done(&d);
}

static void a_damper_is_a_spring_without_stiffness(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.0, 1.0), refit("point_damper", NULL, 2, 1.0, 1.0)};
    decide(&d, *state, 30.0, 30.0, h, 2);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "point_damper");
    done(&d);
}

/* What leaves hum besides the noise explains, and one more effect is asked for; but hum alone is no misfit that something else explains. */
static void hum_is_asked_for_after_what_else_is_missing(void **state)
{
    static const double baselines[] = {3.0, 1.0};
    for (int k = 0; k < 2; k++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("tip_mass", NULL, 1, 1.3, 1.3)};
        decide(&d, *state, 3.2, 3.2, h, 1);
        without_hum(&d.hypotheses[0].fitted, 1.0), without_hum(&d.hypotheses[0].check, 1.0);
        without_hum(&d.baseline.fitted, baselines[k]), without_hum(&d.baseline.check, baselines[k]);
        diagnose_rank(&d, TRIED);
        assert_true(d.hypotheses[0].explains == (k == 0));
        assert_true(diagnose_leaves_hum(&d.hypotheses[0]) == (k == 0));
        assert_true(diagnose_more_wanted(&d));
        done(&d);
    }
}

static void a_computation_that_is_off_blames_no_physics(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 1.0, 1.0)};
    decide(&d, *state, 80.0, 80.0, h, 1);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    d.numerics = (struct numerics){.change = 40.0};
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(d.n_named, 0);
    d.numerics.change = 5.0; /* a misfit sixteen times the error of the computation is physics */
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    d.numerics.change = NAN; /* no finer computation: nothing is ruled out */
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    done(&d);
}

static void an_interrupted_search_names_nothing(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 1.0, 1.0)};
    decide(&d, *state, 80.0, 80.0, h, 1);
    d.interrupted = true;
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(d.n_named, 0);
    done(&d);
    decide(&d, *state, 1.0, 1.0, h, 0); /* nothing was tried: no reason to call it complete */
    d.interrupted = true;
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    done(&d);
}

/* A support that rocks beside a mass, and a clamp that gives, which alone takes a part: the second is not named in the place of the first. */
static void a_soft_clamp_is_no_support_that_rocks(void **state)
{
    for (int rocks = 0; rocks < 2; rocks++) {
        struct diagnosis d;
        struct model_effect clamp = {.effect = effect_by_id("root_compliance")};
        struct hypothesis h[] = {
            refit("root_compliance", "point_mass", 3, 1.0, 1.0), refit("root_compliance", NULL, 2, 70.0, 75.0),
            refit("axial_load", NULL, 1, 80.0, 85.0), refit("root_compliance", "point_spring", 4, 1.001, 1.001)};
        struct model_effect support = {.effect = clamp.effect};
        clamp.parameters[2].fixed = true;
        support.parameters[2].fixed = rocks == 0;
        h[0].model = h[3].model = (struct model){.n_effects = 1, .effects = &support};
        h[1].model = (struct model){.n_effects = 1, .effects = &clamp};
        decide(&d, *state, 100.0, 100.0, h, 4);
        assert_true(d.decisions[0].probability >= 0.8); /* that it is there, in whatever form */
        assert_true((d.verdict == VERDICT_MISSING) == (rocks == 0));
        done(&d);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_model_is_complete),
        cmocka_unit_test(a_special_case_is_named_where_its_general_form_takes_no_more_than_luck),
        cmocka_unit_test(what_held_out_records_do_not_show_is_named),
        cmocka_unit_test(what_silences_a_channel_explains_nothing),
        cmocka_unit_test(what_takes_all_but_a_thousandth_is_far_ahead),
        cmocka_unit_test(a_general_form_that_takes_much_more_is_named),
        cmocka_unit_test(each_of_several_is_told_without_the_others),
        cmocka_unit_test(significance_without_size_names_nothing),
        cmocka_unit_test(one_clear_explanation_is_named),
        cmocka_unit_test(what_stands_out_is_named_though_it_leaves_much),
        cmocka_unit_test(what_takes_a_little_is_not_named),
        cmocka_unit_test(none_of_a_crowd_is_named),
        cmocka_unit_test(two_that_explain_alike_are_ambiguous),
        cmocka_unit_test(of_several_each_is_listed_as_its_special_case),
        cmocka_unit_test(held_out_records_break_a_tie),
        cmocka_unit_test(the_simpler_of_a_family_is_named),
        cmocka_unit_test(a_place_at_the_free_end_does_not_make_the_larger_of_a_family),
        cmocka_unit_test(what_fits_and_predicts_worse_is_not_named),
        cmocka_unit_test(a_second_effect_that_adds_nothing_is_not_named),
        cmocka_unit_test(a_pair_that_one_effect_cannot_replace_is_named),
        cmocka_unit_test(a_soft_clamp_is_no_support_that_rocks),
        cmocka_unit_test(a_damper_is_a_spring_without_stiffness),
        cmocka_unit_test(hum_is_asked_for_after_what_else_is_missing),
        cmocka_unit_test(a_computation_that_is_off_blames_no_physics),
        cmocka_unit_test(an_interrupted_search_names_nothing),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
