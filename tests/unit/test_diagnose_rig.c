/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A rig that is not quite where the model file says, recorded by the independent simulator: no effect may be blamed for it, and none hidden. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "explain/explain.h"
#include "signals.h"
#include "truth/truth.h"

enum { RECORDS = 3 }; /* the last one is held out */

static const char *const beam[] = {
    "length_m = 0.4573",
    "patch_m = 0.02535 0.08905",
    "EI_beam_Nm2 = 0.491",
    "EI_patch_Nm2 = 0.793",
    "rho_beam_kgpm = 0.0926",
    "rho_patch_kgpm = 0.433",
    "cDI_beam_sNm2 = 2e-5",
    "cDI_patch_sNm2 = 2e-5",
    "gamma_sNpm2 = 0.05",
    "input hammer_N point_force at_m=0.1518",     /* the file says 0.15 */
    "output accel_mps2 acceleration at_m=0.3022", /* 0.3 */
    "output tip_mps velocity at_m=0.4378",        /* 0.44 */
    "sample_rate_Hz = 512",
    "duration_s = 2",
    "noise = 0.004",
};
static const char *const hits[RECORDS] = {"signal hammer_N raised_cosine start_s=0.05 width_s=0.010 level=4",
                                          "signal hammer_N raised_cosine start_s=0.05 width_s=0.008 level=9",
                                          "signal hammer_N raised_cosine start_s=0.05 width_s=0.012 level=6"};
static const double gain_of_tip = 1.06;

static const char model_text[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
    "parameters:\n"
    "  EI_beam_Nm2: {value: 0.495, prior: 0.03}\n"
    "  EI_patch_Nm2: {value: 0.9}\n"
    "  rho_beam_kgpm: {value: 0.0926, prior: 0.01}\n"
    "  rho_patch_kgpm: {value: 0.4}\n"
    "  cDI_beam_sNm2: {value: 2e-5}\n"
    "  cDI_patch_sNm2: {value: 2e-5}\n"
    "  gamma_sNpm2: {value: 0.05}\n"
    "inputs: {hammer_N: {kind: point_force, at_m: 0.15}}\n"
    "outputs: {accel_mps2: {kind: acceleration, at_m: 0.3}, tip_mps: {kind: velocity, at_m: "
    "0.44}}\n"
    "effects: []\n";

static void simulate(size_t r, const char *effect, struct record *out)
{
    char message[TRUTH_MESSAGE];
    struct truth_spec spec;
    struct truth_record clean, noisy;
    char name[16];
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof beam / sizeof *beam; i++)
        if (truth_spec_line(&spec, beam[i], message))
            fail_msg("%s: %s", beam[i], message);
    if (truth_spec_line(&spec, hits[r], message) || (effect && truth_spec_line(&spec, effect, message)) ||
        truth_simulate(&spec, &clean, message))
        fail_msg("%s", message);
    truth_measure(&spec, &clean, 300 + r, &noisy);
    (void)snprintf(name, sizeof name, "hit%zu.csv", r + 1);
    *out = (struct record){.n = noisy.n, .dt_s = 1.0 / noisy.rate_Hz, .path = bf_strdup(name)};
    for (size_t c = 0; c < noisy.n_channels; c++) {
        const bool tip = strcmp(noisy.channel[c].name, "tip_mps") == 0;
        for (size_t k = 0; k < noisy.n && tip; k++)
            noisy.channel[c].x[k] *= gain_of_tip;
        record_add_column(out, noisy.channel[c].name, noisy.channel[c].x);
    }
    truth_record_free(&noisy);
    truth_record_free(&clean);
}

static void diagnose(const char *effect, struct model *model, struct record records[RECORDS], struct diagnosis *d)
{
    struct bf_error err = {0};
    const struct diagnose_options options = {.quiet = true};
    for (size_t r = 0; r < RECORDS; r++)
        simulate(r, effect, &records[r]);
    assert_int_equal(model_read_text("rig", model_text, strlen(model_text), model, &err), BF_OK);
    if (diagnose_run(model, records, RECORDS - 1, records + RECORDS - 1, 1, &options, d, &err))
        fail_msg("%s", err.text);
}

static void done(struct model *model, struct record records[RECORDS], struct diagnosis *d)
{
    diagnose_free(d);
    model_free(model);
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&records[r]);
}

static void assert_place(const char *what, double at_m, double expected_m)
{
    if (!(fabs(at_m - expected_m) < 3e-4))
        fail_msg("%s at %g m, not %g", what, at_m, expected_m);
}

static void a_wrong_rig_is_no_missing_physics(void **state)
{
    (void)state;
    struct model model;
    struct record records[RECORDS];
    struct diagnosis d;
    diagnose(NULL, &model, records, &d);
    assert_int_equal(d.verdict, VERDICT_COMPLETE);
    assert_true(d.free_rig);
    assert_true(d.baseline.fitted.noise_ratio < 1.1);
    assert_place("the hammer", d.baseline.model.inputs[0].at_m, 0.1518);
    assert_place("the accelerometer", d.baseline.model.outputs[0].at_m, 0.3022);
    assert_place("the laser", d.baseline.model.outputs[1].at_m, 0.4378);
    /* the scale of all is the prior's; the ratio of the two channels is not */
    const double ratio = d.baseline.model.outputs[1].own.gain.value / d.baseline.model.outputs[0].own.gain.value;
    assert_true(fabs(ratio / gain_of_tip - 1.0) < 0.01);
    assert_non_null(strstr(d.text, "Places and gains"));
    done(&model, records, &d);
}

static void physics_on_a_wrong_rig_is_named(void **state)
{
    (void)state;
    struct model model;
    struct record records[RECORDS];
    struct diagnosis d;
    diagnose("effect tip_mass mass_kg=0.004", &model, records, &d);
    assert_int_equal(d.verdict, VERDICT_MISSING);
    assert_int_equal(d.n_named, 1);
    assert_string_equal(d.named[0], "tip_mass");
    assert_true(d.free_rig);
    const struct hypothesis *best = &d.hypotheses[0];
    const double mass_kg = best->model.effects[0].parameters[0].value;
    if (!(fabs(mass_kg / 0.004 - 1.0) < 0.03))
        fail_msg("%g kg", mass_kg);
    done(&model, records, &d);
}

static const char *const laboratory[] = {
    "length_m = 0.35",
    "region 0 0.35 52.1 0.97 1.1e-4",
    "gamma_sNpm2 = 1.3",
    "noise = 0.002",
    "adc_inputs = 1",
    "input hammer_N point_force at_m=0.30",
    "output accel_mps2 acceleration at_m=0.28",
    "output laser_mps velocity at_m=0.20",
    "signal hammer_N raised_cosine start_s=0.1 width_s=0.002 level=40",
    "sample_rate_Hz = 2048",
    "duration_s = 2",
};
static const char laboratory_model[] = "format: beamfit-model/1\n"
                                       "beam: {length_m: 0.35}\n"
                                       "parameters:\n"
                                       "  EI_beam_Nm2: {value: 53.4, prior: 0.05}\n"
                                       "  rho_beam_kgpm: {value: 0.981, prior: 0.02}\n"
                                       "  cDI_beam_sNm2: 1e-4\n"
                                       "  gamma_sNpm2: 1\n"
                                       "inputs: {hammer_N: {kind: point_force, at_m: 0.30}}\n"
                                       "outputs:\n"
                                       "  accel_mps2: {kind: acceleration, at_m: 0.28}\n"
                                       "  laser_mps: {kind: velocity, at_m: 0.20}\n";

/* The range of the accelerometer ends at a third of its largest value; a hammer at rest has noise. */
static struct record overloaded_record(void)
{
    char message[TRUTH_MESSAGE];
    struct truth_spec spec;
    struct truth_record clean, noisy;
    uint64_t seed = signal_seed(1);
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof laboratory / sizeof *laboratory; i++)
        if (truth_spec_line(&spec, laboratory[i], message))
            fail_msg("%s: %s", laboratory[i], message);
    if (truth_simulate(&spec, &clean, message))
        fail_msg("%s", message);
    truth_measure(&spec, &clean, 11, &noisy);
    struct record out = {.n = noisy.n, .dt_s = 1.0 / noisy.rate_Hz, .path = bf_strdup("hit.csv")};
    for (size_t c = 0; c < noisy.n_channels; c++) {
        double *x = noisy.channel[c].x, top = 0.0;
        for (size_t k = 0; k < noisy.n; k++)
            top = fmax(top, fabs(x[k]) / 3.0);
        for (size_t k = 0; k < noisy.n; k++) {
            if (strcmp(noisy.channel[c].name, "accel_mps2") == 0)
                x[k] = fmin(fmax(x[k], -top), top);
            if (strcmp(noisy.channel[c].name, "hammer_N") == 0)
                x[k] += 0.01 * signal_normal(&seed);
        }
        record_add_column(&out, noisy.channel[c].name, x);
    }
    truth_record_free(&noisy);
    truth_record_free(&clean);
    return out;
}

/* A fit with places and gains free begins elsewhere, and may end in another minimum: then the one that is held is where it begins. */
static void a_free_rig_leaves_no_more_than_a_held_one(void **state)
{
    (void)state;
    struct model model;
    struct diagnosis d;
    struct fit_result fit;
    struct bf_error err = {0};
    const struct diagnose_options options = {.quiet = true};
    const struct fit_options near = {.quiet = true, .never_search = true};
    struct record record = overloaded_record();
    assert_int_equal(model_read_text("rig", laboratory_model, strlen(laboratory_model), &model, &err), BF_OK);
    assert_int_equal(fit_run(&model, &record, 1, &near, &fit, &err), BF_OK);
    assert_int_equal(diagnose_run(&model, &record, 1, NULL, 0, &options, &d, &err), BF_OK);
    if (!(d.baseline.fitted.noise_ratio < 1.05 * fit.noise_ratio))
        fail_msg("the diagnosis is of %g times the noise, the fit leaves %g", d.baseline.fitted.noise_ratio,
                 fit.noise_ratio);
    fit_free(&fit);
    diagnose_free(&d);
    model_free(&model);
    record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_free_rig_leaves_no_more_than_a_held_one),
        cmocka_unit_test(a_wrong_rig_is_no_missing_physics),
        cmocka_unit_test(physics_on_a_wrong_rig_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
