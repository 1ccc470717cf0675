/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_uff_header.h — lines and numbers of a UFF file, and the header of a dataset 58. */
#ifndef BEAMFIT_IMPORT_UFF_HEADER_H
#define BEAMFIT_IMPORT_UFF_HEADER_H

#include <stdbool.h>
#include "ground/ground.h"

enum { UFF_HEADER_LINES = 11, UFF_WIDTH = 80 };

/* The file as bytes with a place and a line in it. */
struct uff_cursor {
    const char *path, *s, *end;
    long line; /* of s; binary values count as no lines */
};

struct uff_line {
    const char *s, *end;
};

/* Record 8 to 11: what an axis is. */
struct uff_axis_text {
    int kind; /* specific data type: 17 time, 18 frequency, 12 acceleration … */
    struct uff_line label, unit;
};

/* The header of one dataset 58. */
struct uff_header {
    long line;
    bool binary, big_endian, abscissa_single;
    unsigned long bytes; /* as claimed */
    struct uff_line title;
    int function, response_node, response_direction, data_type;
    unsigned long n;
    bool even;
    double x0, dx;
    struct uff_axis_text abscissa, ordinate;
};

bool uff_take_line(struct uff_cursor *c, struct uff_line *out);
/* Columns [from, from + width) of a line, blanks trimmed. */
struct uff_line uff_field(struct uff_line l, size_t from, size_t width);
/* Takes a word, or a word that is a whole number, off the line. */
bool uff_take_word(struct uff_line *l, struct uff_line *out);
bool uff_take_integer(struct uff_line *l, long *out);
/* A number as Fortran writes it, too: 1.5D+00 and, with three digits of exponent, 1.5-100. */
bool uff_number(const char *s, const char *end, double *x);
bool uff_is_delimiter(struct uff_line l); /* "    -1" */
bool uff_is_none(struct uff_line l);      /* "" or "NONE" */
/* c stands behind the line "58" or "58b …", given as first; afterwards behind the 11 lines. */
enum bf_status uff_read_header(struct uff_cursor *c, struct uff_line first, struct uff_header *h, struct bf_error *err);

#endif
