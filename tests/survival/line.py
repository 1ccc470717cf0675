# SPDX-License-Identifier: GPL-3.0-or-later
"""A line that damages bytes, and hosts that do not behave."""
import os
import random
import select
import struct
import subprocess
import threading
import time

import rig
import wire
from bench import Watch, counter_of, give, running


def downloads(bench, share):
    """downloads in a row while every sample is streamed; to the board on the PC at 921600 bit/s"""
    tries, lost = max(5, round(100 * share)), 0
    board = bench.board().power_on()
    line = rig.Line(board.port, baud=None if bench.product else 921600)
    link = bench.link(line.port)
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
    line.close()
    board.kill()
    lost += info.missed + abs(watch.absent - info.overrun) + watch.disordered + link.bad_samples
    return tries, lost, (f"{link.samples} samples in {seconds:.1f} s, {info.missed} missed, {watch.absent} did not come, "
                         f"{info.overrun} found no room on the line, {link.bad_samples} CRC failures, "
                         f"{link.repeats} repeats")


def persist(what, times=60):
    """Until it works; the line loses frames."""
    for _ in range(times - 1):
        try:
            return what()
        except (wire.Silent, wire.Refused):
            pass
    return what()


def give_over_noise(link, bench, image):
    """Streams and downloads; whatever is lost is done again, now and then from CONNECT on."""
    def stream():
        link.connect()
        link.start_daq()

    for attempt in range(60):
        if attempt % 5 == 0:
            persist(stream)
        try:
            persist(lambda: link.unlock(bench.key))
            persist(lambda: link.stage(image))
            link.switch()
        except (wire.Silent, wire.Refused):
            pass
        if persist(lambda: link.info().counter) == counter_of(image):
            return
    raise wire.Silent("no download went through")


def noise(bench, share):
    """downloads with streaming on, each byte flipped, dropped or doubled with probability 1e-3, 3e-3, 1e-2"""
    tries, lost, notes = 0, 0, []
    for probability, most, block in ((1e-3, 20, 128), (3e-3, 20, 64), (1e-2, 10, 32)):
        board = bench.board().power_on()
        line = rig.Line(board.port, probability, seed=round(1e5 * probability))
        link = wire.Link(line.port, timeout_s=0.1, retries=20)
        link.block, link.noisy = block, True
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
        now, info = running(bench, board)
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
    line = rig.Line(board.port, 1e-3, seed=5)
    port = ("--port", line.port, "--baud", 921600)
    for counter in range(1, tries + 1):
        with open(bench.path("image"), "wb") as file:
            file.write(bench.image(counter))
        try:
            bench.beamfit("download", bench.path("image"), *port, "--key", bench.key_path, timeout_s=60)
            if counter % 5 == 1:
                bench.beamfit("record", *port, "--key", bench.key_path, "--seconds", 1, "--settle", 0, "--drive", "off", "--force", "-o",
                              bench.path("noisy.csv"), timeout_s=60)
        except (rig.Failed, subprocess.TimeoutExpired) as failure:
            print(failure)
            lost += 1
    line.close()
    now, info = running(bench, board)
    board.kill()
    lost += (now != bench.image(tries)) + info.missed
    return tries, lost, f"{line.spoilt} of {line.bytes} bytes spoilt"


def disturb(port, seed, ended):
    """A second host: commands, random bytes, writes and switches, until it is told to end."""
    generator, host = random.Random(seed), wire.Link(port, timeout_s=0.02, retries=1)
    actions = (host.connect, lambda: host.command(b"\xFD", 6),
               lambda: host.write(generator.randbytes(generator.randrange(1, 60))),
               lambda: host.short_download(wire.IMAGE + 4 * generator.randrange(1000), generator.randbytes(4)),
               lambda: host.command(bytes([0xEB, 0x01, 0, wire.STAGING])))
    host.noisy = True
    while not ended.is_set():
        try:
            host.largest = wire.MAX_PACKET
            generator.choice(actions)()
        except (wire.Silent, wire.Refused, OSError):
            pass
        time.sleep(generator.uniform(0, 0.01))
    host.close()


def two_hosts(bench, share):
    """two hosts that send and read on one line at once, one of them downloading"""
    tries, lost, through = max(3, round(50 * share)), 0, 0
    board = bench.board().power_on()
    link = bench.link(board.port)
    link.connect()
    old = bench.image(1)
    give(link, bench, old)
    link.close()
    for number in range(tries):
        new, ended = bench.image(counter_of(old) + 1), threading.Event()
        thread = threading.Thread(target=disturb, args=(board.port, number, ended))
        thread.start()
        link = wire.Link(board.port, timeout_s=0.05, retries=4)
        link.noisy = True
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
        now, info = running(bench, board)
        lost += now not in (old, new) or info.missed != 0
        through += now == new
        old = now
    board.kill()
    return tries, lost, f"{through} times the download went through all the same"


def stops_reading(bench, share):
    """a host that starts the stream, stops reading for seconds, and comes back"""
    tries, lost, overrun = max(1, round(10 * share)), 0, 0
    board = bench.board().power_on()
    link = bench.link(board.port)
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
