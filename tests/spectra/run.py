# SPDX-License-Identifier: GPL-3.0-or-later
"""One simulated beam from time records, from H1 responses with coherence and from a list of its frequencies; coverage of the intervals."""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import time

import signals

HERE = os.path.dirname(os.path.abspath(__file__))
TRUE = {"EI_beam_Nm2": 2.1, "rho_beam_kgpm": 0.21, "cDI_beam_sNm2": 1e-5, "gamma_sNpm2": 1.0}
HITS, NOISE = 5, 0.02
RATE_HZ, SAMPLES = 1200, 4096
LINES = 1500  # up to 439 Hz, below the recorder's filter
ROOTS = (1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349, 14.1371683910)
KINDS = {"response": "H1 with coherence", "magnitude": "magnitude of H1 in dB, with coherence, without phase",
         "list": "list of five frequencies", "time": "one hit in time"}


def clean(options):
    """The hit and its answer without noise, by the truth simulator."""
    os.makedirs(options.work, exist_ok=True)
    subprocess.run([os.path.join(options.build, "beam_truth"), os.path.join(HERE, "beam.txt"), "-o", options.work], check=True,
                   stdout=subprocess.DEVNULL)
    with open(os.path.join(options.work, "beam.csv"), encoding="utf-8") as stream:
        rows = [line.split(",") for line in stream if line[0] not in "#t"]
    return [float(row[1]) for row in rows[:SAMPLES]], [float(row[2]) for row in rows[:SAMPLES]]


def measure(dice, force, answer):
    """Hits of different strength with noise of the accelerometer: [(force, answer)]."""
    sd = NOISE * math.sqrt(sum(y * y for y in answer) / len(answer))
    levels = [dice.uniform(0.7, 1.4) for _ in range(HITS)]
    return [([a * f for f in force], [a * y + dice.gauss(0, sd) for y in answer]) for a in levels]


def write(path, lines):
    with open(path, "w", encoding="utf-8") as stream:
        stream.write("\n".join(lines) + "\n")
    return path


def modes_listed(step_hz, forces, answers):
    """Frequencies: means over the hits, and their standard errors, with the spread of Student's t of few hits."""
    lines = ["mode,freq_Hz,sd_Hz"]
    for mode, root in enumerate(ROOTS):
        guess = (root / 0.5) ** 2 * math.sqrt(TRUE["EI_beam_Nm2"] / TRUE["rho_beam_kgpm"]) / (2 * math.pi)
        values = [signals.mode_of([y / f for y, f in zip(*hit)], step_hz, guess, max(4.0, 0.04 * guess))
                 for hit in zip(answers, forces)]
        mean = sum(values) / HITS
        lines.append("%d,%.9g,%.4g" % (mode + 1, mean, math.sqrt(sum((v - mean) ** 2 for v in values) / (HITS - 3) / HITS)))
    return lines


def write_set(options, number, force, answer):
    """The files of set `number`, by kind."""
    dice = random.Random("beamfit spectra %d" % number)
    hits = measure(dice, force, answer)
    step_hz = RATE_HZ / SAMPLES
    forces = [signals.transform(f)[:LINES] for f, _ in hits]
    answers = [signals.transform(y)[:LINES] for _, y in hits]
    response, coherence = signals.averaged(forces, answers)
    name, files = os.path.join(options.work, "set%03d-" % number), {}
    head = "# averages: %d\nfreq_Hz,accel_mps2/hammer_N_%s,accel_mps2/hammer_N_coherence"
    lines = range(1, LINES)
    files["response"] = write(name + "response.csv", [head % (HITS, "re,accel_mps2/hammer_N_im")] + [
        "%.12g,%.9g,%.9g,%.9g" % (k * step_hz, response[k].real, response[k].imag, coherence[k]) for k in lines])
    files["magnitude"] = write(name + "magnitude.csv", [head % (HITS, "dB")] + [
        "%.12g,%.9g,%.9g" % (k * step_hz, 20 * math.log10(abs(response[k])), coherence[k]) for k in lines])
    files["list"] = write(name + "list.csv", modes_listed(step_hz, forces, answers))
    files["time"] = write(name + "time.csv", ["time_s,hammer_N,accel_mps2"] + [
        "%.12g,%.9g,%.9g" % (k / RATE_HZ, f, y) for k, (f, y) in enumerate(zip(*hits[0]))])
    return files


def fit(options, kind, path):
    """Answer of `beamfit fit`, its parameters only; None when it did not converge."""
    model = os.path.join(HERE, "list.yaml" if kind == "list" else "model.yaml")
    done = subprocess.run([os.path.join(options.build, "beamfit"), "fit", model, path, "-o", path + ".yaml", "--force", "--json"],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit("%s: %s" % (path, done.stderr))
    answer = json.loads(done.stdout)
    return dict(answer["parameters"], noise_ratio=answer["noise_ratio"]) if answer["converged"] else None


def judge(rows, kind):
    """Lines of a table: for each parameter how often its interval holds the truth, and the scatter over the stated error."""
    lines = []
    for name, truth in TRUE.items():
        some = [row[name] for row in rows if row is not None and row[name]["sd"] is not None]
        if not some:
            continue
        inside = sum(one["ci95"][0] <= truth <= one["ci95"][1] for one in some)
        mean = sum(one["value"] for one in some) / len(some)
        stated = math.sqrt(sum(one["sd"] ** 2 for one in some) / len(some))
        scatter = math.sqrt(sum((one["value"] - mean) ** 2 for one in some) / max(len(some) - 1, 1))
        lines.append("| %s | %s | %d | %.1f %% | %.2f | %+.2f |" % (KINDS[kind], name, len(some), 100 * inside / len(some),
                                                                  scatter / stated, (mean - truth) / stated))
    return lines


def beside(first):
    """Lines of a table: the values of the first set by what they were fitted to."""
    lines = []
    for kind, row in first.items():
        cells = ["%.5g ± %.2g" % (row[name]["value"], row[name]["sd"]) if row[name]["sd"] is not None else "held or not told" for name in TRUE]
        lines.append("| %s | %s |" % (KINDS[kind], " | ".join(cells)))
    return lines


def write_page(options, number, first, tables, seconds):
    begin = subprocess.run([os.path.join(HERE, "..", "..", "tools", "results_page.sh"), "--head", "Responses, spectra without phase, lists",
                            "make spectra N=%d" % number], capture_output=True, text=True, check=True).stdout.rstrip("\n")
    head = [begin, "", "It took %.0f s." % seconds, "",
            "A cantilever of 0.5 m with a hammer and an accelerometer, simulated by `beam_truth` (tests/spectra/beam.txt). Each set has %d hits of different "
            "strength with white noise of %g %% of the answer's rms; H1 and coherence are of these %d." % (HITS, 100 * NOISE, HITS), "",
            "## One set, fitted four ways", "", "| from | " + " | ".join(TRUE) + " |", "|---" * (len(TRUE) + 1) + "|",
            "| true | " + " | ".join("%.5g" % value for value in TRUE.values()) + " |"]
    body = ["", "A list of frequencies knows EI/rho alone: rho is held there, and what damps is not told.", "", "## Intervals of 95 %% over %d sets" % number, "",
            "| from | parameter | sets | interval holds the truth | scatter/stated sd | bias/sd |", "|---|---|---|---|---|---|"]
    write(options.page, head + beside(first) + body + [line for table in tables.values() for line in table])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default=os.path.join("build", "spectra"))
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=["response", "magnitude", "list"])
    parser.add_argument("--page", metavar="FILE")
    parser.add_argument("number", nargs="?", type=int, default=200)
    options = parser.parse_args()
    begin = time.monotonic()
    force, answer = clean(options)
    rows, first = {kind: [] for kind in options.kinds}, {}
    for number in range(options.number):
        files = write_set(options, number, force, answer)
        if number == 0:
            first = {kind: fit(options, kind, files[kind]) for kind in ["time"] + options.kinds}
        for kind in options.kinds:
            rows[kind].append(first[kind] if number == 0 else fit(options, kind, files[kind]))
        for path in files.values():
            os.remove(path)
            if os.path.exists(path + ".yaml"):
                os.remove(path + ".yaml")
    tables = {kind: judge(rows[kind], kind) for kind in options.kinds}
    print("\n".join(beside(first) + [line for table in tables.values() for line in table]))
    for kind in options.kinds:
        print("%s: %d of %d not converged" % (kind, sum(row is None for row in rows[kind]), len(rows[kind])))
    if options.page:
        write_page(options, options.number, first, tables, time.monotonic() - begin)


if __name__ == "__main__":
    main()
