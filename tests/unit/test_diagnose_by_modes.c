/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The road by way of the modes: to a baseline, to single effects and to pairs. */
#include "diagnose_rig.h"
#include "explain/diagnose_shortlist.h"

/* What a free linear model tells of the fitted records. */
static void find_modes(struct bench *b)
{
    struct diagnosis *d = &b->d;
    struct bf_error err;
    double noise[2 * MOST_RECORDS];
    for (size_t c = 0; c < d->n_channels; c++)
        noise[d->baseline.fit.channels[c].record * 2 + d->baseline.fit.channels[c].output] = d->noise[c].rms;
    assert_int_equal(attainable_find(d->model, d->records, d->n_records, noise, &d->attainable, &err), BF_OK);
    assert_true(d->attainable.modes >= 3);
}

static void extend_by_modes(struct diagnose_state *w)
{
    const struct candidate_options options = {.without = w->options->without, .n_without = w->options->n_without};
    struct candidate_list list = {0};
    struct bf_error err;
    assert_int_equal(candidate_list_new(&w->d->baseline.model, w->d->records, w->d->n_records, &options, &list, &err),
                     BF_OK);
    assert_int_equal(diagnose_by_modes(w, &list, &err), BF_OK);
    candidate_list_free(&list);
}

/* As a fit leaves it that has locked in to wrong cycles: its values, and what it has come to. */
static void ruin(struct hypothesis *baseline)
{
    baseline->model.materials[0].EI.value *= 2.0;
    baseline->fit.chi2_per_row = 1e5;
    baseline->fitted.noise_ratio = 300.0, baseline->fitted.nrmse = 0.9;
}

/* Its modes lead from the model as given to the minimum that it has missed, where the computation is checked; one that stands there is left alone. */
static void a_baseline_that_has_come_nowhere_is_fitted_to_the_modes(void **state)
{
    (void)state;
    static const char *const none[] = {NULL};
    for (int ruined = 0; ruined < 2; ruined++) {
        struct bench *b = bench_new("", 2, LONG, 0.004, none);
        b->given.materials[0].EI.value *= 1.3;
        struct diagnose_state w = begun(b);
        struct bf_error err;
        find_modes(b);
        if (ruined)
            ruin(&b->d.baseline);
        const size_t evaluations = b->d.evaluations;
        assert_false(b->d.numerics.fine);
        assert_int_equal(diagnose_baseline_by_modes(&w, &err), BF_OK);
        assert_int_equal(b->d.numerics.fine, ruined);
        assert_int_equal(b->d.evaluations > evaluations, ruined);
        assert_true(b->d.baseline.fitted.noise_ratio < 1.05);
        assert_true(fabs(b->d.baseline.model.materials[0].EI.value - 0.5) < 0.005);
        state_free(&w);
        bench_free(b);
    }
}

/*
 * A clamp that shakes leaves the beam's modes as they are, and far more of the records than modes that are nearly right could: no effect of the beam is refitted. What a mass
 * leaves, its modes tell.
 */
static void modes_that_are_right_clear_the_beam(void **state)
{
    (void)state;
    static const char *const ids[] = {"tip_mass", "point_spring", "base_motion", NULL},
                             *const truths[] = {
                                 "{kind: tip_mass, mass_kg: 0.004}",
                                 "{kind: base_motion, amplitude_mps2: 1, frequency_Hz: 45, phase_rad: 0}"};
    for (int shaken = 0; shaken < 2; shaken++) {
        struct bench *b = bench_new(truths[shaken], 2, LONG, 0.004, ids);
        struct diagnose_state w = begun(b);
        struct bf_error err;
        find_modes(b);
        assert_true(b->d.baseline.fitted.nrmse > 0.2);
        extend_by_modes(&w);
        assert_int_equal(diagnose_modes_clear_beam(&w), shaken);
        assert_int_equal(b->d.n_hypotheses == 0, shaken);
        assert_int_equal(diagnose_modes_rule_out(&w, b->truth.effects[0].effect), false);
        assert_int_equal(diagnose_modes_rule_out(&w, effect_find("tip_mass", &err)), shaken);
        state_free(&w);
        bench_free(b);
    }
}

/* A mass at the tip and a spring within the span: neither explains the modes alone, and the pair is found from them. */
static void a_pair_is_found_from_the_modes(void **state)
{
    (void)state;
    static const char *const ids[] = {"tip_mass", "point_spring", "axial_load", NULL};
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.004}, {kind: point_spring, stiffness_Npm: 60, "
                                "damping_Nspm: 0.001, at_m: 0.25}",
                                2, LONG, 0.004, ids);
    struct diagnose_state w = begun(b);
    struct bf_error err;
    find_modes(b);
    extend_by_modes(&w);
    assert_true(b->d.n_hypotheses > 0 && diagnose_best_left(&b->d, 1) > 3.0);
    assert_int_equal(diagnose_pairs_by_modes(&w, &err), BF_OK);
    assert_true(diagnose_best_left(&b->d, 2) < 1.2);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_int_equal(best->n_effects, 2);
    for (size_t e = 0; e < 2; e++) {
        const bool mass = strcmp(best->effects[e]->id, "tip_mass") == 0;
        const double truth = mass ? 0.004 : 60.0;
        assert_true(mass || strcmp(best->effects[e]->id, "point_spring") == 0);
        assert_true(fabs(best->model.effects[e].parameters[0].value - truth) < 0.01 * truth);
    }
    state_free(&w);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_baseline_that_has_come_nowhere_is_fitted_to_the_modes),
        cmocka_unit_test(modes_that_are_right_clear_the_beam),
        cmocka_unit_test(a_pair_is_found_from_the_modes),
    };
    return cmocka_run_group_tests_name("diagnose by modes", tests, NULL, NULL);
}
