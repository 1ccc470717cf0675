/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int law_place(const beam_real p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_OVER_CURVATURE;
    out->weight = BEAM_WEIGHT_EI;
    return 0;
}

static int law(const beam_real p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    out->f[0] = p[0] * in->t_s * in->w[0]; /* EI r t y″ */
    out->f_w[0][0] = p[0] * in->t_s;
    out->f_p[0][0] = in->t_s * in->w[0];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_thermal_drift) = {
    .id = "thermal_drift",
    .family = BEAM_FAMILY_ENVIRONMENT,
    .title = BEAM_TEXT("the beam warms or cools and its stiffness drifts"),
    .form = BEAM_TEXT("EI(t) = EI (1 + r t) within a record"),
    .source = BEAM_TEXT(
        "Xia, Chen, Weng, Ni and Xu, Temperature effect on vibration properties of civil structures, Journal "
        "of Civil Structural Health Monitoring, 2012 (frequency follows √E, E falls with temperature)"),
    .looks_like = BEAM_TEXT(
        "All frequencies glide together by half the share r per second, at every level alike: the phase "
        "of the tail of a long record is off by a parabola in time, its beginning fits. No harmonics."),
    .confused_with = BEAM_TEXT(
        "cubic_stiffness, large_rotation, patch_softening: glide with the decaying amplitude, not with "
        "the clock; compare a weak and a strong record, or drive steadily for a minute. clock_error: a "
        "wrong but constant frequency. sensor_offset: the zero moves, not the frequencies."),
    .target_cost = BEAM_TEXT(
        "law coordinates over the span (at most 8): about 60 multiply-adds each and a Newton solve with "
        "as many unknowns; the dearest of the laws"),
    .step_instructions = 24,
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("rate_ps"),
                    .unit = BEAM_TEXT("1/s"),
                    .what = BEAM_TEXT("relative change of EI per second, from the record's first sample"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = -0.1,
                    .maximum = 0.1,
                    .start = 1e-4,
                    .flags = 0}},
    .law_place = law_place,
    .law = law,
};
