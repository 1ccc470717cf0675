/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_private.h — private to import/: what its files share of import. */
#ifndef BEAMFIT_IMPORT_PRIVATE_H
#define BEAMFIT_IMPORT_PRIVATE_H

#include "import.h"

/* A reader gets data[n] (data[n] = 0 too) and adds channels; import_read() has filled in path and sha256. */
typedef enum bf_status import_reader(struct import_file *file, const char *data, size_t n,
                                     const struct import_reading *how, struct bf_error *err);
import_reader import_uff, import_mat, import_lvm, import_wav, import_csv;

/*
 * Runs a reader in a child process, so that a file that breaks the reader's library is a bad file and nothing worse.
 * Of the channels name, unit, about, n, x and dt_s come back; of the file rate and metadata.
 */
enum bf_status import_isolated(import_reader *reader, struct import_file *file, const char *data, size_t n,
                               const struct import_reading *how, struct bf_error *err);

/* For the readers: a new last channel, with name[name_n] made printable and unique; x (owned, malloc) may be NULL. */
struct import_channel *import_add(struct import_file *file, const char *name, size_t name_n, double *x, size_t n);
void import_set_text(char **text, const char *s, size_t n); /* trims blanks, makes printable */
void import_add_meta(struct import_file *file, const char *key, const char *value, size_t value_n);
void import_set_rate(struct import_file *file, double rate_Hz, const char *from); /* the first one stays */

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

#endif
