/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of a comparison: text, JSON, the command and its status. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <fcntl.h>
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include "cmd/commands.h"
#include "compare_rig.h"
#include "show/show.h"

extern const struct command command_compare;

static char *printed(const struct comparison *all, bool as_json)
{
    char *text = NULL;
    size_t size = 0;
    struct bf_error err;
    FILE *f = open_memstream(&text, &size);
    assert_non_null(f);
    if (as_json)
        assert_int_equal(json_print_and_free(compare_json(all, NULL), f, &err), BF_OK);
    else {
        struct json *root = compare_json(all, NULL);
        answer_print_text(f, root, compare_fields);
        json_discard(root);
    }
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_keeps_the_contract),
        cmocka_unit_test(silence_and_short_records),
        cmocka_unit_test(the_command_answers_with_its_status),
    };
    return cmocka_run_group_tests_name("compare_answer", tests, NULL, NULL);
}
