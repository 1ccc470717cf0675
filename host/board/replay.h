/* SPDX-License-Identifier: GPL-3.0-or-later */
/* replay.h — a replay of a recording that need not be a file. */
#ifndef BEAMFIT_REPLAY_H
#define BEAMFIT_REPLAY_H

#include "board.h"

/* As replay_run(). lines: of a file that is open, or of memory. */
enum bf_status replay_lines(struct lines *lines, const struct beam_image_file *image, struct replay *out,
                            struct bf_error *err);

#endif
