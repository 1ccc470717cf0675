/* SPDX-License-Identifier: GPL-3.0-or-later */
/* text.h — words for people: "did you mean", wrapping to the terminal, column widths of UTF-8. */
#ifndef BEAMFIT_TEXT_H
#define BEAMFIT_TEXT_H

#include <stddef.h>
#include <stdio.h>

/* The known word closest to `word` when it is close enough to be a typing error, else NULL. */
const char *text_closest(const char *word, const char *const known[], size_t n);

/* Columns of the terminal on standard output, or of COLUMNS; 80 when neither is known; within 40 … 120. */
size_t text_columns(void);

/* The last part of a path, in the path itself; "" for NULL. */
const char *text_base_name(const char *path);

/* Characters (code points) of UTF-8 text. */
size_t text_width(const char *text);

/* The text followed by blanks up to `width` characters. */
void text_print_padded(FILE *out, const char *text, size_t width);

/*
 * Paragraph wrapped at `columns`; every line but the first starts with `indent` blanks, and the first is taken to
 * begin at column `indent` already. Ends with a newline.
 */
void text_print_wrapped(FILE *out, const char *text, size_t indent, size_t columns);

#endif
