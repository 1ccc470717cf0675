/* SPDX-License-Identifier: GPL-3.0-or-later */
/* localise.h — private to compare/: what its files share of localise. */
#ifndef BEAMFIT_LOCALISE_PRIVATE_H
#define BEAMFIT_LOCALISE_PRIVATE_H

#include "compare.h"

/* "all", "large", "small" */
const char *localise_amplitude_text(enum localise_amplitude amplitude);

extern const double localise_least_share;

/* Views of a comparison's channels that are (or are not) held out; out: [comparison->n_channels]; returns how many. */
size_t localise_channels(const struct comparison *comparison, bool held_out, struct misfit_channel out[]);

#endif
