/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model.h"
#include "model/laminate.h"
#include "test_files.h"

static const struct layer paper_beam = {73e9, 2700.0, 0.0203, 0.0016}, paper_patch = {63e9, 7650.0, 0.0203, 0.000254};

/* Eq. 30 with the paper's dimensions, worked out by hand: 0.5058 and 1.0676 N·m². */
static void the_paper_s_stiffness(void **state)
{
    (void)state;
    assert_true(fabs(laminate_EI(&paper_beam, &paper_patch, 0) - 0.5058) < 5e-5);
    assert_true(fabs(laminate_EI(&paper_beam, &paper_patch, 2) - 1.0676) < 5e-5);
}

/* EI = ∫ E w z² dz − (∫ E w z dz)²/∫ E w dz by brute force. */
static double EI_by_slices(const struct layer *beam, const struct layer *patch, int sides)
{
    double low = -0.5 * beam->thickness_m - (sides == 2 ? patch->thickness_m : 0.0);
    double high = 0.5 * beam->thickness_m + (sides >= 1 ? patch->thickness_m : 0.0);
    double a = 0.0, b = 0.0, c = 0.0, dz = (high - low) / 1e6;
    for (int i = 0; i < 1000000; i++) {
        double z = low + (i + 0.5) * dz;
        const struct layer *layer = fabs(z) < 0.5 * beam->thickness_m ? beam : patch;
        double Ew = layer->E_Pa * layer->width_m * dz;
        a += Ew;
        b += Ew * z;
        c += Ew * z * z;
    }
    return c - b * b / a;
}

static void laminates_by_slices(void **state)
{
    (void)state;
    const struct layer thick = {10e9, 1000.0, 0.01, 0.002};
    for (int sides = 0; sides <= 2; sides++) {
        double slices = EI_by_slices(&paper_beam, &thick, sides);
        assert_true(fabs(laminate_EI(&paper_beam, &thick, sides) / slices - 1.0) < 1e-5);
    }
    double rho = laminate_rho(&paper_beam, &paper_patch, 2); /* eq. 31 */
    assert_true(fabs(rho - (2700.0 * 0.0203 * 0.0016 + 2 * 7650.0 * 0.0203 * 0.000254)) < 1e-12);
}

static struct starting_beam paper(void)
{
    static const struct model_input input = {.name = "hammer_N", .kind = INPUT_POINT_FORCE, .at_m = 0.0254};
    static const struct model_output output = {.name = "piezo_V", .kind = OUTPUT_PATCH_STRAIN};
    return (struct starting_beam){.length_m = 0.4573,
                                  .beam = paper_beam,
                                  .patch = paper_patch,
                                  .beam_material = "aluminium",
                                  .patch_material = "piezo",
                                  .n_patches = 1,
                                  .patch_m = {{0.02535, 0.08905}},
                                  .patch_sides = 2,
                                  .n_inputs = 1,
                                  .n_outputs = 1,
                                  .inputs = &input,
                                  .outputs = &output};
}

static void the_text_is_the_model(void **state)
{
    (void)state;
    struct starting_beam beam = paper();
    struct model m;
    struct bf_error err = {0};
    model_warning warning[4];
    char *text = starting_model_text(&beam);
    if (model_read_text("new", text, strlen(text), &m, &err) != BF_OK)
        fail_msg("%s\n%s", err.text, text);
    assert_int_equal(model_unit_warnings(&m, warning, 4), 0);
    assert_true(m.length_m == 0.4573 && m.regions[1].to_m == 0.08905 && m.inputs[0].at_m == 0.0254);
    assert_true(fabs(model_material(&m, "patch")->EI.value / 1.0676 - 1.0) < 1e-3);
    assert_true(fabs(model_material(&m, "patch")->rho.value / laminate_rho(&paper_beam, &paper_patch, 2) - 1.0) < 1e-3);
    assert_true(m.materials[0].EI.prior > 0.0 && !m.materials[0].EI.fixed && !m.Ks.fixed && m.KB.fixed);
    model_free(&m);
    for (char *rest, *line = strtok_r(text, "\n", &rest); line;
         line = strtok_r(NULL, "\n", &rest)) /* every number has its unit beside it */
        if (strstr(line, "value:") && !strstr(line, "} "))
            fail_msg("no comment: %s", line);
    free(text);
}

static void a_weighed_beam(void **state)
{
    (void)state;
    struct starting_beam beam = paper();
    struct model m;
    struct bf_error err = {0};
    beam.mass_kg = 0.045;
    char *text = starting_model_text(&beam);
    assert_int_equal(model_read_text("new", text, strlen(text), &m, &err), BF_OK);
    const struct material *bare = model_material(&m, "beam"), *patch = model_material(&m, "patch");
    assert_true(fabs(bare->rho.value - 0.045 / 0.4573) < 1e-5);
    assert_true(fabs(patch->rho.value - bare->rho.value - 2 * 7650.0 * 0.0203 * 0.000254) < 1e-4);
    assert_true(bare->rho.prior < 0.02);
    free(text);
    model_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_paper_s_stiffness),
        cmocka_unit_test(laminates_by_slices),
        cmocka_unit_test(the_text_is_the_model),
        cmocka_unit_test(a_weighed_beam),
    };
    return cmocka_run_group_tests_name("starting_model", tests, NULL, NULL);
}
