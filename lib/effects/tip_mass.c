/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    out[0].place.kind = BEAM_AT_POINT;
    out[0].place.at_m = place->length_m;
    out[0].value.mass = p[0]; /* m y_tt(ℓ) φ(ℓ) */
    out[0].by_parameter[0].mass = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_tip_mass) = {
    .id = "tip_mass",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("a point mass at the free end"),
    .form = BEAM_TEXT("m y_tt(ℓ) φ(ℓ)"),
    .source = BEAM_TEXT(
        "Blevins, Formulas for Natural Frequency and Mode Shape: cantilever with an end mass; Rao, Mechanical "
        "Vibrations, chapter on continuous systems"),
    .looks_like = BEAM_TEXT(
        "Every frequency falls by nearly the same share, 2 m / (mass of the beam) while m is small, so "
        "the data look like a beam of lower EI or higher ρ. A heavy mass lowers mode 1 most and turns the "
        "higher modes into those of a beam propped at its end. Damping ratios fall slightly; nothing "
        "depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "root_compliance: also lowers all modes by one share; weigh the beam and hold ρ, or add a "
        "second sensor far from the clamp. point_mass: the same effect elsewhere; modes 2 to 4 with "
        "their nodes find the place. Repeat the tap with a known 1 g mass at the tip: the further drop "
        "calibrates this one."),
    .target_cost = BEAM_TEXT("none per step: a number in M before it is factored"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("mass_kg"),
                    .unit = BEAM_TEXT("kg"),
                    .what = BEAM_TEXT("mass at the free end beyond the beam's own"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e3,
                    .start = 1e-3,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
