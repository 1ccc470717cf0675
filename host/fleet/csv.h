/* SPDX-License-Identifier: GPL-3.0-or-later */
/* csv.h — lines of a table with commas and quotes, and the files that its cells name. Private to fleet/. */
#ifndef BEAMFIT_FLEET_CSV_H
#define BEAMFIT_FLEET_CSV_H

#include "ground/ground.h"

enum { CSV_MOST_CELLS = 256 };

/* One line taken apart. Starts empty; the caller frees buffer. */
struct csv_cells {
    size_t n;
    char *text[CSV_MOST_CELLS];
    char *buffer; /* owned */
};

/* The next line that is not empty and no comment; *more false: there is none. */
enum bf_status csv_next(struct lines *in, struct csv_cells *out, bool *more, struct bf_error *err);
char *csv_without_blanks(char *text); /* in place */

/* Where a file that the table names is: beside the table, unless it says its own way. The caller frees it. */
char *csv_place(const char *table, const char *name);

#endif
