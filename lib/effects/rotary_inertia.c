/* SPDX-License-Identifier: MIT */
#include "beam_effect.h"

/*
 * ρ r² = ρ_volume I = EI ρ_volume/E: the beam's thickness is not asked for, because E/ρ_volume is nearly the same,
 * 2.6e7 m²/s², for aluminium, steel and titanium.
 */
#define BAR_SPEED_SQUARED BEAM_K(2.6e7)

static int terms(const beam_real p[], const struct beam_place *place, struct beam_term out[BEAM_EFFECT_TERMS])
{
    (void)place;
    out[0].place.kind = BEAM_OVER_SLOPE;
    out[0].place.weight = BEAM_WEIGHT_EI;
    out[0].value.mass = p[0] / BAR_SPEED_SQUARED; /* ⟨κ ρ r² y'_tt, φ'⟩ */
    out[0].by_parameter[0].mass = BEAM_K(1.0) / BAR_SPEED_SQUARED;
    return 0;
}

const struct beam_effect BEAM_NAME(effect_rotary_inertia) = {
    .id = "rotary_inertia",
    .family = BEAM_FAMILY_STRUCTURE,
    .title = "the cross-sections turn and shear (a thick beam)",
    .form = "⟨κ ρ r² y'_tt, φ'⟩, r² = I/A, ρ r² = EI/(2.6e7 m²/s²)",
    .source = "Han, Benaroya and Wei, Dynamics of transversely vibrating beams using four engineering theories, "
              "Journal of Sound and "
              "Vibration, 1999 (Rayleigh beam; to first order shear adds the same form times E/(k'G))",
    .looks_like =
        "High modes lie below the Euler–Bernoulli frequencies, the share of the shift growing in proportion to "
        "frequency; "
        "mode 1 stays. κ = 1 is rotation alone, κ near 4.2 rotation and shear of a solid metal bar; a larger κ means a "
        "core that shears (glue, foam) or a material other than metal.",
    .confused_with = "point_mass: correlation 0.983 with mass added near an antinode of the high modes; its shifts "
                     "jump from mode to mode. "
                     "The computation itself (too few splines raises high modes): refine first. sensor_delay and "
                     "sensor_lag: change phase, "
                     "not frequency. Measure two more modes.",
    .target_cost = "none per step: a 10 × 10 form added to M before factoring",
    .n_parameters = 1,
    .parameters = {{.name = "scale",
                    .unit = "",
                    .what = "κ: 1 for the rotation of a metal bar, about 4.2 with its shear",
                    .neutral = 0.0,
                    .minimum = 0.0,
                    .maximum = 1e5,
                    .start = 4.2,
                    .flags = 0}},
    .terms = terms,
    .n_terms = 1,
};
