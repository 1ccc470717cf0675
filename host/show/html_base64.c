/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdint.h>

#include "html.h"

void html_base64(FILE *out, const void *bytes, size_t n)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned char *b = bytes;
    for (size_t i = 0; i < n; i += 3) {
        const size_t left = n - i;
        const uint32_t three =
            (uint32_t)b[i] << 16 | (left > 1 ? (uint32_t)b[i + 1] << 8 : 0U) | (left > 2 ? b[i + 2] : 0U);
        (void)fputc(digit[three >> 18], out);
        (void)fputc(digit[three >> 12 & 63U], out);
        (void)fputc(left > 1 ? digit[three >> 6 & 63U] : '=', out);
        (void)fputc(left > 2 ? digit[three & 63U] : '=', out);
    }
}
