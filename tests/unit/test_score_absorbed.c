/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the baseline itself can absorb of a misfit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "estimate/score_base.h"
#include "score_rig.h"

static void a_vanished_damping_comes_back(void **state)
{
    (void)state;
    struct rig r;
    seed = 41;
    rig_records(&r);
    r.model.materials[0].cDI.value = 1e-13; /* the beam has 2e-5 */
    rig_score(&r, NULL);
    struct model start;
    struct bf_error err;
    double freedom;
    const size_t i = index_of(&r, "axial_load");
    assert_true(r.base->white_misfit > 1.2 * CHANNELS * SAMPLES);
    assert_true(score_base_misfit(r.base, &freedom) < 0.9 * r.base->white_misfit);
    assert_int_equal(score_model(r.base, &r.list.candidates[i], &r.scores[i], &start, &err), BF_OK);
    assert_true(start.materials[0].cDI.value > 0.05 * truth.cDI && start.materials[0].cDI.value < 3.0 * truth.cDI);
    model_free(&start);
    rig_free(&r);
}

static void free_states_of_a_decay_are_absorbed(void **state)
{
    (void)state;
    struct rig r;
    seed = 42;
    rig_records(&r);
    rig_effect(&r, "tip_mass", (const double[]){2e-4}, 1);
    for (size_t i = 0; i < RECORDS; i++) {
        record_add_meta(&r.records[i], "excitation", "free_decay");
        record_add_meta(&r.records[i], "free_from_s", "0.2");
    }
    rig_fit(&r);
    rig_score(&r, &(struct candidate_options){.without = (const char *const[]){"base_motion"}, .n_without = 1});
    double freedom;
    assert_true(score_base_misfit(r.base, &freedom) < 50.0 * freedom);
    const struct score *mass = &r.scores[index_of(&r, "tip_mass")];
    assert_true(mass->possible);
    assert_true(mass->explained > 0.8);
    rig_free(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_vanished_damping_comes_back),
        cmocka_unit_test(free_states_of_a_decay_are_absorbed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
