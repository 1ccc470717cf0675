/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    if (beam_less(p[1], BEAM_K(0.0)) || beam_less(place->length_m, p[1]))
        return -1;
    out->points = BEAM_LAW_AT_POINT;
    out->at_m = p[1];
    out->at_parameter = 2;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real w = in->w[0];
    out->f[0] = p[0] * w * w * w; /* k₃ y(a)³ */
    out->f_w[0][0] = BEAM_K(3.0) * p[0] * w * w;
    out->f_p[0][0] = w * w * w;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_cubic_stiffness) = {
    .id = "cubic_stiffness",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("a restoring force that grows with the cube of the deflection at one point"),
    .form = BEAM_TEXT("k₃ y(a)³ φ(a)"),
    .source = BEAM_TEXT("Nayfeh and Mook, Nonlinear Oscillations: the Duffing spring"),
    .looks_like = BEAM_TEXT(
        "Frequency depends on level: for k₃ > 0 mode 1 is higher in large motion and sinks to its linear "
        "value as the decay goes on, the shift going with amplitude squared. Third harmonics appear and "
        "fall by the cube when the level is halved. Damping does not change."),
    .confused_with = BEAM_TEXT(
        "point_spring and axial_load at one single level: repeat at a quarter of the level, where a "
        "cubic spring has lost 15/16 of its shift. patch_softening: frequency follows amplitude "
        "itself, not its square. stop_contact: abrupt above a threshold, with even harmonics. "
        "large_rotation: acts in all modes and needs tip motion beyond ℓ/10."),
    .target_cost = BEAM_TEXT("one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, 5 "
                             "multiply-adds an evaluation"),
    .step_instructions = 28,
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("coefficient_Npm3"),
                    .unit = BEAM_TEXT("N/m³"),
                    .what = BEAM_TEXT("force per cube of deflection (negative softens)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e18,
                    .maximum = 1e18,
                    .start = 500.0,
                    .flags = 0},
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
