/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The estimator on recordings whose truth is known: a beam of the model itself plus noise. (Against the independent
 * simulator: test_fit_coverage.c.)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <signal.h>
#include "fit_rig.h"
#include "ground/ground.h"
#include "show/show.h"

static void assert_estimate(const struct fit_result *result, const char *label, double expected)
{
    const struct fit_parameter *p = find(result, label);
    assert_true(p->estimated && p->identifiable);
    assert_true(p->sd > 0.0 && p->ci95[0] < p->value && p->value < p->ci95[1]);
    if (fabs(p->value - expected) > 4.5 * p->sd)
        fail_msg("%s is %g ± %g, not %g", label, p->value, p->sd, expected);
}

static void run(const struct model *model, const struct record records[], size_t n, const double sigma[],
                struct fit_result *out)
{
    struct bf_error err = {0};
    const struct fit_options options = {.quiet = true, .sigma = sigma};
    if (fit_run(model, records, n, &options, out, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static bool warned(const struct fit_result *result, const char *words)
{
    for (size_t i = 0; i < result->n_warnings; i++)
        if (strstr(result->warnings[i], words))
            return true;
    return false;
}

/* ---- What a user sees ---- */

static void handbook_values_lead_to_the_truth(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 11;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    make_model(&handbook, &model);
    run(&model, &record, 1, sigma, &result);
    assert_true(result.converged);
    assert_false(result.searched);
    assert_near(result.noise_ratio, 1.0, 0.05);
    assert_near(result.nrmse, 0.005, 3e-4);
    assert_estimate(&result, "EI_beam_Nm2", truth.EI);
    assert_estimate(&result, "EI_patch_Nm2", truth.EI_patch);
    assert_estimate(&result, "rho_patch_kgpm", truth.rho_patch);
    assert_estimate(&result, "cDI_beam_sNm2", truth.cDI);
    assert_estimate(&result, "Ks_V", truth.Ks);
    assert_true(find(&result, "rho_beam_kgpm")->value == 0.1);
    assert_false(find(&result, "rho_beam_kgpm")->estimated);
    assert_true(isnan(find(&result, "rho_beam_kgpm")->sd));
    assert_int_equal(result.identifiability.n_null, 0);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

/* Only the patch voltage, nothing weighed: EI, rho, cDI and Ks share a factor (gamma and one cDI are made free too). */
static void the_free_scale_is_found_and_left_alone(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    struct beam start = handbook;
    start.of_rho = "";
    seed = 12;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    drop_column(&record, "tip_mps");
    make_model(&start, &model);
    model.gamma.fixed = false;
    for (size_t i = 0; i < model.n_materials; i++)
        model.materials[i].cDI.fixed = false;
    run(&model, &record, 1, sigma, &result);
    assert_true(result.converged);
    assert_near(result.noise_ratio, 1.0, 0.06);
    assert_int_equal(result.identifiability.n_null, 1);
    assert_true(result.identifiability.null[0].ratio < 1e-9);
    assert_false(find(&result, "EI_beam_Nm2")->identifiable);
    assert_true(isnan(find(&result, "Ks_V")->sd));
    const double ratio = find(&result, "EI_beam_Nm2")->value / find(&result, "rho_beam_kgpm")->value;
    assert_near(ratio / (truth.EI / truth.rho), 1.0, 2e-3);
    for (size_t i = 0; i < result.identifiability.n; i++) { /* equal weights of one sign, but for the residual term */
        const double w = result.identifiability.null[0].weight[i];
        assert_true(fabs(w - 1.0 / sqrt(8.0)) < 1e-4 || fabs(w) < 1e-4);
    }
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

static void a_bound_is_respected_and_said(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    struct beam start = handbook;
    start.EI = 0.45, start.of_EI = ", max: 0.48";
    seed = 13;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    make_model(&start, &model);
    run(&model, &record, 1, sigma, &result);
    const struct fit_parameter *p = find(&result, "EI_beam_Nm2");
    assert_true(p->at_bound && p->value <= 0.48 * (1.0 + 1e-12));
    assert_true(warned(&result, "EI_beam_Nm2 ended at a bound"));
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

static void a_wrong_unit_is_suspected(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 14;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    drop_column(&record, "tip_mps");
    for (size_t k = 0; k < SAMPLES; k++)
        record.columns[1].x[k] *= 1000.0; /* millivolts */
    sigma[0] *= 1000.0;
    make_model(&handbook, &model);
    run(&model, &record, 1, sigma, &result);
    assert_near(result.noise_ratio, 1.0, 0.06);
    assert_true(warned(&result, "in mV"));
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

/* Two hits, the second with an unknown factor 2.5 on its force. */
static void an_unknown_level_is_solved_for(void **state)
{
    (void)state;
    struct record records[2];
    struct model model;
    struct fit_result result;
    double sigma[4];
    seed = 15;
    make_record("known.csv", 0.02, 1.0, &records[0], sigma);
    make_record("unknown.csv", 0.1, 2.5, &records[1], sigma + 2);
    for (size_t k = 0; k < SAMPLES; k++)
        records[1].columns[0].x[k] /= 2.5;
    record_add_meta(&records[1], "excitation", "unknown_level");
    make_model(&handbook, &model);
    run(&model, records, 2, sigma, &result);
    assert_true(result.converged);
    assert_near(result.noise_ratio, 1.0, 0.05);
    assert_true(result.level[0] == 1.0);
    assert_near(result.level[1], 2.5, 2.5 * 5e-3);
    assert_estimate(&result, "Ks_V", truth.Ks);
    fit_free(&result);
    model_free(&model);
    record_free(&records[0]);
    record_free(&records[1]);
}

/* The force was not recorded: the decay from 60 ms on still tells the stiffness. */
static void a_free_decay_is_fitted(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    struct beam start = handbook;
    start.EI_patch = truth.EI_patch, start.rho_patch = truth.rho_patch;
    start.Ks = truth.Ks, start.of_Ks = ", fixed: true";
    seed = 16;
    make_record("tap.csv", 0.02, 1.0, &record, sigma);
    drop_column(&record, "hammer_N");
    record_add_meta(&record, "excitation", "free_decay");
    record_add_meta(&record, "free_from_s", "0.06");
    make_model(&start, &model);
    for (size_t i = 0; i < model.n_materials; i++)
        if (strcmp(model.materials[i].name, "patch") == 0)
            model.materials[i].EI.fixed = model.materials[i].rho.fixed = true;
    run(&model, &record, 1, sigma, &result);
    assert_near(result.noise_ratio, 1.0, 0.06);
    assert_estimate(&result, "EI_beam_Nm2", truth.EI);
    assert_estimate(&result, "cDI_beam_sNm2", truth.cDI);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

static void a_model_that_lacks_something_is_told_so(void **state)
{
    (void)state;
    struct bf_error err;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 17;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    for (size_t k = 0; k < SAMPLES; k++)
        record.columns[2].x[k] += 20.0 * sigma[1] * sin(0.4 * (double)k);
    make_model(&handbook, &model);
    const struct fit_options options = {.quiet = true, .sigma = sigma, .never_search = true};
    assert_int_equal(fit_run(&model, &record, 1, &options, &result, &err), BF_OK);
    assert_true(result.noise_ratio > 5.0 && result.converged);
    assert_false(result.searched);
    assert_true(warned(&result, "the model lacks something"));
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

/* Hum of 20 times the noise at 49.3 Hz in the patch voltage; the model starts at the catalogue's 50 Hz and phase 0. */
static void hum_is_found_at_its_frequency_and_phase(void **state)
{
    (void)state;
    struct bf_error err;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 32;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    const double amplitude = 20.0 * sigma[0];
    for (size_t k = 0; k < SAMPLES; k++)
        record.columns[1].x[k] += amplitude * sin(2.0 * M_PI * 49.3 * (double)k / RATE_HZ + 2.5);
    make_model(&handbook, &model);
    assert_int_equal(model_append_effect(&model, "mains_hum", "piezo_V", &err), BF_OK);
    run(&model, &record, 1, sigma, &result);
    assert_true(result.converged);
    assert_false(result.searched);
    assert_near(result.noise_ratio, 1.0, 0.05);
    assert_estimate(&result, "amplitude", amplitude);
    assert_estimate(&result, "frequency_Hz", 49.3);
    assert_estimate(&result, "phase_rad@hit.csv", 2.5);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

/* A patch ten times too soft and five times too heavy: the staircase ends in another minimum. */
static void a_trapped_fit_is_searched_out(void **state)
{
    (void)state;
    struct bf_error err;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    struct beam start = handbook;
    start.EI_patch = 0.1 * truth.EI_patch, start.rho_patch = 8.0 * truth.rho_patch;
    seed = 31;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    make_model(&start, &model);
    const struct fit_options staircase = {.quiet = true, .sigma = sigma, .never_search = true};
    assert_int_equal(fit_run(&model, &record, 1, &staircase, &result, &err), BF_OK);
    assert_true(result.noise_ratio > 10.0); /* the trap is a real one */
    fit_free(&result);
    run(&model, &record, 1, sigma, &result);
    assert_true(result.searched && result.converged);
    assert_near(result.noise_ratio, 1.0, 0.05);
    assert_estimate(&result, "EI_patch_Nm2", truth.EI_patch);
    assert_true(result.n_minima >= 1);
    assert_true(result.minima[0].noise_ratio > result.noise_ratio);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

static void the_model_takes_values_errors_and_records(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 18;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    strcpy(record.sha256, "abc");
    make_model(&handbook, &model);
    run(&model, &record, 1, sigma, &result);
    const struct fit_check check = {.n = 0};
    fit_into_model(&result, &record, &check, &model);
    assert_true(model.fit.present && model.fit.converged);
    assert_int_equal(model.fit.n_records, 1);
    assert_string_equal(model.fit.records[0].sha256, "abc");
    assert_int_equal(model.fit.records[0].n_channels, 2);
    assert_true(model.Ks.value == find(&result, "Ks_V")->value);
    assert_true(model.Ks.sd == find(&result, "Ks_V")->sd);
    struct json *answer = fit_json(&result, &record, &check);
    json_discard(answer);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

static void errors_on_other_records_are_those_of_the_model(void **state)
{
    (void)state;
    struct bf_error err;
    struct record record;
    struct model model;
    struct fit_channel_error *channels;
    size_t n;
    double sigma[2], nrmse, noise_ratio;
    seed = 19;
    make_record("other.csv", 0.1, 3.0, &record, sigma);
    make_model(&truth, &model);
    const struct fit_options options = {.quiet = true, .sigma = sigma};
    assert_int_equal(fit_errors(&model, &record, 1, &options, &channels, &n, &err), BF_OK);
    assert_int_equal(n, 2);
    fit_totals(channels, n, &nrmse, &noise_ratio);
    assert_near(noise_ratio, 1.0, 0.08);
    assert_near(nrmse, 0.005, 5e-4);
    free(channels);
    model_free(&model);
    record_free(&record);
}

/* With one linear unknown and a prior the estimate has a closed form: (Σz/σ² + θ0/p²)/(n/σ² + 1/p²). */
static void a_prior_pulls_as_the_closed_form_says(void **state)
{
    (void)state;
    struct bf_error err;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    struct beam held = truth;
    held.of_EI = held.of_rho = held.of_Ks = ", fixed: true";
    seed = 22;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    drop_column(&record, "piezo_V");
    make_model(&held, &model);
    for (size_t i = 0; i < model.n_materials; i++)
        model.materials[i].EI.fixed = model.materials[i].rho.fixed = model.materials[i].cDI.fixed = true;
    double clean_sum = 0.0, sum = 0.0;
    struct predictor *predictor;
    struct prediction y;
    struct parameter_ref *refs;
    const char *names[1] = {"hit.csv"};
    assert_int_equal(predictor_new(&model, &record, 1, NULL, &predictor, &err), BF_OK);
    const size_t n = model_parameters(&model, names, 1, &refs);
    double theta[32];
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    for (size_t k = 0; k < SAMPLES; k++)
        clean_sum += y.y[k], sum += record.columns[2].x[k];
    free(refs);
    predictor_free(predictor);
    assert_int_equal(model_append_effect(&model, "sensor_offset", "tip_mps", &err), BF_OK);
    struct parameter *offset = &model.effects[0].parameters[0], *drift = &model.effects[0].parameters[1];
    drift->value = 0.0, drift->fixed = true;
    offset->value = offset->prior_value = 0.2 * sigma[1], offset->prior = 0.25; /* as strong as 400 samples */
    run(&model, &record, 1, sigma + 1, &result);
    const double p = offset->prior * offset->prior_value, w = 1.0 / (sigma[1] * sigma[1]);
    const double expected = (w * (sum - clean_sum) + offset->prior_value / (p * p)) / (w * SAMPLES + 1.0 / (p * p));
    const struct fit_parameter *estimate = find(&result, offset->name);
    assert_near(estimate->value / expected, 1.0, 1e-5);
    assert_near(estimate->sd / sqrt(1.0 / (w * SAMPLES + 1.0 / (p * p))), 1.0, 0.15);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

/* Last, because an interruption cannot be taken back. */
static void an_interrupted_fit_keeps_what_it_has(void **state)
{
    (void)state;
    struct record record;
    struct model model;
    struct fit_result result;
    double sigma[2];
    seed = 23;
    make_record("hit.csv", 0.02, 1.0, &record, sigma);
    make_model(&handbook, &model);
    progress_catch_interrupts();
    assert_int_equal(raise(SIGINT), 0);
    run(&model, &record, 1, sigma, &result);
    assert_true(result.interrupted);
    assert_false(result.converged);
    assert_true(warned(&result, "interrupted"));
    assert_true(isfinite(result.nrmse));
    assert_true(find(&result, "EI_beam_Nm2")->value > 0.0);
    fit_free(&result);
    model_free(&model);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(handbook_values_lead_to_the_truth),
        cmocka_unit_test(the_free_scale_is_found_and_left_alone),
        cmocka_unit_test(a_bound_is_respected_and_said),
        cmocka_unit_test(a_wrong_unit_is_suspected),
        cmocka_unit_test(an_unknown_level_is_solved_for),
        cmocka_unit_test(a_free_decay_is_fitted),
        cmocka_unit_test(a_model_that_lacks_something_is_told_so),
        cmocka_unit_test(hum_is_found_at_its_frequency_and_phase),
        cmocka_unit_test(a_trapped_fit_is_searched_out),
        cmocka_unit_test(the_model_takes_values_errors_and_records),
        cmocka_unit_test(errors_on_other_records_are_those_of_the_model),
        cmocka_unit_test(a_prior_pulls_as_the_closed_form_says),
        cmocka_unit_test(an_interrupted_fit_keeps_what_it_has),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
