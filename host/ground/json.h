/* SPDX-License-Identifier: GPL-3.0-or-later */
/* json.h — building machine-readable answers. NaN and infinities become null. Only json.c sees jansson. */
#ifndef BEAMFIT_JSON_H
#define BEAMFIT_JSON_H

#include <stdbool.h>
#include <stdio.h>
#include "error.h"

struct json;

struct json *json_new_object(void);
struct json *json_new_array(void);
/* The child belongs to the parent afterwards. Returns the child, so that building reads top-down. */
struct json *json_put(struct json *object, const char *key, struct json *child);
struct json *json_push(struct json *array, struct json *child);
void json_put_number(struct json *object, const char *key, double x);
void json_put_text(struct json *object, const char *key, const char *text); /* must be UTF-8; else escaped */
void json_put_bool(struct json *object, const char *key, bool x);
void json_push_number(struct json *array, double x);
void json_push_text(struct json *array, const char *text);
/* Print with a final newline and free the whole tree. */
enum bf_status json_print_and_free(struct json *root, FILE *out, struct bf_error *err);
/* The same on one line, for answers that never end: one object a line. */
enum bf_status json_print_line_and_free(struct json *root, FILE *out, struct bf_error *err);
void json_discard(struct json *root);

#endif
