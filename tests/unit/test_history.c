/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The chain of a model, found among the files around it. The command's table and JSON: tests/system/test_models.c. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "compare/compare.h"
#include "saved_model.h"
#include "test_files.h"
#include "add_effect.h"

enum { CHAIN = 4 };
static const char *const names[CHAIN] = {"start.yaml", "fitted.yml", "heavy.yaml", "last.yaml"};
static char *paths[CHAIN];

static void write_or_fail(const char *path, struct model *model)
{
    struct bf_error err;
    if (model_write(path, model, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static struct model read_or_fail(const char *path)
{
    struct model model;
    struct bf_error err;
    if (model_read(path, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* start -> fitted -> heavy (+viscoelastic) -> last (fitted). */
static int make_chain(void **state)
{
    (void)state;
    struct bf_error err;
    paths[0] = temporary_file(names[0], pretty, strlen(pretty));
    for (int i = 1; i < CHAIN; i++) {
        struct model model = read_or_fail(paths[i - 1]);
        paths[i] = temporary_file(names[i], "", 0);
        if (i == 2 && add_effect(&model, "viscoelastic", "", &err) != BF_OK)
            fail_msg("%s", err.text);
        if (i != 2)
            add_fit_block(&model);
        write_or_fail(paths[i], &model);
        model_free(&model);
    }
    return 0;
}

static int remove_chain(void **state)
{
    (void)state;
    for (int i = 0; i < CHAIN; i++) {
        (void)unlink(paths[i]);
        free(paths[i]);
    }
    return 0;
}

static struct history chain_of(const char *path, const char *const others[], size_t n)
{
    struct history h;
    struct bf_error err;
    if (history_of(path, others, n, &h, &err) != BF_OK)
        fail_msg("%s", err.text);
    return h;
}

static const char *file_at(const struct history *h, int k)
{
    const char *slash = strrchr(h->entries[h->order[k]].file, '/');
    return slash != NULL ? slash + 1 : h->entries[h->order[k]].file;
}

static void ancestors_are_found_in_their_order(void **state)
{
    (void)state;
    char step[200];
    struct history h = chain_of(paths[3], NULL, 0);
    assert_int_equal(h.n, CHAIN);
    for (int k = 0; k < CHAIN; k++) {
        assert_string_equal(file_at(&h, k), names[k]);
        assert_int_equal(h.entries[h.order[k]].depth, k);
    }
    assert_int_equal(history_fits(&h), 2);
    history_step(&h, h.order[2], step, sizeof step);
    assert_string_equal(step, "+viscoelastic");
    history_step(&h, h.order[3], step, sizeof step);
    assert_string_equal(step, "fitted");
    history_step(&h, h.order[0], step, 6); /* never beyond its size */
    assert_true(strlen(step) < 6);
    history_free(&h);
}

/* A descendant is no ancestor; a copy counts once; what is no model does no harm. */
static void nothing_else_is_found(void **state)
{
    (void)state;
    char *copy = temporary_file("a_copy.yaml", pretty, strlen(pretty));
    char *broken = temporary_file("broken.yaml", "beam: [", 7);
    char *other = temporary_file("other.yaml", pretty, strlen(pretty) - 1); /* another hash */
    struct history h = chain_of(paths[1], NULL, 0);
    assert_int_equal(h.n, 2);
    assert_string_equal(file_at(&h, 0), "a_copy.yaml");
    assert_string_equal(file_at(&h, 1), "fitted.yml");
    history_free(&h);
    (void)unlink(copy), (void)unlink(broken), (void)unlink(other);
    free(copy), free(broken), free(other);
}

/* The nearest ancestor that is there takes the place of one that is gone. */
static void a_gap_is_stepped_over(void **state)
{
    (void)state;
    assert_int_equal(unlink(paths[1]), 0);
    struct history h = chain_of(paths[3], NULL, 0);
    assert_int_equal(h.n, CHAIN - 1);
    assert_string_equal(file_at(&h, 0), "start.yaml");
    assert_string_equal(file_at(&h, 1), "heavy.yaml");
    assert_int_equal(h.entries[h.order[1]].parent, h.order[0]);
    history_free(&h);
}

static void ancestors_from_elsewhere(void **state)
{
    (void)state;
    struct bf_error err;
    char elsewhere[600];
    (void)snprintf(elsewhere, sizeof elsewhere, "%s.kept", paths[0]); /* a name that is not searched for */
    assert_int_equal(rename(paths[0], elsewhere), 0);
    const char *others[2] = {elsewhere, paths[2]};
    struct history h = chain_of(paths[3], others, 2);
    assert_int_equal(h.n, CHAIN);
    assert_string_equal(h.entries[h.order[0]].file, elsewhere);
    history_free(&h);
    others[0] = paths[3];
    assert_int_equal(history_of(paths[2], others, 1, &h, &err), BF_USAGE);
    assert_contains(err.text, "last.yaml is no ancestor");
    history_free(&h);
    others[0] = "/nonexistent.yaml";
    assert_int_equal(history_of(paths[2], others, 1, &h, &err), BF_BAD_FILE);
    history_free(&h);
    assert_int_equal(history_of("/nonexistent.yaml", NULL, 0, &h, &err), BF_BAD_FILE);
    history_free(&h);
    assert_int_equal(rename(elsewhere, paths[0]), 0);
}

#define CASE(f) cmocka_unit_test_setup_teardown(f, make_chain, remove_chain)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CASE(ancestors_are_found_in_their_order),
        CASE(nothing_else_is_found),
        CASE(a_gap_is_stepped_over),
        CASE(ancestors_from_elsewhere),
    };
    return cmocka_run_group_tests_name("history", tests, NULL, NULL);
}
