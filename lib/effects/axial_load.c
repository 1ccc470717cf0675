/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_SLOPE;
    out[0].value.stiffness = p[0]; /* ⟨P y', φ'⟩ */
    out[0].by_parameter[0].stiffness = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_axial_load) = {
    .id = "axial_load",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("tension or compression along the beam (taut cable, gravity, supports)"),
    .form = BEAM_TEXT("⟨P y', φ'⟩, P > 0 in tension"),
    .source = BEAM_TEXT(
        "Bokaian, Natural frequencies of beams under tensile axial loads, Journal of Sound and Vibration, "
        "1990; Inman, Engineering Vibration, chapter on distributed-parameter systems"),
    .looks_like = BEAM_TEXT(
        "Tension raises mode 1 most; the share of the shift falls as 1/frequency over the modes. "
        "Compression lowers mode 1 and, near the buckling load, lets it go to zero. Decay rates stay, "
        "nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "point_spring at the free end: correlation 0.996 over five modes after a tap; its shift falls "
        "with frequency squared, so measure modes 2 and 3 precisely, or hang the beam the other way up "
        "(gravity changes sign), or detach the cable. Low EI: lowers all modes alike."),
    .target_cost = BEAM_TEXT("none per step: a 10 × 10 form added to K before factoring"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("force_N"),
                    .unit = BEAM_TEXT("N"),
                    .what = BEAM_TEXT("axial force, positive in tension"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e7,
                    .maximum = 1e7,
                    .start = 0.2,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
