# SPDX-License-Identifier: GPL-3.0-or-later
"""Power that fails."""
import random
import subprocess
import threading

import rig
import wire
from bench import counter_of, give, running


def interrupted(bench, board, old, new, at_download=lambda: None, at_store=lambda: None):
    """Gives the board a new image until it dies; then powers it on. (what it runs, was it lost, how it died)."""
    stored = False
    link = bench.link(board.port)
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
    now, info = running(bench, board)
    return now, now not in (old, new) or (stored and now != new) or info.missed != 0, status


def kills(bench, share):
    """SIGKILL at a random moment of a download (half) or of a store (half), flash in a file"""
    tries, lost, new_ones, generator = max(6, round(500 * share)), 0, 0, random.Random(1)
    board = bench.board().power_on()
    link = bench.link(board.port)
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
    board = bench.board().power_on()
    link = bench.link(board.port)
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
        now, _ = running(bench, board)
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
