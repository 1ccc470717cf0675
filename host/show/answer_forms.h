/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_forms.h — the forms of an answer beside JSON. Private to show/. Writes are not checked. */
#ifndef BEAMFIT_ANSWER_FORMS_H
#define BEAMFIT_ANSWER_FORMS_H

#include <stdbool.h>
#include <stdio.h>
#include "show.h"

/* The field of that name; NULL: none. */
const struct answer_field *answer_field_of(const struct answer_field fields[], const char *name);

/* Where words look for values: an object with what its names are, and what it is in. */
struct answer_scope {
    const struct json *object;
    const struct answer_field *fields;
    const struct answer_scope *up;
    const char *name; /* of the object in a map; NULL: it is in a list */
    size_t place;     /* in the list, from 1 */
};

/* The words with their values, see ANSWER_SAY; the caller's to free. */
char *answer_fill(const char *words, const struct answer_scope *scope);

/* A value for a person. object: in which it is. */
void answer_put_value(FILE *out, const struct json *value, const struct answer_field *field, const struct json *object);

/* The value is there and is not null, "", or empty. */
bool answer_is_there(const struct json *value);

/* A list of objects, or a map, as a table of so many columns. list: in scope */
void answer_table(FILE *out, const struct json *list, const struct answer_field *field,
                  const struct answer_scope *scope, size_t columns);

/* Single values as a table, lists of objects as tables with a column a name, all under headings. */
void answer_markdown(FILE *out, const struct json *root, const struct answer_field fields[]);
void answer_html(FILE *out, const struct json *root, const struct answer_field fields[]);

#endif
