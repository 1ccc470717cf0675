/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_isolated.h — a reader that rests on an outside library, run in a process of its own. */
#ifndef BEAMFIT_IMPORT_ISOLATED_H
#define BEAMFIT_IMPORT_ISOLATED_H

#include "import_format.h"

/*
 * Runs a reader in a child process, so that a file that breaks the reader's library is a bad file and nothing worse.
 * Of the channels name, unit, about, n, x and dt_s come back; of the file rate and metadata.
 */
enum bf_status import_isolated(import_reader *reader, struct import_file *file, const char *data, size_t n,
                               const struct import_reading *how, struct bf_error *err);

#endif
