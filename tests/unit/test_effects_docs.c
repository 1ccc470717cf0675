/* SPDX-License-Identifier: GPL-3.0-or-later */
/* docs/effects.md holds the catalogue that the effects themselves print. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "../../tools/effects_markdown.h"

static char *whole_file(const char *path)
{
    FILE *in = fopen(path, "rb");
    if (!in)
        fail_msg("%s cannot be read; run the test from the project's root or set TOP", path);
    char *text = NULL;
    size_t room = 0;
    const ssize_t n = getdelim(&text, &room, '\0', in);
    fclose(in);
    assert_true(n > 0);
    return text;
}

static void test_page_holds_the_present_catalogue(void **state)
{
    (void)state;
    const char *top = getenv("TOP");
    char path[4096];
    snprintf(path, sizeof path, "%s/docs/effects.md", top ? top : ".");
    char *page = whole_file(path), *table = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&table, &size);
    assert_non_null(out);
    effects_markdown(out);
    fclose(out);
    if (!strstr(page, table))
        fail_msg("%s does not hold the present catalogue; run sh tools/effects_docs.sh", path);
    free(table);
    free(page);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_page_holds_the_present_catalogue)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
