/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A mode that no bending beam has: found where nothing simpler explains the records, and not even tried where something does. */
#include "diagnose_rig.h"
#include "beam/beam.h"
#include "show/diagnose_next.h"

static bool was_tried(const struct diagnosis *d)
{
    for (size_t i = 0; i < d->n_hypotheses; i++)
        for (size_t e = 0; e < d->hypotheses[i].n_effects; e++)
            if (effect_has_own(d->hypotheses[i].effects[e]))
                return true;
    return false;
}

static void an_absorber_is_found_with_its_values(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "point_spring", "attached_resonator", NULL};
    struct bench *b =
        bench_new("{kind: attached_resonator, mass_kg: 0.001, frequency_Hz: 25, damping_ratio: 0.03, at_m: 0.3}", 2,
                  LONG, 0.004, ids);
    diagnose(b, 2, 0);
    assert_true(b->d.baseline.fitted.noise_ratio > 20.0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(b->d.n_named, 1);
    assert_string_equal(b->d.named[0], "attached_resonator");
    const struct hypothesis *best = &b->d.hypotheses[0];
    const struct parameter *p = best->model.effects[0].parameters;
    assert_true(best->explained > 0.995);
    assert_true(fabs(p[0].value - 0.001) < 2e-5);
    assert_true(fabs(p[1].value - 25.0) < 0.1);
    assert_true(fabs(p[2].value - 0.03) < 1.5e-3);
    assert_true(fabs(p[3].value - 0.3) < 2e-3);
    bench_free(b);
}

/* Half as heavy as the beam. */
static struct bench *with_heavy_absorber(void)
{
    static const char *const ids[] = {"point_mass", "attached_resonator", NULL};
    return bench_new("{kind: attached_resonator, mass_kg: 0.02, frequency_Hz: 60, damping_ratio: 0.01, at_m: 0.2}", 2,
                     LONG, 0.004, ids);
}

/* Half as heavy as the beam, so that it has moved every mode and ruined the baseline: found by way of the modes. */
static void what_is_heavy_is_found(void **state)
{
    (void)state;
    struct bench *b = with_heavy_absorber();
    diagnose(b, 1, 0);
    const struct hypothesis *found = &b->d.hypotheses[0];
    const struct parameter *p = found->model.effects[0].parameters;
    assert_true(b->d.baseline.fitted.noise_ratio > 20.0);
    assert_string_equal(found->effects[0]->id, "attached_resonator");
    assert_true(found->fitted.noise_ratio < 1.05);
    assert_true(fabs(p[0].value - 0.02) < 4e-4);
    assert_true(fabs(p[1].value - 60.0) < 0.3);
    assert_true(fabs(p[3].value - 0.2) < 2e-3);
    bench_free(b);
}

/* Of what swings and of the beam two modes are predicted where a free linear model that does as well has none: mass and place were chosen to fit the others. */
static void what_hides_two_modes_is_dropped(void **state)
{
    (void)state;
    for (int hidden = 1; hidden <= 2; hidden++) {
        struct bench *b = with_heavy_absorber();
        struct diagnose_state w = begun(b);
        struct bf_error err;
        struct attainable_pole poles[DIAGNOSE_MODES] = {{0}};
        double mode_Hz[DIAGNOSE_MODES];
        size_t n;
        assert_int_equal(diagnose_modes_in_band(&b->d, &b->truth, mode_Hz, &n, &err), BF_OK);
        assert_true(n > 4);
        for (size_t m = (size_t)hidden; m < n; m++)
            poles[m] = (struct attainable_pole){
                .frequency_Hz = mode_Hz[m], .damping_ratio = 0.01, .without_noise_ratio = HUGE_VAL};
        b->d.attainable = (struct attainable){.modes = n, .poles = poles, .noise_ratio = 1.0};
        assert_int_equal(diagnose_resonator(&w, &err), BF_OK);
        assert_int_equal(was_tried(&b->d), hidden == 1);
        b->d.attainable = (struct attainable){0};
        state_free(&w);
        bench_free(b);
    }
}

/*
 * The free linear model has the modes of the best explanation, or one more, or with it a tone, which nothing damps, or a spare pole, which does nothing; or it has those
 * modes and leaves more than the noise of records that agree with a linear beam, so that it lacks one itself.
 */
static void nothing_is_looked_for_where_no_mode_is_missing(void **state)
{
    (void)state;
    static const double damping_ratio[] = {-1.0, 0.01, 0.0, 0.01, -1.0}; /* of the one more; −1: there is none */
    static const double without[] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, 1.0, HUGE_VAL}, floors[] = {1.0, 1.0, 1.0, 1.0, 1.3};
    for (int i = 0; i < 5; i++) {
        struct bench *b = with_heavy_absorber();
        struct diagnose_state w = begun(b);
        struct bf_error err;
        struct attainable_pole poles[DIAGNOSE_MODES + 1] = {{0}};
        double mode_Hz[DIAGNOSE_MODES];
        size_t n;
        assert_int_equal(diagnose_modes_in_band(&b->d, &b->d.baseline.model, mode_Hz, &n, &err), BF_OK);
        assert_true(n > 2);
        for (size_t m = 0; m < n; m++)
            poles[m] = (struct attainable_pole){
                .frequency_Hz = mode_Hz[m], .damping_ratio = 0.01, .without_noise_ratio = HUGE_VAL};
        poles[n] = (struct attainable_pole){
            .frequency_Hz = 60.0, .damping_ratio = damping_ratio[i], .without_noise_ratio = without[i]};
        b->d.attainable =
            (struct attainable){.modes = n + (damping_ratio[i] >= 0.0), .poles = poles, .noise_ratio = floors[i]};
        b->d.linearity.verdict = LINEARITY_LINEAR;
        const size_t tried = w.n_tried;
        assert_int_equal(diagnose_resonator(&w, &err), BF_OK);
        assert_int_equal(w.n_tried > tried, i == 1 || i == 4);
        b->d.attainable = (struct attainable){0};
        state_free(&w);
        bench_free(b);
    }
}

/* The free linear model has the modes of the beam, and no more: one more may hide beside one of them where a single effect comes near the records, and does not explain them. */
static void what_may_hide_is_looked_for_where_others_come_near(void **state)
{
    (void)state;
    static const double left[] = {1.4, 5.0};
    for (int i = 0; i < 2; i++) {
        struct bench *b = with_heavy_absorber();
        struct diagnose_state w = begun(b);
        struct bf_error err;
        struct attainable_pole poles[DIAGNOSE_MODES] = {{0}};
        struct refit_job job = {
            .model = make("{kind: point_mass, mass_kg: 0.002, at_m: 0.2}"), .first_new = 1, .n_effects = 1};
        double mode_Hz[DIAGNOSE_MODES];
        size_t n;
        diagnose_refits(&w, &job, 1, 0.0);
        diagnose_rank(&b->d, 1);
        assert_int_equal(b->d.n_hypotheses, 1);
        assert_int_equal(diagnose_modes_in_band(&b->d, &b->d.hypotheses[0].model, mode_Hz, &n, &err), BF_OK);
        for (size_t m = 0; m < n; m++)
            poles[m] = (struct attainable_pole){
                .frequency_Hz = mode_Hz[m], .damping_ratio = 0.01, .without_noise_ratio = HUGE_VAL};
        b->d.attainable = (struct attainable){.modes = n, .poles = poles, .noise_ratio = 1.0};
        b->d.hypotheses[0].fitted.noise_ratio = left[i];
        assert_false(b->d.hypotheses[0].explains);
        const size_t tried = w.n_tried;
        assert_int_equal(diagnose_resonator(&w, &err), BF_OK);
        assert_int_equal(w.n_tried > tried, i == 0);
        b->d.attainable = (struct attainable){0};
        state_free(&w);
        bench_free(b);
    }
}

/* Typed as it is printed, the command makes the model that was found. */
static void assert_next_frees_the_frequency(const struct diagnosis *d)
{
    static const struct channel_factors none;
    struct diagnose_next next;
    size_t frees = 0;
    diagnose_next(d, NULL, &none, &next);
    for (size_t i = 0; i < next.n; i++)
        frees += strstr(next.command[i], " --free frequency_Hz -o ") != NULL;
    assert_int_equal(frees, 1);
    diagnose_next_free(&next);
}

/* A clamp on a support with a mode of its own, and beside it a mass that the model lacks, too. */
static void a_support_that_rocks_is_found(const char *effects, double compliance, double f_Hz, size_t n_effects)
{
    static const char *const ids[] = {"point_mass", "tip_mass", "root_compliance", "attached_resonator", NULL};
    struct bench *b = bench_new(effects, 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_true(b->d.baseline.fitted.noise_ratio > 20.0);
    assert_int_equal(best->n_effects, n_effects);
    assert_true(best->explained > 0.995);
    size_t rocks = 0;
    for (size_t e = 0; e < n_effects; e++) {
        const struct model_effect *own = &best->model.effects[e];
        if (strcmp(own->effect->id, "root_compliance") != 0) {
            assert_string_equal(own->effect->id, "tip_mass");
            continue;
        }
        rocks++;
        assert_false(own->parameters[2].fixed);
        assert_true(fabs(own->parameters[0].value - compliance) < 0.05 * compliance);
        assert_true(fabs(own->parameters[2].value - f_Hz) < 0.2);
    }
    assert_int_equal(rocks, 1);
    assert_next_frees_the_frequency(&b->d);
    bench_free(b);
}

static void a_rocking_support_is_found_with_its_frequency(void **state)
{
    (void)state;
    a_support_that_rocks_is_found("{kind: root_compliance, compliance_radpNm: 0.02, loss_s: 5e-4, frequency_Hz: 22}",
                                  0.02, 22.0, 1);
}

static void a_rocking_support_is_found_beside_a_mass(void **state)
{
    (void)state;
    a_support_that_rocks_is_found("{kind: tip_mass, mass_kg: 0.004}, "
                                  "{kind: root_compliance, compliance_radpNm: 0.05, loss_s: 5e-4, frequency_Hz: 18}",
                                  0.05, 18.0, 2);
}

static void a_mass_needs_no_mode_of_its_own(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "point_spring", "attached_resonator", NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.001, at_m: 0.3}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    assert_int_equal(b->d.n_named, 1);
    assert_string_equal(b->d.named[0], "point_mass");
    assert_false(was_tried(&b->d));
    bench_free(b);
}

/* Below every mode and heavily damped it is a damper on a mass that stands still. */
static void what_is_no_mode_is_not_named(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "attached_resonator", NULL};
    struct bench *b = bench_new("{kind: point_damper, damping_Nspm: 0.05, at_m: 0.3}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    assert_false(was_tried(&b->d)); /* tried, and dropped again */
    assert_int_not_equal(b->d.verdict, VERDICT_MISSING);
    bench_free(b);
}

/* The records from `rows` on, when the blow is over. */
static void keep_decays(struct bench *b, size_t rows)
{
    for (size_t r = 0; r < b->n; r++) {
        const struct record *whole = &b->records[r];
        struct record decay = {.n = whole->n - rows, .dt_s = whole->dt_s, .path = strdup(whole->path)};
        for (size_t c = 1; c < whole->n_columns; c++)
            record_add_column(&decay, whole->columns[c].name, whole->columns[c].x + rows);
        record_add_meta(&decay, "excitation", "free_decay");
        record_free(&b->records[r]);
        b->records[r] = decay;
    }
}

/* In a decay the clamp's steady shaking looks like a resonator that nothing damps. */
static void a_steady_tone_is_no_resonator(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "attached_resonator", NULL};
    struct bench *b = bench_new("{kind: base_motion, amplitude_mps2: 0.5, frequency_Hz: 25}", 2, LONG, 0.004, ids);
    keep_decays(b, 40);
    diagnose(b, 2, 0);
    assert_true(b->d.baseline.fitted.noise_ratio > 2.0);
    assert_false(was_tried(&b->d)); /* tried, and dropped again */
    assert_int_not_equal(b->d.verdict, VERDICT_MISSING);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_absorber_is_found_with_its_values),
        cmocka_unit_test(what_is_heavy_is_found),
        cmocka_unit_test(what_hides_two_modes_is_dropped),
        cmocka_unit_test(nothing_is_looked_for_where_no_mode_is_missing),
        cmocka_unit_test(what_may_hide_is_looked_for_where_others_come_near),
        cmocka_unit_test(a_rocking_support_is_found_with_its_frequency),
        cmocka_unit_test(a_rocking_support_is_found_beside_a_mass),
        cmocka_unit_test(a_mass_needs_no_mode_of_its_own),
        cmocka_unit_test(what_is_no_mode_is_not_named),
        cmocka_unit_test(a_steady_tone_is_no_resonator),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
