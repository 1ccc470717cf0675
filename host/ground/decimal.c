/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool decimal_parse(const char *text, double *out)
{
    const char *s = *text == '+' || *text == '-' ? text + 1 : text;
    if (strcmp(s, ".inf") == 0) {
        *out = *text == '-' ? -HUGE_VAL : HUGE_VAL;
        return true;
    }
    return number_parse(text, text + strlen(text), '.', out) && isfinite(*out);
}

/* "1e-05" -> "1.0e-5": a point in the mantissa for YAML 1.1 readers, no leading zero in the exponent. */
static void tidy_exponent(char text[DECIMAL_TEXT])
{
    char *e = strchr(text, 'e');
    if (!e)
        return;
    char exponent[8];
    const char *digits = e + 2;
    while (digits[0] == '0' && digits[1])
        digits++;
    (void)snprintf(exponent, sizeof exponent, "%c%.4s", e[1], digits);
    const char *point = memchr(text, '.', (size_t)(e - text)) ? "" : ".0";
    (void)snprintf(e, DECIMAL_TEXT - (size_t)(e - text), "%se%s", point, exponent);
}

/* x rounded to so many significant digits; without an exponent from 0.0001 to 1e15. */
static void print_with(char text[DECIMAL_TEXT], double x, int digits)
{
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    locale_t old = c ? uselocale(c) : (locale_t)0;
    (void)snprintf(text, DECIMAL_TEXT, "%.*e", digits - 1, x);
    long power = strtol(strchr(text, 'e') + 1, NULL, 10);
    if (power >= -4 && power < 15) {
        long decimals = digits - 1 - power;
        double rounded = strtod(text, NULL);
        (void)snprintf(text, DECIMAL_TEXT, "%.*f", decimals > 0 ? (int)decimals : 0, rounded);
    }
    if (c) {
        (void)uselocale(old);
        freelocale(c);
    }
    tidy_exponent(text);
}

void decimal_print(char text[DECIMAL_TEXT], double x)
{
    if (!isfinite(x)) {
        (void)snprintf(text, DECIMAL_TEXT, "%s", isnan(x) ? ".nan" : x < 0 ? "-.inf" : ".inf");
        return;
    }
    for (int digits = 1; digits <= 17; digits++) {
        double back;
        print_with(text, x, digits);
        if (decimal_parse(text, &back) && !(back < x) && !(back > x))
            return;
    }
}

void decimal_print_rounded(char text[DECIMAL_TEXT], double x, int digits)
{
    double rounded = x;
    if (isfinite(x)) {
        print_with(text, x, digits);
        if (!decimal_parse(text, &rounded))
            rounded = x;
    }
    decimal_print(text, rounded);
}
