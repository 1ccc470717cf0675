/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Refits that are bounded, what becomes of one whose evaluations have run out, and what passes for linear. */
#include "diagnose_rig.h"
#include "explain/diagnose_shortlist.h"

static struct bench *with_mass(void)
{
    static const char *const masses[] = {"tip_mass", NULL};
    return bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, masses);
}

static struct refit_job job_of_mass(size_t most_runs, bool kept)
{
    return (struct refit_job){.model = make("{kind: tip_mass, mass_kg: 1e-5}"),
                              .first_new = 1,
                              .n_effects = 1,
                              .most_runs = most_runs,
                              .kept = kept};
}

/* Out of evaluations it is a hypothesis that has not converged where that was asked for, and none where it was not. */
static void what_runs_out_is_kept_where_it_is_asked_for(void **state)
{
    (void)state;
    enum { FEW = 5 };
    for (int kept = 0; kept < 2; kept++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job job = job_of_mass(FEW, kept == 1);
        diagnose_refits(&w, &job, 1, 0.0);
        assert_true(job.unfinished);
        assert_int_equal(b->d.n_hypotheses, kept);
        if (kept) {
            assert_false(b->d.hypotheses[0].fit.converged);
            assert_true(b->d.hypotheses[0].fit.evaluations >= FEW);
            assert_true(b->d.hypotheses[0].fitted.noise_ratio > 1.05);
        }
        state_free(&w);
        bench_free(b);
    }
}

/* The bound of a law's refit, and that what it has taken counts: of a search that has spent much on laws the next one has a quarter. */
static void laws_have_so_many_evaluations_together(void **state)
{
    (void)state;
    static const char *const laws[] = {"cubic_stiffness", NULL};
    size_t most_runs[2];
    for (int spent = 0; spent < 2; spent++) {
        struct bench *b = bench_new("{kind: cubic_stiffness, coefficient_Npm3: 1e5, at_m: 0.3}", 2, SHORT, 0.01, laws);
        struct diagnose_state w = begun(b);
        struct refit_job job = {
            .model = make("{kind: cubic_stiffness, coefficient_Npm3: 9e4, at_m: 0.3}"), .first_new = 1, .n_effects = 1};
        const size_t before = spent ? 10000 : 0;
        w.law_runs = before;
        diagnose_refits(&w, &job, 1, 0.0);
        assert_true(w.law_runs > before);
        most_runs[spent] = job.most_runs;
        state_free(&w);
        bench_free(b);
    }
    assert_int_equal(most_runs[0], 4 * most_runs[1]);
}

static void what_ends_in_time_is_as_without_a_bound(void **state)
{
    (void)state;
    double left[2];
    for (int bounded = 0; bounded < 2; bounded++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job job = job_of_mass(bounded ? 2000 : 0, bounded == 1);
        diagnose_refits(&w, &job, 1, 0.0);
        assert_false(job.unfinished);
        assert_int_equal(b->d.n_hypotheses, 1);
        left[bounded] = b->d.hypotheses[0].fitted.noise_ratio;
        state_free(&w);
        bench_free(b);
    }
    assert_true(left[0] < 1.05);
    assert_true(fabs(left[1] - left[0]) < 1e-9);
}

/* Each evaluation of a law is a step through time, and a law that is not there takes thousands: its refit is bounded, a linear effect's is not. */
static void only_laws_are_bounded(void **state)
{
    (void)state;
    static const char *const effects[] = {"{kind: cubic_stiffness, coefficient_Npm3: 1e4, at_m: 0.2}",
                                          "{kind: tip_mass, mass_kg: 1e-3}"};
    for (int linear = 0; linear < 2; linear++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job job = {.model = make(effects[linear]), .first_new = 1, .n_effects = 1, .near = true};
        diagnose_refits(&w, &job, 1, 0.0);
        assert_int_equal(job.most_runs > 0, linear == 0);
        assert_int_equal(job.kept, linear == 0);
        assert_int_equal(b->d.n_hypotheses, 1);
        state_free(&w);
        bench_free(b);
    }
}

/* One that promises little, a rival of what has taken nearly all of the misfit, and one beside a linear effect that takes most of a misfit that does not go with the level is given up sooner. */
static void a_rival_law_is_given_up_sooner(void **state)
{
    (void)state;
    size_t most[4];
    for (int k = 0; k < 4; k++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job mass = job_of_mass(0, false);
        struct refit_job job = {.model = make("{kind: cubic_stiffness, coefficient_Npm3: 1e4, at_m: 0.2}"),
                                .first_new = 1,
                                .n_effects = 1,
                                .near = true,
                                .doubtful = k == 1};
        if (k >= 2)
            diagnose_refits(&w, &mass, 1, 0.0);
        else
            model_free(&mass.model);
        diagnose_rank(&b->d, w.n_tried);
        if (k == 3) { /* it has come half of the way only */
            b->d.hypotheses[0].fitted.noise_ratio = 0.6 * b->d.baseline.fitted.noise_ratio;
            b->d.hypotheses[0].explained = 0.6;
            b->d.hypotheses[0].explains = false;
            b->d.linearity.verdict = LINEARITY_LINEAR;
        }
        assert_int_equal(diagnose_nearly_there(&b->d, 1), k == 2);
        diagnose_refits(&w, &job, 1, 0.0);
        most[k] = job.most_runs;
        state_free(&w);
        bench_free(b);
    }
    assert_true(most[1] < most[0]);
    assert_int_equal(most[2], most[1]);
    assert_int_equal(most[3], most[1]);
}

/* Nearly all of the misfit, and of the held-out records, where they have one, as much or what a free linear model takes: whatever is left. */
static void an_answer_leaves_what_it_will(void **state)
{
    (void)state;
    static const double explained[] = {0.98, 0.98, 0.98, 0.96, 0.98, 0.98},
                        held_out[] = {0.975, NAN, 0.2, 0.99, 0.9, 0.2}, floor[] = {50, NAN, 199, 199, NAN, 100};
    struct hypothesis h = {.n_effects = 1};
    struct diagnosis d = {.hypotheses = &h, .n_hypotheses = 1};
    h.fitted.noise_ratio = h.check.noise_ratio = 200.0;
    for (size_t k = 0; k < sizeof explained / sizeof *explained; k++) {
        h.explained = explained[k], h.held_out_explained = held_out[k];
        d.attainable.held_out_noise_ratio = floor[k];
        assert_int_equal(diagnose_has_answer(&d, 1), k < 3);
        assert_false(diagnose_has_answer(&d, 2));
    }
}

/* Near the noise, fitted and held out, and nearly all of the misfit taken; what it is held against. */
static void what_is_nearly_there_has_both(void **state)
{
    (void)state;
    struct hypothesis h = {.n_effects = 1};
    struct diagnosis d = {.hypotheses = &h, .n_hypotheses = 1};
    static const double left[] = {1.4, 2.0, 3.5, 1.4, 1.4}, before[] = {10.0, 5.0, 100.0, 2.0, 10.0},
                        held_out[] = {1.5, 1.5, 1.5, 1.5, 4.0};
    for (size_t k = 0; k < sizeof left / sizeof *left; k++) {
        h.fitted.noise_ratio = left[k], h.check.noise_ratio = held_out[k];
        h.check.n_channels = 1;
        d.baseline.fitted.noise_ratio = before[k];
        assert_int_equal(diagnose_nearly_there(&d, 1), k == 0);
        assert_false(diagnose_nearly_there(&d, 2));
    }
}

/* A free linear model of the same records leaves the noise: nothing nonlinear is seen in them. Held-out records must say so, too. */
static void what_a_linear_model_leaves_at_the_noise_passes_for_linear(void **state)
{
    (void)state;
    struct diagnosis d = {.attainable = {.modes = 4, .noise_ratio = 1.01, .held_out_noise_ratio = 1.02}};
    d.linearity.verdict = LINEARITY_CANNOT_TELL;
    assert_true(diagnose_passes_for_linear(&d));
    d.attainable.held_out_noise_ratio = 1.3;
    assert_false(diagnose_passes_for_linear(&d));
    d.baseline.check.noise_ratio = 30.0; /* next to nothing of what the baseline leaves of them: values are open */
    assert_true(diagnose_passes_for_linear(&d));
    d.attainable.held_out_noise_ratio = 1.5;
    assert_false(diagnose_passes_for_linear(&d));
    d.baseline.check.noise_ratio = 0.0;
    d.attainable.held_out_noise_ratio = nan(""); /* there are none */
    assert_true(diagnose_passes_for_linear(&d));
    d.attainable.held_out_noise_ratio = 1.02;
    d.attainable.noise_ratio = 1.2;
    assert_false(diagnose_passes_for_linear(&d));
    d.attainable.noise_ratio = 1.01;
    d.linearity.verdict = LINEARITY_NONLINEAR;
    assert_false(diagnose_passes_for_linear(&d));
}

/* A free linear model leaves what the baseline does where a nonlinearity is missing: no linear effect outdoes another one there, and laws are still wanted. */
static void what_takes_nothing_is_outdone(void **state)
{
    (void)state;
    struct hypothesis h = {.n_effects = 1, .effects = {effect_by_id("tip_mass")}, .fitted.noise_ratio = 7.21};
    struct diagnosis d = {.attainable = {.modes = 4, .noise_ratio = 7.2, .held_out_noise_ratio = NAN},
                          .n_hypotheses = 1,
                          .hypotheses = &h};
    h.check.noise_ratio = NAN;
    h.explained = 0.02;
    assert_false(diagnose_no_linear_outdoes(&d));
    h.explained = 0.9;
    assert_true(diagnose_no_linear_outdoes(&d));
    h.fitted.noise_ratio = 7.4;
    assert_false(diagnose_no_linear_outdoes(&d));
    h.fitted.noise_ratio = 7.21;
    h.effects[0] = effect_by_id("cubic_stiffness");
    assert_false(diagnose_no_linear_outdoes(&d));
}

/* Held-out records without a known noise are at no noise, with hum or without. */
static void an_unknown_noise_explains_nothing(void **state)
{
    (void)state;
    static const struct noise_estimate none;
    const struct fit_channel_error channel = {.n = 100, .noise_ratio = NAN, .nrmse = 0.1};
    struct hypothesis h = {0};
    hypothesis_take_check(&h, &channel, &none, 1);
    assert_true(isnan(h.check.noise_ratio) && isnan(h.check.humless_ratio));
    hypothesis_free(&h);
}

static const char *const tried_laws[] = {"microslip", "coulomb_friction", "patch_softening"};

/* Their trials take these shares of what they are given, and leave so much, rms in units of their own weights; NULL: of the same. */
static struct shortlist *with_trials(struct diagnose_state *w, const double share[], const double left[], size_t n)
{
    struct shortlist *s;
    struct bf_error err;
    w->d->baseline.fitted.noise_ratio = 15.0;
    assert_int_equal(shortlist_new(w, &w->d->baseline, &s, &err), BF_OK);
    s->trials = bf_alloc(n, sizeof *s->trials);
    for (s->n_trials = 0; s->n_trials < n; s->n_trials++)
        s->trials[s->n_trials] =
            (struct trial){.effect = effect_by_id(tried_laws[s->n_trials]),
                           .possible = true,
                           .chi_square_baseline = 1.0,
                           .chi_square = 1.0 - share[s->n_trials],
                           .share = share[s->n_trials],
                           .unexplained = left ? left[s->n_trials] : 4.75 * sqrt(1.0 - share[s->n_trials])};
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < s->list.n; k++)
            if (s->list.candidates[k].effect == s->trials[i].effect)
                memcpy(s->trials[i].p, s->list.candidates[k].start, sizeof s->trials[i].p);
    return s;
}

/* How many of n laws are refitted whose trials take these shares, the best first. */
static size_t laws_refitted(struct diagnose_state *w, const double share[], size_t n)
{
    struct shortlist *s = with_trials(w, share, NULL, n);
    struct refit_job *jobs = NULL;
    size_t n_jobs = 0;
    shortlist_choose_laws(s, 4, s->trials[0].unexplained, &jobs, &n_jobs);
    for (size_t i = 0; i < n_jobs; i++)
        model_free(&jobs[i].model);
    free(jobs);
    shortlist_free(s);
    return n_jobs;
}

/*
 * Of laws that all promise too little the one that takes the largest share is refitted, though another leaves less in units of its own weights, and beside it one that takes nearly
 * as much.
 */
static void the_last_laws_take_the_largest_shares(void **state)
{
    (void)state;
    static const char *const laws[] = {"microslip", "coulomb_friction", "patch_softening", NULL};
    static const double share[][3] = {{0.04, 0.34, 0.08}, {0.04, 0.34, 0.3}}, left[] = {1.75, 1.79, 1.9};
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, laws);
    struct diagnose_state w = begun(b);
    for (size_t i = 0; i < 2; i++) {
        struct shortlist *s = with_trials(&w, share[i], left, 3);
        struct refit_job *jobs = NULL;
        size_t n = 0;
        shortlist_choose_last(s, left[0], &jobs, &n);
        assert_int_equal(n, 1 + i);
        assert_string_equal(jobs[0].model.effects[0].effect->id, "coulomb_friction");
        assert_string_equal(jobs[n - 1].model.effects[0].effect->id, i == 0 ? "coulomb_friction" : "patch_softening");
        for (size_t k = 0; k < n; k++)
            model_free(&jobs[k].model);
        free(jobs);
        shortlist_free(s);
    }
    state_free(&w);
    bench_free(b);
}

/* Friction and micro-slip: a law that takes nearly as much along the motion as the best trial is refitted beside it, and what takes less is not. */
static void a_law_is_held_against_its_like(void **state)
{
    (void)state;
    static const char *const laws[] = {"microslip", "coulomb_friction", "patch_softening", NULL};
    static const double near[] = {0.87, 0.76, 0.06}, far[] = {0.87, 0.6, 0.06}, little[] = {0.4, 0.39, 0.06};
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}", 2, LONG, 0.01, laws);
    struct diagnose_state w = begun(b);
    assert_int_equal(laws_refitted(&w, near, 3), 2);
    assert_int_equal(laws_refitted(&w, far, 3), 1);
    assert_int_equal(laws_refitted(&w, little, 3), 0);
    state_free(&w);
    bench_free(b);
}

/* A compression far beyond the buckling load: the refit has no value, and the answer counts it. */
static void a_refit_without_a_value_is_counted(void **state)
{
    (void)state;
    struct bench *b = with_mass();
    struct diagnose_state w = begun(b);
    struct refit_job job = {
        .model = make("{kind: axial_load, force_N: -1e4}"), .first_new = 1, .n_effects = 1, .near = true};
    diagnose_refits(&w, &job, 1, 0.0);
    assert_int_equal(b->d.n_hypotheses, 0);
    assert_int_equal(b->d.n_failed, 1);
    state_free(&w);
    bench_free(b);
}

/* Damping does not take what a mass does: where only the noise is of use its refit is given up, where a little less than the baseline leaves is, it goes to its end. */
static void what_will_be_of_no_use_is_given_up(void **state)
{
    (void)state;
    size_t evaluations[2];
    for (int i = 0; i < 2; i++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job job = {
            .model = make("{kind: square_root_damping, coefficient_Ns: 1e-3}"), .first_new = 1, .n_effects = 1};
        job.useless = i == 0 ? 1.0 : 2.0 * b->d.baseline.fitted.noise_ratio;
        diagnose_refits(&w, &job, 1, 0.0);
        assert_int_equal(b->d.n_hypotheses, 1);
        assert_int_equal(b->d.hypotheses[0].fit.abandoned, i == 0);
        evaluations[i] = b->d.hypotheses[0].fit.evaluations;
        state_free(&w);
        bench_free(b);
    }
    assert_true(evaluations[0] < evaluations[1]);
}

/*
 * Where another effect takes most of the misfit, a linear one that takes next to nothing is given up before it leaves three times as much as the best; not where
 * none takes most, nor a law, which has a longer way down.
 */
static void what_takes_next_to_nothing_is_given_up_beside_what_takes_most(void **state)
{
    (void)state;
    static const struct {
        const char *effect;
        double best; /* of the baseline's χ²/n */
        bool abandoned;
    } cases[] = {{"{kind: square_root_damping, coefficient_Ns: 1e-3}", 0.4, true},
                 {"{kind: square_root_damping, coefficient_Ns: 1e-3}", 0.6, false},
                 {"{kind: quadratic_drag, coefficient_Ns2pm3: 0.05}", 0.4, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bench *b = with_mass();
        struct diagnose_state w = begun(b);
        struct refit_job first = {
            .model = make("{kind: point_mass, mass_kg: 1e-3, at_m: 0.3}"), .first_new = 1, .n_effects = 1};
        diagnose_refits(&w, &first, 1, 0.0);
        assert_int_equal(b->d.n_hypotheses, 1);
        b->d.hypotheses[0].fit.chi2_per_row = cases[i].best * b->d.baseline.fit.chi2_per_row;
        struct refit_job job = {.model = make(cases[i].effect), .first_new = 1, .n_effects = 1};
        diagnose_refits(&w, &job, 1, 0.0);
        assert_int_equal(b->d.n_hypotheses, 2);
        assert_int_equal(b->d.hypotheses[1].fit.abandoned, cases[i].abandoned);
        state_free(&w);
        bench_free(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_runs_out_is_kept_where_it_is_asked_for),
        cmocka_unit_test(laws_have_so_many_evaluations_together),
        cmocka_unit_test(what_ends_in_time_is_as_without_a_bound),
        cmocka_unit_test(only_laws_are_bounded),
        cmocka_unit_test(a_rival_law_is_given_up_sooner),
        cmocka_unit_test(an_answer_leaves_what_it_will),
        cmocka_unit_test(what_is_nearly_there_has_both),
        cmocka_unit_test(what_will_be_of_no_use_is_given_up),
        cmocka_unit_test(what_takes_next_to_nothing_is_given_up_beside_what_takes_most),
        cmocka_unit_test(a_law_is_held_against_its_like),
        cmocka_unit_test(the_last_laws_take_the_largest_shares),
        cmocka_unit_test(a_refit_without_a_value_is_counted),
        cmocka_unit_test(what_a_linear_model_leaves_at_the_noise_passes_for_linear),
        cmocka_unit_test(what_takes_nothing_is_outdone),
        cmocka_unit_test(an_unknown_noise_explains_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
