/* SPDX-License-Identifier: GPL-3.0-or-later */
/* free_or_warn.h — decays, stable poles and the table of the records' poles beside a comparison: what cannot be computed is said, and left out. */
#ifndef BEAMFIT_FREE_OR_WARN_H
#define BEAMFIT_FREE_OR_WARN_H

#include "compare/compare.h"

struct free_motion {
    bool wanted; /* false: nothing else is known */
    struct amplitude_curves decays;
    struct stabilisation poles;
    struct pole_table table;
};

/* All, when they are wanted. Never fails; free with free_motion_free(). */
struct free_motion free_or_warn(const struct comparison *comparison, bool wanted);
void free_motion_free(struct free_motion *motion);

#endif
