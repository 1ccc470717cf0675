/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The attainable floor of records of another simulator: causes that are linear leave it at the noise, the others do not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include "noise/noise.h"
#include "test_files.h"

enum { CASE_RECORDS = 4 };

static struct attainable of_case(const char *name, const char *model_name)
{
    struct model model;
    struct record records[CASE_RECORDS];
    struct attainable a = {0};
    struct bf_error err;
    char path[128];
    (void)snprintf(path, sizeof path, "data/open/%s/%s", name, model_name);
    char *file = shared_file(path);
    if (file == NULL)
        skip();
    assert_int_equal(model_read(file, &model, &err), BF_OK);
    free(file);
    for (size_t r = 0; r < CASE_RECORDS; r++) {
        (void)snprintf(path, sizeof path, "data/open/%s/train%zu.csv", name, r + 1);
        file = shared_file(path);
        assert_non_null(file);
        assert_int_equal(record_read(file, &records[r], &err), BF_OK);
        free(file);
    }
    assert_int_equal(attainable_find(&model, records, CASE_RECORDS, NULL, &a, &err), BF_OK);
    for (size_t r = 0; r < CASE_RECORDS; r++)
        record_free(&records[r]);
    model_free(&model);
    return a;
}

static void linear_causes_end_at_the_noise(void **state)
{
    (void)state;
    static const char *const names[] = {"o0_clean", "o1_tip_mass", "o2_root_compliance", "o4_sensor_highpass",
                                        "o7_viscoelastic"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct attainable a = of_case(names[i], "model.yaml");
        if (!(fabs(a.noise_ratio - 1.0) < 0.05))
            fail_msg("%s: %.3f times the noise", names[i], a.noise_ratio);
        attainable_free(&a);
    }
}

/* most: what a fit of the beam's own model leaves (beamfit fit), which the floor must not exceed. */
static void nonlinear_causes_do_not(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double most;
    } cases[] = {{"o3_quadratic_drag", 0.149}, {"o5_coulomb_friction", 0.289}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct attainable a = of_case(cases[i].name, "model.yaml");
        if (!(a.noise_ratio > 10.0) || !(a.nrmse < cases[i].most))
            fail_msg("%s: %.3f times the noise, error %.4f", cases[i].name, a.noise_ratio, a.nrmse);
        attainable_free(&a);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_causes_end_at_the_noise),
        cmocka_unit_test(nonlinear_causes_do_not),
    };
    return cmocka_run_group_tests_name("attainable, open cases", tests, NULL, NULL);
}
