/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * a2l.h — the controller's description for measurement and calibration tools (ASAM MCD-2 MC 1.7.1): live sample, facts,
 * drive, the image's segment with its two pages, and how to reach them (XCP on SxI).
 */
#ifndef BEAMFIT_A2L_H
#define BEAMFIT_A2L_H

#include "target_image.h"

/* BF_BAD_FILE when the file cannot be written. */
enum bf_status a2l_write(const char *path, const struct target_image *image, struct bf_error *err);

#endif
