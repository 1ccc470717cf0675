/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Candidates refitted from a baseline that lacks what the independent simulator put in. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <pthread.h>
#include "maths/maths.h"
#include "estimate/estimate.h"
#include "test_files.h"
#include "truth/truth.h"
#include "add_effect.h"

enum { RECORDS = 2, CHANNELS = 2 * RECORDS };

static const char *const true_beam[] = {
    "length_m = 0.4573",
    "patch_m = 0.02535 0.08905",
    "EI_beam_Nm2 = 0.491",
    "EI_patch_Nm2 = 0.793",
    "rho_beam_kgpm = 0.093",
    "rho_patch_kgpm = 0.433",
    "cDI_beam_sNm2 = 2e-5",
    "cDI_patch_sNm2 = 2e-5",
    "gamma_sNpm2 = 0.05",
    "Ks_V = 40",
    "input hammer_N point_force at_m=0.0254",
    "output piezo_V patch_strain",
    "output tip_mps velocity at_m=0.44",
    "sample_rate_Hz = 512",
    "duration_s = 2",
    "noise = 0.004",
};
static const char *const hits[RECORDS] = {"signal hammer_N raised_cosine start_s=0.05 width_s=0.012 level=2",
                                          "signal hammer_N raised_cosine start_s=0.05 width_s=0.016 level=20"};

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.5}\n"
                                 "  EI_patch_Nm2: {value: 0.8}\n"
                                 "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                 "  rho_patch_kgpm: {value: 0.43}\n"
                                 "  cDI_beam_sNm2: {value: 2e-5}\n"
                                 "  cDI_patch_sNm2: {value: 2e-5}\n"
                                 "  gamma_sNpm2: {value: 0.05}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                                 "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}\n"
                                 "effects: []\n";

/* Recordings with a hidden effect, their noise, and the baseline fitted to them. */
struct rig {
    struct record records[RECORDS];
    double sigma[CHANNELS];
    struct model baseline;
};

static void say(struct truth_spec *spec, const char *line)
{
    char message[TRUTH_MESSAGE];
    if (truth_spec_line(spec, line, message))
        fail_msg("%s: %s", line, message);
}

static void record_hit(size_t r, const char *effect, struct rig *rig)
{
    char message[TRUTH_MESSAGE];
    struct truth_spec spec;
    struct truth_record clean, noisy;
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof true_beam / sizeof *true_beam; i++)
        say(&spec, true_beam[i]);
    say(&spec, hits[r]);
    if (effect)
        say(&spec, effect);
    if (truth_simulate(&spec, &clean, message))
        fail_msg("%s", message);
    truth_measure(&spec, &clean, 100 + r, &noisy);
    rig->records[r] =
        (struct record){.n = noisy.n, .dt_s = 1.0 / noisy.rate_Hz, .path = strdup(r ? "hard.csv" : "soft.csv")};
    for (size_t c = 0, output = 0; c < noisy.n_channels; c++) {
        record_add_column(&rig->records[r], noisy.channel[c].name, noisy.channel[c].x);
        if (!clean.channel[c].is_input)
            rig->sigma[2 * r + output++] = 0.004 * dense_norm(clean.n, clean.channel[c].x) / sqrt((double)clean.n);
    }
    truth_record_free(&noisy);
    truth_record_free(&clean);
}

static void make_rig(const char *effect, struct rig *rig)
{
    struct bf_error err = {0};
    struct fit_result result;
    for (size_t r = 0; r < RECORDS; r++)
        record_hit(r, effect, rig);
    assert_int_equal(model_read_text("rig", model_text, strlen(model_text), &rig->baseline, &err), BF_OK);
    const struct fit_options options = {.quiet = true, .never_search = true, .sigma = rig->sigma};
    if (fit_run(&rig->baseline, rig->records, RECORDS, &options, &result, &err))
        fail_msg("%s", err.text);
    fit_into_model(&result, rig->records, &(struct fit_check){0}, &rig->baseline);
    fit_free(&result);
}

static void free_rig(struct rig *rig)
{
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&rig->records[r]);
    model_free(&rig->baseline);
}

static void refit(const struct rig *rig, const char *id, const struct refit_options *extra, struct refit_result *out)
{
    struct bf_error err = {0};
    struct model model;
    struct refit_options options = extra ? *extra : (struct refit_options){0};
    options.sigma = rig->sigma;
    assert_int_equal(model_copy(&rig->baseline, &model, &err), BF_OK);
    options.first_new = model.n_effects;
    assert_int_equal(add_effect(&model, id, "", &err), BF_OK);
    if (refit_run(&model, rig->records, RECORDS, &options, out, &err))
        fail_msg("%s: %s", id, err.text);
    model_free(&model);
}

/* Index of an effect's parameter in the result of a refit of the baseline plus this effect. */
static size_t index_of(const struct rig *rig, const char *id, const char *label)
{
    struct bf_error err;
    struct model model;
    struct parameter_ref *refs;
    const char *names[RECORDS] = {"soft.csv", "hard.csv"};
    assert_int_equal(model_copy(&rig->baseline, &model, &err), BF_OK);
    assert_int_equal(add_effect(&model, id, "", &err), BF_OK);
    const size_t n = model_parameters(&model, names, RECORDS, &refs);
    size_t found = n;
    for (size_t i = 0; i < n; i++)
        if (strcmp(refs[i].label, label) == 0)
            found = i;
    assert_true(found < n);
    free(refs);
    model_free(&model);
    return found;
}

static void assert_estimate(const struct refit_result *result, size_t i, double expected)
{
    assert_true(result->estimated[i] && result->sd[i] > 0.0);
    if (fabs(result->value[i] - expected) > 4.5 * result->sd[i])
        fail_msg("parameter %zu is %g ± %g, not %g", i, result->value[i], result->sd[i], expected);
}

/* ---- Linear effects ---- */

static void a_hidden_mass_is_found_at_its_place(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result result;
    make_rig("effect point_mass mass_kg=0.003 at_m=0.3", &rig);
    refit(&rig, "point_mass", NULL, &result);
    assert_true(result.converged);
    assert_true(result.chi2_per_row < 1.1 && result.noise_ratio < 1.05);
    assert_estimate(&result, index_of(&rig, "point_mass", "mass_kg"), 0.003);
    assert_estimate(&result, index_of(&rig, "point_mass", "at_m"), 0.3);
    refit_free(&result);
    refit(&rig, "tip_mass", NULL, &result); /* a rival at the wrong place does not explain it */
    assert_true(result.chi2_per_row > 2.0);
    refit_free(&result);
    free_rig(&rig);
}

/* Far from the noise the error of form says how near an end is: what explains nothing comes to one, too. */
static void what_explains_nothing_converges(void **state)
{
    (void)state;
    static const char *const rivals[] = {"axial_load", "hysteretic_damping", "viscoelastic", "sensor_lag"};
    struct rig rig;
    make_rig("effect point_mass mass_kg=0.02 at_m=0.3", &rig);
    for (size_t k = 0; k < sizeof rivals / sizeof *rivals; k++) {
        struct refit_result result;
        refit(&rig, rivals[k], NULL, &result);
        assert_true(result.chi2_per_row > 1000.0);
        if (!result.converged)
            fail_msg("%s: %g standard errors from its end", rivals[k], result.distance);
        refit_free(&result);
    }
    free_rig(&rig);
}

/* Structural damping takes the place of the beam's own, which the search lets vanish; from where that is seen again the records lead further down. */
static void what_has_vanished_on_the_way_is_restored_where_that_is_asked_for(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result as_it_ends, restored;
    make_rig("effect point_mass mass_kg=0.02 at_m=0.3", &rig);
    refit(&rig, "hysteretic_damping", NULL, &as_it_ends);
    const struct refit_options below = {.raise_below = 1.1 * as_it_ends.chi2_per_row},
                               far_below = {.raise_below = 0.9 * as_it_ends.chi2_per_row};
    refit(&rig, "hysteretic_damping", &below, &restored);
    assert_true(restored.chi2_per_row < 0.95 * as_it_ends.chi2_per_row);
    refit_free(&restored);
    refit(&rig, "hysteretic_damping", &far_below, &restored);
    assert_true(restored.evaluations == as_it_ends.evaluations);
    refit_free(&restored), refit_free(&as_it_ends);
    free_rig(&rig);
}

/* From a beam a thousand times as stiff a search does not come back; a start from which whole records lead down does. */
static void a_start_that_leaves_less_is_gone_down_from(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result there, alone, result;
    make_rig("effect point_mass mass_kg=0.004 at_m=0.3", &rig);
    refit(&rig, "point_mass", NULL, &there);
    for (size_t m = 0; m < rig.baseline.n_materials; m++)
        rig.baseline.materials[m].EI.value *= 1e3;
    refit(&rig, "point_mass", NULL, &alone);
    double *start = bf_alloc(there.n_parameters, sizeof *start);
    memcpy(start, there.value, there.n_parameters * sizeof *start);
    start[index_of(&rig, "point_mass", "at_m")] = 0.31;
    const struct refit_options options = {.n_starts = 1, .starts = start};
    refit(&rig, "point_mass", &options, &result);
    assert_true(alone.chi2_per_row > 1e4);
    assert_true(result.chi2_per_row < 0.01 * alone.chi2_per_row);
    assert_true(fabs(result.value[index_of(&rig, "point_mass", "at_m")] - 0.3) < 0.01);
    free(start);
    refit_free(&there), refit_free(&alone), refit_free(&result);
    free_rig(&rig);
}

/* Residuals and totals of the answer agree with each other and with the definition. */
static void the_answer_is_consistent(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result result;
    make_rig("effect tip_mass mass_kg=0.002", &rig);
    refit(&rig, "tip_mass", NULL, &result);
    double square = 0.0;
    assert_int_equal(result.n_channels, CHANNELS);
    for (size_t c = 0; c < CHANNELS; c++)
        for (size_t k = 0; k < result.channels[c].n; k++)
            square += pow(result.residual[result.channels[c].row + k] / rig.sigma[c], 2.0);
    assert_true(fabs(square / (double)result.n_rows - result.chi2_per_row) < 1e-9 * result.chi2_per_row);
    assert_true(fabs(0.5 * square - result.half_square) < 1e-3 * square);
    assert_true(result.n_unknowns == 9);
    refit_free(&result);
    free_rig(&rig);
}

static void a_quick_refit_ranks_alike(void **state)
{
    (void)state;
    static const char *const rivals[] = {"sensor_delay", "hysteretic_damping", "rotary_inertia"};
    const struct refit_options quick = {.quick = true};
    struct rig rig;
    struct refit_result truth, rival;
    make_rig("effect root_compliance compliance_radpNm=0.01 loss_s=3e-5", &rig);
    refit(&rig, "root_compliance", &quick, &truth);
    for (size_t i = 0; i < sizeof rivals / sizeof *rivals; i++) {
        refit(&rig, rivals[i], &quick, &rival);
        assert_true(rival.chi2_per_row > 2.0 * truth.chi2_per_row);
        refit_free(&rival);
    }
    refit_free(&truth);
    free_rig(&rig);
}

/* The logarithm of a positive parameter that a wrong baseline drove to nothing has no gradient there. */
static void a_vanished_parameter_comes_back(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result result;
    make_rig("effect tip_mass mass_kg=0.002", &rig);
    rig.baseline.gamma.value = 1e-7;
    refit(&rig, "tip_mass", NULL, &result);
    assert_true(result.chi2_per_row < 1.1);
    assert_estimate(&result, index_of(&rig, "tip_mass", "gamma_sNpm2"), 0.05);
    refit_free(&result);
    free_rig(&rig);
}

static void a_place_that_nothing_tells_has_no_error(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result result;
    make_rig(NULL, &rig);
    refit(&rig, "point_mass", NULL, &result);
    const size_t mass = index_of(&rig, "point_mass", "mass_kg"), place = index_of(&rig, "point_mass", "at_m");
    assert_true(result.value[mass] < 1e-4);
    assert_true(isnan(result.sd[place]));
    refit_free(&result);
    free_rig(&rig);
}

static bool at_once(void *context)
{
    size_t *asked = context;
    return ++*asked > 20;
}

static void a_refit_gives_up_when_told(void **state)
{
    (void)state;
    size_t asked = 0;
    struct rig rig;
    struct refit_result whole, result;
    make_rig("effect root_compliance compliance_radpNm=0.01 loss_s=3e-5", &rig);
    refit(&rig, "hysteretic_damping", NULL, &whole);
    assert_true(whole.converged);
    const struct refit_options abandon = {.abandon_above = 0.01 * whole.chi2_per_row};
    refit(&rig, "hysteretic_damping", &abandon, &result);
    assert_true(result.abandoned && !result.converged);
    refit_free(&result);
    const struct refit_options stop = {.interrupted = at_once, .context = &asked};
    refit(&rig, "hysteretic_damping", &stop, &result);
    assert_true(result.interrupted && !result.converged);
    assert_true(result.evaluations < whole.evaluations + 20);
    assert_true(isfinite(result.chi2_per_row));
    refit_free(&result);
    refit_free(&whole);
    free_rig(&rig);
}

struct job {
    const struct rig *rig;
    const char *id;
    struct refit_result result;
};

static void *work(void *argument)
{
    struct job *job = argument;
    refit(job->rig, job->id, NULL, &job->result);
    return NULL;
}

/* To the last bit: nothing is shared. */
static void two_refits_at_once_are_those_of_one_after_the_other(void **state)
{
    (void)state;
    struct rig rig;
    pthread_t threads[2];
    make_rig("effect tip_mass mass_kg=0.002", &rig);
    struct job alone[2] = {{.rig = &rig, .id = "tip_mass"}, {.rig = &rig, .id = "viscoelastic"}};
    struct job both[2] = {alone[0], alone[1]};
    for (int i = 0; i < 2; i++)
        work(&alone[i]);
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, work, &both[i]), 0);
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_join(threads[i], NULL), 0);
    for (int i = 0; i < 2; i++) {
        assert_true(alone[i].result.half_square == both[i].result.half_square);
        assert_memory_equal(alone[i].result.value, both[i].result.value, alone[i].result.n_parameters * sizeof(double));
        refit_free(&alone[i].result);
        refit_free(&both[i].result);
    }
    free_rig(&rig);
}

static double held_out_ratio(const struct rig *rig)
{
    const struct fit_options options = {.quiet = true, .sigma = rig->sigma, .predict = {.quiet = true}};
    struct fit_channel_error *channels;
    struct bf_error err;
    size_t n;
    double nrmse, ratio;
    assert_int_equal(fit_errors(&rig->baseline, rig->records, RECORDS, &options, &channels, &n, &err), BF_OK);
    fit_totals(channels, n, &nrmse, &ratio);
    free(channels);
    return ratio;
}

static void held_out_errors_are_those_of_the_model(void **state)
{
    (void)state;
    struct rig rig;
    make_rig(NULL, &rig);
    const double ratio = held_out_ratio(&rig);
    assert_true(fabs(ratio - 1.0) < 0.05);
    for (size_t c = 0; c < CHANNELS; c++)
        rig.sigma[c] *= 2.0;
    assert_true(fabs(held_out_ratio(&rig) - 0.5 * ratio) < 1e-9);
    free_rig(&rig);
}

/* ---- Nonlinear effects ---- */

/* 400 times the catalogue's start, from a baseline that is tens of noises off. */
static void a_hidden_cubic_spring_is_found_from_afar(void **state)
{
    (void)state;
    struct rig rig;
    struct refit_result result;
    make_rig("effect cubic_stiffness coefficient_Npm3=2e5", &rig);
    refit(&rig, "cubic_stiffness", NULL, &result);
    assert_true(result.chi2_per_row < 1.2);
    assert_estimate(&result, index_of(&rig, "cubic_stiffness", "coefficient_Npm3"), 2e5);
    assert_true(fabs(result.value[index_of(&rig, "cubic_stiffness", "at_m")] - 0.4573) < 0.02);
    refit_free(&result);
    free_rig(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hidden_mass_is_found_at_its_place),
        cmocka_unit_test(what_explains_nothing_converges),
        cmocka_unit_test(what_has_vanished_on_the_way_is_restored_where_that_is_asked_for),
        cmocka_unit_test(a_start_that_leaves_less_is_gone_down_from),
        cmocka_unit_test(the_answer_is_consistent),
        cmocka_unit_test(a_quick_refit_ranks_alike),
        cmocka_unit_test(a_vanished_parameter_comes_back),
        cmocka_unit_test(a_place_that_nothing_tells_has_no_error),
        cmocka_unit_test(a_refit_gives_up_when_told),
        cmocka_unit_test(two_refits_at_once_are_those_of_one_after_the_other),
        cmocka_unit_test(held_out_errors_are_those_of_the_model),
        cmocka_unit_test(a_hidden_cubic_spring_is_found_from_afar),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
