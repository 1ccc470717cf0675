/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A fit is no worse than its start, than a fit without a search, than one that begins at another damping: never worse than what was tried. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fit_rig.h"

/* y' = (x − y)/tau: what no parameter of the model can do. */
static void lag(struct record *record, size_t column, double tau_s)
{
    double *x = record->columns[column].x, y = 0.0;
    for (size_t k = 0; k < record->n; k++)
        x[k] = y += (x[k] - y) / RATE_HZ / tau_s;
}

/* A beam far from the handbook, sensors that lag, and an effect that is not there, begun at a hundredth of the usual size. */
static void make_misfit(uint64_t from, const char *id, bool both, struct record *record, struct model *model,
                        double sigma[2])
{
    struct bf_error err;
    struct beam start = handbook;
    seed = from;
    make_record("hit.csv", 0.02, 1.0, record, sigma);
    lag(record, 2, both ? 0.003 : 0.004);
    if (both)
        lag(record, 1, 0.01);
    start.EI = truth.EI * (1.0 + 0.15 * gauss()), start.EI_patch *= 1.0 + 0.3 * gauss();
    start.rho_patch *= exp(0.5 * gauss()), start.cDI *= exp(gauss()), start.Ks *= exp(gauss());
    make_model(&start, model);
    assert_int_equal(model_append_effect(model, id, "", &err), BF_OK);
    for (int i = 0; i < model->effects[0].effect->n_parameters; i++)
        model->effects[0].parameters[i].fixed = false;
    model->effects[0].parameters[0].value *= 0.01;
}

/* The noise ratio that a fit leaves; the model takes its values. */
static double left_by(struct model *model, const struct record *record, const struct fit_options *options)
{
    static const struct fit_check nothing_held_out;
    struct bf_error err;
    struct fit_result result;
    if (fit_run(model, record, 1, options, &result, &err) != BF_OK)
        fail_msg("%s", err.text);
    const double ratio = result.noise_ratio;
    fit_into_model(&result, record, &nothing_held_out, model);
    fit_free(&result);
    return ratio;
}

/* The unit of an effect's strength changes on the way down the windows; the minima that the search keeps must not change with it. */
static void a_search_is_no_worse_than_none(void **state)
{
    (void)state;
    struct {
        uint64_t seed;
        const char *id;
        bool both;
    } cases[] = {{104, "point_mass", false}, {108, "point_spring", true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct record record;
        struct model model[3];
        double sigma[2], ratio[3];
        for (int how = 0; how < 3; how++) {
            make_misfit(cases[i].seed, cases[i].id, cases[i].both, &record, &model[how], sigma);
            const struct fit_options options = {
                .quiet = true, .sigma = sigma, .never_search = how == 1, .start = how == 2 ? FIT_NEAR : FIT_GIVEN};
            ratio[how] = left_by(&model[how], &record, &options);
            record_free(&record);
            model_free(&model[how]);
        }
        assert_true(ratio[0] < 1.01 * fmin(ratio[1], ratio[2]));
    }
}

/* Of a damping so small that it changes nothing the logarithm has no gradient, and another damping takes what it should. */
static void a_damping_that_changes_nothing_is_raised(void **state)
{
    (void)state;
    static const double gamma[] = {0.02, 1e-6}; /* the true one; none, for all that the record tells */
    double ratio[2], found[2];
    for (int how = 0; how < 2; how++) {
        struct bf_error err;
        struct record record;
        struct model model;
        struct fit_result result;
        double sigma[2];
        seed = 25;
        make_record("hit.csv", 0.02, 1.0, &record, sigma);
        for (size_t k = 0; k < SAMPLES; k++) /* something that the model lacks */
            record.columns[2].x[k] += 3.0 * sigma[1] * sin(0.4 * (double)k);
        struct beam start = truth;
        start.of_rho = ", fixed: true";
        make_model(&start, &model);
        model.gamma.fixed = false;
        model.gamma.value = gamma[how];
        const struct fit_options options = {.quiet = true, .sigma = sigma, .start = FIT_NEAR};
        assert_int_equal(fit_run(&model, &record, 1, &options, &result, &err), BF_OK);
        ratio[how] = result.noise_ratio;
        found[how] = find(&result, "gamma_sNpm2")->value;
        fit_free(&result);
        model_free(&model);
        record_free(&record);
    }
    assert_true(ratio[0] > 1.2);
    assert_true(ratio[1] < ratio[0] * (1.0 + 1e-4));
    assert_near(found[1] / found[0], 1.0, 0.01);
}

/* Short windows lead away from values that describe the whole records better than where they lead to. */
static void a_fit_is_no_worse_than_its_start(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    double sigma[2];
    make_misfit(102, "point_spring", true, &record, &model, sigma);
    struct fit_options options = {.quiet = true, .sigma = sigma, .never_search = true, .start = FIT_NEAR};
    double before = left_by(&model, &record, &options);
    options.start = FIT_GIVEN;
    for (int round = 0; round < 3; round++) {
        const double after = left_by(&model, &record, &options);
        assert_true(after < before * (1.0 + 1e-3));
        before = after;
    }
    model_free(&model);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_search_is_no_worse_than_none),
        cmocka_unit_test(a_damping_that_changes_nothing_is_raised),
        cmocka_unit_test(a_fit_is_no_worse_than_its_start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
