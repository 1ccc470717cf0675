/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <locale.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "ground.h"

enum { LONGEST_NUMBER = 1100 }; /* a double printed in full has up to 1077 digits */

static locale_t c_locale;
static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;

static void make_c_locale(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

/* Any length and exponent, by the C library. */
static bool scan_slowly(const char *s, const char *end, char point, double *x)
{
    char text[LONGEST_NUMBER + 1];
    size_t n = (size_t)(end - s);
    if (n > LONGEST_NUMBER)
        return false;
    memcpy(text, s, n);
    text[n] = '\0';
    char *at = memchr(text, point, n);
    if (at != NULL)
        *at = '.';
    pthread_once(&c_locale_once, make_c_locale);
    *x = c_locale != (locale_t)0 ? strtod_l(text, NULL, c_locale) : strtod(text, NULL);
    return true;
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* The parts of a number in text: value = ± mantissa × 10^exponent when exact. */
struct parts {
    bool negative, exact;
    uint64_t mantissa;
    int exponent;
};

/* "e+05": the end of it, and its value; s itself when there is no exponent. */
static const char *scan_exponent(const char *s, const char *end, int *exponent)
{
    const char *p = s;
    *exponent = 0;
    if (p == end || (*p != 'e' && *p != 'E'))
        return s;
    bool negative = ++p < end && *p == '-';
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    if (p == end || !is_digit(*p))
        return s;
    int e = 0;
    for (; p < end && is_digit(*p); p++)
        if (e < 100000)
            e = 10 * e + (*p - '0');
    *exponent = negative ? -e : e;
    return p;
}

static const char *scan_parts(const char *s, const char *end, char point, struct parts *out)
{
    const char *p = s;
    int digits = 0, significant = 0, decimals = 0, exponent;
    *out = (struct parts){.negative = p < end && *p == '-'};
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    for (bool fraction = false; p < end; p++) {
        if (is_digit(*p)) {
            digits++;
            decimals += fraction ? 1 : 0;
            significant += significant > 0 || *p != '0' ? 1 : 0;
            if (significant <= 19)
                out->mantissa = 10 * out->mantissa + (uint64_t)(*p - '0');
        } else if (*p == point && !fraction) {
            fraction = true;
        } else {
            break;
        }
    }
    if (digits == 0)
        return NULL;
    p = scan_exponent(p, end, &exponent);
    out->exponent = exponent - decimals;
    out->exact = significant <= 19 && out->mantissa <= (UINT64_C(1) << 53);
    return p;
}

const char *number_scan(const char *s, const char *end, char point, double *x)
{
    static const double power[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                   1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    struct parts parts;
    const char *after = scan_parts(s, end, point, &parts);
    if (after == NULL)
        return NULL;
    if (parts.exact && parts.exponent >= -22 && parts.exponent <= 22) {
        /* both factors are exact doubles, so one correctly rounded operation gives the nearest double */
        double m = (double)parts.mantissa;
        m = parts.exponent < 0 ? m / power[-parts.exponent] : m * power[parts.exponent];
        *x = parts.negative ? -m : m;
        return after;
    }
    return scan_slowly(s, after, point, x) ? after : NULL;
}

static const char *skip_blanks(const char *s, const char *end)
{
    while (s < end && (*s == ' ' || *s == '\t'))
        s++;
    return s;
}

bool number_parse(const char *s, const char *end, char point, double *x)
{
    const char *after = number_scan(skip_blanks(s, end), end, point, x);
    return after != NULL && skip_blanks(after, end) == end;
}

struct number_digits number_digits(const char *s, const char *end, char point)
{
    struct number_digits out = {0, 0};
    bool fraction = false;
    const char *p = skip_blanks(s, end);
    if (p < end && (*p == '-' || *p == '+'))
        p++;
    for (; p < end && (is_digit(*p) || (*p == point && !fraction)); p++) {
        if (*p == point) {
            fraction = true;
            continue;
        }
        out.significant += out.significant > 0 || *p != '0' ? 1 : 0;
        out.decimals += fraction ? 1 : 0;
    }
    int exponent;
    scan_exponent(p, end, &exponent);
    out.decimals -= exponent;
    return out;
}
