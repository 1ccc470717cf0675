/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    if (beam_less(p[1], BEAM_K(0.0)) || beam_less(place->length_m, p[1]))
        return -1;
    out[0].place.kind = BEAM_AT_POINT;
    out[0].place.at_m = p[1];
    out[0].place.at_parameter = 2;
    out[0].value.mass = p[0]; /* m y_tt(a) φ(a) */
    out[0].by_parameter[0].mass = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_point_mass) = {
    .id = "point_mass",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("a point mass somewhere on the beam (sensor, cable clip, bolt)"),
    .form = BEAM_TEXT("m y_tt(a) φ(a)"),
    .source = BEAM_TEXT("Blevins, Formulas for Natural Frequency and Mode Shape: beams with concentrated masses; Rao, "
                        "Mechanical Vibrations, Rayleigh's quotient"),
    .looks_like = BEAM_TEXT(
        "Mode n falls by the share ½ m φ_n(a)² / (modal mass): modes with a node near x = a stay where "
        "they are, modes with an antinode there fall most. The pattern of shifts over the modes tells the "
        "place. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "tip_mass: the same effect at a = ℓ, and the simpler name when both fit. rotary_inertia: both "
        "lower high modes; it rises steadily with mode number, a point mass does not. root_compliance: "
        "measure three modes or more, or move the suspected mass by a few centimetres and tap again."),
    .target_cost = BEAM_TEXT("none per step: a rank-one addition to M before it is factored"),
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("mass_kg"),
                    .unit = BEAM_TEXT("kg"),
                    .what = BEAM_TEXT("mass attached to the beam"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e3,
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
