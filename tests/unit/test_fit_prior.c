/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Priors of a model that lacks something: what is wrong in its form must not override what is known of the beam. */
#include "diagnose_rig.h"

#include <stdio.h>

static const double prior = 0.03;

/* The beam of the rig with a heavy mass that the model has not; rho with a prior, or without. */
static double fitted_rho(struct bench *b, bool with_prior, struct fit_result *fit)
{
    static const struct fit_options options = {.quiet = true, .never_search = true, .predict = {.quiet = true}};
    struct bf_error err;
    struct parameter *rho = &b->given.materials[0].rho;
    rho->fixed = false;
    rho->prior = with_prior ? prior : 0.0;
    rho->prior_value = rho->value;
    if (fit_run(&b->given, b->records, b->n, &options, fit, &err))
        fail_msg("%s", err.text);
    for (size_t i = 0; i < fit->n_parameters; i++)
        if (strcmp(fit->parameters[i].label, "rho_beam_kgpm") == 0)
            return fit->parameters[i].value;
    fail_msg("no rho_beam_kgpm");
    return 0.0;
}

static void an_error_of_form_does_not_override_a_prior(void **state)
{
    static const char *const none[] = {NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.02, at_m: 0.35}", 2, LONG, 0.003, none);
    struct fit_result without, with;
    (void)state;
    const double free_rho = fitted_rho(b, false, &without), rho = fitted_rho(b, true, &with);
    const double start = b->given.materials[0].rho.value;
    print_message("rho %g without, %g with its prior; %g and %g times the noise\n", free_rho, rho, without.noise_ratio,
                  with.noise_ratio);
    assert_true(without.noise_ratio > 10.0 && with.noise_ratio > 10.0);
    assert_true(fabs(log(free_rho / start)) > 6.0 * prior); /* the records alone would have it elsewhere */
    assert_true(fabs(log(rho / start)) < 3.0 * prior);
    fit_free(&without), fit_free(&with);
    bench_free(b);
}

/* At the noise the prior has its usual weight, next to nothing beside the records. */
static void at_the_noise_the_records_decide(void **state)
{
    static const char *const none[] = {NULL};
    struct bench *b = bench_new("", 2, LONG, 0.003, none);
    struct fit_result without, with;
    (void)state;
    b->given.materials[0].EI.value *= 1.02;
    const double free_rho = fitted_rho(b, false, &without), rho = fitted_rho(b, true, &with);
    double sd = 0.0;
    for (size_t i = 0; i < with.n_parameters; i++)
        if (strcmp(with.parameters[i].label, "rho_beam_kgpm") == 0)
            sd = with.parameters[i].sd;
    print_message("rho %.9g without, %.9g with its prior, sd %g\n", free_rho, rho, sd);
    assert_true(with.noise_ratio < 1.05);
    assert_true(sd > 0.0 && fabs(rho - free_rho) < 0.05 * sd);
    fit_free(&without), fit_free(&with);
    bench_free(b);
}

/* Intervals of a model that lacks something are of the size of what it lacks. */
static void intervals_widen_with_the_error_of_form(void **state)
{
    static const char *const none[] = {NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.02, at_m: 0.35}", 2, LONG, 0.003, none);
    struct fit_result fit;
    (void)state;
    (void)fitted_rho(b, true, &fit);
    for (size_t i = 0; i < fit.n_parameters; i++)
        if (strcmp(fit.parameters[i].label, "rho_beam_kgpm") == 0)
            assert_true(fit.parameters[i].sd > 1e-3 * fit.parameters[i].value);
    fit_free(&fit);
    bench_free(b);
}

/* What no beam that swings explains is left as a beam leaves it of which nothing swings, and not above: what is plausible comes first, not alone. */
static void nothing_is_left_above_silence(void **state)
{
    static const char *const none[] = {NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 2, at_m: 0.38}", 2, LONG, 0.003, none);
    struct fit_result fit;
    (void)state;
    (void)fitted_rho(b, true, &fit);
    print_message("error %g\n", fit.nrmse);
    assert_true(fit.nrmse < 1.01);
    fit_free(&fit);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_error_of_form_does_not_override_a_prior),
        cmocka_unit_test(at_the_noise_the_records_decide),
        cmocka_unit_test(nothing_is_left_above_silence),
        cmocka_unit_test(intervals_widen_with_the_error_of_form),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
