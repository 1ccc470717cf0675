/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_next.h — what to type after a diagnosis; private to show/ */
#ifndef BEAMFIT_DIAGNOSE_NEXT_H
#define BEAMFIT_DIAGNOSE_NEXT_H

#include "explain/explain.h"

/* Whole commands, in order; each effect has a command, then the fit, then the next question. */
struct diagnose_next {
    size_t n;
    char *command[DIAGNOSE_EFFECTS + 2];
};

/* written: the file that already holds the found model; NULL: none. Free with diagnose_next_free(). */
void diagnose_next(const struct diagnosis *d, const char *written, struct diagnose_next *out);
void diagnose_next_free(struct diagnose_next *next);

#endif
