/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int filter(const beam_real p[], struct beam_filter_output *out)
{
    out->value.b0 = BEAM_K(1.0); /* e^(−s d) */
    out->value.a0 = BEAM_K(1.0);
    out->value.delay_s = p[0];
    out->by_parameter[0].delay_s = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_sensor_delay) = {
    .id = "sensor_delay",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("outputs arrive late by a fixed time"),
    .form = BEAM_TEXT("v(t) = w(t − d), every output channel"),
    .source = BEAM_TEXT("Bendat and Piersol, Random Data: time delay and the phase of a frequency response"),
    .looks_like = BEAM_TEXT(
        "Phase between input and output lags in proportion to frequency, 360° × frequency × d, while "
        "amplitudes, frequencies and decay rates are right. The misfit grows with mode number and is "
        "largest just after the hit."),
    .confused_with = BEAM_TEXT(
        "sensor_lag: also loses amplitude at high modes. clock_error: its lag grows along the record, "
        "a delay's does not. sensor_highpass: leads at low frequency. Feed one signal to the input and "
        "to the output channel of the recorder and compare."),
    .target_cost = BEAM_TEXT(
        "a ring of samples per channel and the taps of the band-limited hold (at most 31 multiply-adds a "
        "step)"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("delay_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("time by which the outputs are late against the inputs"),
                    .role = BEAM_ROLE_TIME,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 1e-4,
                    .flags = 0}},
    .channels = BEAM_CHANNELS_EVERY_OUTPUT,
    .filter = filter,
};
