/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An explanation that stopped in a minor minimum of its place. */
#include "diagnose_rig.h"

static const double damper_at_m = 0.15;

static double place(const struct hypothesis *h)
{
    return h->model.effects[0].parameters[1].value;
}

/* The diagnosis so far: the baseline, and a damper refitted from 0.36 m alone. */
static struct diagnose_state trapped(struct bench *b)
{
    struct diagnose_state w = begun(b);
    struct refit_job job = {.model = make("{kind: point_damper, damping_Nspm: 0.001, at_m: 0.36}"),
                            .first_new = 1,
                            .n_effects = 1,
                            .to_the_end = true};
    job.model.effects[0].parameters[1].fixed = false;
    diagnose_refits(&w, &job, 1, 0.0);
    diagnose_rank(&b->d, 1);
    assert_int_equal(b->d.n_hypotheses, 1);
    return w;
}

static struct bench *with_damper(void)
{
    static const char *const dampers[] = {"point_damper", NULL};
    return bench_new("{kind: point_damper, damping_Nspm: 0.05, at_m: 0.15}", 2, LONG, 0.01, dampers);
}

static void another_place_is_found(void **state)
{
    (void)state;
    struct bf_error err;
    struct bench *b = with_damper();
    struct diagnose_state w = trapped(b);
    assert_true(fabs(place(&b->d.hypotheses[0]) - damper_at_m) > 0.05);
    assert_true(b->d.hypotheses[0].fitted.noise_ratio > 1.02);
    b->d.hypotheses[0].fit.converged = false;
    assert_int_equal(diagnose_other_places(&w, 0.0, &err), BF_OK);
    assert_int_equal(b->d.n_hypotheses, 1); /* repeats of the same effects are gone */
    assert_true(fabs(place(&b->d.hypotheses[0]) - damper_at_m) < 0.02);
    assert_true(b->d.hypotheses[0].fitted.noise_ratio < 1.02);
    state_free(&w);
    bench_free(b);
}

/* Converged, and more than the noise is left: elsewhere it may leave less. Once. */
static void what_leaves_something_is_tried_elsewhere(void **state)
{
    (void)state;
    struct bf_error err;
    struct bench *b = with_damper();
    struct diagnose_state w = trapped(b);
    struct hypothesis *h = &b->d.hypotheses[0];
    h->fit.converged = true;
    assert_false(h->explains);
    assert_int_equal(diagnose_other_places(&w, 0.0, &err), BF_OK);
    assert_true(fabs(place(&b->d.hypotheses[0]) - damper_at_m) < 0.02);
    const size_t evaluations = b->d.evaluations;
    assert_int_equal(diagnose_other_places(&w, 0.0, &err), BF_OK); /* not twice */
    assert_int_equal(b->d.evaluations, evaluations);
    state_free(&w);
    bench_free(b);
}

/* The same effect refitted twice, to places that the records cannot tell apart. */
static void another_place_that_does_as_well_is_told(void **state)
{
    (void)state;
    struct bench *b = with_damper();
    struct diagnose_state w = trapped(b);
    struct refit_job job = {.first_new = 1, .n_effects = 1, .to_the_end = true};
    struct bf_error err;
    assert_int_equal(model_copy(&b->d.hypotheses[0].model, &job.model, &err), BF_OK);
    diagnose_refits(&w, &job, 1, 0.0);
    diagnose_rank(&b->d, 2);
    assert_int_equal(b->d.n_hypotheses, 2);
    b->d.hypotheses[1].model.effects[0].parameters[1].value = 0.1;
    diagnose_drop_repeats(&b->d);
    assert_int_equal(b->d.n_hypotheses, 1);
    assert_true(b->d.hypotheses[0].has_other_place);
    assert_float_equal(b->d.hypotheses[0].other_at_m, 0.1, 0.0);
    state_free(&w);
    bench_free(b);
}

/* A crack that opens and closes, refitted from a place where it comes near the records: it is found where it is. */
static void a_law_that_comes_near_is_looked_for_elsewhere(void **state)
{
    (void)state;
    static const char *const cracks[] = {"bilinear_stiffness", NULL};
    struct bf_error err;
    struct bench *b =
        bench_new("{kind: bilinear_stiffness, change_Nmprad: 10, at_m: 0.3, width_m: 0.005}", 2, LONG, 0.004, cracks);
    struct diagnose_state w = begun(b);
    struct refit_job job = {.model = make("{kind: bilinear_stiffness, change_Nmprad: 1, at_m: 0.12, width_m: 0.005}"),
                            .first_new = 1,
                            .n_effects = 1};
    job.model.effects[0].parameters[0].fixed = false, job.model.effects[0].parameters[1].fixed = false;
    diagnose_refits(&w, &job, 1, 0.0);
    diagnose_rank(&b->d, 1);
    assert_int_equal(b->d.n_hypotheses, 1);
    assert_true(fabs(place(&b->d.hypotheses[0]) - 0.3) > 0.1 && b->d.hypotheses[0].fitted.noise_ratio > 1.1);
    assert_int_equal(diagnose_law_places(&w, 0.0, &err), BF_OK);
    assert_int_equal(b->d.n_hypotheses, 1);
    assert_true(fabs(place(&b->d.hypotheses[0]) - 0.3) < 2e-3 && b->d.hypotheses[0].fitted.noise_ratio < 1.02);
    const size_t evaluations = b->d.evaluations;
    assert_int_equal(diagnose_law_places(&w, 0.0, &err), BF_OK); /* it explains the records: not twice */
    assert_int_equal(b->d.evaluations, evaluations);
    state_free(&w);
    bench_free(b);
}

static void what_is_at_the_noise_stays(void **state)
{
    (void)state;
    struct bf_error err;
    struct bench *b = with_damper();
    struct diagnose_state w = trapped(b);
    const size_t evaluations = b->d.evaluations;
    b->d.hypotheses[0].fit.converged = b->d.hypotheses[0].explains = true;
    assert_int_equal(diagnose_other_places(&w, 0.0, &err), BF_OK);
    assert_int_equal(b->d.evaluations, evaluations);
    state_free(&w);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(another_place_is_found),
        cmocka_unit_test(what_leaves_something_is_tried_elsewhere),
        cmocka_unit_test(another_place_that_does_as_well_is_told),
        cmocka_unit_test(a_law_that_comes_near_is_looked_for_elsewhere),
        cmocka_unit_test(what_is_at_the_noise_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
