/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

/*
 * Timoshenko's correction to first order: ρ(x) r² (1 + E/(k'G)) y'_tt, with E/(k'G) = 2 (1 + ν) 6/5 = 3.19 for a
 * rectangular section and ν = 0.33. The thickness is not asked for: r² = I/A = (EI/ρ)/(E/ρ_volume) of the plain beam, and
 * E/ρ_volume is nearly the same, 2.6e7 m²/s², for aluminium, steel and titanium.
 */
#define BAR_SPEED_SQUARED  BEAM_K(2.6e7)
#define ROTATION_AND_SHEAR BEAM_K(4.19)

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_SLOPE;
    out[0].place.weight = BEAM_WEIGHT_TURNING;
    out[0].by_parameter[0].mass = ROTATION_AND_SHEAR / BAR_SPEED_SQUARED;
    out[0].value.mass = p[0] * out[0].by_parameter[0].mass;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_rotary_inertia) = {
    .id = "rotary_inertia",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = BEAM_TEXT("the cross-sections turn and shear (a thick beam)"),
    .form = BEAM_TEXT("⟨κ ρ r² (1 + E/(k'G)) y'_tt, φ'⟩, r² = I/A"),
    .source = BEAM_TEXT(
        "Timoshenko, On the correction for shear of the differential equation for transverse vibrations of "
        "prismatic bars, Philosophical Magazine, 1921; Han, Benaroya and Wei, Dynamics of transversely "
        "vibrating beams using four engineering theories, Journal of Sound and Vibration, 1999"),
    .looks_like = BEAM_TEXT(
        "High modes lie below the Euler–Bernoulli frequencies, the share of the shift growing in "
        "proportion to frequency; mode 1 stays. κ = 1 is the theory for a solid metal bar; a much larger "
        "κ means a core that shears (glue, foam), a material other than metal, or another cause "
        "altogether."),
    .confused_with = BEAM_TEXT(
        "point_mass: correlation 0.983 with mass added near an antinode of the high modes; its shifts "
        "jump from mode to mode. The computation itself (too few splines raises high modes): refine "
        "first. sensor_delay and sensor_lag: change phase, not frequency. Measure two more modes."),
    .target_cost = BEAM_TEXT("none per step: a 10 × 10 form added to M before factoring"),
    .n_parameters = 1,
    .parameters = {{.name = BEAM_TEXT("scale"),
                    .unit = BEAM_TEXT(""),
                    .what = BEAM_TEXT("κ: 1 for the rotation and shear of a solid metal bar"),
                    .role = BEAM_ROLE_STRENGTH,
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 100.0,
                    .start = 1.0,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
