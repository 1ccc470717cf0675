#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a fleet: units whose beams differ as those of one production do, some with a hidden effect, some with broken inputs.

Writes DIR/units.csv (the manifest), DIR/model.yaml, DIR/records/UNIT-*.csv and DIR/truth.json, which says what was drawn. Records that
are there already are not made again.
"""

import argparse
import json
import math
import os
import random
import subprocess
from concurrent.futures import ThreadPoolExecutor

# Mean and relative spread (of the logarithm) of the units' true values.
DRAWN = {"EI_beam_Nm2": (0.491, 0.04), "EI_patch_Nm2": (0.793, 0.05), "gamma_sNpm2": (0.05, 0.15),
         "cDI_beam_sNm2": (2e-5, 0.10), "Ks_V": (40.0, 0.06)}
CORRELATED = ("EI_beam_Nm2", "EI_patch_Nm2", 0.6)  # of their logarithms
HELD = {"rho_beam_kgpm": 0.093, "rho_patch_kgpm": 0.433, "cDI_patch_sNm2": 2e-5}
DRIFT = ("gamma_sNpm2", "temperature_C", 0.01)  # relative, a degree from 20
HIDDEN = ("tip_mass mass_kg=0.001", "root_compliance compliance_radpNm=0.003 loss_s=3e-5")
BROKEN = ("no record", "no model", "a record that is no record", "a record that is cut", "an input that is zero", "NaN")

MODEL = """format: beamfit-model/1
beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}
parameters:
  EI_beam_Nm2: {value: 0.5}
  EI_patch_Nm2: {value: 0.8}
  rho_beam_kgpm: {value: 0.093, fixed: true}
  rho_patch_kgpm: {value: 0.433, fixed: true}
  cDI_beam_sNm2: {value: 2e-5}
  cDI_patch_sNm2: {value: 2e-5, fixed: true}
  gamma_sNpm2: {value: 0.05}
  Ks_V: {value: 40}
inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}
outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}
effects: []
%s"""
BOARD = """board:
  sample_Hz: 1000
  sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}
  drive: {input: hammer_N, per_code: 0.02, zero_code: 2048}
  noise_rms: 0.002
"""
SPEC = """length_m 0.4573
patch_m 0.02535 0.08905
input hammer_N point_force at_m=0.0254
output piezo_V patch_strain
output tip_mps velocity at_m=0.44
sample_rate_Hz 512
duration_s %g
modes 16
tolerance 3e-7
"""


def draw_unit(number, options):
    """One unit as a function of its number and the seed alone."""
    dice = random.Random("fleet %d %d" % (options.seed, number))
    deviates = {name: dice.gauss(0, 1) for name in DRAWN}
    first, second, rho = CORRELATED
    deviates[second] = rho * deviates[first] + math.sqrt(1 - rho * rho) * deviates[second]
    unit = {"unit": "u%04d" % number, "temperature_C": round(20 + 5 * dice.uniform(-1, 1), 1),
            "date": "2026-%02d-%02d" % (1 + number % 12, 1 + number % 28)}
    values = {name: mean * math.exp(spread * deviates[name]) for name, (mean, spread) in DRAWN.items()}
    values[DRIFT[0]] *= 1 + DRIFT[2] * (unit["temperature_C"] - 20)
    poor = dice.random() < 0.1  # more noise
    return {**unit, "values": {**values, **HELD}, "noise": 0.04 if poor else 0.004, "hidden": None, "broken": None}


def draw(options):
    units = [draw_unit(k, options) for k in range(1, options.units + 1)]
    dice = random.Random("fleet %d: which" % options.seed)
    chosen = dice.sample(units, options.hidden + options.broken)
    for k, unit in enumerate(chosen[:options.hidden]):
        unit["hidden"] = HIDDEN[k % len(HIDDEN)]
    for k, unit in enumerate(chosen[options.hidden:]):
        unit["broken"] = BROKEN[k % len(BROKEN)]
    return units


def spec(unit, k, options):
    level, width = ((2.0, 0.008), (20.0, 0.008), (8.0, 0.012))[k]
    lines = [SPEC % options.duration] + ["%s %.17g\n" % item for item in unit["values"].items()]
    lines.append("noise %g\n" % unit["noise"])
    if unit["hidden"]:
        lines.append("effect %s\n" % unit["hidden"])
    lines.append("signal hammer_N raised_cosine start_s=0.15 width_s=%g level=%g\n" % (width, level))
    lines.append("blind 1\nseed %d\n" % (1000003 * options.seed + 10 * int(unit["unit"][1:]) + k))
    return "".join(lines)


def spoil(unit, records):
    """Breaks the unit's inputs on disk; returns what the manifest says of its model and records."""
    kind, first = unit["broken"], records[0]
    if kind == "no record":
        return "model.yaml", records[:-1] + [first.replace(".csv", "-lost.csv")]
    if kind == "no model":
        return "lost.yaml", records
    broken = first.replace(".csv", "-broken.csv")
    with open(first, encoding="utf-8") as stream:
        lines = stream.read().splitlines()
    rows = [k for k, line in enumerate(lines) if line and line[0] != "#"]
    if kind == "a record that is no record":
        lines = ["<html>not found</html>"]
    elif kind == "a record that is cut":
        lines = lines[:rows[1]]
    elif kind == "NaN":
        lines[rows[len(rows) // 2]] = "nan,nan,nan,nan"
    else:
        at = lines[rows[0]].split(",").index("hammer_N")
        for k in rows[1:]:
            cells = lines[k].split(",")
            lines[k] = ",".join(cells[:at] + ["0"] + cells[at + 1:])
    with open(broken, "w", encoding="utf-8") as stream:
        stream.write("\n".join(lines) + "\n")
    return "model.yaml", [broken]


def make(unit, options):
    folder = os.path.join(options.directory, "records")
    paths = []
    for k, kind in enumerate(("soft", "hard", "check")[:options.records]):
        path = os.path.join(folder, "%s-%s" % (unit["unit"], kind))
        text = spec(unit, k, options)
        paths.append(path + ".csv")
        if os.path.exists(path + ".csv") and os.path.exists(path + ".txt"):
            with open(path + ".txt", encoding="utf-8") as stream:
                if stream.read() == text:
                    continue
        with open(path + ".txt", "w", encoding="utf-8") as stream:
            stream.write(text)
        subprocess.run([os.path.join(options.build, "beam_truth"), path + ".txt", "-o", folder], check=True,
                       stdout=subprocess.DEVNULL)
    checks = paths[2:]
    model, records = spoil(unit, paths[:2]) if unit["broken"] else ("model.yaml", paths[:2])
    near = [os.path.relpath(path, options.directory) for path in records]
    return "%s,%s,%s,%s,%s,%s" % (unit["unit"], model, " ".join(near),
                                  " ".join(os.path.relpath(path, options.directory) for path in checks),
                                  unit["temperature_C"], unit["date"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("directory")
    parser.add_argument("--build", default="build")
    parser.add_argument("--units", type=int, default=40)
    parser.add_argument("--hidden", type=int, default=0)
    parser.add_argument("--broken", type=int, default=0)
    parser.add_argument("--records", type=int, default=3, choices=(1, 2, 3), help="a unit: one or two fitted, one held out")
    parser.add_argument("--duration", type=float, default=3.0, help="seconds a record")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--board", action="store_true", help="the model says what a board is wired to")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    os.makedirs(os.path.join(options.directory, "records"), exist_ok=True)
    units = draw(options)
    with ThreadPoolExecutor(options.jobs) as pool:
        lines = list(pool.map(lambda unit: make(unit, options), units))
    with open(os.path.join(options.directory, "model.yaml"), "w", encoding="utf-8") as stream:
        stream.write(MODEL % (BOARD if options.board else ""))
    with open(os.path.join(options.directory, "units.csv"), "w", encoding="utf-8") as stream:
        stream.write("unit,model,records,checks,temperature_C,date\n" + "\n".join(lines) + "\n")
    with open(os.path.join(options.directory, "truth.json"), "w", encoding="utf-8") as stream:
        json.dump({"drawn": DRAWN, "correlated": CORRELATED, "drift": DRIFT, "units": units}, stream, indent=1)


if __name__ == "__main__":
    main()
