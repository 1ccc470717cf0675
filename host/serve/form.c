/* SPDX-License-Identifier: GPL-3.0-or-later */
/* form.c — fields of application/x-www-form-urlencoded. */
#include <string.h>

#include "serve.h"

static int digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

/* text[n] decoded; false when it does not fit, is cut, or holds control characters. */
static bool decode(const char *text, size_t n, char *out, size_t size)
{
    size_t used = 0;
    for (size_t i = 0; i < n; i++) {
        int c = text[i] == '+' ? ' ' : (unsigned char)text[i];
        if (text[i] == '%') {
            if (n - i < 3 || digit(text[i + 1]) < 0 || digit(text[i + 2]) < 0)
                return false;
            c = 16 * digit(text[i + 1]) + digit(text[i + 2]);
            i += 2;
        }
        if (c < ' ' || c == 0x7F || used + 1 >= size)
            return false;
        out[used++] = (char)c;
    }
    out[used] = '\0';
    return true;
}

bool form_field(const char *form, size_t n, const char *name, char *out, size_t size)
{
    const size_t n_name = strlen(name);
    for (size_t i = 0; i < n;) {
        const char *end = memchr(form + i, '&', n - i);
        const size_t length = end != NULL ? (size_t)(end - form) - i : n - i;
        if (length > n_name && memcmp(form + i, name, n_name) == 0 && form[i + n_name] == '=')
            return decode(form + i + n_name + 1, length - n_name - 1, out, size);
        i += length + 1;
    }
    return false;
}
