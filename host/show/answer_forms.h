/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer_forms.h — the forms of an answer beside JSON. Private to show/. Writes are not checked. */
#ifndef BEAMFIT_ANSWER_FORMS_H
#define BEAMFIT_ANSWER_FORMS_H

#include <stdio.h>
#include "show.h"

/* The field of that name; NULL: none. */
const struct answer_field *answer_field_of(const struct answer_field fields[], const char *name);

/* Single values as a table, lists of objects as tables with a column a name, all under headings. */
void answer_markdown(FILE *out, const struct json *root, const struct answer_field fields[]);
void answer_html(FILE *out, const struct json *root, const struct answer_field fields[]);

#endif
