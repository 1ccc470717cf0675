/* SPDX-License-Identifier: GPL-3.0-or-later */
/* RESULTS — the only file that sees SQLite. */
#include "fleet.h"

#include <math.h>
#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FORMAT "beamfit-fleet/1"
enum { APPLICATION = 0x42465431 }; /* in the file's head, so that file(1) and we know it */

struct fleet_results {
    sqlite3 *db;
    char *path;
    sqlite3_stmt *insert[FLEET_STORED], *forget[FLEET_STORED], *identity;
    bool open; /* a transaction, with units that fleet_results_commit() is to write */
};

static enum bf_status failed(const struct fleet_results *r, struct bf_error *err)
{
    const int code = sqlite3_errcode(r->db);
    if (code == SQLITE_BUSY || code == SQLITE_LOCKED)
        return bf_fail(err, BF_BAD_FILE, "%s: is being written by another run; wait for it, or end it", r->path);
    return bf_fail(err, BF_BAD_FILE, "%s: %s; is it a file of `beamfit fleet`, and is there room on the disk?", r->path,
                   sqlite3_errmsg(r->db));
}

static enum bf_status run_sql(struct fleet_results *r, const char *sql, struct bf_error *err)
{
    return sqlite3_exec(r->db, sql, NULL, NULL, NULL) == SQLITE_OK ? BF_OK : failed(r, err);
}

/* ---- Questions ---- */

static void read_row(sqlite3_stmt *s, struct fleet_value values[FLEET_COLUMNS], int n)
{
    for (int k = 0; k < n; k++) {
        const int type = sqlite3_column_type(s, k);
        values[k] = (struct fleet_value){.number = nan(""), .text = ""};
        if (type == SQLITE_NULL)
            continue;
        values[k].kind = type == SQLITE_INTEGER ? 'i' : type == SQLITE_FLOAT ? 'n' : 't';
        if (values[k].kind == 't')
            values[k].text = (const char *)sqlite3_column_text(s, k);
        else
            values[k].number = sqlite3_column_double(s, k);
    }
}

enum bf_status fleet_results_ask(struct fleet_results *r, const char *sql, const char *argument, fleet_take *take,
                                 void *context, struct bf_error *err)
{
    sqlite3_stmt *s;
    struct fleet_value values[FLEET_COLUMNS];
    int code = sqlite3_prepare_v2(r->db, sql, -1, &s, NULL);
    if (code != SQLITE_OK)
        return failed(r, err);
    if (argument != NULL)
        (void)sqlite3_bind_text(s, 1, argument, -1, SQLITE_STATIC);
    const int n = sqlite3_column_count(s) < FLEET_COLUMNS ? sqlite3_column_count(s) : FLEET_COLUMNS;
    bool go_on = true;
    while (go_on && (code = sqlite3_step(s)) == SQLITE_ROW) {
        read_row(s, values, n);
        go_on = take(context, values, (size_t)n);
    }
    const enum bf_status status = code == SQLITE_DONE || code == SQLITE_ROW ? BF_OK : failed(r, err);
    (void)sqlite3_finalize(s);
    return status;
}

static bool take_text(void *context, const struct fleet_value values[], size_t n)
{
    char *text = context;
    (void)snprintf(text, FLEET_NAME, "%s", n > 0 ? values[0].text : "");
    return false;
}

static bool take_number(void *context, const struct fleet_value values[], size_t n)
{
    *(double *)context = n > 0 ? values[0].number : 0.0;
    return false;
}

/* ---- Opening ---- */

static enum bf_status open_file(const char *path, int flags, struct fleet_results **out, struct bf_error *err)
{
    enum { PATIENCE_MS = 2000 };
    struct fleet_results *r = bf_alloc(1, sizeof *r);
    r->path = bf_strdup(path);
    *out = r;
    if (sqlite3_open_v2(path, &r->db, flags, NULL) != SQLITE_OK) {
        const enum bf_status status = bf_fail(err, BF_BAD_FILE, "%s: cannot be opened (%s)", path,
                                              r->db != NULL ? sqlite3_errmsg(r->db) : "memory is out");
        fleet_results_close(r);
        *out = NULL;
        return status;
    }
    (void)sqlite3_busy_timeout(r->db, PATIENCE_MS);
    return BF_OK;
}

static enum bf_status is_ours(struct fleet_results *r, struct bf_error *err)
{
    double application = 0.0, pages = 1.0;
    struct bf_error unread;
    if (fleet_results_ask(r, "PRAGMA application_id", NULL, take_number, &application, &unread) != BF_OK) {
        if (sqlite3_errcode(r->db) != SQLITE_NOTADB)
            return failed(r, err);
    } else if ((int)application == APPLICATION) {
        return BF_OK;
    } else if (fleet_results_ask(r, "PRAGMA page_count", NULL, take_number, &pages, &unread) == BF_OK && pages < 1.0) {
        return BF_OK; /* empty: of a run that was killed before its first row, too */
    }
    return bf_fail(err, BF_USAGE, "%s: exists, and `beamfit fleet` has not made it; choose another name", r->path);
}

static enum bf_status make_tables(struct fleet_results *r, struct bf_error *err)
{
    char sql[1024];
    (void)snprintf(sql, sizeof sql,
                   "PRAGMA application_id = %d;"
                   "CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT);"
                   "CREATE TABLE IF NOT EXISTS manifest (unit TEXT PRIMARY KEY, place INTEGER, model TEXT);"
                   "CREATE TABLE IF NOT EXISTS columns (unit TEXT, name TEXT, value TEXT, PRIMARY KEY (unit, name));"
                   "INSERT OR REPLACE INTO meta VALUES ('format', '" FORMAT "'), ('version', '" BEAMFIT_VERSION "');",
                   (int)APPLICATION);
    enum bf_status status = run_sql(r, sql, err);
    for (int t = 0; t < FLEET_STORED && status == BF_OK; t++) {
        const char *name = fleet_table_name((enum fleet_table)t);
        (void)snprintf(sql, sizeof sql,
                       "CREATE TABLE IF NOT EXISTS %s (unit TEXT%s, %s);"
                       "CREATE INDEX IF NOT EXISTS %s_of_unit ON %s (unit);",
                       name, t == FLEET_UNITS ? " PRIMARY KEY" : "", fleet_table_sql((enum fleet_table)t), name, name);
        status = run_sql(r, sql, err);
    }
    return status;
}

static enum bf_status prepare(struct fleet_results *r, const char *sql, sqlite3_stmt **out, struct bf_error *err)
{
    return sqlite3_prepare_v2(r->db, sql, -1, out, NULL) == SQLITE_OK ? BF_OK : failed(r, err);
}

static enum bf_status prepare_all(struct fleet_results *r, struct bf_error *err)
{
    char sql[256];
    enum bf_status status =
        prepare(r, "SELECT identity FROM units WHERE unit = ?1 AND status <> 'killed'", &r->identity, err);
    for (int t = 0; t < FLEET_STORED && status == BF_OK; t++) {
        const char *name = fleet_table_name((enum fleet_table)t);
        int n = snprintf(sql, sizeof sql, "INSERT INTO %s VALUES (?", name);
        for (size_t k = 0; k < strlen(fleet_table_kinds((enum fleet_table)t)); k++)
            n += snprintf(sql + n, sizeof sql - (size_t)n, ", ?");
        (void)snprintf(sql + n, sizeof sql - (size_t)n, ")");
        status = prepare(r, sql, &r->insert[t], err);
        (void)snprintf(sql, sizeof sql, "DELETE FROM %s WHERE unit = ?1", name);
        if (status == BF_OK)
            status = prepare(r, sql, &r->forget[t], err);
    }
    return status;
}

/* ---- The manifest in the file ---- */

static enum bf_status step(struct fleet_results *r, sqlite3_stmt *s, struct bf_error *err)
{
    const int code = sqlite3_step(s);
    (void)sqlite3_reset(s);
    return code == SQLITE_DONE ? BF_OK : failed(r, err);
}

static void bind_text(sqlite3_stmt *s, int at, const char *text)
{
    (void)sqlite3_bind_text(s, at, text, -1, SQLITE_TRANSIENT);
}

static enum bf_status write_unit(struct fleet_results *r, const struct fleet_manifest *m, size_t i, sqlite3_stmt *unit,
                                 sqlite3_stmt *column, struct bf_error *err)
{
    bind_text(unit, 1, m->units[i].name);
    (void)sqlite3_bind_int64(unit, 2, (sqlite3_int64)i);
    bind_text(unit, 3, m->units[i].model);
    enum bf_status status = step(r, unit, err);
    for (size_t k = 0; k < m->n_columns && status == BF_OK; k++) {
        bind_text(column, 1, m->units[i].name);
        bind_text(column, 2, m->columns[k]);
        bind_text(column, 3, m->units[i].cells[k]);
        status = step(r, column, err);
    }
    return status;
}

/* Columns may have changed since the units were fitted: those of now hold. */
static enum bf_status write_manifest(struct fleet_results *r, const struct fleet_manifest *m, struct bf_error *err)
{
    char gone[FLEET_NAME] = "";
    sqlite3_stmt *unit = NULL, *column = NULL;
    enum bf_status status = run_sql(r, "DELETE FROM manifest; DELETE FROM columns;", err);
    if (status == BF_OK)
        status = prepare(r, "INSERT INTO manifest VALUES (?1, ?2, ?3)", &unit, err);
    if (status == BF_OK)
        status = prepare(r, "INSERT INTO columns VALUES (?1, ?2, ?3)", &column, err);
    for (size_t i = 0; i < m->n && status == BF_OK; i++)
        status = write_unit(r, m, i, unit, column, err);
    (void)sqlite3_finalize(unit), (void)sqlite3_finalize(column);
    if (status == BF_OK)
        status = fleet_results_ask(r, "SELECT unit FROM units WHERE unit NOT IN (SELECT unit FROM manifest)", NULL,
                                   take_text, gone, err);
    if (status == BF_OK && gone[0] != '\0')
        return bf_fail(err, BF_USAGE,
                       "%s: has unit '%s', which the manifest has not; choose another name for a run of another "
                       "manifest",
                       r->path, gone);
    return status;
}

enum bf_status fleet_results_open(const char *path, const struct fleet_manifest *manifest, struct fleet_results **out,
                                  struct bf_error *err)
{
    const bool exists = access(path, F_OK) == 0;
    enum bf_status status = open_file(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, out, err);
    if (status != BF_OK)
        return status;
    struct fleet_results *r = *out;
    if (exists)
        status = is_ours(r, err);
    if (status == BF_OK) /* one writer: the lock is kept until the file is closed */
        status = run_sql(r, "PRAGMA locking_mode = EXCLUSIVE; PRAGMA synchronous = FULL; BEGIN EXCLUSIVE;", err);
    if (status == BF_OK)
        status = make_tables(r, err);
    if (status == BF_OK)
        status = write_manifest(r, manifest, err);
    if (status == BF_OK)
        status = run_sql(r, "COMMIT", err);
    if (status == BF_OK)
        status = prepare_all(r, err);
    if (status != BF_OK) {
        fleet_results_close(r);
        *out = NULL;
    }
    return status;
}

enum bf_status fleet_results_read(const char *path, struct fleet_results **out, struct bf_error *err)
{
    enum bf_status status = open_file(path, SQLITE_OPEN_READONLY, out, err);
    if (status == BF_OK && (status = is_ours(*out, err)) != BF_OK) {
        fleet_results_close(*out);
        *out = NULL;
    }
    return status;
}

void fleet_results_close(struct fleet_results *r)
{
    if (r == NULL)
        return;
    (void)sqlite3_finalize(r->identity);
    for (int t = 0; t < FLEET_STORED; t++)
        (void)sqlite3_finalize(r->insert[t]), (void)sqlite3_finalize(r->forget[t]);
    (void)sqlite3_close(r->db);
    free(r->path);
    free(r);
}

/* ---- Units ---- */

void fleet_results_identity(struct fleet_results *r, const char *unit, char identity[65])
{
    identity[0] = '\0';
    bind_text(r->identity, 1, unit);
    if (sqlite3_step(r->identity) == SQLITE_ROW) {
        const unsigned char *text = sqlite3_column_text(r->identity, 0);
        (void)snprintf(identity, 65, "%s", text != NULL ? (const char *)text : "");
    }
    (void)sqlite3_reset(r->identity);
}

static enum bf_status insert(struct fleet_results *r, const char *unit, enum fleet_table table,
                             const struct fleet_value values[], struct bf_error *err)
{
    sqlite3_stmt *s = r->insert[table];
    bind_text(s, 1, unit);
    for (int k = 0; k < (int)strlen(fleet_table_kinds(table)); k++) {
        if (values[k].kind == 't')
            bind_text(s, k + 2, values[k].text);
        else if (values[k].kind == 'i')
            (void)sqlite3_bind_int64(s, k + 2, (sqlite3_int64)values[k].number);
        else if (values[k].kind == 'n')
            (void)sqlite3_bind_double(s, k + 2, values[k].number);
        else
            (void)sqlite3_bind_null(s, k + 2);
    }
    return step(r, s, err);
}

/* All of a unit, or nothing of it. */
static enum bf_status store(struct fleet_results *r, const char *unit, const struct fleet_rows *rows,
                            struct bf_error *err)
{
    struct fleet_value values[FLEET_COLUMNS];
    enum fleet_table table;
    size_t at = 0;
    enum bf_status status = run_sql(r, "SAVEPOINT unit", err);
    for (int t = 0; t < FLEET_STORED && status == BF_OK; t++) {
        bind_text(r->forget[t], 1, unit);
        status = step(r, r->forget[t], err);
    }
    while (status == BF_OK && fleet_rows_next(rows->bytes, rows->n, &at, &table, values) && table < FLEET_STORED)
        status = insert(r, unit, table, values, err);
    if (status == BF_OK && at < rows->n)
        status = bf_fail(err, BF_NUMERIC, "unit %s: what its process said cannot be read", unit);
    return status == BF_OK ? run_sql(r, "RELEASE unit", err) : status;
}

enum bf_status fleet_results_store(struct fleet_results *r, const char *unit, const struct fleet_rows *rows,
                                   struct bf_error *err)
{
    struct bf_error ignored;
    if (!r->open && run_sql(r, "BEGIN", err) != BF_OK)
        return err->status;
    r->open = true;
    const enum bf_status status = store(r, unit, rows, err);
    if (status != BF_OK)
        (void)run_sql(r, "ROLLBACK TO unit; RELEASE unit", &ignored);
    return status;
}

enum bf_status fleet_results_commit(struct fleet_results *r, struct bf_error *err)
{
    struct bf_error ignored;
    if (!r->open)
        return BF_OK;
    r->open = false;
    const enum bf_status status = run_sql(r, "COMMIT", err);
    if (status != BF_OK)
        (void)run_sql(r, "ROLLBACK", &ignored);
    return status;
}
