/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * atomic_file.h — write a file whole or not at all. Every writer of the program uses it.
 *
 *     struct atomic_file out;
 *     if (atomic_open(path, &out, err) != BF_OK)
 *         return err->status;
 *     fprintf(out.f, ...);
 *     return atomic_commit(&out, err);       // or atomic_abort(&out) when the content could not be made
 *
 * Content goes to a temporary file in the directory of the target, and replaces the target by rename() after a
 * successful fsync(). Until then, and after any failure, an existing target is untouched. A symbolic link is followed;
 * an existing target keeps its permissions. Devices and pipes (/dev/stdout, /dev/null) are written directly.
 */
#ifndef BEAMFIT_ATOMIC_FILE_H
#define BEAMFIT_ATOMIC_FILE_H

#include <stdio.h>
#include "error.h"

struct atomic_file {
    FILE *f;         /* write here; errors need not be checked before commit */
    char *path;      /* the target as given, for messages */
    char *target;    /* the target with links resolved */
    char *temporary; /* NULL: written directly */
};

/* BF_BAD_FILE when the directory is missing or not writable, or the target is a directory or read-only. */
enum bf_status atomic_open(const char *path, struct atomic_file *af, struct bf_error *err);
/* BF_BAD_FILE when any write since open failed (disk full): then the temporary file is gone. Frees af either way. */
enum bf_status atomic_commit(struct atomic_file *af, struct bf_error *err);
/* Removes the temporary file and frees af. Does nothing after atomic_commit() or another atomic_abort(). */
void atomic_abort(struct atomic_file *af);

#endif
