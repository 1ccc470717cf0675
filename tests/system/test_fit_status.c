/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a script learns from the status of fit: nothing was fitted, a record is on both sides; and that models say nothing wrong afterwards. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "ask.h"

/* The rig with the paper's record (of the independent simulator) and model in it. */
static int setup(void **state)
{
    if (rig_setup(state) != 0)
        return -1;
    must(*state, "cp \"$TOP\"/data/paper/b1tapih.csv hit.csv && cp \"$TOP\"/data/paper/b1tapih.yaml beam.yaml");
    return 0;
}

static void fit(struct rig *rig, int status, const char *said, const char *const words[])
{
    run_beamfit(rig->dir, words, &rig->outcome);
    if (rig->outcome.status != status || strstr(rig->outcome.err, said) == NULL)
        fail_msg("wanted status %d and '%s', got %d: %s", status, said, rig->outcome.status, rig->outcome.err);
}

static void a_zero_input_fits_nothing(void **state)
{
    struct rig *rig = *state;
    json_error_t error;
    must(rig, "awk -F, -v OFS=, '/^[0-9]/ {$2 = 0} {print}' hit.csv >zero.csv");
    fit(rig, 1, "nothing was fitted", (const char *[]){"fit", "beam.yaml", "zero.csv", "-o", "out.yaml", NULL});
    assert_non_null(strstr(rig->outcome.out, "zero.csv: every input is zero throughout"));
    assert_null(strstr(rig->outcome.out, "times its start value"));
    assert_int_equal(file_exists(rig->dir, "out.yaml"), 0);
    fit(rig, 1, "nothing was fitted",
        (const char *[]){"fit", "beam.yaml", "zero.csv", "-o", "out.yaml", "--json", NULL});
    json_t *root = json_loads(rig->outcome.out, 0, &error);
    assert_non_null(root);
    assert_true(json_is_false(json_object_get(root, "fitted")));
    const char *name;
    json_t *parameter, *parameters = json_object_get(root, "parameters");
    assert_true(json_object_size(parameters) > 2);
    json_object_foreach(parameters, name, parameter) if (json_number_value(json_object_get(parameter, "value")) !=
                                                         json_number_value(json_object_get(parameter, "start")))
        fail_msg("%s has moved", name);
    json_decref(root);
}

/* One driven record beside it is enough for a fit, and the silent one is named. */
static void a_zero_input_beside_a_hit(void **state)
{
    struct rig *rig = *state;
    must(rig, "awk -F, -v OFS=, '/^[0-9]/ {$2 = 0} {print}' hit.csv >zero.csv");
    fit(rig, 0, "", (const char *[]){"fit", "beam.yaml", "hit.csv", "zero.csv", "-o", "out.yaml", NULL});
    assert_non_null(strstr(rig->outcome.out, "zero.csv: every input is zero throughout"));
}

/* A prior is no measurement. */
static void a_prior_does_not_make_a_fit(void **state)
{
    struct rig *rig = *state;
    must(rig, "awk -F, -v OFS=, '/^[0-9]/ {$2 = 0} {print}' hit.csv >zero.csv\n"
              "sed -E 's/\\{value: ([0-9.e-]+)\\}/{value: \\1, prior: 0.01}/' beam.yaml >sure.yaml");
    fit(rig, 1, "nothing was fitted", (const char *[]){"fit", "sure.yaml", "zero.csv", "-o", "out.yaml", NULL});
}

static void everything_at_a_bound(void **state)
{
    struct rig *rig = *state;
    must(rig, "sed -E 's/\\{value: ([0-9.e-]+)\\}/{value: \\1, fixed: true}/; s/Ks_V:.*/Ks_V: {value: 40, min: 39, "
              "max: 41}/' "
              "beam.yaml >bound.yaml");
    fit(rig, 1, "nothing was fitted", (const char *[]){"fit", "bound.yaml", "hit.csv", "-o", "out.yaml", NULL});
    assert_non_null(strstr(rig->outcome.out, "at a bound"));
    assert_int_equal(file_exists(rig->dir, "out.yaml"), 0);
}

static void a_record_on_both_sides(void **state)
{
    struct rig *rig = *state;
    must(rig, "(echo '# another name, another remark'; cat hit.csv) >again.csv; ln -s hit.csv link.csv");
    static const char *const names[] = {"hit.csv", "link.csv", "again.csv"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        fit(rig, 2, "is held out, and has the content of hit.csv",
            (const char *[]){"fit", "beam.yaml", "hit.csv", "--check", names[i], "-o", "out.yaml", NULL});
        fit(rig, 2, "is held out, and has the content of hit.csv",
            (const char *[]){"diagnose", "beam.yaml", "hit.csv", "--check", names[i], NULL});
    }
    must(rig, "awk -F, -v OFS=, '/^0.5/ {$3 = 0} {print}' hit.csv >other.csv"); /* the same hit, another answer */
    fit(rig, 0, "", (const char *[]){"fit", "beam.yaml", "hit.csv", "--check", "other.csv", "-o", "out.yaml", NULL});
}

/* Comments of a model speak of what was before a fit as of that. */
static void comments_after_a_fit(void **state)
{
    struct rig *rig = *state;
    must(rig, "\"$BEAMFIT\" init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input "
              "hammer_N=point_force@0.0254 --output piezo_V=patch_strain -o mine.yaml");
    fit(rig, 0, "", (const char *[]){"fit", "mine.yaml", "hit.csv", "-o", "out.yaml", NULL});
    must(rig, "grep -q 'before a fit: ' out.yaml && ! grep -Eiq '#.*(guess|start)' out.yaml");
    fit(rig, 0, "", (const char *[]){"fit", "beam.yaml", "hit.csv", "-o", "paper.yaml", NULL});
    must(rig, "! grep -Eiq 'guess|before any fit' paper.yaml");
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, setup, rig_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(a_zero_input_fits_nothing), CASE(a_zero_input_beside_a_hit), CASE(a_prior_does_not_make_a_fit),
        CASE(everything_at_a_bound),     CASE(a_record_on_both_sides),    CASE(comments_after_a_fit),
    };
    return cmocka_run_group_tests_name("status of fit", tests, NULL, NULL);
}
