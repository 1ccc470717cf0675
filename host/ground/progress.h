/* SPDX-License-Identifier: GPL-3.0-or-later */
/* progress.h — a progress bar with an estimate on a terminal (standard error), nothing when piped; and Ctrl-C as a flag. */
#ifndef BEAMFIT_PROGRESS_H
#define BEAMFIT_PROGRESS_H

#include <stdbool.h>

struct progress;

struct progress *progress_begin(const char *what);
/* fraction in [0, 1]; note may be NULL, else one short phrase ("stage 3 of 6, error 0.041"). Cheap: redraws ≤ 10/s. */
void progress_update(struct progress *progress, double fraction, const char *note);
void progress_end(struct progress *progress); /* clears the line */

/* After catch_interrupts(), Ctrl-C sets a flag once; a second Ctrl-C ends the program the ordinary way. */
void progress_catch_interrupts(void);
bool progress_interrupted(void);

#endif
