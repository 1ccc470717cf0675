# SPDX-License-Identifier: GPL-3.0-or-later
"""What a board must survive: each case tries something a number of times and counts what was lost.

Lost is: the board runs an image that is neither the old nor the new one bit for bit, a sample was missed, or the board
cannot be used afterwards.
"""
import os
import random
import select
import struct
import subprocess
import threading
import time

import rig
import wire


class Bench:
    """Programs, key, image and files of one run."""

    def __init__(self, build, directory):
        self.build, self.directory = build, directory
        self.key_path = rig.make_key(self.path("key"))
        self.key = wire.read_key(self.key_path)
        self.device = b"board_host_1"
        model = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "data", "live", "model.yaml")
        self.unsigned_path = self.path("unsigned")
        rig.run(f"{build}/beamfit", "export", model, "-o", self.unsigned_path)
        with open(self.unsigned_path, "rb") as file:
            self.unsigned = file.read()

    def path(self, name):
        return os.path.join(self.directory, name)

    def image(self, counter):
        """Each counter's image differs in its expected noise too, and so in its CRC."""
        whole = bytearray(self.unsigned)
        struct.pack_into("<f", whole, wire.HEADER_BYTES + 16, 0.01 + 1e-6 * counter)
        return wire.signed(bytes(whole), self.key, counter, self.device)

    def board(self, nvm=None, *options):
        return rig.Board(self.build, "--key", self.key_path, *(("--nvm", self.path(nvm)) if nvm else ()), *options)

    def beamfit(self, *words, **keywords):
        return rig.run(f"{self.build}/beamfit", *words, **keywords)


class Watch:
    """Counts where a stream does not go on with the next sample."""

    def __init__(self, link):
        self.last, self.gaps = None, 0
        link.on_live = self

    def __call__(self, live):
        if live is None:
            return
        self.gaps += self.last is not None and live.sequence != self.last + 1
        self.last = live.sequence


def give(link, bench, image, store=True):
    link.unlock(bench.key)
    link.stage(image)
    link.switch()
    if store:
        link.store_and_wait()


def running(port, n):
    """(image, info) of a board that a host connects to anew."""
    link = wire.Link(port)
    try:
        link.connect()
        info = link.info()
        return link.read_image(wire.ACTIVE, n), info
    finally:
        link.close()


def counter_of(image):
    return struct.unpack_from("<I", image, 12)[0]


# ---- Power ----

def interrupted(bench, board, old, new, at_download=lambda: None, at_store=lambda: None):
    """Gives the board a new image until it dies; then powers it on. (what it runs, was it lost, how it died)."""
    stored = False
    link = wire.Link(board.port, retries=2)
    try:
        link.connect()
        at_download()
        give(link, bench, new, store=False)
        at_store()
        link.store_and_wait()
        stored = True
        board.process.wait(2)
    except (OSError, wire.Silent, wire.Refused, subprocess.TimeoutExpired):
        pass
    finally:
        link.close()
    if board.process.poll() is None:
        board.process.kill()
    status = board.wait()
    board.power_on()
    now, info = running(board.port, len(new))
    return now, now not in (old, new) or (stored and now != new) or info.missed != 0, status


def kills(bench, share):
    """SIGKILL at a random moment of a download (half) or of a store (half), flash in a file"""
    tries, lost, new_ones, generator = max(6, round(500 * share)), 0, 0, random.Random(1)
    board = bench.board("flash_kills").power_on()
    link = wire.Link(board.port)
    link.connect()
    old = bench.image(1)
    give(link, bench, old)
    link.close()
    span_s = [0.05, 0.01]
    for number in range(tries):
        new, kind = bench.image(counter_of(old) + 1), number % 2
        timer = threading.Timer(generator.uniform(0, span_s[kind]), board.process.kill)
        now, bad, _ = interrupted(bench, board, old, new, **{("at_download", "at_store")[kind]: timer.start})
        timer.cancel()
        lost += bad
        new_ones += now == new
        span_s[kind] *= 0.95 if now == new else 1.05  # as many kills before the new image is stored as after
        old = now
    board.kill()
    return tries, lost, f"{new_ones} times the new image was running afterwards, else the old one"


def power_cuts(bench, share):
    """power fails within an operation of the flash, words torn"""
    board = bench.board("flash_cuts").power_on()
    link = wire.Link(board.port)
    link.connect()
    old = bench.image(1)
    give(link, bench, old)
    link.close()
    board.kill()
    operations, lost, tries, new_ones, cut = len(old) // 4 + 8, 0, 0, 0, 0
    stride = max(1, round(1 / share))
    for at in range(1, operations + 1, stride):
        try:
            board.power_on("--power-cut", at)
        except rig.Failed:  # it died while it counted the power-on
            board.power_on()
        now, _ = running(board.port, len(old))
        lost += now != old
        new = bench.image(counter_of(old) + 1)
        now, bad, status = interrupted(bench, board, old, new)
        cut += status == 42
        lost += bad
        new_ones += now == new
        old = now
        tries += 1
        board.kill()
    return tries, lost, f"{cut} cut within a store; {new_ones} times the new image was running afterwards"


# ---- Line ----

def downloads(bench, share):
    """downloads in a row while every sample is streamed"""
    tries, lost = max(5, round(100 * share)), 0
    board = bench.board().power_on()
    link = wire.Link(board.port)
    link.connect()
    link.start_daq()
    watch = Watch(link)
    begin = time.monotonic()
    for counter in range(1, tries + 1):
        image = bench.image(counter)
        give(link, bench, image)
        lost += link.read_image(wire.ACTIVE, len(image)) != image
    seconds = time.monotonic() - begin
    info = link.info()
    link.stop_daq()
    link.close()
    board.kill()
    lost += info.missed + watch.gaps + link.bad_samples
    return tries, lost, (f"{link.samples} samples in {seconds:.1f} s, {info.missed} missed, {watch.gaps} gaps, "
                         f"{link.bad_samples} CRC failures, {info.overrun} without room")


def persist(what, times=60):
    """Until it works; the line loses frames."""
    for attempt in range(times):
        try:
            return what()
        except (wire.Silent, wire.Refused):
            if attempt == times - 1:
                raise
    return None


def give_over_noise(link, bench, image):
    """Whatever is lost is done again; unlock and switch end a session's state, so they begin anew."""
    def once():
        link.connect()
        link.unlock(bench.key)
        link.stage(image)
        link.switch()

    def streaming():
        link.connect()
        link.start_daq()

    def running_counter():
        return link.info().counter

    persist(streaming)
    for _ in range(60):
        try:
            persist(lambda: link.unlock(bench.key))
            persist(lambda: link.stage(image))
            link.switch()
        except (wire.Silent, wire.Refused):
            pass
        if persist(running_counter) == counter_of(image):
            return
        persist(once if random.random() < 0.2 else streaming)
    raise wire.Silent("no download went through")


def noise(bench, share):
    """downloads with streaming on, each byte flipped, dropped or doubled with probability 1e-3, 3e-3, 1e-2"""
    tries, lost, notes = 0, 0, []
    for probability, most, block in ((1e-3, 20, 128), (3e-3, 20, 64), (1e-2, 10, 32)):
        board = bench.board().power_on()
        line = rig.NoisyLine(board.port, probability, seed=round(1e5 * probability))
        link = wire.Link(line.port, timeout_s=0.1, retries=20)
        link.block = block
        counter = 0
        for counter in range(1, max(2, round(most * share)) + 1):
            image = bench.image(counter)
            tries += 1
            try:
                give_over_noise(link, bench, image)
            except (wire.Silent, wire.Refused):
                lost += 1
        link.close()
        line.close()
        now, info = running(board.port, len(bench.unsigned))
        board.kill()
        lost += now != bench.image(counter)
        lost += info.missed
        notes.append(f"{probability:g}: {line.spoilt} of {line.bytes} bytes spoilt, {link.repeats} repeats, "
                     f"{link.samples} samples came")
    return tries, lost, "; ".join(notes)


def noisy_programs(bench, share):
    """beamfit download and record over a line with 1e-3 byte noise"""
    tries, lost = max(2, round(20 * share)), 0
    board = bench.board().power_on()
    line = rig.NoisyLine(board.port, 1e-3, seed=5)
    port = ("--port", line.port, "--baud", 921600)
    for counter in range(1, tries + 1):
        with open(bench.path("image"), "wb") as file:
            file.write(bench.image(counter))
        try:
            bench.beamfit("download", bench.path("image"), *port, "--key", bench.key_path, timeout_s=60)
            if counter % 5 == 1:
                bench.beamfit("record", *port, "--seconds", 1, "--settle", 0, "--drive", "off", "-o",
                              bench.path("noisy.csv"), timeout_s=60)
        except (rig.Failed, subprocess.TimeoutExpired) as failure:
            print(failure)
            lost += 1
    line.close()
    now, info = running(board.port, len(bench.unsigned))
    board.kill()
    lost += (now != bench.image(tries)) + info.missed
    return tries, lost, f"{line.spoilt} of {line.bytes} bytes spoilt"


def blind(bench, share):
    """a host that switches to what noise left of an image, without comparing it first"""
    tries, lost, refused, taken = max(5, round(100 * share)), 0, 0, 0
    board = bench.board().power_on()
    link = wire.Link(board.port)
    link.connect()
    link.unlock(bench.key)
    old, generator = bench.image(1), random.Random(3)
    give(link, bench, old, store=False)
    for _ in range(tries):
        new = bench.image(counter_of(old) + 1)
        spoilt = bytearray(new)
        for _ in range(generator.choice((0, 1, 2, 3))):
            spoilt[generator.randrange(len(spoilt))] ^= 1 << generator.randrange(8)
        link.stage(bytes(spoilt))
        try:
            link.switch()
            taken += 1
            lost += bytes(spoilt) != new
            old = new
        except wire.Refused as error:
            refused += 1
            lost += error.code != wire.ERROR_PAGE or bytes(spoilt) == new
        lost += link.read_image(wire.ACTIVE, len(old)) != old
    lost += link.info().missed
    link.close()
    board.kill()
    return tries, lost, f"{refused} damaged ones refused, {taken} whole ones taken"


def two_hosts(bench, share):
    """two hosts that send and read on one line at once, one of them downloading"""
    tries, lost, through = max(3, round(50 * share)), 0, 0
    board = bench.board("flash_two").power_on()
    link = wire.Link(board.port)
    link.connect()
    old = bench.image(1)
    give(link, bench, old)
    link.close()
    for number in range(tries):
        new = bench.image(counter_of(old) + 1)
        ended = threading.Event()

        def other(seed=number, ended=ended):
            generator, host = random.Random(seed), wire.Link(board.port, timeout_s=0.02, retries=1)
            while not ended.is_set():
                try:
                    choice = generator.randrange(5)
                    if choice == 0:
                        host.connect()
                    elif choice == 1:
                        host.command(b"\xFD", 6)
                    elif choice == 2:
                        host.write(generator.randbytes(generator.randrange(1, 60)))
                    elif choice == 3:
                        host.command(struct.pack("<BBBBI", 0xED, 4, 0, 0, wire.IMAGE + 4 * generator.randrange(1000)) +
                                     generator.randbytes(4))
                    else:
                        host.command(bytes([0xEB, 0x01, 0, wire.STAGING]))
                except (wire.Silent, wire.Refused, OSError):
                    pass
                time.sleep(generator.uniform(0, 0.01))
            host.close()

        thread = threading.Thread(target=other)
        thread.start()
        link = wire.Link(board.port, timeout_s=0.05, retries=4)
        for _ in range(3):
            try:
                link.connect()
                give(link, bench, new)
                break
            except (wire.Silent, wire.Refused):
                pass
        ended.set()
        thread.join()
        link.close()
        time.sleep(0.1)
        now, info = running(board.port, len(old))
        lost += now not in (old, new) or info.missed != 0
        through += now == new
        old = now
    board.kill()
    return tries, lost, f"{through} times the download went through all the same"


def stops_reading(bench, share):
    """a host that starts the stream, stops reading for seconds, and comes back"""
    tries, lost, overrun = max(1, round(10 * share)), 0, 0
    board = bench.board().power_on()
    link = wire.Link(board.port)
    link.connect()
    old = bench.image(1)
    give(link, bench, old)
    for counter in range(2, 2 + tries):
        link.start_daq()
        before = link.info()
        time.sleep(4)
        while select.select([link.fd], [], [], 0)[0]:
            os.read(link.fd, 65536)
        link.receiver.bytes.clear()
        link.connect()
        first = wire.Live(*struct.unpack(wire.LIVE_FORMAT, link.short_upload(wire.LIVE, wire.LIVE_BYTES)))
        info = link.info()
        overrun = info.overrun
        lost += info.missed + (link.read_image(wire.ACTIVE, len(old)) != old) + (info.overrun <= before.overrun)
        old = bench.image(counter)
        give(link, bench, old)
        lost += link.read_image(wire.ACTIVE, len(old)) != old
        lost += first.sequence < 4000 * (counter - 1)
    link.close()
    board.kill()
    return tries, lost, f"{overrun} samples found no room on the line, none was missed by the model"


# ---- Images ----

def refusals(bench, share):
    """wrong keys, replayed and foreign images, tampered bytes, NaN and unstable models"""
    board = bench.board().power_on()
    link = wire.Link(board.port)
    link.connect()
    link.unlock(bench.key)
    old, generator, lost, counts = bench.image(1000), random.Random(7), 0, {}
    give(link, bench, old)
    plan = 320 + 4 * 66  # front, counts; then dt_s, phi[16][4]

    def patched(*changes):
        whole = bytearray(bench.image(2000))
        for offset, number in changes:
            struct.pack_into("<f", whole, offset, number)
        return wire.signed(bytes(whole), bench.key, 2000, bench.device)

    def tampered():
        whole = bytearray(bench.image(2000))
        whole[generator.randrange(len(whole))] ^= 1 << generator.randrange(8)
        return bytes(whole)

    phi = struct.unpack_from("<4f", old, plan + 4)
    makers = {
        "tampered byte": (200, tampered, None),
        "replayed counter": (20, lambda: bench.image(generator.randrange(1, 1001)), 6),
        "foreign device": (20, lambda: wire.signed(bench.unsigned, bench.key, 2000, generator.randbytes(12)), 5),
        "foreign key": (20, lambda: wire.signed(bench.unsigned, generator.randbytes(32), 2000, bench.device), 7),
        "NaN": (20, lambda: patched((plan + 4 * generator.randrange(1, 60), float("nan"))), 10),
        "infinity": (20, lambda: patched((plan + 4 * generator.randrange(1, 60), float("inf"))), 10),
        "unstable": (20, lambda: patched((plan + 4, phi[0] + 0.3), (plan + 16, phi[3] + 0.3)), 10),
        "other rate": (20, lambda: patched((plan, 0.0011)), 11),
    }
    for name, (times, make, fault) in makers.items():
        counts[name] = max(2, round(times * share))
        for _ in range(counts[name]):
            link.stage(make())
            try:
                link.switch()
                lost += 1
            except wire.Refused as error:
                lost += error.code != wire.ERROR_PAGE
            info = link.info()
            lost += fault is not None and info.last_fault != fault
            lost += link.read_image(wire.ACTIVE, len(old)) != old
    lost += link.info().missed
    counts["wrong key"] = max(2, round(8 * share))
    for _ in range(counts["wrong key"]):
        link.connect()
        try:
            link.unlock(generator.randbytes(32))
            lost += 1
        except wire.Refused as error:
            lost += error.code != wire.ERROR_LOCKED
    link.close()
    board.kill()
    return sum(counts.values()), lost, ", ".join(f"{n} {name}" for name, n in counts.items())


def steps(bench, share):
    """steps of the image without drift: a period at the end against one at the beginning"""
    count = max(10**6, round(10**8 * share))
    answer = rig.run(f"{bench.build}/survival_steps", bench.unsigned_path, count, timeout_s=3600)
    difference = float(answer.split()[0])
    return count, int(not difference <= 1e-5), f"largest difference {difference:.2g} of the rms"


ALL = [kills, power_cuts, downloads, noise, noisy_programs, blind, two_hosts, stops_reading, refusals, steps]
