/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ground.h"
#undef bf_fail
#undef bf_fail_at
#undef bf_alloc

/* One printable line: text quoted from a hostile file must not move the cursor or add lines. */
static void make_one_line(char *text)
{
    for (unsigned char *c = (unsigned char *)text; *c != 0; c++)
        if (*c < 0x20 || *c == 0x7f)
            *c = '?';
}

enum bf_status bf_fail(struct bf_error *err, enum bf_status status, const char *format, ...)
{
    char text[sizeof err->text]; /* an argument may be err->text itself */
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    make_one_line(text);
    memcpy(err->text, text, sizeof text);
    err->status = status;
    return status;
}

enum bf_status bf_fail_at(struct bf_error *err, const char *file, long line, const char *format, ...)
{
    char text[sizeof err->text];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (line > 0)
        return bf_fail(err, BF_BAD_FILE, "%s:%ld: %s", file, line, text);
    return bf_fail(err, BF_BAD_FILE, "%s: %s", file, text);
}

static struct {
    bf_warn_listener *tell;
    void *context;
} listener;

void bf_warn_listen(bf_warn_listener *tell, void *context)
{
    listener.context = context;
    listener.tell = tell;
}

void bf_warn(const char *format, ...)
{
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    make_one_line(text);
    fprintf(stderr, "beamfit: warning: %s\n", text);
    if (listener.tell != NULL)
        listener.tell(listener.context, text);
}

static void end_out_of_memory(size_t count, size_t size)
{
    fprintf(stderr, "beamfit: memory is out (%zu x %zu bytes wanted): use a shorter record or a larger machine\n",
            count, size);
    exit(BF_NUMERIC);
}

void *bf_alloc(size_t count, size_t size)
{
    void *p = calloc(count > 0 ? count : 1, size > 0 ? size : 1);
    if (p == NULL)
        end_out_of_memory(count, size);
    return p;
}

void *bf_grow(void *old, size_t count, size_t size)
{
    if (size > 0 && count > SIZE_MAX / size)
        end_out_of_memory(count, size);
    void *p = realloc(old, count * size > 0 ? count * size : 1);
    if (p == NULL)
        end_out_of_memory(count, size);
    return p;
}

char *bf_strdup(const char *text)
{
    char *copy = strdup(text);
    if (copy == NULL)
        end_out_of_memory(strlen(text) + 1, 1);
    return copy;
}
