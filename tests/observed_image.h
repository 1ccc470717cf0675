/* SPDX-License-Identifier: GPL-3.0-or-later */
/* observed_image.h — the image that `export` makes of a model file, for tests that see the controller's sizes. */
#ifndef OBSERVED_IMAGE_H
#define OBSERVED_IMAGE_H

#include <stddef.h>
#include <stdint.h>

/* n bytes into out; EI_beam is multiplied by `stiffness`. 0: made. */
int observed_image(const char *path, double stiffness, size_t n, uint8_t out[]);

#endif
