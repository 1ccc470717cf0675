# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that must not run, and one that runs for long."""
import random
import struct

import rig
import wire
from bench import counter_of, give


def blind(bench, share):
    """a host that switches to what noise left of an image, without comparing it first"""
    tries, lost, refused, taken = max(5, round(100 * share)), 0, 0, 0
    board = bench.board().power_on()
    link = bench.link(board.port)
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


def bad_images(bench, generator):
    """Name: (how many, maker of one, the fault the board must name or None for any). The board runs counter 1000."""
    setup = 64  # behind the header: floats
    plan = 448 + 124  # front, counts; then dt_s, phi[16][4]
    phi = struct.unpack_from("<4f", bench.unsigned, plan + 4)

    def patched(*changes):
        whole = bytearray(bench.image(2000))
        for offset, number in changes:
            struct.pack_into("<f", whole, offset, number)
        return wire.signed(bytes(whole), bench.key, 2000, bench.device)

    def tampered():
        whole = bytearray(bench.image(2000))
        whole[generator.randrange(len(whole))] ^= 1 << generator.randrange(8)
        return bytes(whole)

    return {
        "tampered byte": (200, tampered, None),
        "replayed counter": (20, lambda: bench.image(generator.randrange(1, 1001)), 6),
        "foreign device": (20, lambda: wire.signed(bench.unsigned, bench.key, 2000, generator.randbytes(12)), 5),
        "foreign key": (20, lambda: wire.signed(bench.unsigned, generator.randbytes(32), 2000, bench.device), 7),
        "NaN": (20, lambda: patched((plan + 4 * generator.randrange(1, 60), float("nan"))), 10),
        "infinity": (20, lambda: patched((plan + 4 * generator.randrange(1, 60), float("inf"))), 10),
        "denormal": (20, lambda: patched((plan + 4 * generator.randrange(1, 60), 1e-45)), 10),
        "absurd scale": (20, lambda: patched((setup + 8, 1e38)), 8),
        "absurd noise": (20, lambda: patched((setup + 16, 1e-45)), 8),
        "unstable": (20, lambda: patched((plan + 4, phi[0] + 0.3), (plan + 16, phi[3] + 0.3)), 10),
        "other rate": (20, lambda: patched((plan, 0.0011)), 11),
    }


def refusals(bench, share):
    """wrong keys, replayed and foreign images, tampered bytes, NaN and unstable models"""
    board = bench.board().power_on()
    link = bench.link(board.port)
    link.connect()
    old, generator, lost, counts = bench.image(1000), random.Random(7), 0, {}
    give(link, bench, old)
    for name, (times, make, fault) in bad_images(bench, generator).items():
        counts[name] = max(2, round(times * share))
        for _ in range(counts[name]):
            link.stage(make())
            try:
                link.switch()
                lost += 1
            except wire.Refused as error:
                lost += error.code != wire.ERROR_PAGE
            lost += fault is not None and link.info().last_fault != fault
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
