/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_text.c — a growing text of YAML: pieces, numbers, scalars with quotes where they are needed. */
#include "model_yaml_text.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "ground/ground.h"

void yaml_text_add(struct yaml_text *text, const char *s)
{
    size_t n = strlen(s);
    if (text->n + n + 1 > text->room) {
        text->room = 2 * (text->n + n) + 256;
        text->s = bf_grow(text->s, text->room, 1);
    }
    memcpy(text->s + text->n, s, n + 1);
    text->n += n;
}

void yaml_text_addf(struct yaml_text *text, const char *format, ...)
{
    char piece[512];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(piece, sizeof piece, format, args);
    va_end(args);
    yaml_text_add(text, piece);
}

void yaml_text_number(struct yaml_text *text, double x)
{
    char number[DECIMAL_TEXT];
    decimal_print(number, x);
    yaml_text_add(text, number);
}

static bool is_plain_word(const char *s)
{
    static const char *const reserved[] = {"true", "false", "null", "yes", "no", "on", "off", "y", "n", "~"};
    double number;
    size_t n = strlen(s);
    const char *inside = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./+-";
    if (n == 0 || strspn(s, inside) != n || strchr("-.+/", s[0]) || decimal_parse(s, &number))
        return false;
    for (size_t i = 0; i < sizeof reserved / sizeof *reserved; i++)
        if (strcasecmp(s, reserved[i]) == 0)
            return false;
    return strspn(s, "0123456789_+-.eExabcdefABCDEF") != n; /* digests, dates, other number-like words */
}

void yaml_text_scalar(struct yaml_text *text, const char *s)
{
    if (is_plain_word(s)) {
        yaml_text_add(text, s);
        return;
    }
    yaml_text_add(text, "\"");
    for (; *s; s++) {
        if (*s == '"' || *s == '\\')
            yaml_text_addf(text, "\\%c", *s);
        else if ((unsigned char)*s < ' ' || *s == 0x7F)
            yaml_text_addf(text, "\\x%02X", (unsigned)(unsigned char)*s);
        else
            yaml_text_addf(text, "%c", *s);
    }
    yaml_text_add(text, "\"");
}
