# SPDX-License-Identifier: GPL-3.0-or-later
"""QEMU as the tests need it: command lines, time limits, what its version can do."""
import os
import re
import subprocess

QEMU = "qemu-system-arm"
CASES_AT = {"netduinoplus2": 0x08080000, "mps2-an386": 0x21800000}
CLOCK_HZ = 168e6


def version():
    """(major, minor) of the emulator, or None when there is none."""
    try:
        text = subprocess.run([QEMU, "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    found = re.search(r"version (\d+)\.(\d+)", text)
    return (int(found[1]), int(found[2])) if found else None


def command(board, elf, *options):
    # a storm of timers makes QEMU deaf to SIGTERM: callers kill it by its process id
    return [QEMU, "-M", board, "-display", "none", "-monitor", "none", "-kernel", elf, *options]


def semihosted(board, elf, cases, *options, timeout_s=300):
    """Run a test program to its end; (exit status, standard output)."""
    done = subprocess.run(
        command(board, elf, "-serial", "null", "-semihosting-config", "enable=on,target=native",
                *(["-device", f"loader,file={cases},addr={CASES_AT[board]:#x},force-raw=on"] if cases else []), *options),
        capture_output=True, text=True, timeout=timeout_s, check=False, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout + (done.stderr if done.returncode else "")


def in_build(build, *names):
    return os.path.join(build, *names)


WAKEFUL = ("-device", "loader,addr=0x2001FF00,data=0x5EED,data-len=4")  # no sleep: virtual time would stand still
KEY_AT = 0x08010000
POWER_FAILED = 77


def product(build, elf, key, plugin, *options):
    """The STM32F405 with its devices; plugin: options of tests/target/plugin, as NAME=VALUE."""
    so = in_build(build, "stm32f405.so")
    return command("netduinoplus2", elf, "-icount", "shift=3,sleep=off", *WAKEFUL,
                   "-device", f"loader,file={key},addr={KEY_AT:#x},force-raw=on",
                   "-plugin", ",".join([so, *plugin]), *options)


def run(arguments, timeout_s=600):
    """Run an emulator to its end: (exit status, standard output, standard error)."""
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=timeout_s, check=False, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout, done.stderr


def has_plugin_board(build):
    """Can the emulated product board run here? It needs QEMU 7.2 and says so loudly when there is another."""
    if version() == (7, 2):
        return True
    print(f"  SKIPPED: the plugin is made for QEMU 7.2, this is {version()}; the mps2 board is tested all the same")
    return False
