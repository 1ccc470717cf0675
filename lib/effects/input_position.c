/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int geometry(const beam_real p[], struct beam_geometry *out)
{
    out->input_shift_m = p[0];
    out->by_parameter[1][0] = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_input_position) = {
    .id = "input_position",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("the hammer struck beside its mark"),
    .form = BEAM_TEXT("the force at a + d, one d per record"),
    .source = BEAM_TEXT("Ewins, Modal Testing: Theory, Practice and Application (excitation point errors)"),
    .looks_like = BEAM_TEXT(
        "In one record all channels share a wrong balance of modes: each is scaled by φ_n(a + d)/φ_n(a). "
        "Frequencies and decay rates agree with the other records. Near the clamp, where φ_n grows as x², "
        "a millimetre matters."),
    .confused_with = BEAM_TEXT(
        "The hammer's gain: one factor for all modes; near the clamp all modes scale nearly alike, so "
        "the two are told apart only by high modes. tip_mass, low EI: change frequencies. "
        "patch_position: the same in every record. Strike again, farther from the clamp, with the mark "
        "under the tip."),
    .target_cost = BEAM_TEXT("none per step: another input vector"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("shift_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("shift of the strike away from the clamp"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -0.5,
                    .maximum = 0.5,
                    .start = 1e-3,
                    .flags = BEAM_PARAMETER_PER_RECORD}},
    .geometry = geometry,
};
