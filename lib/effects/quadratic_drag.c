/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_OVER_DEFLECTION;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const beam_real speed = beam_fabs(in->v[0]);
    out->f[0] = p[0] * speed * in->v[0]; /* c |y_t| y_t */
    out->f_v[0][0] = BEAM_K(2.0) * p[0] * speed;
    out->f_p[0][0] = speed * in->v[0];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_quadratic_drag) = {
    .id = "quadratic_drag",
    .family = BEAM_FAMILY_DAMPING,
    .title = BEAM_TEXT("air drag that grows with the square of the speed"),
    .form = BEAM_TEXT("⟨c |y_t| y_t, φ⟩"),
    .source = BEAM_TEXT(
        "Baker, Woolam and Young, Air and internal damping of thin cantilever beams, International Journal of "
        "Mechanical Sciences, 1967; Inman, Engineering Vibration, section on velocity-squared damping"),
    .looks_like = BEAM_TEXT(
        "Large motion decays faster than small motion: the logarithm of the envelope is steep after the "
        "hit and straightens later. The peak of mode 1, which moves farthest, broadens with level; high "
        "modes and frequencies hardly change. Weak third harmonics of a steady drive."),
    .confused_with = BEAM_TEXT(
        "γ: repeat at a quarter of the level; γ keeps its decay rate, drag loses three quarters of it. "
        "coulomb_friction: the opposite trend, relative damping grows as motion dies. "
        "sensor_saturation: clips the output but leaves the decay rate of the structure; look with a "
        "second sensor."),
    .target_cost = BEAM_TEXT(
        "law coordinates over the span (at most 8): about 60 multiply-adds each and a Newton solve with "
        "as many unknowns; the dearest of the laws"),
    .step_instructions = 24,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("coefficient_Ns2pm3"),
                    .unit = BEAM_TEXT("N·s²/m³"),
                    .what = BEAM_TEXT(
                        "drag force per length over speed squared (½ air density × drag coefficient × width)"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e9,
                    .start = 0.05,
                    .flags = 0}},
    .law_place = law_place,
    .law = law,
};
