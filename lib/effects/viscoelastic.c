/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_CURVATURE;
    out[0].value.memory = p[0]; /* ⟨E₁ ξ, φ″⟩, ξ_t = y″_t − ξ/τ: ξ = τs/(1 + τs) y″ */
    out[0].value.relaxation_s = p[1];
    out[0].by_parameter[0].memory = BEAM_K(1.0);
    out[0].by_parameter[1].relaxation_s = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_viscoelastic) = {
    .id = "viscoelastic",
    .family = BEAM_FAMILY_DAMPING,
    .title = BEAM_TEXT("bending stiffness with a memory (one Maxwell branch)"),
    .form = BEAM_TEXT("⟨E₁ ξ, φ″⟩ with ξ_t = y″_t − ξ/τ"),
    .source = BEAM_TEXT(
        "Christensen, Theory of Viscoelasticity; Banks and Inman, On damping mechanisms in beams, Journal of "
        "Applied Mechanics, 1991 (time hysteresis)"),
    .looks_like = BEAM_TEXT(
        "Damping peaks for modes near 1/(2πτ), with a loss factor up to E₁/(2 EI), and falls off on both "
        "sides. Modes above it are stiffer than modes below by the share E₁/EI, so no single EI fits all "
        "frequencies. After a step the beam creeps with the time τ. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "cDI: the same when τ is far shorter than the period of the highest mode. hysteretic_damping "
        "and square_root_damping: flat over frequency; measure modes a decade apart on either side of "
        "1/(2πτ). A relative frequency error of 3e-5 in the computation looks like it: refine the "
        "model first."),
    .target_cost = BEAM_TEXT(
        "up to 10 more states: 20 multiply-adds, and 10 for each input, output and law coordinate; no "
        "Newton"),
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("strength_Nm2"),
                    .unit = BEAM_TEXT("N·m²"),
                    .what = BEAM_TEXT("bending stiffness of the branch, seen only above 1/(2πτ)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 0.02,
                    .flags = 0},
                   {.name = BEAM_TEXT("relaxation_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("relaxation time of the branch"),
                    .role = BEAM_ROLE_TIME,
                    .neutral = 5e-3,
                    .minimum = 1e-6,
                    .maximum = 1e3,
                    .start = 5e-3,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER}},
    .terms = terms,
    .n_terms = 1,
};
