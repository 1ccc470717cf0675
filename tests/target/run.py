#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""run.py --build DIR [NAME...]: the tests on emulated boards; every test prints what it counted. Status 1: one failed."""
import argparse
import os
import subprocess
import sys
import time

import emulator
import power
from emulator import in_build

LINEAR_GOAL = 2 * 217  # instructions: twice what eleven bare 2x2 blocks take at -O2
CUT_EVERY = 1 if os.environ.get("FULL") else 12  # operations of a store
REPLAY_STEPS, EFFECT_STEPS = 200_000, 10_000


class Failure(Exception):
    pass


def check(good, text):
    if not good:
        raise Failure(text)


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
    check(linear <= LINEAR_GOAL, f"the linear step takes {linear} instructions, the goal is {LINEAR_GOAL}")


def test_power(build):
    """Power cut inside operations on the emulated STM32's flash, words and erases; FULL=1 takes every operation."""
    if not emulator.has_plugin_board(build):
        return
    chains = power.power_cuts(build, CUT_EVERY)
    lost = [text for c in chains for text in c.lost]
    total = {n: sum(getattr(c, n) for c in chains) for n in ("lives", "cuts", "words", "erases", "kept", "taken")}
    check(not lost, f"{len(lost)} lost, first: {lost[:1]}")
    check(total["cuts"] > 100 and total["words"] > 50 and total["erases"] > 0, f"too little was cut: {total}")
    print(f"  {total['lives']} lives, {total['cuts']} cuts ({total['words']} inside words, {total['erases']} inside sector "
          f"erases): the old image {total['kept']} times, the new one {total['taken']} times, lost 0")


def main():
    tests = {name[5:]: test for name, test in globals().items() if name.startswith("test_")}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("name", nargs="*", choices=[[], *tests], help="of a test")
    arguments = parser.parse_args()
    if emulator.version() is None:
        print("target: qemu-system-arm is not installed: tools/deps.sh target", file=sys.stderr)
        return 1
    failed = 0
    for name in arguments.name or tests:
        print(f"{name}: {tests[name].__doc__}", flush=True)
        begin = time.monotonic()
        try:
            tests[name](arguments.build)
            print(f"  ok ({time.monotonic() - begin:.1f} s)", flush=True)
        except (Failure, subprocess.SubprocessError) as error:
            failed += 1
            print(f"  FAILED: {error}", flush=True)
    print(f"target: {failed} failed" if failed else "target: all passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
