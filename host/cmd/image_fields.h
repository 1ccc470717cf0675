/* SPDX-License-Identifier: GPL-3.0-or-later */
/* image_fields.h — what the names in the answers of export, sign and verify are. */
#ifndef BEAMFIT_IMAGE_FIELDS_H
#define BEAMFIT_IMAGE_FIELDS_H

#include "show/show.h"

extern const struct answer_field target_image_board_fields[], target_image_observer_fields[], target_image_use_fields[],
    target_image_pole_fields[], target_image_effect_fields[], target_image_deployed_fields[];
extern const struct answer_field target_image_file_fields[]; /* of target_image_file_json(), and file */
extern const struct answer_field target_image_fields[];      /* of target_image_json(), file and a2l */

/* Rows of target_image_file_json(). */
#define TARGET_IMAGE_FIELDS                                                                                            \
    ANSWER_ROW(COUNT, "bytes", "of the image"), ANSWER_ROW(COUNT, "layout", "version of the layout"),                  \
        ANSWER_ROW(BOOL, "signed", "it carries a signature"),                                                          \
        ANSWER_ROW(TEXT, "device", "it is for, 24 hexadecimal digits"), ANSWER_ROW(COUNT, "counter", "of the image"),  \
        ANSWER_ROW(TEXT, "model_sha256", "of the model file"), ANSWER_ROW(COUNT, "crc32", "of the image"),             \
        ANSWER_ROW_OF(OBJECT, "board", "what the controller is wired to", target_image_board_fields),                  \
        ANSWER_ROW_OF(OBJECT, "observer", "what a push is told from a wrong model by", target_image_observer_fields),  \
        ANSWER_ROW(TEXT, "step", "what a step costs, in words"),                                                       \
        ANSWER_ROW(COUNT, "step_bound", "instructions of a step, at most"),                                            \
        ANSWER_ROW(NUMBER, "least_core_MHz", "clock that the step needs"),                                             \
        ANSWER_ROW(COUNT, "law_evaluations", "of each law in a step"),                                                 \
        ANSWER_ROW_OF(LIST, "uses", "effects that run in the step", target_image_use_fields),                          \
        ANSWER_ROW_OF(LIST, "poles", "of the step", target_image_pole_fields)

#endif
