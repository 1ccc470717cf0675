/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a free linear model leaves, beside what is known of the noise: what an explanation is held against, and when a beam is complete. */
#include "invented_refits.h"

/* A noise that was judged too large does not end the search at what comes down to it: a free linear model tells. */
static void the_noise_explains_nothing_where_a_linear_model_leaves_less(void **state)
{
    static const double floors[] = {0.98, 0.7};
    struct diagnosis d;
    struct hypothesis h[] = {refit("axial_load", NULL, 1, 0.96, 1.0)};
    decide(&d, *state, 13.0, 31.0, h, 1);
    assert_true(d.hypotheses[0].explains);
    assert_true(diagnose_explained(&d, 1)); /* no linear model was fitted */
    for (int i = 0; i < 2; i++) {
        d.attainable = (struct attainable){.modes = 4, .nrmse = 0.01, .noise_ratio = floors[i]};
        assert_true(diagnose_explained(&d, 1) == (i == 0));
    }
    done(&d);
}

static void records_that_pass_for_nonlinear_may_be_linear(void **state)
{
    (void)state;
    struct diagnosis d = {.linearity.verdict = LINEARITY_NONLINEAR,
                          .attainable = {.modes = 4, .nrmse = 0.1, .noise_ratio = 1.3}};
    assert_false(diagnose_linear_is_out(&d));
    d.attainable.noise_ratio = 5.0;
    assert_true(diagnose_linear_is_out(&d));
    d.linearity.verdict = LINEARITY_LINEAR;
    assert_false(diagnose_linear_is_out(&d));
}

/* As good as any linear model, and the records are those of a linear beam: the estimate of the noise was too low. */
static void a_beam_at_the_attainable_error_is_complete(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 1.79, 1.8)};
    decide(&d, *state, 1.8, 1.8, h, 1);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    d.baseline.fitted.nrmse = 0.0101;
    d.attainable = (struct attainable){.modes = 7, .nrmse = 0.01};
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_COMPLETE);
    d.linearity.verdict = LINEARITY_NONLINEAR;
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    d.linearity.verdict = LINEARITY_LINEAR;
    d.baseline.fitted.noise_ratio = 4.0; /* nobody misjudges the noise by that much */
    diagnose_decide(&d);
    assert_int_equal(d.verdict, VERDICT_UNKNOWN);
    done(&d);
}

/* Six channels, each above a level that is known to 1 or to 30 %: together to 0.8 or 24 %, at two standard errors. */
static void what_the_level_of_the_noise_leaves_open_is_not_missing(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 1.19, 1.19)};
    decide(&d, *state, 1.2, 1.2, h, 1);
    assert_false(diagnose_is_complete(&d));
    for (size_t c = 0; c < CHANNELS; c++)
        d.baseline.fitted.doubt[c] = 0.6;
    assert_true(diagnose_is_complete(&d));
    d.baseline.fitted.worst_ratio = 1.4; /* one channel, its own doubt taken off */
    assert_false(diagnose_is_complete(&d));
    done(&d);
}

/* Six channels at the noise, of which a free linear model takes a part: more than is doubted of its level, or less. */
static void a_floor_within_what_is_doubted_of_the_noise_is_doubtful(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("tip_mass", NULL, 1, 0.96, 0.96)};
    decide(&d, *state, 0.97, 0.97, h, 1);
    d.attainable = (struct attainable){.modes = 6, .noise_ratio = 0.84};
    assert_false(diagnose_floor_is_doubtful(&d));
    for (size_t c = 0; c < CHANNELS; c++)
        d.baseline.fitted.doubt[c] = 0.5;
    assert_true(diagnose_floor_is_doubtful(&d));
    d.baseline.fitted.noise_ratio = 1.03;
    assert_false(diagnose_floor_is_doubtful(&d));
    done(&d);
}

/* The floor is told by the signal then: as much of it as the baseline leaves is what the baseline leaves in units of what stands for the noise. */
static void a_linear_model_is_the_floor_where_no_noise_is_known(void **state)
{
    struct diagnosis d;
    struct hypothesis h[] = {refit("cubic_stiffness", NULL, 1, 12.0, 12.0)};
    decide(&d, *state, 156.0, 156.0, h, 1);
    d.baseline.fitted.nrmse = 0.156;
    d.attainable = (struct attainable){.modes = 4, .nrmse = 0.154, .noise_ratio = NAN};
    assert_true(fabs(diagnose_floor(&d) - 154.0) < 1e-9);
    d.attainable.noise_ratio = 3.0;
    assert_true(fabs(diagnose_floor(&d) - 3.0) < 1e-12);
    done(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_noise_explains_nothing_where_a_linear_model_leaves_less),
        cmocka_unit_test(records_that_pass_for_nonlinear_may_be_linear),
        cmocka_unit_test(a_beam_at_the_attainable_error_is_complete),
        cmocka_unit_test(what_the_level_of_the_noise_leaves_open_is_not_missing),
        cmocka_unit_test(a_floor_within_what_is_doubted_of_the_noise_is_doubtful),
        cmocka_unit_test(a_linear_model_is_the_floor_where_no_noise_is_known),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
