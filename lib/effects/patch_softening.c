/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_AT_PATCH;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real size = beam_fabs(in->w[0]);
    out->f[0] = p[0] * size * in->w[0]; /* k₂ |s| s */
    out->f_w[0][0] = BEAM_K(2.0) * p[0] * size;
    out->f_p[0][0] = size * in->w[0];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_patch_softening) = {
    .id = "patch_softening",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("the patch and its glue soften in large strain"),
    .form = BEAM_TEXT("k₂ |s| s · (φ'(x₂) − φ'(x₁)), s = y'(x₂) − y'(x₁)"),
    .source = BEAM_TEXT("Leadenham and Erturk, Unified nonlinear electroelastic dynamics of a bimorph piezoelectric "
                        "cantilever, Nonlinear Dynamics, 2015 (quadratic softening of piezoelectric ceramics)"),
    .looks_like = BEAM_TEXT(
        "Frequencies of the modes that bend the patch fall in proportion to amplitude (k₂ < 0), half the "
        "level gives half the shift, with weak third harmonics. During a decay the period shortens "
        "steadily."),
    .confused_with = BEAM_TEXT(
        "cubic_stiffness: shifts with amplitude squared, and mostly mode 1; record three levels, 1 : 2 "
        ": 4. microslip: softens too but also damps, most at a middle level. drive_hysteresis: shows "
        "only when the patch drives; hit with a hammer instead."),
    .target_cost = BEAM_TEXT("one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, 4 "
                             "multiply-adds an evaluation"),
    .step_instructions = 24,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("coefficient_Nmprad2"),
                    .unit = BEAM_TEXT("N·m/rad²"),
                    .what = BEAM_TEXT("moment per square of the patch's slope difference (negative softens)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -1e9,
                    .maximum = 1e9,
                    .start = -5.0,
                    .flags = 0}},
    .law_place = law_place,
    .law = law,
};
