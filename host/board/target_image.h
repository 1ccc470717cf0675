/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image.h — private to board/: what its files share of target_image. */
#ifndef BEAMFIT_TARGET_IMAGE_PRIVATE_H
#define BEAMFIT_TARGET_IMAGE_PRIVATE_H

#include "board.h"

enum { TARGET_PROOF_STEPS = 256 };

/* What a step of this image costs, in one clause: "linear", "laws at 8 points" … with the instructions measured. */
void target_image_cost(const struct beam_image_file *file, char text[160]);

#endif
