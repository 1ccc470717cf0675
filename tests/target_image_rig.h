/* SPDX-License-Identifier: GPL-3.0-or-later */
/* target_image_rig.h — images of the paper's beam with effects, for a board of 1024 Hz. Include after cmocka.h. */
#ifndef TARGET_IMAGE_RIG_H
#define TARGET_IMAGE_RIG_H

#include <string.h>
#include "model_fixture.h"
#include "board/board.h"
#include "test_files.h"

static const double rate_Hz = 1024.0;

static inline struct target_options options_for(double noise)
{
    struct target_options o = {.hold = BEAM_HOLD_ZERO_ORDER};
    o.board =
        (struct model_board){.sample_Hz = rate_Hz, .sensor_per_code = 1e-3, .drive_per_code = 0.02, .noise_rms = noise};
    (void)strcpy(o.board.sensor, "piezo_V");
    (void)strcpy(o.board.drive, "drive_V");
    o.board.sensor_zero_code = o.board.drive_zero_code = 2048.0;
    o.sensor_zero = o.drive_zero = true;
    return o;
}

static inline void make_as(const char *effects, bool plain, struct target_image *image)
{
    struct model model;
    struct bf_error err;
    struct target_options o = options_for(2e-3);
    o.plain = plain;
    fixture_model(&model, effects);
    if (target_image_make(&model, &o, image, &err) != BF_OK)
        fail_msg("%s", err.text);
    model_free(&model);
}

static inline void make(const char *effects, struct target_image *image)
{
    make_as(effects, false, image);
}

#endif
