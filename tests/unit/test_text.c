/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"

static const char *const words[] = {"tip_mass", "point_mass", "mains_hum", "EI_beam_Nm2", "rho_beam_kgpm", "length_m"};

static void typing_errors_are_recognised(void **state)
{
    (void)state;
    static const struct {
        const char *typed, *meant;
    } cases[] = {
        {"tip_mas", "tip_mass"},    {"tpi_mass", "tip_mass"}, {"pointmass", "point_mass"},
        {"MAINS_HUM", "mains_hum"}, {"lenght_m", "length_m"}, {"rho_baem_kgpm", "rho_beam_kgpm"},
        {"EI_beam", "EI_beam_Nm2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_string_equal(text_closest(cases[i].typed, words, 6), cases[i].meant);
}

static void something_else_is_not(void **state)
{
    (void)state;
    static const char *const other[] = {"quadratic_drag", "x", "", "temperature"};
    for (size_t i = 0; i < sizeof other / sizeof *other; i++)
        assert_null(text_closest(other[i], words, 6));
    assert_null(text_closest("tip_mass", words, 0));
    char longest[300];
    memset(longest, 'a', sizeof longest - 1);
    longest[sizeof longest - 1] = '\0';
    assert_null(text_closest(longest, words, 6));
}

static char *wrapped(const char *text, size_t indent, size_t columns)
{
    char *out = NULL;
    size_t size;
    FILE *f = open_memstream(&out, &size);
    text_print_wrapped(f, text, indent, columns);
    (void)fclose(f);
    return out;
}

static void wrapping_keeps_words_and_width(void **state)
{
    (void)state;
    char *out = wrapped("γ y_t and ⟨EI y″, φ″⟩ stand in this line of words", 2, 20);
    assert_string_equal(out, "γ y_t and ⟨EI y″,\n  φ″⟩ stand in this\n  line of words\n");
    free(out);
    out = wrapped("a_word_longer_than_the_line b", 0, 10);
    assert_string_equal(out, "a_word_longer_than_the_line\nb\n");
    free(out);
    out = wrapped("", 4, 10);
    assert_string_equal(out, "\n");
    free(out);
}

static void width_counts_characters(void **state)
{
    (void)state;
    assert_int_equal(text_width("m²·s"), 4);
    char *out = NULL;
    size_t size;
    FILE *f = open_memstream(&out, &size);
    text_print_padded(f, "γ", 3);
    text_print_padded(f, "long", 2);
    (void)fclose(f);
    assert_string_equal(out, "γ  long");
    free(out);
}

static void columns_from_the_environment(void **state)
{
    (void)state;
    (void)setenv("COLUMNS", "72", 1);
    assert_int_equal(text_columns(), 72);
    (void)setenv("COLUMNS", "5", 1);
    assert_int_equal(text_columns(), 40);
    (void)setenv("COLUMNS", "1000", 1);
    assert_int_equal(text_columns(), 120);
    (void)setenv("COLUMNS", "wide", 1);
    assert_int_equal(text_columns(), 80);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(typing_errors_are_recognised),   cmocka_unit_test(something_else_is_not),
        cmocka_unit_test(wrapping_keeps_words_and_width), cmocka_unit_test(width_counts_characters),
        cmocka_unit_test(columns_from_the_environment),
    };
    return cmocka_run_group_tests_name("text", tests, NULL, NULL);
}
