/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A computation that is too coarse, a baseline in a local minimum: found out, and no physics is blamed for it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "beam_effect.h"
#include "explain/diagnose_state.h"
#include "fit_rig.h"
#include "add_effect.h"

enum { MOST_EFFECTS = 64 };

/* Nothing is searched for: the whole catalogue is left out. */
static void diagnose(const struct model *model, const struct record *record, struct predict_options predict,
                     struct diagnosis *out)
{
    const char *ids[MOST_EFFECTS];
    struct bf_error err;
    struct diagnose_options options = {.without = ids, .threads = 1, .quiet = true, .predict = predict};
    options.predict.quiet = true;
    assert_true(beam_effects_count <= MOST_EFFECTS);
    for (int i = 0; i < beam_effects_count; i++)
        ids[options.n_without++] = beam_effects[i]->id;
    if (diagnose_run(model, record, 1, NULL, 0, &options, out, &err))
        fail_msg("%s", err.text);
}

static void the_usual_computation_is_fine(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct diagnosis d;
    double sigma[2];
    seed = 71;
    make_record("hit.csv", 0.1, 2.0, &record, sigma);
    make_model(&truth, &model);
    diagnose(&model, &record, (struct predict_options){0}, &d);
    assert_true(d.numerics.fine && d.converged);
    assert_true(d.numerics.change >= 0.0 && d.numerics.change < 0.05);
    assert_int_equal(d.verdict, VERDICT_COMPLETE);
    diagnose_free(&d);
    model_free(&model);
    record_free(&record);
}

static void a_coarse_space_is_said_before_anything_else(void **state)
{
    (void)state;
    static const char first[] = "The computation itself is off by ";
    struct record record;
    struct model model;
    struct diagnosis d;
    double sigma[2];
    seed = 72;
    make_record("hit.csv", 0.1, 2.0, &record, sigma);
    make_model(&truth, &model);
    diagnose(&model, &record, (struct predict_options){.fine_splines = 6}, &d);
    assert_false(d.numerics.fine);
    assert_false(d.numerics.steps);
    assert_true(d.numerics.change > 1.0);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    assert_int_equal(d.n_named, 0);
    assert_int_equal(d.n_hypotheses, 0);
    assert_int_equal(strncmp(d.text, first, strlen(first)), 0);
    assert_non_null(strstr(d.text, "raise --splines before"));
    diagnose_free(&d);
    model_free(&model);
    record_free(&record);
}

/* States of a free decay are solved again in the finer space: their modes are not those of the coarse one. */
static void a_free_decay_is_compared_at_its_own_states(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct diagnosis d;
    double sigma[2];
    seed = 73;
    make_record("pluck.csv", 0.1, 2.0, &record, sigma);
    record_add_meta(&record, "excitation", "free_decay");
    record_add_meta(&record, "free_from_s", "0.2");
    make_model(&truth, &model);
    model.Ks.fixed = true;
    diagnose(&model, &record, (struct predict_options){0}, &d);
    assert_true(d.numerics.fine);
    assert_true(d.numerics.change < 0.05);
    diagnose_free(&d);
    model_free(&model);
    record_free(&record);
}

static void the_step_of_a_law_is_looked_at_too(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct diagnosis coarse, usual;
    struct bf_error err;
    double sigma[2];
    seed = 74;
    make_record("hit.csv", 0.1, 2.0, &record, sigma);
    make_model(&truth, &model);
    for (size_t m = 0; m < model.n_materials; m++)
        model.materials[m].EI.fixed = model.materials[m].rho.fixed = true;
    assert_int_equal(add_effect(&model, "stop_contact", "", &err), BF_OK);
    struct parameter *p = model.effects[0].parameters; /* stiffness_Npm, gap_m */
    assert_string_equal(p[1].name, "gap_m");
    p[0].value = 500.0, p[1].value = 1e-3;
    p[0].fixed = p[1].fixed = true;
    diagnose(&model, &record, (struct predict_options){.oversample = 1}, &coarse);
    diagnose(&model, &record, (struct predict_options){0}, &usual);
    assert_true(coarse.numerics.steps && usual.numerics.steps);
    print_message("change over noise: %g and %g\n", coarse.numerics.change, usual.numerics.change);
    assert_true(coarse.numerics.change > 10.0 * usual.numerics.change);
    assert_false(coarse.numerics.fine);
    diagnose_free(&coarse), diagnose_free(&usual);
    model_free(&model);
    record_free(&record);
}

/*
 * The true values are known to an explanation; the baseline's own fit is said to have stopped at this χ²/n. second ≥ 0: it is the second best, which takes so much of the
 * misfit alone, and the best knows nothing of the beam's stiffness.
 */
static bool restarts_lower(double stopped_at, double second, double *after)
{
    struct record record;
    struct bf_error err;
    struct model model;
    double sigma[2];
    bool lower;
    seed = 75;
    make_record("hit.csv", 0.1, 2.0, &record, sigma);
    make_model(&truth, &model);
    const struct diagnose_options options = {.predict.quiet = true};
    struct diagnosis d = {.model = &model, .records = &record, .n_records = 1};
    struct diagnose_state w = {.d = &d, .options = &options, .threads = 1};
    assert_int_equal(diagnose_noise(&w, &err), BF_OK);
    assert_int_equal(diagnose_baseline(&w, &err), BF_OK);
    assert_true(d.baseline.fit.chi2_per_row < 1.2);
    const size_t n = d.baseline.fit.n_parameters;
    double *value = bf_alloc(n + 1, sizeof *value); /* and the mass, 0 */
    memcpy(value, d.baseline.fit.value, n * sizeof *value);
    double *far_off = bf_alloc(n + 1, sizeof *far_off);
    memcpy(far_off, value, n * sizeof *far_off);
    far_off[0] *= 4.0;
    struct hypothesis h[] = {{.n_effects = 1, .explained = 1.0, .fit = {.value = value, .n_parameters = n + 1}},
                             {.n_effects = 1, .explained = second, .fit = {.value = value, .n_parameters = n + 1}}};
    h[0].effects[0] = effect_by_id("tip_mass"), h[1].effects[0] = effect_by_id("axial_load");
    if (second >= 0.0)
        h[0].fit.value = far_off;
    d.hypotheses = h, d.n_hypotheses = second >= 0.0 ? 2 : 1;
    d.converged = !(stopped_at > 0.0) || second >= 0.0;
    if (stopped_at > 0.0)
        d.baseline.fit.chi2_per_row = stopped_at;
    assert_int_equal(diagnose_restart(&w, &lower, &err), BF_OK);
    *after = d.baseline.fit.chi2_per_row;
    assert_true(d.converged);
    free(value), free(far_off), free(w.sigma), free(w.whiteners);
    d.hypotheses = NULL, d.n_hypotheses = 0;
    diagnose_free(&d);
    model_free(&model);
    record_free(&record);
    return lower;
}

static void a_trapped_baseline_is_replaced(void **state)
{
    (void)state;
    double own, after;
    assert_false(restarts_lower(0.0, -1.0, &own));
    assert_true(restarts_lower(50.0, -1.0, &after));
    assert_true(after < 1.2);
    assert_false(restarts_lower(own, -1.0, &after)); /* it was the lowest after all */
}

/* Two effects that have nothing to do with each other take nearly all: the second has found the baseline's values. One that takes less is not asked. */
static void a_trapped_baseline_is_replaced_by_the_second_best(void **state)
{
    (void)state;
    double after;
    assert_true(restarts_lower(50.0, 0.95, &after));
    assert_true(after < 1.2);
    assert_false(restarts_lower(50.0, 0.5, &after));
    assert_true(after > 40.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_usual_computation_is_fine),
        cmocka_unit_test(a_coarse_space_is_said_before_anything_else),
        cmocka_unit_test(a_free_decay_is_compared_at_its_own_states),
        cmocka_unit_test(the_step_of_a_law_is_looked_at_too),
        cmocka_unit_test(a_trapped_baseline_is_replaced),
        cmocka_unit_test(a_trapped_baseline_is_replaced_by_the_second_best),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
