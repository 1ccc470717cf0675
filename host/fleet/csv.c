/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "csv.h"

#include <stdlib.h>
#include <string.h>

static bool is_empty(const char *line, size_t n)
{
    size_t blanks = 0;
    while (blanks < n && (line[blanks] == ' ' || line[blanks] == '\t'))
        blanks++;
    return blanks == n || line[blanks] == '#';
}

char *csv_without_blanks(char *text)
{
    text += strspn(text, " \t");
    size_t n = strlen(text);
    while (n > 0 && (text[n - 1] == ' ' || text[n - 1] == '\t'))
        text[--n] = '\0';
    return text;
}

/* A quoted cell at *from behind its quote; false: it does not end, or something follows it. */
static bool unquote(char **from, char **to)
{
    for (char *s = *from;; s++) {
        if (*s == '\0')
            return false;
        if (*s == '"' && s[1] != '"') {
            *from = s + 1 + strspn(s + 1, " \t");
            return **from == ',' || **from == '\0';
        }
        if (*s == '"')
            s++;
        *(*to)++ = *s;
    }
}

static enum bf_status split(const struct lines *in, const char *text, size_t n, struct csv_cells *out,
                            struct bf_error *err)
{
    char *from = out->buffer = bf_grow(out->buffer, n + 1, 1);
    memcpy(from, text, n);
    from[n] = '\0';
    for (out->n = 0;; from++) {
        if (out->n == CSV_MOST_CELLS)
            return bf_fail_at(err, in->path, in->number, "more than %d cells; a table of units has fewer columns",
                              CSV_MOST_CELLS);
        char *first = from + strspn(from, " \t"), *to = first;
        if (*first == '"') {
            from = first + 1;
            if (!unquote(&from, &to))
                return bf_fail_at(err, in->path, in->number,
                                  "cell %zu has a quote that is not closed; write \"a \"\"b\"\" c\" for a \"b\" c",
                                  out->n + 1);
        } else {
            from += strcspn(from, ",");
            to = from;
        }
        const bool last = *from == '\0';
        *to = '\0';
        out->text[out->n++] = csv_without_blanks(first);
        if (last)
            return BF_OK;
    }
}

enum bf_status csv_next(struct lines *in, struct csv_cells *out, bool *more, struct bf_error *err)
{
    const char *line;
    size_t length;
    do {
        const enum bf_status status = lines_next(in, &line, &length, err);
        *more = status == BF_OK && line != NULL;
        if (!*more)
            return status;
    } while (is_empty(line, length));
    return split(in, line, length, out, err);
}

char *csv_place(const char *manifest, const char *name)
{
    const size_t directory = (size_t)(text_base_name(manifest) - manifest), n = strlen(name);
    if (name[0] == '/' || n == 0)
        return bf_strdup(name);
    char *path = bf_alloc(directory + n + 1, 1);
    memcpy(path, manifest, directory);
    memcpy(path + directory, name, n + 1);
    return path;
}
