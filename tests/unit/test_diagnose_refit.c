/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Refits that are bounded: what becomes of one whose evaluations have run out, and which are not begun. */
#include "diagnose_rig.h"

/* What is known before any effect is refitted. */
static struct diagnose_state begun(struct bench *b)
{
    struct bf_error err;
    b->d = (struct diagnosis){.model = &b->given, .records = b->records, .n_records = b->n};
    struct diagnose_state w = {.d = &b->d, .options = &b->options, .threads = 2};
    assert_int_equal(diagnose_noise(&w, &err), BF_OK);
    assert_int_equal(diagnose_baseline(&w, &err), BF_OK);
    return w;
}

static void state_free(struct diagnose_state *w)
{
    for (size_t c = 0; c < w->n_check_channels; c++)
        noise_free(&w->check_noise[c]);
    free(w->sigma), free(w->check_sigma), free(w->whiteners), free(w->check_noise);
}

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
        assert_true(isfinite(job.left) && job.left > 1.05);
        assert_int_equal(b->d.n_hypotheses, kept);
        if (kept) {
            assert_false(b->d.hypotheses[0].fit.converged);
            assert_true(b->d.hypotheses[0].fit.evaluations >= FEW);
            assert_true(b->d.hypotheses[0].fitted.noise_ratio <= 1.5 * job.left);
        }
        state_free(&w);
        bench_free(b);
    }
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

/* Another law than the one that the beam has, beside a spring: its refit would take many times the evaluations, and end far off. */
static void a_law_that_is_not_there_does_not_take_for_ever(void **state)
{
    (void)state;
    static const char *const ids[] = {"stop_contact", "bilinear_stiffness", "coulomb_friction", "microslip", NULL};
    struct bench *b = bench_new("{kind: point_spring, stiffness_Npm: 80, damping_Nspm: 0.003, at_m: 0.35}, "
                                "{kind: cubic_stiffness, coefficient_Npm3: 5.5e6, at_m: 0.2}",
                                3, LONG, 0.004, ids);
    diagnose(b, 3, 0);
    size_t laws = 0;
    for (size_t i = 0; i < b->d.n_hypotheses; i++) {
        const struct hypothesis *h = &b->d.hypotheses[i];
        if (!hypothesis_has_law(h))
            continue;
        laws++;
        assert_true(h->fit.evaluations < 200);
        assert_false(h->fit.converged);
    }
    assert_true(laws > 0);
    bench_free(b);
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
    d.attainable.held_out_noise_ratio = nan("");
    assert_false(diagnose_passes_for_linear(&d));
    d.attainable.held_out_noise_ratio = 1.02;
    d.attainable.noise_ratio = 1.2;
    assert_false(diagnose_passes_for_linear(&d));
    d.attainable.noise_ratio = 1.01;
    d.linearity.verdict = LINEARITY_NONLINEAR;
    assert_false(diagnose_passes_for_linear(&d));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_runs_out_is_kept_where_it_is_asked_for),
        cmocka_unit_test(what_ends_in_time_is_as_without_a_bound),
        cmocka_unit_test(a_law_that_is_not_there_does_not_take_for_ever),
        cmocka_unit_test(what_a_linear_model_leaves_at_the_noise_passes_for_linear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
