/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Wrong signs and units of channels, on a steel cantilever of the truth simulator whose model has handbook values: each wrong input is
 * named, and nothing is named where a beam only does what the model does not know.
 */
#include "compare/compare.h"
#include "compare/factor_pair.h"
#include "truth_hit.h"

#include <stdio.h>

/* EI 8 % and ρ 3 % off, damping a guess. */
static const char model_format[] =
    "format: beamfit-model/1\n"
    "beam: {length_m: 0.35}\n"
    "parameters:\n"
    "  EI_beam_Nm2: {value: 92.25, prior: 0.1}\n"
    "  rho_beam_kgpm: {value: 1.177, prior: 0.05}\n"
    "  cDI_beam_sNm2: 0.0016\n"
    "  gamma_sNpm2: 0.002\n"
    "inputs: {hammer_N: {kind: point_force, at_m: 0.30}, shaker_N: {kind: point_force, at_m: 0.1}}\n"
    "outputs:\n"
    "  accel_mps2: {kind: acceleration, at_m: %s}\n"
    "  laser_mps: {kind: velocity, at_m: 0.2}\n";

static struct model model_at(const char *place)
{
    char text[1024];
    struct model model;
    struct bf_error err;
    const int n = snprintf(text, sizeof text, model_format, place);
    if (model_read_text("test.yaml", text, (size_t)n, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* One hit or one chirp; signal and effect are lines of a spec, effect may be NULL. */
static struct record make(const char *input, const char *signal, const char *effect)
{
    struct truth_spec spec;
    truth_spec_default(&spec);
    spec.length_m = 0.35;
    spec.n_regions = 1;
    spec.region[0] = (struct truth_region){0, 0.35, 100.0, 1.21, 6e-4, 3e-6};
    spec.gamma_sNpm2 = 0.05;
    spec.sample_rate_Hz = 2048;
    spec.duration_s = 1;
    spec.modes = 20;
    say(&spec, input);
    say(&spec, "output accel_mps2 acceleration at_m=0.28");
    say(&spec, "output laser_mps velocity at_m=0.2");
    say(&spec, signal);
    if (effect != NULL)
        say(&spec, effect);
    return hit_of(&spec);
}

static struct record copy_of(const struct record *from)
{
    struct record record = {.path = strdup(from->path), .n = from->n, .dt_s = from->dt_s};
    for (size_t c = 0; c < from->n_columns; c++)
        record_add_column(&record, from->columns[c].name, from->columns[c].x);
    return record;
}

static struct record plain_hit; /* simulated once */

static struct record hit(const char *effect)
{
    if (effect == NULL && plain_hit.n > 0)
        return copy_of(&plain_hit);
    return make("input hammer_N point_force at_m=0.30",
                "signal hammer_N raised_cosine start_s=0.05 width_s=0.002 level=40", effect);
}

static struct record chirp(void)
{
    return make("input shaker_N point_force at_m=0.1",
                "signal shaker_N chirp start_s=0 width_s=0.9 from_Hz=10 to_Hz=700 level=5 taper_s=0.1", NULL);
}

static void scale(struct record *record, const char *name, double factor)
{
    double *x = (double *)record_column(record, name);
    for (size_t i = 0; x != NULL && i < record->n; i++)
        x[i] *= factor;
}

static bool fits_half(const struct fit_result *fitted)
{
    for (size_t c = 0; c < fitted->n_channels; c++)
        if (!(fitted->channels[c].nrmse < 0.5))
            return false;
    return true;
}

/* A fit that is known beforehand spares work. Where it misses half of a channel it changes no word, else nothing is asked. */
static void same_after_a_fit(const struct model *model, const struct record records[], size_t n,
                             const struct channel_factors *found)
{
    const struct fit_options options = {.never_search = true, .quiet = true};
    struct channel_factors out;
    struct fit_result fitted;
    struct bf_error err;
    if (fit_run(model, records, n, &options, &fitted, &err) != BF_OK)
        return;
    if (channel_factors_find(model, records, n, NULL, &fitted, true, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < out.n && i < found->n; i++)
        assert_string_equal(out.all[i].line, found->all[i].line);
    assert_int_equal(out.n, fits_half(&fitted) ? 0 : found->n);
    channel_factors_free(&out);
    fit_free(&fitted);
}

static struct channel_factors found(const struct model *model, const struct record records[], size_t n)
{
    struct channel_factors out;
    struct bf_error err;
    if (channel_factors_find(model, records, n, NULL, NULL, true, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    same_after_a_fit(model, records, n, &out);
    return out;
}

static void nothing(const struct model *model, const struct record records[], size_t n)
{
    struct channel_factors out = found(model, records, n);
    if (out.n != 0)
        fail_msg("said without a reason: %s", out.all[0].text);
    channel_factors_free(&out);
}

static void a_right_beam_gets_no_word(void **state)
{
    (void)state;
    static const char *const effects[] = {NULL,
                                          "effect tip_mass mass_kg=0.05",
                                          "effect tip_mass mass_kg=0.7",
                                          "effect root_compliance compliance_radpNm=2e-3",
                                          "effect quadratic_drag coefficient_Ns2pm3=5",
                                          "effect point_spring stiffness_Npm=2e4 at_m=0.15"};
    struct model model = model_at("0.28");
    for (size_t i = 0; i < sizeof effects / sizeof *effects; i++) {
        struct record record = hit(effects[i]);
        nothing(&model, &record, 1);
        record_free(&record);
    }
    model_free(&model);
}

/* Beyond the node of mode 2 (at 0.274 m of 0.35) that mode has the other sign, and mode 1 has not. */
static void a_wrong_place_is_named_and_is_no_wrong_sign(void **state)
{
    (void)state;
    static const char *const places[] = {"0.2", "0.34", "0.1"};
    struct record record = hit(NULL);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct model model = model_at(places[i]);
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        const struct channel_factor *f = &out.all[0];
        if (f->kind != FACTOR_PLACE || f->is_input || f->channel != 0 || !(fabs(f->found - 0.28) < 0.01))
            fail_msg("at %s: %s", places[i], f->text);
        assert_non_null(strstr(f->line, "at_m: 0.28"));
        channel_factors_apply(&out, &model);
        const struct parameter *at = &model.outputs[0].own.at;
        assert_true(model.outputs[0].own.lists_at && !at->fixed); /* a short fit has found it */
        assert_true(fabs(at->prior * at->prior_value - 0.0035) < 1e-6);
        channel_factors_free(&out);
        nothing(&model, &record, 1);
        model_free(&model);
    }
    record_free(&record);
}

/* A fit of the whole model that comes as near as another place explains the records without it. */
static void a_place_must_beat_the_fit_that_was_made(void **state)
{
    (void)state;
    const size_t first = 0;
    struct model model = model_at("0.2");
    struct record record = hit(NULL);
    struct channel_factor without, with;
    struct bf_error err;
    assert_int_equal(factor_place_find(&model, &record, &first, 1, HUGE_VAL, true, NULL, &without, &err), BF_OK);
    assert_true(without.kind == FACTOR_PLACE && isfinite(without.after));
    assert_int_equal(factor_place_find(&model, &record, &first, 1, without.after, true, NULL, &with, &err), BF_OK);
    assert_true(!isfinite(with.after));
    record_free(&record);
    model_free(&model);
}

static void the_place_of_a_hit_is_named(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record = make("input hammer_N point_force at_m=0.15",
                                "signal hammer_N raised_cosine start_s=0.05 width_s=0.002 level=40", NULL);
    struct channel_factors out = found(&model, &record, 1);
    assert_int_equal(out.n, 1);
    if (out.all[0].kind != FACTOR_PLACE || !out.all[0].is_input || !(fabs(out.all[0].found - 0.15) < 0.01))
        fail_msg("%s", out.all[0].text);
    channel_factors_free(&out);
    record_free(&record);
    model_free(&model);
}

static void exchanged_columns_are_named_and_put_back(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"accel_mps2", "laser_mps"}, {"hammer_N", "accel_mps2"}};
    for (size_t i = 0; i < 2; i++) {
        struct model model = model_at("0.28");
        struct record record = hit(NULL);
        for (size_t c = 0; c < record.n_columns; c++)
            for (size_t k = 0; k < 2; k++)
                if (strcmp(record.columns[c].name, pairs[i][k]) == 0) {
                    free(record.columns[c].name);
                    record.columns[c].name = strdup(pairs[i][1 - k]);
                    break;
                }
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        if (out.all[0].kind != FACTOR_EXCHANGE)
            fail_msg("%s", out.all[0].text);
        channel_factors_apply_to_records(&out, &model, &record, 1);
        channel_factors_free(&out);
        nothing(&model, &record, 1);
        record_free(&record);
        model_free(&model);
    }
}

static void frequencies_are_no_times(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record = {.path = strdup("frf.csv"), .n = 800, .dt_s = 0.5};
    double force[800], accel[800];
    for (size_t k = 0; k < 800; k++) {
        const double f = 0.5 * (double)k / 47.0;
        force[k] = 1.0, accel[k] = -f * f * (1.0 - f * f) / ((1.0 - f * f) * (1.0 - f * f) + 1e-4);
    }
    record_add_column(&record, "hammer_N", force);
    record_add_column(&record, "accel_mps2", accel);
    struct channel_factors out = found(&model, &record, 1);
    assert_int_equal(out.n, 1);
    assert_int_equal(out.all[0].kind, FACTOR_NO_TIME);
    assert_non_null(strstr(out.all[0].text, "frequency response"));
    channel_factors_free(&out);
    record_free(&record);
    model_free(&model);
}

static void one_pair_tells_only_the_product(void **state)
{
    (void)state;
    static const struct {
        const char *column;
        double by, factor;
        const char *line, *word;
    } cases[] = {
        {"accel_mps2", -1.0, -1.0, "gain: -1}", "opposite ways"},
        {"hammer_N", -1.0, -1.0, "gain: -1}", "opposite ways"},
        {"accel_mps2", 1.0 / 9.80665, 0.102, "gain: 0.101972}", "in g instead of"},
        {"accel_mps2", 1000.0, 1000.0, "gain: 1000}", "thousandths"},
        {"accel_mps2", 0.001, 0.001, "gain: 0.001}", "thousands"},
        {"accel_mps2", -10.0, -10.0, "gain: -10}", "decade"},
        {"hammer_N", 0.1, 10.0, "gain: 10}", "decade"},
        {"hammer_N", 1000.0, 0.001, "gain: 0.001}", "thousands"},
    };
    struct model model = model_at("0.28");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct record record = hit(NULL);
        for (size_t c = 0; c < record.n_columns; c++)
            if (strcmp(record.columns[c].name, "laser_mps") == 0)
                record.columns[c].name[0] = '-';
        scale(&record, cases[i].column, cases[i].by);
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        const struct channel_factor *f = &out.all[0];
        assert_true(f->kind == FACTOR_CHANNEL && !f->is_input && f->channel == 0 && f->either && f->other == 0);
        if (!(fabs(log(f->factor / cases[i].factor)) < 0.03) || strstr(f->line, cases[i].line) == NULL ||
            strstr(f->text, cases[i].word) == NULL)
            fail_msg("%s times %g: factor %g, %s\n%s", cases[i].column, cases[i].by, f->factor, f->line, f->text);
        assert_true(f->after < 0.1 && f->before > 0.6);
        channel_factors_free(&out);
        record_free(&record);
    }
    model_free(&model);
}

/* Ten is about right, a thousand is exact. */
static void a_decade_stays_free(void **state)
{
    (void)state;
    static const double by[] = {10.2, 1000.0};
    for (size_t i = 0; i < 2; i++) {
        struct model model = model_at("0.28");
        struct record record = hit(NULL);
        scale(&record, "accel_mps2", by[i]);
        struct channel_factors out = found(&model, &record, 1);
        channel_factors_apply(&out, &model);
        const struct parameter *gain = &model.outputs[0].own.gain;
        assert_true(model.outputs[0].own.lists_gain == (i == 0) && gain->fixed == (i == 1));
        assert_true(fabs(gain->value / by[i] - 1.0) < 0.03);
        if (i == 0)
            assert_true(fabs(gain->prior - 0.05) < 1e-12 && fabs(gain->prior_value - 10.0) < 1e-12);
        channel_factors_free(&out);
        record_free(&record);
        model_free(&model);
    }
}

static void the_channel_that_explains_all_is_named(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    static const struct {
        const char *column;
        bool is_input;
        size_t channel;
    } cases[] = {{"accel_mps2", false, 0}, {"laser_mps", false, 1}, {"hammer_N", true, 0}, {"shaker_N", true, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct record records[2] = {hit(NULL), chirp()};
        for (size_t r = 0; r < 2; r++)
            scale(&records[r], cases[i].column, -1.0);
        struct channel_factors out = found(&model, records, 2);
        assert_int_equal(out.n, 1);
        const struct channel_factor *f = &out.all[0];
        assert_true(f->is_input == cases[i].is_input && f->channel == cases[i].channel && !f->either);
        assert_true(fabs(f->factor + 1.0) < 1e-12);
        channel_factors_apply(&out, &model);
        nothing(&model, records, 2);
        channel_factors_apply(&out, &model); /* and back */
        channel_factors_free(&out);
        record_free(&records[0]), record_free(&records[1]);
    }
    model_free(&model);
}

static void a_mass_that_nobody_wrote_down_hides_no_sign(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record = hit("effect tip_mass mass_kg=0.3");
    scale(&record, "hammer_N", -1.0);
    struct channel_factors out = found(&model, &record, 1);
    assert_int_equal(out.n, 1);
    if (!(out.all[0].is_input || out.all[0].either) || fabs(out.all[0].factor + 1.0) > 1e-12)
        fail_msg("%s", out.all[0].text);
    channel_factors_free(&out);
    record_free(&record);
    model_free(&model);
}

/* Where mode 1 is 5 % off, a fit without that mass finds a factor that is 10 % off and stops being one of those that are known. */
static void nor_a_decade(void **state)
{
    (void)state;
    static const struct {
        const char *column;
        bool is_input;
        size_t channel;
        double by;
    } cases[] = {{"hammer_N", true, 0, 10.0}, {"accel_mps2", false, 0, 1.0 / 9.80665}, {"laser_mps", false, 1, 1000.0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct model model = model_at("0.28");
        struct record record = hit("effect tip_mass mass_kg=0.012");
        scale(&record, cases[i].column, cases[i].by);
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        if (out.all[0].is_input != cases[i].is_input || out.all[0].channel != cases[i].channel ||
            out.all[0].after > 0.2)
            fail_msg("%s times %g: %s", cases[i].column, cases[i].by, out.all[0].text);
        channel_factors_free(&out);
        record_free(&record);
        model_free(&model);
    }
}

/* The model states a gain of -1, and the sensor is the right way round. */
static void a_sign_that_the_model_has_too_much_is_named(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record turned = hit(NULL), record = hit(NULL);
    scale(&turned, "accel_mps2", -1.0);
    struct channel_factors out = found(&model, &turned, 1);
    channel_factors_apply(&out, &model);
    channel_factors_free(&out);
    out = found(&model, &record, 1);
    assert_int_equal(out.n, 1);
    assert_true(!out.all[0].is_input && out.all[0].channel == 0 && out.all[0].factor < 0.0);
    assert_non_null(strstr(out.all[0].line, "gain: 1}"));
    channel_factors_free(&out);
    record_free(&turned), record_free(&record);
    model_free(&model);
}

static void milliseconds_are_told_from_seconds(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    static const double by[] = {1e3, 1e-3};
    for (size_t i = 0; i < 2; i++) {
        struct record record = hit(NULL);
        record.dt_s *= by[i];
        struct channel_factors out = found(&model, &record, 1);
        assert_int_equal(out.n, 1);
        assert_true(out.all[0].kind == FACTOR_TIME && fabs(out.all[0].factor * by[i] - 1.0) < 1e-12);
        channel_factors_free(&out);
        record_free(&record);
    }
    model_free(&model);
}

/* Below a mode a steady sine answers with one sign, above it with the other. */
static void a_steady_sine_has_no_sign(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record record =
        make("input shaker_N point_force at_m=0.1",
             "signal shaker_N chirp start_s=0 width_s=1 from_Hz=30 to_Hz=30.5 level=5 taper_s=0.3", NULL);
    scale(&record, "accel_mps2", -1.0), scale(&record, "laser_mps", -1.0);
    nothing(&model, &record, 1);
    record_free(&record);
    model_free(&model);
}

/* Of a line only its width in so short a record, whether it ends with the record or not; a blow on the first sample, a sweep. */
static void only_a_band_is_wide(void **state)
{
    (void)state;
    enum { N = 2048, BANDS = 2 };
    static const double periods[] = {2.37, 3.1, 7.43, 14.0, 100.37};
    enum { LINES = sizeof periods / sizeof *periods };
    struct model model = model_at("0.28");
    for (size_t i = 0; i < LINES + BANDS; i++) {
        static double u[N];
        for (size_t k = 0; k < N; k++) {
            const double t = (double)k / N;
            if (i < LINES)
                u[k] = sin(2.0 * acos(-1.0) * periods[i] * t + 1.6);
            else
                u[k] = i == LINES ? (k == 0 ? 1.0 : 0.0) : sin(2.0 * acos(-1.0) * (10.0 + 40.0 * t) * t);
        }
        struct record record = {.path = strdup("drive.csv"), .n = N, .dt_s = 1.0 / N};
        struct bf_error err;
        bool wide;
        record_add_column(&record, "shaker_N", u);
        assert_int_equal(factor_drive_wide(&model, &record, SIZE_MAX, &wide, &err), BF_OK);
        if (wide != (i >= LINES))
            fail_msg("drive %zu: %s", i, wide ? "wide" : "one line");
        record_free(&record);
    }
    model_free(&model);
}

/* Cut out of a steady sine that does not end with the record, by a shaker at 0.15 m; the accelerometer alone is left. */
static struct record steady(const char *signal, const char *effect)
{
    enum { FROM = 500 };
    struct record whole = make("input shaker_N point_force at_m=0.15", signal, effect);
    struct record record = {.path = strdup(whole.path), .n = whole.n - 2 * FROM, .dt_s = whole.dt_s};
    record_add_column(&record, "shaker_N", (double *)record_column(&whole, "shaker_N") + FROM);
    record_add_column(&record, "accel_mps2", (double *)record_column(&whole, "accel_mps2") + FROM);
    record_add_meta(&record, "initial_state", "free");
    record_free(&whole);
    return record;
}

/* The model has it at 0.1 m, and no mass: amplitudes alone would tell that the sensor is elsewhere. */
static void nor_a_place(void **state)
{
    (void)state;
    struct model model = model_at("0.28");
    struct record records[2] = {
        steady("signal shaker_N chirp start_s=0 width_s=1 from_Hz=6.1 to_Hz=6.11 level=5 taper_s=0.1",
               "effect tip_mass mass_kg=0.5"),
        steady("signal shaker_N chirp start_s=0 width_s=1 from_Hz=9.3 to_Hz=9.31 level=5 taper_s=0.1",
               "effect tip_mass mass_kg=0.5")};
    nothing(&model, records, 2);
    record_free(&records[0]), record_free(&records[1]);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_right_beam_gets_no_word),
        cmocka_unit_test(a_wrong_place_is_named_and_is_no_wrong_sign),
        cmocka_unit_test(a_place_must_beat_the_fit_that_was_made),
        cmocka_unit_test(the_place_of_a_hit_is_named),
        cmocka_unit_test(exchanged_columns_are_named_and_put_back),
        cmocka_unit_test(frequencies_are_no_times),
        cmocka_unit_test(one_pair_tells_only_the_product),
        cmocka_unit_test(a_decade_stays_free),
        cmocka_unit_test(the_channel_that_explains_all_is_named),
        cmocka_unit_test(a_mass_that_nobody_wrote_down_hides_no_sign),
        cmocka_unit_test(nor_a_decade),
        cmocka_unit_test(a_sign_that_the_model_has_too_much_is_named),
        cmocka_unit_test(milliseconds_are_told_from_seconds),
        cmocka_unit_test(a_steady_sine_has_no_sign),
        cmocka_unit_test(only_a_band_is_wide),
        cmocka_unit_test(nor_a_place),
    };
    plain_hit = hit(NULL);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    record_free(&plain_hit);
    return failed;
}
