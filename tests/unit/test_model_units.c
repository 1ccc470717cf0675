/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/model.h"
#include "test_files.h"

enum { MOST = 8 };

/* Warnings about a beam of length, EI, rho, cDI, gamma. */
static size_t warned(double length_m, double EI, double rho, double cDI, double gamma, model_warning text[MOST])
{
    char yaml[512];
    struct model m;
    struct bf_error err = {0};
    (void)snprintf(
        yaml, sizeof yaml,
        "format: beamfit-model/1\nbeam: {length_m: %.9g}\nparameters: {EI_beam_Nm2: %.9g, rho_beam_kgpm: %.9g, "
        "cDI_beam_sNm2: %.9g, gamma_sNpm2: %.9g}\n",
        length_m, EI, rho, cDI, gamma);
    if (model_read_text("m", yaml, strlen(yaml), &m, &err) != BF_OK)
        fail_msg("%s", err.text);
    size_t n = model_unit_warnings(&m, text, MOST);
    model_free(&m);
    return n;
}

/* Beams of laboratories: nothing to say. */
static void ordinary_beams(void **state)
{
    (void)state;
    static const double beams[][5] = {
        {0.4573, 0.491, 0.093, 0.649e-5, 0.013}, /* the seed paper's aluminium */
        {0.759, 114.6, 2.044, 1e-4, 0.1},        /* steel 50.66 × 5.14 mm */
        {0.300, 1.06, 0.1057, 1e-5, 0.002},      /* aluminium 18.2 × 2.15 mm */
        {1.0, 0.2025, 0.107, 1e-6, 0.0},         /* acrylic ruler 30 × 3 mm */
        {0.1, 1.17e-4, 5.4e-3, 0.0, 1e-4},       /* aluminium foil 20 × 0.1 mm, 10 cm */
        {0.5, 6833.0, 7.85, 0.0, 0.0},           /* steel bar 50 × 20 mm */
        {3.0, 1708.0, 7.85, 0.0, 0.0},           /* steel strap 100 × 10 mm, 3 m */
    };
    model_warning text[MOST];
    for (size_t i = 0; i < sizeof beams / sizeof *beams; i++) {
        const double *b = beams[i];
        if (warned(b[0], b[1], b[2], b[3], b[4], text) != 0)
            fail_msg("beam %zu: %s", i, text[0]);
    }
}

static void assert_warned(size_t n, model_warning text[MOST], const char *word)
{
    if (n == 0)
        fail_msg("no warning about %s", word);
    assert_contains(text[0], word);
}

static void the_paper_s_beam_off_by_a_thousand(void **state)
{
    (void)state;
    model_warning text[MOST];
    assert_warned(warned(457.3, 0.491, 0.093, 0.649e-5, 0.013, text), text, "length_m");
    assert_warned(warned(0.4573, 491.0, 0.093, 0.649e-5, 0.013, text), text, "EI_beam_Nm2");
    assert_warned(warned(0.4573, 491e3, 0.093, 0.649e-5, 0.013, text), text, "EI_beam_Nm2"); /* N·mm² */
    assert_warned(warned(0.4573, 0.491e-3, 0.093, 0.649e-5, 0.013, text), text, "EI_beam_Nm2");
    assert_warned(warned(0.4573, 0.491, 93.0, 0.649e-5, 0.013, text), text, "rho_beam_kgpm");   /* g/m */
    assert_warned(warned(0.4573, 0.491, 2700.0, 0.649e-5, 0.013, text), text, "rho_beam_kgpm"); /* kg/m³ */
    assert_warned(warned(0.4573, 0.491, 0.093e-3, 0.649e-5, 0.013, text), text, "rho_beam_kgpm");
    assert_warned(warned(0.4573, 0.491, 0.093, 6.49, 0.013, text), text, "cDI_beam_sNm2"); /* N·mm²·s */
    assert_warned(warned(0.4573, 0.491, 0.093, 0.649e-5, 13.0, text), text, "gamma_sNpm2");
}

static void one_region_in_another_unit(void **state)
{
    (void)state;
    static const char yaml[] =
        "format: beamfit-model/1\nbeam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
        "parameters: {EI_beam_Nm2: 0.491, rho_beam_kgpm: 0.093, EI_patch_Nm2: 793, rho_patch_kgpm: 433}\n";
    struct model m;
    struct bf_error err = {0};
    model_warning text[MOST];
    assert_int_equal(model_read_text("m", yaml, strlen(yaml), &m, &err), BF_OK);
    assert_int_equal(model_unit_warnings(&m, text, MOST), 2);
    assert_contains(text[0], "EI_patch_Nm2");
    assert_contains(text[1], "rho_patch_kgpm");
    assert_int_equal(model_unit_warnings(&m, text, 1), 1); /* as many as there is room for */
    model_free(&m);
}

/* (βL)² of the uniform beam's first bending, by the equation of each support. */
static void the_first_mode_is_that_of_the_support(void **state)
{
    (void)state;
    static const double from[] = {1.5, 4.0, 2.5, 4.0}, to[] = {2.5, 5.0, 4.0, 5.0}; /* of βL */
    struct model m;
    struct bf_error err = {0};
    static const char text[] =
        "format: beamfit-model/1\nbeam: {length_m: 2}\nparameters: {EI_beam_Nm2: 3, rho_beam_kgpm: "
        "0.5, cDI_beam_sNm2: 1e-6, gamma_sNpm2: 0.01}\n";
    static const enum model_support supports[] = {SUPPORT_CLAMPED_FREE, SUPPORT_CLAMPED_CLAMPED, SUPPORT_PINNED_PINNED,
                                                  SUPPORT_FREE_FREE};
    assert_int_equal(model_read_text("m", text, strlen(text), &m, &err), BF_OK);
    for (int i = 0; i < 4; i++) {
        double low = from[i], high = to[i];
        for (int halving = 0; halving < 60; halving++) {
            const double x = 0.5 * (low + high), sign = i == 0 ? 1.0 : -1.0;
            const double f = i == 2 ? -sin(x) : cos(x) * cosh(x) + sign;
            const double f_low = i == 2 ? -sin(low) : cos(low) * cosh(low) + sign;
            *(f * f_low > 0.0 ? &low : &high) = x;
        }
        m.support = supports[i];
        const double omega = low * low / 4.0 * sqrt(3.0 / 0.5);
        assert_true(fabs(model_first_mode_radps(&m) / omega - 1.0) < 1e-6);
    }
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_mode_is_that_of_the_support),
        cmocka_unit_test(ordinary_beams),
        cmocka_unit_test(the_paper_s_beam_off_by_a_thousand),
        cmocka_unit_test(one_region_in_another_unit),
    };
    return cmocka_run_group_tests_name("model_units", tests, NULL, NULL);
}
