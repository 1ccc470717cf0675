/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_table.c — a list of an answer as a table on the terminal, as wide as that. */
#include "answer_forms.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_COLUMNS = 24, MOST_LEVELS = 4, GAP = 2, NARROWEST = 12 };

struct column {
    const struct answer_field *field;
    size_t level;  /* of the lists in each other: whose item has it */
    bool is_error; /* of the field: its standard error */
    bool used, is_text;
    size_t width, widest;
};

struct table {
    struct column columns[MOST_COLUMNS];
    size_t n, n_rows;
    char **cells;  /* [n_rows][n] */
    char **groups; /* [n_rows] */
    const struct answer_field *group;
    size_t group_level;
};

static bool is_shown(const struct answer_field *f)
{
    return f->text != NULL && (!(f->flags & ANSWER_ALL) || options_all());
}

static bool has_rows(const struct answer_field *f)
{
    return (f->kind == ANSWER_LIST || f->kind == ANSWER_MAP) && (f->flags & ANSWER_TABLE) != 0;
}

static void add_columns(struct table *t, const struct answer_field fields[], size_t level)
{
    for (const struct answer_field *f = fields; f->name != NULL; f++) {
        if (f->flags & ANSWER_GROUP) {
            t->group = f;
            t->group_level = level;
        } else if (has_rows(f) && level + 1 < MOST_LEVELS)
            add_columns(t, f->fields, level + 1);
        else if (is_shown(f))
            for (int part = 0; part < (f->error != NULL ? 2 : 1) && t->n < MOST_COLUMNS; part++)
                t->columns[t->n++] = (struct column){.field = f, .level = level, .is_error = part == 1};
    }
}

/* ---- Cells ---- */

static char *error_cell(const struct answer_field *field, const struct answer_scope *scope)
{
    const struct json *object = scope->object;
    const double sd = json_number_of(json_member(object, field->error)),
                 value = json_number_of(json_member(object, field->name));
    char text[64] = "";
    if (!(sd > 0.0) && field->instead != NULL)
        return answer_fill(field->instead, scope);
    if (sd > 0.0)
        (void)snprintf(text, sizeof text, "± %-8.2g %7.3g %%", sd, fabs(100.0 * sd / value));
    return bf_strdup(text);
}

static char *cell_of(const struct column *column, const struct answer_scope *scope)
{
    const struct answer_field *field = column->field;
    struct answer_field alone = *field;
    char *text = NULL;
    size_t size;
    if (field->kind == ANSWER_LINE)
        return answer_fill(field->text, scope);
    if (column->is_error)
        return error_cell(field, scope);
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return bf_strdup("");
    alone.error = NULL;
    alone.unit = ""; /* the heading has it */
    const struct json *value = json_member(scope->object, field->name);
    if (value != NULL)
        answer_put_value(out, value, &alone, scope->object);
    (void)fclose(out);
    if (field->flags & ANSWER_PERCENT && size > 2 && strcmp(text + size - 2, " %") == 0)
        text[size - 2] = '\0';
    return text;
}

static bool looks_like_a_number(const char *text)
{
    return strspn(text, "+-0123456789.eE% ") == strlen(text);
}

static void add_row(struct table *t, const struct answer_scope scopes[], size_t level)
{
    t->cells = bf_grow(t->cells, (t->n_rows + 1) * t->n, sizeof *t->cells);
    for (size_t c = 0; c < t->n; c++) {
        struct column *column = &t->columns[c];
        char *text = column->level <= level ? cell_of(column, &scopes[column->level]) : bf_strdup("");
        const size_t width = text_width(text);
        t->cells[t->n_rows * t->n + c] = text;
        column->used = column->used || (text[0] != '\0' && strcmp(text, "-") != 0);
        column->is_text = column->is_text || !looks_like_a_number(text);
        column->widest = width > column->widest ? width : column->widest;
    }
    t->groups = bf_grow(t->groups, t->n_rows + 1, sizeof *t->groups);
    t->groups[t->n_rows++] = t->group != NULL ? answer_fill(t->group->text, &scopes[t->group_level]) : bf_strdup("");
}

static void add_rows(struct table *t, const struct json *list, const struct answer_field *field,
                     struct answer_scope scopes[], size_t level, const struct answer_scope *up)
{
    const struct answer_field *inner = NULL;
    for (const struct answer_field *f = field->fields; f->name != NULL; f++)
        inner = has_rows(f) && level + 1 < MOST_LEVELS ? f : inner;
    for (size_t i = 0; i < json_length(list); i++) {
        const bool map = field->kind == ANSWER_MAP;
        scopes[level] = (struct answer_scope){.object = map ? json_member_at(list, i) : json_item(list, i),
                                              .fields = field->fields,
                                              .up = up,
                                              .name = map ? json_member_name(list, i) : NULL,
                                              .place = i + 1};
        if (field->row != NULL && !json_truth(json_member(scopes[level].object, field->row)))
            continue;
        if (inner != NULL)
            add_rows(t, json_member(scopes[level].object, inner->name), inner, scopes, level + 1, &scopes[level]);
        else
            add_row(t, scopes, level);
    }
}

/* ---- Printing ---- */

static void heading(const struct column *column, char text[120])
{
    const struct answer_field *f = column->field;
    const char *unit = f->flags & ANSWER_PERCENT ? "%" : f->kind == ANSWER_LINE ? "" : answer_unit(f);
    (void)snprintf(text, 120, "%s", f->kind == ANSWER_LINE ? f->name : f->text);
    if (column->is_error)
        (void)snprintf(text, 120, "standard error");
    else if (unit[0] != '\0')
        (void)snprintf(text, 120, "%s %s", f->text, unit);
}

/* Columns without a value are left out; of the others the widest texts give way until all fit. */
static void fit_widths(struct table *t, size_t indent, size_t columns)
{
    size_t total = indent, n = 0;
    char text[120];
    for (size_t c = 0; c < t->n; c++) {
        struct column *column = &t->columns[c];
        if (!column->used)
            continue;
        heading(column, text);
        column->width = column->widest > text_width(text) ? column->widest : text_width(text);
        total += column->width + (n++ > 0 ? GAP : 0);
    }
    while (total > columns && !options_all()) {
        struct column *widest = NULL;
        for (size_t c = 0; c < t->n; c++)
            if (t->columns[c].used && t->columns[c].is_text && !t->columns[c].is_error &&
                t->columns[c].width > NARROWEST && (widest == NULL || t->columns[c].width >= widest->width))
                widest = &t->columns[c];
        if (widest == NULL)
            return;
        widest->width--;
        total--;
    }
}

static size_t last_used(const struct table *t)
{
    size_t last = t->n;
    for (size_t c = 0; c < t->n; c++)
        last = t->columns[c].used ? c : last;
    return last;
}

/* One row; text: NULL is the heading. A text that is too wide is wrapped in the last column, and has a line for itself elsewhere. */
static void put_row(FILE *out, const struct table *t, char *const cells[], size_t indent, size_t columns)
{
    size_t at = indent, pending = indent; /* blanks that are due before the next text */
    const size_t last = last_used(t);
    char title[120];
    for (size_t c = 0; c < t->n; c++) {
        const struct column *column = &t->columns[c];
        if (!column->used)
            continue;
        heading(column, title);
        const char *text = cells != NULL ? cells[c] : title;
        const size_t width = text_width(text), pad = width < column->width ? column->width - width : 0;
        const size_t before = column->is_text ? 0 : pad;
        if (text[0] != '\0')
            (void)fprintf(out, "%*s", (int)(pending + before), "");
        if (c == last && width > column->width) {
            text_print_wrapped(out, text, at, columns);
            return;
        }
        (void)fputs(text, out);
        at += column->width + GAP;
        pending = text[0] == '\0' ? pending + column->width + GAP : GAP + pad - before;
        if (width > column->width) {
            (void)fputc('\n', out);
            pending = at;
        }
    }
    (void)fputc('\n', out);
}

void answer_table(FILE *out, const struct json *list, const struct answer_field *field,
                  const struct answer_scope *scope, size_t columns)
{
    struct table t = {0};
    struct answer_scope scopes[MOST_LEVELS];
    const size_t indent = 0;
    bool headed = false;
    add_columns(&t, field->fields, 0);
    if (t.n == 0)
        return;
    add_rows(&t, list, field, scopes, 0, scope);
    fit_widths(&t, indent, columns);
    for (size_t c = 0; c < t.n; c++) {
        char text[120];
        heading(&t.columns[c], text);
        headed = headed || (t.columns[c].used && text[0] != '\0');
    }
    if (headed && t.n_rows > 0)
        put_row(out, &t, NULL, indent, columns);
    const size_t most = field->most > 0 && field->most < t.n_rows && !options_all() ? field->most : t.n_rows;
    for (size_t r = 0; r < most; r++) {
        if (t.groups[r][0] != '\0' && (r == 0 || strcmp(t.groups[r], t.groups[r - 1]) != 0))
            (void)fprintf(out, "%s%s\n", r > 0 ? "\n" : "", t.groups[r]);
        put_row(out, &t, t.cells + r * t.n, indent, columns);
    }
    if (most < t.n_rows)
        (void)fprintf(out, "(and %zu more; --all)\n", t.n_rows - most);
    for (size_t r = 0; r < t.n_rows; r++)
        free(t.groups[r]);
    free(t.groups);
    for (size_t i = 0; i < t.n_rows * t.n; i++)
        free(t.cells[i]);
    free(t.cells);
}
