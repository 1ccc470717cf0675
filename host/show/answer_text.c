/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_text.c — an answer for a person at a terminal: its lines and tables in the order of the table of fields. */
#include "answer_forms.h"

#include <stdlib.h>
#include <string.h>

/* Wrapped behind a tab, else behind the blanks (and the dash) that it begins with. */
static void put_line(FILE *out, char *text, bool verbatim)
{
    const size_t newlines = strspn(text, "\n");
    char *words = text + newlines, *tab = strchr(words, '\t');
    (void)fprintf(out, "%.*s", (int)newlines, text);
    if (words[0] == '\0')
        return;
    if (verbatim) {
        (void)fprintf(out, "%s\n", words);
        return;
    }
    size_t indent = strspn(words, " ");
    indent += strncmp(words + indent, "- ", 2) == 0 ? 2 : 0;
    char *label = words;
    if (tab != NULL) {
        *tab = '\0';
        indent = text_width(label);
        words = tab + 1;
    } else {
        words += indent;
    }
    (void)fprintf(out, "%.*s", tab != NULL ? (int)strlen(label) : (int)indent, label);
    text_print_wrapped(out, words, indent, text_columns());
}

static void say(FILE *out, const char *words, const struct answer_scope *scope, bool verbatim)
{
    if (words[0] == '\0') {
        (void)fputc('\n', out);
        return;
    }
    char *text = answer_fill(words, scope);
    put_line(out, text, verbatim);
    free(text);
}

static void title(FILE *out, const struct answer_field *f, const struct answer_scope *scope)
{
    if (f->text[0] != '\0')
        say(out, f->text, scope, false);
}

static void say_all(FILE *out, const struct answer_scope *scope);

static void say_items(FILE *out, const struct json *list, const struct answer_field *f,
                      const struct answer_scope *scope)
{
    const bool map = f->kind == ANSWER_MAP;
    for (size_t i = 0; i < json_length(list); i++) {
        const struct answer_scope one = {.object = map ? json_member_at(list, i) : json_item(list, i),
                                         .fields = f->fields,
                                         .up = scope,
                                         .name = map ? json_member_name(list, i) : NULL,
                                         .place = i + 1};
        say_all(out, &one);
    }
}

static void say_texts(FILE *out, const struct json *list, const struct answer_field *f)
{
    for (size_t i = 0; i < json_length(list); i++) {
        char text[4096];
        const char *dash = f->flags & ANSWER_VERBATIM ? "  " : "- ";
        (void)snprintf(text, 3, "%s", dash);
        (void)json_words(json_item(list, i), 0, text + 2, sizeof text - 3);
        const size_t n = strlen(text);
        if (!(f->flags & ANSWER_VERBATIM) && strchr(".?!", text[n - 1]) == NULL) /* they are sentences */
            text[n] = '.', text[n + 1] = '\0';
        put_line(out, text, (f->flags & ANSWER_VERBATIM) != 0);
    }
}

static void say_field(FILE *out, const struct answer_field *f, const struct answer_scope *scope)
{
    const struct json *value = json_member(scope->object, f->name);
    if (f->kind == ANSWER_LINE) {
        say(out, f->text, scope, (f->flags & ANSWER_VERBATIM) != 0);
        return;
    }
    if (f->kind < ANSWER_TEXTS || json_length(value) == 0)
        return;
    title(out, f, scope);
    if (f->kind == ANSWER_TEXTS) {
        say_texts(out, value, f);
    } else if (f->flags & ANSWER_TABLE) {
        answer_table(out, value, f, scope, text_columns());
    } else if (f->kind == ANSWER_OBJECT) {
        const struct answer_scope inner = {.object = value, .fields = f->fields, .up = scope, .place = 1};
        say_all(out, &inner);
    } else {
        say_items(out, value, f, scope);
    }
}

static void say_all(FILE *out, const struct answer_scope *scope)
{
    for (const struct answer_field *f = scope->fields; f->name != NULL; f++)
        if (f->text != NULL && (!(f->flags & ANSWER_ALL) || options_all()))
            say_field(out, f, scope);
}

void answer_print_text(FILE *out, const struct json *root, const struct answer_field fields[])
{
    const struct answer_scope scope = {.object = root, .fields = fields, .place = 1};
    say_all(out, &scope);
}
