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
        if (one->n != 1)
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
        cmocka_unit_test(what_stands_beside_it_answers_for_its_kin),
        cmocka_unit_test(a_spring_that_attracts_is_no_explanation),
        cmocka_unit_test(a_spring_that_attracts_is_no_rival_of_what_leaves_less),
        cmocka_unit_test(a_damper_is_not_judged_by_a_spring_that_attracts),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
