# SPDX-License-Identifier: GPL-3.0-or-later
"""Power cuts: chains of lives of the emulated STM32, each cut inside one operation on its flash; and kills of the mps2
board, whose slots lie in memory that a file backs."""
import concurrent.futures
import os
import random
import re
import subprocess
import tempfile
import threading
import time

import board
import emulator
from emulator import in_build

OPERATIONS = 1299  # of one life that stores an image: mark, words, record, boot bit, sector erase; the last are never reached


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


MPS2_BYTES, MPS2_PROVISION, MPS2_SLOTS = 16 << 20, 0x700000, 3 * 8192


def mps2_memory(path, key=bytes(range(32)), device=b"mps2-an386-1"):
    """The file behind the PSRAM: blank slots, identity, key."""
    with open(path, "wb") as file:
        file.write(b"\xff" * MPS2_SLOTS)
        file.seek(MPS2_PROVISION)
        file.write(0x504D4642.to_bytes(4, "little") + device + key)
        file.truncate(MPS2_BYTES)


def mps2(elf, memory, *options, machine="mps2-an386"):
    return ["qemu-system-arm", "-M", f"{machine},memory-backend=nv", "-object",
            f"memory-backend-file,id=nv,size=16M,mem-path={memory},share=on", "-display", "none", "-monitor", "none",
            "-kernel", elf, *options]


def killed_life(build, memory, after_s):
    """
    A life that stores one image after the other until it is killed, after_s from when it had looked (below 0: before it can
    have); (counter at boot, counters stored).
    """
    arguments = mps2(in_build(build, "target_store_mps2.elf"), memory, "-serial", "null", "-semihosting-config",
                     "enable=on,target=native", "-device", "loader,addr=0x2001FF04,data=2,data-len=4")
    process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    watchdog = threading.Timer(60, process.kill)
    watchdog.start()
    text = ""
    while after_s >= 0 and "boot" not in text and process.poll() is None:
        text += process.stderr.readline()
    time.sleep(abs(after_s))
    ended = process.poll()
    process.kill()
    text += process.communicate()[1]
    watchdog.cancel()
    if ended is not None:
        raise subprocess.SubprocessError(f"the board ended by itself, status {ended}: {text}")
    found = re.search(r"boot (\d+) number \d+\n", text)
    return (int(found[1]) if found else None), [int(n) for n in re.findall(r"stored (\d+)\n", text)]


def kill_chain(build, folder, seed, kills):
    """What a life finds is what the last one said it had stored, or the one that it was storing. (seen, stores, lost)"""
    chance, memory = random.Random(seed), os.path.join(folder, f"memory{seed}")
    mps2_memory(memory)
    least, most, seen, stores, lost = 0, 0, 0, 0, []
    for life in range(kills):
        boot, stored = killed_life(build, memory, chance.uniform(-0.01, 0.08))
        if boot is None:  # killed before it could look
            continue
        seen += 1
        stores += len(stored)
        if not least <= boot <= most:
            lost.append(f"life {life}: holds {boot}, not {least} to {most}")
        least = stored[-1] if stored else boot
        most = least + 2  # a line that was not yet written, and a store under way
    os.remove(memory)
    return seen, stores, lost


def random_kills(build, kills, jobs=2):
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(lambda seed: kill_chain(build, folder, seed, kills // jobs), range(1, jobs + 1)))


def second_port(build, folder, kills, name="mps2", machine="mps2-an386"):
    """
    A board of the mps2 family under its firmware: downloads, and SIGKILL at random inside them. After each the running model is the last
    one that was acknowledged, or the one under way. (kills, downloads done, lost)
    """
    chance, memory, image = random.Random(7), os.path.join(folder, "memory"), os.path.join(folder, "model.img")
    secret, key = board.make_key(folder)
    mps2_memory(memory, secret)
    done, held, lost = 0, 0, []
    for life in range(kills + 1):
        target = board.Served(build, folder, mps2(in_build(build, f"firmware_{name}.elf"), memory, "-serial", "pty",
                                                          machine=machine))
        try:
            info = target.info()
            if not held <= info["counter"] <= held + 1:
                lost.append(f"life {life}: counter {info['counter']}, was {held}: {info}")
            held = info["counter"]
            if life == 0:
                target.beamfit("export", "data/live/model.yaml", "-o", image)
            download = subprocess.Popen([in_build(build, "beamfit"), "download", image, "--port", target.port, "--key", key],
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                download.wait(timeout=None if life == kills else chance.uniform(0.05, 2.5))
            except subprocess.TimeoutExpired:
                pass
            target.process.kill()
            good = download.wait(timeout=60) == 0
            done += good
            held += good
        finally:
            target.end()
    return kills, done, lost
