/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A set that grew from one effect, and another effect that does as much alone. */
#include "diagnose_rig.h"

static struct refit_job job_of(const char *effects, size_t n_effects)
{
    return (struct refit_job){.model = make(effects), .n_effects = n_effects};
}

static const struct hypothesis *pair(const struct diagnosis *d, const char *one, const char *other)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        if (h->n_effects == 2 && (strcmp(h->effects[0]->id, one) == 0 || strcmp(h->effects[1]->id, one) == 0) &&
            (strcmp(h->effects[0]->id, other) == 0 || strcmp(h->effects[1]->id, other) == 0))
            return h;
    }
    return NULL;
}

/*
 * A spring and a slow sensor; tension and the slow sensor have been found. Alone the spring scores less than tension (it is said to), as a spring would that stands for the
 * sensor, too: it is tried beside the sensor's lag where it leaves as much as tension, and is not where it leaves a tenth more.
 */
static void what_takes_as_much_alone_is_tried_in_the_set(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_spring", "axial_load", "sensor_lag", NULL};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new("{kind: point_spring, stiffness_Npm: 20, damping_Nspm: 0.001, at_m: 0.2}, "
                                    "{kind: sensor_lag, channel: piezo_V, tau_s: 0.001}",
                                    2, LONG, 0.004, ids);
        struct diagnose_state w = begun(b);
        struct bf_error err;
        struct refit_job jobs[] = {
            job_of("{kind: axial_load, force_N: 1}", 1),
            job_of("{kind: point_spring, stiffness_Npm: 20, damping_Nspm: 0.001, at_m: 0.15}", 1),
            job_of("{kind: axial_load, force_N: 1}, {kind: sensor_lag, channel: piezo_V, tau_s: 0.001}", 2)};
        diagnose_refits(&w, jobs, 3, 0.0);
        diagnose_rank(&b->d, 3);
        assert_non_null(pair(&b->d, "axial_load", "sensor_lag"));
        assert_int_equal(b->d.hypotheses[0].n_effects, 2);
        struct hypothesis *tension = &b->d.hypotheses[single(&b->d, "axial_load") - b->d.hypotheses],
                          *spring = &b->d.hypotheses[single(&b->d, "point_spring") - b->d.hypotheses];
        tension->explained = 0.5;
        spring->score = tension->score - 10.0;
        spring->fitted.noise_ratio = (i == 0 ? 1.0 : 1.1) * tension->fitted.noise_ratio;
        assert_int_equal(diagnose_exchange(&w, &err), BF_OK);
        const struct hypothesis *found = pair(&b->d, "point_spring", "sensor_lag");
        assert_int_equal(found != NULL, i == 0);
        if (found != NULL)
            assert_true(found->fitted.noise_ratio < 1.05);
        state_free(&w);
        bench_free(b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_takes_as_much_alone_is_tried_in_the_set),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
