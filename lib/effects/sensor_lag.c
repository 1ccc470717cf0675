/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int filter(const beam_real p[], struct beam_filter_output *out)
{
    out->value.b0 = BEAM_K(1.0); /* 1 / (τ s + 1) */
    out->value.a1 = p[0];
    out->value.a0 = BEAM_K(1.0);
    out->by_parameter[0].a1 = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_sensor_lag) = {
    .id = "sensor_lag",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("a slow sensor or amplifier: a first-order low-pass"),
    .form = BEAM_TEXT("τ v_t + v = w"),
    .source = BEAM_TEXT("Doebelin, Measurement Systems: first-order instruments"),
    .looks_like = BEAM_TEXT(
        "High modes are small and late in one channel: amplitude falls as 1/√(1 + ω²τ²), phase lags by "
        "atan(ωτ). Frequencies and decay rates are right; other channels are fine."),
    .confused_with = BEAM_TEXT(
        "sensor_delay: the same lag in phase at low frequency, but no loss of amplitude; the highest "
        "modes decide. sensor_highpass: the other end of the spectrum. Lower gain Ks: equal for all "
        "modes. Compare with a second sensor, or feed the amplifier a known sweep."),
    .target_cost =
        BEAM_TEXT("one state per channel and the taps of the band-limited hold (at most 31 multiply-adds a step)"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("tau_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("time constant of the low-pass"),
                    .role = BEAM_ROLE_TIME,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 10.0,
                    .start = 2e-4,
                    .flags = 0}},
    .channels = BEAM_CHANNELS_PATCH_OUTPUT,
    .filter = filter,
};
