#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""wrong_inputs.py BUILD [CASE...] — a good hammer test, spoilt in one way after the other, and what fit, compare and diagnose say of it.

The beam is that of data/laboratory without its tip mass, simulated; the model knows it to a few per cent. What the three commands say alike
stands once."""

import json
import math
import os
import random
import subprocess
import sys
import tempfile
import textwrap

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MODEL = """format: beamfit-model/1
beam: {length_m: 0.35}
parameters:
  EI_beam_Nm2: {value: 53.4, prior: 0.05}
  rho_beam_kgpm: {value: 0.981, prior: 0.02}
  cDI_beam_sNm2: 1e-4
  gamma_sNpm2: 1
inputs: {hammer_N: {kind: point_force, at_m: 0.30}}
outputs:
  accel_mps2: {kind: acceleration, at_m: 0.28}
  laser_mps: {kind: velocity, at_m: 0.20}
"""
RATE = 2048
HIT = int(0.1 * RATE)  # sample of its begin
LASTS = 5  # samples
CASES = []  # (name, what is wrong, function)


def case(what):
    """A function that spoils a record (its columns by name) is one case; it returns options of the run, or nothing."""
    def keep(function):
        CASES.append((function.__name__, what, function))
        return function
    return keep


@case("nothing: the test as it should be")
def good(record):
    return {}


@case("the accelerometer is screwed on upside down")
def sign(record):
    record.scale("accel_mps2", -1)


@case("the hammer's sign is the other one, and so both answers disagree with it")
def sign_hammer(record):
    record.scale("hammer_N", -1)


@case("the accelerometer in g")
def in_g(record):
    record.scale("accel_mps2", 1 / 9.80665)


@case("the accelerometer in mV, at 10.2 mV/(m/s2)")
def in_mV(record):
    record.scale("accel_mps2", 10.2)


@case("the laser in mm/s")
def in_mm(record):
    record.scale("laser_mps", 1000)


@case("the force in mN")
def force_mN(record):
    record.scale("hammer_N", 1000)


@case("the times in ms")
def in_ms(record):
    record.scale("time_s", 1000)


@case("accelerometer and laser in each other's column")
def wrong_column(record):
    record.swap("accel_mps2", "laser_mps")


@case("hammer and accelerometer in each other's column")
def wrong_force(record):
    record.swap("hammer_N", "accel_mps2")


@case("hit at 0.20 m; the model says 0.30 m")
def wrong_place(record):
    return {"spec": ("hammer_N point_force at_m=0.30", "hammer_N point_force at_m=0.20")}


@case("hit at 0.12 m; the model says 0.30 m")
def far_place(record):
    return {"spec": ("hammer_N point_force at_m=0.30", "hammer_N point_force at_m=0.12")}


@case("the accelerometer sits at 0.15 m; the model says 0.28 m")
def wrong_sensor_place(record):
    return {"spec": ("accel_mps2 acceleration at_m=0.28", "accel_mps2 acceleration at_m=0.15")}


@case("a frequency response, its frequencies in the column time_s")
def response_as_time(record):
    f1, zeta, n = 34.0, 0.004, 801
    record.columns = {"time_s": [0.5 * k for k in range(n)], "hammer_N": [1.0] * n, "accel_mps2": [], "laser_mps": []}
    for f in record.columns["time_s"]:
        h = -f * f / (f1 * f1 - f * f + 2j * zeta * f * f1)
        record.columns["accel_mps2"].append(h.real)
        record.columns["laser_mps"].append(h.imag)


@case("the frequency response of an analyser (Frequency, Magnitude, Phase) given to import without --frequency")
def response_imported(record):
    f1, zeta = 34.0, 0.004
    lines = ["Frequency [Hz];Magnitude [dB];Phase [deg]"]
    for k in range(1, 801):
        h = -(0.5 * k) ** 2 / (f1 * f1 - (0.5 * k) ** 2 + 1j * zeta * k * f1)
        lines.append("%.1f;%.3f;%.3f" % (0.5 * k, 20 * math.log10(abs(h)), math.degrees(math.atan2(h.imag, h.real))))
    return {"import": "\n".join(lines) + "\n"}


@case("a double hit: the second, 40 ms later, has a fifth of the first's force; both were recorded")
def double_hit(record):
    return {"spec": ("signal hammer_N", "signal hammer_N raised_cosine start_s=0.14 width_s=0.002 level=8\nsignal hammer_N")}


@case("a double hit of which the force window took the second")
def hidden_hit(record):
    double_hit(record)
    return dict(double_hit(record), after=lambda r: window(r, HIT + 60))


@case("the accelerometer's recorder ends at a third of the largest value")
def clipped(record):
    top = max(abs(x) for x in record.columns["accel_mps2"]) / 3
    record.columns["accel_mps2"] = [min(max(x, -top), top) for x in record.columns["accel_mps2"]]


@case("the force's recorder ends at half of the hit")
def clipped_force(record):
    top = 0.5 * max(record.columns["hammer_N"])
    record.columns["hammer_N"] = [min(x, top) for x in record.columns["hammer_N"]]


def window(record, first):
    force = record.columns["hammer_N"]
    record.columns["hammer_N"] = force[:first] + [0.0] * (len(force) - first)


@case("a force window: exactly 0 after the hit")
def force_window(record):
    window(record, HIT + 2 * LASTS)


@case("an exponential window on all channels that nobody wrote down (time constant 0.4 s)")
def exponential_window(record):
    for name in ("hammer_N", "accel_mps2", "laser_mps"):
        record.columns[name] = [x * math.exp(-t / 0.4) for x, t in zip(record.columns[name], record.columns["time_s"])]


@case("the record ends in the middle of the hit")
def open_hit(record):
    record.cut(0, HIT + 3)


@case("the record ends in the middle of a second, later hit")
def second_open(record):
    force = record.columns["hammer_N"]
    for k in range(4):
        force[-4 + k] += (5, 17, 30, 38)[k]


@case("the record begins in the middle of the hit")
def begun_hit(record):
    record.cut(HIT + 2, None)


@case("hum of 50 Hz with its third harmonic in the accelerometer, from before the hit on")
def hum(record):
    for k, t in enumerate(record.columns["time_s"]):
        record.columns["accel_mps2"][k] += 2 * math.sin(2 * math.pi * 49.97 * t + 1) + 0.8 * math.sin(2 * math.pi * 149.91 * t)


@case("the hammer's channel was not connected: zero throughout")
def silent(record):
    record.scale("hammer_N", 0)


@case("the accelerometer was not connected: its recorder's noise")
def dead_sensor(record):
    dice = random.Random(5)
    record.columns["accel_mps2"] = [dice.gauss(0, 0.01) for _ in record.columns["accel_mps2"]]


@case("a sample is missing")
def missing(record):
    for name in record.columns:
        del record.columns[name][700]


@case("jittered time stamps, 20 % of the interval")
def jitter(record):
    dice = random.Random(3)
    record.columns["time_s"] = [t + dice.uniform(-0.1, 0.1) / RATE for t in record.columns["time_s"]]


class Record:
    """Columns of numbers by name, from a CSV of beam_truth."""

    def __init__(self, path):
        rows = [line.strip().split(",") for line in open(path) if not line.startswith("#")]
        self.columns = {name: [float(row[c]) for row in rows[1:]] for c, name in enumerate(rows[0])}
        dice = random.Random(1)  # a hammer at rest is never exactly 0
        self.columns["hammer_N"] = [u + dice.gauss(0, 0.01) for u in self.columns["hammer_N"]]

    def scale(self, name, factor):
        self.columns[name] = [factor * x for x in self.columns[name]]

    def swap(self, a, b):
        self.columns[a], self.columns[b] = self.columns[b], self.columns[a]

    def cut(self, first, last):
        self.columns = {name: x[first:last] for name, x in self.columns.items()}

    def write(self, path):
        with open(path, "w") as out:
            out.write(",".join(self.columns) + "\n")
            for row in zip(*self.columns.values()):
                out.write(",".join("%.10g" % x for x in row) + "\n")


class Bench:
    def __init__(self, build):
        self.build = os.path.abspath(build)
        self.simulated = {}

    def record(self, change):
        """The hit, simulated with one line of its specification changed."""
        if change not in self.simulated:
            with open(os.path.join(TOP, "data", "laboratory", "hit1.txt")) as source:
                text = "".join(line for line in source if not line.startswith("effect"))
            text = text if change is None else text.replace(*change)
            with open("hit.txt", "w") as out:
                out.write(text)
            subprocess.run([os.path.join(self.build, "beam_truth"), "hit.txt", "-o", "."], check=True, stdout=subprocess.DEVNULL)
            self.simulated[change] = "simulated%d.csv" % len(self.simulated)
            os.rename("hit.csv", self.simulated[change])
        return Record(self.simulated[change])

    def ask(self, *words):
        """Status and what is said beside numbers: sentences, in order."""
        done = subprocess.run([os.path.join(self.build, "beamfit"), *words], capture_output=True, text=True, check=False)
        said = []
        if "--json" in words and done.stdout.strip():
            answer = json.loads(done.stdout)
            said += ["record: " + one["text"] for one in answer.get("record_findings", [])]
            for one in answer.get("channel_factors", []):
                said.append("channel: " + one["text"] + (" In the model: " + one["line"] if one["line"] else ""))
            for one in answer.get("records", []):
                said += ["suspect: " + c["suspect"] for c in one.get("channels", []) if c.get("suspect")]
            if "verdict" in answer:
                said.append("verdict: " + answer["verdict"] + " " + " + ".join(answer["effects"]) + ", %.1f times the noise before"
                            % answer["noise_ratio_before"])
            elif "noise_ratio" in answer:
                said.append("(error %.3g %%, %.3g times the noise)" % (100 * answer["nrmse"], answer["noise_ratio"] or math.nan))
        for line in done.stderr.splitlines():
            if line.startswith("beamfit: "):
                said.append(line[len("beamfit: "):])
        return done.returncode, said

    def show(self, name, what, function):
        options = function(Record(self.simulated[None]) if None in self.simulated else self.record(None)) or {}
        record = self.record(options.get("spec"))
        function(record)
        if "after" in options:
            options["after"](record)
        record.write("hit.csv")
        print("\n%s" % (what[0].upper() + what[1:]))
        commands = {"fit": ("fit", "beam.yaml", "hit.csv", "-o", "fitted.yaml", "--force", "--json"),
                    "compare": ("compare", "beam.yaml", "hit.csv", "--json"),
                    "diagnose": ("diagnose", "beam.yaml", "hit.csv", "--json")}
        if "import" in options:
            with open("foreign.csv", "w") as out:
                out.write(options["import"])
            commands = {"import": ("import", "foreign.csv", "-o", "hit.csv", "--force")}
        before = []
        for command, words in commands.items():
            status, said = self.ask(*words)
            fresh = [text for text in said if text not in before]
            before += fresh
            print("    %s: status %d%s" % (command, status, "" if len(fresh) == len(said) else ", and what was said above"))
            for text in fresh:
                print(textwrap.fill(text, 150, initial_indent="      - ", subsequent_indent="        "))
        sys.stdout.flush()


def main():
    bench = Bench(sys.argv[1])
    wanted = sys.argv[2:]
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        with open("beam.yaml", "w") as out:
            out.write(MODEL)
        for name, what, function in CASES:
            if not wanted or name in wanted:
                bench.show(name, what, function)


if __name__ == "__main__":
    main()
