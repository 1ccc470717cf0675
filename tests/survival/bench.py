# SPDX-License-Identifier: GPL-3.0-or-later
"""What a board must survive: each case tries something a number of times and counts what was lost.

Lost is: the board runs an image that is neither the old nor the new one bit for bit, a sample was missed or did not come
and the board does not count it, or the board cannot be used afterwards.
"""
import os
import struct

import rig
import wire


class Bench:
    """Programs, key, image and files of one run."""

    def __init__(self, build, directory, product):
        self.build, self.directory, self.product, self.boards = build, directory, product, []
        self.key_path = rig.make_key(self.path("key"))
        self.key = wire.read_key(self.key_path)
        self.device = bytes.fromhex("0123456789abcdef01234567") if product else b"board_host_1"
        model = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "data", "live", "model.yaml")
        self.unsigned_path = self.path("unsigned")
        rig.run(f"{build}/beamfit", "export", model, "-o", self.unsigned_path)
        with open(self.unsigned_path, "rb") as file:
            self.unsigned = file.read()

    def path(self, name):
        return os.path.join(self.directory, name)

    def image(self, counter):
        """Each counter's image differs in its expected noise too, and so in its CRC; no innovation is below that noise."""
        whole = bytearray(self.unsigned)
        struct.pack_into("<f", whole, wire.HEADER_BYTES + 16, 0.01 / (1 + 1e-4 * counter))
        return wire.signed(bytes(whole), self.key, counter, self.device)

    def link(self, port):
        """A host with the patience that an emulator on a busy machine asks for."""
        return wire.Link(port, timeout_s=2.0, retries=10) if self.product else wire.Link(port, timeout_s=0.5, retries=10)

    def board(self):
        flash = self.path("flash")
        self.boards.append(rig.Product(self.build, self.key_path, flash) if self.product else
                           rig.Board(self.build, "--key", self.key_path, "--nvm", flash))
        return self.boards[-1]

    def close(self):
        """Ends what a case that failed has left running."""
        for board in self.boards:
            if board.process and board.process.poll() is None:
                board.kill()

    def beamfit(self, *words, **keywords):
        return rig.run(f"{self.build}/beamfit", *words, **keywords)


class Watch:
    """Counts the samples that a stream lacks, and those that come twice or in the wrong order."""

    def __init__(self, link):
        self.last, self.absent, self.disordered = None, 0, 0
        link.on_live = self

    def __call__(self, live):
        if live is None:
            return
        if self.last is not None and live.sequence > self.last:
            self.absent += live.sequence - self.last - 1
        self.disordered += self.last is not None and live.sequence <= self.last
        self.last = live.sequence


def give(link, bench, image, store=True):
    link.unlock(bench.key)
    link.stage(image)
    link.switch()
    if store:
        link.store_and_wait()


def running(bench, board):
    """(image, info) of a board that a host connects to anew."""
    link = bench.link(board.port)
    try:
        link.connect()
        info = link.info()
        return link.read_image(wire.ACTIVE, len(bench.unsigned)), info
    finally:
        link.close()


def counter_of(image):
    return struct.unpack_from("<I", image, 12)[0]
