# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers of boards by themselves (tests/driver/driver_run.c): on the PC, on emulated boards, with the power cut anywhere; keys of two roles."""
import os
import subprocess
import tempfile
import board
import emulator
import power
from emulator import in_build

PC_CUT = 42
PASSED = "driver: all passed"


def life_on_pc(program, folder, cut):
    """Status and text of one life of the PC's board or of the template's part, whose flash is a file."""
    flash = os.path.join(folder, "flash")
    arguments = [program, flash, str(cut)]
    if program.endswith("host"):
        key = os.path.join(folder, "key")
        if not os.path.exists(key):
            with open(os.open(key, os.O_WRONLY | os.O_CREAT, 0o600), "wb") as file:
                file.write(os.urandom(32))
        arguments = [program, "--virtual", "--nvm", flash, "--key", key, *(["--power-cut", str(cut)] if cut else [])]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout + done.stderr


def life_on_f405(build, folder, cut):
    key = os.path.join(folder, "key")
    with open(key, "wb") as file:
        file.write(bytes(range(1, 33)))
    status, out, err = emulator.run(emulator.product(
        build, in_build(build, "target_driver_stm32f405.elf"), key, [f"flash={os.path.join(folder, 'flash')}", f"cut={cut}"],
        "-serial", "null", "-semihosting-config", "enable=on,target=native"))
    return (PC_CUT if status == emulator.POWER_FAILED else status), out + err


def life_on_mps2(build, folder, name, machine):
    memory = os.path.join(folder, "nv")
    if not os.path.exists(memory):
        power.mps2_memory(memory)
    status, out, err = emulator.run(power.mps2(in_build(build, f"target_driver_{name}.elf"), memory, "-serial", "null", "-semihosting-config",
                                               "enable=on,target=native", "-icount", "shift=3,sleep=off", machine=machine))
    return status, out + err


def lives(live, cuts):
    """A life without a cut, then one cut at each of these operations and one that must find everything in order. (lives, cuts that came, wrong)"""
    wrong, came = [], 0
    for cut in (0, *cuts):
        status, text = live(cut)
        came += status == PC_CUT
        if status not in (0, PC_CUT) or (status == 0 and PASSED not in text):
            wrong.append(f"cut {cut}: status {status}: {text[-300:]}")
        if cut and status == PC_CUT:
            status, text = live(0)
            if status != 0 or PASSED not in text:
                wrong.append(f"after cut {cut}: status {status}: {text[-300:]}")
    return 1 + 2 * len(cuts), came, wrong


def everywhere(build, every, on_boards):
    """Name, (lives, cuts, wrong) of each driver."""
    found = {}
    for program in ("driver_template", "driver_host"):
        with tempfile.TemporaryDirectory() as folder:
            found[program] = lives(lambda cut, p=in_build(build, program), f=folder: life_on_pc(p, f, cut), range(1, 6000, every))
    for name, machine in (("mps2", "mps2-an386"), ("an500", "mps2-an500")):
        with tempfile.TemporaryDirectory() as folder:
            found[name] = lives(lambda cut, n=name, m=machine, f=folder: life_on_mps2(build, f, n, m), ())
    if on_boards:
        with tempfile.TemporaryDirectory() as folder:
            found["stm32f405"] = lives(lambda cut, f=folder: life_on_f405(build, f, cut), range(5, 5000, 20 * every))
    return found


def roles(build):
    """One key unlocks, another signs, as provisioned in one sector: what each of them can do. A list of what went wrong."""
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        target = board.Board(build, folder, two_keys=True)
        image = os.path.join(folder, "model.img")
        port = ("--port", target.port)

        def expect(fine, what, *arguments):
            """With the right key and line a command is tried again; a refusal is one."""
            try:
                (target.insist if fine else target.beamfit)(*arguments)
                said = True
            except subprocess.SubprocessError:
                said = False
            if said != fine:
                wrong.append(what)
        try:
            target.beamfit("export", "data/live/model.yaml", "-o", image)
            expect(False, "the unlocking key signed", "download", image, *port, "--key", target.unlock_text)
            expect(False, "the signing key unlocked", "download", image, *port, "--key", target.key_text)
            if target.info()["counter"] != 0:
                wrong.append("a model was taken")
            expect(True, "both together were refused", "download", image, *port, "--key", target.unlock_text, "--signing-key", target.key_text)
            info = target.info()
            signed = os.path.join(folder, "signed.img")
            target.beamfit("export", "data/live/model.yaml", "-o", signed, "--key", target.key_text, "--device", info["device"], "--counter",
                           str(info["stored"] + 1))
            expect(True, "a signed image was refused to who can unlock", "download", signed, *port, "--key", target.unlock_text)
            if target.info()["counter"] != info["stored"] + 1:
                wrong.append("the signed model does not run")
            expect(True, "the latch was kept from who can unlock", "info", "--acknowledge", *port, "--key", target.unlock_text)
        finally:
            target.end()
    return wrong
