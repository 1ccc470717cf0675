/* SPDX-License-Identifier: GPL-3.0-or-later */
/* image_fields.c — what the names in the answer on a target image are (board/target_image_text.c makes it). */
#include "image_fields.h"

const struct answer_field target_image_board_fields[] = {
    ANSWER_ROW(NUMBER, "dt_s", "sampling interval"),
    ANSWER_ROW(NUMBER, "clock_relative", "how much longer a second of the board is"),
    ANSWER_ROW(NUMBER, "sensor_per_code", "value of a step of the A/D"),
    ANSWER_ROW(NUMBER, "sensor_zero_code", "code that is 0"),
    ANSWER_ROW(NUMBER, "drive_per_code", "value of a step of the D/A"),
    ANSWER_ROW(NUMBER, "drive_zero_code", "code that is 0"),
    ANSWER_ROW(NUMBER, "noise_rms", "expected, in the sensor's unit"),
    ANSWER_ROW(NUMBER, "alarm_ratio", "the alarm goes on above"),
    ANSWER_ROW(NUMBER, "clear_ratio", "and off below"),
    ANSWER_ROW(NUMBER, "averaging_s", "of the running mean and rms"),
    ANSWER_ROW(NUMBER, "quiet_ratio", "sensor fault below"),
    ANSWER_ROW(NUMBER, "offset_ratio", "offset above"),
    ANSWER_ROW(COUNT, "stuck_samples", "equal codes in a row are a fault"),
    {0},
};

const struct answer_field target_image_observer_fields[] = {
    ANSWER_ROW(COUNT, "modes", "that it follows; 0: there is none"),
    ANSWER_ROW(NUMBER, "innovation_rms", "expected of the right model, in the sensor's unit"),
    ANSWER_ROW(NUMBER, "disturbance_s", "after which a push is over"),
    {0},
};

const struct answer_field target_image_use_fields[] = {
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(NUMBERS, "parameters", "in the order of the catalogue, 0 beyond"),
    {0},
};

const struct answer_field target_image_pole_fields[] = {
    ANSWER_ROW(NUMBER, "frequency_Hz", "of the oscillation"),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping"),
    {0},
};

const struct answer_field target_image_effect_fields[] = {
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(TEXT, "fate", "where it is, or why it is not"),
    ANSWER_ROW(BOOL, "runs", "in the step"),
    {0},
};

const struct answer_field target_image_deployed_fields[] = {
    ANSWER_ROW(COUNT, "modes", "of the beam in the space"),
    ANSWER_ROW(COUNT, "static_responses", "beside them"),
    ANSWER_ROW(BOOL, "band_is_wider", "below half the sample rate the beam has more modes"),
    ANSWER_ROW(NUMBERS, "frequency_Hz", "of each mode in band"),
    ANSWER_ROW(NUMBERS, "relative_error", "of that frequency in the space"),
    ANSWER_ROW(COUNT, "blocks_beside", "for what is faster than the modes"),
    ANSWER_ROW(NUMBER, "held_error", "of the response to a held drive, relative"),
    ANSWER_ROW(NUMBER, "float_error", "of the 24-bit numbers, relative"),
    ANSWER_ROW(COUNT, "step_budget", "instructions between two samples"),
    ANSWER_ROW(NUMBER, "core_MHz", "clock of the processor"),
    ANSWER_ROW(NUMBER, "unsolved_share", "of steps whose law was not solved in time"),
    {0},
};

const struct answer_field target_image_file_fields[] = {
    TARGET_IMAGE_FIELDS,
    ANSWER_ROW(TEXT, "file", "the image"),
    {0},
};

const struct answer_field target_image_fields[] = {
    TARGET_IMAGE_FIELDS,
    ANSWER_ROW(TEXT, "file", "the image"),
    {ANSWER_TEXT, "a2l", "its description", NULL, ANSWER_MAYBE, NULL},
    ANSWER_ROW(TEXT, "sensor", "the model's output on the A/D"),
    ANSWER_ROW(TEXT, "drive", "the model's input on the D/A"),
    ANSWER_ROW(TEXT, "noise_from", "where the expected noise comes from"),
    ANSWER_ROW_OF(LIST, "effects", "of the model", target_image_effect_fields),
    ANSWER_ROW_OF(OBJECT, "deployed", "the space of the step", target_image_deployed_fields),
    ANSWER_ROW(TEXTS, "notes", "on the image"),
    {0},
};
