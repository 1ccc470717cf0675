/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    if (beam_less(p[1], BEAM_K(0.0)) || beam_less(place->length_m, p[1]))
        return -1;
    out[0].place.kind = BEAM_AT_POINT;
    out[0].place.at_m = p[1];
    out[0].place.at_parameter = 2;
    out[0].value.damping = p[0]; /* d y_t(a) φ(a) */
    out[0].by_parameter[0].damping = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_point_damper) = {
    .id = "point_damper",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("a viscous damper to ground at one point (eddy current, sensor cable)"),
    .form = BEAM_TEXT("d y_t(a) φ(a)"),
    .source = BEAM_TEXT(
        "Inman, Engineering Vibration, chapter on distributed-parameter systems: lumped elements in the modal "
        "equations"),
    .looks_like = BEAM_TEXT(
        "Peaks broaden and decays shorten for the modes that move at x = a; modes with a node there keep "
        "their damping. The damping ratio falls as 1/frequency. Frequencies stay put while d is small, "
        "and decays stay exponential at every level."),
    .confused_with = BEAM_TEXT(
        "γ of the baseline: a damper at the free end of a uniform beam damps all modes alike, as γ "
        "does; only its place separates them, so use three modes or more, or repeat in still air "
        "without the cable. quadratic_drag: repeat at a quarter of the level; a linear damper keeps "
        "its decay rate."),
    .target_cost = BEAM_TEXT("none per step: a rank-one addition to C before factoring"),
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("damping_Nspm"),
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
