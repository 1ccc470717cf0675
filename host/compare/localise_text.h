/* SPDX-License-Identifier: GPL-3.0-or-later */
/* localise_text.h — where the misfit is, in sentences. Private to compare/. */
#ifndef BEAMFIT_LOCALISE_TEXT_H
#define BEAMFIT_LOCALISE_TEXT_H

#include "compare.h"

/* channels: [n_channels]. Fills out->text from out->parts and out->excess. */
void localise_describe(const struct misfit_channel channels[], size_t n_channels, struct localisation *out);

#endif
