/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

#define TWO_PI BEAM_K(6.283185307179586476925)

static int base(const beam_real p[], beam_real t_s, struct beam_sample_output *out)
{
    const beam_real angle = TWO_PI * (p[2] * t_s) + p[1];
    const beam_real s = beam_sin(angle), c = beam_cos(angle);
    out->y = p[0] * s; /* a_b(t) = A sin(2π f t + φ) */
    out->y_p[0] = s;
    out->y_p[1] = p[0] * c;
    out->y_p[2] = p[0] * c * TWO_PI * t_s;
    return 0;
}

static int tone(const beam_real p[], struct beam_tone *out)
{
    out->amplitude = p[0];
    out->phase_rad = p[1];
    out->frequency_Hz = p[2];
    out->by_parameter[0][0] = out->by_parameter[1][1] = out->by_parameter[2][2] = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_base_motion) = {
    .id = "base_motion",
    .family = BEAM_FAMILY_ENVIRONMENT,
    .title = BEAM_TEXT("the bench shakes the clamp at one frequency"),
    .form = BEAM_TEXT("load −⟨ρ a_b, φ⟩, a_b = A sin(2π f t + φ₀); absolute sensors read relative + base motion"),
    .source = BEAM_TEXT(
        "Erturk and Inman, On mechanical modeling of cantilevered piezoelectric vibration energy harvesters, "
        "Journal of Intelligent Material Systems and Structures, 2008 (base excitation of a cantilever)"),
    .looks_like = BEAM_TEXT(
        "A line at the frequency of a machine nearby stands in every channel, before the hit and after "
        "the decay, of the same height at every level of excitation. Its heights in the channels follow "
        "the beam's response to a shaken clamp: large if a mode is near."),
    .confused_with = BEAM_TEXT(
        "mains_hum: in the electrical channel only and not enlarged near a mode. A lightly damped "
        "mode: it decays. Record some seconds at rest; switch machines off; put a sensor on the clamp."),
    .target_cost = BEAM_TEXT("one sine and one cosine per step, and one more input: 20 multiply-adds"),
    .step_instructions = 300,
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("amplitude_mps2"),
                    .unit = BEAM_TEXT("m/s²"),
                    .what = BEAM_TEXT("amplitude of the clamp's acceleration"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e3,
                    .start = 0.05,
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
                    .what = BEAM_TEXT("frequency of the shaking"),
                    .role = BEAM_ROLE_FREQUENCY,
                    .neutral = 25.0,
                    .minimum = 0.01,
                    .maximum = 1e5,
                    .start = 25.0,
                    .flags = BEAM_PARAMETER_INNER | BEAM_PARAMETER_LOG}},
    .base = base,
    .tone = tone,
};
