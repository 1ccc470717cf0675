/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * html.h — pieces of a page that stands alone: text that cannot become markup, numbers, tables, data for its scripts.
 * Nothing here loads anything from elsewhere. No write is checked here: whoever closes the file checks it. Private to show/.
 */
#ifndef BEAMFIT_HTML_H
#define BEAMFIT_HTML_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include "ground/ground.h"

/*
 * Text from anywhere, between tags or in a quoted attribute: & < > " ' as entities; what is not UTF-8, control characters
 * (a tab and a newline are blanks) and marks that turn the direction of writing as U+FFFD.
 */
void html_text(FILE *out, const char *text);
/* The same of a formatted text, of any length. */
void html_textf(FILE *out, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* A name or a path: as html_text(), and of more than 24 characters it may be broken behind / _ - and within long words. */
void html_name(FILE *out, const char *name);

/* RFC 4648, with padding, without line breaks. */
void html_base64(FILE *out, const void *bytes, size_t n);

/*
 * From <!doctype> to <body>, with the style for screen and paper; and the end. program: "beamfit 0.1.0". scripts: the only ones that may run
 * (page_assets.h), NULL at the end; they are written by the caller. live: the page may ask the server that it came from.
 */
void html_begin(FILE *out, const char *title, const char *program, const char *const scripts[], bool live);
void html_end(FILE *out);
/* The Content-Security-Policy of such a page. */
void html_policy(FILE *out, const char *const scripts[], bool live);

/* The tree as <script type="application/json" id=ID>, freed; nothing in it can end the element. */
void html_data(FILE *out, const char *id, struct json *tree);

/*
 * <table id=ID> with a row of headings, one for each column, split at '|' (a heading that begins with '>' stands over
 * numbers); its end.
 */
void html_table_begin(FILE *out, const char *id, const char *headings);
void html_table_end(FILE *out);
/* <td>name</td>, as html_name() */
void html_name_cell(FILE *out, const char *name);
/* <td>text</td> */
void html_cell(FILE *out, const char *format, ...) __attribute__((format(printf, 2, 3)));
/*
 * factor · x as `format` prints it (one conversion of a double, "%.3g", and text around it), powers of ten as a person
 * writes them; x itself, to full precision, is in <data value>. NaN and infinity are a dash. Factor 100: per cent.
 */
void html_number(FILE *out, double x, double factor, const char *format);
/* The same in a cell. */
void html_number_cell(FILE *out, double x, double factor, const char *format);

#endif
