/* SPDX-License-Identifier: GPL-3.0-or-later */
/* json.c — the only file that sees jansson. struct json is json_t under another name. */
#include "ground.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static json_t *inner(struct json *json)
{
    return (json_t *)(void *)json;
}

static struct json *outer(json_t *json)
{
    if (!json) {
        (void)fputs("beamfit: memory is out\n", stderr);
        exit(BF_NUMERIC);
    }
    return (struct json *)(void *)json;
}

struct json *json_new_object(void)
{
    return outer(json_object());
}

struct json *json_new_array(void)
{
    return outer(json_array());
}

/* Printable ASCII stays, every other byte becomes \xHH. */
static json_t *escaped(const char *text)
{
    size_t n = strlen(text), used = 0;
    char *copy = bf_alloc(4 * n + 1, 1);
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)text[i];
        used += (size_t)snprintf(copy + used, 5, c >= 0x20 && c < 0x7F ? "%c" : "\\x%02X", c);
    }
    json_t *json = json_string(copy);
    free(copy);
    return json;
}

static struct json *text_value(const char *text)
{
    json_t *json = json_string(text); /* NULL when it is not UTF-8 */
    return outer(json ? json : escaped(text));
}

/* Whole numbers print without ".0": a count is a count. */
static struct json *number_value(double x)
{
    if (!isfinite(x))
        return outer(json_null());
    bool whole = fabs(x) < 1e15 && floor(x) >= x;
    return outer(whole ? json_integer((json_int_t)x) : json_real(x));
}

struct json *json_put(struct json *object, const char *key, struct json *child)
{
    if (json_object_set(inner(object), key, inner(child)) != 0) { /* the key is not UTF-8 */
        json_t *plain = escaped(key);
        (void)json_object_set(inner(object), json_string_value(plain), inner(child));
        json_decref(plain);
    }
    json_decref(inner(child)); /* now the object's alone */
    return child;
}

struct json *json_push(struct json *array, struct json *child)
{
    (void)json_array_append_new(inner(array), inner(child));
    return child;
}

void json_put_number(struct json *object, const char *key, double x)
{
    (void)json_put(object, key, number_value(x));
}

void json_put_text(struct json *object, const char *key, const char *text)
{
    (void)json_put(object, key, text_value(text));
}

void json_put_bool(struct json *object, const char *key, bool x)
{
    (void)json_put(object, key, outer(json_boolean(x)));
}

void json_push_number(struct json *array, double x)
{
    (void)json_push(array, number_value(x));
}

void json_push_text(struct json *array, const char *text)
{
    (void)json_push(array, text_value(text));
}

static const json_t *inside(const struct json *json)
{
    return (const json_t *)(const void *)json;
}

static struct json *found(const json_t *json)
{
    return (struct json *)(uintptr_t)json;
}

bool json_is_list(const struct json *value)
{
    return json_is_array(inside(value));
}

bool json_is_text(const struct json *value)
{
    return json_is_string(inside(value));
}

bool json_number_is(const struct json *value)
{
    return json_is_number(inside(value));
}

double json_number_of(const struct json *value)
{
    return json_is_number(inside(value)) ? json_number_value(inside(value)) : (double)NAN;
}

bool json_truth(const struct json *value)
{
    return json_is_true(inside(value));
}

size_t json_length(const struct json *value)
{
    return json_is_array(inside(value)) ? json_array_size(inside(value)) : json_object_size(inside(value));
}

struct json *json_item(const struct json *list, size_t i)
{
    return found(json_array_get(inside(list), i));
}

struct json *json_member(const struct json *object, const char *key)
{
    return found(json_object_get(inside(object), key));
}

static void *member_at(const struct json *object, size_t i)
{
    json_t *all = (json_t *)(uintptr_t)object;
    void *at = json_object_iter(all);
    while (i-- > 0 && at != NULL)
        at = json_object_iter_next(all, at);
    return at;
}

struct json *json_member_at(const struct json *object, size_t i)
{
    return found(json_object_iter_value(member_at(object, i)));
}

const char *json_member_name(const struct json *object, size_t i)
{
    return json_object_iter_key(member_at(object, i));
}

const char *json_words(const struct json *value, int digits, char text[], size_t size)
{
    const json_t *json = inside(value);
    if (json_is_string(json))
        (void)snprintf(text, size, "%s", json_string_value(json));
    else if (json_is_boolean(json))
        (void)snprintf(text, size, "%s", json_is_true(json) ? "yes" : "no");
    else if (json_is_integer(json))
        (void)snprintf(text, size, "%lld", (long long)json_integer_value(json));
    else if (json_is_real(json))
        (void)snprintf(text, size, "%.*g", digits, json_real_value(json));
    else
        (void)snprintf(text, size, "-");
    return text;
}

static enum bf_status print_and_free(struct json *root, size_t layout, FILE *out, struct bf_error *err)
{
    int failed = json_dumpf(inner(root), out, layout | JSON_REAL_PRECISION(17));
    failed |= fputc('\n', out) == EOF || fflush(out) != 0;
    json_decref(inner(root));
    return failed ? bf_fail(err, BF_BAD_FILE, "the answer cannot be written; is the disk or pipe full or closed?")
                  : BF_OK;
}

enum bf_status json_print_and_free(struct json *root, FILE *out, struct bf_error *err)
{
    return print_and_free(root, JSON_INDENT(2), out, err);
}

enum bf_status json_print_line_and_free(struct json *root, FILE *out, struct bf_error *err)
{
    return print_and_free(root, JSON_COMPACT, out, err);
}

void json_discard(struct json *root)
{
    json_decref(inner(root));
}
