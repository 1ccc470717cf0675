/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A special case of the best explanation, refitted from its values. */
#include "diagnose_rig.h"
#include "ground/ground.h"

/* As the diagnosis itself is when the general effect has been found, and every effect may be tried. */
static struct diagnose_state state_of(struct bench *b, struct diagnose_options *options)
{
    struct diagnose_state w = {.d = &b->d, .options = options, .predict = &options->predict, .threads = 1};
    struct bf_error err;
    w.sigma = calloc(b->d.n_channels, sizeof *w.sigma);
    w.whiteners = calloc(b->d.n_channels, sizeof *w.whiteners);
    for (size_t c = 0; c < b->d.n_channels; c++) {
        w.sigma[c] = b->d.noise[c].rms;
        assert_int_equal(whitener_from_noise(&b->d.noise[c], &w.whiteners[c], &err), BF_OK);
    }
    return w;
}

/* Only the general effect was looked at; its special case then ends where it does, with one parameter less, and is asked for once. */
static void assert_found(const char *truth, const char *general, const char *special)
{
    const char *const ids[] = {general, NULL};
    struct bench *b = bench_new(truth, 2, LONG, 0.003, ids);
    struct diagnose_options options = {.quiet = true, .predict = {.quiet = true}};
    diagnose(b, 2, 0);
    assert_non_null(single(&b->d, general));
    assert_null(single(&b->d, special));
    struct diagnose_state w = state_of(b, &options);
    diagnose_special_cases(&w);
    assert_non_null(single(&b->d, special));
    const double least = single(&b->d, general)->fitted.noise_ratio;
    assert_true(fabs(single(&b->d, special)->fitted.noise_ratio - least) < 2e-3 * least);
    assert_true(single(&b->d, special)->score > single(&b->d, general)->score);
    const size_t n = b->d.n_hypotheses, evaluations = b->d.evaluations;
    diagnose_special_cases(&w);
    assert_int_equal(b->d.n_hypotheses, n);
    assert_int_equal(b->d.evaluations, evaluations);
    free(w.sigma), free(w.whiteners);
    bench_free(b);
}

static void a_mass_at_the_free_end_is_a_tip_mass(void **state)
{
    (void)state;
    assert_found("{kind: tip_mass, mass_kg: 0.003}", "point_mass", "tip_mass");
}

static void a_spring_without_stiffness_is_a_damper(void **state)
{
    (void)state;
    assert_found("{kind: point_damper, damping_Nspm: 0.1, at_m: 0.25}", "point_spring", "point_damper");
}

/* The best explanation of these two effects; NULL: there is none. */
static const struct hypothesis *pair(const struct diagnosis *d, const char *one, const char *other)
{
    for (size_t i = 0; i < d->n_hypotheses; i++) {
        const struct hypothesis *h = &d->hypotheses[i];
        const bool first = h->n_effects == 2 && strcmp(h->effects[0]->id, one) == 0;
        if (first ? strcmp(h->effects[1]->id, other) == 0
                  : h->n_effects == 2 && strcmp(h->effects[1]->id, one) == 0 && strcmp(h->effects[0]->id, other) == 0)
            return h;
    }
    return NULL;
}

static void a_member_of_a_set_has_a_special_case(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "sensor_lag", NULL};
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.002}, {kind: sensor_lag, tau_s: 4e-3, channel: tip_mps}",
                                2, LONG, 0.003, ids);
    struct diagnose_options options = {.quiet = true, .predict = {.quiet = true}};
    diagnose(b, 2, 0);
    const struct hypothesis *general = pair(&b->d, "point_mass", "sensor_lag");
    assert_non_null(general);
    const double least = general->fitted.noise_ratio, score = general->score;
    struct diagnose_state w = state_of(b, &options);
    diagnose_special_sets(&w);
    const struct hypothesis *special = pair(&b->d, "tip_mass", "sensor_lag");
    assert_non_null(special);
    assert_true(fabs(special->fitted.noise_ratio - least) < 2e-3 * least);
    assert_true(special->score > score);
    free(w.sigma), free(w.whiteners);
    bench_free(b);
}

/* A slow sensor and one that forgets share their time constant: what one has found is where the other is refitted from, in the same channel. */
static void a_sensor_that_forgets_has_a_slow_twin(void **state)
{
    (void)state;
    static const char *const ids[] = {"sensor_highpass", NULL};
    struct bench *b = bench_new("{kind: sensor_lag, tau_s: 4e-3, channel: tip_mps}", 2, LONG, 0.003, ids);
    struct diagnose_options options = {.quiet = true, .predict = {.quiet = true}};
    diagnose(b, 1, 0);
    assert_null(single(&b->d, "sensor_lag"));
    const struct hypothesis *leaks = single(&b->d, "sensor_highpass");
    assert_non_null(leaks);
    char channel[MODEL_NAME];
    (void)snprintf(channel, sizeof channel, "%s", leaks->model.effects[leaks->n_base].channel);
    struct diagnose_state w = state_of(b, &options);
    diagnose_special_cases(&w);
    const struct hypothesis *twin = single(&b->d, "sensor_lag");
    assert_non_null(twin);
    assert_string_equal(twin->model.effects[twin->n_base].channel, channel);
    free(w.sigma), free(w.whiteners);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mass_at_the_free_end_is_a_tip_mass),
        cmocka_unit_test(a_spring_without_stiffness_is_a_damper),
        cmocka_unit_test(a_member_of_a_set_has_a_special_case),
        cmocka_unit_test(a_sensor_that_forgets_has_a_slow_twin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
