/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_AT_PATCH;
    return 0;
}

/* Jenkins element. The state is the slider's rotation, so nothing accumulates while it sticks. */
static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real k = p[0], limit = p[1];
    const beam_real stretch = in->w[0] - in->z[0];
    const beam_real moment = k * stretch; /* if it sticks */
    if (!beam_less(limit, beam_fabs(moment))) {
        out->f[0] = moment; /* k (s − z) */
        out->f_w[0][0] = k;
        out->f_z[0][0] = -k;
        out->f_p[0][0] = stretch;
        out->z[0] = in->z[0];
        out->z_z[0][0] = BEAM_K(1.0);
        return 0;
    }
    const beam_real side = beam_less(moment, BEAM_K(0.0)) ? -BEAM_K(1.0) : BEAM_K(1.0);
    out->f[0] = side * limit; /* ±M₀ */
    out->f_p[0][1] = side;
    out->z[0] = in->w[0] - side * limit / k;
    out->z_w[0][0] = BEAM_K(1.0);
    out->z_p[0][0] = side * limit / (k * k);
    out->z_p[0][1] = -side / k;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_microslip) = {
    .id = "microslip",
    .family = BEAM_FAMILY_NONLINEAR,
    .title = BEAM_TEXT("part of the bond line sticks and slips"),
    .form = BEAM_TEXT("Jenkins element on s = y'(x₂) − y'(x₁): spring k in series with a slider that yields at M₀"),
    .source = BEAM_TEXT(
        "Jenkins, Analysis of the stress-strain relationships in reactor grade graphite, British Journal of "
        "Applied Physics, 1962; Iwan, A distributed-element model for hysteresis and its steady-state dynamic "
        "response, Journal of Applied Mechanics, 1966"),
    .looks_like = BEAM_TEXT(
        "Below a threshold nothing but a little extra stiffness. Above it frequencies of modes that bend "
        "the patch fall and damping rises, is largest at about twice the threshold and fades again in "
        "very large motion. Odd harmonics; the patch may rest with an offset."),
    .confused_with = BEAM_TEXT(
        "coulomb_friction: slides at every level and adds no stiffness; record levels below the "
        "threshold. patch_softening: softens without damping. stop_contact: stiffens instead. Sweep "
        "the level over a factor of ten and plot frequency and damping of one mode against it."),
    .target_cost = BEAM_TEXT(
        "one law coordinate: about 60 multiply-adds a step and a Newton solve with one unknown, about 6 "
        "operations an evaluation; one internal state"),
    .step_instructions = 40,
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("stiffness_Nmprad"),
                    .unit = BEAM_TEXT("N·m/rad"),
                    .what = BEAM_TEXT("stiffness of the part that sticks"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 0.5,
                    .flags = 0},
                   {.name = BEAM_TEXT("slip_Nm"),
                    .unit = BEAM_TEXT("N·m"),
                    .what = BEAM_TEXT("moment at which it slips"),
                    .role = BEAM_ROLE_LEVEL,
                    .level_of = BEAM_LEVEL_ELASTIC,
                    .neutral = 1e-3,
                    .minimum = 1e-9,
                    .maximum = 1e3,
                    .start = 1e-3,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER}},
    .law_place = law_place,
    .law = law,
    .n_law_states = 1,
};
