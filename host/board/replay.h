/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * replay.h — did the controller compute what this machine computes? A recording of `record` carries the drive's codes and
 * what the controller predicted; the same image, stepped here by the same library from the sample where the model was at
 * rest, must give the same bits. docs/target_image.md has the columns.
 */
#ifndef BEAMFIT_REPLAY_H
#define BEAMFIT_REPLAY_H

#include "ground/lines.h"
#include "target_image.h"

enum replay_difference { REPLAY_EQUAL, REPLAY_INPUT, REPLAY_PREDICTED, REPLAY_STATUS };

struct replay {
    size_t rows;
    size_t compared;
    size_t before_rest; /* rows before the first step 0 */
    size_t after_gap;   /* rows between a lost sample and the next step 0 */
    size_t gaps, rests; /* lost stretches; times the model was at rest */
    size_t resets;      /* samples in which the controller's state was not finite: not compared */
    size_t other_image; /* rows of an image with another counter */
    unsigned other_counter;
    enum replay_difference difference; /* first of them, then: */
    long line;                         /* of the recording */
    uint32_t sequence, step;
    float recorded, computed; /* of input, predicted; the SOLVE bit of the status */
};

/*
 * The image must be fine (target_image_check()). BF_BAD_FILE: no recording, or nothing in it can be compared, and why.
 * BF_OK also when something differs. Cost: a step a row. lines: of a file that is open, or of memory.
 */
enum bf_status replay_lines(struct lines *lines, const struct beam_image_file *image, struct replay *out,
                            struct bf_error *err);
enum bf_status replay_run(const char *recording, const struct beam_image_file *image, struct replay *out,
                          struct bf_error *err);

#endif
