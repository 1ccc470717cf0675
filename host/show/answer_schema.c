/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_schema.c — what a field of an answer is, and the JSON Schema of all of them. */
#include "answer_forms.h"
#include "show.h"

#include <string.h>

/* ---- What a field is ---- */

bool answer_is_name(const struct answer_field *field)
{
    return field->kind != ANSWER_LINE && !(field->flags & ANSWER_AGAIN);
}

const struct answer_field *answer_field_of(const struct answer_field fields[], const char *name)
{
    for (const struct answer_field *f = fields; f != NULL && f->name != NULL; f++)
        if (answer_is_name(f) && strcmp(f->name, name) == 0)
            return f;
    return NULL;
}

const char *answer_unit(const struct answer_field *field)
{
    static const char *const units[] = {"Hz", "MHz", "s", "us", "m", "V"};
    const char *last = strrchr(field->name, '_');
    const bool number = field->kind == ANSWER_NUMBER || field->kind == ANSWER_COUNT || field->kind == ANSWER_NUMBERS;
    if (field->unit != NULL)
        return field->unit;
    for (size_t i = 0; last != NULL && number && i < sizeof units / sizeof *units; i++)
        if (strcmp(last + 1, units[i]) == 0)
            return units[i];
    return "";
}

/* ---- Schema ---- */

static struct json *schema_of(const struct answer_field *field);

static void put_members(struct json *schema, const struct answer_field fields[], bool always)
{
    struct json *members = json_put(schema, "properties", json_new_object());
    struct json *required = json_put(schema, "required", json_new_array());
    json_put_text(schema, "type", "object");
    for (const struct answer_field *f = fields; f->name != NULL; f++) {
        if (!answer_is_name(f))
            continue;
        (void)json_put(members, f->name, schema_of(f));
        if (!(f->flags & ANSWER_MAYBE))
            json_push_text(required, f->name);
    }
    static const char *const everywhere[][2] = {
        {"warnings", "what was not tried or could not be judged, and what looks wrong"},
        {"next", "commands that go on from here"}};
    for (size_t i = 0; always && i < 2; i++) {
        const struct answer_field texts = ANSWER_ROW(TEXTS, everywhere[i][0], everywhere[i][1]);
        if (json_member(members, texts.name) == NULL) {
            (void)json_put(members, texts.name, schema_of(&texts));
            json_push_text(required, texts.name);
        }
    }
    json_put_bool(schema, "additionalProperties", false);
}

static struct json *typed(const char *type, bool or_null)
{
    struct json *schema = json_new_object();
    if (!or_null) {
        json_put_text(schema, "type", type);
    } else {
        struct json *types = json_put(schema, "type", json_new_array());
        json_push_text(types, type);
        json_push_text(types, "null");
    }
    return schema;
}

static struct json *object_of(const struct answer_field *field)
{
    struct json *schema = json_new_object();
    put_members(schema, field->fields, false);
    return schema;
}

/* Null beside an object: a choice of two. */
static struct json *or_null(struct json *schema)
{
    struct json *choice = json_new_object(), *any = json_put(choice, "anyOf", json_new_array());
    (void)json_push(any, schema);
    (void)json_push(any, typed("null", false));
    return choice;
}

static struct json *list_of(struct json *items)
{
    struct json *schema = typed("array", false);
    (void)json_put(schema, "items", items);
    return schema;
}

static struct json *map_of(struct json *values)
{
    struct json *schema = typed("object", false);
    (void)json_put(schema, "additionalProperties", values);
    return schema;
}

static struct json *schema_of(const struct answer_field *field)
{
    static const char *const types[] = {
        [ANSWER_NUMBER] = "number", [ANSWER_COUNT] = "integer", [ANSWER_TEXT] = "string", [ANSWER_BOOL] = "boolean"};
    const bool null = (field->flags & ANSWER_NULL) != 0;
    struct json *schema;
    switch (field->kind) {
    case ANSWER_NUMBERS:
        schema = list_of(typed("number", true));
        break;
    case ANSWER_TEXTS:
        schema = list_of(typed("string", false));
        break;
    case ANSWER_OBJECT:
        schema = null ? or_null(object_of(field)) : object_of(field);
        break;
    case ANSWER_LIST:
        schema = list_of(object_of(field));
        break;
    case ANSWER_MAP:
        schema = map_of(object_of(field));
        break;
    case ANSWER_NUMBER_MAP:
        schema = map_of(typed("number", true));
        break;
    default:
        schema = typed(types[field->kind], null || field->kind == ANSWER_NUMBER);
    }
    json_put_text(schema, "description", field->what);
    if (answer_unit(field)[0] != '\0')
        json_put_text(schema, "unit", answer_unit(field));
    return schema;
}

enum bf_status answer_print_schema(const char *command, const struct answer_field fields[], FILE *out,
                                   struct bf_error *err)
{
    char title[80];
    struct json *schema = json_new_object();
    (void)snprintf(title, sizeof title, "beamfit %s --json", command);
    json_put_text(schema, "$schema", "https://json-schema.org/draft/2020-12/schema");
    json_put_text(schema, "title", title);
    put_members(schema, fields, true);
    return json_print_and_free(schema, out, err);
}
