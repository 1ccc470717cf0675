/* SPDX-License-Identifier: GPL-3.0-or-later */
/* decimal.h — numbers as a person and a YAML reader expect them, whatever the locale; number.h does the scanning. */
#ifndef BEAMFIT_DECIMAL_H
#define BEAMFIT_DECIMAL_H

#include <stdbool.h>

enum { DECIMAL_TEXT = 32 };

/*
 * The whole text must be one decimal number ("1.050", "0.8e-5", "-3", ".5") or ".inf", "-.inf". False otherwise, and when
 * the number is too large for a double.
 */
bool decimal_parse(const char *text, double *out);

/* Shortest decimal text that reads back as exactly x: "0.05", "8.25e-6", "1.0e+7"; YAML 1.1 and 1.2 both read it. */
void decimal_print(char text[DECIMAL_TEXT], double x);

/* As above after rounding x to so many significant digits: for quantities that are themselves uncertain. */
void decimal_print_rounded(char text[DECIMAL_TEXT], double x, int digits);

#endif
