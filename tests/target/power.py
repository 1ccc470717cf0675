# SPDX-License-Identifier: GPL-3.0-or-later
"""Power cuts: chains of lives of the emulated STM32, each cut inside one operation on its flash."""
import concurrent.futures
import os
import re
import tempfile

import emulator
from emulator import in_build

OPERATIONS = 1345  # of one life that stores an image: mark, words, record, boot bit, sector erase; the last are never reached


class Chain:
    """Lives on one flash, one after the other. What the next life finds must be what the last one left or completed."""

    def __init__(self, build, folder, seed):
        self.build, self.seed = build, seed
        self.flash, self.key = os.path.join(folder, f"flash{seed}"), os.path.join(folder, f"key{seed}")
        with open(self.key, "wb") as file:
            file.write(bytes(range(32)))
        self.allowed, self.lives, self.cuts, self.words, self.erases, self.boots = {0}, 0, 0, 0, 0, 0
        self.kept = self.taken = 0
        self.lost = []

    def live(self, cut):
        """One life; cut 0: none. Counts what happened and notes what must not."""
        status, out, err = emulator.run(emulator.product(
            self.build, in_build(self.build, "target_store_stm32f405.elf"), self.key,
            [f"flash={self.flash}", f"cut={cut}", f"seed={self.seed * 100003 + self.lives}"],
            "-device", "loader,addr=0x2001FF04,data=1,data-len=4", "-serial", "null",
            "-semihosting-config", "enable=on,target=native"))
        self.lives += 1
        text = out + err  # semihosting's console is standard error
        found = re.search(r"boot (\d+) number (\d+)", text)
        stored = re.search(r"stored (\d+)", text)
        if status == emulator.POWER_FAILED:
            self.cuts += 1
            self.words += "a word" in err
            self.erases += "an erase" in err
        elif status != 0 or not stored:
            self.lost.append(f"life {self.lives}, cut {cut}: status {status} {text}")
            return
        if not found:  # cut before the store was read: nothing is known of this life
            return
        counter, boots = int(found[1]), int(found[2])
        if counter not in self.allowed:
            self.lost.append(f"life {self.lives}: holds {counter}, may hold {sorted(self.allowed)}")
        if boots < self.boots:
            self.lost.append(f"life {self.lives}: power-on {boots} after {self.boots}")
        if len(self.allowed) > 1:
            self.taken += counter == max(self.allowed)
            self.kept += counter == min(self.allowed)
        self.boots = boots
        self.allowed = {int(stored[1])} if stored else {counter, counter + 1}


def chain(build, folder, seed, cuts):
    lives = Chain(build, folder, seed)
    for cut in cuts:
        lives.live(cut)
    lives.live(0)
    return lives


def power_cuts(build, every, jobs=2):
    """Cuts in every `every`-th operation, and over and over in the first few, where marks and sector erases are."""
    plan = [*range(1, OPERATIONS, every)]
    early = [(3, 3, 4, 3, 2, 3, 3, 0)[i % 8] for i in range(400)]  # each uses up a window: the sixteenth cuts an erase
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        parts = [plan[i::2 * jobs] for i in range(2 * jobs)] + [early[i::jobs] for i in range(jobs)]
        done = list(pool.map(lambda part: chain(build, folder, part[0], part[1]), list(enumerate(parts, 1))))
    return done
