/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * lines.h — the lines of a text file, one at a time, from a file of any size or from memory. Line ends may be LF or
 * CR LF; a UTF-8 byte order mark is skipped; bytes that no text file has are an error. Memory: one buffer of 256 KiB.
 */
#ifndef BEAMFIT_LINES_H
#define BEAMFIT_LINES_H

#include <stdbool.h>
#include <stddef.h>
#include "error.h"
#include "hash.h"

enum { LINES_LONGEST = 1 << 20 }; /* bytes in a line */

struct lines {
    const char *path; /* the caller's; must outlive this */
    long number;      /* of the line last returned, from 1 */
    int fd;           /* −1: from memory */
    char *buffer;     /* owned when fd ≥ 0 */
    size_t capacity, start, end;
    bool at_end;      /* nothing is left to read from fd */
    struct hash hash; /* of all bytes read from fd */
};

enum bf_status lines_open(const char *path, struct lines *out, struct bf_error *err);
/* The lines of text[n], which is not copied; path is for messages. lines_close() is not needed. */
void lines_from_memory(const char *path, const char *text, size_t n, struct lines *out);
/*
 * The next line [*text, *text + *n) without its end; *text is NULL after the last. Valid until the next call.
 * BF_BAD_FILE: read error, a NUL byte, UTF-16, a line longer than LINES_LONGEST.
 */
enum bf_status lines_next(struct lines *lines, const char **text, size_t *n, struct bf_error *err);
void lines_close(struct lines *lines);

/* A whole file in memory with its SHA-256; caller frees *data. One NUL byte follows the n bytes. */
enum bf_status lines_read_all(const char *path, char **data, size_t *n, char sha256[65], struct bf_error *err);

#endif
