/* SPDX-License-Identifier: GPL-3.0-or-later */
/* When the rig is freed: at once where what a ruler and a gauge may be wrong by explains the records, else after single effects. */
#include "diagnose_rig.h"

/* The sensor is nearer to the clamp than the file says: by what a ruler may be wrong, and by ten times that. */
static void a_rig_that_nobody_would_believe_comes_after_single_effects(void **state)
{
    (void)state;
    static const char *const none[] = {NULL};
    static const double off_m[] = {0.004, 0.02};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new("", 2, LONG, 0.01, none);
        struct bf_error err;
        bool freed;
        b->given.outputs[1].at_m = b->given.outputs[1].own.at.value = 0.39 - off_m[i];
        struct diagnose_state w = begun(b);
        assert_true(b->d.baseline.fitted.noise_ratio > 1.5);
        assert_int_equal(diagnose_free_rig(&w, true, &freed, &err), BF_OK);
        assert_int_equal(freed, i == 0);
        if (i == 1)
            assert_int_equal(diagnose_free_rig(&w, false, &freed, &err), BF_OK);
        assert_true(freed && b->d.baseline.fitted.noise_ratio < 1.1);
        assert_true(fabs(b->d.baseline.model.outputs[1].at_m - 0.39) < 5e-4);
        diagnose_side_free(&w.other);
        state_free(&w);
        bench_free(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rig_that_nobody_would_believe_comes_after_single_effects),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
