/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * import_format.h — the interface of a format of foreign files. A new format is one new file of this folder that defines
 * `const struct import_format import_format_NAME`: the table import_formats[] is made from the sources (tools/table.sh).
 */
#ifndef BEAMFIT_IMPORT_FORMAT_H
#define BEAMFIT_IMPORT_FORMAT_H

#include <string.h>
#include "import.h"

/* How sure a format is that a file is one of its own; the surest format reads it. */
enum import_match {
    IMPORT_NO_MATCH,
    IMPORT_MATCH_TEXT,     /* it is text, and no other format knows it */
    IMPORT_MATCH_FILENAME, /* only the end of the file's name says so */
    IMPORT_MATCH_CONTENT   /* the first bytes of the file say so */
};

/*
 * Reads data[n] (data[n] = 0 too) and adds channels to *file with the functions of import_channel.h; path and sha256 are
 * filled in. BF_BAD_FILE, with the line where it is known.
 */
typedef enum bf_status import_reader(struct import_file *file, const char *data, size_t n,
                                     const struct import_reading *how, struct bf_error *err);

struct import_format {
    const char *name;  /* of --format: "uff" */
    const char *title; /* for people: "Universal File Format 58" */
    enum import_match (*recognise)(const char *path, const char *data, size_t n);
    import_reader *read;
    bool by_outside_library; /* the reader runs in a process of its own (import_isolated.h) */
};

extern const struct import_format *const import_formats[]; /* in order of their names */
extern const int import_formats_count;

/* Does data[n] start with these bytes? */
static inline bool import_starts_with(const char *data, size_t n, const char *start, size_t length)
{
    return n >= length && memcmp(data, start, length) == 0;
}

#endif
