# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes of a test: the plant, the board on the PC, beamfit; and what disturbs the line between them."""
import os
import random
import select
import signal
import subprocess
import threading
import time
import tty

ENVIRONMENT = dict(os.environ, OPENBLAS_NUM_THREADS="1")


class Failed(Exception):
    """Something that had to work did not."""


def run(*command, expect=0, timeout_s=600):
    """Standard output of a program that must end with this status."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout_s,
                          env=ENVIRONMENT, check=False)
    if done.returncode != expect:
        raise Failed(f"{' '.join(map(str, command))}: status {done.returncode}, not {expect}\n{done.stdout}{done.stderr}")
    return done.stdout


def make_key(path, key=None):
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(key or os.urandom(32))
    return path


class Plant:
    def __init__(self, build, spec, directory):
        self.socket = os.path.join(directory, "plant")
        self.process = subprocess.Popen([f"{build}/beam_truth", "--live", spec, "--socket", self.socket],
                                        env=ENVIRONMENT)
        end = time.monotonic() + 60
        while not os.path.exists(self.socket):
            if self.process.poll() is not None or time.monotonic() > end:
                raise Failed(f"the plant of {spec} does not start")
            time.sleep(0.01)

    def stop(self):
        self.process.terminate()
        self.process.wait()


class Board:
    """build/board_host; options as on its command line. power_on() may follow kill()."""

    def __init__(self, build, *options):
        self.command = [f"{build}/board_host", *map(str, options)]
        self.process = None
        self.port = None

    def power_on(self, *more):
        self.process = subprocess.Popen([*self.command, *map(str, more)], stdout=subprocess.PIPE, text=True,
                                        env=ENVIRONMENT)
        for line in self.process.stdout:
            if line.startswith("port: "):
                self.port = line.split()[1]
            if line.startswith("READY"):
                return self
        raise Failed(f"{' '.join(self.command)}: ended with status {self.process.wait()} before READY")

    def kill(self, how=signal.SIGKILL):
        self.process.send_signal(how)
        self.wait()

    def wait(self, timeout_s=60):
        self.process.stdout.close()
        return self.process.wait(timeout_s)


class Product:
    """The product's firmware on QEMU 7.2 with the devices of tests/target/plugin, in virtual time."""

    def __init__(self, build, key, flash):
        self.command = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial",
                        "pty", "-icount", "shift=3,sleep=off", "-device", "loader,addr=0x2001FF00,data=0x5EED,data-len=4",
                        "-device", f"loader,file={key},addr=0x08010000,force-raw=on",
                        "-plugin", f"{build}/stm32f405.so,flash={flash}", "-kernel", f"{build}/firmware_stm32f405.elf"]
        self.process = self.port = self.held = None

    def power_on(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in self.process.stdout:
            if "redirected to " in line:
                self.port = line.split("redirected to ")[1].split()[0]
                break
        else:
            raise Failed(f"{self.command[0]}: ended with status {self.process.wait()}")
        self.held = os.open(self.port, os.O_RDWR | os.O_NOCTTY)  # QEMU looks for a new host once a second only
        tty.setraw(self.held)
        time.sleep(1.5)
        return self

    def kill(self):
        self.process.kill()
        self.wait()

    def wait(self, timeout_s=60):
        self.process.stdout.close()
        os.close(self.held)
        return self.process.wait(timeout_s)


class Line:
    """A port of its own, joined to another. Each byte is flipped, dropped or doubled with this probability; baud: bits a
    second, ten a byte, in each direction (None: as fast as it goes)."""

    PORTION = 64  # bytes that a paced line holds back at once

    def __init__(self, port, probability=0.0, seed=1, baud=None):
        self.random, self.probability = random.Random(seed), probability
        self.seconds_a_byte = 10 / baud if baud else 0
        self.board = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.board)
        self.host, other = os.openpty()
        tty.setraw(other)
        os.set_blocking(self.host, False)
        self.port, self.other = os.ttyname(other), other
        self.bytes = self.spoilt = 0
        self.ended = False
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _spoil(self, data):
        if not self.probability:
            return data
        out = bytearray()
        for byte in data:
            self.bytes += 1
            if self.random.random() >= self.probability:
                out.append(byte)
                continue
            self.spoilt += 1
            what = self.random.randrange(3)
            if what == 0:
                out.append(byte ^ 1 << self.random.randrange(8))
            elif what == 1:
                out += bytes([byte, byte])
        return bytes(out)

    def _run(self):
        other = {self.host: self.board, self.board: self.host}
        pending, free_at = {fd: b"" for fd in other}, {fd: 0.0 for fd in other}
        room = self.PORTION if self.seconds_a_byte else 65536
        while not self.ended:
            now = time.monotonic()
            writers = [fd for fd, data in pending.items() if data and free_at[fd] <= now]
            readers = [fd for fd in pending if len(pending[other[fd]]) < room]
            waits = [free_at[fd] - now for fd, data in pending.items() if data and free_at[fd] > now]
            ready, writable, _ = select.select(readers, writers, [], min([0.05, *waits]))
            for fd in ready:
                try:
                    pending[other[fd]] += self._spoil(os.read(fd, room))
                except OSError:
                    continue
            for fd in writable:
                try:
                    sent = os.write(fd, pending[fd][:room])
                    pending[fd] = pending[fd][sent:]
                    free_at[fd] = max(free_at[fd], time.monotonic() - 0.01) + sent * self.seconds_a_byte
                except BlockingIOError:
                    continue
                except OSError:
                    pending[fd] = b""

    def close(self):
        self.ended = True
        self.thread.join()
        for fd in (self.host, self.other, self.board):
            os.close(fd)
