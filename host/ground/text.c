/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { WORD = 96 };

static int lower(int c)
{
    return c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c;
}

static size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Edit distance with transpositions of neighbours; letters that differ in case only cost nothing. Rows of one table. */
static size_t distance(const char *a, const char *b)
{
    size_t n = strlen(a), m = strlen(b);
    if (n >= WORD || m >= WORD)
        return WORD;
    size_t rows[3][WORD];
    size_t *before = rows[0], *last = rows[1], *now = rows[2];
    for (size_t j = 0; j <= m; j++)
        last[j] = j;
    memcpy(before, last, sizeof rows[0]);
    for (size_t i = 1; i <= n; i++) {
        now[0] = i;
        for (size_t j = 1; j <= m; j++) {
            size_t change = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
            now[j] = smaller(smaller(last[j] + 1, now[j - 1] + 1), last[j - 1] + change);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
                now[j] = smaller(now[j], before[j - 2] + 1);
        }
        size_t *oldest = before;
        before = last;
        last = now;
        now = oldest;
    }
    return last[m];
}

const char *text_closest(const char *word, const char *const known[], size_t n)
{
    const char *best = NULL;
    size_t length = strlen(word);
    size_t limit = length < 3 ? 1 : length < 6 ? 2 : length / 3 + 1;
    size_t best_distance = limit + 1;
    for (size_t i = 0; i < n; i++) {
        bool abbreviated = length >= 4 && strncmp(word, known[i], length) == 0;
        size_t d = abbreviated ? 1 : distance(word, known[i]);
        if (d < best_distance && d < strlen(known[i])) {
            best_distance = d;
            best = known[i];
        }
    }
    return best;
}

size_t text_columns(void)
{
    long columns = 0;
    struct winsize size;
    const char *variable = getenv("COLUMNS");
    if (variable)
        columns = strtol(variable, NULL, 10);
    else if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0)
        columns = size.ws_col;
    if (columns <= 0)
        columns = 80;
    return columns < 40 ? 40 : columns > 120 ? 120 : (size_t)columns;
}

const char *text_base_name(const char *path)
{
    const char *slash = path != NULL ? strrchr(path, '/') : NULL;
    return slash != NULL ? slash + 1 : path != NULL ? path : "";
}

size_t text_width(const char *text)
{
    size_t n = 0;
    for (; *text; text++)
        if (((unsigned char)*text & 0xC0U) != 0x80U)
            n++;
    return n;
}

void text_print_padded(FILE *out, const char *text, size_t width)
{
    (void)fputs(text, out);
    for (size_t n = text_width(text); n < width; n++)
        (void)fputc(' ', out);
}

void text_print_wrapped(FILE *out, const char *text, size_t indent, size_t columns)
{
    size_t column = indent;
    while (*text) {
        text += strspn(text, " \n");
        size_t bytes = strcspn(text, " \n");
        if (bytes == 0)
            break;
        size_t width = 0;
        for (size_t i = 0; i < bytes; i++)
            width += ((unsigned char)text[i] & 0xC0U) != 0x80U;
        if (column > indent && column + 1 + width > columns) {
            (void)fprintf(out, "\n%*s", (int)indent, "");
            column = indent;
        } else if (column > indent) {
            (void)fputc(' ', out);
            column++;
        }
        (void)fwrite(text, 1, bytes, out);
        column += width;
        text += bytes;
    }
    (void)fputc('\n', out);
}
