/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int drive(const beam_real p[], beam_real u, beam_real u_old, const beam_real z[BEAM_DRIVE_STATES],
                 struct beam_drive_output *out)
{
    (void)u_old;
    (void)z;
    if (!beam_finite(p[0])) {
        out->u = u;
        out->u_u = BEAM_K(1.0);
        return 0;
    }
    const beam_real ratio = u / p[0];
    const beam_real t = beam_tanh(ratio);
    const beam_real slope = BEAM_K(1.0) - t * t;
    out->u = p[0] * t; /* L tanh(u/L) */
    out->u_u = slope;
    out->u_p[0] = t - ratio * slope;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_drive_saturation) = {
    .id = "drive_saturation",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the drive amplifier or the patch runs out of range"),
    .form = BEAM_TEXT("u → L tanh(u/L)"),
    .source = BEAM_TEXT("Moheimani and Fleming, Piezoelectric Transducers for Vibration Control and Damping (amplifier "
                        "range); Bendat, Nonlinear System Techniques and Applications (memoryless nonlinear systems)"),
    .looks_like = BEAM_TEXT(
        "Large drives move the beam less than in proportion, in every channel by the same share; odd "
        "harmonics of the drive shake the modes they meet. Free decay and hammer records are exact."),
    .confused_with = BEAM_TEXT(
        "sensor_saturation: one channel only. drive_hysteresis: also delays the drive and matters at "
        "small levels. quadratic_drag, cubic_stiffness: remain with the hammer at the same motion. "
        "Record the amplifier's output voltage as the input."),
    .target_cost = BEAM_TEXT("one tanh per step and patch input"),
    .step_instructions = 140,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("level_V"),
                    .unit = BEAM_TEXT("V"),
                    .what = BEAM_TEXT("voltage that the drive cannot pass"),
                    .role = BEAM_ROLE_LEVEL,
                    .level_of = BEAM_LEVEL_CHANNEL,
                    .neutral = INFINITY,
                    .minimum = 1e-6,
                    .maximum = INFINITY,
                    .start = 10.0,
                    .flags = BEAM_PARAMETER_LOG}},
    .channels = BEAM_CHANNELS_PATCH_INPUT,
    .drive = drive,
};
