/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The units of a fleet, read from a CSV file. */
#include "csv.h"
#include "fleet.h"

#include <stdlib.h>
#include <string.h>

enum { UNIT, MODEL, RECORDS, CHECKS, NAMED };
static const char *const named[NAMED] = {"unit", "model", "records", "checks"};

static void take_files(const char *manifest, char *cell, struct fleet_files *out)
{
    const char *between = strchr(cell, ';') != NULL ? ";" : " \t";
    char *rest = NULL;
    for (char *name = strtok_r(cell, between, &rest); name != NULL; name = strtok_r(NULL, between, &rest)) {
        name = csv_without_blanks(name);
        if (*name == '\0')
            continue;
        out->names = bf_grow(out->names, out->n + 1, sizeof *out->names);
        out->names[out->n++] = csv_place(manifest, name);
    }
}

/* Where each column of the file goes: at[NAMED] of the named ones (n: absent), the others are the user's. */
struct header {
    size_t n, at[NAMED];
};

static enum bf_status take_header(const struct lines *in, const struct csv_cells *cells, struct header *header,
                                  struct fleet_manifest *out, struct bf_error *err)
{
    header->n = cells->n;
    for (size_t k = 0; k < NAMED; k++)
        header->at[k] = cells->n;
    for (size_t i = 0; i < cells->n; i++) {
        size_t k = 0;
        while (k < NAMED && strcmp(cells->text[i], named[k]) != 0)
            k++;
        for (size_t j = 0; j < i; j++)
            if (strcmp(cells->text[i], cells->text[j]) == 0)
                return bf_fail_at(err, in->path, in->number, "two columns are called '%.60s'; call one otherwise",
                                  cells->text[i]);
        if (cells->text[i][0] == '\0')
            return bf_fail_at(err, in->path, in->number, "column %zu has no name; give it one", i + 1);
        if (k < NAMED) {
            header->at[k] = i;
            continue;
        }
        out->columns = bf_grow(out->columns, out->n_columns + 1, sizeof *out->columns);
        out->columns[out->n_columns++] = bf_strdup(cells->text[i]);
    }
    for (size_t k = 0; k < CHECKS; k++)
        if (header->at[k] == cells->n)
            return bf_fail_at(err, in->path, in->number,
                              "no column '%s'; the first line of a manifest names the columns: unit,model,records,"
                              "checks and any others",
                              named[k]);
    return BF_OK;
}

static enum bf_status take_unit(const struct lines *in, const struct header *header, struct csv_cells *cells,
                                struct fleet_manifest *out, struct bf_error *err)
{
    if (cells->n != header->n)
        return bf_fail_at(err, in->path, in->number, "%zu cells where the header has %zu; quote a cell with a comma",
                          cells->n, header->n);
    const char *name = cells->text[header->at[UNIT]];
    if (name[0] == '\0' || strlen(name) >= FLEET_NAME)
        return bf_fail_at(err, in->path, in->number, "the unit has %s; give it a short name of its own",
                          name[0] == '\0' ? "no name" : "a name that is too long");
    out->units = bf_grow(out->units, out->n + 1, sizeof *out->units);
    struct fleet_unit *unit = &out->units[out->n++];
    *unit = (struct fleet_unit){.name = bf_strdup(name), .model = csv_place(in->path, cells->text[header->at[MODEL]])};
    unit->cells = bf_alloc(out->n_columns, sizeof *unit->cells);
    for (size_t i = 0, k = 0; i < cells->n; i++)
        if (i != header->at[UNIT] && i != header->at[MODEL] && i != header->at[RECORDS] && i != header->at[CHECKS])
            unit->cells[k++] = bf_strdup(cells->text[i]);
    take_files(in->path, cells->text[header->at[RECORDS]], &unit->records);
    if (header->at[CHECKS] < cells->n)
        take_files(in->path, cells->text[header->at[CHECKS]], &unit->checks);
    return BF_OK;
}

static int by_name(const void *a, const void *b)
{
    return strcmp((*(const struct fleet_unit *const *)a)->name, (*(const struct fleet_unit *const *)b)->name);
}

static enum bf_status check_names(const char *path, const struct fleet_manifest *manifest, struct bf_error *err)
{
    const struct fleet_unit **sorted = bf_alloc(manifest->n, sizeof *sorted);
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < manifest->n; i++)
        sorted[i] = &manifest->units[i];
    qsort(sorted, manifest->n, sizeof *sorted, by_name);
    for (size_t i = 1; i < manifest->n && status == BF_OK; i++)
        if (strcmp(sorted[i - 1]->name, sorted[i]->name) == 0)
            status =
                bf_fail_at(err, path, 0, "two units are called '%s'; give each a name of its own", sorted[i]->name);
    free(sorted);
    if (status == BF_OK && manifest->n == 0)
        return bf_fail_at(err, path, 0, "no unit; write a line for each below the header");
    return status;
}

enum bf_status fleet_manifest_parse(const char *path, const char *text, size_t n, struct fleet_manifest *out,
                                    struct bf_error *err)
{
    struct lines in;
    struct header header = {0};
    struct csv_cells cells = {0};
    bool more;
    *out = (struct fleet_manifest){0};
    lines_from_memory(path, text, n, &in);
    enum bf_status status;
    while ((status = csv_next(&in, &cells, &more, err)) == BF_OK && more) {
        status =
            header.n == 0 ? take_header(&in, &cells, &header, out, err) : take_unit(&in, &header, &cells, out, err);
        if (status != BF_OK)
            break;
    }
    free(cells.buffer);
    if (status == BF_OK)
        status = check_names(path, out, err);
    hash_sha256_hex(text, n, out->sha256);
    if (status != BF_OK)
        fleet_manifest_free(out);
    return status;
}

enum bf_status fleet_manifest_read(const char *path, struct fleet_manifest *out, struct bf_error *err)
{
    char *text, sha256[65];
    size_t n;
    *out = (struct fleet_manifest){0};
    if (lines_read_all(path, &text, &n, sha256, err) != BF_OK)
        return err->status;
    outputs_note_input(path);
    const enum bf_status status = fleet_manifest_parse(path, text, n, out, err);
    free(text);
    return status;
}

enum bf_status fleet_list_read(const char *path, struct fleet_files *out, struct bf_error *err)
{
    struct lines in;
    const char *text;
    size_t n;
    if (lines_open(path, &in, err) != BF_OK)
        return err->status;
    enum bf_status status;
    while ((status = lines_next(&in, &text, &n, err)) == BF_OK && text != NULL) {
        char *line = bf_alloc(n + 1, 1);
        memcpy(line, text, n);
        const char *name = csv_without_blanks(line);
        if (*name != '\0' && *name != '#') {
            out->names = bf_grow(out->names, out->n + 1, sizeof *out->names);
            out->names[out->n++] = csv_place(path, name);
        }
        free(line);
    }
    lines_close(&in);
    outputs_note_input(path);
    return status;
}

void fleet_files_free(struct fleet_files *files)
{
    for (size_t i = 0; i < files->n; i++)
        free(files->names[i]);
    free(files->names);
    *files = (struct fleet_files){0};
}

void fleet_manifest_free(struct fleet_manifest *manifest)
{
    for (size_t i = 0; i < manifest->n; i++) {
        struct fleet_unit *unit = &manifest->units[i];
        for (size_t k = 0; k < manifest->n_columns && unit->cells != NULL; k++)
            free(unit->cells[k]);
        fleet_files_free(&unit->records), fleet_files_free(&unit->checks);
        free(unit->cells), free(unit->name), free(unit->model);
    }
    for (size_t k = 0; k < manifest->n_columns; k++)
        free(manifest->columns[k]);
    free(manifest->columns), free(manifest->units);
    *manifest = (struct fleet_manifest){0};
}
