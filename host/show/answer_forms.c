/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_forms.c — an answer as Markdown and HTML: one walk over its tree, and two sets of marks. */
#include "answer_forms.h"
#include "html.h"

#include <string.h>

/* How a form is written. level: of headings, from 2. */
struct form {
    FILE *out;
    void (*heading)(FILE *out, int level, const char *name, const char *what);
    void (*table)(FILE *out, const char *const headings[], size_t n);
    void (*cell)(FILE *out, const char *text);
    void (*item)(FILE *out, const char *text);
    const char *row, *end_row, *end_table, *end_items;
};

enum { MOST_COLUMNS = 40, SCALAR = 1200 };

/* ---- The walk ---- */

static bool is_single(const struct answer_field *field)
{
    return field->kind <= ANSWER_BOOL || field->kind == ANSWER_NUMBERS;
}

static bool is_cell(const struct answer_field *field)
{
    return is_single(field) || field->kind == ANSWER_TEXTS || !answer_is_name(field);
}

/* A value in words: a number with five digits, several parted by blanks. */
static void say(const struct json *value, char text[SCALAR])
{
    char one[SCALAR];
    size_t used = 0;
    if (!json_is_list(value)) {
        (void)snprintf(text, SCALAR, "%s", json_words(value, 5, one, sizeof one));
        return;
    }
    text[0] = '\0';
    for (size_t i = 0; i < json_length(value) && used < SCALAR; i++)
        used += (size_t)snprintf(text + used, SCALAR - used, "%s%s",
                                 i > 0 ? json_is_text(json_item(value, i)) ? ", " : " " : "",
                                 json_words(json_item(value, i), 5, one, sizeof one));
}

static void put_cell(const struct form *form, const struct json *value)
{
    char text[SCALAR] = "";
    if (value != NULL)
        say(value, text);
    form->cell(form->out, text);
}

static void put_name(const struct form *form, const struct answer_field *field)
{
    char name[200];
    const char *unit = answer_unit(field);
    (void)snprintf(name, sizeof name, "%s%s%s%s", field->name, unit[0] != '\0' ? " (" : "", unit,
                   unit[0] != '\0' ? ")" : "");
    form->cell(form->out, name);
}

static void put_singles(const struct form *form, const struct json *object, const struct answer_field fields[])
{
    static const char *const headings[] = {"name", "value", "meaning"};
    bool open = false;
    for (const struct answer_field *f = fields; f->name != NULL; f++) {
        const struct json *value = json_member(object, f->name);
        if (value == NULL || !is_single(f))
            continue;
        if (!open)
            form->table(form->out, headings, 3);
        open = true;
        (void)fputs(form->row, form->out);
        put_name(form, f);
        put_cell(form, value);
        form->cell(form->out, f->what);
        (void)fputs(form->end_row, form->out);
    }
    if (open)
        (void)fputs(form->end_table, form->out);
}

/* A row for each object; of a map, its name first. Columns are the single values and the lists of words. */
static void put_rows(const struct form *form, const struct json *list, const struct answer_field *field)
{
    const char *headings[MOST_COLUMNS];
    const bool map = field->kind == ANSWER_MAP;
    size_t n = 0;
    if (map)
        headings[n++] = "name";
    for (const struct answer_field *f = field->fields; f->name != NULL && n < MOST_COLUMNS; f++)
        if (is_cell(f) && answer_is_name(f))
            headings[n++] = f->name;
    form->table(form->out, headings, n);
    for (size_t i = 0; i < json_length(list); i++) {
        const struct json *one = map ? json_member_at(list, i) : json_item(list, i);
        (void)fputs(form->row, form->out);
        if (map)
            form->cell(form->out, json_member_name(list, i));
        size_t column = map;
        for (const struct answer_field *f = field->fields; f->name != NULL && column < n; f++)
            if (is_cell(f) && answer_is_name(f)) {
                put_cell(form, json_member(one, f->name));
                column++;
            }
        (void)fputs(form->end_row, form->out);
    }
    (void)fputs(form->end_table, form->out);
}

static void put_number_map(const struct form *form, const struct json *map)
{
    static const char *const headings[] = {"name", "value"};
    form->table(form->out, headings, 2);
    for (size_t i = 0; i < json_length(map); i++) {
        (void)fputs(form->row, form->out);
        form->cell(form->out, json_member_name(map, i));
        put_cell(form, json_member_at(map, i));
        (void)fputs(form->end_row, form->out);
    }
    (void)fputs(form->end_table, form->out);
}

static void put_object(const struct form *form, const struct json *object, const struct answer_field fields[],
                       int level);

/* Of an object in a list: its name in the map, its first word, else its number. */
static void put_title(const struct answer_field *field, const struct json *list, size_t i, char title[SCALAR])
{
    title[0] = '\0';
    if (field->kind == ANSWER_MAP)
        (void)snprintf(title, SCALAR, "%s", json_member_name(list, i));
    for (const struct answer_field *f = field->fields; f->name != NULL && title[0] == '\0'; f++)
        if (field->kind != ANSWER_MAP && f->kind == ANSWER_TEXT && answer_is_name(f) &&
            json_member(json_item(list, i), f->name) != NULL)
            say(json_member(json_item(list, i), f->name), title);
    if (title[0] == '\0')
        (void)snprintf(title, SCALAR, "%zu", i + 1);
}

/* What does not fit the row of an object: lists within it, under a heading of its own. */
static void put_inner(const struct form *form, const struct json *list, const struct answer_field *field, int level)
{
    bool nested = false;
    for (const struct answer_field *f = field->fields; f->name != NULL; f++)
        nested = nested || !is_cell(f);
    for (size_t i = 0; nested && i < json_length(list); i++) {
        const struct json *one = field->kind == ANSWER_MAP ? json_member_at(list, i) : json_item(list, i);
        char title[SCALAR];
        put_title(field, list, i, title);
        bool headed = false;
        for (const struct answer_field *f = field->fields; f->name != NULL; f++) {
            const struct json *value = json_member(one, f->name);
            if (is_cell(f) || value == NULL || json_length(value) == 0)
                continue;
            if (!headed)
                form->heading(form->out, level, title, "");
            headed = true;
            const struct answer_field alone[2] = {*f};
            put_object(form, one, alone, level + 1);
        }
    }
}

static void put_texts(const struct form *form, const struct json *list)
{
    char text[SCALAR];
    for (size_t i = 0; i < json_length(list); i++) {
        say(json_item(list, i), text);
        form->item(form->out, text);
    }
    (void)fputs(form->end_items, form->out);
}

static void put_field(const struct form *form, const struct json *value, const struct answer_field *f, int level)
{
    form->heading(form->out, level, f->name, f->what);
    switch (f->kind) {
    case ANSWER_OBJECT:
        put_object(form, value, f->fields, level + 1);
        break;
    case ANSWER_TEXTS:
        put_texts(form, value);
        break;
    case ANSWER_NUMBER_MAP:
        put_number_map(form, value);
        break;
    default:
        put_rows(form, value, f);
        put_inner(form, value, f, level + 1);
    }
}

static void put_object(const struct form *form, const struct json *object, const struct answer_field fields[],
                       int level)
{
    put_singles(form, object, fields);
    for (const struct answer_field *f = fields; f->name != NULL; f++) {
        const struct json *value = json_member(object, f->name);
        if (value != NULL && !is_single(f) && answer_is_name(f) && json_length(value) > 0)
            put_field(form, value, f, level);
    }
}

/* `warnings` and `next` of every answer, where the command's own table does not have them. */
static void put_everywhere(const struct form *form, const struct json *root, const struct answer_field fields[])
{
    static const struct answer_field everywhere[] = {
        ANSWER_ROW(TEXTS, "warnings", ""), ANSWER_ROW(TEXTS, "next", "commands that go on from here"), {0}};
    for (const struct answer_field *f = everywhere; f->name != NULL; f++)
        if (answer_field_of(fields, f->name) == NULL && json_length(json_member(root, f->name)) > 0)
            put_field(form, json_member(root, f->name), f, 2);
}

/* ---- Markdown ---- */

static void markdown_text(FILE *out, const char *text)
{
    for (; *text != '\0'; text++) {
        if (strchr("\\`*[]<>|", *text) != NULL)
            (void)fputc('\\', out);
        (void)fputc(*text == '\n' ? ' ' : *text, out);
    }
}

static void markdown_heading(FILE *out, int level, const char *name, const char *what)
{
    (void)fprintf(out, "%.*s ", level < 6 ? level : 6, "######");
    markdown_text(out, name);
    (void)fputs("\n\n", out);
    if (what[0] != '\0') {
        markdown_text(out, what);
        (void)fputs("\n\n", out);
    }
}

static void markdown_table(FILE *out, const char *const headings[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        (void)fprintf(out, "| %s ", headings[i]);
    (void)fputs("|\n", out);
    for (size_t i = 0; i < n; i++)
        (void)fputs("|---", out);
    (void)fputs("|\n", out);
}

static void markdown_cell(FILE *out, const char *text)
{
    (void)fputs("| ", out);
    markdown_text(out, text);
    (void)fputc(' ', out);
}

static void markdown_item(FILE *out, const char *text)
{
    (void)fputs("- ", out);
    markdown_text(out, text);
    (void)fputc('\n', out);
}

void answer_markdown(FILE *out, const struct json *root, const struct answer_field fields[])
{
    const struct form form = {.out = out,
                              .heading = markdown_heading,
                              .table = markdown_table,
                              .cell = markdown_cell,
                              .item = markdown_item,
                              .row = "",
                              .end_row = "|\n",
                              .end_table = "\n",
                              .end_items = "\n"};
    put_object(&form, root, fields, 2);
    put_everywhere(&form, root, fields);
}

/* ---- HTML ---- */

static void html_heading(FILE *out, int level, const char *name, const char *what)
{
    level = level < 6 ? level : 6;
    (void)fprintf(out, "<h%d>", level);
    html_text(out, name);
    (void)fprintf(out, "</h%d>\n", level);
    if (what[0] != '\0') {
        (void)fputs("<p>", out);
        html_text(out, what);
        (void)fputs("</p>\n", out);
    }
}

static void html_table(FILE *out, const char *const headings[], size_t n)
{
    (void)fputs("<div class=\"scroll\"><table class=\"answer\">\n<tr>", out);
    for (size_t i = 0; i < n; i++) {
        (void)fputs("<th>", out);
        html_text(out, headings[i]);
        (void)fputs("</th>", out);
    }
    (void)fputs("</tr>\n", out);
}

static void html_one_cell(FILE *out, const char *text)
{
    (void)fputs("<td>", out);
    html_text(out, text);
    (void)fputs("</td>", out);
}

static void html_item(FILE *out, const char *text)
{
    (void)fputs("<p>", out);
    html_text(out, text);
    (void)fputs("</p>\n", out);
}

void answer_html(FILE *out, const struct json *root, const struct answer_field fields[])
{
    const struct form form = {.out = out,
                              .heading = html_heading,
                              .table = html_table,
                              .cell = html_one_cell,
                              .item = html_item,
                              .row = "<tr>",
                              .end_row = "</tr>\n",
                              .end_table = "</table></div>\n",
                              .end_items = ""};
    static const char *const no_scripts[] = {NULL};
    html_begin(out, "beamfit", "beamfit " BEAMFIT_VERSION, no_scripts, false);
    put_object(&form, root, fields, 2);
    put_everywhere(&form, root, fields);
    html_end(out);
}
