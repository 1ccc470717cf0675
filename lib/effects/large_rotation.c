/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_OVER_SLOPE_AND_CURVATURE;
    out->weight = BEAM_WEIGHT_EI;
    return 0;
}

/* The gradient of ½ κ EI y'² y″², the curvature energy's next order. */
static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real a = in->w[0], b = in->w[1]; /* y', y″ */
    out->f[0] = p[0] * a * b * b;
    out->f[1] = p[0] * a * a * b;
    out->f_w[0][0] = p[0] * b * b;
    out->f_w[0][1] = BEAM_K(2.0) * p[0] * a * b;
    out->f_w[1][0] = BEAM_K(2.0) * p[0] * a * b;
    out->f_w[1][1] = p[0] * a * a;
    out->f_p[0][0] = a * b * b;
    out->f_p[1][0] = a * a * b;
    return 0;
}

static int axial_inertia(const beam_real p[], struct beam_sample_output *out)
{
    out->y = p[0];
    out->y_p[0] = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_large_rotation) = {
    .id = "large_rotation",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("the beam turns so far that its length matters (inextensible beam)"),
    .form = BEAM_TEXT("⟨κ EI y' y″², φ'⟩ + ⟨κ EI y'² y″, φ″⟩ + κ ⟨ρ u_tt, −∫₀ˣ y' φ' ds⟩, u = −½ ∫₀ˣ y'² ds"),
    .source = BEAM_TEXT(
        "Crespo da Silva and Glynn, Nonlinear flexural-flexural-torsional dynamics of inextensional beams, "
        "Journal of Structural Mechanics, 1978; Nayfeh and Mook, Nonlinear Oscillations"),
    .looks_like = BEAM_TEXT(
        "In mode 1 the frequency rises slightly, in mode 2 and above it falls, with amplitude squared and "
        "only when the tip moves by more than about ℓ/10. Third harmonics. κ = 1 is the theory without a "
        "free number: another value says it is something else."),
    .confused_with = BEAM_TEXT(
        "cubic_stiffness: hardens or softens all modes in the same sense; drive mode 1 and mode 2 "
        "separately, at three levels. patch_softening: shift proportional to amplitude. Keep the swing "
        "of the tip under ℓ/20: large rotation is gone, everything else remains."),
    .target_cost = BEAM_TEXT(
        "law coordinates over the span (at most 8): about 60 multiply-adds each and a Newton solve with "
        "as many unknowns; the dearest of the laws"),
    .step_instructions = 52,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("scale"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("κ: 1 for an inextensible beam"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 100.0,
                    .start = 1.0,
                    .flags = 0}},
    .law_place = law_place,
    .law = law,
    .axial_inertia = axial_inertia,
};
