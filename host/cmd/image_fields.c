/* SPDX-License-Identifier: GPL-3.0-or-later */
/* image_fields.c — what the names in the answer on a target image are (board/target_image_text.c makes it). */
#include "image_fields.h"

const struct answer_field target_image_board_fields[] = {
    ANSWER_ROW(NUMBER, "dt_s", "sampling interval", .digits = 9),
    ANSWER_ROW(NUMBER, "sample_Hz", "by the controller\'s clock", .digits = 6),
    ANSWER_ROW(NUMBER, "clock_relative", "how much longer a second of the board is", .digits = 3),
    ANSWER_ROW(NUMBER, "sensor_per_code", "value of a step of the A/D", .digits = 6),
    ANSWER_ROW(NUMBER, "sensor_zero_code", "code that is 0", .digits = 6),
    ANSWER_ROW(NUMBER, "drive_per_code", "value of a step of the D/A", .digits = 6),
    ANSWER_ROW(NUMBER, "drive_zero_code", "code that is 0", .digits = 6),
    ANSWER_ROW(NUMBER, "noise_rms", "expected, in the sensor's unit", .digits = 4),
    ANSWER_ROW(NUMBER, "alarm_ratio", "the alarm goes on above", .digits = 3),
    ANSWER_ROW(NUMBER, "clear_ratio", "and off below", .digits = 3),
    ANSWER_ROW(NUMBER, "averaging_s", "of the running mean and rms", .digits = 3),
    ANSWER_ROW(NUMBER, "quiet_ratio", "sensor fault below", .digits = 3),
    ANSWER_ROW(NUMBER, "offset_ratio", "offset above", .digits = 3),
    ANSWER_ROW(COUNT, "stuck_samples", "equal codes in a row are a fault"),
    {0},
};

const struct answer_field target_image_observer_fields[] = {
    ANSWER_ROW(COUNT, "modes", "that it follows; 0: there is none"),
    ANSWER_ROW(NUMBER, "innovation_rms", "expected of the right model, in the sensor's unit", .digits = 4),
    ANSWER_ROW(NUMBER, "disturbance_s", "after which a push is over", .digits = 3),
    {0},
};

const struct answer_field target_image_tracking_fields[] = {
    ANSWER_ROW(COUNT, "modes", "that it follows; 0: none was asked for"),
    ANSWER_ROW(NUMBER, "wander_s", "in which a frequency may wander by a tenth", .digits = 4),
    {0},
};

const struct answer_field target_image_use_fields[] = {
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(NUMBERS, "parameters", "in the order of the catalogue, 0 beyond", .digits = 6),
    ANSWER_SAY("effect     \t{effect}: {parameters}"),
    {0},
};

const struct answer_field target_image_pole_fields[] = {
    ANSWER_ROW(NUMBER, "frequency_Hz", "of the oscillation"),
    ANSWER_ROW(NUMBER, "damping_ratio", "share of critical damping", .flags = ANSWER_PERCENT, .digits = 3),
    ANSWER_SAY("           {frequency_Hz}, {damping_ratio}"),
    {0},
};

const struct answer_field target_image_effect_fields[] = {
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(TEXT, "fate", "where it is, or why it is not"),
    ANSWER_ROW(BOOL, "runs", "in the step"),
    ANSWER_SAY("effect     \t{effect}: {fate}"),
    {0},
};

const struct answer_field target_image_deployed_fields[] = {
    ANSWER_ROW(COUNT, "modes", "of the beam in the space"),
    ANSWER_ROW(COUNT, "static_responses", "beside them"),
    ANSWER_ROW(BOOL, "band_is_wider", "below half the sample rate the beam has more modes"),
    ANSWER_ROW(NUMBERS, "frequency_Hz", "of each mode in band", .digits = 6),
    ANSWER_ROW(NUMBERS, "relative_error", "of that frequency in the space", .digits = 2),
    ANSWER_ROW(COUNT, "blocks_beside", "for what is faster than the modes"),
    ANSWER_ROW(NUMBER, "held_error", "of the response to a held drive, relative", .digits = 2),
    ANSWER_ROW(NUMBER, "float_error", "of the 24-bit numbers, relative", .digits = 2),
    ANSWER_ROW(COUNT, "step_budget", "instructions between two samples"),
    ANSWER_ROW(NUMBER, "core_MHz", "clock of the processor", .digits = 4),
    ANSWER_ROW(NUMBER, "unsolved_share", "of steps whose law was not solved in time"),
    ANSWER_SAY("\nModes in the space: {modes}; static responses: {static_responses}; blocks beside it, for what is "
               "faster: {blocks_beside}."),
    ANSWER_SAY("Frequencies in band: {frequency_Hz}; off on the controller by {relative_error} of themselves."),
    ANSWER_SAY("[A held {drive} to {sensor}: off by {held_error} of its rms.]"),
    ANSWER_SAY("Float against double: {float_error}."),
    ANSWER_SAY("[{band_is_wider?}Below half the sample rate the beam has more modes than the space.]"),
    {0},
};

const struct answer_field target_image_fields[] = {
    TARGET_IMAGE_FIELDS,
    ANSWER_ROW(TEXT, "file", "the image"),
    ANSWER_ROW(TEXT, "a2l", "its description", .flags = ANSWER_MAYBE),
    ANSWER_ROW(TEXT, "sensor", "the model's output on the A/D"),
    ANSWER_ROW(TEXT, "drive", "the model's input on the D/A"),
    ANSWER_ROW(TEXT, "noise_from", "where the expected noise comes from"),
    ANSWER_SAY("{file}"),
    TARGET_IMAGE_LINES,
    ANSWER_ROW_OF(LIST, "effects", "of the model", target_image_effect_fields, .text = ""),
    ANSWER_ROW_OF(OBJECT, "deployed", "the space of the step", target_image_deployed_fields, .text = ""),
    ANSWER_ROW(TEXTS, "notes", "on the image", .text = "\nNotes"),
    {0},
};
