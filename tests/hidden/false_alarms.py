# SPDX-License-Identifier: GPL-3.0-or-later
"""Effect-free sets with coloured noise: in how many does `beamfit diagnose` say that something is missing?"""

import argparse
import json
import math
import os
import random
import sys
import time

import cases as hidden
import run

# Middle and relative spread of the true numbers of such a beam; EI and rho of the beam as the priors of rigs/short.yaml.
BEAM = {"EI_beam_Nm2": (0.495, 0.03), "EI_patch_Nm2": (0.78, 0.10), "rho_beam_kgpm": (0.0925, 0.01),
        "rho_patch_kgpm": (0.44, 0.10), "cDI_beam_sNm2": (0.66e-5, 0.15), "cDI_patch_sNm2": (1.2e-5, 0.15),
        "gamma_sNpm2": (0.0128, 0.2), "Ks_V": (40.0, 0.12), "KB_NmpV": (0.0175, 0.12)}
COLOUR = (0.5, 0.9)  # coefficient of the first-order autoregression, drawn evenly
NAMED_BAR = 0.025


def draw(number):
    """Set number: its beam and colour are functions of the number alone."""
    dice = random.Random("beamfit false alarm %d" % number)
    beam = {key: "%.6g" % (middle * math.exp(spread * max(-2, min(2, dice.gauss(0, 1)))))
            for key, (middle, spread) in BEAM.items()}
    beam["seed"] = str(100000 + number)
    case = hidden.Case("n%03d" % number, hidden.Rig("short"), beam)
    case.hidden = [([], "noise_ar %.3f 0" % dice.uniform(*COLOUR))]
    return case


def write_page(rows, lines, options):
    """The page of results (--page): the counts, and the sets that are not `complete`."""
    with open(options.page, "w", encoding="utf-8") as stream:
        stream.write(run.head("False alarms", "make false-alarms N=%d PAGE=%s" % (options.number, options.page))
                     + "What is drawn: [hidden.md](../hidden.md).\n\n```\n" + "\n".join(lines) + "\n```\n")
        others = [row for row in rows if row["verdict"] != "complete"]
        if others:
            stream.write("\n| set | noise | verdict | named |\n|---|---|---|---|\n")
        for row in others:
            stream.write("| %s | %s | %s | %s |\n" % (row["case"], row["noise"], row["verdict"], " + ".join(row["named"])))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default=os.path.join("build", "false_alarms"))
    parser.add_argument("--jobs", type=int, default=2, help="simulations at once")
    parser.add_argument("--limit", type=float, default=300, help="seconds for one diagnosis")
    parser.add_argument("--page", metavar="FILE", help="write the counts as a page of docs/results, too")
    parser.add_argument("number", nargs="?", type=int, default=200)
    options = parser.parse_args()
    begin = time.monotonic()
    chosen = [draw(k) for k in range(1, options.number + 1)]
    made = hidden.make_all(chosen, os.path.join(options.build, "beam_truth"), options.work, options.jobs)
    print("%d recordings simulated in %.0f s" % (made, time.monotonic() - begin), flush=True)
    begin, rows = time.monotonic(), []
    for case in chosen:
        directory = os.path.join(options.work, case.name)
        row = run.diagnose(os.path.join(options.build, "beamfit"), case, directory, case.rig.noise, False, options.limit)
        rows.append({**row, "noise": case.hidden[0][1]})
        if row["verdict"] != "complete":
            print("%s %s: %s %s, %s" % (case.name, case.hidden[0][1], row["verdict"], "+".join(row["named"]),
                                        row["text"] if row["outcome"] == "failed" else ""), flush=True)
    with open(os.path.join(options.work, "results.json"), "w", encoding="utf-8") as stream:
        json.dump(rows, stream, indent=1)
    lines = []
    for verdict in ("complete", "missing", "ambiguous", "unknown", "failed"):
        count = sum(row["verdict"] == verdict for row in rows)
        lines.append("%-10s %4d of %d" % (verdict, count, len(rows)))
    named = sum(row["verdict"] in ("missing", "ambiguous") for row in rows)
    failed = sum(row["verdict"] == "failed" for row in rows)
    met = named <= NAMED_BAR * len(rows) and failed == 0
    lines.append("an effect is named in %.1f %%   bar %g %%  %s   (%.0f s)" % (100 * named / len(rows), 100 * NAMED_BAR,
                 "met" if met else "NOT MET", time.monotonic() - begin))
    print("\n".join(lines))
    if options.page:
        write_page(rows, lines, options)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
