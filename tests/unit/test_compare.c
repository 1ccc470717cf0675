/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <fcntl.h>
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include "cmd/commands.h"
#include "compare.h"
#include "signals.h"
#include "test_files.h"

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam:\n"
                                 "  length_m: 0.4573\n"
                                 "  patch_m: [0.02535, 0.08905]\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 0.491}\n"
                                 "  EI_patch_Nm2: {value: 0.793}\n"
                                 "  rho_beam_kgpm: {value: 0.093}\n"
                                 "  rho_patch_kgpm: {value: 0.433}\n"
                                 "  cDI_beam_sNm2: {value: 0.649e-5}\n"
                                 "  cDI_patch_sNm2: {value: 1.255e-5}\n"
                                 "  gamma_sNpm2: {value: 0.013}\n"
                                 "  Ks_V: {value: 40}\n"
                                 "inputs:\n"
                                 "  hammer_N: {kind: point_force, at_m: 0.0254}\n"
                                 "outputs:\n"
                                 "  piezo_V: {kind: patch_strain}\n"
                                 "  tip_mps: {kind: velocity, at_m: 0.44}\n"
                                 "effects: []\n";

enum { N = 2048 };
static const double dt = 1.0 / 512.0;

static struct model read_model(void)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("test.yaml", model_text, sizeof model_text - 1, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* A hammer hit and the answer of both outputs, both outputs arbitrary so far. */
static struct record hit_record(const char *path)
{
    static double u[N], noise[N];
    struct record record = {.path = strdup(path), .n = N, .dt_s = dt};
    uint64_t seed = signal_seed(1);
    for (size_t i = 0; i < N; i++) {
        u[i] = i >= 40 && i < 44 ? 10.0 : 0.0;
        noise[i] = signal_normal(&seed);
    }
    record_add_column(&record, "hammer_N", u);
    record_add_column(&record, "piezo_V", noise);
    record_add_column(&record, "tip_mps", noise);
    return record;
}

static struct comparison run(const struct model *model, const struct record *records, size_t n, size_t held_out)
{
    const struct predict_options options = {0};
    struct comparison all;
    struct bf_error err;
    if (compare_run(model, records, n, held_out, &options, &all, &err) != BF_OK)
        fail_msg("%s", err.text);
    return all;
}

static double *column(const struct record *record, const char *name)
{
    return (double *)record_column(record, name);
}

/* Overwrites the outputs with what the model predicts, and noise of this relative size. */
static void make_truth(const struct model *model, struct record *record, double noise, unsigned number)
{
    uint64_t seed = signal_seed(number);
    struct comparison all = run(model, record, 1, 0);
    for (size_t c = 0; c < all.n_channels; c++) {
        double *z = column(record, all.channels[c].name);
        const double size = noise * signal_rms(all.channels[c].predicted, N);
        for (size_t i = 0; i < N; i++)
            z[i] = all.channels[c].predicted[i] + size * signal_normal(&seed);
    }
    compare_free(&all);
}

static const struct comparison_channel *channel(const struct comparison *all, size_t record, const char *name)
{
    for (size_t i = 0; i < all->n_channels; i++)
        if (all->channels[i].record == record && strcmp(all->channels[i].name, name) == 0)
            return &all->channels[i];
    fail_msg("no channel %s", name);
    return NULL;
}

static void a_true_model_leaves_the_noise(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.01, 2);
    struct comparison all = run(&model, &record, 1, 0);
    assert_int_equal(all.n_channels, 2);
    assert_true(all.n_modes == 4 && fabs(all.frequency_Hz[0] - 6.64605) < 1e-3);
    for (size_t i = 0; i < 2; i++) {
        const struct comparison_channel *c = &all.channels[i];
        double shares = 0.0;
        assert_true(fabs(c->nrmse - 0.01) < 5e-4);
        assert_true(fabs(c->noise_ratio - 1.0) < 0.05);
        assert_true(c->whiteness.p_value > 1e-3);
        assert_true(c->inputs[0].correlation.p_value > 1e-3);
        assert_true(isnan(c->inputs[0].coherence)); /* one hit: no averages */
        assert_true(fabs(c->scale - 1.0) < 0.01 && c->alignment > 0.999);
        assert_string_equal(c->warning, "");
        assert_int_equal(c->n_bands, 4);
        for (size_t b = 0; b < c->n_bands; b++) {
            shares += c->bands[b].share;
            assert_int_equal(c->bands[b].mode, b + 1);
            assert_true(fabs(c->bands[b].noise_ratio - 1.0) < 0.35);
        }
        assert_true(fabs(shares - 1.0) < 1e-12);
        compare_summary(&all, c, text, sizeof text);
        assert_contains(text, "nothing is left to explain");
    }
    const double total = sqrt(0.5 * (pow(all.channels[0].nrmse, 2.0) + pow(all.channels[1].nrmse, 2.0)));
    assert_true(fabs(all.nrmse - total) < 1e-15);
    assert_true(isnan(all.check_nrmse));
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void misfit_is_found_where_it_is(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.002, 3);
    double *z = column(&record, "piezo_V");
    const double size = 0.3 * signal_rms(z, N);
    for (size_t i = 0; i < N; i++)
        z[i] += size * exp(-3.0 * (double)i * dt) * sin(2.0 * M_PI * 36.0 * (double)i * dt);
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->bands[1].share > 0.95 && c->bands[1].mode == 2);
    assert_true(c->time_share[0] > 0.9);
    assert_true(c->whiteness.p_value < 1e-9);
    assert_true(c->noise_ratio > 20.0);
    compare_summary(&all, c, text, sizeof text);
    assert_contains(text, "mode 2");
    assert_contains(text, "first third");
    compare_summary(&all, c, text, 20); /* cut, not overrun */
    assert_int_equal(strlen(text), 19);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void a_missing_path_follows_the_input(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    char text[1200];
    make_truth(&model, &record, 0.002, 4);
    double *z = column(&record, "piezo_V");
    const double *u = column(&record, "hammer_N");
    for (size_t i = 9; i < N; i++)
        z[i] += 0.002 * u[i - 9];
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->inputs[0].correlation.p_value < 1e-6);
    assert_true(labs(c->inputs[0].correlation.largest_lag - 9) <= 1);
    compare_summary(&all, c, text, sizeof text);
    assert_contains(text, "follows hammer_N");
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void units_and_signs_are_questioned(void **state)
{
    (void)state;
    static const struct {
        double factor;
        const char *word;
    } cases[] = {{1000.0, "1000"}, {0.0011, "1000"}, {-1.0, "opposite"}, {-950.0, "1000"}, {1.6, ""}, {30.0, ""}};
    struct model model = read_model();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct record record = hit_record("hit.csv");
        make_truth(&model, &record, 0.01, 5);
        double *z = column(&record, "tip_mps");
        for (size_t i = 0; i < N; i++)
            z[i] *= cases[k].factor;
        struct comparison all = run(&model, &record, 1, 0);
        const char *warning = channel(&all, 0, "tip_mps")->warning;
        if (cases[k].word[0] == '\0')
            assert_string_equal(warning, "");
        else
            assert_contains(warning, cases[k].word);
        assert_string_equal(channel(&all, 0, "piezo_V")->warning, "");
        compare_free(&all);
        record_free(&record);
    }
    model_free(&model);
}

static void held_out_records_have_their_own_total(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record records[3] = {hit_record("a.csv"), hit_record("b.csv"), hit_record("check.csv")};
    for (unsigned r = 0; r < 3; r++)
        make_truth(&model, &records[r], r == 2 ? 0.05 : 0.01, 10 + r);
    struct comparison all = run(&model, records, 3, 1);
    assert_int_equal(all.n_channels, 6);
    assert_true(fabs(all.nrmse - 0.01) < 5e-4 && fabs(all.check_nrmse - 0.05) < 3e-3);
    assert_false(all.channels[3].held_out);
    assert_true(all.channels[4].held_out && all.channels[4].record == 2);
    compare_free(&all);
    for (size_t r = 0; r < 3; r++)
        record_free(&records[r]);
    model_free(&model);
}

/* What a free decay can be is what the model leaves when it is compared with itself: the states are solved for. */
static void free_decay_states_are_solved(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("decay.csv");
    record_add_meta(&record, "excitation", "free_decay");
    record_add_meta(&record, "free_from_s", "0.25");
    struct comparison all = run(&model, &record, 1, 0);
    const struct comparison_channel *c = channel(&all, 0, "piezo_V");
    assert_true(c->n == N - 128 && fabs(c->t0_s - 0.25) < 1e-9);
    for (size_t i = 0; i < all.n_channels; i++) { /* measured := a free decay of the model */
        double *z = column(&record, all.channels[i].name);
        memcpy(z + 128, all.channels[i].predicted, (N - 128) * sizeof *z);
    }
    compare_free(&all);
    all = run(&model, &record, 1, 0);
    assert_true(all.nrmse < 1e-6);
    assert_int_equal(all.channels[0].n_inputs, 0);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void an_unknown_level_is_solved(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    make_truth(&model, &record, 0.01, 30);
    double *z[2] = {column(&record, "piezo_V"), column(&record, "tip_mps")};
    for (size_t i = 0; i < N; i++) {
        z[0][i] *= 3.7;
        z[1][i] *= 3.7;
    }
    struct comparison known = run(&model, &record, 1, 0);
    assert_true(known.nrmse > 0.5);
    compare_free(&known);
    record_add_meta(&record, "excitation", "unknown_level");
    struct comparison all = run(&model, &record, 1, 0);
    assert_true(fabs(all.level[0] - 3.7) < 0.01);
    assert_true(fabs(all.nrmse - 0.01) < 5e-4);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static char *printed(const struct comparison *all, bool as_json)
{
    char *text = NULL;
    size_t size = 0;
    struct bf_error err;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    if (as_json)
        assert_int_equal(json_print_and_free(compare_json(all), f, &err), BF_OK);
    else
        compare_print(f, all);
    assert_int_equal(fclose(f), 0);
    return text;
}

static void json_keeps_the_contract(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("dir/hit.csv");
    make_truth(&model, &record, 0.01, 40);
    struct comparison all = run(&model, &record, 1, 0);
    char *text = printed(&all, true);
    json_t *root = json_loads(text, 0, NULL);
    assert_non_null(root);
    assert_true(fabs(json_number_value(json_object_get(root, "nrmse")) - all.nrmse) < 1e-15);
    assert_true(json_is_number(json_object_get(root, "noise_ratio")));
    assert_true(json_is_null(json_object_get(root, "check_nrmse"))); /* NaN */
    const json_t *first = json_array_get(json_object_get(root, "records"), 0);
    assert_string_equal(json_string_value(json_object_get(first, "file")), "dir/hit.csv");
    const json_t *c = json_array_get(json_object_get(first, "channels"), 0);
    assert_string_equal(json_string_value(json_object_get(c, "name")), "piezo_V");
    assert_true(json_is_number(json_object_get(c, "nrmse")) && json_is_number(json_object_get(c, "noise_ratio")));
    const json_t *band = json_array_get(json_object_get(c, "bands"), 0);
    assert_true(json_is_number(json_object_get(band, "from_Hz")) && json_is_number(json_object_get(band, "to_Hz")) &&
                json_is_number(json_object_get(band, "share")));
    json_decref(root);
    free(text);
    text = printed(&all, false);
    assert_contains(text, "hit.csv");
    assert_contains(text, "piezo_V");
    assert_contains(text, "local rational method");
    free(text);
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

static void silence_and_short_records(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    memset(column(&record, "piezo_V"), 0, N * sizeof(double));
    struct comparison all = run(&model, &record, 1, 0);
    assert_true(isinf(channel(&all, 0, "piezo_V")->nrmse));
    char *text = printed(&all, true);
    json_t *root = json_loads(text, 0, NULL);
    assert_non_null(root);
    json_decref(root);
    free(text);
    free(printed(&all, false));
    compare_free(&all);
    record.n = 12; /* fewer samples than any estimate wants */
    all = run(&model, &record, 1, 0);
    assert_true(isnan(all.noise_ratio));
    free(printed(&all, false));
    compare_free(&all);
    record_free(&record);
    model_free(&model);
}

/* ---- The command ---- */

static enum bf_status command(struct bf_error *err, int argc, const char *const argv[])
{
    char *copy[16] = {NULL};
    for (int i = 0; i < argc; i++)
        copy[i] = strdup(argv[i]);
    (void)fflush(stdout);
    const int kept = dup(1), nothing = open("/dev/null", O_WRONLY);
    assert_true(kept >= 0 && nothing >= 0 && dup2(nothing, 1) == 1);
    optind = 1;
    const enum bf_status status = command_compare.run(argc, copy, err);
    (void)fflush(stdout);
    assert_true(dup2(kept, 1) == 1);
    (void)close(kept);
    (void)close(nothing);
    for (int i = 0; i < argc; i++)
        free(copy[i]);
    return status;
}

static void the_command_answers_with_its_status(void **state)
{
    (void)state;
    struct bf_error err;
    struct model model = read_model();
    struct record record = hit_record("hit.csv");
    make_truth(&model, &record, 0.01, 50);
    char *model_path = temporary_file("model.yaml", model_text, sizeof model_text - 1);
    char *path = temporary_file("hit.csv", "", 0);
    assert_int_equal(record_write(path, &record, 9, &err), BF_OK);
    assert_int_equal(command(&err, 3, (const char *[]){"compare", model_path, path}), BF_OK);
    assert_int_equal(command(&err, 5, (const char *[]){"compare", model_path, "--check", path, "--json"}), BF_OK);
    assert_int_equal(command(&err, 4, (const char *[]){"compare", "--max-nrmse=0.02", model_path, path}), BF_OK);
    assert_int_equal(command(&err, 5, (const char *[]){"compare", model_path, path, "--max-nrmse", "0.005"}), BF_NO);
    assert_contains(err.text, "0.005");
    assert_int_equal(command(&err, 2, (const char *[]){"compare", model_path}), BF_USAGE);
    assert_int_equal(command(&err, 1, (const char *[]){"compare"}), BF_USAGE);
    assert_int_equal(command(&err, 5, (const char *[]){"compare", model_path, path, "--max-nrmse", "x"}), BF_USAGE);
    assert_int_equal(command(&err, 5, (const char *[]){"compare", model_path, path, "--max-nrmse", "-1"}), BF_USAGE);
    assert_int_equal(command(&err, 5, (const char *[]){"compare", model_path, path, "--intersample", "x"}), BF_USAGE);
    assert_int_equal(command(&err, 4, (const char *[]){"compare", model_path, path, "--nonsense"}), BF_USAGE);
    assert_int_equal(command(&err, 3, (const char *[]){"compare", model_path, "/nonexistent.csv"}), BF_BAD_FILE);
    assert_contains(err.text, "/nonexistent.csv");
    assert_int_equal(command(&err, 3, (const char *[]){"compare", "/nonexistent.yaml", path}), BF_BAD_FILE);
    (void)unlink(model_path);
    (void)unlink(path);
    free(model_path);
    free(path);
    record_free(&record);
    model_free(&model);
}

/* ---- An independent simulator's records, with its own answer as the model ---- */

static void other_peoples_truth(void **state)
{
    (void)state;
    char *yaml = shared_file("data/open/o0_clean/model.yaml"), *csv = shared_file("data/open/o0_clean/train4.csv");
    struct model model;
    struct record record;
    struct bf_error err;
    if (yaml == NULL || csv == NULL) {
        free(yaml);
        free(csv);
        skip();
        return;
    }
    assert_int_equal(model_read(yaml, &model, &err), BF_OK);
    assert_int_equal(record_read(csv, &record, &err), BF_OK);
    const double answer[9] = {0.4936302,    0.09200885, 6.29281e-06, 0.7837074, 0.4530721,
                              1.234549e-05, 0.01308902, 40.15837,    0.01787214}; /* of answer.txt */
    struct parameter_ref *refs;
    const char *name = record.path;
    const size_t n = model_parameters(&model, &name, 1, &refs);
    double *value = calloc(n, sizeof *value);
    for (size_t i = 0; i < n; i++)
        value[i] = i < 9 ? answer[i] : refs[i].value;
    model_set_parameters(&model, refs, n, value, NULL, &name);
    struct comparison all = run(&model, &record, 1, 0);
    assert_true(fabs(channel(&all, 0, "tip_mps")->noise_ratio - 1.0) < 0.03);
    compare_free(&all);
    free(value);
    free(refs);
    record_free(&record);
    model_free(&model);
    free(yaml);
    free(csv);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_true_model_leaves_the_noise),
        cmocka_unit_test(misfit_is_found_where_it_is),
        cmocka_unit_test(a_missing_path_follows_the_input),
        cmocka_unit_test(units_and_signs_are_questioned),
        cmocka_unit_test(held_out_records_have_their_own_total),
        cmocka_unit_test(free_decay_states_are_solved),
        cmocka_unit_test(an_unknown_level_is_solved),
        cmocka_unit_test(json_keeps_the_contract),
        cmocka_unit_test(silence_and_short_records),
        cmocka_unit_test(the_command_answers_with_its_status),
        cmocka_unit_test(other_peoples_truth),
    };
    return cmocka_run_group_tests_name("compare", tests, NULL, NULL);
}
