/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_CURVATURE;
    out[0].place.weight = BEAM_WEIGHT_PATCH;
    out[0].value.memory = p[0]; /* EI_patch + θ s RC/(1 + s RC) */
    out[0].value.relaxation_s = p[1];
    out[0].by_parameter[0].memory = BEAM_K(1.0);
    out[0].by_parameter[1].relaxation_s = BEAM_K(1.0);
    return 0;
}

const struct beam_effect BEAM_NAME(effect_electrical_coupling) = {
    .id = "electrical_coupling",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("the patch's charge, loaded by a resistor, stiffens and damps the beam"),
    .form = BEAM_TEXT("EI_patch + θ s RC/(1 + s RC)"),
    .source = BEAM_TEXT(
        "Hagood and von Flotow, Damping of structural vibrations with piezoelectric materials and passive "
        "electrical networks, Journal of Sound and Vibration, 1991"),
    .looks_like = BEAM_TEXT(
        "Modes above 1/(2πRC) see the patch with its charge kept (open circuit, stiffer), modes below "
        "with its charge drained (short circuit); a mode near it is damped. Frequencies change when the "
        "patch is shorted, or when another amplifier is connected. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "viscoelastic: a memory of the whole beam, this one of the patch only: short the patch and tap "
        "again; what is electrical vanishes. EI_patch: the same when every mode lies far above or far "
        "below 1/(2πRC). sensor_highpass: the same RC seen in the sensor's own voltage; that leaves "
        "the beam's frequencies alone."),
    .target_cost = BEAM_TEXT(
        "up to 10 more states: 20 multiply-adds, and 10 for each input, output and law coordinate; no "
        "Newton"),
    .n_parameters = 2,
    .parameters = {{.name = BEAM_TEXT("stiffening_Nm2"),
                    .unit = BEAM_TEXT("N·m²"),
                    .what = BEAM_TEXT("bending stiffness that the open circuit adds to the patch"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 0.02,
                    .flags = 0},
                   {.name = BEAM_TEXT("time_constant_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("load resistance × patch capacitance"),
                    .role = BEAM_ROLE_TIME,
                    .neutral = 5e-3,
                    .minimum = 1e-7,
                    .maximum = 1e3,
                    .start = 5e-3,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER}},
    .terms = terms,
    .n_terms = 1,
};
