/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What speaks against an effect, from invented errors of invented refits: not its kin, unless that stands beside it, and no spring that attracts. */
#include "invented_refits.h"

/* Whether a mass is there as well, beside a tip mass, the tip mass with something else answers, though it is kin; alone it speaks against no mass. */
static void what_stands_beside_it_answers_for_its_kin(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "point_mass", 3, 1.2, 1.2),
                             refit("tip_mass", "axial_load", 2, 1.25, 1.25), refit("tip_mass", NULL, 1, 4.0, 4.0),
                             refit("axial_load", NULL, 1, 100.0, 100.0)};
    size_t asked = 0;
    decide(&d, *state, 200.0, 200.0, h, 4);
    for (size_t k = 0; k < d.n_decisions; k++) {
        const struct decision *one = &d.decisions[k];
        if (one->n != 1 || one->n_beside > 0)
            continue;
        const struct hypothesis *without = &d.hypotheses[one->without];
        const bool of_mass = one->among[0] == effect_by_id("point_mass");
        assert_int_equal(without->n_effects, of_mass ? 2 : 1);
        assert_true(without->fitted.noise_ratio == (of_mass ? 1.25 : 100.0));
        asked += of_mass;
    }
    assert_int_equal(asked, 1);
    done(&d);
}

/* The probability of an effect that was weighed with others taken to be there; NaN: it was not. */
static double beside_of(const struct diagnosis *d, const char *id)
{
    for (size_t k = 0; k < d->n_decisions; k++)
        if (d->decisions[k].n_beside > 0 && d->decisions[k].among[0] == effect_by_id(id))
            return d->decisions[k].probability;
    return (double)NAN;
}

/*
 * Of a pair that leaves the noise the first stands out, and the second, the first being there, of all that could stand beside it: both are named. A set of three that
 * leaves as much as the pair speaks not against the second (three effects can do what two others do), another pair that does so speaks.
 */
static void the_second_of_a_pair_is_weighed_beside_the_first(void **state)
{
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("sensor_delay", "hysteretic_damping", 2, 1.0, 1.0),
                                 refit("sensor_delay", "square_root_damping", i == 0 ? 2 : 5, 1.002, 1.002),
                                 refit("sensor_delay", "point_damper", 3, 2.2, 2.2),
                                 refit("sensor_delay", NULL, 1, 8.0, 8.0),
                                 refit("hysteretic_damping", NULL, 1, 9.0, 9.0)};
        if (i == 1)
            h[1].effects[h[1].n_effects++] = effect_by_id("point_spring");
        decide(&d, *state, 30.0, 30.0, h, 5);
        assert_int_equal(d.verdict, VERDICT_MISSING);
        assert_int_equal(d.n_named, i == 0 ? 1 : 2);
        assert_string_equal(d.named[0], "sensor_delay");
        const double beside = beside_of(&d, "hysteretic_damping");
        assert_true(i == 1 ? beside >= 0.8 && d.probability == beside : beside < 0.8);
        assert_true(isnan(beside_of(&d, "sensor_delay")));
        done(&d);
    }
}

/* Where both are sure anyway each is named once. */
static void a_sure_pair_is_named(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", "root_compliance", 3, 1.0, 1.0),
                             refit("tip_mass", "axial_load", 2, 1.3, 1.3), refit("tip_mass", NULL, 1, 9.0, 9.0),
                             refit("root_compliance", NULL, 2, 160.0, 160.0)};
    decide(&d, *state, 200.0, 200.0, h, 4);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 2);
    assert_true(beside_of(&d, "root_compliance") >= 0.8);
    done(&d);
}

/* A spring and a mass at free places have, with the beam's stiffness, as many unknowns as five modes have frequencies: where there are no more, they follow whatever moves them. */
static void a_set_that_can_follow_every_mode_is_suspect(void **state)
{
    double probability[2];
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_spring", "point_mass", 5, 1.02, 1.02),
                                 refit("point_spring", NULL, 3, 6.0, 6.0), refit("axial_load", NULL, 1, 40.0, 40.0)};
        decide(&d, *state, 300.0, 300.0, h, 3);
        d.baseline.fitted.nrmse = 0.9;
        d.n_modes = i == 0 ? 6 : 5;
        diagnose_decide(&d);
        probability[i] = d.decisions[0].probability;
        assert_string_equal(d.decisions[0].among[0]->id, "point_spring");
        assert_true(i == 0 || d.verdict != VERDICT_MISSING);
        done(&d);
    }
    assert_true(probability[0] >= 0.8 && probability[1] < 0.7);
}

/* A spring that attracts nearly always stands in for something else: it is not named, and what leaves more than it is not either. */
static void a_spring_that_attracts_is_no_explanation(void **state)
{
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.01, 1.02), refit("axial_load", NULL, 1, 30.0, 26.0),
                                 refit("root_compliance", NULL, 2, 31.0, 33.0)};
        fixture_model(&h[0].model, i == 0
                                       ? "  - {kind: point_spring, stiffness_Npm: 20, damping_Nspm: 0, at_m: 0.3}\n"
                                       : "  - {kind: point_spring, stiffness_Npm: -20, damping_Nspm: 0, at_m: 0.3}\n");
        decide(&d, *state, 37.0, 28.0, h, 3);
        assert_int_equal(d.verdict, i == 0 ? VERDICT_MISSING : VERDICT_UNKNOWN);
        assert_string_equal(d.decisions[0].among[0]->id, i == 0 ? "point_spring" : "axial_load");
        assert_true(i == 0 || d.decisions[0].probability < 0.3);
        model_free(&d.hypotheses[0].model);
        done(&d);
    }
}

/* A hysteresis whose shape ζ is far above its slip β has no loop: a bent line, which another law of the drive is (a dead zone). */
static void a_hysteresis_without_a_loop_is_no_explanation(void **state)
{
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("drive_hysteresis", NULL, 3, 1.01, 1.02),
                                 refit("mains_hum", NULL, 3, 29.0, 29.0)};
        fixture_model(&h[0].model, i == 0 ? "  - {kind: drive_hysteresis, share: 0.7, slip_pV: 2, shape_pV: 2.6}\n"
                                          : "  - {kind: drive_hysteresis, share: 0.7, slip_pV: 1e-6, shape_pV: 2.6}\n");
        decide(&d, *state, 30.0, 30.0, h, 2);
        assert_int_equal(d.verdict, i == 0 ? VERDICT_MISSING : VERDICT_UNKNOWN);
        for (size_t k = 0; k < d.n_hypotheses; k++)
            if (d.hypotheses[k].model.n_effects > 0)
                model_free(&d.hypotheses[k].model);
        done(&d);
    }
}

/* Where it leaves more than another explanation it is no rival of that either. */
static void a_spring_that_attracts_is_no_rival_of_what_leaves_less(void **state)
{
    double lead[2];
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("axial_load", NULL, 1, 1.01, 1.02),
                                 refit("root_compliance", NULL, 2, 31.0, 33.0),
                                 refit("point_spring", NULL, 3, 1.3, 1.3)};
        fixture_model(&h[2].model, "  - {kind: point_spring, stiffness_Npm: -20, damping_Nspm: 0, at_m: 0.3}\n");
        decide(&d, *state, 37.0, 28.0, h, 2 + (size_t)i);
        assert_string_equal(d.named[0], "axial_load");
        lead[i] = d.decisions[0].feature[FEATURE_LEAD];
        for (size_t k = 0; k < 3; k++)
            if (h[k].model.n_effects > 0)
                model_free(&h[k].model);
        done(&d);
        if (i == 0)
            forget(&h[2]);
    }
    assert_true(fabs(lead[1] - lead[0]) < 0.1 && lead[0] > 4.0);
}

/* Where a spring that attracts leaves less, its special case, the damper, is asked for without it. */
static void a_damper_is_not_judged_by_a_spring_that_attracts(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.01, 1.01), refit("point_damper", NULL, 2, 1.6, 1.7),
                             refit("root_compliance", NULL, 2, 15.0, 16.0)};
    fixture_model(&h[0].model, "  - {kind: point_spring, stiffness_Npm: -20, damping_Nspm: 0.1, at_m: 0.3}\n");
    decide(&d, *state, 37.0, 38.0, h, 3);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_string_equal(d.named[0], "point_damper");
    for (size_t i = 0; i < d.n_hypotheses; i++)
        if (d.hypotheses[i].model.n_effects > 0)
            model_free(&d.hypotheses[i].model);
    done(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sure_pair_is_named),
        cmocka_unit_test(a_hysteresis_without_a_loop_is_no_explanation),
        cmocka_unit_test(the_second_of_a_pair_is_weighed_beside_the_first),
        cmocka_unit_test(a_set_that_can_follow_every_mode_is_suspect),
        cmocka_unit_test(what_stands_beside_it_answers_for_its_kin),
        cmocka_unit_test(a_spring_that_attracts_is_no_explanation),
        cmocka_unit_test(a_spring_that_attracts_is_no_rival_of_what_leaves_less),
        cmocka_unit_test(a_damper_is_not_judged_by_a_spring_that_attracts),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
