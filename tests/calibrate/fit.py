# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the table of probabilities to the answers that run.py has stored, or judges answers by their own probabilities: docs/calibration.md.

    python3 tests/calibrate/fit.py --seeds 1 2             fits; writes host/explain/probability_table.c and results/calibration
    python3 tests/calibrate/fit.py --update --seeds 3      moves the present table as far as these answers ask for it: few answers change little
    python3 tests/calibrate/fit.py --judge --seeds 11 12   judges other seeds; writes results/drawn_imperfect
"""

import argparse
import collections
import math
import os
import re
import sys

import answers
import logistic
import page
import records

RIDGE = 1.0  # a weight of a standardised feature is near 0, with a standard deviation of 1, before anything is known
STAYS = 30.0  # the same of what an update adds to the present weights: what 120 entries at even odds tell of one of them
LACKING = 0.1  # of the beams that lack something, those that lack what the catalogue does not have; the drawn cases hold more of them
CLOSE = 0.8  # a wrong name that is said with more is listed


def entries(rows):
    """[(row, entry, features, label)] and the names of the features."""
    found, names = [], None
    for row in rows:
        for entry in answers.decisions(row):
            if entry.get("beside"):
                continue  # a product of two probabilities, of which the features tell one
            names = names or list(entry["features"])
            if list(entry["features"]) != names:
                raise SystemExit("%s: its features are %s, others have %s" % (row["case"], list(entry["features"]), names))
            values = [math.nan if entry["features"][name] is None else float(entry["features"][name]) for name in names]
            if all(map(math.isfinite, values)):
                found.append((row, entry, values, answers.label(row, entry)))
    if not found:
        raise SystemExit("no answer has a `decision`: run.py has found nothing to weigh")
    return found, names


def is_lacking(row):
    return row["kind"] in ("removed", "outside")


def counts_of(rows, found):
    """What each entry stands for: every answer counts the same, however many questions it asks, and the cause of one beam in ten is outside the catalogue."""
    lacking = sum(map(is_lacking, rows))
    known = sum(row["kind"] != "clean" for row in rows) - lacking
    count = LACKING / (1 - LACKING) * known / lacking if lacking else 1.0
    asked = collections.Counter((row["case"], row["kind"]) for row, _, _, _ in found)
    usual = len(found) / len(asked)
    return [(count if is_lacking(row) else 1.0) * usual / asked[row["case"], row["kind"]] for row, _, _, _ in found]


def table_source(model, names, count, command):
    """As clang-format would have it."""
    weights = ["[FEATURE_%s] = %.6g" % (name.upper(), weight) for name, weight in zip(names, model[1])]
    one_line = "        {" + ", ".join(weights) + "},"
    table = ["    .weight =", one_line] if len(one_line) <= 120 else ["    .weight = {" + ",\n               ".join(weights) + "},"]
    lines = ["/* SPDX-License-Identifier: GPL-3.0-or-later */", "/* Written by `%s`: %s. */" % (command, count),
             '#include "probability.h"', "", "const struct probability_table probability_table = {", "    .intercept = %.6g," % model[0],
             *table, "};", ""]
    return "\n".join(lines)


def present_table(path, names):
    """(intercept, weights) that the C source has."""
    with open(path, encoding="utf-8") as stream:
        source = stream.read()
    weights = {name.lower(): float(value) for name, value in re.findall(r"\[FEATURE_(\w+)\] = ([-+.\de]+)", source)}
    if sorted(weights) != sorted(names):
        raise SystemExit("%s: its features are %s, the answers have %s" % (path, sorted(weights), sorted(names)))
    return float(re.search(r"\.intercept = ([-+.\de]+)", source).group(1)), [weights[name] for name in names]


def with_diagram(text, bins, title, path):
    """Adds the reliability table and the diagram, which is written beside the page."""
    picture = os.path.splitext(path)[0] + ".svg"
    page.write(picture, page.diagram(bins, title))
    return text + "![%s](%s)\n\n" % (title, os.path.basename(picture)) + page.reliability_table(bins)


def calibrate(rows, options):
    found, names = entries(rows)
    values, labels = [f[2] for f in found], [f[3] for f in found]
    kinds = [f[0]["kind"] for f in found]
    counts = counts_of(rows, found)
    start = present_table(options.table, names) if options.update else None
    said = logistic.cross_validated(values, labels, [f[0]["case"] for f in found], options.ridge, counts, start)
    model = logistic.fit(values, labels, options.ridge, counts, start)
    command = "make calibrate SEED='%s'%s" % (" ".join(str(seed) for seed in options.seeds if seed), " UPDATE=1" if options.update else "")
    count = "%d cases, %d answers, %d entries, of them %d right" % (len({row["case"] for row in rows}), len(rows), len(found), sum(labels))
    text = page.head("Calibration of the probability", command) + "What is drawn and what counts as right: [calibration.md](../calibration.md).\n\n"
    text += "Seeds %s (0: data/hidden): %s. Logistic regression, ridge penalty %g on standardised features%s; every answer counts the same, however many questions it asks; the cause of one beam in ten is taken to be outside the catalogue. The figures below are cross-validated: ten folds, a case " \
        "in one of them with all its answers.\n\n" % (" ".join(map(str, options.seeds)), count, options.ridge, ", of what is added to the table that was there before" if options.update else "")
    text += page.brier_table(kinds, said, labels) + "\n"
    text = with_diagram(text, logistic.reliability(said, labels), "Calibration, cross-validated", options.page)
    deviation = [math.sqrt(sum((v[j] - sum(u[j] for u in values) / len(values)) ** 2 for v in values) / len(values)) for j in range(len(names))]
    text += "\n" + page.table(("feature", "weight", "weight × standard deviation of the feature"),
                              [(name, "%.4g" % w, "%.3g" % (w * d)) for name, w, d in zip(names, model[1], deviation)] + [("intercept", "%.4g" % model[0], "")])
    text += "\nWhat the program said with the table that it had:\n\n" + page.outcome_table(rows)
    if not options.no_table:
        page.write(options.table, table_source(model, names, count, command))
    page.write(options.page, text)
    print("%s; Brier score %.4f, cross-validated" % (count, logistic.brier(said, labels)))


def wrong_names(rows):
    """Wrong names with a probability above CLOSE, for each kind, as lines of a table."""
    lines = []
    for row in rows:
        p = answers.named_probability(row)
        if answers.outcome(row) == "WRONG" and p is not None and p > CLOSE:
            lines.append((row["case"], row["kind"], " + ".join(row["truth"]), " + ".join(row["answer"]["effects"]), "%.3f" % p,
                          "%.1f" % row["clean_ratio"], "%.1f" % row["ratio"]))
    return lines


def judge(rows, options):
    command = "make drawn-imperfect SEED='%s' N=%d" % (" ".join(map(str, options.seeds)), options.number)
    text = page.head("Drawn imperfect rigs", command) + "What is drawn and what the words mean: [calibration.md](../calibration.md).\n\n"
    text += page.outcome_table(rows) + "\n"
    judged = [(row, entry, answers.label(row, entry)) for row in rows for entry in answers.decisions(row) if entry.get("probability") is not None]
    if judged:
        said, labels = [float(e["probability"]) for _, e, _ in judged], [y for _, _, y in judged]
        text += "Every group of explanations that the answers weigh:\n\n" + page.brier_table([row["kind"] for row, _, _ in judged], said, labels) + "\n"
        text = with_diagram(text, logistic.reliability(said, labels), "Drawn imperfect rigs", options.page)
        print("Brier score %.4f of %d entries" % (logistic.brier(said, labels), len(labels)))
    named = [(row, answers.named_probability(row)) for row in rows if answers.named_probability(row) is not None]
    if named:
        labels = [int(answers.outcome(row) in ("right", "class", "also")) for row, _ in named]
        text += "\nThe answers that name something:\n\n" + page.brier_table([row["kind"] for row, _ in named], [p for _, p in named], labels)
    lines = wrong_names(rows)
    text += "\n## Wrong names with a probability above %g\n\n" % CLOSE
    text += page.table(("case", "kind", "truth", "named", "probability", "clean ×", "ratio ×"), lines) if lines else "None.\n"
    removed = [row for row in rows if row["kind"] == "removed"]
    if removed:
        text += "\nTruth removed: %d of %d answers.\n" % (sum(line[1] == "removed" for line in lines), len(removed))
    alarms = [row for row in rows if row["kind"] == "clean" and (row.get("answer") or {}).get("verdict") != "complete"]
    text += "\n## Clean rigs that are not `complete`\n\n" + page.table(("case", "state", "verdict", "named", "also true of the rig", "clean ×"), [
        (row["case"], row["state"], (row["answer"] or {}).get("verdict", ""), " + ".join((row["answer"] or {}).get("effects", [])), " ".join(row["also_true"]),
         "%.2f" % row["clean_ratio"]) for row in alarms])
    seconds = sorted(row["cpu_s"] for row in rows)
    text += "\nProcessor seconds: median %.1f, nine tenths within %.1f, longest %.1f.\n" % (seconds[len(seconds) // 2], seconds[len(seconds) * 9 // 10], seconds[-1])
    page.write(options.page, text)
    print(page.outcome_table(rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", default=os.path.join("build", "calibrate"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--judge", action="store_true", help="no fit: the probabilities that the answers have")
    parser.add_argument("--number", type=int, default=0, help="cases of each seed, for the command on the page")
    parser.add_argument("--update", action="store_true", help="from the present table")
    parser.add_argument("--ridge", type=float, help="default %g, with --update %g" % (RIDGE, STAYS))
    parser.add_argument("--table", default=os.path.join(records.TOP, "host", "explain", "probability_table.c"))
    parser.add_argument("--no-table", action="store_true", help="only the page")
    parser.add_argument("--page", help="default: calibration or drawn_imperfect below docs/results")
    options = parser.parse_args()
    options.page = options.page or os.path.join(records.TOP, "docs", "results", "drawn_imperfect.md" if options.judge else "calibration.md")
    options.ridge = options.ridge if options.ridge is not None else STAYS if options.update else RIDGE
    rows = answers.load(options.work, options.seeds, options.number)
    options.number = options.number or len({row["case"] for row in rows}) // len(options.seeds)
    (judge if options.judge else calibrate)(rows, options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
