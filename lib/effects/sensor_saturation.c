/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int map(const beam_real p[], beam_real v, beam_real u, struct beam_sample_output *out)
{
    (void)u;
    if (!beam_finite(p[0])) {
        out->y = v;
        out->y_v = BEAM_K(1.0);
        return 0;
    }
    const beam_real ratio = v / p[0];
    const beam_real t = beam_tanh(ratio);
    const beam_real slope = BEAM_K(1.0) - t * t;
    out->y = p[0] * t; /* L tanh(v/L) */
    out->y_v = slope;
    out->y_p[0] = t - ratio * slope;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_sensor_saturation) = {
    .id = "sensor_saturation",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the sensor or its amplifier runs out of range"),
    .form = BEAM_TEXT("v = L tanh(w/L)"),
    .source = BEAM_TEXT(
        "Doebelin, Measurement Systems: linearity and range; the smooth clip as in Bendat, Nonlinear System "
        "Techniques and Applications (memoryless nonlinear systems)"),
    .looks_like = BEAM_TEXT(
        "Peaks of one channel are flattened on both sides as they approach a level; small motion is "
        "exact. Odd harmonics that no other channel shows. Frequencies, and decay rates late in the "
        "record, are those of the beam."),
    .confused_with = BEAM_TEXT(
        "drive_saturation: every channel sees it. quadratic_drag: large motion also looks too small, "
        "but its later motion is then smaller too; a saturated sensor recovers. stop_contact: "
        "one-sided and rings. Halve the gain or the level, or look at a second sensor."),
    .target_cost = BEAM_TEXT("one tanh per step and channel"),
    .step_instructions = 140,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("level"),
                    .unit = BEAM_TEXT("channel unit"),
                    .what = BEAM_TEXT("value that the channel cannot pass"),
                    .role = BEAM_ROLE_LEVEL,
                    .level_of = BEAM_LEVEL_CHANNEL,
                    .neutral = INFINITY,
                    .minimum = 1e-9,
                    .maximum = INFINITY,
                    .start = 1.0,
                    .flags = BEAM_PARAMETER_LOG}},
    .channels = BEAM_CHANNELS_PATCH_OUTPUT,
    .map = map,
};
