/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <getopt.h>
#include <jansson.h>
#include "cmd/commands.h"
#include "test_import.h"

extern const struct command command_import;

static const char table[] = "Time (ms);Kraft [N];Weg\n0;1,5;2\n0,5;-2;3\n1;0,25;4\n1,5;3;5\n";

/* Runs "import" with these words; standard output goes to text. */
#define RUN(text, err, ...) run((text), sizeof(text), (err), (const char *const[]){__VA_ARGS__, NULL})

static enum bf_status run(char *text, size_t size, struct bf_error *err, const char *const words[])
{
    char *argv[20] = {(char *)(uintptr_t) "import"};
    int argc = 1, kept = dup(STDOUT_FILENO);
    for (; words[argc - 1] != NULL && argc < 19; argc++)
        argv[argc] = (char *)(uintptr_t)words[argc - 1];
    fflush(stdout);
    FILE *capture = tmpfile();
    assert_non_null(capture);
    assert_int_equal(dup2(fileno(capture), STDOUT_FILENO), STDOUT_FILENO);
    optind = 1;
    err->text[0] = '\0';
    enum bf_status status = command_import.run(argc, argv, err);
    fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    close(kept);
    rewind(capture);
    text[fread(text, 1, size - 1, capture)] = '\0';
    fclose(capture);
    return status;
}

static void a_table_becomes_a_record(void **state)
{
    (void)state;
    char *in = temporary_file("in.csv", table, sizeof table - 1), *out = temporary_file("out.csv", "", 0), text[4000];
    struct bf_error err;
    struct record record;
    assert_int_equal(
        RUN(text, &err, in, "-o", out, "--channel", "Kraft=hammer_N", "--from", "0.0005", "--scale", "hammer_N=2:N"),
        BF_OK);
    assert_contains(text, "3 samples, 2000 Hz");
    assert_int_equal(record_read(out, &record, &err), BF_OK);
    assert_int_equal(record.n, 3);
    assert_true(record_column(&record, "hammer_N")[0] == -4);
    assert_string_equal(record_meta(&record, "source"), in);
    assert_contains(record_meta(&record, "imported_by"), "--channel Kraft=hammer_N --from 0.0005");
    record_free(&record);
    unlink(in);
    unlink(out);
    free(in);
    free(out);
}

static void json_says_columns_samples_and_step(void **state)
{
    (void)state;
    char *in = temporary_file("in.csv", table, sizeof table - 1), *out = temporary_file("out.csv", "", 0), text[4000];
    struct bf_error err;
    json_error_t where;
    assert_int_equal(RUN(text, &err, in, "--json", "-o", out), BF_OK);
    json_t *root = json_loads(text, 0, &where); /* nothing else on standard output */
    assert_non_null(root);
    assert_int_equal(json_array_size(json_object_get(root, "columns")), 2);
    assert_string_equal(json_string_value(json_array_get(json_object_get(root, "columns"), 0)), "Kraft_N");
    assert_true(json_number_value(json_object_get(root, "samples")) == 4);
    assert_true(fabs(json_number_value(json_object_get(root, "dt_s")) - 0.0005) < 1e-18);
    json_decref(root);
    unlink(out);
    assert_int_equal(RUN(text, &err, in, "--list", "--json"), BF_OK);
    root = json_loads(text, 0, &where);
    assert_non_null(root);
    assert_string_equal(json_string_value(json_object_get(root, "format")), "csv");
    json_t *channels = json_object_get(root, "channels");
    assert_int_equal(json_array_size(channels), 3);
    assert_string_equal(json_string_value(json_object_get(json_array_get(channels, 0), "name")), "Time");
    assert_string_equal(json_string_value(json_object_get(json_array_get(channels, 1), "unit")), "N");
    json_decref(root);
    assert_int_not_equal(access(out, F_OK), 0); /* a list writes nothing */
    unlink(in);
    free(in);
    free(out);
}

static void free_decay_is_written_down(void **state)
{
    (void)state;
    char *in = temporary_file("in.csv", table, sizeof table - 1), *out = temporary_file("out.csv", "", 0), text[4000];
    struct bf_error err;
    struct record record;
    assert_int_equal(RUN(text, &err, in, "-o", out, "--free-decay", "--free-from", "0.0005"), BF_OK);
    assert_int_equal(record_read(out, &record, &err), BF_OK);
    assert_string_equal(record_meta(&record, "excitation"), "free_decay");
    assert_string_equal(record_meta(&record, "free_from_s"), "0.0005");
    record_free(&record);
    unlink(in);
    unlink(out);
    free(in);
    free(out);
}

static void wrong_usage_is_explained_and_writes_nothing(void **state)
{
    (void)state;
    char *in = temporary_file("in.csv", table, sizeof table - 1), *out = temporary_file("out.csv", "kept", 4),
         text[4000];
    struct bf_error err;
    static const struct {
        const char *words[3], *phrase;
    } cases[] = {{{"--rate", "0", NULL}, "above 0"},
                 {{"--rate", "fast", NULL}, "not a number"},
                 {{"--digits", "40", NULL}, "1 to 17"},
                 {{"--format", "xls", NULL}, "mat (MATLAB"},
                 {{"--scale", "Weg", NULL}, "NAME=FACTOR"},
                 {{"--scale", "Weg=0", NULL}, "leaves nothing"},
                 {{"--channel", "=a", NULL}, "FROM=TO"},
                 {{"--separator", "x", NULL}, "tab"},
                 {{"--free-from", "1", NULL}, "--free-decay"},
                 {{"--free-decay", "--unknown-level", NULL}, "exclude"},
                 {{"--colour", NULL, NULL}, "no such option"},
                 {{"--rate", NULL, NULL}, "needs a value"},
                 {{"--channel", "nothing", NULL}, "no such channel"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(RUN(text, &err, in, "-o", out, cases[i].words[0], cases[i].words[1]), BF_USAGE);
        assert_contains(err.text, cases[i].phrase);
        assert_string_equal(text, "");
    }
    assert_int_equal(RUN(text, &err, in), BF_USAGE);
    assert_contains(err.text, "-o OUT.csv");
    assert_int_equal(RUN(text, &err, "-o", out), BF_USAGE);
    outputs_protect("import", false);
    assert_int_equal(RUN(text, &err, in, "-o", in), BF_USAGE);
    assert_contains(err.text, "is read by this command");
    outputs_protect(NULL, false);
    assert_int_equal(RUN(text, &err, "/nonexistent", "-o", out), BF_BAD_FILE);
    assert_int_equal(RUN(text, &err, in, "-o", "/nonexistent/out.csv"), BF_BAD_FILE);
    assert_contains(err.text, "create the directory");
    assert_file_is(out, "kept");
    unlink(in);
    unlink(out);
    free(in);
    free(out);
}

/* Every option has its words, and the help tells exit statuses and examples. */
static void the_help_is_whole(void **state)
{
    (void)state;
    size_t n = 0;
    for (const struct option_row *row = command_import.options; row->what != NULL; row++, n++)
        assert_true(row->what[0] != '\0' && (row->code == 0 || row->name != NULL));
    assert_true(n > 20);
    assert_contains(command_import.closing, "Exit status");
    assert_contains(command_import.closing, "Examples");
    assert_string_equal(command_import.name, "import");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_becomes_a_record),   cmocka_unit_test(json_says_columns_samples_and_step),
        cmocka_unit_test(free_decay_is_written_down), cmocka_unit_test(wrong_usage_is_explained_and_writes_nothing),
        cmocka_unit_test(the_help_is_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
