# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated product board as a process: a pseudo terminal outside, the plant or a record at its converter."""
import json
import os
import re
import subprocess
import time

import emulator
from emulator import in_build

CROSS = os.environ.get("CROSS", "arm-none-eabi-")


def symbols(path):
    """name -> (address, bytes)"""
    text = subprocess.run([CROSS + "nm", "-S", path], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in text.splitlines()]
    return {row[3]: (int(row[0], 16), int(row[1], 16)) for row in rows if len(row) == 4}


def address_of(path, name):
    """Of a symbol with or without a size."""
    text = subprocess.run([CROSS + "nm", path], capture_output=True, text=True, check=True).stdout
    return int(re.search(rf"^([0-9a-f]+) \S {name}$", text, re.M)[1], 16)


def live_address(build):
    """Where the STM32's firmware keeps struct beam_live."""
    return (symbols(in_build(build, "firmware_stm32f405.elf"))["app"][0] +
            symbols(in_build(build, "arm", "layout.o"))["layout_live_offset"][1])


def returns_of(elf, function):
    """Addresses of the instructions by which a function returns."""
    text = subprocess.run([CROSS + "objdump", "-d", "--no-show-raw-insn", f"--disassemble={function}", elf],
                          capture_output=True, text=True, check=True).stdout
    return [int(m[1], 16) for m in re.finditer(r"^\s*([0-9a-f]+):\s+(?:bx\s+lr|ldmia\.w\s+sp!.*pc|pop\S*\s.*pc)", text, re.M)]


class Process:
    """Something that is started, and ended by its own process id."""

    def __init__(self, arguments, output):
        self.output = output
        with open(output, "wb") as file:
            self.process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT)

    def wait_for(self, pattern, timeout_s=20):
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            with open(self.output, encoding="utf-8", errors="replace") as file:
                found = re.search(pattern, file.read())
            if found:
                return found
            if self.process.poll() is not None:
                break
            time.sleep(0.02)
        raise subprocess.SubprocessError(f"{pattern!r} did not come: {open(self.output, errors='replace').read()[-500:]}")

    def end(self):
        """Ask, so that a last report comes; then insist: QEMU may be deaf to it."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self.process.kill()
        return self.process.wait()


class Served(Process):
    """A board under its firmware behind a pseudo terminal."""

    def __init__(self, build, folder, arguments):
        self.build, self.folder = build, folder
        super().__init__(arguments, os.path.join(folder, "board.log"))
        self.port = self.wait_for(r"redirected to (/dev/pts/\d+)")[1]

    def beamfit(self, *arguments, timeout_s=120):
        done = subprocess.run([in_build(self.build, "beamfit"), *arguments], capture_output=True, text=True,
                              timeout=timeout_s, check=False, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise subprocess.SubprocessError(f"beamfit {' '.join(arguments)}: status {done.returncode}: {done.stderr}")
        return done.stdout

    def insist(self, *arguments, tries=4):
        """beamfit(), again when the line failed: to a board whose time runs fast, a pause of this machine is a gap in a frame."""
        for left in reversed(range(tries)):
            try:
                return self.beamfit(*arguments)
            except subprocess.SubprocessError:
                if left == 0 or self.process.poll() is not None:
                    raise

    def info(self):
        return json.loads(self.insist("info", "--port", self.port, "--json"))

    def report(self):
        return open(self.output, encoding="utf-8", errors="replace").read()


def make_key(folder, name="key.txt"):
    """The board's secret, as its bytes and as the file that beamfit reads, which is kept when it is there; the second name."""
    secret, text = os.urandom(32), os.path.join(folder, name)
    if os.path.exists(text):
        with open(text, encoding="ascii") as file:
            return bytes.fromhex(file.read()), text
    with open(os.open(text, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="ascii") as file:
        file.write(secret.hex() + "\n")
    return secret, text


class Board(Served):
    """The STM32F405; plugin: further NAME=VALUE options; shift: 2^shift ns an instruction; plant: what the truth simulates."""

    def __init__(self, build, folder, plugin=(), shift=3, plant=None, two_keys=False):
        self.key = os.path.join(folder, "key.bin")
        secret, self.key_text = make_key(folder)
        with open(self.key, "wb") as file:  # the sector of keys: what signs, then what unlocks
            file.write(secret)
            if two_keys:
                unlocking, self.unlock_text = make_key(folder, "unlock.txt")
                file.write(unlocking)
        self.plant = None
        plugin = [f"flash={os.path.join(folder, 'flash.bin')}", *plugin]
        if plant is not None:
            path = os.path.join(folder, "plant.socket")
            self.plant = Process([in_build(build, "beam_truth"), "--live", plant, "--socket", path],
                                 os.path.join(folder, "plant.log"))
            while not os.path.exists(path):
                if self.plant.process.poll() is not None:
                    raise subprocess.SubprocessError(f"no plant: {open(self.plant.output, errors='replace').read()}")
                time.sleep(0.02)
            plugin.append(f"plant={path}")
        arguments = emulator.product(build, in_build(build, "firmware_stm32f405.elf"), self.key, plugin, "-serial", "pty")
        arguments[arguments.index("shift=3,sleep=off")] = f"shift={shift},sleep=off"
        super().__init__(build, folder, arguments)

    def end(self):
        status = super().end()
        if self.plant is not None:
            self.plant.end()
        return status
