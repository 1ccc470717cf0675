/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_write.h — the end of `beamfit import`: the record made, gated, written; and what is said of it and of a foreign file. */
#ifndef BEAMFIT_IMPORT_WRITE_H
#define BEAMFIT_IMPORT_WRITE_H

#include "record/import/import.h"
#include "show/show.h"

struct import_job {
    const char *output;
    int digits;             /* significant; 0: the usual number */
    const char *trigger[2]; /* columns of two files; NULL: none */
    const char *gate;       /* column; NULL: none */
    double gate_s[2];       /* from, to; equal: its hits */
};

/* The record of n_files (1 or 2) files, written and shown on standard output with what is wrong with it. */
enum bf_status import_write(const struct import_file files[], size_t n_files, const struct import_choice *choice,
                            const struct import_job *job, struct bf_error *err);

enum bf_status import_print_list(const struct import_file *file, struct bf_error *err);

extern const struct answer_field import_fields[]; /* of both */

#endif
