/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_units.h — names and units as people and programs write them, and the names of columns made of them. */
#ifndef BEAMFIT_IMPORT_UNITS_H
#define BEAMFIT_IMPORT_UNITS_H

#include "import.h"

/* "Force (N)", "N" -> "Force_N": letters, digits and '_' with the unit as suffix. Caller frees. */
char *import_column_name(const struct import_channel *channel);

/* A unit as people and files write it. */
struct import_unit {
    const char *suffix; /* of a column's name: "mps2" */
    const char *SI;     /* suffix of its SI unit */
    double factor;      /* one unit in SI */
};
bool import_unit(const char *text, struct import_unit *out);           /* "m/s^2", "Volts", "mV" */
bool import_unit_of_name(const char *column, struct import_unit *out); /* "accel_mps2" */

/* "Force [N]" -> length of "Force", and the unit; no unit: the whole length and *unit_n = 0. */
size_t import_split_unit(const char *text, size_t n, const char **unit, size_t *unit_n);

/* "Sampling rate: 2.5 kHz", "Sample interval;0.4 ms" in a line of text; 0 when it says no such thing. */
double import_rate_in_text(const char *text, size_t n, char point);

#endif
