/* SPDX-License-Identifier: GPL-3.0-or-later */
/* record_spool.h — the file of a spool; private to record/. */
#ifndef BEAMFIT_RECORD_SPOOL_H
#define BEAMFIT_RECORD_SPOOL_H

#include "record.h"

/* A file without a name in the directory of `beside` (a device or "-": the current one); NULL: none can be made there. */
FILE *record_spool_open(const char *beside);
/* Numbers of a row's cell (0: time), of samples `first` … first + n − 1 as far as there are; how many there were. */
size_t record_spool_numbers(const struct record_spool *spool, size_t cell, size_t first, size_t n, double x[]);
/* The columns of a record with so many rows, out of the file into memory. */
enum bf_status record_spool_rows(const struct record_spool *spool, struct record *record, struct bf_error *err);

#endif
