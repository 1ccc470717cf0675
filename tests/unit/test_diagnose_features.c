/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What makes an answer more or less sure: a free place, the size of the misfit, what stands alone, what explains nothing. */
#include "invented_refits.h"

#include "explain/diagnose_presence.h"
#include "explain/diagnose_relatives.h"
#include "model_fixture.h"

/* With its place a mass or a spring follows much of what another cause does: the same errors make it less sure than what has no place. */
static void what_follows_much_is_less_sure(void **state)
{
    static const char *const ids[] = {"axial_load", "point_damper", "tip_mass", "point_mass", "point_spring"};
    enum { N = sizeof ids / sizeof *ids, FREE = 3 };
    double probability[N];
    for (int i = 0; i < N; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit(ids[i], NULL, 2, 1.01, 1.02), refit("root_compliance", NULL, 2, 31.0, 33.0)};
        decide(&d, *state, 37.0, 28.0, h, 2);
        assert_true((d.decisions[0].feature[FEATURE_FOLLOWS] > 0.5) == (i >= FREE));
        probability[i] = d.decisions[0].probability;
        done(&d);
    }
    for (int i = 0; i < FREE; i++)
        for (int k = FREE; k < N; k++)
            assert_true(probability[i] > probability[k] + 0.05 && probability[k] > 0.8);
}

/* What takes next to nothing is not sure because a free linear model has found even less: then that is no measure of what can be left. */
static void a_poor_linear_model_is_no_floor(void **state)
{
    double probability[2];
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("patch_position", NULL, 1, 3.9, 3.9), refit("axial_load", NULL, 1, 4.3, 4.3)};
        decide(&d, *state, 4.35, 4.35, h, 2);
        d.attainable = (struct attainable){
            .modes = 7, .noise_ratio = i == 0 ? 3.9 : 6.9, .held_out_noise_ratio = i == 0 ? 3.9 : 6.9};
        diagnose_decide(&d);
        assert_true((d.decisions[0].feature[FEATURE_REMAINS] > 0.9) == (i == 1));
        probability[i] = d.decisions[0].probability;
        d.attainable = (struct attainable){0};
        done(&d);
    }
    assert_true(probability[1] < probability[0] - 0.1);
}

/* A mass at the free end, of which the special case without a place does as well, is judged as that. */
static void a_place_that_is_not_needed_makes_nothing_less_sure(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_mass", NULL, 2, 1.01, 1.01), refit("tip_mass", NULL, 1, 1.0101, 1.0101),
                             refit("root_compliance", NULL, 2, 31.0, 25.0)};
    decide(&d, *state, 37.0, 28.0, h, 3);
    assert_string_equal(d.named[0], "tip_mass");
    assert_true(d.decisions[0].feature[FEATURE_FOLLOWS] < 0.5 && d.probability > 0.9);
    done(&d);
}

/* The features of the first decision, where the misfit is that share of the signal. */
static const double *features_at(struct diagnosis *d, double share)
{
    d->baseline.fitted.nrmse = share;
    diagnose_decide(d);
    return d->decisions[0].feature;
}

/* A mass at a free place stands in for what is small; nothing but a mass does what one of half a beam's does. */
static void of_a_large_misfit_a_mass_is_surer(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("point_mass", NULL, 2, 1.2, 1.2), refit("root_compliance", NULL, 2, 60.0, 60.0)};
    decide(&d, *state, 100.0, 100.0, h, 2);
    assert_true(features_at(&d, 0.01)[FEATURE_FOLLOWS] == 1.0);
    const double unsure = d.decisions[0].probability;
    const double middle = features_at(&d, 0.1)[FEATURE_FOLLOWS];
    assert_true(middle > 0.5 && middle < 0.9);
    const double large = features_at(&d, 0.5)[FEATURE_FOLLOWS];
    assert_true(fabs(large - 0.5 * d.decisions[0].feature[FEATURE_REMAINS]) < 1e-12);
    assert_true(d.verdict == VERDICT_MISSING && d.decisions[0].probability > unsure + 0.1);
    done(&d);
}

/* A spring stands in for all that stiffens a beam, tension above all, but then it leaves something. */
static void a_spring_is_sure_only_where_it_leaves_nothing(void **state)
{
    static const double left[] = {1.0, 4.0};
    double follows[2];
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_spring", NULL, 3, left[i], left[i]),
                                 refit("root_compliance", NULL, 2, 60.0, 60.0)};
        decide(&d, *state, 100.0, 100.0, h, 2);
        follows[i] = features_at(&d, 0.9)[FEATURE_FOLLOWS];
        done(&d);
    }
    assert_true(follows[0] < 0.05 && follows[1] > 0.9);
}

/* One that holds the beam has its place alone to follow with, whatever is left. */
static void a_rigid_support_follows_nothing(void **state)
{
    for (int rigid = 0; rigid < 2; rigid++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_spring", NULL, 3, 4.0, 4.0),
                                 refit("root_compliance", NULL, 2, 60.0, 60.0)};
        struct model held;
        fixture_model(&held, "  - {kind: point_spring, stiffness_Npm: 1, damping_Nspm: 0, at_m: 0.1}\n");
        held.effects[0].parameters[0].value = (rigid ? 2.0 : 0.5) * diagnose_rigid_Npm(&held);
        h[0].model = held;
        decide(&d, *state, 100.0, 100.0, h, 2);
        const double follows = features_at(&d, 0.9)[FEATURE_FOLLOWS];
        assert_true(rigid ? follows == 0.0 : follows > 0.9);
        done(&d);
        model_free(&held);
    }
}

/* The rig's own errors leave much of a change that was made on purpose: that nothing else takes much of it tells the cause all the same. */
static void what_takes_a_large_misfit_alone_is_surer(void **state)
{
    static const double other[] = {99.0, 30.0, 10.0}, share[] = {0.9, 0.05};
    double alone[2][3];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++) {
            struct diagnosis d;
            struct hypothesis h[] = {refit("tip_mass", NULL, 1, 10.0, 10.0),
                                     refit("root_compliance", NULL, 2, other[i], other[i])};
            decide(&d, *state, 100.0, 100.0, h, 2);
            alone[k][i] = features_at(&d, share[k])[FEATURE_ALONE];
            done(&d);
        }
    assert_true(alone[0][0] > 0.9 && alone[0][0] > alone[0][1] + 0.05 && alone[0][2] < 0.01);
    for (int i = 0; i < 3; i++)
        assert_true(alone[1][i] < 0.1 * alone[0][i] + 1e-9);
}

/* It takes three quarters: what takes the rest may as well be the cause of all. */
/* Of a baseline that leaves twice as much as no model at all the signal is what there is to explain: what makes the beam silent has explained nothing of it. */
static void silence_explains_nothing(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 15.0, 15.0),
                             refit("square_root_damping", NULL, 1, 100.0, 100.0)};
    decide(&d, *state, 200.0, 200.0, h, 2);
    const double against_nothing = d.hypotheses[1].explained;
    d.baseline.fitted.silent_ratio = d.baseline.check.silent_ratio = 100.0;
    diagnose_rank(&d, 1);
    assert_true(against_nothing > 0.7);
    assert_true(fabs(d.hypotheses[1].explained) < 1e-12 && fabs(d.hypotheses[1].held_out_explained) < 1e-12);
    assert_true(d.hypotheses[0].explained > 0.97 && d.hypotheses[0].explained < 0.98);
    done(&d);
}

static void what_leaves_a_quarter_is_not_alone(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 50.0, 50.0), refit("root_compliance", NULL, 2, 99.0, 99.0)};
    decide(&d, *state, 100.0, 100.0, h, 2);
    assert_true(features_at(&d, 0.9)[FEATURE_ALONE] == 0.0);
    done(&d);
}

/* A mass near the free end, but not there, of which another effect takes much, too. */
static void a_special_case_that_leaves_four_times_as_much_is_not_named(void **state)
{
    static const double left[] = {1.2, 4.6};
    for (int i = 0; i < 2; i++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_mass", NULL, 2, 1.02, 1.01), refit("tip_mass", NULL, 1, left[i], left[i]),
                                 refit("root_compliance", NULL, 2, 2.0, 2.0)};
        decide(&d, *state, 214.0, 207.0, h, 3);
        size_t mass = 0;
        while (strcmp(d.hypotheses[mass].effects[0]->id, "point_mass") != 0)
            mass++;
        assert_string_equal(d.hypotheses[diagnose_simplest(&d, mass)].effects[0]->id,
                            i == 0 ? "tip_mass" : "point_mass");
        done(&d);
    }
}

/* What a spring that attracts stands for is still to be found. */
static void a_spring_that_attracts_has_explained_nothing(void **state)
{
    for (int k = 0; k < 2; k++) {
        struct diagnosis d;
        struct hypothesis h[] = {refit("point_spring", NULL, 3, 1.0, 1.0)};
        fixture_model(&h[0].model, k == 0 ? "  - {kind: point_spring, stiffness_Npm: -20, at_m: 0.3}\n"
                                          : "  - {kind: point_spring, stiffness_Npm: 20, at_m: 0.3}\n");
        decide(&d, *state, 200.0, 200.0, h, 1);
        assert_true(d.hypotheses[0].explains);
        assert_true(diagnose_explained(&d, 1) == (k == 1));
        model_free(&d.hypotheses[0].model);
        done(&d);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_poor_linear_model_is_no_floor),
        cmocka_unit_test(what_follows_much_is_less_sure),
        cmocka_unit_test(a_place_that_is_not_needed_makes_nothing_less_sure),
        cmocka_unit_test(of_a_large_misfit_a_mass_is_surer),
        cmocka_unit_test(a_spring_is_sure_only_where_it_leaves_nothing),
        cmocka_unit_test(a_rigid_support_follows_nothing),
        cmocka_unit_test(what_takes_a_large_misfit_alone_is_surer),
        cmocka_unit_test(silence_explains_nothing),
        cmocka_unit_test(what_leaves_a_quarter_is_not_alone),
        cmocka_unit_test(a_special_case_that_leaves_four_times_as_much_is_not_named),
        cmocka_unit_test(a_spring_that_attracts_has_explained_nothing),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
