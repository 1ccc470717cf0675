/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Per-record values of records that were not fitted: hum of another phase, a tip mass of another weight in every record. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "compare/compare.h"
#include "estimate/estimate.h"
#include "fit_rig.h"

/* 20 times the noise, at 50 Hz in the patch voltage. */
static void add_hum(struct record *record, double sigma, double phase_rad)
{
    for (size_t c = 0; c < record->n_columns; c++)
        for (size_t k = 0; k < SAMPLES && strcmp(record->columns[c].name, "piezo_V") == 0; k++)
            record->columns[c].x[k] += 20.0 * sigma * sin(2.0 * M_PI * 50.0 * (double)k / RATE_HZ + phase_rad);
}

/* The true beam with the true hum; only the record "hit.csv" has its phase in the model. */
static void make_hum_model(double sigma, struct model *model)
{
    struct bf_error err;
    make_model(&truth, model);
    assert_int_equal(model_append_effect(model, "mains_hum", "piezo_V", &err), BF_OK);
    struct model_effect *hum = &model->effects[0];
    for (int i = 0; i < hum->effect->n_parameters; i++) {
        if (strcmp(hum->parameters[i].name, "amplitude") == 0)
            hum->parameters[i].value = 20.0 * sigma;
        if (strcmp(hum->parameters[i].name, "frequency_Hz") == 0)
            hum->parameters[i].value = 50.0;
        if (strcmp(hum->parameters[i].name, "phase_rad") != 0)
            continue;
        hum->n_per_record = 1;
        hum->per_record = calloc(1, sizeof *hum->per_record);
        hum->per_record[0] = (struct per_record_value){.record = "hit.csv", .parameter = i, .value = 0.4};
    }
}

/* The model leaves the noise of the record's first channel. */
static void leaves_the_noise(const struct model *model, const struct record *record, const double sigma[])
{
    const struct fit_options options = {.quiet = true, .sigma = sigma};
    struct fit_channel_error *errors;
    struct bf_error err;
    size_t n;
    assert_int_equal(fit_errors(model, record, 1, &options, &errors, &n, &err), BF_OK);
    assert_near(errors[0].noise_ratio, 1.0, 0.08);
    free(errors);
}

/* Phases all round, π among them: from 0 that is the maximum of the misfit. */
static void the_phase_of_a_held_out_record_comes_from_the_record(void **state)
{
    (void)state;
    static const double phase[] = {0.3, 1.9, M_PI, -2.0};
    for (size_t i = 0; i < sizeof phase / sizeof *phase; i++) {
        struct record record;
        struct model model;
        struct own_values own;
        struct bf_error err = {0};
        double sigma[2], value = 0.0;
        const struct fit_options options = {.quiet = true, .sigma = sigma};
        seed = 40 + i;
        make_record("some/where/held.csv", 0.02, 1.0, &record, sigma);
        add_hum(&record, sigma[0], phase[i]);
        make_hum_model(sigma[0], &model);
        assert_int_equal(own_values_find(&model, &record, 1, &options, &own, &err), BF_OK);
        assert_int_equal(own.n_notes, 1);
        assert_non_null(strstr(own.notes[0], "phase_rad of held.csv"));
        assert_int_equal(model.effects[0].n_per_record, 1);
        assert_int_equal(own.model->effects[0].n_per_record, 2);
        value = own.model->effects[0].per_record[1].value;
        assert_near(remainder(value - phase[i], 2.0 * M_PI), 0.0, 0.02);
        leaves_the_noise(own.model, &record, sigma);
        own_values_free(&own);
        model_free(&model);
        record_free(&record);
    }
}

/* What the second record is weighed by is its own noise: by that of the first its channel with the hum would count for nothing. */
static void each_record_is_weighed_by_its_own_noise(void **state)
{
    (void)state;
    static const double phase[] = {0.3, -2.0};
    struct record records[2];
    struct model model;
    struct own_values own;
    struct bf_error err = {0};
    double sigma[4], of_one[2];
    const struct fit_options options = {.quiet = true, .sigma = sigma};
    for (int r = 0; r < 2; r++) {
        seed = 44 + (uint64_t)r;
        make_record(r == 0 ? "first.csv" : "second.csv", 0.02, 1.0, &records[r], of_one);
        add_hum(&records[r], of_one[0], phase[r]);
        sigma[2 * r] = of_one[0], sigma[2 * r + 1] = of_one[1];
    }
    make_hum_model(of_one[0], &model);
    sigma[0] *= 1e9;
    assert_int_equal(own_values_find(&model, records, 2, &options, &own, &err), BF_OK);
    assert_true(own.n_notes > 0);
    const struct per_record_value *second =
        effect_record_value(&own.model->effects[0], model.effects[0].per_record[0].parameter, "second.csv");
    assert_non_null(second);
    assert_near(remainder(second->value - phase[1], 2.0 * M_PI), 0.0, 0.02);
    own_values_free(&own);
    model_free(&model);
    record_free(&records[0]), record_free(&records[1]);
}

static void a_value_that_the_model_has_is_kept(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct own_values own;
    struct comparison comparison;
    struct bf_error err = {0};
    double sigma[2];
    const struct fit_options options = {.quiet = true};
    seed = 50;
    make_record("some/where/hit.csv", 0.02, 1.0, &record, sigma);
    add_hum(&record, sigma[0], 0.4);
    make_hum_model(sigma[0], &model);
    assert_int_equal(own_values_find(&model, &record, 1, &options, &own, &err), BF_OK);
    assert_ptr_equal(own.model, &model);
    assert_int_equal(own.n_notes, 0);
    own_values_free(&own);
    assert_int_equal(compare_run(&model, &record, 1, 0, NULL, &comparison, &err), BF_OK);
    assert_int_equal(comparison.n_notes, 0);
    assert_near(comparison.channels[0].residual_rms / sigma[0], 1.0, 0.08);
    compare_free(&comparison);
    model_free(&model);
    record_free(&record);
}

static void compare_allows_for_it_and_says_so(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct comparison comparison;
    struct bf_error err = {0};
    double sigma[2];
    seed = 60;
    make_record("held.csv", 0.02, 1.0, &record, sigma);
    add_hum(&record, sigma[0], 2.5);
    make_hum_model(sigma[0], &model);
    assert_int_equal(compare_run(&model, &record, 1, 1, NULL, &comparison, &err), BF_OK);
    assert_int_equal(comparison.n_notes, 1);
    assert_near(comparison.channels[0].residual_rms / sigma[0], 1.0, 0.08);
    compare_free(&comparison);
    model_free(&model);
    record_free(&record);
}

/* From the mass of the heavy record, where the model's own value stands too, no descent comes down to a record of a bare beam. */
static void a_mass_of_a_held_out_record_begins_at_those_of_the_others(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct own_values own;
    struct bf_error err = {0};
    double sigma[2];
    const struct fit_options options = {.quiet = true, .sigma = sigma};
    seed = 70;
    make_record("held.csv", 0.02, 1.0, &record, sigma);
    make_model_with(&truth,
                    "\n  - {kind: tip_mass, mass_kg: {value: 0.05, per_record: {heavy.csv: {value: 0.05}, "
                    "light.csv: {value: 0.001}}}}",
                    &model);
    assert_int_equal(own_values_find(&model, &record, 1, &options, &own, &err), BF_OK);
    assert_int_equal(own.n_notes, 1);
    assert_int_equal(own.model->effects[0].n_per_record, 3);
    assert_near(own.model->effects[0].per_record[2].value, 0.0, 1e-5);
    leaves_the_noise(own.model, &record, sigma);
    own_values_free(&own);
    model_free(&model);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_phase_of_a_held_out_record_comes_from_the_record),
        cmocka_unit_test(each_record_is_weighed_by_its_own_noise),
        cmocka_unit_test(a_value_that_the_model_has_is_kept),
        cmocka_unit_test(compare_allows_for_it_and_says_so),
        cmocka_unit_test(a_mass_of_a_held_out_record_begins_at_those_of_the_others),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
