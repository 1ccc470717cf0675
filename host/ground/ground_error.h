/* SPDX-License-Identifier: GPL-3.0-or-later */
/* ground_error.h — how a stage says what went wrong, and memory that is never NULL; part of ground.h */
#ifndef BEAMFIT_GROUND_ERROR_H
#define BEAMFIT_GROUND_ERROR_H

#include <stdbool.h>
#include <stddef.h>

/*
 * ERROR — how a stage says what went wrong.
 *
 * Every function that can fail returns enum bf_status and takes a struct bf_error *err as its last argument.
 * On failure err->text is one line for a person, "file:line: what is wrong, what to do", without "beamfit: " and
 * without a newline; main() prints it and exits with the status. err must not be NULL.
 */

enum bf_status {
    BF_OK = 0,
    BF_NO = 1,       /* a clear answer 'no' where a command asks a question */
    BF_USAGE = 2,    /* the caller of the program must change the command line */
    BF_BAD_FILE = 3, /* the owner of a file must change it (or its directory, or the disk) */
    BF_NUMERIC = 4,  /* the computation failed */
    BF_DEVICE = 5    /* a device or port */
};

struct bf_error {
    enum bf_status status;
    char text[1024];
};

/* Fill err and return status, so that `return bf_fail(err, BF_NUMERIC, "...", ...)` reads well. */
enum bf_status bf_fail(struct bf_error *err, enum bf_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* "file:line: text"; line 0 leaves the line out. */
enum bf_status bf_fail_at(struct bf_error *err, const char *file, long line, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* A note for the person at the terminal, on standard error: "beamfit: warning: …" (never an error). */
void bf_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Who is told of every warning besides, from whatever thread; NULL: nobody. Call while one thread runs. */
typedef void bf_warn_listener(void *context, const char *text);
void bf_warn_listen(bf_warn_listener *tell, void *context);

/* malloc/calloc/realloc/strdup that end the program with a message (status 4) when memory is out. */
void *bf_alloc(size_t count, size_t size);
void *bf_grow(void *old, size_t count, size_t size);
char *bf_strdup(const char *text);

#ifdef __clang_analyzer__ /* clang's analyser does not see error.c: bf_fail() returns its status, bf_alloc() zeroed memory, never NULL */
static inline void *bf_alloc_known(size_t count, size_t size)
{
    void *p = calloc(count > 0 ? count : 1, size > 0 ? size : 1);
    if (p == NULL)
        abort();
    return p;
}
#define bf_fail(err, status, ...)        ((bf_fail)(err, status, __VA_ARGS__), (status))
#define bf_fail_at(err, file, line, ...) ((bf_fail_at)(err, file, line, __VA_ARGS__), BF_BAD_FILE)
#define bf_alloc(count, size)            bf_alloc_known(count, size)
#endif

#endif
