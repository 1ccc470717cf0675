/* SPDX-License-Identifier: GPL-3.0-or-later */
/* signing.h — the options --key, --device, --counter, which export, sign and verify share. */
#ifndef BEAMFIT_CMD_SIGNING_H
#define BEAMFIT_CMD_SIGNING_H

#include "board/board.h"

struct signing {
    const char *key_file; /* NULL: none */
    bool has_device, has_counter;
    uint8_t device[BEAM_IMAGE_DEVICE_BYTES];
    uint32_t counter;
};

enum bf_status signing_take_device(struct signing *signing, const char *text, struct bf_error *err);
enum bf_status signing_take_counter(struct signing *signing, const char *text, struct bf_error *err);
/* All three, or none where that is allowed. BF_USAGE. */
enum bf_status signing_complete(const struct signing *signing, bool may_be_none, struct bf_error *err);
/* Reads the key, signs, wipes the key. */
enum bf_status signing_sign(const struct signing *signing, struct beam_image_file *file, struct bf_error *err);

#endif
