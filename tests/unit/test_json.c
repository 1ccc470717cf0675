/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <jansson.h>
#include "ground/ground.h"

static char *printed(struct json *root)
{
    char *text = NULL;
    size_t size;
    struct bf_error err = {0};
    FILE *f = open_memstream(&text, &size);
    assert_int_equal(json_print_and_free(root, f, &err), BF_OK);
    (void)fclose(f);
    assert_true(size > 0 && text[size - 1] == '\n');
    return text;
}

static json_t *parsed(struct json *root)
{
    char *text = printed(root);
    json_t *json = json_loads(text, 0, NULL);
    assert_non_null(json);
    free(text);
    return json;
}

static void objects_and_arrays_nest(void **state)
{
    (void)state;
    struct json *root = json_new_object();
    struct json *list = json_put(root, "modes", json_new_array());
    for (int i = 0; i < 3; i++)
        json_put_number(json_push(list, json_new_object()), "frequency_Hz", i + 0.1);
    json_push_text(json_put(root, "effects", json_new_array()), "tip_mass");
    json_push_number(json_put(root, "ci95", json_new_array()), 1e-300);
    json_put_bool(root, "converged", true);
    json_t *json = parsed(root);
    json_t *modes = json_object_get(json, "modes");
    assert_int_equal(json_array_size(modes), 3);
    assert_true(fabs(json_real_value(json_object_get(json_array_get(modes, 2), "frequency_Hz")) - 2.1) < 1e-300);
    assert_true(json_is_true(json_object_get(json, "converged")));
    assert_true(json_real_value(json_array_get(json_object_get(json, "ci95"), 0)) > 0.0);
    json_decref(json);
}

static void order_is_that_of_building(void **state)
{
    (void)state;
    struct json *root = json_new_object();
    json_put_text(root, "zebra", "1");
    json_put_text(root, "ape", "2");
    char *text = printed(root);
    assert_true(strstr(text, "zebra") < strstr(text, "ape"));
    free(text);
}

static void what_is_no_number_becomes_null(void **state)
{
    (void)state;
    struct json *root = json_new_array();
    json_push_number(root, (double)NAN);
    json_push_number(root, (double)INFINITY);
    json_push_number(root, -(double)INFINITY);
    json_push_number(root, 0.1);
    json_t *json = parsed(root);
    for (size_t i = 0; i < 3; i++)
        assert_true(json_is_null(json_array_get(json, i)));
    assert_true(!(fabs(json_real_value(json_array_get(json, 3)) - 0.1) > 0.0)); /* every bit */
    json_decref(json);
}

static void text_that_is_not_utf8_is_escaped(void **state)
{
    (void)state;
    struct json *root = json_new_object();
    json_put_text(root, "file",
                  "tr\xE4"
                  "ger.csv");
    json_put_text(root, "ok", "Träger \"1\"\n");
    json_put_number(root, "k\xFF", 1.0);
    json_t *json = parsed(root);
    assert_string_equal(json_string_value(json_object_get(json, "file")), "tr\\xE4ger.csv");
    assert_string_equal(json_string_value(json_object_get(json, "ok")), "Träger \"1\"\n");
    assert_non_null(json_object_get(json, "k\\xFF"));
    json_decref(json);
}

static void a_full_disk_is_an_error(void **state)
{
    (void)state;
    struct bf_error err = {0};
    FILE *f = fopen("/dev/full", "w");
    assert_non_null(f);
    assert_int_equal(json_print_and_free(json_new_object(), f, &err), BF_BAD_FILE);
    assert_true(strlen(err.text) > 0);
    (void)fclose(f);
}

static void discarded_trees_leave_nothing(void **state)
{
    (void)state;
    struct json *root = json_new_object();
    (void)json_put(root, "a", json_new_array());
    json_discard(root); /* the leak check sees to it */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(objects_and_arrays_nest),        cmocka_unit_test(order_is_that_of_building),
        cmocka_unit_test(what_is_no_number_becomes_null), cmocka_unit_test(text_that_is_not_utf8_is_escaped),
        cmocka_unit_test(a_full_disk_is_an_error),        cmocka_unit_test(discarded_trees_leave_nothing),
    };
    return cmocka_run_group_tests_name("json", tests, NULL, NULL);
}
