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

/* What --help prints of this text in so many columns. */
static char *helped(const char *text, size_t columns)
{
    char *out = NULL;
    size_t size;
    FILE *f = open_memstream(&out, &size);
    assert_non_null(f);
    text_print_help(f, text, columns);
    assert_int_equal(fclose(f), 0);
    return out;
}

static void help_fits_the_width(void **state)
{
    static const char text[] = "Usage: beamfit fit MODEL RECORD... [options]\n"
                               "\n"
                               "One paragraph in two\n"
                               "lines.\n"
                               "\n"
                               "  -o FILE    what is written, whatever it\n"
                               "             is\n"
                               "  --a-term-that-stands-alone\n"
                               "             and its words\n"
                               "\n"
                               "Example:\n"
                               "  beamfit fit model.yaml \\\n"
                               "          --check tap3.csv\n"
                               "    key: kept as it is\n";
    (void)state;
    char *wide = helped(text, 60), *narrow = helped(text, 30);
    assert_string_equal(wide, "Usage: beamfit fit MODEL RECORD... [options]\n"
                              "\n"
                              "One paragraph in two lines.\n"
                              "\n"
                              "  -o FILE    what is written, whatever it is\n"
                              "  --a-term-that-stands-alone\n"
                              "             and its words\n"
                              "\n"
                              "Example:\n"
                              "  beamfit fit model.yaml --check tap3.csv\n"
                              "    key: kept as it is\n");
    assert_string_equal(narrow, "Usage: beamfit fit MODEL\n"
                                "               RECORD...\n"
                                "               [options]\n"
                                "\n"
                                "One paragraph in two lines.\n"
                                "\n"
                                "  -o FILE    what is written,\n"
                                "             whatever it is\n"
                                "  --a-term-that-stands-alone\n"
                                "             and its words\n"
                                "\n"
                                "Example:\n"
                                "  beamfit fit model.yaml \\\n"
                                "      --check tap3.csv\n"
                                "    key: kept as it is\n");
    free(wide);
    free(narrow);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(typing_errors_are_recognised),   cmocka_unit_test(something_else_is_not),
        cmocka_unit_test(wrapping_keeps_words_and_width), cmocka_unit_test(width_counts_characters),
        cmocka_unit_test(columns_from_the_environment),   cmocka_unit_test(help_fits_the_width),
    };
    return cmocka_run_group_tests_name("text", tests, NULL, NULL);
}
