/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Models fitted to modes: against a cantilever with a mass at its tip in closed form, whose poles and residues come from nobody's matrices. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "estimate/estimate.h"
#include "exact_response.h"

enum { FOUND = 4 };
static const struct exact_cantilever bare = {0.4, 0.5, 0.1, 2e-5, 0.02, 0.0};
static const double tip_kg = 0.006;

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.4}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: %g, prior: 0.03}\n"
                                 "  rho_beam_kgpm: {value: 0.1, prior: 0.01}\n"
                                 "  cDI_beam_sNm2: {value: %g}\n"
                                 "  gamma_sNpm2: {value: %g}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.4}}\n"
                                 "outputs: {accel_mps2: {kind: acceleration, at_m: 0.4}}\n"
                                 "effects: []\n";

static struct model read_model(double EI, double cDI, double gamma)
{
    char text[1024];
    struct model model;
    struct bf_error err;
    const int n = snprintf(text, sizeof text, model_text, EI, cDI, gamma);
    if (model_read_text("test.yaml", text, (size_t)n, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

static double complex accelerance(const struct exact_cantilever *b, double complex s)
{
    return exact_accelerance(b, cimag(s) / (2.0 * acos(-1.0)), creal(s));
}

/* 1/A = 0 by the secant method from a frequency near by. */
static double complex exact_pole(const struct exact_cantilever *b, double near_Hz)
{
    const double omega = 2.0 * acos(-1.0) * near_Hz;
    double complex p = CMPLX(-0.01 * omega, omega), q = p * 1.001;
    for (int i = 0; i < 50 && cabs(p - q) > 1e-12 * cabs(p); i++) {
        const double complex fp = 1.0 / accelerance(b, p), fq = 1.0 / accelerance(b, q);
        const double complex next = p - fp * (p - q) / (fp - fq);
        q = p;
        p = next;
    }
    return p;
}

/* (1/2πi)∮A ds on a small circle. */
static double complex exact_residue(const struct exact_cantilever *b, double complex p)
{
    enum { POINTS = 16 };
    double complex sum = 0.0;
    for (int i = 0; i < POINTS; i++) {
        const double complex step = 0.01 * cabs(p) * cexp(CMPLX(0.0, 2.0 * acos(-1.0) * i / POINTS));
        sum += step * accelerance(b, p + step) / POINTS;
    }
    return sum;
}

/* The lowest modes, from the peaks of the closed form. */
static struct measured_modes exact_modes(const struct exact_cantilever *b)
{
    struct measured_modes modes = {.n_outputs = 1,
                                   .n_inputs = 1,
                                   .pole = calloc(FOUND + 1, sizeof *modes.pole),
                                   .residue = calloc(FOUND + 1, sizeof *modes.residue)};
    double before = 0.0, here = 0.0;
    for (double f = 1.0; modes.n < FOUND; f *= 1.0005) {
        const double next = cabs(exact_accelerance(b, f, 0.0)) / f;
        if (here > before && here > next) {
            const double complex p = exact_pole(b, f);
            modes.residue[modes.n] = exact_residue(b, p);
            modes.pole[modes.n++] = p;
        }
        before = here, here = next;
    }
    return modes;
}

static void add_tip_mass(struct model *model, double mass_kg)
{
    struct bf_error err;
    assert_int_equal(model_append_effect(model, "tip_mass", "", &err), BF_OK);
    model->effects[0].parameters[0].value = mass_kg;
}

static double fit(struct model *model, const struct measured_modes *modes, double sharpness, double complex fitted[])
{
    const struct modal_options options = {.sharpness = sharpness, .fitted = fitted};
    struct bf_error err;
    double left;
    if (refit_to_modes(model, modes, &options, &left, &err) != BF_OK)
        fail_msg("%s", err.text);
    return left;
}

static void a_model_with_the_true_values_has_the_exact_modes(void **state)
{
    (void)state;
    struct exact_cantilever beam = bare;
    struct model model = read_model(bare.EI_Nm2, bare.cDI_sNm2, bare.gamma_sNpm2);
    double complex fitted[FOUND];
    beam.tip_kg = tip_kg;
    struct measured_modes modes = exact_modes(&beam);
    add_tip_mass(&model, tip_kg);
    assert_true(fit(&model, &modes, 1.0, fitted) < 0.02);
    for (int k = 0; k < FOUND; k++)
        if (!(cabs(fitted[k] - modes.residue[k]) < 2e-3 * cabs(modes.residue[k])))
            fail_msg("mode %d: residue %g%+gi, exactly %g%+gi", k + 1, creal(fitted[k]), cimag(fitted[k]),
                     creal(modes.residue[k]), cimag(modes.residue[k]));
    measured_modes_free(&modes);
    model_free(&model);
}

/* From handbook values that are off, and a thousandth of the mass. */
static void a_mass_is_found_from_the_modes_and_a_beam_without_it_leaves_much(void **state)
{
    (void)state;
    struct exact_cantilever beam = bare;
    struct model model = read_model(1.03 * bare.EI_Nm2, 5e-5, 0.005), without = read_model(bare.EI_Nm2, 5e-5, 0.005);
    beam.tip_kg = tip_kg;
    struct measured_modes modes = exact_modes(&beam);
    add_tip_mass(&model, 1e-3 * tip_kg);
    assert_true(fit(&model, &modes, 1.0, NULL) < 0.5);
    assert_true(fabs(model.effects[0].parameters[0].value / tip_kg - 1.0) < 0.02);
    assert_true(fabs(model.materials[0].cDI.value / bare.cDI_sNm2 - 1.0) < 0.05);
    assert_true(fit(&model, &modes, 10.0, NULL) < 0.2); /* in the same units, and nearer */
    assert_true(fit(&without, &modes, 1.0, NULL) > 3.0);
    measured_modes_free(&modes);
    model_free(&model), model_free(&without);
}

/* A pole that no beam has, between two of the beam's. */
static void a_mode_that_the_model_lacks_belongs_to_none_of_its_own(void **state)
{
    (void)state;
    struct exact_cantilever beam = bare;
    struct model model = read_model(1.03 * bare.EI_Nm2, 5e-5, 0.005);
    double complex fitted[FOUND + 1];
    beam.tip_kg = tip_kg;
    struct measured_modes modes = exact_modes(&beam);
    memmove(modes.pole + 2, modes.pole + 1, (FOUND - 1) * sizeof *modes.pole);
    memmove(modes.residue + 2, modes.residue + 1, (FOUND - 1) * sizeof *modes.residue);
    modes.pole[1] = 0.5 * (modes.pole[0] + modes.pole[2]);
    modes.n++;
    add_tip_mass(&model, 1e-3 * tip_kg);
    assert_true(fit(&model, &modes, 1.0, fitted) > 1.0);
    assert_true(fabs(model.effects[0].parameters[0].value / tip_kg - 1.0) < 0.02);
    assert_true(cabs(fitted[1]) == 0.0 && cabs(fitted[2]) > 0.0);
    measured_modes_free(&modes);
    model_free(&model);
}

/*
 * With mass and stiffness known. Samples that are taken further apart than the records say show every pole as so much larger, and the residues of an acceleration, too.
 */
static void a_wrong_clock_is_found_from_the_modes(void **state)
{
    (void)state;
    static const double relative = 0.01;
    struct model model = read_model(bare.EI_Nm2, 5e-5, 0.005);
    struct measured_modes modes = exact_modes(&bare);
    struct bf_error err;
    model.materials[0].EI.fixed = model.materials[0].rho.fixed = true;
    for (size_t k = 0; k < modes.n; k++)
        modes.pole[k] *= 1.0 + relative, modes.residue[k] *= 1.0 + relative;
    assert_int_equal(model_append_effect(&model, "clock_error", "", &err), BF_OK);
    model.effects[0].parameters[0].fixed = false;
    assert_true(fit(&model, &modes, 1.0, NULL) < 0.05);
    assert_true(fabs(model.effects[0].parameters[0].value - relative) < 1e-4);
    measured_modes_free(&modes);
    model_free(&model);
}

/* The free linear model's spare poles, tones that nothing damps and what lies above the band are no modes of a beam. */
static void only_modes_of_a_beam_are_taken(void **state)
{
    (void)state;
    static double nothing[512];
    struct attainable_pole poles[] = {{10.0, 0.01, 50.0}, {20.0, 0.01, 1.01}, {30.0, 1e-6, 50.0},
                                      {40.0, 0.5, 50.0},  {60.0, 0.02, NAN},  {90.0, 0.01, 50.0}};
    double complex residue[] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
    const struct attainable attainable = {
        .modes = 6, .noise_ratio = 1.0, .poles = poles, .n_outputs = 1, .n_inputs = 1, .residue = residue};
    struct record record = {.n = 512, .dt_s = 1.0 / 200.0, .path = strdup("test.csv")};
    record_add_column(&record, "accel_mps2", nothing);
    struct measured_modes modes = measured_modes_of(&attainable, &record, 1);
    assert_int_equal(modes.n, 2);
    assert_true(creal(modes.residue[0]) == 1.0 && creal(modes.residue[1]) == 5.0);
    assert_true(fabs(cabs(modes.pole[1]) / (2.0 * acos(-1.0) * 60.0) - 1.0) < 1e-12);
    assert_true(fabs(-creal(modes.pole[1]) / cabs(modes.pole[1]) - 0.02) < 1e-12);
    measured_modes_free(&modes);
    record_free(&record);
}

/* Compressed beyond its buckling load a beam has no modes: that is said, and the model stays as it was. */
static void a_model_that_has_no_modes_is_refused_and_kept(void **state)
{
    (void)state;
    const struct modal_options options = {0};
    struct model model = read_model(bare.EI_Nm2, bare.cDI_sNm2, bare.gamma_sNpm2);
    struct measured_modes modes = exact_modes(&bare);
    struct bf_error err;
    double left = -1.0;
    assert_int_equal(model_append_effect(&model, "axial_load", "", &err), BF_OK);
    model.effects[0].parameters[0].value = -100.0;
    assert_int_equal(refit_to_modes(&model, &modes, &options, &left, &err), BF_NUMERIC);
    assert_true(left == -1.0 && model.effects[0].parameters[0].value == -100.0);
    measured_modes_free(&modes);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_model_with_the_true_values_has_the_exact_modes),
        cmocka_unit_test(a_mass_is_found_from_the_modes_and_a_beam_without_it_leaves_much),
        cmocka_unit_test(a_mode_that_the_model_lacks_belongs_to_none_of_its_own),
        cmocka_unit_test(a_wrong_clock_is_found_from_the_modes),
        cmocka_unit_test(only_modes_of_a_beam_are_taken),
        cmocka_unit_test(a_model_that_has_no_modes_is_refused_and_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
