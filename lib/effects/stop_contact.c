/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    if (beam_less(p[2], BEAM_K(0.0)) || beam_less(place->length_m, p[2]))
        return -1;
    out->points = BEAM_LAW_AT_POINT;
    out->at_m = p[2];
    out->at_parameter = 3;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real depth = in->w[0] - p[1];
    if (!beam_less(BEAM_K(0.0), depth))
        return 0;             /* apart */
    out->f[0] = p[0] * depth; /* k (y(a) − g) */
    out->f_w[0][0] = p[0];
    out->f_p[0][0] = depth;
    out->f_p[0][1] = -p[0];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_stop_contact) = {
    .id = "stop_contact",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("the beam touches a stop on one side"),
    .form = BEAM_TEXT("k (y(a) − g) φ(a) for y(a) > g, else 0"),
    .source = BEAM_TEXT(
        "Moon and Shaw, Chaotic vibrations of a beam with non-linear boundary conditions, International "
        "Journal of Non-Linear Mechanics, 1983; Shaw and Holmes, A periodically forced piecewise linear "
        "oscillator, Journal of Sound and Vibration, 1983"),
    .looks_like = BEAM_TEXT(
        "Small motion is perfectly linear. Above a sharp threshold one side of the motion is cut, each "
        "touch rings the high modes (bursts at the peaks of mode 1), even harmonics and a mean offset "
        "appear and the apparent frequency of mode 1 rises."),
    .confused_with = BEAM_TEXT(
        "bilinear_stiffness: no threshold and softens. sensor_saturation: clips both sides of one "
        "channel without ringing the high modes; look at a second sensor. cubic_stiffness: symmetric, "
        "no even harmonics. Record below the threshold: the baseline must fit."),
    .target_cost = BEAM_TEXT("one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, 2 "
                             "operations an evaluation"),
    .step_instructions = 28,
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("stiffness_Npm"),
                    .unit = BEAM_TEXT("N/m"),
                    .what = BEAM_TEXT("contact stiffness of the stop"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e8,
                    .start = 500.0,
                    .flags = 0},
                   {.name = BEAM_TEXT("gap_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("distance of the stop from the beam at rest, on the side of positive y"),
                    .role = BEAM_ROLE_LEVEL,
                    .level_of = BEAM_LEVEL_COORDINATE,
                    .neutral = 1e-3,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 1e-3,
                    .flags = BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("at_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("its distance from the clamp"),
                    .role = BEAM_ROLE_PLACE,
                    .neutral = 1.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 1.0,
                    .flags = BEAM_PARAMETER_INNER}},
    .law_place = law_place,
    .law = law,
};
