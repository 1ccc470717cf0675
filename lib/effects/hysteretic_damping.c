/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_MODES;
    out[0].value.damping = p[0]; /* C_jj += η ω_j */
    out[0].by_parameter[0].damping = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_hysteretic_damping) = {
    .id = "hysteretic_damping",
    .family = BEAM_FAMILY_DAMPING,
    .title = BEAM_TEXT("material loss that does not depend on frequency (loss factor)"),
    .form = BEAM_TEXT("C_jj += η ω_j in the modes of the beam"),
    .source = BEAM_TEXT(
        "Inman, Engineering Vibration, section on hysteretic damping; Crandall, The role of damping in "
        "vibration theory, Journal of Sound and Vibration, 1970 (why the causal form is stated mode by mode)"),
    .looks_like = BEAM_TEXT(
        "Every mode has the same damping ratio, η/2, where air damping falls and Kelvin–Voigt damping "
        "rises with frequency. Frequencies stay put, decays stay exponential at every level."),
    .confused_with = BEAM_TEXT(
        "square_root_damping: the same damping ratio in every mode (correlation 0.999); vibration "
        "tests of one beam do not separate them, a second beam of other thickness does. viscoelastic: "
        "its loss peaks in one decade of frequency; measure over a wider band. coulomb_friction: "
        "depends on level; repeat at a quarter of it."),
    .target_cost = BEAM_TEXT("none per step: a dense form added to C before factoring (needs the modes once)"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("loss_factor"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("share of the elastic energy lost per radian of vibration"),
                    .role = BEAM_ROLE_LOSS,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 5e-3,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
