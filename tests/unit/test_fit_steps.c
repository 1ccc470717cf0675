/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Steps a sample: as many as a law's kinks need, against the independent simulator's friction; none for what has no kinks. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "estimate/estimate.h"
#include "maths/maths.h"
#include "truth/truth.h"

/* A bond line that hardly slips: friction that turns within 2 mrad/s. */
static const char *const rubbing_beam[] = {
    "length_m = 0.4573",
    "patch_m = 0.02535 0.08905",
    "EI_beam_Nm2 = 0.489",
    "EI_patch_Nm2 = 0.770",
    "rho_beam_kgpm = 0.0919",
    "rho_patch_kgpm = 0.448",
    "cDI_beam_sNm2 = 6.3e-6",
    "cDI_patch_sNm2 = 1.25e-5",
    "gamma_sNpm2 = 0.0134",
    "input hammer_N point_force at_m=0.0254",
    "output tip_mps velocity at_m=0.44",
    "signal hammer_N raised_cosine start_s=0.05 width_s=0.012 level=10",
    "effect coulomb_friction moment_Nm=1.4e-3 velocity_radps=0.002",
    "sample_rate_Hz = 512",
    "duration_s = 0.8",
    "noise = 0",
};
static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                 "parameters: {EI_beam_Nm2: 0.489, EI_patch_Nm2: 0.770, rho_beam_kgpm: 0.0919,\n"
                                 "  rho_patch_kgpm: 0.448, cDI_beam_sNm2: 6.3e-6, cDI_patch_sNm2: 1.25e-5,\n"
                                 "  gamma_sNpm2: 0.0134}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}\n"
                                 "outputs: {tip_mps: {kind: velocity, at_m: 0.44}}\n";
static const char friction[] = "effects: [{kind: coulomb_friction, moment_Nm: 1.4e-3, velocity_radps: 0.002}]\n";
static const char nothing[] = "effects: []\n";

struct rig {
    struct record record;
    struct model model;
    double theta[16];
    size_t n;
    double sigma;
};

static void make_rig(const char *effects, struct rig *rig)
{
    char message[TRUTH_MESSAGE], text[1024];
    struct bf_error err = {0};
    struct truth_spec spec;
    struct truth_record truth;
    struct parameter_ref *refs;
    const char *name = "hit.csv";
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof rubbing_beam / sizeof *rubbing_beam; i++)
        if (truth_spec_line(&spec, rubbing_beam[i], message))
            fail_msg("%s: %s", rubbing_beam[i], message);
    if (truth_simulate(&spec, &truth, message))
        fail_msg("%s", message);
    *rig = (struct rig){.record = {.n = truth.n, .dt_s = 1.0 / truth.rate_Hz, .path = bf_strdup(name)}};
    for (size_t c = 0; c < truth.n_channels; c++)
        record_add_column(&rig->record, truth.channel[c].name, truth.channel[c].x);
    (void)snprintf(text, sizeof text, "Butterworth order %zu at %.9g Hz, %s", spec.filter_order,
                   spec.filter_ratio * truth.rate_Hz,
                   spec.filter_causal ? "one pass" : "forward and backward (zero phase)");
    record_add_meta(&rig->record, "anti-alias filter", text);
    rig->sigma = 2e-3 * dense_norm(truth.n, truth_record_channel(&truth, "tip_mps")) / sqrt((double)truth.n);
    truth_record_free(&truth);
    (void)snprintf(text, sizeof text, "%s%s", model_text, effects);
    assert_int_equal(model_read_text("rig", text, strlen(text), &rig->model, &err), BF_OK);
    rig->n = model_parameters(&rig->model, &name, 1, &refs);
    assert_true(rig->n <= sizeof rig->theta / sizeof *rig->theta);
    for (size_t i = 0; i < rig->n; i++)
        rig->theta[i] = refs[i].value;
    free(refs);
}

static void free_rig(struct rig *rig)
{
    record_free(&rig->record);
    model_free(&rig->model);
}

static int steps_of(const struct rig *rig, int asked_for)
{
    struct bf_error err = {0};
    struct fit_options options = {.quiet = true, .sigma = &rig->sigma};
    int steps = -1;
    options.predict.oversample = asked_for;
    if (fit_steps(&rig->model, &rig->record, 1, &options, rig->theta, NULL, &steps, &err))
        fail_msg("%s", err.text);
    return steps;
}

/* Rms of what the model leaves of the record, in units of the noise, at its own steps a sample. */
static double left_by(const struct rig *rig)
{
    struct bf_error err = {0};
    const struct fit_options options = {.quiet = true, .sigma = &rig->sigma};
    struct finer_prediction out;
    double square = 0.0;
    if (fit_predict(&rig->model, &rig->record, 1, &options, rig->theta, &out, &err))
        fail_msg("%s", err.text);
    for (size_t k = 0; k < out.channels[0].n; k++)
        square += pow(out.channels[0].measured[k] - out.fitted[k], 2);
    square /= (double)out.channels[0].n;
    finer_prediction_free(&out);
    return sqrt(square) / rig->sigma;
}

static void friction_gets_the_steps_that_its_kinks_need(void **state)
{
    (void)state;
    struct rig rig;
    make_rig(friction, &rig);
    const double usual = left_by(&rig);
    rig.model.steps_per_sample = steps_of(&rig, 0);
    assert_true(rig.model.steps_per_sample > 8 && rig.model.steps_per_sample <= MODEL_STEPS_MOST);
    const double fine = left_by(&rig);
    if (!(fine < usual && usual < 1.5 &&
          fine < 1.1)) /* no noise: what is left is the computation's, and no step takes the last 0.2 % */
        fail_msg("%g times the noise with %d steps, %g with the usual ones", fine, rig.model.steps_per_sample, usual);
    assert_int_equal(steps_of(&rig, 0) % 8, 0);
    free_rig(&rig);
}

static void without_a_law_or_when_told_nothing_is_asked(void **state)
{
    (void)state;
    struct rig rig;
    make_rig(nothing, &rig);
    assert_int_equal(steps_of(&rig, 0), 0);
    free_rig(&rig);
    make_rig(friction, &rig);
    assert_int_equal(steps_of(&rig, 8), 0);
    free_rig(&rig);
}

/* A fit ends with the steps in its result, and they go into the model and its file. */
static void a_fit_tells_the_model_its_steps(void **state)
{
    (void)state;
    struct rig rig;
    struct bf_error err = {0};
    struct fit_result result;
    make_rig(friction, &rig);
    const struct fit_options options = {.quiet = true, .never_search = true, .start = FIT_NEAR, .sigma = &rig.sigma};
    if (fit_run(&rig.model, &rig.record, 1, &options, &result, &err))
        fail_msg("%s", err.text);
    assert_true(result.steps_per_sample > 8);
    assert_true(result.noise_ratio < 1.2);
    fit_into_model(&result, &rig.record, &(struct fit_check){0}, &rig.model);
    assert_int_equal(rig.model.steps_per_sample, result.steps_per_sample);
    fit_free(&result);
    free_rig(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(friction_gets_the_steps_that_its_kinks_need),
        cmocka_unit_test(without_a_law_or_when_told_nothing_is_asked),
        cmocka_unit_test(a_fit_tells_the_model_its_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
