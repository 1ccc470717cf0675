# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws subtle cases that nobody has seen: docs/hidden.md, 'Drawn cases'. One for each single effect, in the form of data/hidden.

Beam, rig, places and strength are functions of the seed. The strength is sought until the program's own fit of the handbook model
leaves 1.25 to 1.75 times the noise.
"""

import argparse
import math
import os
import random
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import cases as hidden
import run

WEAKEST, STRONGEST = 1.25, 1.75  # times the noise, of the baseline
TRIALS, BEAMS = 9, 4  # strengths tried for a beam; beams tried for an effect
LENGTH_PART = (0.25, 0.95)  # of a place, in lengths


def draw_beam(dice, like, everything):
    """The numbers of a beam between the smallest and the largest of all cases on the same rig."""
    same = [case.beam for case in everything if case.rig.name == like.rig.name]
    beam = {}
    for key in like.beam:
        values = [float(one[key]) for one in same if key in one]
        beam[key] = "%.6g" % math.exp(dice.uniform(math.log(min(values)), math.log(max(values))))
    beam["seed"] = str(dice.randrange(200000, 20000000))
    return beam


def vary(dice, line, length_m, common):
    """An effect's line with other places, times and phases; its first number, the strength, stays."""
    words = line.split()
    numbers = [k for k, word in enumerate(words) if "=" in word and not word.startswith("channel=")]
    for k in numbers[1:]:
        name, value = words[k].split("=")
        if name == "at_m":
            drawn = common.setdefault(name, length_m * dice.uniform(*LENGTH_PART))
        elif name == "phase_rad":
            drawn = dice.uniform(0, 2 * math.pi)
        elif name == "frequency_Hz":
            drawn = float(value) * common.setdefault(name, dice.uniform(0.999, 1.001))  # a mains is 50 or 60 Hz
        else:
            drawn = float(value) * common.setdefault(name, math.exp(dice.uniform(-0.5, 0.5)))
        words[k] = "%s=%.4g" % (name, drawn) if name != "frequency_Hz" else "%s=%.6g" % (name, drawn)
    return " ".join(words)


def scaled(line, factor):
    """The line with its strength times factor."""
    words = line.split()
    k = next(k for k, word in enumerate(words) if "=" in word and not word.startswith("channel="))
    name, value = words[k].split("=")
    words[k] = "%s=%.4g" % (name, float(value) * factor)
    return " ".join(words)


def draw_case(dice, name, effect, everything):
    """A case at the strength of the one that it is drawn from."""
    like = dice.choice([case for case in everything if case.truth == [effect] and case.strength in ("plain", "subtle")])
    case = hidden.Case(name, like.rig, draw_beam(dice, like, everything))
    case.strength, case.truth = "subtle", [effect]
    length_m = next(float(line.split()[1]) for line in like.rig.common if line.startswith("length_m "))
    common = {}
    case.hidden = [(records, vary(dice, line, length_m, common)) for records, line in like.hidden]
    return case


def baseline(case, build, directory):
    """Times the noise that the fitted handbook model leaves; NaN: it cannot be fitted."""
    hidden.make_records(case, os.path.join(build, "beam_truth"), directory, hidden.simulator_hash())
    command = [os.path.join(build, "beamfit"), "fit", os.path.join(directory, "model.yaml")]
    command += hidden.record_files(directory, "train") + ["-o", os.path.join(directory, "fitted.yaml"), "--force", "--no-search", "--json"]
    answer, _, _ = run.call(command, 300)
    return math.nan if answer is None else answer["noise_ratio"]


def next_factor(tried, goal):
    """From [(factor, excess power)]: a straight line in logarithms through the two nearest the goal."""
    tried = sorted(tried, key=lambda one: abs(math.log(one[1] / goal)))
    (f0, e0), (f1, e1) = tried[0], tried[1] if len(tried) > 1 else (tried[0][0] * 2, tried[0][1] * 4)
    slope = math.log(e1 / e0) / math.log(f1 / f0)
    step = math.log(goal / e0) / slope if abs(slope) > 0.1 else 0.7
    return f0 * math.exp(max(-1.6, min(1.6, step)))


def settle_strength(case, goal, build, directory):
    """Scales the strength until the baseline leaves what it should; the ratio, or None."""
    start, tried, factor = case.hidden, [], 1.0
    for _ in range(TRIALS):
        case.hidden = [(records, scaled(line, factor)) for records, line in start]
        ratio = baseline(case, build, directory)
        if math.isnan(ratio):
            return None
        if WEAKEST <= ratio <= STRONGEST:
            return ratio
        tried.append((factor, max(ratio * ratio - 1, 0.01)))
        factor = next_factor(tried, goal) if len(tried) > 1 else factor * (0.7 if ratio > STRONGEST else 1.4)
    return None


def draw(number, effect, options, everything):
    """(case or None, ratio)"""
    dice = random.Random("beamfit drawn case %d %s" % (options.seed, effect))
    for _ in range(BEAMS):
        case = draw_case(dice, "d%d%02d" % (options.seed, number), effect, everything)
        ratio_goal = dice.uniform(1.3, 1.7)
        with tempfile.TemporaryDirectory() as scratch:
            try:
                ratio = settle_strength(case, ratio_goal ** 2 - 1, options.build, scratch)
            except SystemExit:  # the simulator refuses: an unphysical strength
                ratio = None
        if ratio is not None:
            return case, ratio
    return None, math.nan


def write(drawn, directory):
    """cases.txt and answers.txt as read_cases() takes them."""
    os.makedirs(directory, exist_ok=True)
    keys = list(dict.fromkeys(key for case, _ in drawn for key in case.beam))
    with open(os.path.join(directory, "cases.txt"), "w", encoding="utf-8") as stream:
        print("case rig " + " ".join(keys), file=stream)
        for case, _ in drawn:
            print(case.name, case.rig.name, *(case.beam.get(key, "-") for key in keys), file=stream)
    with open(os.path.join(directory, "answers.txt"), "w", encoding="utf-8") as stream:
        for case, ratio in drawn:
            print("%s subtle %s # %.2f times the noise" % (case.name, case.truth[0], ratio), file=stream)
            for records, line in case.hidden:
                print("    " + (",".join(records) + ": " if records else "") + line, file=stream)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build", help="directory with beamfit and beam_truth")
    parser.add_argument("--jobs", type=int, default=2, help="effects at once")
    parser.add_argument("seed", type=int)
    parser.add_argument("directory", help="receives cases.txt and answers.txt")
    options = parser.parse_args()
    everything = hidden.read_cases()
    effects = sorted({case.truth[0] for case in everything if case.strength in ("plain", "subtle")})
    shutil.rmtree(options.directory, ignore_errors=True)
    with ThreadPoolExecutor(options.jobs) as pool:
        drawn = list(pool.map(lambda item: draw(item[0], item[1], options, everything), enumerate(effects, 1)))
    for effect, (case, ratio) in zip(effects, drawn):
        print("%-22s %s" % (effect, "%s on %s, %.2f times the noise" % (case.name, case.rig.name, ratio) if case else "no strength found"))
    write([item for item in drawn if item[0]], options.directory)
    return 0


if __name__ == "__main__":
    sys.exit(main())
