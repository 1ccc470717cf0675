# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests of run.py that need no firmware: lib/ on the boards' processors, its bits and its instructions."""
import os
import re
import subprocess

import emulator
from checks import check
from emulator import in_build

LINEAR_GOAL = 330  # instructions of a linear step of ten blocks; GCC's own loop takes 365
UNITS_QUICK = ["beam_assemble", "beam_dense", "beam_image", "beam_image_check", "beam_image_pack", "beam_narrow", "beam_poles", "effects"]
# Not beam_factor, whose reference is long double, no more than double here; nor effects_derivatives, for which newlib's
# complex tanh overflows.
UNITS_SLOW = ["beam_chain", "beam_check", "beam_law", "beam_math", "beam_newmark", "beam_step", "effects_laws"]
STEP_BOUND = 30_000  # of a step with any effects: 18 % of 1 kHz at 168 MHz
REPLAY_STEPS, EFFECT_STEPS = 200_000, 10_000


def replay_lines(text):
    """name -> (what must be equal, [mean, largest instructions])"""
    rows = {}
    for line in text.splitlines():
        word = line.split()
        check(len(word) >= 5, f"not a line of replay_run: {line!r}")
        rows[word[0]] = (word[1:5], [int(w) for w in word[5:]])
    return rows


def replay(build, steps, effect_steps):
    cases = in_build(build, "replay_cases.bin")
    subprocess.run([in_build(build, "replay_cases"), cases, str(steps), str(effect_steps)], check=True,
                   stderr=subprocess.DEVNULL)
    host = subprocess.run([in_build(build, "replay_run"), cases], check=True, capture_output=True, text=True).stdout
    return cases, replay_lines(host)


def test_bits(build):
    """Host and boards compute the same bits: linear, every effect that a plan can carry, several at once."""
    cases, host = replay(build, REPLAY_STEPS, EFFECT_STEPS)
    check(len(host) >= 30, "too few cases")
    for board in emulator.CASES_AT:
        status, text = emulator.semihosted(board, in_build(build, f"target_{board}_replay.elf"), cases)
        check(status == 0, f"{board}: status {status}: {text}")
        target = replay_lines(text)
        differ = [name for name in host if name not in target or target[name][0] != host[name][0]]
        check(not differ and len(target) == len(host), f"{board} and host differ: {differ}")
        samples = sum(int(row[0][0]) for row in host.values())
        print(f"  {board}: {len(host)} models, {samples} samples, all outputs equal bit for bit")


def test_counts(build):
    """Instructions of one step, counted by the emulator; the linear model within its goal."""
    cases, host = replay(build, 2000, 2000)
    status, text = emulator.semihosted("netduinoplus2", in_build(build, "target_netduinoplus2_replay.elf"), cases,
                                       "-icount", "shift=0,sleep=off")
    check(status == 0, f"status {status}: {text}")
    rows = replay_lines(text)
    check([rows[n][0] for n in rows] == [host[n][0] for n in host], "counted run and host differ")
    linear = rows["linear"][1][1]
    print("  instructions a step      mean   largest   beyond linear   largest of 1 kHz   of 10 kHz (168 MHz)")
    for name, (_, (mean, worst)) in rows.items():
        print(f"  {name:22s} {mean:7d} {worst:9d} {mean - linear:15d} {worst * 1e3 / emulator.CLOCK_HZ:18.2%}"
              f" {worst * 1e4 / emulator.CLOCK_HZ:11.2%}")
    worst = max(row[1][1] for row in rows.values())
    check(worst <= STEP_BOUND, f"a step takes {worst} instructions, the bound is {STEP_BOUND}")
    check(linear <= LINEAR_GOAL, f"the linear step takes {linear} instructions, the goal is {LINEAR_GOAL}")


def test_costs(build):
    """What a step may take at most: the costliest calls of effects, and plans whose laws never settle, beside the bound."""
    status, text = emulator.semihosted("netduinoplus2", in_build(build, "target_costs.elf"), None, "-icount", "shift=0,sleep=off")
    check(status == 0, f"status {status}: {text}")
    rows = [line.split() for line in text.splitlines()]
    calls = [(name, int(stated), int(counted)) for kind, name, stated, counted in rows if kind == "call"]
    steps = [(name, int(bound), int(counted)) for kind, name, bound, counted in rows if kind == "step"]
    check(len(calls) >= 16 and len(steps) >= 30, f"too little was counted: {text}")
    for name, stated, counted in [*calls, *steps]:
        check(counted <= stated, f"{name} takes {counted} instructions, stated are {stated}")
        check(stated <= 1.35 * counted + 300, f"{name} takes {counted} instructions, {stated} is no useful bound")
    tight = [counted / bound for _, bound, counted in steps]
    print(f"  {len(calls)} effects' calls within what they state; {len(steps)} plans take {min(tight):.0%} to {max(tight):.0%} of "
          f"their bounds; {steps[-1][1]} for a law of 100 evaluations")
    for name in ("tracking_1", "tracking_3", "laws_1_evaluations_16", "laws_3_evaluations_16", "laws_6_evaluations_16", "laws_8_evaluations_16"):
        _, bound, counted = next(row for row in steps if row[0] == name)
        print(f"  {name:24s} bound {bound:7d}, counted {counted:7d}")


def test_units(build):
    """Unit tests of lib/ on the mps2 board, double in software; FULL=1: also those that take minutes."""
    names = UNITS_QUICK + (UNITS_SLOW if os.environ.get("FULL") else [])
    passed = 0
    for name in names:
        elf = in_build(build, f"target_unit_test_{name}.elf")
        status, text = emulator.semihosted("mps2-an386", elf, None, timeout_s=1800)
        done = len(re.findall(r"^passed ", text, re.M))
        check(status == 0 and done > 0, f"{name}: status {status}: {text[-500:]}")
        passed += done
    print(f"  {len(names)} programs of tests/unit, {passed} tests passed")
