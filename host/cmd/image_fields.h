/* SPDX-License-Identifier: GPL-3.0-or-later */
/* image_fields.h — what the names in the answers of export, sign and verify are. */
#ifndef BEAMFIT_IMAGE_FIELDS_H
#define BEAMFIT_IMAGE_FIELDS_H

#include "show/show.h"

extern const struct answer_field target_image_board_fields[], target_image_observer_fields[],
    target_image_tracking_fields[], target_image_use_fields[], target_image_pole_fields[], target_image_effect_fields[],
    target_image_deployed_fields[];
extern const struct answer_field target_image_fields[]; /* of target_image_json(), file and a2l */

/* Rows of target_image_file_json(); at the end, behind rows of a command's own, its text. */
#define TARGET_IMAGE_FIELDS                                                                                            \
    ANSWER_ROW(COUNT, "bytes", "of the image"), ANSWER_ROW(COUNT, "layout", "version of the layout"),                  \
        ANSWER_ROW(BOOL, "signed", "it carries a signature"),                                                          \
        ANSWER_ROW(TEXT, "device", "it is for, 24 hexadecimal digits"), ANSWER_ROW(COUNT, "counter", "of the image"),  \
        ANSWER_ROW(TEXT, "model_sha256", "of the model file"), ANSWER_ROW(COUNT, "crc32", "of the image"),             \
        ANSWER_ROW_OF(OBJECT, "board", "what the controller is wired to", target_image_board_fields),                  \
        ANSWER_ROW_OF(OBJECT, "observer", "what a push is told from a wrong model by", target_image_observer_fields),  \
        ANSWER_ROW_OF(OBJECT, "tracking", "what the board follows beside the model", target_image_tracking_fields),    \
        ANSWER_ROW(TEXT, "step", "what a step costs, in words"),                                                       \
        ANSWER_ROW(COUNT, "step_bound", "instructions of a step, at most"),                                            \
        ANSWER_ROW(NUMBER, "least_core_MHz", "clock that the step needs"),                                             \
        ANSWER_ROW(COUNT, "law_evaluations", "of each law in a step")

#define TARGET_IMAGE_LINES                                                                                             \
    ANSWER_SAY("[{signed?}signed     \tfor device {device}, counter {counter}]"),                                      \
        ANSWER_SAY("[{signed!}unsigned   \tno controller takes it: beamfit sign]"),                                    \
        ANSWER_SAY("sha256     \t{model_sha256} of the model"),                                                        \
        ANSWER_SAY("image      \t{bytes} bytes, layout {layout}, crc32 {crc32}"),                                      \
        ANSWER_SAY("[channels   \t{sensor} at the A/D, {drive} at the D/A; noise from {noise_from}]"),                 \
        ANSWER_SAY("interval   \t{board.dt_s} ({board.sample_Hz}{board.clock_relative? by the controller's clock|})"), \
        ANSWER_SAY("sensor     \t{board.sensor_per_code} a code, zero at {board.sensor_zero_code}"),                   \
        ANSWER_SAY("drive      \t{board.drive_per_code} a code, zero at {board.drive_zero_code}"),                     \
        ANSWER_SAY("residual   \tnoise {board.noise_rms} rms, alarm above {board.alarm_ratio} times, off below "       \
                   "{board.clear_ratio} times, over {board.averaging_s}"),                                             \
        ANSWER_SAY("sensor's   \tquiet below {board.quiet_ratio} of the noise; offset above {board.offset_ratio} of "  \
                   "it; {board.stuck_samples?|a stuck one is not told from one code of noise}[{board.stuck_samples?}"  \
                   "stuck after {board.stuck_samples} equal codes]"),                                                  \
        ANSWER_SAY("observer   \t{observer.innovation_rms?|none: any motion that is not driven is taken for a wrong "  \
                   "model}[{observer.innovation_rms?}follows {observer.modes} modes and an offset; innovation "        \
                   "{observer.innovation_rms} rms; a push is over after {observer.disturbance_s}]"),                   \
        ANSWER_SAY(                                                                                                    \
            "[{tracking.modes?}tracking   \t{tracking.modes} modes beside the model; within "                          \
            "{tracking.wander_s} a frequency may wander by a tenth, a damping by its own size, a gain by 0.3]"),       \
        ANSWER_SAY("step       \t{step}[; a controller of {deployed.core_MHz} leaves {deployed.step_budget} at this "  \
                   "rate]"),                                                                                           \
        ANSWER_ROW_OF(LIST, "uses", "effects that run in the step", target_image_use_fields, .text = ""),              \
        ANSWER_ROW_OF(LIST, "poles", "of the step", target_image_pole_fields,                                          \
                      .text = "poles      \tfrequency and damping ratio:")

#endif
