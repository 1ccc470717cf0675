/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A sensor's own mass: against the truth simulator's point mass, against the effect of that name, by its place, and in the file. */
#include "truth_hit.h"

#include <stdio.h>

#include "estimate/estimate.h"
#include "response/response.h"
#include "test_files.h"

static const char format[] = "format: beamfit-model/1\n"
                             "beam: {length_m: 0.35}\n"
                             "parameters:\n"
                             "  EI_beam_Nm2: 100\n"
                             "  rho_beam_kgpm: 1.21\n"
                             "  cDI_beam_sNm2: 6e-4\n"
                             "  gamma_sNpm2: 0.05\n"
                             "inputs: {hammer_N: {kind: point_force, at_m: 0.3}}\n"
                             "outputs:\n"
                             "  accel_mps2: {kind: acceleration, at_m: %s}\n"
                             "  tip_m: {kind: displacement, at_m: 0.35}\n"
                             "effects: [%s]\n";

static enum bf_status read_model(const char *place, const char *effects, struct model *out, struct bf_error *err)
{
    char text[1200];
    const int n = snprintf(text, sizeof text, format, place, effects);
    return model_read_text("m.yaml", text, (size_t)n, out, err);
}

static struct model model_of(const char *place, const char *effects)
{
    struct model model;
    struct bf_error err;
    if (read_model(place, effects, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* A hit on the truth simulator's beam with 54 g at 0.28 m. */
static struct record truth_hit(void)
{
    struct truth_spec spec;
    truth_spec_default(&spec);
    spec.length_m = 0.35;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, 0.35, 100.0, 1.21, 6e-4, 0};
    spec.gamma_sNpm2 = 0.05;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = 0.5;
    spec.noise = 0;
    spec.adc_bits = 0;
    say(&spec, "input hammer_N point_force at_m=0.3");
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    say(&spec, "output tip_m displacement at_m=0.35");
    say(&spec, "signal hammer_N raised_cosine start_s=0.05 width_s=0.003 level=40");
    say(&spec, "effect point_mass mass_kg=0.054 at_m=0.28");
    return hit_of(&spec);
}

/* Prediction at the model's own values, with parameter `moved` (SIZE_MAX: none) changed by `by`; want: its derivative. y, dy: [rows]. */
static size_t predict(const struct model *model, const struct record *record, size_t moved, double by, double **y,
                      double **dy)
{
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction out;
    struct bf_error err;
    const char *name = "hit.csv";
    const size_t n = model_parameters(model, &name, 1, &refs);
    double *theta = calloc(n, sizeof *theta);
    bool *want = calloc(n, sizeof *want);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value + (i == moved ? by : 0.0);
    if (dy != NULL)
        want[moved] = true;
    const struct predict_options options = {.quiet = true};
    assert_int_equal(predictor_new(model, record, 1, &options, &predictor, &err), BF_OK);
    if (predictor_run(predictor, theta, dy != NULL ? want : NULL, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    *y = malloc(out.n_rows * sizeof **y);
    memcpy(*y, out.y, out.n_rows * sizeof **y);
    if (dy != NULL) {
        *dy = malloc(out.n_rows * sizeof **dy);
        memcpy(*dy, out.jacobian + moved * out.n_rows, out.n_rows * sizeof **dy);
    }
    const size_t rows = out.n_rows;
    predictor_free(predictor);
    free(refs), free(theta), free(want);
    return rows;
}

static double distance(const double a[], const double b[], size_t n)
{
    double difference = 0.0, size = 0.0;
    for (size_t i = 0; i < n; i++)
        difference += pow(a[i] - b[i], 2.0), size += b[i] * b[i];
    return sqrt(difference / size);
}

static void the_beam_carries_its_sensor(void **state)
{
    (void)state;
    struct record record = truth_hit();
    static const struct {
        const char *place;
        double least, most; /* of the error */
    } cases[] = {{"0.28, mass_kg: 0.054", 0.0, 0.003}, {"0.28", 0.5, 3.0}, {"0.28, mass_kg: 0.05", 0.03, 3.0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct model model = model_of(cases[i].place, "");
        struct fit_channel_error *channels;
        struct bf_error err;
        const struct fit_options options = {.quiet = true};
        size_t n;
        assert_int_equal(fit_errors(&model, &record, 1, &options, &channels, &n, &err), BF_OK);
        assert_int_equal(n, 2);
        for (size_t c = 0; c < n; c++)
            if (!(channels[c].nrmse >= cases[i].least && channels[c].nrmse <= cases[i].most))
                fail_msg("%s: %s off by %g", cases[i].place, channels[c].name, channels[c].nrmse);
        free(channels);
        model_free(&model);
    }
    record_free(&record);
}

static void it_is_a_point_mass_for_every_effect(void **state)
{
    (void)state;
    static const char *const effects[] = {
        "", "{kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}",
        "{kind: hysteretic_damping, loss_factor: 0.01}", "{kind: cubic_stiffness, coefficient_Npm3: 1e7, at_m: 0.35}",
        "{kind: large_rotation}"};
    struct record record = truth_hit();
    for (size_t i = 0; i < sizeof effects / sizeof *effects; i++) {
        char both[300];
        double *y, *z;
        (void)snprintf(both, sizeof both, "%s%s{kind: point_mass, mass_kg: 0.054, at_m: 0.28}", effects[i],
                       effects[i][0] != '\0' ? ", " : "");
        struct model sensor = model_of("0.28, mass_kg: 0.054", effects[i]), mass = model_of("0.28", both);
        const size_t n = predict(&sensor, &record, SIZE_MAX, 0.0, &y, NULL);
        assert_int_equal(predict(&mass, &record, SIZE_MAX, 0.0, &z, NULL), n);
        if (!(distance(y, z, n) < 1e-6))
            fail_msg("'%s': %g", effects[i], distance(y, z, n));
        free(y), free(z);
        model_free(&sensor), model_free(&mass);
    }
    record_free(&record);
}

/* Where the sensor moves, its mass does. */
static void a_free_place_moves_the_mass(void **state)
{
    (void)state;
    static const char *const effects[] = {"",
                                          "{kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}"};
    struct record record = truth_hit();
    for (size_t i = 0; i < 2; i++) {
        struct model model = model_of("{value: 0.28}, mass_kg: 0.054", effects[i]);
        const char *name = "hit.csv";
        struct parameter_ref *refs;
        const size_t n = model_parameters(&model, &name, 1, &refs);
        size_t place = 0;
        while (place < n && strcmp(refs[place].label, "accel_mps2.at_m") != 0)
            place++;
        assert_true(place < n);
        double *low, *high, *low2, *high2, *y, *dy;
        const double h = 2e-4;
        const size_t rows = predict(&model, &record, place, 0.0, &y, &dy);
        predict(&model, &record, place, -h, &low, NULL), predict(&model, &record, place, h, &high, NULL);
        predict(&model, &record, place, -2 * h, &low2, NULL), predict(&model, &record, place, 2 * h, &high2, NULL);
        for (size_t k = 0; k < rows; k++) /* of fourth order */
            y[k] = (8 * (high[k] - low[k]) - (high2[k] - low2[k])) / (12 * h);
        if (!(distance(dy, y, rows) < 1e-4))
            fail_msg("'%s': %g", effects[i], distance(dy, y, rows));
        free(low), free(high), free(low2), free(high2), free(y), free(dy), free(refs);
        model_free(&model);
    }
    record_free(&record);
}

static void the_file_keeps_it(void **state)
{
    (void)state;
    struct model model = model_of("0.28, mass_kg: 0.054, gain: -1", ""), again;
    struct bf_error err;
    char *path = temporary_file("m.yaml", "", 0);
    near(model.outputs[0].mass_kg, 0.054, 1e-15);
    assert_true(!(model.outputs[1].mass_kg > 0.0));
    assert_int_equal(model_write(path, &model, &err), BF_OK);
    assert_int_equal(model_read(path, &again, &err), BF_OK);
    near(again.outputs[0].mass_kg, 0.054, 1e-15);
    model_free(&again);
    model.outputs[0].mass_kg = 0.01; /* the layout has no place for that: written anew */
    assert_int_equal(model_write(path, &model, &err), BF_OK);
    assert_int_equal(model_read(path, &again, &err), BF_OK);
    near(again.outputs[0].mass_kg, 0.01, 1e-15);
    model_free(&again);
    model_free(&model);
    unlink(path);
    free(path);
}

static void what_is_no_mass_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *place, *says;
    } cases[] = {{"0.28, mass_kg: 54", "54 g is 0.054"},
                 {"0.28, mass_kg: -1", "0 to 5"},
                 {"0.28, mass_kg: {value: 0.05}", "point_mass"},
                 {"0.28, mass: 0.05", "mass_kg"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct model model;
        struct bf_error err;
        assert_int_equal(read_model(cases[i].place, "", &model, &err), BF_BAD_FILE);
        assert_contains(err.text, "m.yaml:10");
        assert_contains(err.text, cases[i].says);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_beam_carries_its_sensor), cmocka_unit_test(it_is_a_point_mass_for_every_effect),
        cmocka_unit_test(a_free_place_moves_the_mass), cmocka_unit_test(the_file_keeps_it),
        cmocka_unit_test(what_is_no_mass_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
