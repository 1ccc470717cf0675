#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""One model fitted to many simulated records on ranks of MPI: time, efficiency, memory of a rank, bits, and plain `fit` of some. Writes a page."""

import argparse
import datetime
import json
import os
import random
import resource
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

from draw import DRAWN, HELD, MODEL, SPEC

SUBSET = 24  # records that `beamfit fit` takes in one memory, too


def make(number, options):
    """Record `number` of the one beam: a hit of its own, by the truth simulator. Those that are there are not made again."""
    dice = random.Random("many %d" % number)
    path = os.path.join(options.work, "records", "r%05d" % number)
    if os.path.exists(path + ".csv"):
        return
    lines = [SPEC % options.duration] + ["%s %.17g\n" % (name, mean) for name, (mean, _) in DRAWN.items()]
    lines += ["%s %.17g\n" % item for item in HELD.items()] + ["noise 0.004\n", "blind 1\n", "seed %d\n" % (number + 1)]
    lines.append("signal hammer_N raised_cosine start_s=0.15 width_s=%.4g level=%.4g\n" % (
        dice.uniform(0.008, 0.014), dice.uniform(1, 20)))
    with open(path + ".txt", "w", encoding="utf-8") as stream:
        stream.write("".join(lines))
    subprocess.run([os.path.join(options.build, "beam_truth"), path + ".txt", "-o", os.path.dirname(path)], check=True,
                   stdout=subprocess.DEVNULL)


def measured(words):
    """Answer of a command, its seconds, processor seconds, and MiB of its largest process."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(["/usr/bin/time", "-f", "peak %M", *words, "--json"], capture_output=True, text=True, check=True)
    seconds, after = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    peak = max(int(line.split()[1]) for line in done.stderr.splitlines() if line.startswith("peak "))
    return json.loads(done.stdout), seconds, used, peak / 1024


def fresh(options, name):
    path = os.path.join(options.work, name)
    if os.path.exists(path):
        os.remove(path)
    return path


def names(options, count):
    return [os.path.join(options.work, "records", "r%05d.csv" % k) for k in range(count)]


def ranks(options, say):
    say("| records | ranks | seconds | efficiency | processor seconds | memory of the largest rank, MiB | evaluations |\n|---|---|---|---|---|---|---|")
    program, first = os.path.join(options.build, "beamfit-fleet"), None
    for count in options.records:
        kept = None
        for n in options.ranks:
            words = ["mpirun", "--oversubscribe", "-n", str(n), "/usr/bin/time", "-f", "peak %M", program, "fit",
                     os.path.join(options.work, "model.yaml"), *names(options, count), "-o", fresh(options, "fitted.yaml")]
            answer, seconds, used, peak = measured(words)
            fit = answer["fit"]
            fit.pop("seconds")
            first = (seconds, n) if kept is None else first
            if kept is not None and fit != kept:
                raise SystemExit("the numbers of %d ranks differ" % n)
            kept = fit
            say("| %d | %d | %.1f | %.2f | %.1f | %.0f | %d |" % (
                count, n, seconds, first[0] * first[1] / (seconds * min(n, os.cpu_count())), used, peak, fit["evaluations"]))
    say("\nSeconds: all of the command, reading and the noise of every channel included. Efficiency: against %d rank, over the ranks or the "
        "machine's %d cores, whichever is less. Numbers of all ranks: equal, bit for bit, those of each record too." % (first[1], os.cpu_count()))
    return kept


def values(options, fit, say):
    say("\n| parameter | drawn | found | off, in standard errors |\n|---|---|---|---|")
    for name, (true, _) in DRAWN.items():
        one = fit["parameters"][name]
        say("| `%s` | %.6g | %.6g ± %.2g | %.2f |" % (name, true, one["value"], one["sd"], (one["value"] - true) / one["sd"]))
    beamfit = os.path.join(options.build, "beamfit")
    start = os.path.join(options.work, "fitted.yaml")
    words = [start, *names(options, SUBSET), "--start", "near", "-o"]
    one, other = fresh(options, "whole.yaml"), fresh(options, "shared.yaml")
    whole = json.loads(subprocess.run([beamfit, "fit", *words, one, "--json"], capture_output=True, check=True).stdout)
    shared = json.loads(subprocess.run([beamfit, "fleet", "fit", *words, other, "--json"], capture_output=True,
                                       check=True).stdout)["fit"]
    off = max(abs(shared["parameters"][name]["value"] - p["value"]) / p["sd"] for name, p in whole["parameters"].items() if p["sd"])
    sd = max(abs(shared["parameters"][name]["sd"] / p["sd"] - 1) for name, p in whole["parameters"].items() if p["sd"])
    say("\n`beamfit fit` of %d of the records, from the same values: at most %.1g standard errors away, standard errors at most %.1g of themselves." %
        (SUBSET, off, sd))
    say("\nThe truth simulator's own tolerance is 3e-7 of the signal: standard errors below that size are not tested by this, and whether it is what EI and EI_patch are off by has not been tried.")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default="build/many")
    parser.add_argument("--records", type=int, nargs="+", default=[300, 1200])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--duration", type=float, default=4.0, help="seconds a record")
    parser.add_argument("--page", default="docs/results/many_records.md")
    options = parser.parse_args()
    options.build, lines = os.path.abspath(options.build), []
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OPENBLAS_NUM_THREADS="1")
    os.makedirs(os.path.join(options.work, "records"), exist_ok=True)
    with open(os.path.join(options.work, "model.yaml"), "w", encoding="utf-8") as stream:
        stream.write(MODEL % "")
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda k: make(k, options), range(max(options.records))))

    def say(text):
        lines.append(text)
        print(text, flush=True)

    version = subprocess.run([os.path.join(options.build, "beamfit"), "--version"], capture_output=True, text=True, check=True).stdout.strip()
    say("# One model, many records\n\nMade by `make many-bench RECORDS='%s' RANKS='%s'`, %s, %s, %d cores. Hits of one simulated beam, %.0f samples, two "
        "outputs, 0.4 %% of noise.\n" % (" ".join(map(str, options.records)), " ".join(map(str, options.ranks)), datetime.date.today(), version,
                                        os.cpu_count(), 512 * options.duration))
    values(options, ranks(options, say), say)
    with open(options.page, "w", encoding="utf-8") as stream:
        stream.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
