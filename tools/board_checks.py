#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""board_checks.py BUILD — what an independent review found of the board, attack by attack: what it saw then, the test that shows it, and what
that test says now. Every test named is run here; its printed figures are copied. Status 1: one failed, or a test named is not there."""

import os
import re
import subprocess
import sys

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
# subject: [(attack or measurement, what the review saw, program, test or None: all of it)]; program: a unit or system test, or target:NAME
CHECKS = {
    "Time that nothing can hide": [
        ("a sector is erased while the board samples: conversions that were missed, counted from a timer", "+0",
         "target:stall", None),
        ("the driver alone: samples as many as were due by the board's time, also during an erase", "no such test", "target:driver", None),
        ("erases happen before sampling where that can be", "during sampling", "test_firmware_store", "test_erases_before_sampling"),
        ("the board on the PC says that it misses none", "said nothing", "test_board_host", "test_command_line")],
    "A bound per image": [
        ("laws whose bound does not fit: refused by the board, the largest that is taken misses nothing", "413 of 22 776 samples missed",
         "target:deadline", None),
        ("counted instructions beside the bound of every plan and effect", "documented 30 000, three laws 30 217, six 74 635",
         "target:costs", None),
        ("export at 10 kHz: coulomb friction with a cubic spring; a plan for another clock", "taken", "test_target_image",
         "a_step_that_may_not_fit_is_refused"),
        ("the board refuses a step above its budget", "taken", "test_firmware_pages", "test_bound"),
        ("a step of the proof run that does not fit", "taken", "test_firmware_pages", "test_slow_model"),
        ("the proof run's longest step is reported", "not measured", "test_firmware_pages", "test_longest_step")],
    "Sensor health": [
        ("converter stuck", "ratio 0.50, taken for a model that is right", "test_firmware_health", "test_stuck"),
        ("wire off", "ratio 0.00, taken for a model that is perfect", "test_firmware_health", "test_quiet"),
        ("clipped", "not said apart", "test_firmware_health", "test_at_end"),
        ("offset", "a wrong model", "test_firmware_health", "test_offset"),
        ("white noise: neither a fault nor an alarm", "0 in 10^6", "test_firmware_health", "test_noise_raises_nothing"),
        ("a wrong model is no fault of the sensor", "", "test_firmware_health", "test_wrong_model")],
    "An alarm that acts": [
        ("a client without the key puts the model to rest again and again", "11 of 1410 samples alarmed at 19.8 x the noise",
         "test_firmware_guard", "test_nobody_silences_the_alarm_without_the_key"),
        ("a client without the key drives", "codes 1 to 4095", "test_firmware_guard", "test_nobody_drives_without_the_key"),
        ("a session that ends", "the drive went on", "test_firmware_guard", "test_a_drive_ends_with_its_session"),
        ("a client that falls silent", "the drive went on", "test_firmware_guard", "test_dead_man"),
        ("latch with time and count, over a reconnect", "none", "test_firmware_guard", "test_latch"),
        ("pin and XCP event", "none", "test_firmware_guard", "test_pin_and_event"),
        ("starts and their causes", "none", "test_firmware_guard", "test_starts_are_counted"),
        ("a converter that dies, a pointer that is spoilt: watchdog and fault start it again", "it stood still", "target:resets", None)],
    "An observer": [
        ("switched on while the beam moves", "'model wrong' for 3 to 59 s", "test_firmware_observer", "a_beam_that_moves_at_power_on"),
        ("touched", "'model wrong' for 3 to 59 s", "test_firmware_observer", "a_beam_that_is_touched"),
        ("offset of six codes", "'model wrong' for ever", "test_firmware_observer", "an_offset_of_the_sensor"),
        ("a model that is wrong", "alarm", "test_firmware_observer", "a_wrong_model"),
        ("noise", "", "test_firmware_observer", "noise_raises_nothing"),
        ("every sample of the emulated product computed again, observer included", "", "target:product", None)],
    "Tracking": [
        ("the truth's beam grows heavier during a run", "no tracking", "test_firmware_track", "a_mass_that_grows"),
        ("the same on the emulated product", "no tracking", "target:tracking", None),
        ("not a bit of what the model says changes", "", "test_firmware_track", "the_beam_of_the_model"),
        ("bounded", "", "test_firmware_track", "nothing_leaves_its_limits"),
        ("noise teaches nothing", "", "test_firmware_track", "noise_teaches_nothing")],
    "Limits for key holders too": [
        ("1e38, 1e-45, infinity, denormals in any field: the board's check", "taken", "test_beam_image", "absurd_numbers"),
        ("setups out of range", "taken", "test_beam_image", "setups_out_of_range"),
        ("the same given to export", "taken", "test_export", "mistakes_on_the_command_line"),
        ("denormals flushed, another rounding: refused before the proof run", "first other bit at step 53 901, the proof run passed", "test_beam_image",
         "another_arithmetic_is_refused"),
        ("a wrong key: DISCONNECTED, and a delay", "stayed connected", "test_firmware_xcp", "test_seed_and_key"),
        ("each wrong key doubles the wait, a CONNECT does not shorten it", "", "test_firmware_xcp", "test_delay_after_wrong_key")],
    "The library alone": [
        ("make install, then strangers' programs: pkg-config for float and double, extern \"C\", CMake and Makefile fragment, the bare Cortex-M4 example",
         "none of it", "test_install", "the_library_alone"),
        ("install, use, uninstall", "", "test_install", "install_use_uninstall")],
    "Porting kit": [
        ("two core families, a Cortex-M7 in one folder of its own: downloads to a board that is killed", "one family", "target:port", None),
        ("one key unlocks, another signs", "one key for both", "target:roles", None),
        ("one key unlocks, another signs, on the PC", "one key for both", "test_firmware_guard", "test_two_keys")],
}


def run_all(build, program):
    """(lines, tests that passed or None where the program is one test)"""
    if program.startswith("target:"):
        command = [sys.executable, "-B", "tests/target/run.py", "--build", build, program[7:]]
    else:
        folder = "system" if os.path.exists(f"tests/system/{program}.c") else "tests"
        command = [f"{build}/{folder}/{program}"]
    environment = {**os.environ, "TOP": TOP, "BEAMFIT": os.path.abspath(f"{build}/beamfit"), "OPENBLAS_NUM_THREADS": "1"}
    environment.setdefault("BEAMFIT_SHARED", os.path.join(TOP, "..", "shared"))
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, stdin=subprocess.DEVNULL)
    return done.stdout.splitlines(), done.returncode


def of_test(lines, status, test):
    """(passed, the figures that this test printed)"""
    if test is None:
        return status == 0, [line.strip() for line in lines[1:] if line.startswith("  ")]
    said, inside, passed = [], False, False
    for line in lines:
        found = re.match(r"\[ +(RUN|OK|FAILED) +\] (?:\S+: )?(\w+)", line)
        if found and found[2] == test:
            inside, passed = found[1] == "RUN", passed or found[1] == "OK"
        elif inside and not line.startswith("["):
            said.append(line.strip())
    return passed, said


def main():
    build = sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__)
    os.chdir(TOP)
    ran, failed, number = {}, 0, 0
    for subject, checks in CHECKS.items():
        number += 1
        print(f"{number}. {subject}")
        for attack, before, program, test in checks:
            if program not in ran:
                ran[program] = run_all(build, program)
            passed, said = of_test(*ran[program], test)
            failed += not passed
            name = f"make target NAMES={program[7:]}" if test is None else f"{program}: {test}"
            print(f"   {'passed' if passed else 'FAILED'}  {attack}\n           {name}" + (f"; before: {before}" if before else ""))
            for line in said:
                print(f"           | {line[:180]}")
            sys.stdout.flush()
        print()
    print("10. Conformance by virtual time: make conformance BOARD=stm32f405 LOAD=0.8, results/conformance.md")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
