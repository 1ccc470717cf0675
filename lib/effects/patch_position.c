/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int geometry(const beam_real p[], struct beam_geometry *out)
{
    out->patch_shift_m = p[0];
    out->by_parameter[0][0] = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_patch_position) = {
    .id = "patch_position",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("the patch sits a little nearer to or farther from the clamp"),
    .form = BEAM_TEXT("the patch on [x₁ + d, x₂ + d]"),
    .source = BEAM_TEXT(
        "Banks, Smith and Wang, Smart Material Structures: Modeling, Estimation and Control (the patch as a "
        "piecewise change of ρ, EI and cDI and as moments at its edges)"),
    .looks_like = BEAM_TEXT(
        "The modes' heights in the patch channel are wrong in a pattern that follows their slope "
        "difference over the patch, while other sensors are right; frequencies move by a little, since "
        "the patch carries its stiffness and mass along. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "Ks and KB: one factor for all modes, a shift acts on each differently; two modes suffice. "
        "input_position: changes all channels, and only of that record. Measure the patch edges with a "
        "ruler: the shift must be credible."),
    .target_cost = BEAM_TEXT("none per step: the tables of the patch are made for the shifted place"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("shift_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("shift of the patch away from the clamp"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -0.2,
                    .maximum = 0.2,
                    .start = 3e-4,
                    .flags = 0}},
    .geometry = geometry,
};
