/* SPDX-License-Identifier: GPL-3.0-or-later */
/* number.h — decimal numbers in text that is not NUL-terminated. Correctly rounded, whatever the locale. */
#ifndef BEAMFIT_NUMBER_H
#define BEAMFIT_NUMBER_H

#include <stdbool.h>

/*
 * Reads [+-]digits[POINTdigits][e[+-]digits] from the start of [s, end). Returns the first character after it, NULL
 * when there is no number. No blanks are skipped; no hexadecimal, nan, inf. Too large a number gives ±INFINITY, too
 * small a one the nearest subnormal or 0. About 20 ns for up to 15 digits, 200 ns beyond.
 */
const char *number_scan(const char *s, const char *end, char point, double *x);

/* The whole of [s, end), blanks around it allowed. */
bool number_parse(const char *s, const char *end, char point, double *x);

/* How exactly a number was printed: its significant digits (of 0: none), and the decimal places of its last digit. */
struct number_digits {
    int significant, decimals;
};
struct number_digits number_digits(const char *s, const char *end, char point);

#endif
