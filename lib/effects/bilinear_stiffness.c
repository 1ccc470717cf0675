/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    const beam_real at = p[1], half = BEAM_K(0.5) * p[2];
    if (beam_less(at, half) || beam_less(place->length_m, at + half)) /* the span must lie on the beam */
        return -1;
    out->points = BEAM_LAW_AT_SPAN;
    out->at_m = at;
    out->at_parameter = 2;
    out->width_m = p[2];
    out->width_parameter = 3;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real r = in->w[0];
    if (!beam_less(BEAM_K(0.0), r))
        return 0;          /* closed */
    out->f[0] = -p[0] * r; /* −Δk r */
    out->f_w[0][0] = -p[0];
    out->f_p[0][0] = -r;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_bilinear_stiffness) = {
    .id = "bilinear_stiffness",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("a crack that opens and closes (breathing crack)"),
    .form = BEAM_TEXT("−Δk r (φ'(a + h/2) − φ'(a − h/2)) for r > 0, r = y'(a + h/2) − y'(a − h/2)"),
    .source = BEAM_TEXT(
        "Shaw and Holmes, A periodically forced piecewise linear oscillator, Journal of Sound and Vibration, "
        "1983; Chondros, Dimarogonas and Yao, A continuous cracked beam vibration theory, Journal of Sound "
        "and Vibration, 1998"),
    .looks_like = BEAM_TEXT(
        "Modes that bend the beam at the crack fall in frequency, at every level by the same share: the "
        "response doubles when the drive doubles. Yet even harmonics (2f, 4f) stand beside each strong "
        "line, and the motion is one-sided. Modes that leave the beam straight there stay."),
    .confused_with = BEAM_TEXT(
        "stop_contact: harmonics only above a threshold, and stiffens. Low EI of one region: the same "
        "shifts but no even harmonics; drive one mode with a pure sine and look at 2f at two levels. "
        "feedthrough and sensor faults: harmonics in one channel only."),
    .target_cost = BEAM_TEXT("one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, 2 "
                             "operations an evaluation"),
    .step_instructions = 24,
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("change_Nmprad"),
                    .unit = BEAM_TEXT("N·m/rad"),
                    .what = BEAM_TEXT("stiffness of the short span lost while the crack is open (r > 0)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e7,
                    .start = 1.0,
                    .flags = 0},
                   {.name = BEAM_TEXT("at_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("the crack's distance from the clamp"),
                    .role = BEAM_ROLE_PLACE,
                    .neutral = 0.25,
                    .minimum = 0.02,
                    .maximum = 0.98,
                    .start = 0.25,
                    .flags = BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("width_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("length of the weakened span"),
                    .role = BEAM_ROLE_LEVEL,
                    .neutral = 5e-3,
                    .minimum = 1e-5,
                    .maximum = 0.5,
                    .start = 5e-3,
                    .flags = BEAM_PARAMETER_HELD | BEAM_PARAMETER_INNER}},
    .law_place = law_place,
    .law = law,
};
