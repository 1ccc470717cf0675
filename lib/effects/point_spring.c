/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    if (beam_less(p[2], BEAM_K(0.0)) || beam_less(place->length_m, p[2]))
        return -1;
    out[0].place.kind = BEAM_AT_POINT;
    out[0].place.at_m = p[2];
    out[0].place.at_parameter = 3;
    out[0].value.stiffness = p[0]; /* (k y(a) + d y_t(a)) φ(a) */
    out[0].value.damping = p[1];
    out[0].by_parameter[0].stiffness = BEAM_K(1.0);
    out[0].by_parameter[1].damping = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_point_spring) = {
    .id = "point_spring",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("a linear spring with damping to ground (cable, contactless probe, magnet)"),
    .form = BEAM_TEXT("(k y(a) + d y_t(a)) φ(a)"),
    .source = BEAM_TEXT("Blevins, Formulas for Natural Frequency and Mode Shape: cantilever with an end spring; Rao, "
                        "Mechanical Vibrations, chapter on continuous systems"),
    .looks_like = BEAM_TEXT(
        "Mode 1 rises (falls for an attracting magnet, k < 0), higher modes hardly move: the share of the "
        "shift falls with the square of the frequency. Its damper broadens the peaks of the modes that "
        "move at x = a. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "axial_load: both move mode 1 most; tension falls off only with the frequency itself, so fit "
        "modes 1 to 3 together, or move or detach the cable. cubic_stiffness: repeat at a quarter of "
        "the level; a linear spring gives the same frequency. point_damper: the same with k = 0."),
    .target_cost = BEAM_TEXT("none per step: rank-one additions to K and C before factoring"),
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("stiffness_Npm"),
                    .unit = BEAM_TEXT("N/m"),
                    .what = BEAM_TEXT("stiffness to ground (negative: it attracts)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e4,
                    .maximum = 1e9,
                    .start = 1.0,
                    .flags = 0},
                   {.name = BEAM_TEXT("damping_Nspm"),
                    .unit = BEAM_TEXT("N·s/m"),
                    .what = BEAM_TEXT("damping to ground"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 1e-3,
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
    .terms = terms,
    .n_terms = 1,
};
