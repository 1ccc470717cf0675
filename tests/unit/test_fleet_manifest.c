/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "fleet/fleet.h"

static enum bf_status parse(const char *text, struct fleet_manifest *m, struct bf_error *err)
{
    return fleet_manifest_parse("here/units.csv", text, strlen(text), m, err);
}

static void cells_go_where_the_header_says(void **state)
{
    (void)state;
    struct fleet_manifest m;
    struct bf_error err;
    static const char text[] = "# made by hand\n"
                               " date ,unit,checks,\"the \"\"model\"\"\",model,records\r\n"
                               "2026-01-02, u1 ,,\"x, y\",m.yaml,\"a.csv  b.csv\"\n"
                               "\n"
                               ",u 2,c 1.csv;,, /top/m.yaml , a b.csv ; c.csv;\n";
    assert_int_equal(parse(text, &m, &err), BF_OK);
    assert_int_equal(m.n, 2);
    assert_int_equal(m.n_columns, 2);
    assert_string_equal(m.columns[0], "date");
    assert_string_equal(m.columns[1], "the \"model\"");
    assert_string_equal(m.units[0].name, "u1");
    assert_string_equal(m.units[0].model, "here/m.yaml");
    assert_string_equal(m.units[0].cells[1], "x, y");
    assert_int_equal(m.units[0].records.n, 2);
    assert_string_equal(m.units[0].records.names[1], "here/b.csv");
    assert_int_equal(m.units[0].checks.n, 0);
    assert_string_equal(m.units[1].name, "u 2");
    assert_string_equal(m.units[1].model, "/top/m.yaml");
    assert_int_equal(m.units[1].records.n, 2);
    assert_string_equal(m.units[1].records.names[0], "here/a b.csv");
    assert_string_equal(m.units[1].checks.names[0], "here/c 1.csv");
    assert_string_equal(m.units[1].cells[0], "");
    fleet_manifest_free(&m);
}

/* A unit without files is for its own row to say, not for the manifest. */
static void empty_cells_are_units(void **state)
{
    (void)state;
    struct fleet_manifest m;
    struct bf_error err;
    assert_int_equal(parse("unit,model,records\nu1,,\n", &m, &err), BF_OK);
    assert_int_equal(m.n, 1);
    assert_string_equal(m.units[0].model, "");
    assert_int_equal(m.units[0].records.n, 0);
    fleet_manifest_free(&m);
}

static void refuses(const char *text, const char *words)
{
    struct fleet_manifest m;
    struct bf_error err = {BF_OK, ""};
    assert_int_equal(parse(text, &m, &err), BF_BAD_FILE);
    if (strstr(err.text, words) == NULL)
        fail_msg("'%s' has no '%s'", err.text, words);
    assert_null(m.units);
}

static void what_is_no_manifest_is_refused(void **state)
{
    (void)state;
    refuses("", "no unit");
    refuses("unit,model,records\n", "no unit");
    refuses("unit,model\nu,m\n", "units.csv:1: no column 'records'");
    refuses("unit,model,records,model\n", "two columns are called 'model'");
    refuses("unit,model,records,\n", "column 4 has no name");
    refuses("unit,model,records\nu,m\n", "units.csv:2: 2 cells where the header has 3");
    refuses("unit,model,records\n,m,r\n", "no name");
    refuses("unit,model,records\n\"u,m,r\n", "quote that is not closed");
    refuses("unit,model,records\n\"u\"x,m,r\n", "quote that is not closed");
    refuses("unit,model,records\nu,m,r\nv,m,r\nu,m,r\n", "two units are called 'u'");
}

static void rows_come_back_as_they_were(void **state)
{
    (void)state;
    struct fleet_rows rows = {0};
    struct fleet_value v[FLEET_COLUMNS];
    enum fleet_table table;
    size_t at = 0;
    fleet_row(&rows, FLEET_COVARIANCES, "a", "", 0.1);
    fleet_row(&rows, FLEET_EFFECTS, -3, "tip_mass", NULL, "mass_kg", (double)NAN, -0.0, "kg");
    assert_true(fleet_rows_next(rows.bytes, rows.n, &at, &table, v));
    assert_int_equal(table, FLEET_COVARIANCES);
    assert_string_equal(v[0].text, "a");
    assert_string_equal(v[1].text, "");
    assert_true(v[1].kind == 't' && v[2].kind == 'n' && v[2].number == 0.1);
    assert_true(fleet_rows_next(rows.bytes, rows.n, &at, &table, v));
    assert_true(v[0].kind == 'i' && v[0].number == -3.0 && v[2].kind == '\0' && v[4].kind == '\0');
    assert_true(v[5].number == 0.0 && signbit(v[5].number));
    assert_false(fleet_rows_next(rows.bytes, rows.n, &at, &table, v));
    assert_int_equal(at, rows.n);
    for (size_t n = 0; n < rows.n; n++) { /* cut anywhere: the end, or no rows */
        for (at = 0; fleet_rows_next(rows.bytes, n, &at, &table, v);)
            ;
        assert_true(at <= n);
    }
    fleet_rows_free(&rows);
}

static void other_bytes_are_no_rows(void **state)
{
    (void)state;
    struct fleet_value v[FLEET_COLUMNS];
    enum fleet_table table;
    static const unsigned char wrong_kind[] = {FLEET_WARNINGS, 'n', 0, 0, 0, 0, 0, 0, 0, 0}, wrong_table[] = {200};
    size_t at = 0;
    assert_false(fleet_rows_next(wrong_kind, sizeof wrong_kind, &at, &table, v));
    assert_int_equal(table, FLEET_TABLES);
    at = 0;
    assert_false(fleet_rows_next(wrong_table, sizeof wrong_table, &at, &table, v));
    assert_int_equal(table, FLEET_TABLES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_go_where_the_header_says), cmocka_unit_test(empty_cells_are_units),
        cmocka_unit_test(what_is_no_manifest_is_refused), cmocka_unit_test(rows_come_back_as_they_were),
        cmocka_unit_test(other_bytes_are_no_rows),
    };
    return cmocka_run_group_tests_name("fleet_manifest", tests, NULL, NULL);
}
