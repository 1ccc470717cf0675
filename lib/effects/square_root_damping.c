/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_SLOPE;
    out[0].value.damping = p[0]; /* ⟨c y'_t, φ'⟩ */
    out[0].by_parameter[0].damping = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_square_root_damping) = {
    .id = "square_root_damping",
    .family = BEAM_FAMILY_DAMPING,
    .title = BEAM_TEXT("damping that goes with the rate of slope (square-root damping)"),
    .form = BEAM_TEXT("⟨c y'_t, φ'⟩"),
    .source = BEAM_TEXT(
        "Chen and Russell, A mathematical model for linear elastic systems with structural damping, Quarterly "
        "of Applied Mathematics, 1982; the weaker damping form of Banks, Wang, Inman and Slater"),
    .looks_like = BEAM_TEXT(
        "The damping ratio is nearly the same in all modes, about c/(2 √(EI ρ)), where air damping falls "
        "and Kelvin–Voigt damping rises with frequency. Frequencies stay put, decays stay exponential at "
        "every level."),
    .confused_with = BEAM_TEXT(
        "hysteretic_damping: the same damping ratio in every mode (correlation 0.999); no vibration "
        "test of one beam separates them well, a second beam of other thickness does. γ with cDI "
        "together imitate it over two modes: measure four or more."),
    .target_cost = BEAM_TEXT("none per step: a 10 × 10 form added to C before factoring"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("coefficient_Ns"),
                    .unit = BEAM_TEXT("N·s"),
                    .what = BEAM_TEXT("damping moment per rate of slope and length"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 1e-3,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
