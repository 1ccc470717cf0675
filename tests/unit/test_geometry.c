/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The free length and the edges of the patch as parameters: derivatives, agreement with a model that was written so, recovery by a fit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "estimate/estimate.h"
#include "gradient_check.h"
#include "test_files.h"

/* Length and edges are listed, at other values than the file's; no channel next to an edge, where differences cross a kink of the splines. */
static void free_geometry(struct model *model, double length_by, double from_by, double to_by)
{
    struct geometry_parameters *own = &model->own;
    own->lists_length = own->lists_from = own->lists_to = true;
    own->length.fixed = own->from.fixed = own->to.fixed = false;
    model->inputs[0].at_m = 0.2113;
    model->outputs[1].at_m = 0.0157;
    own->length.value += length_by, own->from.value += from_by, own->to.value += to_by;
}

static void check_gradients(const char *effects, bool inputs, double goal)
{
    const struct predict_options options = {.fine_splines = 24, .modes = 6};
    struct bf_error err;
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, inputs)};
    fixture_model(&c.model, effects);
    free_geometry(&c.model, 0.0, 0.0, 0.0);
    if (case_open(&c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
    const struct summary s = check_case(&c, true);
    print_message("  worst %.2g at %s (reference good to %.1g)\n", s.worst.error, s.label, s.worst.estimate);
    assert_true(s.worst.estimate < goal && s.worst.error < goal);
    case_close(&c);
}

static void gradients(void **state)
{
    (void)state;
    check_gradients("", true, 3e-7);
    check_gradients("", false, 3e-7);
    check_gradients("  - {kind: tip_mass, mass_kg: 0.003}\n"
                    "  - {kind: patch_position, shift_m: 0.004}\n"
                    "  - {kind: root_compliance, compliance_radpNm: 0.01, loss_s: 3e-5, frequency_Hz: 60}\n"
                    "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                    "  - {kind: hysteretic_damping, loss_factor: 0.004}\n"
                    "  - {kind: input_position, shift_m: 0.004}\n",
                    true, 3e-7);
    check_gradients("  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n", true, 1e-6);
}

static void predicted(const struct model *model, const struct record *record, double y[], size_t n)
{
    struct bf_error err;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction out;
    const char *name = "case.csv";
    if (predictor_new(model, record, 1, NULL, &predictor, &err) != BF_OK)
        fail_msg("%s", err.text);
    const size_t n_refs = model_parameters(model, &name, 1, &refs);
    double *theta = bf_alloc(n_refs, sizeof *theta);
    for (size_t i = 0; i < n_refs; i++)
        theta[i] = refs[i].value;
    if (predictor_run(predictor, theta, NULL, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_int_equal(out.n_rows, n);
    memcpy(y, out.y, n * sizeof *y);
    free(theta), free(refs);
    predictor_free(predictor);
}

/* Parameters that stand elsewhere than the file's numbers predict what a file with these numbers does; a channel held at the end stays there. */
static void parameters_are_the_geometry(void **state)
{
    (void)state;
    enum { ROWS = CHANNELS * SAMPLES };
    static double y[ROWS], wanted[ROWS];
    struct record record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, true);
    struct model listed, written, nominal;
    struct bf_error err;
    fixture_model(&nominal, "  - {kind: tip_mass, mass_kg: 0.003}\n");
    nominal.outputs[2].at_m = nominal.length_m;
    assert_int_equal(model_copy(&nominal, &listed, &err), BF_OK);
    assert_int_equal(model_copy(&nominal, &written, &err), BF_OK);
    free_geometry(&listed, 0.01, -0.003, 0.005);
    written.inputs[0].at_m = 0.2113, written.outputs[1].at_m = 0.0157;
    written.length_m = written.regions[2].to_m = written.outputs[2].at_m = 0.4673;
    written.regions[0].to_m = written.regions[1].from_m = written.inputs[1].from_m = written.outputs[0].from_m =
        0.02235;
    written.regions[1].to_m = written.regions[2].from_m = written.inputs[1].to_m = written.outputs[0].to_m = 0.09405;
    predicted(&listed, &record, y, ROWS);
    predicted(&written, &record, wanted, ROWS);
    for (size_t c = 0; c < CHANNELS; c++) {
        const double size = channel_norm(wanted, NULL, c, SAMPLES), off = channel_norm(y, wanted, c, SAMPLES) / size;
        print_message("  channel %zu: %.2g\n", c, off);
        assert_true(off < 1e-6); /* knots are stretched, not counted anew */
    }
    predicted(&nominal, &record, y, ROWS);
    assert_true(channel_norm(y, wanted, 0, SAMPLES) > 0.05 * channel_norm(wanted, NULL, 0, SAMPLES));
    model_free(&listed), model_free(&written), model_free(&nominal);
    record_free(&record);
}

/* A ruler that was 3 mm off beside a stiffness that is known: the records move the length back, with an error that covers what is left. */
static void a_fit_finds_the_length(void **state)
{
    (void)state;
    enum { ROWS = CHANNELS * SAMPLES };
    static double y[ROWS];
    struct record record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, true);
    struct model model;
    struct fit_result fit;
    struct bf_error err;
    fixture_model(&model, "");
    model.inputs[0].at_m = 0.2113, model.outputs[1].at_m = 0.0157;
    predicted(&model, &record, y, ROWS);
    uint64_t seed = signal_seed(4);
    for (size_t o = 0; o < CHANNELS; o++) {
        const double noise = 0.003 * channel_norm(y, NULL, o, SAMPLES) / sqrt((double)SAMPLES);
        double *column = NULL;
        for (size_t i = 0; i < record.n_columns; i++)
            column = strcmp(record.columns[i].name, model.outputs[o].name) == 0 ? record.columns[i].x : column;
        assert_non_null(column);
        for (size_t k = 0; k < SAMPLES; k++)
            column[k] = y[o * SAMPLES + k] + noise * signal_normal(&seed);
    }
    struct parameter *held[] = {&model.materials[0].EI,
                                &model.materials[1].EI,
                                &model.materials[0].rho,
                                &model.materials[1].rho,
                                &model.Ks,
                                &model.KB};
    for (size_t i = 0; i < sizeof held / sizeof *held; i++)
        held[i]->fixed = true;
    free_geometry(&model, 0.0, 0.0, 0.0);
    model.own.from.fixed = model.own.to.fixed = true;
    model.own.length.value = model.own.length.prior_value = 0.4603;
    model.own.length.prior = 0.003 / 0.4603;
    const struct fit_options options = {.quiet = true, .never_search = true, .predict = {.quiet = true}};
    if (fit_run(&model, &record, 1, &options, &fit, &err) != BF_OK)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < fit.n_parameters; i++) {
        if (strcmp(fit.parameters[i].label, "length_m") != 0)
            continue;
        const double value = fit.parameters[i].value, sd = fit.parameters[i].sd;
        print_message("  length %.6f ± %.1g m\n", value, sd);
        assert_true(sd > 0.0 && sd < 1e-3 && fabs(value - 0.4573) < 4.0 * sd);
    }
    assert_true(fit.nrmse < 0.004); /* 0.3 % was put in */
    fit_free(&fit), model_free(&model), record_free(&record);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradients),
        cmocka_unit_test(parameters_are_the_geometry),
        cmocka_unit_test(a_fit_finds_the_length),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
