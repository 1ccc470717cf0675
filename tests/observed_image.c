/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "observed_image.h"

#include <stdio.h>
#include <string.h>

#include "board/board.h"

int observed_image(const char *path, double stiffness, size_t n, uint8_t out[])
{
    static struct target_image image;
    struct model model;
    struct bf_error err;
    const struct target_options options = {.hold = BEAM_HOLD_ZERO_ORDER, .tracks = true};
    if (model_read(path, &model, &err) != BF_OK) {
        (void)fprintf(stderr, "%s\n", err.text);
        return -1;
    }
    model.materials[0].EI.value *= stiffness;
    const enum bf_status status = target_image_make(&model, &options, &image, &err);
    if (status == BF_OK && n == sizeof image.file)
        memcpy(out, &image.file, n);
    else
        (void)fprintf(stderr, "%s\n", err.text);
    target_image_free(&image);
    model_free(&model);
    return status == BF_OK && n == sizeof image.file ? 0 : -1;
}
