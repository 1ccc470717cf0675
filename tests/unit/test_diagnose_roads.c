/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The second road to single effects: from the model as given, when the fitted baseline leads nowhere. */
#include "diagnose_rig.h"
#include "explain/diagnose_shortlist.h"

/* The only effect that is named; returns the explanation. */
static const struct hypothesis *named_alone(const struct bench *b, const char *id)
{
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_int_equal(b->d.n_named, 1);
    assert_string_equal(b->d.named[0], id);
    return &b->d.hypotheses[0];
}

/* A mass of a fifth of the beam's near its middle: the baseline without it ends where no single effect can help. */
static void what_ruins_the_baseline_is_found(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "point_spring", "tip_mass", "axial_load", NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.008, at_m: 0.15}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    assert_true(b->d.baseline.fitted.noise_ratio > 20.0);
    const struct hypothesis *best = named_alone(b, "point_mass");
    assert_int_equal(best->n_effects, 1);
    assert_true(best->fitted.noise_ratio < 1.02);
    assert_true(fabs(best->model.effects[0].parameters[0].value - 0.008) < 1e-4);
    assert_true(fabs(best->model.effects[0].parameters[1].value - 0.15) < 1e-3);
    bench_free(b);
}

/* A shifted patch, of which the first order makes little beside what stands in for it. */
static void a_subtle_cause_is_named_near_the_noise(void **state)
{
    (void)state;
    static const char *const ids[] = {"root_compliance", "point_spring",   "axial_load",
                                      "rotary_inertia",  "patch_position", NULL};
    struct bench *b = bench_new("{kind: patch_position, shift_m: 0.0005}", 2, LONG, 0.02, ids);
    diagnose(b, 2, 0);
    assert_true(b->d.baseline.fitted.noise_ratio > 1.2 && b->d.baseline.fitted.noise_ratio < 3.0);
    assert_int_equal(b->d.n_named, 1);
    assert_string_equal(b->d.named[0], "patch_position");
    bench_free(b);
}

/* Hum far above the noise on a beam that is linear at every level, and a little of it beside a mass. */
static void a_signal_that_takes_nearly_all_is_looked_at_first(void **state)
{
    (void)state;
    static const char *const ids[] = {"mains_hum", "point_mass", "tip_mass", "root_compliance", "axial_load", NULL};
    static const char *const truth[] = {
        "{kind: mains_hum, channel: piezo_V, amplitude: 0.05, frequency_Hz: 50}",
        "{kind: mains_hum, channel: piezo_V, amplitude: 0.0005, frequency_Hz: 50}, {kind: tip_mass, mass_kg: 0.002}"};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new(truth[i], 2, LONG, 0.004, ids);
        struct diagnose_state w = begun(b);
        struct bf_error err;
        b->d.linearity.verdict = LINEARITY_LINEAR;
        assert_true(b->d.baseline.fitted.noise_ratio > 3.0);
        assert_int_equal(diagnose_first_look(&w, &err), BF_OK);
        assert_int_equal(single(&b->d, "mains_hum") != NULL, i == 0);
        shortlist_free(w.looked);
        w.looked = NULL;
        state_free(&w);
        bench_free(b);
    }
}

/*
 * Every mode of a beam whose loss is the same at all frequencies has the same damping ratio: no damper and no other law of damping makes the modes that, and none is refitted to the
 * records, whether a free linear model leaves as much or a little less.
 */
static void what_comes_nowhere_near_the_modes_is_not_refitted(void **state)
{
    (void)state;
    static const char *const damping[] = {"point_damper",       "point_spring", "square_root_damping",
                                          "hysteretic_damping", "viscoelastic", NULL};
    for (int i = 0; i < 2; i++) {
        struct bench *b =
            bench_new("{kind: hysteretic_damping, loss_factor: 0.006}", 2, LONG, i == 0 ? 0.001 : 0.004, damping);
        diagnose(b, 1, 1);
        assert_int_equal(b->d.n_named, 1);
        assert_string_equal(b->d.named[0], "hysteretic_damping");
        assert_int_equal(b->d.hypotheses[0].fitted.noise_ratio > 1.01 * diagnose_floor(&b->d), i == 0);
        assert_null(single(&b->d, "viscoelastic"));
        assert_true(i == 1 || b->d.n_hypotheses == 1);
        bench_free(b);
    }
}

/* Near the noise a law may follow what tension does: it is tried along the motion, unless records of different level have told that the beam is linear. */
static void levels_that_agree_ask_for_no_law_beside_what_explains(void **state)
{
    (void)state;
    static const char *const ids[] = {"axial_load", "bilinear_stiffness", "microslip", NULL};
    static const size_t most[] = {[KIND_LINEAR] = 4, [KIND_NONLINEAR_CHAIN] = 2, [KIND_LAW] = 3};
    size_t n_tried[2];
    for (int agree = 0; agree < 2; agree++) {
        struct bench *b = bench_new("{kind: axial_load, force_N: 0.15}", 2, LONG, 0.02, ids);
        struct diagnose_state w = begun(b);
        struct bf_error err;
        b->d.linearity.verdict = agree ? LINEARITY_LINEAR : LINEARITY_CANNOT_TELL;
        assert_true(b->d.baseline.fitted.noise_ratio > 1.2 && b->d.baseline.fitted.noise_ratio < 3.0);
        assert_int_equal(diagnose_extend(&w, &b->d.baseline, most, 0.0, &err), BF_OK);
        assert_non_null(single(&b->d, "axial_load"));
        assert_true(diagnose_explained(&b->d, 1));
        n_tried[agree] = w.n_tried;
        state_free(&w);
        bench_free(b);
    }
    assert_true(n_tried[0] > n_tried[1]);
}

/* Records of different level agree; where a free linear model is far from the noise all the same, and takes less than nine tenths, one that could not be compared is not linear. */
static void what_no_linear_model_explains_is_not_linear(void **state)
{
    (void)state;
    static const char *const ids[] = {"tip_mass", "sensor_saturation", NULL};
    static const double floor_of_left[] = {0.01, 0.2, 0.5};
    struct bench *b = bench_new("{kind: tip_mass, mass_kg: 0.004}", 2, SHORT, 0.004, ids);
    struct diagnose_state w = begun(b);
    b->d.linearity.verdict = LINEARITY_LINEAR;
    b->d.attainable.modes = 3;
    assert_true(b->d.baseline.fitted.noise_ratio > 20.0);
    for (int i = 0; i < 3; i++) {
        struct shortlist *s;
        struct bf_error err;
        b->d.attainable.noise_ratio = floor_of_left[i] * b->d.baseline.fitted.noise_ratio;
        assert_int_equal(shortlist_new(&w, &b->d.baseline, &s, &err), BF_OK);
        assert_int_equal(s->linear, i < 2);
        shortlist_free(s);
    }
    state_free(&w);
    bench_free(b);
}

/* Tension has explained the records; what a spring would do to these few modes is much the same, what a tip mass does is not. */
static void a_mate_is_held_against_what_has_explained(void **state)
{
    (void)state;
    static const char *const ids[] = {"axial_load", "point_spring", "tip_mass", NULL};
    struct bench *b = bench_new("{kind: axial_load, force_N: 0.3}", 2, SHORT, 0.015, ids);
    struct diagnose_state w = begun(b);
    struct shortlist *s;
    struct refit_job job;
    struct bf_error err;
    size_t axial = 0;
    assert_int_equal(shortlist_new(&w, &b->d.baseline, &s, &err), BF_OK);
    assert_int_equal(shortlist_score(s, KIND_LINEAR, &err), BF_OK);
    while (strcmp(s->list.candidates[axial].effect->id, "axial_load") != 0)
        axial++;
    assert_int_equal(shortlist_job(s, axial, &job, &err), BF_OK);
    assert_int_equal(diagnose_try(&w, &job, 1, BF_OK, 0.0), BF_OK);
    assert_int_equal(b->d.n_hypotheses, 1);
    assert_int_equal(shortlist_mates(s, &err), BF_OK);
    const struct hypothesis *spring = single(&b->d, "point_spring");
    assert_non_null(spring);
    assert_true(spring->fit.converged &&
                spring->fitted.noise_ratio < 1.2 * single(&b->d, "axial_load")->fitted.noise_ratio);
    assert_null(single(&b->d, "tip_mass"));
    shortlist_free(s);
    state_free(&w);
    bench_free(b);
}

/* A beam on a rigid point: tension and a stiff branch take its first frequency, too, at values that nobody would believe. */
static void a_rigid_support_is_found_at_its_place(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_spring", "axial_load", "viscoelastic", "point_mass", NULL};
    struct bench *b =
        bench_new("{kind: point_spring, stiffness_Npm: 2e4, damping_Nspm: 0.05, at_m: 0.14}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    const struct hypothesis *best = named_alone(b, "point_spring");
    assert_true(best->fitted.noise_ratio < 1.05);
    assert_true(fabs(best->model.effects[0].parameters[2].value - 0.14) < 2e-3);
    bench_free(b);
}

/* How stiff it is the records do not tell: it is held, and has its place alone. A spring that gives, at the same place, keeps its stiffness. */
static void a_rigid_support_is_held_and_a_spring_is_not(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_spring", "axial_load", "point_mass", NULL},
                             *const springs[] = {
                                 "{kind: point_spring, stiffness_Npm: 1e8, damping_Nspm: 0, at_m: 0.14}",
                                 "{kind: point_spring, stiffness_Npm: 300, damping_Nspm: 0.01, at_m: 0.14}"};
    for (int gives = 0; gives < 2; gives++) {
        struct bench *b = bench_new(springs[gives], 2, LONG, 0.02, ids);
        diagnose(b, 2, 0);
        const struct hypothesis *best = named_alone(b, "point_spring");
        const struct parameter *own = best->model.effects[0].parameters;
        assert_true(own[0].fixed == !gives && own[1].fixed == !gives && !own[2].fixed);
        assert_true(fabs(own[2].value - 0.14) < 4.0 * own[2].sd && own[2].sd < 3e-4);
        bench_free(b);
    }
}

/* A mass ten times as heavy as the beam, near its clamp: from the catalogue's start alone the fit ends at a tenth of it, three times as far out. */
static void a_mass_heavier_than_the_beam_is_found_at_its_place(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_mass", "root_compliance", "axial_load", "viscoelastic", NULL};
    struct bench *b = bench_new("{kind: point_mass, mass_kg: 0.4, at_m: 0.1}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    const struct hypothesis *best = named_alone(b, "point_mass");
    assert_true(best->fitted.noise_ratio < 1.2);
    assert_true(fabs(best->model.effects[0].parameters[0].value - 0.4) < 0.004);
    assert_true(fabs(best->model.effects[0].parameters[1].value - 0.1) < 2e-4);
    bench_free(b);
}

/*
 * Each candidate is first looked at for a hundred evaluations. The spring's refit has come to the noise by then but is not at its end: it goes on and is
 * named, instead of being looked for once more after all others.
 */
static void what_has_nearly_been_found_is_not_left(void **state)
{
    (void)state;
    static const char *const ids[] = {"point_spring", "point_mass",     "axial_load",          "electrical_coupling",
                                      "tip_mass",     "viscoelastic",   "sensor_lag",          "root_compliance",
                                      "point_damper", "rotary_inertia", "square_root_damping", NULL};
    struct bench *b =
        bench_new("{kind: point_spring, stiffness_Npm: 5, damping_Nspm: 0.003, at_m: 0.35}", 2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_string_equal(b->d.named[0], "point_spring");
    assert_true(b->d.hypotheses[0].fit.converged);
    assert_true(b->d.evaluations < 800); /* eleven candidates at a hundred each are more */
    bench_free(b);
}

/* A spring takes more alone than a mass or a soft clamp, and no pair with the spring explains the records. */
static void a_pair_is_found_behind_a_stronger_single_effect(void **state)
{
    (void)state;
    static const char *const ids[] = {"tip_mass", "point_mass", "point_spring", "axial_load", "root_compliance", NULL};
    struct bench *b =
        bench_new("{kind: tip_mass, mass_kg: 0.002}, {kind: root_compliance, compliance_radpNm: 0.03, loss_s: 1e-3}", 2,
                  LONG, 0.004, ids);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0];
    assert_non_null(single(&b->d, "point_spring"));
    assert_true(single(&b->d, "point_spring")->fitted.noise_ratio > 10.0);
    assert_true(single(&b->d, "root_compliance")->score < single(&b->d, "point_spring")->score);
    assert_int_equal(best->n_effects, 2);
    assert_string_equal(best->effects[0]->id, "root_compliance");
    assert_string_equal(best->effects[1]->id, "tip_mass");
    assert_true(fabs(best->model.effects[1].parameters[0].value - 0.002) < 1e-4);
    bench_free(b);
}

/* A sensor's offset on a beam that hardens: it takes the most alone, and other single effects have more evidence, which counts channels and modes alike. */
static void a_pair_begins_at_what_takes_the_most(void **state)
{
    (void)state;
    static const char *const ids[] = {"cubic_stiffness", "point_spring",  "axial_load",
                                      "point_mass",      "sensor_offset", NULL};
    struct bench *b = bench_new("{kind: cubic_stiffness, coefficient_Npm3: 5.5e6, at_m: 0.3}, "
                                "{kind: sensor_offset, offset: 0.05, channel: tip_mps}",
                                2, LONG, 0.004, ids);
    diagnose(b, 2, 0);
    const struct hypothesis *best = &b->d.hypotheses[0], *offset = single(&b->d, "sensor_offset");
    for (size_t i = 1; i < b->d.n_hypotheses; i++)
        best = b->d.hypotheses[i].score > best->score ? &b->d.hypotheses[i] : best;
    assert_non_null(offset);
    assert_true(offset->score < single(&b->d, "axial_load")->score);
    assert_true(offset->fitted.noise_ratio > 20.0 && best->fitted.noise_ratio < 1.3);
    assert_int_equal(best->n_effects, 2);
    assert_string_equal(best->effects[0]->id, "sensor_offset");
    assert_string_equal(best->effects[1]->id, "cubic_stiffness");
    bench_free(b);
}

/*
 * One record tells nothing of other levels, but no free linear model takes a weak and a strong blow in it to the noise, and along the measured motion a law does: it
 * comes before the linear effects, of which each takes a hundred evaluations and more from the model as given.
 */
static void a_law_that_outdoes_linear_models_comes_first(void **state)
{
    (void)state;
    static const char *const ids[] = {"cubic_stiffness", "point_spring",   "axial_load",   "point_mass",   "tip_mass",
                                      "point_damper",    "rotary_inertia", "viscoelastic", "sensor_delay", NULL};
    struct bench *b = bench_new("{kind: cubic_stiffness, coefficient_Npm3: 3e7, at_m: 0.3}", 1, LONG, 0.004, ids);
    double *force = b->records[0].columns[0].x;
    for (size_t k = 0; k < LONG / 2; k++)
        force[LONG / 2 + k] = 10.0 * force[k];
    predict(&b->truth, &b->records[0], 0.004, 5);
    diagnose(b, 1, 0);
    assert_int_equal(b->d.linearity.verdict, LINEARITY_CANNOT_TELL);
    assert_true(b->d.attainable.noise_ratio > 2.0);
    assert_int_equal(b->d.verdict, VERDICT_MISSING);
    assert_string_equal(b->d.named[0], "cubic_stiffness");
    assert_true(b->d.evaluations < 900);
    bench_free(b);
}

/* With a mode to spare a free linear model follows a hardening beam through one record, down to the noise; no linear effect comes near it, so a law may. */
static void a_law_that_passes_for_linear_is_tried(void **state)
{
    (void)state;
    static const char *const ids[] = {"cubic_stiffness", "axial_load", "point_damper", "tip_mass", "rotary_inertia",
                                      "sensor_lag",      NULL};
    struct bench *b = bench_new("{kind: cubic_stiffness, coefficient_Npm3: 1.6e8, at_m: 0.3}", 1, LONG, 0.00375, ids);
    diagnose(b, 1, 0);
    assert_true(diagnose_passes_for_linear(&b->d) && diagnose_is_far(&b->d.baseline));
    assert_string_equal(named_alone(b, "cubic_stiffness")->effects[0]->id, "cubic_stiffness");
    bench_free(b);
}

static size_t most_effects(const struct diagnosis *d)
{
    size_t most = 0;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        most = d->hypotheses[i].n_effects > most ? d->hypotheses[i].n_effects : most;
    return most;
}

/* A mass, hum and an offset, none of which takes half alone; and an absorber that the catalogue lacks, of which tension and a mass take most: no third takes half of what they leave. */
static void a_third_effect_is_asked_for_what_two_leave(void **state)
{
    (void)state;
    static const char *const ids[] = {"mains_hum", "sensor_offset", "point_mass", NULL},
                             *const stand_ins[] = {"point_mass",     "clock_error",        "axial_load",
                                                   "rotary_inertia", "hysteretic_damping", NULL};
    struct bench *three = bench_new("{kind: mains_hum, channel: piezo_V, amplitude: 0.003, frequency_Hz: 50}, "
                                    "{kind: sensor_offset, channel: piezo_V, offset: 0.002, drift_per_s: 0}, "
                                    "{kind: point_mass, mass_kg: 0.002, at_m: 0.3}",
                                    2, LONG, 0.004, ids);
    diagnose(three, 2, 0);
    assert_int_equal(three->d.hypotheses[0].n_effects, 3);
    assert_true(three->d.hypotheses[0].explained > 0.999);
    bench_free(three);
    struct bench *lacks =
        bench_new("{kind: attached_resonator, mass_kg: 0.004, frequency_Hz: 30, damping_ratio: 0.05, at_m: 0.3}", 2,
                  LONG, 0.004, stand_ins);
    diagnose(lacks, 2, 0);
    assert_int_equal(most_effects(&lacks->d), 2);
    bench_free(lacks);
}

/* Three times what the best leaves; a spring that attracts leaves less, and explains nothing; nor does a pair say what a single effect should leave. */
static void a_stand_in_puts_nothing_out_of_reach(void **state)
{
    (void)state;
    struct hypothesis h[] = {
        {.model = make("{kind: point_spring, stiffness_Npm: -20, damping_Nspm: 0, at_m: 0.2}"), .n_effects = 1},
        {.model = make("{kind: tip_mass, mass_kg: 0.004}"), .n_effects = 1},
        {.model = make("{kind: point_mass, mass_kg: 0.004, at_m: 0.2}"), .n_effects = 1},
        {.model = make("{kind: tip_mass, mass_kg: 0.004}"), .n_effects = 2},
    };
    static const double left[] = {1.0, 25.0, 16.0, 1.0};
    struct diagnosis d = {.hypotheses = h};
    for (size_t i = 0; i < 4; i++)
        h[i].fit.chi2_per_row = left[i];
    assert_true(diagnose_out_of_reach(&d, 1) == 0.0);
    d.n_hypotheses = 4;
    assert_true(diagnose_out_of_reach(&d, 1) == 9.0 * 16.0);
    for (size_t i = 0; i < 4; i++)
        model_free(&h[i].model);
}

/* Near the noise: hum and an offset, of which one takes most, or neither half of what they and a mass, which is not asked for, leave. */
static void a_weak_misfit_has_a_second_effect_where_one_leads(void **state)
{
    (void)state;
    static const char *const ids[] = {"mains_hum", "sensor_offset", NULL};
    static const char *const truths[] = {
        "{kind: mains_hum, channel: piezo_V, amplitude: 6e-5, frequency_Hz: 50}, "
        "{kind: sensor_offset, channel: piezo_V, offset: 8e-5, drift_per_s: 0}",
        "{kind: mains_hum, channel: piezo_V, amplitude: 6e-5, frequency_Hz: 50}, "
        "{kind: sensor_offset, channel: piezo_V, offset: 4e-5, drift_per_s: 0}, "
        "{kind: point_mass, mass_kg: 2e-5, at_m: 0.3}",
    };
    for (size_t i = 0; i < 2; i++) {
        struct bench *b = bench_new(truths[i], 2, LONG, 0.004, ids);
        diagnose(b, 2, 0);
        assert_true(b->d.baseline.fitted.noise_ratio > 1.5 && b->d.baseline.fitted.noise_ratio < 3.0);
        assert_int_equal(most_effects(&b->d), i == 0 ? 2 : 1);
        bench_free(b);
    }
}

/*
 * A free linear model is said to leave half of the noise, so that it outdoes the beam: where the beam leaves no more than the noise there is no misfit that an effect could
 * explain most of, and none is tried; ten milligrams leave a little, and are looked for.
 */
static void without_a_misfit_nothing_is_looked_for(void **state)
{
    (void)state;
    static const char *const ids[] = {"tip_mass", "mains_hum", NULL}, *const truths[] = {
                                                                          "", "{kind: tip_mass, mass_kg: 1e-5}"};
    struct attainable_pole poles[] = {{.frequency_Hz = 8.0, .damping_ratio = 0.01},
                                      {.frequency_Hz = 50.0, .damping_ratio = 0.01},
                                      {.frequency_Hz = 150.0, .damping_ratio = 0.01}};
    const struct attainable half = {.modes = 3, .poles = poles, .nrmse = 0.002, .noise_ratio = 0.5};
    for (int i = 0; i < 2; i++) {
        struct bench *b = bench_new(truths[i], 6, LONG, 0.004, ids);
        b->options.free_model = &half;
        diagnose(b, 6, 0);
        assert_int_equal(b->d.baseline.fitted.noise_ratio <= 1.0, i == 0);
        assert_int_equal(b->d.n_hypotheses == 0, i == 0);
        bench_free(b);
    }
}

/* The misfit of the fitted record, of drag and a weak spring, is weak; held-out ones that move farther show that there are two. */
static void held_out_records_ask_for_a_second_effect(void **state)
{
    (void)state;
    static const char *const ids[] = {"quadratic_drag", "point_spring", NULL};
    struct bench *b = bench_new("{kind: quadratic_drag, coefficient_Ns2pm3: 3}, "
                                "{kind: point_spring, stiffness_Npm: 0.5, damping_Nspm: 0, at_m: 0.3}",
                                2, LONG, 0.02, ids);
    diagnose(b, 1, 1);
    assert_true(b->d.baseline.fitted.noise_ratio < 3.0 && b->d.baseline.check.noise_ratio > 30.0);
    assert_int_equal(most_effects(&b->d), 2);
    bench_free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pair_begins_at_what_takes_the_most),
        cmocka_unit_test(a_pair_is_found_behind_a_stronger_single_effect),
        cmocka_unit_test(what_ruins_the_baseline_is_found),
        cmocka_unit_test(a_subtle_cause_is_named_near_the_noise),
        cmocka_unit_test(a_signal_that_takes_nearly_all_is_looked_at_first),
        cmocka_unit_test(what_comes_nowhere_near_the_modes_is_not_refitted),
        cmocka_unit_test(levels_that_agree_ask_for_no_law_beside_what_explains),
        cmocka_unit_test(what_no_linear_model_explains_is_not_linear),
        cmocka_unit_test(a_mate_is_held_against_what_has_explained),
        cmocka_unit_test(a_rigid_support_is_found_at_its_place),
        cmocka_unit_test(a_rigid_support_is_held_and_a_spring_is_not),
        cmocka_unit_test(a_mass_heavier_than_the_beam_is_found_at_its_place),
        cmocka_unit_test(what_has_nearly_been_found_is_not_left),
        cmocka_unit_test(a_law_that_outdoes_linear_models_comes_first),
        cmocka_unit_test(a_law_that_passes_for_linear_is_tried),
        cmocka_unit_test(a_third_effect_is_asked_for_what_two_leave),
        cmocka_unit_test(a_stand_in_puts_nothing_out_of_reach),
        cmocka_unit_test(a_weak_misfit_has_a_second_effect_where_one_leads),
        cmocka_unit_test(without_a_misfit_nothing_is_looked_for),
        cmocka_unit_test(held_out_records_ask_for_a_second_effect),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
