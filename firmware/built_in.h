/* SPDX-License-Identifier: MIT */
/* built_in.h — the model in ROM: what runs when no slot holds a valid one. Made by tools/built_in_image.c. */
#ifndef BUILT_IN_H
#define BUILT_IN_H

#include "beam_image.h"

/* Paper's handbook values, patch drives, patch measures, 1 kHz; counter 0, no device, not signed. */
extern const uint8_t built_in_image[BEAM_IMAGE_BYTES];

#endif
