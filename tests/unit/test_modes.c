/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What `modes` prints: frequencies, damping, the errors of the small spaces, shapes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "exact_beam.h"
#include "model_fixture.h"
#include "beam/beam.h"

enum { MODES = 6, POINTS = 201 };

static struct modes compute(const struct model *model, size_t n, double band_Hz)
{
    struct modes modes;
    struct bf_error err;
    if (modes_compute(model, n, band_Hz, POINTS, &modes, &err) != BF_OK)
        fail_msg("%s", err.text);
    return modes;
}

static void errors_of_the_small_spaces(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct modes modes = compute(&model, MODES, 0.0);
    assert_int_equal(modes.deployed_modes + modes.deployed_statics, 10);
    assert_true(modes.in_band >= 5);
    for (size_t k = 0; k < modes.in_band; k++)
        assert_true(fabs(modes.mode[k].deployed_error) < 1e-6);
    assert_true(fabs(modes.mode[0].uniform_error - 0.0051) < 5e-5); /* +0.51 % */
    assert_true(fabs(modes.mode[1].uniform_error - 0.0030) < 5e-5); /* +0.30 % */
    for (size_t k = 0; k < MODES; k++)
        assert_true(modes.mode[k].uniform_error > 0.0); /* Rayleigh and Ritz: from above */
    assert_true(modes.convergence < 1e-6);
    modes_free(&modes);
    model_free(&model);
}

static void band_limits_what_must_be_right(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct modes modes = compute(&model, MODES, 100.0);
    assert_int_equal(modes.in_band, 3); /* 6.6, 38.4, 95.5 Hz */
    modes_free(&modes);
    model_free(&model);
}

static void make_uniform(struct model *model, double EI, double rho, double cDI, double gamma)
{
    for (size_t m = 0; m < model->n_materials; m++) {
        model->materials[m].EI.value = EI;
        model->materials[m].rho.value = rho;
        model->materials[m].cDI.value = cDI;
    }
    model->gamma.value = gamma;
}

/* ρ q'' + (γ + cDI β⁴) q' + EI β⁴ q = 0: ζ = (γ/ρ + cDI β⁴/ρ)/(2ω), ω² = EI β⁴/ρ. */
static void damping_of_a_uniform_beam(void **state)
{
    (void)state;
    const double EI = 0.5, rho = 0.1, cDI = 2e-5, gamma = 0.02;
    struct model model;
    fixture_model(&model, "");
    make_uniform(&model, EI, rho, cDI, gamma);
    struct modes modes = compute(&model, MODES, 0.0);
    for (int k = 0; k < MODES; k++) {
        double b = exact_uniform_root(0, k) / model.length_m, omega = b * b * sqrt(EI / rho);
        double ratio = (gamma / rho + cDI * b * b * b * b / rho) / (2.0 * omega);
        assert_true(fabs(modes.mode[k].undamped_Hz * 2.0 * acos(-1.0) / omega - 1.0) < 1e-6);
        assert_true(fabs(modes.mode[k].frequency_Hz / modes.mode[k].undamped_Hz - 1.0) < 1e-9); /* |p| = ω */
        if (fabs(modes.mode[k].damping_ratio / ratio - 1.0) > 1e-5)
            fail_msg("mode %d: ratio %.9g, exact %.9g", k + 1, modes.mode[k].damping_ratio, ratio);
    }
    modes_free(&modes);
    model_free(&model);
}

/* cos cosh shapes of the cantilever. */
static void shapes_of_a_uniform_cantilever(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    make_uniform(&model, 0.5, 0.1, 1e-5, 0.01);
    struct modes modes = compute(&model, 3, 0.0);
    for (int k = 0; k < 3; k++) {
        double z = exact_uniform_root(0, k), ratio = (cosh(z) + cos(z)) / (sinh(z) + sin(z)), tip = 0.0;
        for (int i = POINTS - 1; i >= 0; i--) {
            double x = z * (double)i / (double)(POINTS - 1);
            double y = cosh(x) - cos(x) - ratio * (sinh(x) - sin(x));
            tip = i == POINTS - 1 ? y : tip;
            assert_true(fabs(modes.x_m[i] - model.length_m * (double)i / (double)(POINTS - 1)) < 1e-12);
            assert_true(fabs(modes.shape[k * POINTS + i] - y / tip) < 1e-5); /* largest at the tip */
        }
    }
    modes_free(&modes);
    model_free(&model);
}

static void rigid_motions_of_a_free_beam(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    make_uniform(&model, 0.5, 0.1, 1e-5, 0.01);
    model.support = SUPPORT_FREE_FREE;
    struct modes modes = compute(&model, 5, 0.0);
    double b = exact_uniform_root(SUPPORT_FREE_FREE, 0) / model.length_m;
    assert_true(modes.mode[1].undamped_Hz < 1e-2 * modes.mode[2].undamped_Hz);
    assert_true(fabs(modes.mode[2].undamped_Hz * 2.0 * acos(-1.0) / (b * b * sqrt(5.0)) - 1.0) < 1e-6);
    modes_free(&modes);
    model_free(&model);
}

static void impossible_models_are_refused(void **state)
{
    (void)state;
    struct model model;
    struct modes modes;
    struct bf_error err;
    fixture_model(&model, "");
    model.materials[0].EI.value = -1.0;
    assert_int_equal(modes_compute(&model, 4, 0.0, 11, &modes, &err), BF_NUMERIC);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_of_the_small_spaces),   cmocka_unit_test(band_limits_what_must_be_right),
        cmocka_unit_test(damping_of_a_uniform_beam),    cmocka_unit_test(shapes_of_a_uniform_cantilever),
        cmocka_unit_test(rigid_motions_of_a_free_beam), cmocka_unit_test(impossible_models_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
