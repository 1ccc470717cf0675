/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int geometry(const beam_real p[], struct beam_geometry *out)
{
    out->clock_relative = p[0];
    out->by_parameter[2][0] = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_clock_error) = {
    .id = "clock_error",
    .family = BEAM_FAMILY_MEASUREMENT,
    .title = BEAM_TEXT("the recorder's clock runs fast or slow"),
    .form = BEAM_TEXT("sample interval (1 + e) × the stated one"),
    .source = BEAM_TEXT("Bendat and Piersol, Random Data: data acquisition; elementary change of the time unit"),
    .looks_like = BEAM_TEXT(
        "All frequencies and all decay rates are wrong by one and the same share. A mains line stands "
        "beside 50 or 60 Hz by that share too, in every record from this recorder."),
    .confused_with = BEAM_TEXT(
        "EI, ρ, tip_mass, root_compliance: shift frequencies alike but not the mains line, nor decay "
        "rates in step; with EI and ρ free this is not identifiable from the beam alone. Record a "
        "quartz-made 100 Hz signal, or the mains against a counter."),
    .target_cost = BEAM_TEXT("none per step: the matrices are made for the true interval"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("relative"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("relative error of the stated sample interval (positive: it is longer)"),
                    .role = BEAM_ROLE_SHARE,
                    .neutral = 0.0,
                    .minimum = -0.1,
                    .maximum = 0.1,
                    .start = 1e-3,
                    .flags = 0}},
    .geometry = geometry,
};
