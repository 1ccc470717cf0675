/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What physics says of experiments: which must tell rivals apart better, and which cannot at all. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "explain/explain.h"
#include "maths/maths.h"

static const char beam_text[] = "format: beamfit-model/1\n"
                                "beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}\n"
                                "parameters:\n"
                                "  EI_beam_Nm2: {value: 0.491}\n"
                                "  EI_patch_Nm2: {value: 0.793}\n"
                                "  rho_beam_kgpm: {value: 0.093, fixed: true}\n"
                                "  rho_patch_kgpm: {value: 0.433}\n"
                                "  cDI_beam_sNm2: {value: 2e-5}\n"
                                "  cDI_patch_sNm2: {value: 2e-5}\n"
                                "  gamma_sNpm2: {value: 0.05}\n"
                                "  Ks_V: {value: 40}\n"
                                "  KB_NmpV: {value: 0.01}\n"
                                "inputs:\n"
                                "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                                "  drive_V: {kind: patch_moment}\n"
                                "outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}\n"
                                "effects: [";

static struct model make(const char *effects)
{
    char text[2048];
    struct bf_error err;
    struct model model;
    (void)snprintf(text, sizeof text, "%s%s]\n", beam_text, effects);
    if (model_read_text("beam.yaml", text, strlen(text), &model, &err))
        fail_msg("%s", err.text);
    return model;
}

static struct discriminate_options quick(void)
{
    return (struct discriminate_options){.quiet = true, .threads = 1, .duration_s = 0.5, .no_sensors = true};
}

static void only(struct discriminate_options *options, enum drive_kind a, enum drive_kind b)
{
    for (int k = 0; k < DRIVE_KINDS; k++)
        options->without[k] = k != (int)a && k != (int)b;
}

static struct discrimination compare(const struct model *a, const struct model *b,
                                     const struct discriminate_options *options)
{
    const struct model base = make("");
    const struct discriminate_rival rivals[] = {{.name = "a", .model = a}, {.name = "b", .model = b}};
    struct discrimination d;
    struct bf_error err;
    if (discriminate_run(&base, rivals, 2, NULL, 0, options, &d, &err))
        fail_msg("%s", err.text);
    struct model own = base;
    model_free(&own);
    return d;
}

/* Evidence of the experiment with this drive at this multiple of the largest level, no sensor added. */
static double evidence(const struct discrimination *d, enum drive_kind kind, double level)
{
    for (size_t i = 0; i < d->n; i++) {
        const struct drive *drive = &d->drives[d->experiments[i].drive];
        if (drive->kind == kind && d->experiments[i].sensor == d->n_sensors && fabs(drive->level / level - 1.0) < 1e-9)
            return d->experiments[i].evidence;
    }
    fail_msg("no %s at %g", drive_kind_name(kind), level);
    return 0.0;
}

static void identical_rivals_cannot_be_told_apart(void **state)
{
    (void)state;
    struct model a = make("{kind: tip_mass, mass_kg: {value: 0.004}}");
    struct discriminate_options options = quick();
    options.no_sensors = false;
    only(&options, DRIVE_HIT, DRIVE_CHIRP);
    struct discrimination d = compare(&a, &a, &options);
    assert_true(d.n > 9);
    assert_int_equal(d.n_failed, 0);
    for (size_t i = 0; i < d.n; i++) {
        assert_true(d.experiments[i].evidence == 0.0);
        assert_true(d.experiments[i].wrong_choice == 0.5);
    }
    discrimination_free(&d);
    model_free(&a);
}

/* A difference that the baseline's own parameters make is absorbed by a refit; held parameters cannot absorb it. */
static void a_refit_absorbs_what_free_parameters_can_do(void **state)
{
    (void)state;
    struct model a = make(""), b = make("");
    struct discriminate_options options = quick();
    only(&options, DRIVE_CHIRP, DRIVE_CHIRP);
    b.materials[0].EI.value *= 1.0002;
    b.gamma.value *= 1.001;
    struct discrimination free_ones = compare(&a, &b, &options);
    struct parameter_ref *refs;
    for (int which = 0; which < 2; which++) {
        const size_t n = model_parameters(which ? &a : &b, NULL, 0, &refs);
        for (size_t i = 0; i < n; i++)
            ((struct parameter *)(uintptr_t)refs[i].info)->fixed = true;
        free(refs);
    }
    struct discrimination held = compare(&a, &b, &options);
    const double absorbed = free_ones.experiments[free_ones.best].evidence,
                 plain = held.experiments[held.best].evidence;
    print_message("held: %g, free: %g\n", plain, absorbed);
    assert_true(plain > 1.0);
    assert_true(absorbed < 1e-3 * plain);
    discrimination_free(&free_ones), discrimination_free(&held);
    model_free(&a), model_free(&b);
}

static void a_cubic_spring_shows_more_at_a_larger_level_and_linear_effects_do_not(void **state)
{
    (void)state;
    struct model linear = make("{kind: point_spring, stiffness_Npm: {value: 0.001}, at_m: 0.4573}");
    struct model cubic = make("{kind: cubic_stiffness, coefficient_Npm3: {value: 2000}, at_m: 0.4573}");
    struct model mass = make("{kind: tip_mass, mass_kg: {value: 0.002}}");
    struct discriminate_options options = quick();
    only(&options, DRIVE_CHIRP, DRIVE_CHIRP);
    options.moment_V = 8.0;
    struct discrimination bent = compare(&cubic, &linear, &options), straight = compare(&mass, &linear, &options);
    const double weak = evidence(&bent, DRIVE_CHIRP, 2.0), strong = evidence(&bent, DRIVE_CHIRP, 8.0),
                 beyond = evidence(&bent, DRIVE_CHIRP, 32.0);
    print_message("cubic against linear: %g %g %g; mass against spring: %g %g\n", weak, strong, beyond,
                  evidence(&straight, DRIVE_CHIRP, 2.0), evidence(&straight, DRIVE_CHIRP, 32.0));
    assert_true(strong > weak && beyond > strong);
    assert_true(fabs(evidence(&straight, DRIVE_CHIRP, 32.0) / evidence(&straight, DRIVE_CHIRP, 2.0) - 1.0) < 1e-3);
    /* the largest levels are listed and flagged, never chosen */
    assert_true(bent.drives[bent.experiments[0].drive].beyond);
    assert_false(bent.drives[bent.experiments[bent.best].drive].beyond);
    discrimination_free(&bent), discrimination_free(&straight);
    model_free(&linear), model_free(&cubic), model_free(&mass);
}

/* Two laws of damping against frequency agree on one mode; many modes tell them apart. */
static void damping_laws_need_many_modes(void **state)
{
    (void)state;
    const struct model base = make("");
    const struct beam_effect *square_root = effect_by_id("square_root_damping"),
                             *hysteretic = effect_by_id("hysteretic_damping");
    const struct discriminate_rival rivals[] = {{.name = "r", .n_effects = 1, .effects = {square_root}},
                                                {.name = "h", .n_effects = 1, .effects = {hysteretic}}};
    struct discriminate_options options = quick();
    struct discrimination d;
    struct bf_error err;
    options.duration_s = 2.0;
    only(&options, DRIVE_CHIRP, DRIVE_RELEASE);
    options.moment_V = 8.0;
    if (discriminate_run(&base, rivals, 2, NULL, 0, &options, &d, &err))
        fail_msg("%s", err.text);
    double release = 0.0;
    for (size_t i = 0; i < d.n; i++)
        if (d.drives[d.experiments[i].drive].kind == DRIVE_RELEASE)
            release = fmax(release, d.experiments[i].evidence);
    print_message("chirp %g, release %g\n", evidence(&d, DRIVE_CHIRP, 8.0), release);
    assert_true(evidence(&d, DRIVE_CHIRP, 8.0) > 2.0 * release);
    assert_non_null(d.warning); /* no records */
    discrimination_free(&d);
    struct model own = base;
    model_free(&own);
}

/* The model's answer to the inputs of a record, with white noise: where sigma[output] is 0 it becomes 0.4 % of the signal. */
static struct record simulate(const struct model *model, const struct record *inputs, double sigma[], const char *name)
{
    static uint64_t seed = 1;
    struct predictor *predictor;
    struct prediction p;
    struct parameter_ref *refs;
    struct bf_error err;
    struct record out = {.path = bf_strdup(name), .n = inputs->n, .dt_s = inputs->dt_s};
    double *zeros = bf_alloc(out.n, sizeof *zeros);
    for (size_t i = 0; i < inputs->n_columns; i++)
        record_add_column(&out, inputs->columns[i].name, inputs->columns[i].x);
    for (size_t o = 0; o < model->n_outputs; o++)
        record_add_column(&out, model->outputs[o].name, zeros);
    const size_t n = model_parameters(model, (const char *const *)&out.path, 1, &refs);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    if (predictor_new(model, &out, 1, &(struct predict_options){.quiet = true}, &predictor, &err) ||
        predictor_run(predictor, theta, NULL, &p, &err))
        fail_msg("%s", err.text);
    for (size_t o = 0; o < model->n_outputs; o++) {
        double *y = out.columns[inputs->n_columns + o].x;
        if (sigma[o] == 0.0)
            sigma[o] = 0.004 * root_mean_square(p.y + o * out.n, out.n);
        for (size_t k = 0; k < out.n; k++) {
            double normal = -6.0; /* sum of twelve uniform ones */
            for (int j = 0; j < 12; j++) {
                seed = seed * 6364136223846793005u + 1442695040888963407u;
                normal += (double)(seed >> 11) / 9007199254740992.0;
            }
            y[k] = p.y[o * out.n + k] + sigma[o] * normal;
        }
    }
    predictor_free(predictor);
    free(refs), free(theta), free(zeros);
    return out;
}

static struct discrimination ask(const struct model *base, const struct record records[], size_t n,
                                 enum drive_kind kind)
{
    const struct discriminate_rival rivals[] = {
        {.name = "r", .n_effects = 1, .effects = {effect_by_id("square_root_damping")}},
        {.name = "h", .n_effects = 1, .effects = {effect_by_id("hysteretic_damping")}}};
    struct discriminate_options options = quick();
    struct discrimination d;
    struct bf_error err;
    options.duration_s = 2.0;
    options.moment_V = 8.0;
    only(&options, kind, kind);
    if (discriminate_run(base, rivals, 2, records, n, &options, &d, &err))
        fail_msg("%s", err.text);
    return d;
}

/*
 * The experiment proposed, then done: the evidence promised is found when both rivals are refitted to all records. The first
 * record is a chirp, so that the strengths are known well: evidence grows with their square.
 */
static void what_is_expected_is_found(void **state)
{
    (void)state;
    struct model base = make(""), truth = make("{kind: square_root_damping, coefficient_Ns: {value: 4e-4}}");
    struct record records[2];
    double sigma[2] = {0.0, 0.0};
    struct discrimination first = ask(&base, NULL, 0, DRIVE_CHIRP);
    records[0] = simulate(&truth, &first.signal, sigma, "chirp.csv");
    struct discrimination before = ask(&base, records, 1, DRIVE_MULTISINE);
    records[1] = simulate(&truth, &before.signal, sigma, "multisine.csv");
    struct discrimination after = ask(&base, records, 2, DRIVE_MULTISINE);
    const double expected = before.present[0].evidence + before.experiments[before.best].evidence,
                 found = after.present[0].evidence;
    print_message("present %g, expected %g, found %g\n", before.present[0].evidence, expected, found);
    assert_true(after.noise_ratio[0] < 1.1);
    /* its standard deviation is 2 √evidence; two of them, and a tenth for the strength and the noise level */
    assert_true(before.experiments[before.best].evidence > 300.0);
    assert_true(fabs(found - expected) < 0.1 * expected + 4.0 * sqrt(before.experiments[before.best].evidence));
    discrimination_free(&first), discrimination_free(&before), discrimination_free(&after);
    record_free(&records[0]), record_free(&records[1]);
    model_free(&base), model_free(&truth);
}

static void the_signal_is_the_best_drive(void **state)
{
    (void)state;
    struct model a = make("{kind: tip_mass, mass_kg: {value: 0.002}}"), b = make("");
    struct discriminate_options options = quick();
    for (int k = 0; k < DRIVE_KINDS; k++) {
        only(&options, (enum drive_kind)k, (enum drive_kind)k);
        struct discrimination d = compare(&a, &b, &options);
        const struct drive *drive = &d.drives[d.experiments[d.best].drive];
        const double *u = record_column(&d.signal, drive->input == 0 ? "hammer_N" : "drive_V");
        double peak = 0.0;
        assert_int_equal(d.signal.n_columns, 2);
        assert_int_equal(d.signal.n, 512);
        for (size_t i = 0; i < d.signal.n; i++)
            peak = fmax(peak, fabs(u[i]));
        assert_true(fabs(peak / drive->level - 1.0) < 1e-9);
        assert_true(fabs(u[0]) < 0.02 * peak && u[d.signal.n - 1] == 0.0); /* from rest, ends free */
        discrimination_free(&d);
    }
    model_free(&a), model_free(&b);
}

static void bad_questions_are_refused(void **state)
{
    (void)state;
    struct model a = make("{kind: tip_mass, mass_kg: {value: 0.002}}"), base = make("");
    struct discriminate_rival rivals[] = {{.name = "a", .model = &a}, {.name = "a", .model = &a}};
    struct discriminate_options options = quick();
    struct discrimination d;
    struct bf_error err;
    assert_int_equal(discriminate_run(&base, rivals, 1, NULL, 0, &options, &d, &err), BF_USAGE);
    assert_non_null(strstr(err.text, "two rival"));
    assert_int_equal(discriminate_run(&base, rivals, 2, NULL, 0, &options, &d, &err), BF_USAGE);
    assert_non_null(strstr(err.text, "twice"));
    rivals[1].name = "b";
    base.n_inputs = a.n_inputs = 1; /* the hammer alone */
    only(&options, DRIVE_CHIRP, DRIVE_MULTISINE);
    assert_int_equal(discriminate_run(&base, rivals, 2, NULL, 0, &options, &d, &err), BF_USAGE);
    assert_non_null(strstr(err.text, "chirp, multisine"));
    discrimination_free(&d);
    base.n_inputs = a.n_inputs = 2;
    model_free(&a), model_free(&base);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identical_rivals_cannot_be_told_apart),
        cmocka_unit_test(a_refit_absorbs_what_free_parameters_can_do),
        cmocka_unit_test(a_cubic_spring_shows_more_at_a_larger_level_and_linear_effects_do_not),
        cmocka_unit_test(damping_laws_need_many_modes),
        cmocka_unit_test(what_is_expected_is_found),
        cmocka_unit_test(the_signal_is_the_best_drive),
        cmocka_unit_test(bad_questions_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
