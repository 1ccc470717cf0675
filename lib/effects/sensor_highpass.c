/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int filter(const beam_real p[], struct beam_filter_output *out)
{
    if (!beam_finite(p[0])) { /* no leak */
        out->value.b0 = BEAM_K(1.0);
        out->value.a0 = BEAM_K(1.0);
        return 0;
    }
    out->value.b1 = BEAM_K(1.0); /* s / (s + 1/τ) */
    out->value.a1 = BEAM_K(1.0);
    out->value.a0 = BEAM_K(1.0) / p[0];
    out->by_parameter[0].a0 = -BEAM_K(1.0) / (p[0] * p[0]);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_sensor_highpass) = {
    .id = "sensor_highpass",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("charge leaks away: the sensor forgets slow signals"),
    .form = BEAM_TEXT("τ v_t + v = τ w_t"),
    .source = BEAM_TEXT(
        "Doebelin, Measurement Systems: piezoelectric transducers with an amplifier's input resistance; "
        "Moheimani and Fleming, Piezoelectric Transducers for Vibration Control and Damping"),
    .looks_like = BEAM_TEXT(
        "Signals slower than 1/(2πτ) fade and lead in phase: mode 1 is a little small and early, by "
        "atan(1/ωτ), and higher modes are untouched. After a one-sided pulse the channel undershoots and "
        "creeps back with τ. Other channels are fine."),
    .confused_with = BEAM_TEXT(
        "sensor_offset with drift: adds, whatever the beam does; a leak only follows motion. Low "
        "damping or gain of mode 1: compare with a second sensor or with the frequency response "
        "between two channels below 10 Hz. sensor_delay: a delay grows with frequency, the lead of a "
        "leak falls."),
    .target_cost =
        BEAM_TEXT("one state per channel and the taps of the band-limited hold (at most 31 multiply-adds a step)"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("tau_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("time constant of the leak (sensor capacitance × input resistance)"),
                    .role = BEAM_ROLE_TIME,
                    .neutral = INFINITY,
                    .minimum = 1e-5,
                    .maximum = INFINITY,
                    .start = 0.2,
                    .flags = BEAM_PARAMETER_LOG}},
    .channels = BEAM_CHANNELS_PATCH_OUTPUT,
    .filter = filter,
};
