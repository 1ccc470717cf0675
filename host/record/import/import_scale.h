/* SPDX-License-Identifier: GPL-3.0-or-later */
/* import_scale.h — what a scale is worth for one channel. Private to import/. */
#ifndef BEAMFIT_IMPORT_SCALE_H
#define BEAMFIT_IMPORT_SCALE_H

#include "import.h"

/*
 * The factor by which a channel is multiplied to become a column of this name, and the column's unit ("" not known, else static or the
 * scale's). A sensitivity needs both units: that of the channel as the file states it, else volts or what the column's name says.
 * BF_USAGE: they do not go together.
 */
enum bf_status import_scale_factor(const struct import_scale *scale, const struct import_file *file,
                                   const struct import_channel *channel, const char *column, double *factor,
                                   const char **unit, struct bf_error *err);

#endif
