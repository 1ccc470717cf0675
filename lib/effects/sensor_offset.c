/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int signal(const beam_real p[], beam_real t_s, beam_real v, struct beam_sample_output *out)
{
    out->y = v + p[0] + p[1] * t_s; /* v + a + b t */
    out->y_v = BEAM_K(1.0);
    out->y_p[0] = BEAM_K(1.0);
    out->y_p[1] = t_s;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_sensor_offset) = {
    .id = "sensor_offset",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("a constant and a slow drift added to a channel"),
    .form = BEAM_TEXT("v = w + a + b t"),
    .source = BEAM_TEXT("Doebelin, Measurement Systems: zero drift"),
    .looks_like = BEAM_TEXT(
        "The channel does not return to zero after the motion has died, or wanders in a straight line; it "
        "is there before the hit. In the spectrum only the lowest lines rise."),
    .confused_with = BEAM_TEXT(
        "sensor_highpass: creeps back to zero after a pulse, an offset stays. thermal_drift: moves "
        "frequencies, not the zero. Record some seconds at rest before the hit."),
    .target_cost = BEAM_TEXT("2 additions per step and channel"),
    .step_instructions = 28,
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("offset"),
                    .unit = BEAM_TEXT("channel unit"),
                    .what = BEAM_TEXT("value added at the record's first sample"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e6,
                    .maximum = 1e6,
                    .start = 0.01,
                    .flags = 0},
                   {.name = BEAM_TEXT("drift_per_s"),
                    .unit = BEAM_TEXT("channel unit/s"),
                    .what = BEAM_TEXT("its change per second"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e6,
                    .maximum = 1e6,
                    .start = 1e-3,
                    .flags = 0}},
    .channels = BEAM_CHANNELS_PATCH_OUTPUT,
    .signal = signal,
};
