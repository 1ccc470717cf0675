/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The table of effects: names and parameters as in the catalogue, then those that beamfit does not know. */
#include "truth_internal.h"

#include <math.h>
#include <string.h>

enum family { STRUCTURE, LAW, TIME_VARYING, CHAIN, DRIVE, RECORDER, BASE };

struct effect_row {
    const char *id;
    enum family family;
    const char *name[TRUTH_PARAMETERS];
    double neutral[TRUTH_PARAMETERS]; /* defaults; at_m NAN: the free end */
};

static const struct effect_row table[TRUTH_EFFECT_KINDS] = {
    [TRUTH_TIP_MASS] = {"tip_mass", STRUCTURE, {"mass_kg"}, {0}},
    [TRUTH_POINT_MASS] = {"point_mass", STRUCTURE, {"mass_kg", "at_m"}, {0, NAN}},
    [TRUTH_ROOT_COMPLIANCE] = {"root_compliance",
                               STRUCTURE,
                               {"compliance_radpNm", "loss_s", "frequency_Hz"},
                               {0, 0, INFINITY}},
    [TRUTH_POINT_SPRING] = {"point_spring", STRUCTURE, {"stiffness_Npm", "damping_Nspm", "at_m"}, {0, 0, NAN}},
    [TRUTH_POINT_DAMPER] = {"point_damper", STRUCTURE, {"damping_Nspm", "at_m"}, {0, NAN}},
    [TRUTH_AXIAL_LOAD] = {"axial_load", STRUCTURE, {"force_N"}, {0}},
    [TRUTH_ROTARY_INERTIA] = {"rotary_inertia", STRUCTURE, {"scale"}, {0}},
    [TRUTH_PATCH_POSITION] = {"patch_position", STRUCTURE, {"shift_m"}, {0}},
    [TRUTH_INPUT_POSITION] = {"input_position", STRUCTURE, {"shift_m"}, {0}},
    [TRUTH_ELECTRICAL_COUPLING] = {"electrical_coupling", STRUCTURE, {"stiffening_Nm2", "time_constant_s"}, {0, 1e-3}},
    [TRUTH_SQUARE_ROOT_DAMPING] = {"square_root_damping", STRUCTURE, {"coefficient_Ns"}, {0}},
    [TRUTH_HYSTERETIC_DAMPING] = {"hysteretic_damping", STRUCTURE, {"loss_factor"}, {0}},
    [TRUTH_VISCOELASTIC] = {"viscoelastic", STRUCTURE, {"strength_Nm2", "relaxation_s"}, {0, 1e-2}},
    [TRUTH_QUADRATIC_DRAG] = {"quadratic_drag", LAW, {"coefficient_Ns2pm3", "power"}, {0, 2}},
    [TRUTH_CUBIC_STIFFNESS] = {"cubic_stiffness", LAW, {"coefficient_Npm3", "at_m", "power"}, {0, NAN, 3}},
    [TRUTH_PATCH_SOFTENING] = {"patch_softening", LAW, {"coefficient_Nmprad2", "power"}, {0, 2}},
    [TRUTH_COULOMB_FRICTION] = {"coulomb_friction", LAW, {"moment_Nm", "velocity_radps", "curve"}, {0, 1e-3}},
    [TRUTH_MICROSLIP] = {"microslip", LAW, {"stiffness_Nmprad", "slip_Nm"}, {0, 1e-3}},
    [TRUTH_BILINEAR_STIFFNESS] = {"bilinear_stiffness",
                                  LAW,
                                  {"change_Nmprad", "at_m", "width_m", "rounding_rad"},
                                  {0, 0.1, 0.01}},
    [TRUTH_LARGE_ROTATION] = {"large_rotation", LAW, {"scale"}, {0}},
    [TRUTH_STOP_CONTACT] = {"stop_contact", LAW, {"stiffness_Npm", "gap_m", "at_m", "power"}, {0, 0, NAN, 1}},
    [TRUTH_SENSOR_HIGHPASS] = {"sensor_highpass", CHAIN, {"tau_s"}, {1}},
    [TRUTH_SENSOR_LAG] = {"sensor_lag", CHAIN, {"tau_s"}, {0}},
    [TRUTH_SENSOR_DELAY] = {"sensor_delay", CHAIN, {"delay_s"}, {0}},
    [TRUTH_SENSOR_SATURATION] = {"sensor_saturation", CHAIN, {"level", "curve"}, {INFINITY}},
    [TRUTH_SENSOR_OFFSET] = {"sensor_offset", CHAIN, {"offset", "drift_per_s"}, {0}},
    [TRUTH_FEEDTHROUGH] = {"feedthrough", CHAIN, {"gain"}, {0}},
    [TRUTH_DRIVE_HYSTERESIS] = {"drive_hysteresis", DRIVE, {"share", "slip_pV", "shape_pV"}, {0, 0.1, 0.05}},
    [TRUTH_DRIVE_SATURATION] = {"drive_saturation", DRIVE, {"level_V", "curve"}, {INFINITY}},
    [TRUTH_CLOCK_ERROR] = {"clock_error", RECORDER, {"relative"}, {0}},
    [TRUTH_MAINS_HUM] = {"mains_hum", CHAIN, {"amplitude", "phase_rad", "frequency_Hz"}, {0, 0, 50}},
    [TRUTH_BASE_MOTION] = {"base_motion", BASE, {"amplitude_mps2", "phase_rad", "frequency_Hz"}, {0, 0, 20}},
    [TRUTH_ATTACHED_RESONATOR] = {"attached_resonator",
                                  STRUCTURE,
                                  {"mass_kg", "frequency_Hz", "damping_ratio", "at_m"},
                                  {0, 40, 0.02, NAN}},
    [TRUTH_THERMAL_DRIFT] = {"thermal_drift", TIME_VARYING, {"rate_ps", "settling_s"}, {0, INFINITY}},
    [TRUTH_QUINTIC_SPRING] = {"quintic_spring", LAW, {"coefficient_Npm5", "at_m"}, {0, NAN}},
    [TRUTH_TIP_MAGNET] = {"tip_magnet", LAW, {"strength_N", "reach_m", "at_m"}, {0, 5e-3, NAN}},
    [TRUTH_DRIVE_DEAD_ZONE] = {"drive_dead_zone", DRIVE, {"half_width_V"}, {0}},
    [TRUTH_DELAYED_FEEDBACK] = {"delayed_feedback", LAW, {"gain_Nspm", "delay_s", "at_m"}, {0, 5e-3, NAN}},
    [TRUTH_SENSOR_QUADRATIC] = {"sensor_quadratic", CHAIN, {"coefficient"}, {0}},
    [TRUTH_STIFFNESS_STEP] = {"stiffness_step", TIME_VARYING, {"relative", "at_s"}, {0, 1}},
};

struct truth_effect *truth_effect_add(struct truth_spec *spec, const char *id)
{
    if (spec->n_effects == TRUTH_EFFECTS)
        return NULL;
    for (int kind = 0; kind < TRUTH_EFFECT_KINDS; kind++) {
        if (strcmp(table[kind].id, id) != 0)
            continue;
        struct truth_effect *effect = &spec->effect[spec->n_effects++];
        *effect = (struct truth_effect){.kind = kind, .output = TRUTH_ALL_CHANNELS};
        memcpy(effect->parameter, table[kind].neutral, sizeof effect->parameter);
        return effect;
    }
    return NULL;
}

static int parameter_index(enum truth_effect_kind kind, const char *name)
{
    for (int k = 0; k < TRUTH_PARAMETERS && table[kind].name[k]; k++)
        if (strcmp(table[kind].name[k], name) == 0)
            return k;
    return -1;
}

int truth_effect_set(struct truth_effect *effect, const char *name, double value)
{
    int k = parameter_index((enum truth_effect_kind)effect->kind, name);
    if (k < 0)
        return -1;
    effect->parameter[k] = value;
    return 0;
}

bool truth_effect_place(const struct truth_spec *spec, const struct truth_effect *effect, double *at_m)
{
    int k = parameter_index((enum truth_effect_kind)effect->kind, "at_m");
    if (k < 0)
        return false;
    *at_m = isnan(effect->parameter[k]) ? spec->length_m : effect->parameter[k];
    return true;
}

const char *truth_effect_parameter(const struct truth_effect *effect, int index)
{
    return index >= 0 && index < TRUTH_PARAMETERS ? table[effect->kind].name[index] : NULL;
}

const char *truth_effect_id(const struct truth_effect *effect)
{
    return table[effect->kind].id;
}

const char *truth_effect_name(size_t index, bool *in_catalogue)
{
    if (index >= TRUTH_EFFECT_KINDS)
        return NULL;
    if (in_catalogue)
        *in_catalogue = index <= TRUTH_THERMAL_DRIFT;
    return table[index].id;
}

const struct truth_effect *truth_effect_find(const struct truth_spec *spec, enum truth_effect_kind kind)
{
    for (size_t i = 0; i < spec->n_effects; i++)
        if (spec->effect[i].kind == (int)kind)
            return &spec->effect[i];
    return NULL;
}

bool truth_effects_nonlinear(const struct truth_spec *spec)
{
    for (size_t i = 0; i < spec->n_effects; i++) {
        enum family family = table[spec->effect[i].kind].family;
        if (family == LAW || family == TIME_VARYING)
            return true;
    }
    return false;
}
