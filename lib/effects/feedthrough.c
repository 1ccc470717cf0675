/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int map(const beam_real p[], beam_real v, beam_real u, struct beam_sample_output *out)
{
    out->y = v + p[0] * u; /* w + g u */
    out->y_v = BEAM_K(1.0);
    out->y_u = p[0];
    out->y_p[0] = u;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_feedthrough) = {
    .id = "feedthrough",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the drive voltage leaks into the sensor line"),
    .form = BEAM_TEXT("v = w + g u"),
    .source = BEAM_TEXT(
        "Ott, Noise Reduction Techniques in Electronic Systems (capacitive coupling); Moheimani and Fleming, "
        "Piezoelectric Transducers for Vibration Control and Damping (feedthrough of collocated patches)"),
    .looks_like = BEAM_TEXT(
        "A copy of the drive stands in the channel at once, flat over frequency: between the modes the "
        "response does not fall off, and the antiresonances move. It vanishes with the drive, and in "
        "hammer records."),
    .confused_with = BEAM_TEXT(
        "Too few modes in the computation: their static part looks like a leak; raise the number of "
        "modes first. patch_position: also moves antiresonances, but leaves nothing above the last "
        "mode. Hold the beam still (a block under the tip) and drive: what remains leaks."),
    .target_cost = BEAM_TEXT("one multiply-add per step and channel"),
    .step_instructions = 26,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("gain"),
                    .unit = BEAM_TEXT("channel unit/V"),
                    .what = BEAM_TEXT("channel value per volt of drive"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e6,
                    .maximum = 1e6,
                    .start = 1e-3,
                    .flags = 0}},
    .channels = BEAM_CHANNELS_EVERY_OUTPUT,
    .map = map,
};
