/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A list of measured frequencies: one mode a line, in columns that a first line names, or "frequency_Hz[, sd_Hz[, damping_ratio[, damping_sd]]]"
 * without one.
 */
#include "record.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double highest_Hz = 1e9;
enum { MOST_CELLS = FREQUENCY_LIST_PLACES + 5 };

enum meaning { MODE, FREQUENCY, SD, DAMPING, DAMPING_SD, SHAPE, NOTHING };

/* What stands in the columns. */
struct columns {
    size_t n;
    enum meaning meaning[MOST_CELLS];
    size_t place[MOST_CELLS]; /* of a SHAPE */
    char separator;           /* ',': or ';', and cells may be empty; ' ': anything that separates */
    bool named;
};

struct cell {
    const char *from, *to;
};

static bool separates(char c, char separator)
{
    return c == ',' || c == ';' || (separator == ' ' && (c == ' ' || c == '\t'));
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '"';
}

/* Cells of a line, without blanks and quotes around; more than MOST_CELLS are counted and not kept. */
static size_t split(const char *s, const char *end, char separator, struct cell cells[MOST_CELLS])
{
    size_t n = 0;
    while (s <= end) {
        while (separator == ' ' && s < end && separates(*s, separator))
            s++;
        if (separator == ' ' && s == end)
            break;
        struct cell cell = {s, s};
        while (cell.to < end && !separates(*cell.to, separator))
            cell.to++;
        s = cell.to + 1;
        while (cell.from < cell.to && is_blank(*cell.from))
            cell.from++;
        while (cell.from < cell.to && is_blank(cell.to[-1]))
            cell.to--;
        if (n < MOST_CELLS)
            cells[n] = cell;
        n++;
    }
    return n;
}

/* ---- The line of names ---- */

static bool is(const struct cell *cell, const char *name)
{
    const size_t length = (size_t)(cell->to - cell->from);
    return strlen(name) == length && strncmp(cell->from, name, length) == 0;
}

/* "shape_at_0.12_m". */
static bool shape_place(const struct cell *cell, double *place_m)
{
    static const char before[] = "shape_at_", after[] = "_m";
    const size_t length = (size_t)(cell->to - cell->from), ends = sizeof before + sizeof after - 2;
    return length > ends && strncmp(cell->from, before, sizeof before - 1) == 0 &&
           strncmp(cell->to - 2, after, 2) == 0 &&
           number_parse(cell->from + sizeof before - 1, cell->to - 2, '.', place_m) && *place_m >= 0.0;
}

static enum meaning meaning_of(const struct cell *cell, enum meaning before)
{
    static const struct {
        const char *name;
        enum meaning meaning;
    } names[] = {{"mode", MODE},
                 {"freq_Hz", FREQUENCY},
                 {"frequency_Hz", FREQUENCY},
                 {"sd_Hz", SD},
                 {"damping_ratio", DAMPING},
                 {"damping", DAMPING},
                 {"damping_sd", DAMPING_SD}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (is(cell, names[i].name))
            return names[i].meaning;
    if (is(cell, "sd"))
        return before == DAMPING ? DAMPING_SD : SD;
    return NOTHING;
}

static bool has_meaning(const struct columns *columns, enum meaning meaning)
{
    for (size_t i = 0; i < columns->n; i++)
        if (columns->meaning[i] == meaning)
            return true;
    return false;
}

/* A line of names that says where the frequency is; any other first line of words leaves the columns as they are. */
static enum bf_status take_names(const char *s, const char *end, const struct lines *in, struct columns *out,
                                 struct frequency_list *list, struct bf_error *err)
{
    const size_t length = (size_t)(end - s);
    const char separator = memchr(s, ',', length) != NULL || memchr(s, ';', length) != NULL ? ',' : ' ';
    struct cell cells[MOST_CELLS];
    struct columns columns = {.separator = separator, .named = true};
    const size_t n = split(s, end, separator, cells);
    bool known = false;
    for (size_t i = 0; i < n && i < MOST_CELLS; i++)
        known = known || meaning_of(&cells[i], NOTHING) == FREQUENCY;
    if (!known)
        return BF_OK;
    if (n > MOST_CELLS)
        return bf_fail_at(err, in->path, in->number, "more than %d columns; leave some out", MOST_CELLS);
    for (; columns.n < n; columns.n++) {
        const struct cell *cell = &cells[columns.n];
        double place_m;
        enum meaning meaning = meaning_of(cell, columns.n > 0 ? columns.meaning[columns.n - 1] : NOTHING);
        if (meaning == NOTHING && shape_place(cell, &place_m) && list->n_places < FREQUENCY_LIST_PLACES) {
            meaning = SHAPE;
            columns.place[columns.n] = list->n_places;
            list->place_m[list->n_places++] = place_m;
        }
        if (meaning == NOTHING || (meaning != SHAPE && has_meaning(&columns, meaning)))
            return bf_fail_at(err, in->path, in->number,
                              "column %zu '%.*s': a list of frequencies has mode, freq_Hz, sd_Hz, damping_ratio, "
                              "damping_sd, shape_at_0.12_m, each once",
                              columns.n + 1, (int)(cell->to - cell->from < 60 ? cell->to - cell->from : 60),
                              cell->from);
        columns.meaning[columns.n] = meaning;
    }
    *out = columns;
    return BF_OK;
}

/* ---- Lines of numbers ---- */

static enum bf_status check(const struct measured_frequency *mode, double before, const struct lines *in,
                            struct bf_error *err)
{
    if (!(mode->frequency_Hz > before && mode->frequency_Hz <= highest_Hz))
        return bf_fail_at(err, in->path, in->number,
                          "frequency %.9g Hz; give frequencies above 0 in ascending order, one a line",
                          mode->frequency_Hz);
    if (!(mode->sd_Hz >= 0.0 && mode->sd_Hz < mode->frequency_Hz))
        return bf_fail_at(err, in->path, in->number,
                          "standard error %.9g Hz of %.9g Hz; the second number of a line is the frequency's standard "
                          "error in Hz",
                          mode->sd_Hz, mode->frequency_Hz);
    if (!isnan(mode->damping_ratio) && !(mode->damping_ratio >= 0.0 && mode->damping_ratio < 1.0))
        return bf_fail_at(err, in->path, in->number, "damping ratio %.9g; it lies between 0 and 1 (1 %% is 0.01)",
                          mode->damping_ratio);
    if (!(mode->damping_sd >= 0.0 && mode->damping_sd < 1.0))
        return bf_fail_at(err, in->path, in->number,
                          "standard error %.9g of the damping ratio; it lies between 0 and 1", mode->damping_sd);
    return BF_OK;
}

static enum bf_status fail_cell(const struct lines *in, struct bf_error *err)
{
    return bf_fail_at(err, in->path, in->number,
                      "not a mode; write frequency_Hz, and after a comma its standard error in Hz and "
                      "the damping ratio where they are known");
}

static void put(struct measured_frequency *mode, double shape[], const struct columns *columns, size_t i, double x)
{
    switch (columns->meaning[i]) {
    case MODE:
        mode->mode = x >= 1.0 && x <= 1000.0 && !(x > floor(x)) ? (size_t)x : SIZE_MAX;
        break;
    case FREQUENCY:
        mode->frequency_Hz = x;
        break;
    case SD:
        mode->sd_Hz = x;
        break;
    case DAMPING:
        mode->damping_ratio = x;
        break;
    case DAMPING_SD:
        mode->damping_sd = x;
        break;
    case SHAPE:
        shape[columns->place[i]] = x;
        break;
    case NOTHING:
        break;
    }
}

/* One mode; *numbers false: a cell is no number. */
static enum bf_status take(struct frequency_list *list, const struct columns *columns, const char *s, const char *end,
                           const struct lines *in, bool *numbers, struct bf_error *err)
{
    struct cell cells[MOST_CELLS];
    struct measured_frequency mode = {.damping_ratio = nan("")};
    double shape[FREQUENCY_LIST_PLACES];
    const size_t n = split(s, end, columns->separator, cells);
    *numbers = n <= columns->n;
    for (size_t p = 0; p < FREQUENCY_LIST_PLACES; p++)
        shape[p] = nan("");
    for (size_t i = 0; i < n && *numbers; i++) {
        double x;
        const bool open = columns->named && (cells[i].from == cells[i].to || is(&cells[i], "-"));
        if (open)
            continue;
        *numbers = number_parse(cells[i].from, cells[i].to, '.', &x);
        if (*numbers)
            put(&mode, shape, columns, i, x);
    }
    if (!*numbers)
        return fail_cell(in, err);
    if (mode.mode == SIZE_MAX)
        return bf_fail_at(err, in->path, in->number, "mode: write 1 for the lowest, 2 for the next, ...");
    const enum bf_status status = check(&mode, list->n > 0 ? list->modes[list->n - 1].frequency_Hz : 0.0, in, err);
    if (status != BF_OK)
        return status;
    if (list->n == FREQUENCY_LIST_MOST)
        return bf_fail_at(err, in->path, in->number, "more than %d frequencies; keep the lowest", FREQUENCY_LIST_MOST);
    list->modes = bf_grow(list->modes, list->n + 1, sizeof *list->modes);
    list->shape = bf_grow(list->shape, (list->n + 1) * (list->n_places + 1), sizeof *list->shape);
    for (size_t p = 0; p < list->n_places; p++)
        list->shape[list->n * list->n_places + p] = shape[p];
    list->modes[list->n++] = mode;
    return BF_OK;
}

static enum bf_status read_lines(struct lines *in, struct frequency_list *out, struct bf_error *err)
{
    struct columns columns = {.n = 4, .meaning = {FREQUENCY, SD, DAMPING, DAMPING_SD}, .separator = ' '};
    const char *text = NULL;
    size_t length = 0;
    bool header = true;
    enum bf_status status;
    while ((status = lines_next(in, &text, &length, err)) == BF_OK && text != NULL) {
        const char *end = text + length;
        bool numbers = true;
        while (text < end && is_blank(*text))
            text++;
        if (text == end || *text == '#')
            continue;
        const bool words = isalpha((unsigned char)*text);
        status = take(out, &columns, text, end, in, &numbers, err);
        if (!numbers && header && out->n == 0 && words)
            status = take_names(text, end, in, &columns, out, err);
        header = header && numbers;
        if (status != BF_OK)
            return status;
    }
    return status;
}

enum bf_status frequency_list_read(const char *path, struct frequency_list *out, struct bf_error *err)
{
    struct lines in;
    *out = (struct frequency_list){0};
    enum bf_status status = lines_open(path, &in, err);
    if (status != BF_OK)
        return status;
    status = read_lines(&in, out, err);
    if (status == BF_OK)
        hash_end(&in.hash, out->sha256);
    lines_close(&in);
    if (status == BF_OK && out->n == 0)
        status = bf_fail_at(err, path, 1, "no frequency in it; write one a line, in Hz");
    if (status != BF_OK)
        frequency_list_free(out);
    return status;
}

void frequency_list_free(struct frequency_list *list)
{
    free(list->modes);
    free(list->shape);
    *list = (struct frequency_list){0};
}

/* ---- As a record ---- */

bool frequency_list_begins(const char *line, const char *end)
{
    struct cell cells[MOST_CELLS];
    const size_t n = split(line, end, ' ', cells);
    if (n == 0 || memchr(line, '/', (size_t)(end - line)) != NULL)
        return false;
    const enum meaning first = meaning_of(&cells[0], NOTHING);
    double place_m;
    return first == MODE || is(&cells[0], "frequency_Hz") ||
           (first == FREQUENCY &&
            (n == 1 || meaning_of(&cells[1], first) != NOTHING || shape_place(&cells[1], &place_m)));
}

enum { LIST_COLUMNS = 5 };
static const char *const list_columns[LIST_COLUMNS] = {"mode", "frequency_Hz", "sd_Hz", "damping_ratio", "damping_sd"};

void frequency_list_to_record(const struct frequency_list *list, const char *path, struct record *out)
{
    double *x = bf_alloc(list->n, sizeof *x);
    *out = (struct record){.kind = RECORD_FREQUENCIES, .n = list->n, .dt_s = 1.0};
    out->path = path != NULL ? bf_strdup(path) : NULL;
    memcpy(out->sha256, list->sha256, sizeof out->sha256);
    for (int c = 0; c < LIST_COLUMNS; c++) {
        for (size_t i = 0; i < list->n; i++) {
            const struct measured_frequency *m = &list->modes[i];
            const double cell[LIST_COLUMNS] = {(double)m->mode, m->frequency_Hz, m->sd_Hz, m->damping_ratio,
                                               m->damping_sd};
            x[i] = cell[c];
        }
        record_add_column(out, list_columns[c], x);
    }
    free(x);
}

void frequency_list_of_record(const struct record *record, struct frequency_list *out)
{
    const double *x[LIST_COLUMNS];
    *out = (struct frequency_list){.n = record->n, .modes = bf_alloc(record->n, sizeof *out->modes)};
    for (int c = 0; c < LIST_COLUMNS; c++)
        x[c] = record_column(record, list_columns[c]);
    for (size_t i = 0; i < record->n; i++)
        out->modes[i] = (struct measured_frequency){.mode = (size_t)x[0][i],
                                                    .frequency_Hz = x[1][i],
                                                    .sd_Hz = x[2][i],
                                                    .damping_ratio = x[3][i],
                                                    .damping_sd = x[4][i]};
}
