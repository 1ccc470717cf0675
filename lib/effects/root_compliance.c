/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

/* A stiffer clamp than this is rigid: below 1e-6 in every frequency of a laboratory beam (EI/ℓ of order 1 N·m). */
#define COMPLIANCE_FLOOR BEAM_K(1e-7)

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    const beam_real omega = BEAM_K(6.283185307179586476925287) * p[2];
    beam_real c = p[0];
    if (beam_less(c, COMPLIANCE_FLOOR))
        c = COMPLIANCE_FLOOR; /* the slope at the floor stands for the slope at 0, so that a search can leave it */
    out[0].place.kind = BEAM_AT_ROOT;
    out[0].value.stiffness = BEAM_K(1.0) / c; /* (y'(0) + τ y'_t(0) + y'_tt(0)/ω²) / c · φ'(0) */
    out[0].value.damping = p[1] / c;
    out[0].value.mass = BEAM_K(1.0) / (c * omega * omega);
    out[0].by_parameter[0].stiffness = -BEAM_K(1.0) / (c * c);
    out[0].by_parameter[0].damping = -p[1] / (c * c);
    out[0].by_parameter[0].mass = -out[0].value.mass / c;
    out[0].by_parameter[1].damping = BEAM_K(1.0) / c;
    out[0].by_parameter[2].mass = -BEAM_K(2.0) * out[0].value.mass / p[2];
    return 0;
}

const struct beam_effect BEAM_NAME(effect_root_compliance) = {
    .id = "root_compliance",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("a clamp that turns under the root moment (soft, or on a support that rocks)"),
    .form = BEAM_TEXT("(y'(0) + τ y'_t(0) + y'_tt(0)/(2πf)²)/c · φ'(0), with y'(0) free"),
    .source = BEAM_TEXT(
        "Blevins, Formulas for Natural Frequency and Mode Shape: beam with a torsion spring at its root; the "
        "loss as a rotational Kelvin–Voigt element; Ewins, Modal Testing, section on rigs: a support's own modes"),
    .looks_like = BEAM_TEXT(
        "Every frequency falls by nearly the same share, 2 c EI/ℓ while c is small, so EI fitted from "
        "frequencies comes out too low. Against the motion of the tip, strain near the clamp shrinks and "
        "deflection near it grows. A lossy clamp (τ) adds damping that grows with frequency. A clamp on a support "
        "that rocks at f in the band is one mode more than a beam has: below f the clamp is soft, near f one of the "
        "beam's modes becomes two, above f it stands still. Nothing depends on amplitude while the screws hold."),
    .confused_with = BEAM_TEXT(
        "tip_mass and low EI or high ρ: hold ρ at the weighed value and add a tip sensor beside the "
        "one near the clamp, or re-tighten the clamp and compare. cDI and viscoelastic: damping from "
        "the clamp follows the root moment, and changes when the clamp is re-tightened. attached_resonator looks like "
        "a support's mode: put a sensor on the support, or fix it in another way."),
    .target_cost =
        BEAM_TEXT("none per step: the basis holds one shape with y'(0) ≠ 0; numbers in K and C before factoring"),
    .n_parameters = 3,
    .parameters = {{.name = BEAM_TEXT("compliance_radpNm"),
                    .unit = BEAM_TEXT("rad/(N·m)"),
                    .what = BEAM_TEXT("rotation of the clamp per root moment"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e6,
                    .start = 2e-3,
                    .flags = 0},
                   {.name = BEAM_TEXT("loss_s"),
                    .unit = BEAM_TEXT("s"),
                    .what = BEAM_TEXT("damping of the clamp over its stiffness"),
                    .role = BEAM_ROLE_LOSS,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1.0,
                    .start = 1e-3,
                    .flags = BEAM_PARAMETER_INNER},
                   {.name = BEAM_TEXT("frequency_Hz"),
                    .unit = BEAM_TEXT("Hz"),
                    .what =
                        BEAM_TEXT("of the support without the beam, whose damping ratio is πfτ; high: no mode of it"),
                    .role = BEAM_ROLE_RESONANCE,
                    .neutral = 1e6,
                    .minimum = 1e-1,
                    .maximum = 1e7,
                    .start = 1e6,
                    .flags = BEAM_PARAMETER_LOG | BEAM_PARAMETER_INNER | BEAM_PARAMETER_HELD}},
    .releases_root = 1,
    .terms = terms,
    .n_terms = 1,
};
