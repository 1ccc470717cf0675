/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Foreign text tables: any of the separators , ; tab and blanks, decimal point or comma, with or without a header row,
 * a row of units, and lines of other text above. What is used is the longest run of rows of numbers with equally many
 * cells among the first lines; from there on every line must be such a row.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "import_channel.h"
#include "import_format.h"
#include "import_units.h"
#include "ground/ground.h"

enum { SAMPLE = 400, MOST_CELLS = 4096, SHOWN = 40 };

struct dialect {
    char separator, point;
};

/* A cell of a line: quotes and blanks around it removed. */
struct cell {
    const char *s, *end;
};

struct table {
    const char *path;
    struct dialect dialect;
    size_t n_rows;           /* of the sample */
    struct cell row[SAMPLE]; /* whole lines */
    long line[SAMPLE];
    size_t first, run; /* first row of numbers in the sample and how many follow each other */
    size_t n_cells;    /* in each of them */
};

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static struct cell trim(struct cell c)
{
    while (c.s < c.end && is_blank(*c.s))
        c.s++;
    while (c.s < c.end && is_blank(c.end[-1]))
        c.end--;
    if (c.end - c.s >= 2 && (*c.s == '"' || *c.s == '\'') && c.end[-1] == *c.s) {
        c.s++;
        c.end--;
    }
    return c;
}

/* Takes the next cell off the line; false when none is left. Separators within quotes do not separate. */
static bool next_cell(struct cell *line, char separator, struct cell *out)
{
    const char *s = line->s;
    if (s > line->end)
        return false;
    if (separator == ' ') {
        while (s < line->end && is_blank(*s))
            s++;
        if (s == line->end)
            return false;
    }
    const char *from = s;
    for (char quote = '\0'; s < line->end; s++) {
        if (quote != '\0' ? *s == quote : (*s == '"' && memchr(s + 1, '"', (size_t)(line->end - s - 1)) != NULL))
            quote = quote != '\0' ? '\0' : *s;
        else if (quote == '\0' && (separator == ' ' ? is_blank(*s) : *s == separator))
            break;
    }
    *out = trim((struct cell){from, s});
    line->s = s + 1;
    return true;
}

static bool is_missing(struct cell c)
{
    static const char *const words[] = {"", "nan", "n/a", "na", "-", "--", "null", "#n/a"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strlen(words[i]) == (size_t)(c.end - c.s) && strncasecmp(words[i], c.s, (size_t)(c.end - c.s)) == 0)
            return true;
    return false;
}

/* "1," is no number with a decimal comma. */
static bool cell_number(struct cell c, char point, double *x)
{
    return (point == '.' || c.s == c.end || c.end[-1] != point) && number_parse(c.s, c.end, point, x);
}

/* Cells of a row of numbers, 0 for any other line; *trailing: the last one is empty. */
static size_t count_numbers(struct cell line, struct dialect dialect, bool *trailing)
{
    size_t cells = 0, numbers = 0;
    struct cell cell;
    *trailing = false;
    while (next_cell(&line, dialect.separator, &cell)) {
        double x;
        if (cell_number(cell, dialect.point, &x))
            numbers++;
        else if (!is_missing(cell))
            return 0;
        *trailing = cell.s == cell.end;
        if (++cells > MOST_CELLS)
            return 0;
    }
    return numbers > 0 ? cells : 0;
}

/*
 * The longest run of equally long rows of numbers in the sample. An empty last cell stands behind a separator at the
 * end of the line, or is a missing value, whichever fits.
 */
static void find_run(const struct table *t, struct dialect dialect, size_t *first, size_t *run, size_t *n_cells)
{
    size_t start = 0, current = 0;
    *first = *run = *n_cells = 0;
    for (size_t i = 0; i < t->n_rows; i++) {
        bool trailing;
        size_t cells = count_numbers(t->row[i], dialect, &trailing);
        if (cells == 0 || (cells != current && !(trailing && cells == current + 1))) {
            start = i;
            current = trailing && cells > 1 ? cells - 1 : cells;
        }
        if (current > 0 && i - start + 1 > *run) {
            *run = i - start + 1;
            *first = start;
            *n_cells = current;
        }
    }
}

/* How well a dialect explains the sample. */
struct fit {
    struct dialect dialect;
    bool has_header; /* text with as many cells, two or more, stands above the run */
    size_t first, run, n_cells;
};

static struct fit fit_of(const struct table *t, struct dialect dialect)
{
    struct fit fit = {.dialect = dialect};
    find_run(t, dialect, &fit.first, &fit.run, &fit.n_cells);
    if (fit.run < 2 || fit.n_cells < 2 || fit.first == 0)
        return fit;
    struct cell above = t->row[fit.first - 1], cell = {NULL, NULL};
    size_t cells = 0;
    while (next_cell(&above, dialect.separator, &cell))
        cells++;
    fit.has_header = cells == fit.n_cells || (cell.s == cell.end && cells == fit.n_cells + 1);
    return fit;
}

static bool is_better(const struct fit *a, const struct fit *b)
{
    if (a->has_header != b->has_header)
        return a->has_header;
    return a->run != b->run ? a->run > b->run : a->n_cells > b->n_cells;
}

static void choose_dialect(struct table *t, const struct import_reading *how)
{
    static const struct dialect candidates[] = {{',', '.'},  {';', '.'}, {';', ','}, {'\t', '.'},
                                                {'\t', ','}, {' ', '.'}, {' ', ','}};
    struct fit best = {.run = 0};
    size_t decimal_run = 0; /* as one column with decimal commas */
    for (size_t i = 0; i < sizeof candidates / sizeof *candidates; i++) {
        struct dialect d = candidates[i];
        if ((how->separator != '\0' && how->separator != d.separator) || (how->point != '\0' && how->point != d.point))
            continue;
        struct fit fit = fit_of(t, d);
        if (d.point == ',' && fit.n_cells == 1)
            decimal_run = fit.run;
        if (is_better(&fit, &best))
            best = fit;
    }
    t->dialect = best.dialect;
    t->first = best.first;
    t->run = best.run;
    t->n_cells = best.n_cells;
    if (best.dialect.separator == ',' && best.n_cells == 2 && !best.has_header && decimal_run == best.run)
        bf_warn("%s: '1,5' is read as the two numbers 1 and 5; if it is one and a half give --decimal ','", t->path);
}

static bool looks_like_unit(struct cell c)
{
    static const char *const no_factor[] = {"",    "-", "1",  "dB",
                                            "deg", "°", "rad"}; /* units, though nothing is converted by them */
    char text[32];
    struct import_unit unit;
    size_t n = (size_t)(c.end - c.s);
    if (n >= 2 && ((*c.s == '[' && c.end[-1] == ']') || (*c.s == '(' && c.end[-1] == ')')))
        return true;
    if (n >= sizeof text)
        return false;
    memcpy(text, c.s, n);
    text[n] = '\0';
    for (size_t i = 0; i < sizeof no_factor / sizeof *no_factor; i++)
        if (strcmp(text, no_factor[i]) == 0)
            return true;
    return import_unit(text, &unit);
}

/* Cells of a line of text; 0 when the dialect would give more than a table has. */
static size_t split(struct cell line, char separator, struct cell cells[MOST_CELLS])
{
    size_t n = 0;
    struct cell cell;
    while (next_cell(&line, separator, &cell)) {
        if (n == MOST_CELLS)
            return 0;
        cells[n++] = cell;
    }
    if (n > 1 && cells[n - 1].s == cells[n - 1].end)
        n--;
    return n;
}

/* Rows of text with as many cells as the numbers below: the last is the header, or the units below a header. */
static void name_channels(struct import_file *file, const struct table *t)
{
    struct cell *names = bf_alloc(2 * MOST_CELLS, sizeof *names), *units = names + MOST_CELLS;
    size_t header = t->first, n = t->n_cells;
    bool has_names = header > 0 && split(t->row[header - 1], t->dialect.separator, names) == n, has_units = false;
    if (has_names && header > 1 && split(t->row[header - 2], t->dialect.separator, units) == n) {
        has_units = true;
        for (size_t i = 0; i < n; i++)
            has_units &= looks_like_unit(names[i]);
    }
    file->has_names = has_names;
    const struct cell *name_row = has_units ? units : names, *unit_row = names;
    for (size_t i = 0; i < n; i++) {
        const struct cell name = has_names ? name_row[i] : (struct cell){t->path, t->path}; /* empty */
        const char *unit;
        size_t unit_n, name_n = import_split_unit(name.s, (size_t)(name.end - name.s), &unit, &unit_n);
        struct import_channel *c = import_add(file, name.s, name_n, NULL, 0);
        if (has_units) {
            unit = unit_row[i].s;
            unit_n = (size_t)(unit_row[i].end - unit_row[i].s);
            if (unit_n >= 2 && (*unit == '[' || *unit == '(')) {
                unit++;
                unit_n -= 2;
            }
        }
        import_set_text(&c->unit, unit, unit_n);
    }
    for (size_t i = 0; i < t->first; i++) {
        char from[32];
        snprintf(from, sizeof from, "line %ld", t->line[i]);
        import_set_rate(file, import_rate_in_text(t->row[i].s, (size_t)(t->row[i].end - t->row[i].s), t->dialect.point),
                        from);
    }
    free(names);
}

static enum bf_status fail_row(const struct table *t, struct cell line, long number, struct bf_error *err)
{
    struct cell cell, rest = line;
    double x;
    size_t cells = 0;
    while (next_cell(&rest, t->dialect.separator, &cell)) {
        cells++;
        if (!cell_number(cell, t->dialect.point, &x) && !is_missing(cell))
            return bf_fail_at(err, t->path, number, "column %zu: '%.*s' is not a number; remove the line, or repair it",
                              cells, cell.end - cell.s < SHOWN ? (int)(cell.end - cell.s) : SHOWN, cell.s);
    }
    return bf_fail_at(err, t->path, number, "has %zu cells where the lines above have %zu; complete or remove it",
                      cells, t->n_cells);
}

/* One row of numbers at the end of every channel. */
static enum bf_status read_row(struct import_file *file, const struct table *t, struct cell line, size_t sample,
                               long number, struct bf_error *err)
{
    struct cell cell, rest = line;
    size_t i = 0;
    for (; next_cell(&rest, t->dialect.separator, &cell); i++) {
        double x;
        if (i == t->n_cells && cell.s == cell.end && rest.s > rest.end)
            break; /* behind the last separator */
        if (!cell_number(cell, t->dialect.point, &x)) {
            if (!is_missing(cell))
                return fail_row(t, line, number, err);
            x = NAN;
        }
        if (i == t->n_cells)
            return fail_row(t, line, number, err);
        struct import_channel *c = &file->channels[i];
        c->x[sample] = x;
        time_axis_note(&c->digits, number_digits(cell.s, cell.end, t->dialect.point));
    }
    return i == t->n_cells ? BF_OK : fail_row(t, line, number, err);
}

static bool is_comment(struct cell line)
{
    return line.s < line.end && (*line.s == '#' || *line.s == '%');
}

/* "# key: value", and any statement of the sampling rate. */
static void read_comment(struct import_file *file, struct cell line, long number)
{
    char key[64], from[32];
    while (line.s < line.end && (*line.s == '#' || *line.s == '%' || is_blank(*line.s)))
        line.s++;
    snprintf(from, sizeof from, "line %ld", number);
    import_set_rate(file, import_rate_in_text(line.s, (size_t)(line.end - line.s), '.'), from);
    const char *colon = line.s < line.end ? memchr(line.s, ':', (size_t)(line.end - line.s)) : NULL;
    size_t n = colon != NULL ? (size_t)(colon - line.s) : 0;
    static const char of_keys[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-. "; /* as record_read() */
    if (n == 0 || n >= sizeof key || strspn(line.s, of_keys) != n || strchr("-. ", line.s[0]) != NULL)
        return;
    memcpy(key, line.s, n);
    key[n] = '\0';
    import_add_meta(file, key, colon + 1, (size_t)(line.end - colon - 1));
}

/* The first lines that are neither blank nor comments. */
static enum bf_status take_sample(struct import_file *file, struct table *t, const char *data, size_t n,
                                  struct bf_error *err)
{
    struct lines in;
    const char *text;
    size_t length;
    lines_from_memory(t->path, data, n, &in);
    while (t->n_rows < SAMPLE) {
        if (lines_next(&in, &text, &length, err) != BF_OK)
            return err->status;
        if (text == NULL)
            return BF_OK;
        struct cell line = trim((struct cell){text, text + length});
        if (is_comment(line)) {
            read_comment(file, line, in.number);
        } else if (line.s < line.end) {
            t->row[t->n_rows] = (struct cell){text, text + length};
            t->line[t->n_rows++] = in.number;
        }
    }
    return BF_OK;
}

static enum bf_status read_rows(struct import_file *file, const struct table *t, const char *data, size_t n,
                                struct bf_error *err)
{
    struct lines in;
    const char *text;
    size_t length, capacity = 0;
    lines_from_memory(t->path, data, n, &in);
    for (;;) {
        if (lines_next(&in, &text, &length, err) != BF_OK)
            return err->status;
        if (text == NULL)
            return BF_OK;
        struct cell line = {text, text + length}, inner = trim(line);
        if (in.number < t->line[t->first] || inner.s == inner.end || is_comment(inner))
            continue;
        if (file->n_lines == capacity) {
            capacity = capacity > 0 ? 2 * capacity : 1024;
            file->lines = bf_grow(file->lines, capacity, sizeof *file->lines);
            for (size_t i = 0; i < t->n_cells; i++)
                file->channels[i].x = bf_grow(file->channels[i].x, capacity, sizeof(double));
        }
        if (read_row(file, t, line, file->n_lines, in.number, err) != BF_OK)
            return err->status;
        file->lines[file->n_lines++] = in.number;
        for (size_t i = 0; i < t->n_cells; i++)
            file->channels[i].n = file->n_lines;
    }
}

static enum bf_status read_csv(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    struct table *t = bf_alloc(1, sizeof *t);
    t->path = file->path;
    enum bf_status status = take_sample(file, t, data, n, err);
    if (status == BF_OK) {
        choose_dialect(t, how);
        if (t->run == 0)
            status = bf_fail_at(err, file->path, t->n_rows > 0 ? t->line[0] : 0,
                                "no row of numbers in the first %zu lines; give --separator and --decimal if it is a "
                                "table, or export it as CSV",
                                t->n_rows);
    }
    if (status == BF_OK) {
        name_channels(file, t);
        status = read_rows(file, t, data, n, err);
    }
    free(t);
    return status;
}

/* Every text may be a table. */
static enum import_match recognise(const char *path, const char *data, size_t n)
{
    (void)path;
    return memchr(data, '\0', n < 65536 ? n : 65536) == NULL ? IMPORT_MATCH_TEXT : IMPORT_NO_MATCH;
}

const struct import_format import_format_csv = {
    .name = "csv", .title = "text table", .recognise = recognise, .read = read_csv};
