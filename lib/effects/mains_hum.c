/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

#define TWO_PI BEAM_K(6.283185307179586476925)

static int signal(const beam_real p[], beam_real t_s, beam_real v, struct beam_sample_output *out)
{
    const beam_real turns = p[2] * t_s;
    const beam_real angle = TWO_PI * turns + p[1];
    const beam_real s = beam_sin(angle), c = beam_cos(angle);
    out->y = v + p[0] * s; /* v + A sin(2π f t + φ) */
    out->y_v = BEAM_K(1.0);
    out->y_p[0] = s;
    out->y_p[1] = p[0] * c;
    out->y_p[2] = p[0] * c * TWO_PI * t_s;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_mains_hum) = {
    .id = "mains_hum",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the mains in the sensor line"),
    .form = BEAM_TEXT("v = w + A sin(2π f t + φ)"),
    .source = BEAM_TEXT(
        "Ott, Noise Reduction Techniques in Electronic Systems: capacitive and magnetic coupling into a "
        "signal line"),
    .looks_like = BEAM_TEXT(
        "A needle at 50 or 60 Hz in the spectrum of one channel, present before the hit, of the same "
        "height at every level of excitation, and with another phase in each record. It does not decay. Often "
        "with harmonics (150, 250 Hz; 100 Hz from a rectifier): one such effect for each line."),
    .confused_with = BEAM_TEXT(
        "base_motion near 50 or 60 Hz (a machine's motor): that reaches every channel through the "
        "modes, hum only the electrical one. A mode close to 50 Hz: it decays. Record some seconds "
        "with the beam at rest, on batteries if possible."),
    .target_cost = BEAM_TEXT("one sine and one cosine per step and channel"),
    .step_instructions = 300,
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("amplitude"),
                    .unit = BEAM_TEXT("channel unit"),
                    .what = BEAM_TEXT("amplitude of the hum"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 0.01,
                    .flags = 0},
                   {.name = BEAM_TEXT("phase_rad"),
                    .unit = BEAM_TEXT("rad"),
                    .what = BEAM_TEXT("phase at the record's first sample"),
                    .role = BEAM_ROLE_PHASE,
                    .neutral = 0.0,
                    .minimum = -25.0,
                    .maximum = 25.0,
                    .start = 0.0,
                    .flags = BEAM_PARAMETER_INNER | BEAM_PARAMETER_PER_RECORD},
                   {.name = BEAM_TEXT("frequency_Hz"),
                    .unit = BEAM_TEXT("Hz"),
                    .what = BEAM_TEXT("frequency of the mains, or of one of its harmonics"),
                    .role = BEAM_ROLE_FREQUENCY,
                    .neutral = 50.0,
                    .minimum = 45.0,
                    .maximum = 1000.0,
                    .start = 50.0,
                    .flags = BEAM_PARAMETER_INNER}},
    .channels = BEAM_CHANNELS_PATCH_OUTPUT,
    .signal = signal,
};
