# SPDX-License-Identifier: GPL-3.0-or-later
"""What hides in a rig: which effects can act on it, their places and times, and a first strength from the beam's own motion.

A strength is first guessed so that the effect's forces are some per cent of the beam's; settle.py then scales it.
"""

import math

import rigs

OUTSIDE = ("attached_resonator", "quintic_spring", "tip_magnet", "drive_dead_zone", "delayed_feedback", "sensor_quadratic", "stiffness_step")
# Drawn among those, so that the seeds keep their cases, and in the catalogue by now.
SINCE = ("attached_resonator",)
LAWS = ("quadratic_drag", "cubic_stiffness", "patch_softening", "coulomb_friction", "microslip", "bilinear_stiffness",
        "stop_contact", "sensor_saturation", "drive_saturation", "thermal_drift")  # their form can be bent
PATCH = ("patch_position", "electrical_coupling", "patch_softening", "coulomb_friction", "microslip")
# need the beam's state, which a free decay does not give: beamfit cannot add these to a model that is fitted to one
STATEFUL = ("quadratic_drag", "cubic_stiffness", "patch_softening", "coulomb_friction", "microslip", "bilinear_stiffness", "large_rotation",
            "stop_contact", "thermal_drift", "sensor_saturation")
DRIVE = ("feedthrough", "drive_hysteresis", "drive_saturation", "drive_dead_zone")
CHANNEL = ("sensor_highpass", "sensor_lag", "sensor_delay", "sensor_saturation", "sensor_offset", "feedthrough", "mains_hum", "sensor_quadratic")
PER_RECORD = {"input_position": ("shift_m",), "mains_hum": ("phase_rad",), "base_motion": ("phase_rad",)}
# What a rough rig lacks beside the cause (rigs.ROUGH_SHARE): a clamp that gives, something that swings, more damping than the model's
BESIDE = ("root_compliance", "root_compliance", "attached_resonator", "point_damper", "point_spring", "axial_load", "hysteretic_damping",
          "viscoelastic", "sensor_lag", "quadratic_drag", "rotary_inertia")
# What laboratories change on purpose (a weighed mass, a roller, a soft clamp), so many times the first guess: a misfit as large as the signal
CHANGES = {"tip_mass": (10, 500), "point_mass": (10, 500), "point_spring": (20, 20000), "root_compliance": (10, 250),
           "attached_resonator": (5, 50), "point_damper": (15, 150), "axial_load": (30, 1000)}
FAMILIES = (("tip_mass", "point_mass"), ("point_damper", "point_spring"))  # the first is a special case of the second
CATALOGUE = ("tip_mass", "point_mass", "root_compliance", "point_spring", "point_damper", "axial_load", "rotary_inertia", "patch_position",
             "input_position", "electrical_coupling", "square_root_damping", "hysteretic_damping", "viscoelastic", "quadratic_drag",
             "cubic_stiffness", "patch_softening", "coulomb_friction", "microslip", "bilinear_stiffness", "large_rotation", "stop_contact",
             "sensor_highpass", "sensor_lag", "sensor_delay", "sensor_saturation", "sensor_offset", "feedthrough", "drive_hysteresis",
             "drive_saturation", "clock_error", "mains_hum", "base_motion", "thermal_drift")


def struck(rig):
    """Records whose force stands in a column."""
    return [r for r, plan in rig.records.items() if rig.inputs[plan["input"]][0] == "point_force" and not plan["decay"]]


def driven(rig, channel=None):
    """Training records with a voltage on the patch, that have the channel."""
    return [r for r, plan in rig.records.items() if r.startswith("train") and plan["input"] == "drive_V"
            and (channel is None or channel in rig.channels(r)[1])]


def out_of_reach(effect, rig):
    """Acts, and beamfit cannot represent it with these records: counts as outside the catalogue."""
    return effect in STATEFUL and any(plan["decay"] for plan in rig.records.values())


def can_act(effect, rig):
    """On this support, with these channels, where the fitted records would show it."""
    if effect in ("tip_mass",):
        return rig.support in ("clamped-free", "free-free")
    if effect in ("root_compliance",):
        return rig.support in ("clamped-free", "clamped-clamped")
    if effect == "large_rotation":
        return rig.support == "clamped-free"
    if effect == "base_motion":
        return rig.support != "free-free"
    if effect == "clock_error":
        return rig.weighed
    if effect == "input_position":
        return any(record.startswith("train") for record in struck(rig))
    if effect in DRIVE and not driven(rig):
        return False
    if effect == "mains_hum" and rig.band_Hz < 70:
        return False
    return len(rig.patches) > 0 or effect not in PATCH


class Effect:
    """One effect: `values` for every record, or {record: value} of those that differ from record to record."""

    def __init__(self, effect, rig, dice):
        self.id, self.values, self.channel, self.strength, self.inverse = effect, {}, None, None, False
        self.second = None  # of two sliders: the values of the other
        self.ends = {"clamped-free": (0.25, 0.95), "free-free": (0.05, 0.95)}.get(rig.support, (0.15, 0.85))
        self.at = round(rig.length_m * dice.uniform(*self.ends), 3)
        self.bent = effect in LAWS and dice.random() < 1 / 3
        names = [n for n in rig.outputs if any(n in rig.channels(r)[1] for r in rig.records if r.startswith("train"))]
        if effect == "feedthrough":
            names = [n for n in names if driven(rig, n)]
        if effect in CHANNEL:
            self.channel = dice.choice(names)

    def lines(self, record, outputs):
        """Spec lines for one record."""
        if self.channel is not None and self.channel not in outputs:
            return []
        found = []
        for values in [self.values] + ([self.second] if self.second else []):
            words = ["effect", self.id] + (["channel=" + self.channel] if self.channel else [])
            for name, value in values.items():
                value = value.get(record, 0) if isinstance(value, dict) else value
                words.append("%s=%.9g" % (name, value))
            found.append(" ".join(words))
        return found

    def scale(self, factor):
        """Makes the effect so many times stronger."""
        factor = 1 / factor if self.inverse else factor
        for values in [self.values] + ([self.second] if self.second else []):
            for name in self.strength:
                value = values[name]
                values[name] = {r: v * factor for r, v in value.items()} if isinstance(value, dict) else value * factor


def set_structure(e, rig, dice, seen, unit):
    mass, sign = rig.rho * rig.length_m, dice.choice((-1, 1))
    if e.id in ("tip_mass", "point_mass"):
        e.values = {"mass_kg": 0.02 * mass}
        e.values.update({"at_m": e.at} if e.id == "point_mass" else {})
    elif e.id == "root_compliance":
        e.values = {"compliance_radpNm": 0.02 * rig.length_m / rig.EI, "loss_s": 0.1 / (2 * math.pi * rig.band_Hz)}
    elif e.id == "point_spring":
        e.values = {"stiffness_Npm": 0.05 * unit["stiffness"], "damping_Nspm": dice.uniform(0, 0.02) * unit["damping"], "at_m": e.at}
        e.strength = ("stiffness_Npm", "damping_Nspm")
    elif e.id == "point_damper":
        e.values = {"damping_Nspm": 0.02 * unit["damping"], "at_m": e.at}
    elif e.id == "axial_load":
        e.values = {"force_N": sign * 0.01 * rig.EI * (math.pi / rig.length_m) ** 2}
    elif e.id == "rotary_inertia":  # beam_truth's section is 1.6 mm thick: a solid bar of this beam's thickness
        e.values = {"scale": (rig.thickness_m / 1.6e-3) ** 2}
    elif e.id == "patch_position":
        e.values = {"shift_m": sign * 0.003}
    elif e.id == "input_position":
        e.values = {"shift_m": {r: 0.005 * dice.choice((-1, 1)) * dice.uniform(0.5, 1.5) for r in struck(rig)}}
    elif e.id == "electrical_coupling":
        e.values = {"stiffening_Nm2": 0.03 * rig.patches[0][2], "time_constant_s": unit["time"]}
    elif e.id == "square_root_damping":
        e.values = {"coefficient_Ns": 0.01 * unit["omega"] * rig.rho * (rig.length_m / math.pi) ** 2}
    elif e.id == "hysteretic_damping":
        e.values = {"loss_factor": 0.005}
    elif e.id == "viscoelastic":
        e.values = {"strength_Nm2": 0.02 * rig.EI, "relaxation_s": unit["time"]}
    elif e.id == "attached_resonator":
        e.values = {"mass_kg": 0.02 * mass, "frequency_Hz": rigs.log_uniform(dice, rig.frequency_Hz(1), rig.frequency_Hz(3)),
                    "damping_ratio": rigs.log_uniform(dice, 0.005, 0.05), "at_m": e.at}


def set_law(e, rig, dice, seen, unit):
    w, v, s = seen["w"], seen["v"], seen["s"]
    bend = e.bent
    if e.id == "quadratic_drag":
        e.values = {"coefficient_Ns2pm3": 0.02 * rig.rho * unit["omega"] / v}
        if bend:
            power = dice.choice((1.8, 1.9, 2.15))
            e.values = {"coefficient_Ns2pm3": e.values["coefficient_Ns2pm3"] * v ** (2 - power), "power": power}
    elif e.id == "cubic_stiffness":
        power = dice.choice((2.8, 2.9, 3.1, 3.3)) if bend else 3
        e.values = {"coefficient_Npm3": 0.05 * unit["stiffness"] * w ** (1 - power), "at_m": e.at, "power": power}
    elif e.id == "patch_softening":
        power = dice.choice((1.85, 1.9, 2.15)) if bend else 2
        e.values = {"coefficient_Nmprad2": -0.1 * unit["patch"] * s ** (1 - power), "power": power}
    elif e.id == "coulomb_friction":
        e.values = {"moment_Nm": 0.03 * unit["patch"] * s, "velocity_radps": rigs.log_uniform(dice, 0.03, 0.3) * unit["omega"] * s}
        e.values.update({"curve": dice.choice((1, 2))} if bend else {})
    elif e.id == "microslip":
        stiffness = 0.05 * unit["patch"]
        e.values = {"stiffness_Nmprad": stiffness, "slip_Nm": stiffness * s * dice.uniform(0.1, 0.5)}
        e.strength = ("stiffness_Nmprad", "slip_Nm")
        if bend:
            e.values["stiffness_Nmprad"] /= 2
            e.second = {"stiffness_Nmprad": stiffness / 2, "slip_Nm": e.values["slip_Nm"] * 0.7}
            e.values["slip_Nm"] *= 0.3
    elif e.id == "bilinear_stiffness":
        e.values = {"change_Nmprad": 0.1 * rig.EI / 0.005, "at_m": e.at, "width_m": 0.005}
        e.values.update({"rounding_rad": 0.2 * 0.005 * w * (rigs.root(rig.support, 1) / rig.length_m) ** 2} if bend else {})
    elif e.id == "large_rotation":
        e.values = {"scale": 1.0}
    elif e.id == "stop_contact":
        e.values = {"stiffness_Npm": 0.3 * unit["stiffness"], "gap_m": w * dice.uniform(0.4, 0.8), "at_m": e.at}
        if bend:
            e.values.update({"power": 1.3, "stiffness_Npm": e.values["stiffness_Npm"] * (0.3 * w) ** -0.3})
    elif e.id == "quintic_spring":
        e.values = {"coefficient_Npm5": 0.05 * unit["stiffness"] * w ** -4, "at_m": e.at}
    elif e.id == "tip_magnet":
        reach = w * dice.uniform(0.3, 1)
        e.values = {"strength_N": 0.05 * unit["stiffness"] * reach, "reach_m": reach, "at_m": e.at}
    elif e.id == "delayed_feedback":
        e.values = {"gain_Nspm": 0.02 * unit["damping"], "delay_s": dice.uniform(0.1, 0.6) / rig.frequency_Hz(1), "at_m": e.at}
    elif e.id == "thermal_drift":
        e.values = {"rate_ps": dice.choice((-1, 1)) * 0.01 / unit["duration"]}
        e.values.update({"settling_s": unit["duration"] * dice.uniform(0.7, 2)} if bend else {})
    elif e.id == "stiffness_step":
        e.values = {"relative": dice.choice((-1, 1)) * 0.01, "at_s": unit["duration"] * dice.uniform(0.1, 0.5)}


def set_chain(e, rig, dice, seen, unit):
    rms, peak = seen["out"].get(e.channel, (1.0, 1.0))
    drive_rms, drive_peak = seen["in"].get("drive_V", (1.0, 1.0))
    sign, every = dice.choice((-1, 1)), list(rig.records)
    if e.id == "sensor_highpass":
        e.values, e.inverse = {"tau_s": 20 / unit["omega"]}, True
    elif e.id == "sensor_lag":
        e.values = {"tau_s": 0.1 / (2 * math.pi * rig.band_Hz)}
    elif e.id == "sensor_delay":
        e.values = {"delay_s": 0.05 / (2 * math.pi * rig.band_Hz)}
    elif e.id == "sensor_saturation":
        e.values, e.inverse = {"level": 1.5 * peak}, True
    elif e.id == "sensor_offset":
        e.values = {"offset": sign * 0.05 * rms, "drift_per_s": 0.05 * rms * dice.uniform(-0.5, 0.5) / unit["duration"]}
        e.strength = ("offset", "drift_per_s")
    elif e.id == "feedthrough":
        e.values = {"gain": sign * 0.05 * rms / drive_rms}
    elif e.id == "sensor_quadratic":
        e.values = {"coefficient": sign * 0.05 / peak}
    elif e.id == "mains_hum":
        e.values = {"amplitude": 0.05 * rms, "phase_rad": {r: dice.uniform(0, 2 * math.pi) for r in every},
                    "frequency_Hz": dice.choice((50, 60)) * (1 + dice.gauss(0, 3e-4))}
    elif e.id == "drive_hysteresis":
        e.values = {"share": 0.1, "slip_pV": 3 / drive_peak, "shape_pV": 1.5 / drive_peak}
    elif e.id == "drive_saturation":
        e.values, e.inverse = {"level_V": 2 * drive_peak}, True
    elif e.id == "drive_dead_zone":
        e.values = {"half_width_V": 0.02 * drive_peak}
    elif e.id == "clock_error":
        e.values = {"relative": sign * 3e-4}
    elif e.id == "base_motion":
        frequency = rigs.log_uniform(dice, 0.3, 3) * rig.frequency_Hz(1)
        e.values = {"amplitude_mps2": 0.01 * unit["omega"] ** 2 * seen["w"], "phase_rad": {r: dice.uniform(0, 2 * math.pi) for r in every},
                    "frequency_Hz": frequency}
    if e.bent and e.id in ("sensor_saturation", "drive_saturation"):
        e.values["curve"] = dice.choice((1, 3))


def first_guess(e, rig, dice, seen):
    """Fills the values. seen: peak of displacement w and velocity v at the effect's place, of the patch's turn s, (rms, peak) of channels."""
    omega = 2 * math.pi * rig.frequency_Hz(1)
    stiffness = 0.25 * rig.rho * rig.length_m * omega ** 2
    unit = {"omega": omega, "stiffness": stiffness, "damping": stiffness / omega, "duration": rig.samples / rig.rate_Hz,
            "time": 1 / (2 * math.pi * rigs.log_uniform(dice, rig.frequency_Hz(1), 0.7 * rig.band_Hz)),
            "patch": rig.patches[0][2] / (rig.patches[0][1] - rig.patches[0][0]) if rig.patches else 0}
    for fill in (set_structure, set_law, set_chain):
        if not e.values:
            fill(e, rig, dice, seen, unit)
    if e.strength is None:
        e.strength = (next(iter(e.values)),)


def can_change(effect, rig):
    """A cantilever has nothing that pulls its free end."""
    return can_act(effect, rig) and (effect != "axial_load" or rig.support in ("pinned-pinned", "clamped-clamped"))


def change(e, dice):
    """From the first guess to what a laboratory does: tension, not pressure, and a spring that hardly damps."""
    name = next(iter(e.values))
    e.values[name] = abs(e.values[name]) * rigs.log_uniform(dice, *CHANGES[e.id])


def mates(truth, rig, places):
    """Sets that are right, too: [[id, …]]. A tip mass is a point mass; a damper is a spring without stiffness."""
    found = [list(truth)]
    for special, general in FAMILIES:
        if special in truth:
            found.append([general if effect == special else effect for effect in truth])
    if "point_mass" in truth and rig.support in ("clamped-free", "free-free") and places.get("point_mass", 0) > 0.97 * rig.length_m:
        found.append(["tip_mass" if effect == "point_mass" else effect for effect in truth])
    return found


def removed(truth):
    """What `--without` takes away: the truth and its special cases and generalisations."""
    found = set(truth)
    for family in FAMILIES:
        if found & set(family):
            found |= set(family)
    return sorted(found)
