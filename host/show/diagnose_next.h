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

/*
 * written: the file that already holds the found model; NULL: none. factors: what was put right before the diagnosis, so that the model's own file is not the one that was
 * diagnosed. Free with diagnose_next_free().
 */
void diagnose_next(const struct diagnosis *d, const char *written, const struct channel_factors *factors,
                   struct diagnose_next *out);
void diagnose_next_free(struct diagnose_next *next);

#endif
