/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_AT_PATCH;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real ratio = in->v[0] / p[1];
    const beam_real t = beam_tanh(ratio);
    const beam_real slope = BEAM_K(1.0) - t * t;
    out->f[0] = p[0] * t; /* M₀ tanh(s_t/v₀) */
    out->f_v[0][0] = p[0] * slope / p[1];
    out->f_p[0][0] = t;
    out->f_p[0][1] = -p[0] * slope * ratio / p[1];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_coulomb_friction) = {
    .id = "coulomb_friction",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("dry friction in the bond line of the patch"),
    .form = BEAM_TEXT("M₀ tanh(s_t/v₀) · (φ'(x₂) − φ'(x₁)), s = y'(x₂) − y'(x₁)"),
    .source = BEAM_TEXT(
        "Inman, Engineering Vibration, section on Coulomb friction; Andersson, Söderberg and Björklund, "
        "Friction models for sliding dry, boundary and mixed lubricated contacts, Tribology International, "
        "2007 (the smooth tanh form)"),
    .looks_like = BEAM_TEXT(
        "Small motion decays faster than large motion: the envelope falls in a straight line rather than "
        "an exponential, and ends abruptly. Damping ratio goes as 1/amplitude, frequency hardly changes. "
        "Odd harmonics under a steady drive."),
    .confused_with = BEAM_TEXT(
        "quadratic_drag: the opposite trend, large motion decays faster. microslip: also softens, and "
        "at small motion sticks without loss. hysteretic_damping: the same at one level only. Record a "
        "quarter and four times the level, and watch the last tenth of the decay."),
    .target_cost = BEAM_TEXT(
        "one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, one tanh "
        "an evaluation"),
    .step_instructions = 140,
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("moment_Nm"),
                    .unit = BEAM_TEXT("N·m"),
                    .what = BEAM_TEXT("friction moment while the bond line slides"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e3,
                    .start = 1e-3,
                    .flags = 0},
                   {.name = BEAM_TEXT("velocity_radps"),
                    .unit = BEAM_TEXT("rad/s"),
                    .what = BEAM_TEXT("rate at which friction reaches three quarters of it"),
                    .role = BEAM_ROLE_LEVEL,
                    .level_of = BEAM_LEVEL_RATE,
                    .neutral = 2e-3,
                    .minimum = 1e-7,
                    .maximum = 1e3,
                    .start = 2e-3,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER}},
    .law_place = law_place,
    .law = law,
};
