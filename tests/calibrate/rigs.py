# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a whole rig: beam, support, patches, channels, records, instruments and what the experimenter has wrong about them.

Every number is a function of (seed, number) alone. docs/calibration.md says what is drawn from what.
"""

import math
import random

# Young's modulus in Pa and density in kg/m3 (handbook), loss (damping ratio that the material alone gives in the band)
MATERIALS = {"steel": (205e9, 7850, 0.001), "aluminium": (70e9, 2700, 0.001), "brass": (100e9, 8500, 0.0015), "plastic": (3.2e9, 1300, 0.012)}
SUPPORTS = (("clamped-free", 5), ("pinned-pinned", 2), ("clamped-clamped", 2), ("free-free", 1))
# (beta l) of the first modes that bend; the further ones lie pi apart
FIRST_ROOTS = {"clamped-free": (1.8751, 4.6941), "pinned-pinned": (math.pi, 2 * math.pi),
               "clamped-clamped": (4.7300, 7.8532), "free-free": (4.7300, 7.8532)}
RATES_HZ = (128, 200, 256, 400, 500, 512, 800, 1000, 1024, 1600, 2000, 2048, 2500, 3200, 4000, 4096, 5000, 8000, 8192, 10000)
SAMPLES = (1500, 4096)  # fewest and most of a record
PLACE_SD_M, EDGE_SD_M, GAIN_SD = 0.002, 0.001, 0.05
CAREFUL = 3  # one rig of so many is where and what the model says
UNEVEN_SHARE, PIECES = 0.4, 6  # of the rigs; pieces of a beam
ROUGH_SHARE = 0.6  # of the rigs whose experimenter makes errors: what they lack beside the cause is seen, as on every measured beam
SHIFTED, SHIFT = 0.3, (0.03, 0.5)  # of their records of acceleration: a zero shift that creeps back, of the rms
SECTION_SD, REPEAT_SD = (0.003, 0.05), (0.003, 0.05)  # relative, each drawn between these: EI and rho of a piece; what a blow is said to be
KIND_UNIT = {"displacement": "m", "velocity": "mps", "acceleration": "mps2", "patch_strain": "V"}


def log_uniform(dice, low, high):
    return math.exp(dice.uniform(math.log(low), math.log(high)))


def bounded_normal(dice, sd):
    """Normal, cut at two standard deviations: a ruler is not off by any amount."""
    return sd * max(-2.0, min(2.0, dice.gauss(0, 1)))


def weighted(dice, choices):
    return dice.choices([word for word, _ in choices], [weight for _, weight in choices])[0]


def root(support, mode):
    """(beta l) of mode 1, 2, …"""
    roots = FIRST_ROOTS[support]
    return roots[mode - 1] if mode <= 2 else roots[1] + (mode - 2) * math.pi


class Rig:
    """What is on the bench (true numbers) and what the model file says of it (`believed`)."""

    def __init__(self, seed, number):
        self.name, self.number = "c%d_%04d" % (seed, number), number
        dice = random.Random("beamfit calibration %d %d" % (seed, number))
        self.seed = dice.randrange(1 << 40)
        self.draw_beam(dice)
        self.draw_patches(dice)
        self.draw_rate(dice)
        self.draw_channels(dice)
        self.draw_records(dice)
        self.draw_instruments(dice)
        self.draw_beliefs(dice)
        self.draw_unevenness(dice)
        self.draw_roughness(dice)

    def frequency_Hz(self, mode):
        """Of the bare beam."""
        return (root(self.support, mode) / self.length_m) ** 2 * math.sqrt(self.EI / self.rho) / (2 * math.pi)

    def draw_beam(self, dice):
        self.support = weighted(dice, SUPPORTS)
        while True:
            self.material = dice.choice(sorted(MATERIALS))
            young, density, loss = MATERIALS[self.material]
            self.length_m = round(dice.uniform(0.2, 0.8), 3)
            self.width_m, self.thickness_m = dice.uniform(0.01, 0.04), log_uniform(dice, 0.8e-3, 6e-3)
            self.handbook_EI = young * self.width_m * self.thickness_m ** 3 / 12
            self.handbook_rho = density * self.width_m * self.thickness_m
            self.EI, self.rho = self.handbook_EI, self.handbook_rho
            if 4 < self.frequency_Hz(1) < 120:  # slower ones need minutes of record, faster ones other instruments
                break
        self.weighed = dice.random() < 0.15  # bent and weighed beforehand: the model holds EI and rho
        self.prior_EI, self.prior_rho = 0.03, 0.01
        self.EI *= math.exp(0 if self.weighed else bounded_normal(dice, self.prior_EI))
        self.rho *= math.exp(0 if self.weighed else bounded_normal(dice, self.prior_rho))
        self.material_loss = loss * log_uniform(dice, 0.6, 2)
        self.air_loss = log_uniform(dice, 0.001, 0.008)

    def draw_patches(self, dice):
        """self.patches: [[from, to, EI, rho]], the first one wired."""
        self.patches = []
        count = dice.choices((0, 1, 2), (3, 5, 2))[0]
        start = self.length_m * (dice.uniform(0.03, 0.12) if self.support == "clamped-free" else dice.uniform(0.1, 0.4))
        for _ in range(count):
            long = min(dice.uniform(0.03, 0.08), 0.25 * self.length_m)
            self.patches.append([start, start + long, self.EI * dice.uniform(1.15, 2), self.rho * dice.uniform(1.2, 3)])
            start += long + self.length_m * dice.uniform(0.05, 0.2)

    def draw_rate(self, dice):
        """Three to eight modes below the anti-alias filter's corner."""
        self.filter_order = dice.choice((4, 6, 8))
        self.filter_ratio = dice.choice((0.4, 0.4, 0.35, 0.3))
        self.filter_causal = dice.random() < 0.4
        self.filter_stated = dice.random() < 0.5
        fits = []
        for rate in RATES_HZ:
            modes = sum(self.frequency_Hz(mode) < 0.9 * self.filter_ratio * rate for mode in range(1, 20))
            if 3 <= modes <= 8 and 10 * rate / self.frequency_Hz(1) <= SAMPLES[1]:
                fits.append((rate, modes))
        if not fits:
            rate = 3 * self.frequency_Hz(4)
            fits = [(round(rate, -1 if rate > 100 else 0), 3)]
        self.rate_Hz, self.modes = dice.choice(fits)
        self.band_Hz = 0.9 * self.filter_ratio * self.rate_Hz
        least = max(SAMPLES[0], min(SAMPLES[1], 10 * self.rate_Hz / self.frequency_Hz(1)))
        self.samples = int(dice.uniform(least, SAMPLES[1]))
        top = 2 * math.pi * self.frequency_Hz(self.modes)
        first = 2 * math.pi * self.frequency_Hz(1)
        self.cDI_per_EI = 2 * self.material_loss / math.sqrt(top * first)
        self.gamma = 2 * self.air_loss * self.rho * first

    def place(self, dice):
        """Somewhere that moves."""
        ends = {"clamped-free": (0.15, 0.98), "free-free": (0.02, 0.98)}.get(self.support, (0.08, 0.92))
        return round(self.length_m * dice.uniform(*ends), 3)

    def draw_channels(self, dice):
        """self.inputs: {name: [kind, at]}, self.outputs: {name: [kind, at, inputs whose records have it]}."""
        wired = len(self.patches) > 0
        self.inputs, self.outputs = {}, {}
        choice = dice.choice(("drive", "force", "both")) if wired else "force"
        self.shaker = dice.random() < 0.35
        if choice != "drive":
            self.inputs["shaker_N" if self.shaker else "hammer_N"] = ["point_force", self.place(dice)]
        if choice != "force":
            self.inputs["drive_V"] = ["patch_moment", None]
        for name, (kind, _) in self.inputs.items():
            hears = ["acceleration", "velocity", "displacement"]
            if self.support == "free-free":
                hears = ["acceleration"]  # the rigid motion of a struck free beam leaves every other range
            hears += ["patch_strain"] if wired and kind == "point_force" else []
            for _ in range(dice.choices((1, 2, 3), (5, 4, 2))[0]):
                self.add_output(dice, dice.choice(hears), name)

    def add_output(self, dice, kind, input_name):
        """A new sensor, or one that the records of another input have, too."""
        same = [n for n, (k, _, _) in self.outputs.items() if k == kind]
        free = [n for n in same if input_name not in self.outputs[n][2]]
        if free and (kind == "patch_strain" or dice.random() < 0.7):
            self.outputs[free[0]][2].append(input_name)
        elif not (same and kind == "patch_strain") and len(self.outputs) < 4:
            stem = {"acceleration": "accel", "velocity": "laser", "displacement": "gap", "patch_strain": "piezo"}[kind]
            name = "%s%s_%s" % (stem, len(same) + 1 if same else "", KIND_UNIT[kind])
            self.outputs[name] = [kind, None if kind == "patch_strain" else self.place(dice), [input_name]]

    def draw_records(self, dice):
        """self.records: {name: {input, signal line, keep_from_s, decay}}; train… are fitted, check… held out."""
        self.records = {}
        self.one_level = dice.random() < 0.3
        self.spread = log_uniform(dice, 3, 10)
        self.decays = dice.random() < 0.5  # blows are cut where the beam already swings, the force is not recorded
        train, check = dice.choices((1, 2, 3, 4), (2, 4, 3, 3))[0], dice.choices((0, 1, 2), (1, 2, 2))[0]
        names = list(self.inputs)
        dice.shuffle(names)
        self.sway_m = self.length_m * log_uniform(dice, 0.002, 0.02)  # of the strong level, roughly
        kinds = {name: ("hit" if name == "hammer_N" else dice.choice(("chirp", "multisine"))) for name in names}
        volts = log_uniform(dice, 10, 100)
        self.KB = self.force_for(self.sway_m, "chirp") / volts / self.moment_arm() if "drive_V" in names else 0
        for k in range(train + check):
            name = names[k % len(names)]
            weak = not self.one_level and (k // len(names)) % 2 == 1
            level = self.sway_m / (self.spread if weak else 1)
            record = "train%d" % (k + 1) if k < train else "check%d" % (k + 1 - train)
            kind = kinds[name]
            if k >= train:
                name = dice.choice([self.records["train%d" % (1 + j)]["input"] for j in range(train)])
                level = self.sway_m * (dice.uniform(0.8, 1.2) if self.one_level else self.spread ** dice.uniform(-1, 0))
                kind = "hit" if name == "hammer_N" else {"chirp": "multisine", "multisine": "chirp"}[kinds[name]]
            self.records[record] = self.signal(dice, name, kind, level)

    def moment_arm(self):
        """Force that a unit moment on the wired patch is worth: its length times the curvature of mode 1, roughly."""
        begin, end = self.patches[0][:2]
        return (end - begin) * (root(self.support, 1) / self.length_m) ** 2

    def force_for(self, sway_m, kind):
        """Of a swept or noisy drive in N, or the impulse of a blow in N s, that sways mode 1 about so far."""
        omega = 2 * math.pi * self.frequency_Hz(1)
        mass = self.rho * self.length_m / 4
        return sway_m * mass * omega if kind == "hit" else sway_m * mass * omega ** 2 * 0.05

    def signal(self, dice, name, kind, sway_m):
        duration = self.samples / self.rate_Hz
        level = self.force_for(sway_m, kind)
        level /= self.KB * self.moment_arm() if name == "drive_V" else 1
        low, high = 0.6 * self.frequency_Hz(1), self.band_Hz * dice.uniform(0.75, 0.95)
        keep = 0.0
        if kind == "hit":
            width = 2 / (self.band_Hz * dice.uniform(0.5, 1.0))
            start = dice.uniform(0.01, 0.04) * duration
            line = "raised_cosine start_s=%.6g width_s=%.6g level=%.6g" % (start, width, 2 * level / width)
            keep = start + width + 2 / self.rate_Hz if self.decays else 0.0
        elif kind == "chirp":
            line = "chirp width_s=%.6g level=%.6g from_Hz=%.6g to_Hz=%.6g taper_s=%.6g" \
                % (0.93 * duration, level, low, high, 0.04 * duration)
        else:
            line = "multisine width_s=%.6g level=%.6g from_Hz=%.6g to_Hz=%.6g taper_s=%.6g count=%d seed=%d" \
                % (0.93 * duration, 0.7 * level, low, high, 0.05 * duration, dice.randint(40, 90), dice.randrange(1, 10 ** 6))
        return {"input": name, "line": line, "keep_from_s": keep, "decay": keep > 0}

    def channels(self, record):
        """(input or None, outputs) that the record has as columns."""
        name = self.records[record]["input"]
        outputs = [n for n, (_, _, inputs) in self.outputs.items() if name in inputs]
        return None if self.records[record]["decay"] else name, outputs

    def draw_instruments(self, dice):
        """Noise of each channel: level, colour, line; bits; whether the range and noise are common to weak and strong records."""
        self.bits, self.headroom = dice.randint(12, 16), log_uniform(dice, 1.1, 3)
        self.common_range, self.common_noise = dice.random() < 0.5, dice.random() < 0.5
        self.noise = {}
        self.mains_Hz = dice.choice((50, 60)) * (1 + dice.gauss(0, 3e-4))
        for name in self.outputs:
            colour = dice.choices(("white", "autoregression", "slope", "line"), (4, 2, 2, 2))[0]
            self.noise[name] = {"level": log_uniform(dice, 0.002, 0.01), "of": "rms", "colour": colour,
                                "coefficient": dice.uniform(0.5, 0.9), "line": dice.uniform(0.3, 0.8)}
        for name, (kind, _) in self.inputs.items():
            force = kind == "point_force"  # a drive's voltage is known better than a hammer's force
            self.noise[name] = {"level": log_uniform(dice, 0.002, 0.01) if force else log_uniform(dice, 0.0002, 0.002),
                                "of": dice.choice(("rms", "peak")) if force else "rms", "colour": "white"}

    def draw_beliefs(self, dice):
        """Where things are said to be, and the gain of each channel (written value / true value)."""
        self.Ks = log_uniform(dice, 10, 100)
        self.care = 1.0 if dice.random() < 0.4 else log_uniform(dice, 0.05, 1)  # some experimenters measure better than others
        self.care = 0.0 if self.number % CAREFUL == 0 else self.care  # and some make no error at all
        self.gain = {name: 1.0 if kind == "patch_strain" else math.exp(self.care * bounded_normal(dice, GAIN_SD))
                     for name, (kind, *_) in self.outputs.items()}
        self.gain.update({name: 1.0 if kind == "patch_moment" else math.exp(self.care * bounded_normal(dice, GAIN_SD))
                          for name, (kind, _) in self.inputs.items()})
        self.believed_at, self.believed_patches = {}, []
        for name, (_, at, *_) in list(self.inputs.items()) + list(self.outputs.items()):
            if at is not None:
                self.believed_at[name] = round(min(max(at + self.care * bounded_normal(dice, PLACE_SD_M), 0.001), self.length_m), 5)
        for begin, end, _, _ in self.patches:
            self.believed_patches.append([round(edge + self.care * bounded_normal(dice, EDGE_SD_M), 5 if self.care else 9) for edge in (begin, end)])
        self.start = {}
        for k, (_, _, EI, rho) in enumerate(self.patches):
            self.start["EI_%s_Nm2" % self.region(k)] = EI * math.exp(bounded_normal(dice, 0.25))
            self.start["rho_%s_kgpm" % self.region(k)] = rho * math.exp(bounded_normal(dice, 0.25))
        cDI = self.cDI_per_EI * self.EI * math.exp(bounded_normal(dice, 0.5))
        for name in ["beam"] + [self.region(k) for k in range(len(self.patches))]:
            self.start["cDI_%s_sNm2" % name] = cDI
        self.start["gamma_sNpm2"] = self.gamma * math.exp(bounded_normal(dice, 0.5))
        self.start["Ks_V"] = self.Ks * math.exp(bounded_normal(dice, 0.3))
        self.start["KB_NmpV"] = self.KB * math.exp(bounded_normal(dice, 0.3))

    def draw_unevenness(self, dice):
        """What no parameter of the model is: pieces of another section (self.pieces, as patches), blows that repeat badly (self.repeats)."""
        self.pieces, self.repeats = [], {record: 1.0 for record in self.records}
        if dice.random() > UNEVEN_SHARE:
            return
        section, repeat = log_uniform(dice, *SECTION_SD), log_uniform(dice, *REPEAT_SD)
        cuts = sorted([0, self.length_m] + [self.length_m * dice.random() for _ in range(PIECES - 1)])
        for a, b in zip(cuts, cuts[1:]):
            EI, rho = (value * math.exp(bounded_normal(dice, section)) for value in (self.EI, self.rho))
            for begin, end, _, _ in self.patches + [[self.length_m] * 4]:  # a patch keeps its own section
                if begin > a:
                    self.pieces.append([a, min(b, begin), EI, rho])
                a = max(a, min(b, end))
        self.pieces = [piece for piece in self.pieces if piece[1] - piece[0] > 1e-3 * self.length_m]
        if self.shaker or "hammer_N" not in self.inputs:
            return
        self.repeats = {record: math.exp(bounded_normal(dice, repeat)) for record in self.records}

    def draw_roughness(self, dice):
        """self.rough: other effects than the cause are there, too (settle.py). self.shift: {(record, channel): (of the rms, time constant in s)}."""
        self.rough, self.shift = self.care > 0 and dice.random() < ROUGH_SHARE, {}
        if not self.rough:
            return
        for record in self.records:
            for name in self.channels(record)[1]:
                if self.outputs[name][0] == "acceleration" and self.support != "free-free" and dice.random() < SHIFTED:
                    duration = self.samples / self.rate_Hz
                    self.shift[record, name] = (dice.choice((-1, 1)) * log_uniform(dice, *SHIFT), duration * log_uniform(dice, 0.3, 3))

    @staticmethod
    def region(k):
        return "patch" if k == 0 else "patch%d" % (k + 1)

    def beam_lines(self):
        """Spec lines of beam_truth for all records: docs/truth.md."""
        begin, end, EI, rho = self.patches[0] if self.patches else [0.1 * self.length_m, 0.2 * self.length_m, self.EI, self.rho]
        damping = self.cDI_per_EI
        lines = ["length_m %.9g" % self.length_m, "support " + self.support, "patch_m %.9g %.9g" % (begin, end)]
        lines += ["EI_beam_Nm2 %.9g" % self.EI, "rho_beam_kgpm %.9g" % self.rho, "cDI_beam_sNm2 %.9g" % (damping * self.EI)]
        lines += ["EI_patch_Nm2 %.9g" % EI, "rho_patch_kgpm %.9g" % rho, "cDI_patch_sNm2 %.9g" % (damping * EI)]
        lines += ["region %.9g %.9g %.9g %.9g %.9g" % (a, b, e, r, damping * e) for a, b, e, r in self.patches[1:] + self.pieces]
        lines += ["gamma_sNpm2 %.9g" % self.gamma, "Ks_V %.9g" % self.Ks, "KB_NmpV %.9g" % self.KB]
        lines += ["sample_rate_Hz %.9g" % self.rate_Hz, "filter_order %d" % self.filter_order, "filter_ratio %.9g" % self.filter_ratio]
        lines += ["filter_causal %d" % self.filter_causal, "modes %d" % (self.modes + 10), "tolerance 3e-7"]
        lines += ["oversampling %d" % max(16, math.ceil(4000 / self.rate_Hz)), "noise 0", "input_noise 0", "adc_bits 0", "blind 1"]
        return lines

    def record_lines(self, record):
        """Spec lines of one record: its channels with true places, its signal. Instruments come afterwards (records.py)."""
        plan = self.records[record]
        kind, at = self.inputs[plan["input"]]
        lines = ["duration_s %.9g" % (self.samples / self.rate_Hz + plan["keep_from_s"]), "keep_from_s %.9g" % plan["keep_from_s"]]
        lines.append("input %s %s" % (plan["input"], kind) + ("" if at is None else " at_m=%.9g" % at))
        for name in self.channels(record)[1]:
            kind, at, _ = self.outputs[name]
            lines.append("output %s %s" % (name, kind) + ("" if at is None else " at_m=%.9g" % at))
        return lines + ["signal %s %s" % (plan["input"], plan["line"])]

    def model(self):
        """The model file: what the experimenter believes."""
        lines = ["# %s: geometry from a ruler, handbook values, where things are" % self.name, "format: beamfit-model/1", "beam:",
                 "  length_m: %g" % self.length_m, "  support: %s" % self.support]
        if self.patches:
            lines.append("  regions:")
        lines += ["    - {name: %s, from_m: %.9g, to_m: %.9g}" % (self.region(k), a, b) for k, (a, b) in enumerate(self.believed_patches)]
        known = ("fixed: true", "fixed: true") if self.weighed else ("prior: %g" % self.prior_EI, "prior: %g" % self.prior_rho)
        digits = 9 if self.care == 0 else 4  # a frequency that is off by a ten-thousandth is seen where a mode rings for long
        lines += ["parameters:", "  EI_beam_Nm2: {value: %.*g, %s}" % (digits, self.handbook_EI, known[0]),
                  "  rho_beam_kgpm: {value: %.*g, %s}" % (digits, self.handbook_rho, known[1])]
        used = {kind for kind, *_ in list(self.inputs.values()) + list(self.outputs.values())}
        for name, value in self.start.items():
            if (name == "Ks_V" and "patch_strain" not in used) or (name == "KB_NmpV" and "patch_moment" not in used):
                continue
            lines.append("  %s: {value: %.3g}" % (name, value))
        for title, ports in (("inputs", self.inputs), ("outputs", self.outputs)):
            lines.append(title + ":")
            for name, (kind, *_) in ports.items():
                place = ", at_m: %g" % self.believed_at[name] if name in self.believed_at else ""
                lines.append("  %s: {kind: %s%s}" % (name, kind, place))
        return "\n".join(lines + ["effects: []", ""])

    def also_true(self):
        """Effects of the catalogue that the imperfections of this rig are: to name them is not wrong."""
        found = set()
        for name, (kind, at, *_) in self.inputs.items():
            heard = any(self.records[r]["input"] == name and not self.records[r]["decay"] for r in self.records)
            if kind == "point_force" and heard and abs(self.believed_at[name] - at) > PLACE_SD_M / 4:
                found.add("input_position")
        for (begin, end, _, _), believed in list(zip(self.patches, self.believed_patches))[:1]:
            if abs(believed[0] + believed[1] - begin - end) / 2 > EDGE_SD_M / 4:
                found.add("patch_position")
        if any(noise["colour"] == "line" for noise in self.noise.values()):
            found.add("mains_hum")
        return sorted(found)
