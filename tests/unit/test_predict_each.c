/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Records that are not all of one beam: a mass that differs, a blow and a sensor elsewhere; predicted, differentiated, fitted, read and written. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "estimate/estimate.h"
#include "model/model_yaml.h"
#include "gradient_check.h"
#include "test_files.h"

enum { RECORDS = 2, ROWS = CHANNELS * SAMPLES };
static const char *const names[RECORDS] = {"light.csv", "heavy.csv"};
#define MASSES                                                                                                         \
    "  - {kind: tip_mass, mass_kg: {value: 0.01, per_record: {light.csv: 0.004, heavy.csv: {value: 0.03, sd: "         \
    "1e-4}}}}\n"

static void records_of(struct record records[RECORDS], bool inputs)
{
    for (int r = 0; r < RECORDS; r++)
        records[r] = case_record(names[r], SAMPLES, 1.0 / 1200.0, 1.0, inputs);
}

static struct predictor *open_all(const struct model *model, const struct record records[], size_t n, double **theta,
                                  struct parameter_ref **refs, size_t *n_refs)
{
    struct bf_error err;
    struct predictor *predictor;
    const char **all = record_base_names(records, n);
    if (predictor_new(model, records, n, NULL, &predictor, &err) != BF_OK)
        fail_msg("%s", err.text);
    *n_refs = model_parameters(model, all, n, refs);
    *theta = bf_alloc(*n_refs, sizeof **theta);
    for (size_t i = 0; i < *n_refs; i++)
        (*theta)[i] = (*refs)[i].value;
    free(all);
    return predictor;
}

/* y[n · ROWS] and, of a parameter, its column; the amplitudes of initial states are those given, or 0. */
static void run_all(const struct model *model, const struct record records[], size_t n, const char *label, double y[],
                    double column[])
{
    struct bf_error err;
    struct parameter_ref *refs;
    struct prediction out;
    double *theta;
    size_t n_refs, found = SIZE_MAX;
    struct predictor *predictor = open_all(model, records, n, &theta, &refs, &n_refs);
    bool *want = bf_alloc(n_refs, sizeof *want);
    for (size_t i = 0; label != NULL && i < n_refs; i++)
        if (strcmp(refs[i].label, label) == 0)
            want[found = i] = true;
    assert_true(label == NULL || found != SIZE_MAX);
    if (predictor_run(predictor, theta, want, &out, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_int_equal(out.n_rows, n * ROWS);
    memcpy(y, out.y, n * ROWS * sizeof *y);
    if (label != NULL)
        memcpy(column, out.jacobian + found * out.n_rows, n * ROWS * sizeof *y);
    free(want), free(theta), free(refs);
    predictor_free(predictor);
}

static void assert_same(const double a[], const double b[])
{
    const double off = channel_norm(a, b, 0, ROWS) / channel_norm(b, NULL, 0, ROWS);
    if (!(off < 1e-9))
        fail_msg("%.2g apart", off);
}

/* Each record's rows are those of a model that has its mass; and the derivative by a record's mass is nothing in the other. */
static void a_mass_that_differs(void **state)
{
    (void)state;
    static double y[RECORDS * ROWS], column[RECORDS * ROWS], one[ROWS], its[ROWS];
    static const double mass_kg[RECORDS] = {0.004, 0.03};
    struct record records[RECORDS];
    struct model model, single;
    records_of(records, true);
    fixture_model(&model, MASSES);
    assert_true(model_differs_by_record(&model));
    run_all(&model, records, RECORDS, "mass_kg@heavy.csv", y, column);
    for (size_t r = 0; r < RECORDS; r++) {
        fixture_model(&single, "  - {kind: tip_mass, mass_kg: 0.01}\n");
        single.effects[0].parameters[0].value = mass_kg[r];
        run_all(&single, &records[r], 1, "mass_kg", one, its);
        assert_same(y + r * ROWS, one);
        if (r == 1)
            assert_same(column + ROWS, its);
        model_free(&single);
    }
    assert_true(channel_norm(column, NULL, 0, ROWS) == 0.0);
    assert_true(channel_norm(y, y + ROWS, 0, ROWS) > 0.1 * channel_norm(y, NULL, 0, ROWS));
    model_free(&model);
    for (int r = 0; r < RECORDS; r++)
        record_free(&records[r]);
}

/* Said in the record, or in the model by the record's name: the same; a place off the beam is refused, by the record's name. */
static void places_of_a_record(void **state)
{
    (void)state;
    static double y[RECORDS * ROWS], one[ROWS];
    struct record records[RECORDS];
    struct model model, single;
    struct bf_error err;
    struct predictor *predictor;
    records_of(records, true);
    record_add_meta(&records[1], "hammer_N.at_m", "0.2113");
    fixture_model(&model, "");
    model.stated = bf_alloc(1, sizeof *model.stated);
    model.stated[model.n_stated++] = (struct stated_place){"tip_mps", "heavy.csv", 0.3507};
    run_all(&model, records, RECORDS, NULL, y, NULL);
    fixture_model(&single, "");
    run_all(&single, &records[0], 1, NULL, one, NULL);
    assert_same(y, one);
    single.inputs[0].at_m = 0.2113, single.outputs[2].at_m = 0.3507;
    struct record bare = case_record("bare.csv", SAMPLES, 1.0 / 1200.0, 1.0, true);
    run_all(&single, &bare, 1, NULL, one, NULL);
    assert_same(y + ROWS, one);
    record_add_meta(&records[0], "accel_mps2.at_m", "21");
    assert_int_equal(predictor_new(&model, records, RECORDS, NULL, &predictor, &err), BF_BAD_FILE);
    assert_non_null(strstr(err.text, "accel_mps2.at_m: 21 m is outside the beam"));
    model_free(&model), model_free(&single), record_free(&bare);
    for (int r = 0; r < RECORDS; r++)
        record_free(&records[r]);
}

/* Two masses, one beam: the fit shares EI and finds both; free decays, whose states are of each record, likewise. */
static void fitted(bool inputs)
{
    static double y[RECORDS * ROWS];
    struct record records[RECORDS];
    struct model truth, model;
    struct fit_result fit;
    struct bf_error err;
    uint64_t seed = signal_seed(11);
    records_of(records, inputs);
    fixture_model(&truth, MASSES);
    if (inputs) {
        run_all(&truth, records, RECORDS, NULL, y, NULL);
    } else { /* the states' columns, summed */
        struct parameter_ref *refs;
        struct prediction out;
        double *theta, a[64];
        size_t n;
        struct predictor *predictor = open_all(&truth, records, RECORDS, &theta, &refs, &n);
        assert_int_equal(predictor_run(predictor, theta, NULL, &out, &err), BF_OK);
        assert_true(out.n_nuisance <= 64 && out.n_nuisance > 8);
        for (size_t i = 0; i < out.n_nuisance; i++) {
            a[i] = signal_normal(&seed);
            for (size_t k = 0; k < out.n_rows; k++)
                y[k] = (i > 0 ? y[k] : 0.0) + a[i] * out.nuisance[i * out.n_rows + k];
        }
        free(theta), free(refs), predictor_free(predictor);
    }
    for (size_t r = 0; r < RECORDS; r++)
        for (size_t o = 0; o < CHANNELS; o++) {
            const double *clean = y + r * ROWS + o * SAMPLES;
            const double noise = 0.003 * channel_norm(clean, NULL, 0, SAMPLES) / sqrt((double)SAMPLES);
            for (size_t i = 0; i < records[r].n_columns; i++)
                for (size_t k = 0; strcmp(records[r].columns[i].name, truth.outputs[o].name) == 0 && k < SAMPLES; k++)
                    records[r].columns[i].x[k] = clean[k] + noise * signal_normal(&seed);
        }
    fixture_model(&model, "  - {kind: tip_mass, mass_kg: {value: 0.012, per_record: {}}}\n");
    model.materials[0].EI.value *= 1.03;
    model.materials[0].rho.fixed = model.materials[1].rho.fixed = model.materials[1].EI.fixed = true;
    model.gamma.fixed = model.materials[0].cDI.fixed = model.materials[1].cDI.fixed = true;
    model.Ks.fixed = model.KB.fixed = true;
    const struct fit_options options = {.quiet = true, .never_search = true, .predict = {.quiet = true}};
    if (fit_run(&model, records, RECORDS, &options, &fit, &err) != BF_OK)
        fail_msg("%s", err.text);
    int seen = 0;
    for (size_t i = 0; i < fit.n_parameters; i++) {
        const struct fit_parameter *p = &fit.parameters[i];
        const double wanted = strcmp(p->label, "mass_kg@light.csv") == 0   ? 0.004
                              : strcmp(p->label, "mass_kg@heavy.csv") == 0 ? 0.03
                              : strcmp(p->label, "EI_beam_Nm2") == 0       ? 0.491
                                                                           : 0.0;
        if (!(wanted > 0.0))
            continue;
        print_message("  %s %.6g ± %.2g\n", p->label, p->value, p->sd);
        assert_true(p->sd > 0.0 && p->sd < 0.1 * wanted && fabs(p->value - wanted) < 4.0 * p->sd);
        seen++;
    }
    assert_int_equal(seen, 3);
    fit_free(&fit), model_free(&model), model_free(&truth);
    for (int r = 0; r < RECORDS; r++)
        record_free(&records[r]);
}

static void a_fit_shares_the_rest(void **state)
{
    (void)state;
    fitted(true);
    fitted(false);
}

static void in_the_file(void **state)
{
    (void)state;
    struct model model, again;
    struct parameter_ref *refs;
    fixture_model(&model, MASSES);
    const size_t n = model_parameters(&model, (const char *const *)names, RECORDS, &refs);
    size_t at = n;
    for (size_t i = 0; i < n; i++)
        if (strcmp(refs[i].label, "mass_kg@heavy.csv") == 0)
            at = i;
    assert_true(at < n && refs[at].value == 0.03 && refs[at].record == 1);
    model_set_parameters(&model, &refs[at], 1, (const double[]){0.025}, (const double[]){2e-4},
                         (const char *const *)names);
    struct bf_error err;
    char *edited = model_edit_text(model.document, strlen(model.document), &model), *printed = model_to_text(&model);
    assert_non_null(edited);
    for (int k = 0; k < 2; k++) {
        const char *text = k == 0 ? edited : printed;
        assert_int_equal(model_read_text("m.yaml", text, strlen(text), &again, &err), BF_OK);
        const struct per_record_value *heavy = effect_record_value(&again.effects[0], 0, "heavy.csv");
        assert_true(heavy != NULL && heavy->value == 0.025 && model_differs_by_record(&again));
        model_free(&again);
    }
    free(edited), free(printed), free(refs), model_free(&model);
    const char places[] =
        "format: beamfit-model/1\nbeam: {length_m: 0.4}\n"
        "parameters: {EI_beam_Nm2: 0.5, rho_beam_kgpm: 0.1}\n"
        "inputs: {hammer_N: {kind: point_force, at_m: {value: 0.1, fixed: true, per_record: {a.csv: %s}}}}\n"
        "outputs: {tip_m: {kind: displacement, at_m: 0.4}}\n";
    char text[1024];
    (void)snprintf(text, sizeof text, places, "0.2");
    assert_int_equal(model_read_text("m.yaml", text, strlen(text), &model, &err), BF_OK);
    printed = model_to_text(&model);
    assert_non_null(strstr(printed, "per_record: {a.csv: 0.2}"));
    free(printed), model_free(&model);
    (void)snprintf(text, sizeof text, places, "0.5");
    assert_int_equal(model_read_text("m.yaml", text, strlen(text), &model, &err), BF_BAD_FILE);
    assert_non_null(strstr(err.text, "outside the beam"));
}

static void assert_states_of_their_records(const struct prediction *y, size_t rows)
{
    assert_true(y->n_nuisance > 8);
    assert_int_equal(y->first_state[0], 0);
    assert_int_equal(y->first_state[RECORDS], y->n_nuisance);
    for (size_t r = 0; r < RECORDS; r++)
        for (size_t i = y->first_state[r]; i < y->first_state[r + 1]; i++)
            for (size_t k = 0; k < y->n_rows; k++)
                if (k / rows != r && fpclassify(y->nuisance[i * y->n_rows + k]) != FP_ZERO)
                    fail_msg("column %zu of record %zu: %g in row %zu", i, r, y->nuisance[i * y->n_rows + k], k);
}

/* Free decays: a record's states are columns of its own rows, in a short window and in whole records after it, where they are what they were before. */
static void states_of_a_record(void **state)
{
    (void)state;
    for (int one_beam = 0; one_beam < 2; one_beam++) {
        struct record records[RECORDS];
        struct model model;
        struct parameter_ref *refs;
        struct prediction y;
        struct bf_error err;
        double *theta, *before = NULL;
        size_t n;
        records_of(records, false);
        fixture_model(&model, one_beam ? "" : MASSES);
        struct predictor *predictor = open_all(&model, records, RECORDS, &theta, &refs, &n);
        for (int i = 0; i < 3; i++) {
            assert_int_equal(predictor_window(predictor, i == 1 ? 0.25 * SAMPLES / 1200.0 : (double)INFINITY, &err),
                             BF_OK);
            assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
            assert_states_of_their_records(&y, y.n_rows / RECORDS);
            const size_t size = y.n_nuisance * y.n_rows;
            if (before == NULL)
                before = memcpy(bf_alloc(size, sizeof *before), y.nuisance, size * sizeof *before);
        }
        assert_memory_equal(before, y.nuisance, y.n_nuisance * y.n_rows * sizeof *before);
        free(before), free(theta), free(refs);
        predictor_free(predictor), model_free(&model);
        for (int r = 0; r < RECORDS; r++)
            record_free(&records[r]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mass_that_differs),   cmocka_unit_test(places_of_a_record),
        cmocka_unit_test(a_fit_shares_the_rest), cmocka_unit_test(in_the_file),
        cmocka_unit_test(states_of_a_record),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
