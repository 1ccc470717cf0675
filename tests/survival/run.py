# SPDX-License-Identifier: GPL-3.0-or-later
"""What a board must survive, on the board on the PC or the emulated product: what was tried and what was lost."""
import argparse
import os
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "live"))
import images  # noqa: E402
import line  # noqa: E402
import power  # noqa: E402
from bench import Bench  # noqa: E402

CASES = [power.kills, power.power_cuts, line.downloads, line.noise, line.noisy_programs, line.two_hosts,
         line.stops_reading, images.blind, images.refusals, images.steps]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True)
    parser.add_argument("--board", choices=("host", "stm32f405"), default="host")
    parser.add_argument("--share", type=float, default=1.0, help="of the full counts")
    parser.add_argument("case", nargs="*", help="names; all when absent")
    a = parser.parse_args()
    unknown = set(a.case) - {case.__name__ for case in CASES}
    if unknown or not 0 < a.share <= 1:
        parser.error(f"cases: {' '.join(case.__name__ for case in CASES)}; 0 < share <= 1")
    all_lost = 0
    print(f"{'case':<16}{'tried':>10}{'lost':>6}{'s':>7}   what")
    for case in CASES:
        if a.case and case.__name__ not in a.case:
            continue
        if a.board != "host" and case in (power.power_cuts, line.stops_reading, images.steps):
            continue  # tests/target cuts the real driver's power; the emulator waits for a host; steps needs no board
        with tempfile.TemporaryDirectory(prefix="beamfit_survival_") as directory:
            begin = time.monotonic()
            bench = Bench(os.path.abspath(a.build), directory, a.board != "host")
            try:
                tried, lost, note = case(bench, a.share)
            finally:
                bench.close()
            seconds = time.monotonic() - begin
        all_lost += lost
        print(f"{case.__name__:<16}{tried:>10}{lost:>6}{seconds:>7.0f}   {case.__doc__}\n{'':>42}{note}", flush=True)
    if all_lost:
        sys.exit(f"survival: {all_lost} LOST")


if __name__ == "__main__":
    main()
