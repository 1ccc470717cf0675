/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

/* Stays when the mass is 0, kg: so the coordinate is never without one, and the effect begins in proportion to what is added. */
static const beam_real least_mass = BEAM_K(1e-9);

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    const beam_real turn = BEAM_K(6.283185307179586476925287), omega = turn * p[1], two = BEAM_K(2.0);
    const beam_real m = p[0] + least_mass;
    if (beam_less(p[3], BEAM_K(0.0)) || beam_less(place->length_m, p[3]))
        return -1;
    out[0].place.kind = BEAM_AT_OWN; /* m q_tt against q */
    out[0].value.mass = m;
    out[0].by_parameter[0].mass = BEAM_K(1.0);
    out[1].place.kind = BEAM_AT_POINT_TO_OWN; /* m (ω² + 2ζω d/dt)(y(a) − q) against φ(a) − q */
    out[1].place.at_m = p[3];
    out[1].place.at_parameter = 4;
    out[1].value.stiffness = m * omega * omega;
    out[1].value.damping = two * m * p[2] * omega;
    out[1].by_parameter[0].stiffness = omega * omega;
    out[1].by_parameter[0].damping = two * p[2] * omega;
    out[1].by_parameter[1].stiffness = two * m * omega * turn;
    out[1].by_parameter[1].damping = two * m * p[2] * turn;
    out[1].by_parameter[2].damping = two * m * omega;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_attached_resonator) = {
    .id = "attached_resonator",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("something on the beam that swings by itself (absorber, shaker, loose part)"),
    .form = BEAM_TEXT("m (ω² + 2ζω d/dt)(y(a) − q) φ(a), m q_tt = m (ω² + 2ζω d/dt)(y(a) − q), ω = 2πf"),
    .source = BEAM_TEXT("Den Hartog, Mechanical Vibrations, chapter 3: the damped dynamic vibration absorber; Ewins, "
                        "Modal Testing, chapter on the coupled exciter"),
    .looks_like = BEAM_TEXT(
        "One mode more than a beam has. Where its frequency f is near one of the beam's, that mode becomes two, "
        "on either side of f, with the response small between them; with a large ζ one broad peak. Far below f "
        "it is a mass that is carried along, far above f it stands still. Nothing depends on amplitude."),
    .confused_with = BEAM_TEXT(
        "point_mass: the same when f lies far above the band. point_spring and point_damper: nearly the same "
        "when f lies far below it. A mode that bends sideways or twists, and a support with a mode of its own "
        "(root_compliance with its frequency freed), look alike in one sensor: move the sensor across the width, or "
        "fix the support in another way."),
    .target_cost = BEAM_TEXT("one mode more: 7 multiply-adds, and 2 for each input and output; no Newton"),
    .n_parameters = 4,
    .parameters = {{.name = BEAM_TEXT("mass_kg"),
                    .unit = BEAM_TEXT("kg"),
                    .what = BEAM_TEXT("the mass that swings"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e3,
                    .start = 1e-3,
                    .flags = 0},
                   {.name = BEAM_TEXT("frequency_Hz"),
                    .unit = BEAM_TEXT("Hz"),
                    .what = BEAM_TEXT("its frequency with the beam held still"),
                    .role = BEAM_ROLE_RESONANCE,
                    .neutral = 50.0,
                    .minimum = 1e-3,
                    .maximum = 1e6,
                    .start = 50.0,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("damping_ratio"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("ζ, the share of its critical damping"),
                    .role = BEAM_ROLE_LOSS,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 10.0,
                    .start = 0.02,
                    .flags = BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("at_m"),
                    .unit = BEAM_TEXT("m"),
                    .what = BEAM_TEXT("its distance from the clamp"),
                    .role = BEAM_ROLE_PLACE,
                    .neutral = 1.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 1.0,
                    .flags = BEAM_PARAMETER_INNER}},
    .terms = terms,
    .n_terms = 2,
};
