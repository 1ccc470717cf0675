/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_words.c — values of an answer in words, and the words of a line with its values. */
#include "answer_forms.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACE = 400, NUMBER_TEXT = 48, USUAL_DIGITS = 5 };

/* ---- Values ---- */

bool answer_is_there(const struct json *value)
{
    char text[8];
    if (value == NULL)
        return false;
    if (json_is_list(value) || json_length(value) > 0)
        return json_length(value) > 0;
    (void)json_words(value, USUAL_DIGITS, text, sizeof text);
    return json_is_text(value) ? text[0] != '\0' : strcmp(text, "-") != 0;
}

static bool is_so(const struct json *value)
{
    if (json_number_is(value))
        return json_number_of(value) < 0.0 || json_number_of(value) > 0.0;
    return json_truth(value) || ((json_is_text(value) || json_length(value) > 0) && answer_is_there(value));
}

static void number_text(double x, const struct answer_field *field, char text[NUMBER_TEXT])
{
    const int digits = field == NULL || field->digits == 0 ? USUAL_DIGITS : field->digits;
    const bool percent = field != NULL && (field->flags & ANSWER_PERCENT) != 0;
    x = percent ? 100.0 * x : x;
    if (digits < 0 && fabs(x) < 1e7)
        (void)snprintf(text, NUMBER_TEXT, "%.*f", -digits, x);
    else
        (void)snprintf(text, NUMBER_TEXT, "%.*g", abs(digits), x);
}

/* Without its unit. */
static void put_plain(FILE *out, const struct json *value, const struct answer_field *field)
{
    char text[4096];
    if (json_number_is(value) && field != NULL && field->kind != ANSWER_COUNT) {
        number_text(json_number_of(value), field, text);
        (void)fputs(text, out);
        return;
    }
    (void)json_words(value, USUAL_DIGITS, text, sizeof text);
    (void)fputs(field != NULL && (field->flags & ANSWER_BASE) ? text_base_name(text) : text, out);
}

static void put_many(FILE *out, const struct json *value, const struct answer_field *field)
{
    for (size_t i = 0; i < json_length(value); i++) {
        (void)fputs(i > 0 ? ", " : "", out);
        if (json_is_list(value)) {
            const struct json *item = json_item(value, i);
            put_plain(out, json_length(item) > 0 ? json_member_at(item, 0) : item, field);
        } else {
            (void)fprintf(out, "%s ", json_member_name(value, i));
            put_plain(out, json_member_at(value, i), field);
        }
    }
}

void answer_put_value(FILE *out, const struct json *value, const struct answer_field *field, const struct json *object)
{
    if (json_is_list(value) || json_length(value) > 0) {
        put_many(out, value, field);
    } else {
        const bool has_error = field != NULL && field->error != NULL;
        const double sd = has_error ? json_number_of(json_member(object, field->error)) : (double)NAN;
        put_plain(out, value, field);
        if (has_error && sd > 0.0)
            (void)fprintf(out, " ± %.2g", field->flags & ANSWER_PERCENT ? 100.0 * sd : sd);
    }
    if (field == NULL || !answer_is_there(value) || json_is_text(value))
        return;
    const char *unit = field->flags & ANSWER_PERCENT ? "%" : answer_unit(field);
    (void)fprintf(out, "%s%s", unit[0] != '\0' ? " " : "", unit);
}

/* ---- Words ---- */

/* A value that was looked for: what it is, and the object that has it. */
struct found {
    const struct json *value, *object;
    const struct answer_field *field;
};

/* A part of a path within a value. */
static void step_into(struct found *at, const char *part)
{
    const struct json *within = at->value;
    if (json_is_list(within)) {
        at->value = json_item(within, (size_t)strtoul(part, NULL, 10));
        return;
    }
    at->object = within;
    at->value = json_member(within, part);
    at->field = at->field != NULL && at->field->fields != NULL ? answer_field_of(at->field->fields, part) : at->field;
}

static struct found find(char *path, const struct answer_scope *scope)
{
    char *rest = NULL;
    const char *part = strtok_r(path, ".", &rest);
    struct found at = {0};
    for (; part != NULL && scope != NULL && at.value == NULL; scope = scope->up) {
        at = (struct found){json_member(scope->object, part), scope->object, answer_field_of(scope->fields, part)};
    }
    while (at.value != NULL && (part = strtok_r(NULL, ".", &rest)) != NULL)
        step_into(&at, part);
    return at;
}

/* The first or the second of "one|other". */
static void put_choice(FILE *out, const char *words, bool first)
{
    const size_t n = strcspn(words, "|");
    if (first)
        (void)fwrite(words, 1, n, out);
    else if (words[n] != '\0')
        (void)fputs(words + n + 1, out);
}

/* What stands between braces; false: [...] around it is left out. */
static bool put_place(FILE *out, char place[PLACE], const struct answer_scope *scope)
{
    if (strcmp(place, "@") == 0) {
        if (scope->name != NULL)
            (void)fputs(scope->name, out);
        else
            (void)fprintf(out, "%zu", scope->place);
        return true;
    }
    const size_t n = strcspn(place, "?!#>");
    const char kind = place[n], *words = kind != '\0' ? place + n + 1 : "";
    place[n] = '\0';
    const struct found found = find(place, scope);
    if (kind == '!')
        return !is_so(found.value);
    if (kind == '#' && words[0] == '\0') {
        (void)fprintf(out, "%zu", json_length(found.value));
        return true;
    }
    if (kind == '#') {
        put_choice(out, words,
                   json_number_is(found.value) ? fabs(json_number_of(found.value) - 1.0) < 0.5
                                               : json_length(found.value) == 1);
        return true;
    }
    if (kind == '>') {
        (void)fprintf(out, "%*s", 2 * (int)json_number_of(found.value), "");
        return true;
    }
    if (kind == '?') {
        put_choice(out, words, is_so(found.value));
        return words[0] != '\0' || is_so(found.value);
    }
    if (found.value == NULL)
        (void)fputc('-', out);
    else
        answer_put_value(out, found.value, found.field, found.object);
    return answer_is_there(found.value);
}

/* Up to the end of the words or of the bracket that they are in; *at: behind it. */
static bool put_words(FILE *out, const char **at, const struct answer_scope *scope)
{
    char place[PLACE];
    bool all_there = true;
    while (**at != '\0' && **at != ']') {
        const char c = *(*at)++;
        if (c == '{') {
            const size_t n = strcspn(*at, "}");
            (void)snprintf(place, sizeof place, "%.*s", (int)n, *at);
            *at += n + 1;
            all_there &= put_place(out, place, scope);
        } else if (c == '[') {
            char *text = NULL;
            size_t size;
            FILE *inner = open_memstream(&text, &size);
            if (inner == NULL)
                return false;
            const bool told = put_words(inner, at, scope);
            *at += **at == ']';
            (void)fclose(inner);
            (void)fputs(told ? text : "", out);
            free(text);
        } else {
            (void)fputc(c, out);
        }
    }
    return all_there;
}

char *answer_fill(const char *words, const struct answer_scope *scope)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return bf_strdup("");
    while (*words != '\0') {
        (void)put_words(out, &words, scope);
        words += *words == ']';
    }
    (void)fclose(out);
    return text;
}
