# SPDX-License-Identifier: GPL-3.0-or-later
"""XCP on SxI from lib/beam_wire.h and lib/beam_image.h, written once more: a host that shares no code with beamfit.

It tests what goes over the line, so it can also do what a well-behaved host does not: stop reading, send garbage, repeat.
"""
import hashlib
import hmac
import os
import select
import struct
import termios
import time
import tty
import zlib
from typing import NamedTuple

IMAGE, LIVE, INFO, DRIVE, TRACKING = 0x00010000, 0x00020000, 0x00030000, 0x00040000, 0x00070000
ACTIVE, STAGING = 0, 1
MAX_PACKET = 248
CODE_BYTES, HEADER_BYTES = 32, 64
ERROR_BUSY = 0x10
ERROR_LOCKED = 0x25
ERROR_PAGE = 0x26
FAULTS = ["fine", "magic", "layout", "length", "crc", "foreign device", "old counter", "code", "setup", "effect", "plan",
          "rate", "proof", "too slow", "arithmetic"]


class Info(NamedTuple):
    firmware_version: int
    image_layout: int
    image_bytes: int
    device: bytes
    sample_mHz: int
    running: int
    counter: int
    stored: int
    missed: int
    overrun: int
    frames_bad: int
    wrong_keys: int
    refused: int
    last_fault: int
    slot_0: int
    slot_1: int
    boots: int
    nvm_errors: int
    worst_step_us: int
    model_sha256: bytes
    core_Hz: int
    step_budget: int
    step_bound: int
    proof_us: int
    sequence: int
    latched: int
    alarms: int
    faults: int
    latch_first: int
    latch_last: int
    drive_stops: int
    reset: int
    reset_power: int
    reset_pin: int
    reset_fault: int
    reset_watchdog: int


class Live(NamedTuple):
    sequence: int
    step: int
    input: float
    measured: float
    predicted: float
    residual: float
    innovation: float
    ratio: float
    innovation_ratio: float
    codes: int
    status: int
    crc32: int


INFO_FORMAT, LIVE_FORMAT = "<3I12s15I32s16I", "<2I7f3I"
INFO_BYTES, LIVE_BYTES = struct.calcsize(INFO_FORMAT), struct.calcsize(LIVE_FORMAT)


class Refused(Exception):
    """The board answered with an error packet."""

    def __init__(self, command, code):
        super().__init__(f"command 0x{command:02X} refused with error 0x{code:02X}")
        self.code = code


class Silent(Exception):
    """The board did not answer."""


def read_key(path):
    """The key file's 32 bytes, or its 64 hexadecimal digits."""
    with open(path, "rb") as file:
        raw = file.read()
    return raw if len(raw) == 32 else bytes.fromhex(raw.decode("ascii"))


def signed(image, key, counter, device=None):
    """A copy of a target image for this counter and device, with CRC and code made anew."""
    head = bytearray(image[:HEADER_BYTES])
    body = image[HEADER_BYTES:-CODE_BYTES]
    struct.pack_into("<I", head, 12, counter)
    if device is not None:
        head[16:28] = device
    struct.pack_into("<I", head, 60, zlib.crc32(body))
    whole = bytes(head) + body
    return whole + hmac.new(key, whole, hashlib.sha256).digest()


def frame(packet, counter=0):
    body = struct.pack("<HH", len(packet), counter & 0xFFFF) + packet + (b"\0" if len(packet) % 2 else b"")
    return body + struct.pack("<H", sum(struct.unpack(f"<{len(body) // 2}H", body)) & 0xFFFF)


class Receiver:
    """Bytes to packets. A length or sum that is wrong costs one byte, then it looks again."""

    def __init__(self):
        self.bytes = bytearray()
        self.skipped = 0

    def packets(self, more):
        self.bytes += more
        while len(self.bytes) >= 4:
            length = self.bytes[0] | self.bytes[1] << 8
            padded = 4 + length + length % 2
            if not 1 <= length <= MAX_PACKET:
                del self.bytes[0]
                self.skipped += 1
                continue
            if len(self.bytes) < padded + 2:
                return
            words = struct.unpack(f"<{padded // 2 + 1}H", self.bytes[:padded + 2])
            if sum(words[:-1]) & 0xFFFF == words[-1]:
                packet = bytes(self.bytes[4:4 + length])
                del self.bytes[:padded + 2]
                yield packet
            else:
                del self.bytes[0]
                self.skipped += 1

    def give_up(self):
        """Nothing came for long: the frame that began will not end."""
        if self.bytes:
            del self.bytes[0]
            self.skipped += 1


class Link:
    """
    One host on a port. on_live(Live or None): each DAQ sample; None when its CRC-32 is wrong. `noisy`: a frame that does
    not end is given up; else the board is only slow.
    """

    def __init__(self, path, timeout_s=0.3, retries=6):
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.fd)
        termios.tcflush(self.fd, termios.TCIOFLUSH)
        self.timeout_s, self.retries = timeout_s, retries
        self.receiver = Receiver()
        self.counter = 0
        self.answer, self.noisy = None, False
        self.on_live = lambda live: None
        self.samples = self.bad_samples = self.repeats = self.largest = 0
        self.block = MAX_PACKET  # bytes of a packet that carries data

    def close(self):
        os.close(self.fd)

    # ---- Bytes ----

    def pump(self, seconds):
        """Handles what comes within this time; returns at once when an answer is there."""
        end = time.monotonic() + seconds
        while True:
            left = end - time.monotonic()
            ready, _, _ = select.select([self.fd], [], [], max(0, min(left, 0.05)))
            more = b""
            if ready:
                try:
                    more = os.read(self.fd, 65536)
                except BlockingIOError:
                    pass
            for packet in self.receiver.packets(more):
                self._handle(packet)
            if self.answer is not None or left <= 0:
                return

    def _handle(self, packet):
        if packet[0] in (0xFF, 0xFE):
            self.answer = packet
        elif packet[0] < 0xFC:
            data = packet[-LIVE_BYTES:]
            if len(packet) >= 1 + LIVE_BYTES and zlib.crc32(data[:-4]) == struct.unpack("<I", data[-4:])[0]:
                self.samples += 1
                self.on_live(Live(*struct.unpack(LIVE_FORMAT, data)))
            else:
                self.bad_samples += 1
                self.on_live(None)

    def write(self, data):
        while data:
            _, ready, _ = select.select([], [self.fd], [], 1)
            if not ready:
                raise Silent("the port takes no bytes")
            data = data[os.write(self.fd, data):]

    # ---- Commands ----

    def command(self, packet, size=1, repeat=True):
        """The answer's packet, at least `size` bytes. Repeats after silence; only for commands that may come twice."""
        for attempt in range(self.retries if repeat else 1):
            self.answer = None
            self.repeats += attempt > 0
            if self.noisy and attempt > 1:
                self.receiver.give_up()
            self.counter += 1
            self.write(frame(bytes(packet), self.counter))
            end = time.monotonic() + self.timeout_s
            while time.monotonic() < end:
                self.pump(end - time.monotonic())
                answer, self.answer = self.answer, None
                if answer is None:
                    break
                if answer[0] == 0xFE:
                    if len(answer) > 1 and answer[1] == ERROR_BUSY:
                        self.pump(0.01)
                        break
                    raise Refused(packet[0], answer[1] if len(answer) > 1 else 0)
                if len(answer) >= size:
                    self._drop_late_answers(attempt)
                    return answer
        raise Silent(f"command 0x{packet[0]:02X}: no answer")

    def _drop_late_answers(self, attempt):
        """A command that was sent again may be answered again, and must not be taken for the next one's answer."""
        for _ in range(attempt):
            self.pump(self.timeout_s / 2)
            self.answer = None

    def connect(self):
        self.largest = self.command(b"\xFF\x00", 8)[3]

    def short_upload(self, address, n):
        data = b""
        while len(data) < n:
            part = min(self.largest - 1, self.block, n - len(data))
            # the answer's length tells it from a late one to another command
            data += self.command(struct.pack("<BBBBI", 0xF4, part, 0, 0, address + len(data)), part + 1)[1:part + 1]
        return data

    def short_download(self, address, data):
        step = min(self.largest - 8, self.block) // 4 * 4
        for at in range(0, len(data), step):
            part = data[at:at + step]
            self.command(struct.pack("<BBBBI", 0xED, len(part), 0, 0, address + at) + part)

    def info(self):
        return Info(*struct.unpack(INFO_FORMAT, self.short_upload(INFO, INFO_BYTES)))

    def unlock(self, key, resource=1):
        seed = self.command(bytes([0xF8, 0, resource]), 2)
        if seed[1] == 0:
            return
        answer = hmac.new(key, bytes([resource]) + seed[2:2 + seed[1]], hashlib.sha256).digest()[:16]
        self.command(bytes([0xF7, len(answer)]) + answer, 2, repeat=False)

    def show_page(self, page):
        self.command(bytes([0xEB, 0x02, 0, page]))

    def read_image(self, page, n):
        self.show_page(page)
        return self.short_upload(IMAGE, n)

    def checksum(self, address, n):
        """The board's address moves on with each BUILD_CHECKSUM, so both commands are sent again."""
        for _ in range(self.retries):
            self.command(struct.pack("<BBBBI", 0xF6, 0, 0, 0, address))
            try:
                return struct.unpack("<I", self.command(struct.pack("<BBBBI", 0xF3, 0, 0, 0, n), 8, repeat=False)[4:8])[0]
            except Silent:
                self.repeats += 1
                self._drop_late_answers(1)
        raise Silent("no checksum")

    def stage(self, image):
        """Writes the image into the staged page until its CRC-32 is right."""
        self.show_page(STAGING)
        for _ in range(self.retries):
            self.short_download(IMAGE, image)
            if self.checksum(IMAGE, len(image)) == zlib.crc32(image):
                return
        raise Silent("the staged page does not take the image")

    def switch(self, timeout_s=5):
        """SET_CAL_PAGE(ECU, staging): the board checks, and answers when the model runs or is refused."""
        end = time.monotonic() + timeout_s
        while True:
            try:
                self.command(bytes([0xEB, 0x01, 0, STAGING]), repeat=False)
                return
            except Silent:
                if time.monotonic() > end:
                    raise

    def store(self):
        self.command(struct.pack("<BBH", 0xF9, 0x01, 0))

    def storing(self):
        return bool(self.command(b"\xFD", 6)[1] & 0x01)

    def store_and_wait(self, timeout_s=10):
        self.store()
        end = time.monotonic() + timeout_s
        while self.storing():
            if time.monotonic() > end:
                raise Silent("the store does not end")
            self.pump(0.01)

    def start_daq(self, prescaler=1):
        self.stop_daq()
        self.command(b"\xD6")
        self.command(struct.pack("<BBH", 0xD5, 0, 1), repeat=False)
        self.command(struct.pack("<BBHB", 0xD4, 0, 0, 1), repeat=False)
        self.command(struct.pack("<BBHBB", 0xD3, 0, 0, 0, 1), repeat=False)
        self.command(struct.pack("<BBHBB", 0xE2, 0, 0, 0, 0))
        self.command(struct.pack("<BBBBI", 0xE1, 0xFF, LIVE_BYTES, 0, LIVE), repeat=False)
        self.command(struct.pack("<BBHHBB", 0xE0, 0x10, 0, 0, prescaler, 0))
        self.command(struct.pack("<BBH", 0xDE, 0x02, 0))
        self.command(bytes([0xDD, 0x01]))

    def stop_daq(self):
        self.command(bytes([0xDD, 0x00]))

    def drive(self, amplitude, from_Hz, to_Hz, period, sample_Hz, generation, rest=True):
        turns = 2.0**32 / sample_Hz
        sweep = int((to_Hz - from_Hz) * turns / period) & 0xFFFFFFFF
        self.short_download(DRIVE, struct.pack("<f6I", amplitude, int(from_Hz * turns), sweep, period, 0, int(rest),
                                               generation))
