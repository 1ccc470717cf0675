# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs `beamfit diagnose` on the hidden cases and judges it: docs/hidden.md. `run.py --help` lists the modes."""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import time

import cases as hidden

MIMIC = 1.1  # held-out residual / noise below which an explanation counts as predicting to the floor (issue: 1.1)
MATE = 0.005  # an effect that comes so near the truth's own noise ratios, fitted and held out, is its class mate (docs/hidden.md)
BARS = {"plain": 0.95, "subtle": 0.90, "clean": 1.0, "outside": 1.0, "pair": 0.75}
GOOD = ("right", "class", "mimic")
# For `make test`: cheap ones, clean, of the structure, of damping, of the measurement chain, on another sensor than the piezo.
FAST = ("h01", "h08", "h18", "h31", "h62", "h66")


def call(command, limit_s):
    """(parsed JSON or None, message, seconds) of a beamfit command."""
    begin = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit_s, check=False)
        message = done.stderr.strip().splitlines()[-1:] or [""]
        answer = json.loads(done.stdout) if done.returncode == 0 else None
        if answer is None:
            message = ["status %d: %s" % (done.returncode, message[0])]
    except subprocess.TimeoutExpired:
        answer, message = None, ["no answer in %g s" % limit_s]
    except json.JSONDecodeError as error:
        answer, message = None, ["not JSON: %s" % error]
    return answer, message[0], time.monotonic() - begin


def judge(strength, truth, mates, verdict, named, check_ratio):
    """One word for what diagnose said; docs/hidden.md defines each."""
    truth, named, kin = set(truth), set(named), set(truth) | set(mates)
    if strength == "clean":
        return {"complete": "right", "missing": "WRONG"}.get(verdict, "alarm")
    if verdict == "unknown":
        return "right" if strength == "outside" else "unknown"
    if verdict == "complete":
        return "missed"
    if strength == "outside":
        if check_ratio <= MIMIC:
            return "mimic"
        return "WRONG" if verdict == "missing" else "astray"
    if verdict == "missing":
        if named == truth:
            return "right"
        if named <= kin:
            return "class" if len(named) == len(truth) else "partial"
        return "WRONG"
    if named <= kin and named & truth:
        return "class" if len(truth) == 1 else "partial"
    return "wide" if named & truth else "astray"


def number(answer, key):
    value = answer.get(key)
    return math.nan if value is None else float(value)


def diagnose(program, case, directory, noise, without, limit_s, drawn=False):
    """Runs diagnose on one case; the row of the result table as a dict. drawn: nobody has listed its class mates."""
    command = [program, "diagnose", os.path.join(directory, "model.yaml")] + hidden.record_files(directory, "train")
    command += ["--check"] + hidden.record_files(directory, "check") + ["--json"]
    strength, truth = case.strength, case.truth
    removed = sorted(set(case.truth) | set(case.mates))
    if without:
        command += ["--without", ",".join(removed)]
        strength = "outside"
    answer, message, seconds = call(command, limit_s)
    row = {"case": case.name, "strength": case.strength, "truth": truth, "mates": case.mates, "seconds": seconds}
    if answer is None:
        return {**row, "verdict": "failed", "named": [], "outcome": "failed", "text": message}
    check_before, check_after = (number(answer, "check_nrmse_" + when) / noise for when in ("before", "after"))
    row.update(verdict=answer["verdict"], named=answer["effects"], before=number(answer, "noise_ratio_before"),
               after=number(answer, "noise_ratio_after"), check_before=check_before, check_after=check_after,
               text=answer.get("text", ""))
    row["outcome"] = judge(strength, truth, case.mates, row["verdict"], row["named"], check_after)
    if without and len(row["named"]) > 0:
        found_mate(row, refit(program, case, directory, limit_s), answer["candidates"])
    elif drawn and row["outcome"] in ("WRONG", "wide", "astray"):
        measure_mates(row, refit(program, case, directory, limit_s), answer["candidates"])
    row["candidates"] = [[c["effects"], c.get("noise_ratio_after"), c.get("check_noise_ratio_after")]
                         for c in answer["candidates"]]
    best = answer["candidates"][0] if answer["candidates"] else {}
    estimates = best.get("parameters", {}) if set(best.get("effects", [])) == set(truth) else {}
    row["covered"] = coverage(case, estimates)
    return row


def is_mate(candidate, truth):
    """A single effect that does what the truth does (its row of refit()), in fitted and held-out records."""
    return len(candidate["effects"]) == 1 and candidate["noise_ratio_after"] <= truth.get("after", math.nan) + MATE \
        and candidate["check_noise_ratio_after"] <= truth.get("check_after", math.nan) + MATE


def found_mate(row, truth, candidates):
    """Truth removed: the named are single effects, and the best does what the truth does: a class mate remained."""
    row["truth_after"], row["truth_check_after"] = truth.get("after", math.nan), truth.get("check_after", math.nan)
    if is_mate(candidates[0], truth):
        row["outcome"] = "mate"


def measure_mates(row, truth, candidates):
    """Judged again with the class mates that these very recordings have."""
    row["mates"] = sorted({c["effects"][0] for c in candidates if is_mate(c, truth)} - set(row["truth"]))
    row["outcome"] = judge(row["strength"], row["truth"], row["mates"], row["verdict"], row["named"], row["check_after"])


def coverage(case, estimates):
    """[[name, truth, estimate, interval, inside]] of the effects' parameters; per-record values are left out."""
    rows = []
    for effect, values, _ in case.effects():
        for name, value in values.items():
            estimate = estimates.get(name) or estimates.get(effect + "." + name) or {}
            low, high = estimate.get("ci95") or (None, None)
            if low is not None and high is not None and not isinstance(value, dict):
                rows.append([effect + "." + name, value, estimate["value"], [low, high], low <= value <= high])
    return rows


def refit(program, case, directory, limit_s):
    """Adds the truth to the handbook model, fits, and compares estimates with what was hidden."""
    model, fitted = os.path.join(directory, "model.yaml"), os.path.join(directory, "with_truth.yaml")
    row = {"case": case.name, "strength": case.strength, "truth": case.truth, "covered": [], "seconds": math.nan}
    for effect, values, channel in case.effects():
        command = [program, "add", model, effect, "-o", fitted + ".start"]
        command += ["%s=%.9g" % item for item in values.items() if not isinstance(item[1], dict)]
        command += ["--channel", channel] if channel else []
        command += ["--free", "at_m"] if "at_m" in values else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return {**row, "text": done.stderr.strip()}
        os.replace(fitted + ".start", fitted)
        model = fitted
    command = [program, "fit", model] + hidden.record_files(directory, "train") + ["-o", fitted, "--force", "--json"]
    answer, message, row["seconds"] = call(command + ["--check"] + hidden.record_files(directory, "check"), limit_s)
    if answer is None:
        return {**row, "text": message}
    row.update(after=answer["noise_ratio"], check_after=answer["check"]["noise_ratio"], text="")
    row["covered"] = coverage(case, answer["parameters"])
    return row


def show(row):
    """One line of the table."""
    ratios = " ".join("%7.2f" % row.get(key, math.nan) for key in ("before", "after", "check_before", "check_after"))
    print("%-26s %-34s %-9s %-40s %-8s %s %6.1f" % (row["case"], "+".join(row["truth"]) or "-", row["verdict"],
          "+".join(row["named"]) or "-", row["outcome"], ratios, row["seconds"]), flush=True)
    if row["outcome"] == "failed":
        print("    " + row["text"], flush=True)


def totals(rows, without):
    """(lines that give the counts against the bars of the issue, True when all that were run are met)"""
    met, lines = True, []

    def line(name, good, total, bar):
        nonlocal met
        if total == 0:
            return
        ok = good >= bar * total
        met = met and ok
        lines.append("%-28s %3d of %3d = %5.1f %%   bar %g %%  %s" % (name, good, total, 100 * good / total, 100 * bar,
                                                                     "met" if ok else "NOT MET"))

    if without:
        for strength in ("plain", "subtle"):
            inside = [row for row in rows if row["strength"] == strength and row["outcome"] != "mate"]
            line("%s, no mate left: unknown" % strength, sum(row["verdict"] == "unknown" for row in inside), len(inside), 0.9)
        lines.append("%-28s %3d" % ("class mates found", sum(row["outcome"] == "mate" for row in rows)))
        lines.append("%-28s %3d" % ("others that reach the floor", sum(row["outcome"] == "mimic" for row in rows)))
    else:
        for strength, bar in BARS.items():
            group = [row for row in rows if row["strength"] == strength]
            line(strength, sum(row["outcome"] in GOOD for row in group), len(group), bar)
    wrong = [row["case"] for row in rows if row["outcome"] == "WRONG"]
    lines.append(("%-28s %3d   bar 0  %s %s" % ("confident wrong names", len(wrong), "NOT MET" if wrong else "met",
                                              " ".join(wrong))).rstrip())
    single = [row for row in rows if row["strength"] in ("plain", "subtle") and row["outcome"] in ("right", "class")]
    if single and not without:
        line("check <= 1.1 x noise after", sum(row["check_after"] <= MIMIC for row in single), len(single), 1.0)
    intervals = [item[4] for row in rows for item in row.get("covered", [])]
    if intervals:
        lines.append("%-28s %3d of %3d = %5.1f %%   bar 90 to 97 %%" % ("95 % intervals that hold truth", sum(intervals),
                     len(intervals), 100 * sum(intervals) / len(intervals)))
    seconds = [row["seconds"] for row in rows]
    lines.append("%-28s median %.1f, longest %.1f, sum %.0f" % ("seconds", statistics.median(seconds), max(seconds),
                                                                sum(seconds)))
    return lines, met and not wrong


def head(title, command):
    """How a page of docs/results begins."""
    tool = os.path.join(hidden.TOP, "tools", "results_page.sh")
    return subprocess.run([tool, "--head", title, command], capture_output=True, text=True, check=True).stdout


def write_page(rows, lines, options):
    """The page of results (--page): the counts, and a row for each case."""
    words = options.cases + ["--" + mode for mode in ("open", "without-truth") if getattr(options, mode.replace("-", "_"))]
    command = " ".join(["make hidden"] + (["CASES='%s'" % " ".join(words)] if words else []) + ["PAGE=" + options.page])
    title = "Hidden cases" + (", truth and class mates taken from the catalogue" if options.without_truth else "")
    number = lambda row, key: "%.3g" % row[key] if key in row and not math.isnan(row[key]) else ""
    with open(options.page, "w", encoding="utf-8") as stream:
        stream.write(head(title, command) + "What the words mean: [hidden.md](../hidden.md).\n\n```\n" + "\n".join(lines) + "\n```\n\n"
                     + "| case | kind | truth | verdict | named | outcome | fitted before | after | held out before | after | s |\n"
                     + "|---|---|---|---|---|---|---|---|---|---|---|\n")
        for row in rows:
            cells = [row["case"], row["strength"], " + ".join(row["truth"]), row["verdict"], " + ".join(row["named"]), row["outcome"]]
            cells += [number(row, key) for key in ("before", "after", "check_before", "check_after")] + ["%.1f" % row["seconds"]]
            stream.write("| " + " | ".join(cells) + " |\n")


def open_cases():
    """(case, directory) of the shared open cases, whose answers come from another simulator."""
    folder = os.path.join(os.environ.get("BEAMFIT_SHARED", os.path.join(hidden.TOP, "..", "shared")), "data", "open")
    if not os.path.isdir(folder):
        print("SKIPPED: %s is not there" % folder)
        sys.exit(0)
    for name in sorted(os.listdir(folder)):
        answer = os.path.join(folder, name, "answer.txt")
        if not os.path.exists(answer):
            continue
        with open(answer, encoding="utf-8") as stream:
            truth = stream.readline().split(":")[1].strip()
        case = hidden.Case(name, None, {})
        case.strength, case.truth = ("clean", []) if truth == "clean" else ("plain", [truth])
        yield case, os.path.join(folder, name)


def with_truth(program, chosen, limit_s):
    """Table of refits with the truth added: what an ideal diagnosis could reach, and the coverage of its intervals."""
    rows, inside, total = [], 0, 0
    print("%-26s %-34s %7s %7s %6s  %s" % ("case", "truth", "after", "check", "s", "estimates (truth, interval)"))
    for case, directory, _ in chosen:
        if case.strength in ("clean", "outside"):
            continue
        row = refit(program, case, directory, limit_s)
        rows.append(row)
        inside += sum(item[4] for item in row["covered"])
        total += len(row["covered"])
        texts = ["%s %.4g (%.4g, %.4g..%.4g)%s" % (n, e, v, ci[0], ci[1], "" if good else " MISSES")
                 for n, v, e, ci, good in row["covered"]]
        print("%-26s %-34s %7.3f %7.3f %6.1f  %s" % (row["case"], "+".join(row["truth"]), row.get("after", math.nan),
              row.get("check_after", math.nan), row["seconds"], "; ".join(texts) or row["text"]), flush=True)
    print("95 %% intervals: %d of %d hold the truth" % (inside, total))
    reached = [row for row in rows if row.get("check_after", math.nan) <= MIMIC]
    print("check records within %g x noise: %d of %d" % (MIMIC, len(reached), len(rows)))
    return rows


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", help="names, strengths, effects or rigs; none: all")
    parser.add_argument("--build", default="build", help="directory with beamfit and beam_truth")
    parser.add_argument("--work", default=os.path.join("build", "hidden"), help="directory for recordings and results")
    parser.add_argument("--jobs", type=int, default=2, help="simulations at once (diagnose itself uses all cores)")
    parser.add_argument("--limit", type=float, default=600, help="seconds for one diagnosis")
    parser.add_argument("--fast", action="store_true", help="the cheap cases of `make test`")
    parser.add_argument("--open", action="store_true", help="the open cases of ../shared instead")
    parser.add_argument("--drawn", metavar="DIR", help="the cases that draw.py has written there instead")
    parser.add_argument("--without-truth", action="store_true", help="truth and class mates are taken from the catalogue")
    parser.add_argument("--with-truth", action="store_true", help="no diagnosis: add the truth, fit, compare estimates")
    parser.add_argument("--page", metavar="FILE", help="write the table as a page of docs/results, too")
    parser.add_argument("--generate", action="store_true", help="only make the recordings")
    return parser.parse_args()


def choose(options):
    """[(case, directory, relative noise)]; hidden recordings are made when they are missing."""
    if options.open:
        return [(case, directory, 0.004) for case, directory in open_cases()
                if not options.cases or {case.name, case.strength, *case.truth} & set(options.cases)]
    chosen = hidden.read_cases(FAST if options.fast else options.cases, options.drawn or hidden.DATA)
    begin = time.monotonic()
    made = hidden.make_all(chosen, os.path.join(options.build, "beam_truth"), options.work, options.jobs)
    if made:
        print("%d recordings simulated in %.0f s" % (made, time.monotonic() - begin))
    return [(case, os.path.join(options.work, case.name), case.rig.noise) for case in chosen]


def save(rows, path):
    with open(path, "w", encoding="utf-8") as stream:
        json.dump(rows, stream, indent=1)


def main():
    options = arguments()
    if options.page and (options.with_truth or options.generate):
        raise SystemExit("--page: only a diagnosis has a page")
    program = os.path.join(options.build, "beamfit")
    chosen = choose(options)
    if options.without_truth:
        chosen = [item for item in chosen if item[0].strength in ("plain", "subtle")]
    if not chosen:
        raise SystemExit("no case left: " + " ".join(options.cases))
    if options.generate:
        return 0
    kind = "with_truth" if options.with_truth else "without_truth" if options.without_truth else "results"
    os.makedirs(options.work, exist_ok=True)
    result = os.path.join(options.work, ("open_" if options.open else "") + kind + ".json")
    if options.with_truth:
        rows = with_truth(program, chosen, options.limit)
        save(rows, result)
        met = True
    else:
        print("%-26s %-34s %-9s %-40s %-8s %s %6s" % ("case", "truth", "verdict", "named", "outcome",
              " ".join("%7s" % word for word in ("before", "after", "check<", "check>")), "s"))
        rows = []
        for case, directory, noise in chosen:
            rows.append(diagnose(program, case, directory, noise, options.without_truth, options.limit, options.drawn))
            show(rows[-1])
            save(rows, result)
        print()
        lines, met = totals(rows, options.without_truth)
        print("\n".join(lines))
        if options.page:
            write_page(rows, lines, options)
    print("rows: " + result)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
