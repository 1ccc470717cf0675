# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench of measured beams: import, fit, diagnose, fit again, and what is known of each beam beside what was found (docs/real_data.md).

Answers are kept below --work, so that single sets can be run again; the page is made of all that are there."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import sets

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
REAL = os.path.join(os.environ.get("BEAMFIT_SHARED", os.path.join(TOP, "..", "shared")), "data", "real")


class Failed(Exception):
    """A command ended without an answer."""


class Bench:
    """The commands of one set, in its own directory; counts their processor time."""

    def __init__(self, program, work, limit_s):
        self.program, self.work, self.limit_s, self.seconds = os.path.abspath(program), work, limit_s, 0.0
        os.makedirs(work, exist_ok=True)

    def run(self, *command):
        """Parsed JSON of a beamfit command, or its text."""
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = subprocess.Popen([self.program, *command], stdout=out, stderr=err, cwd=self.work)
            begin = time.monotonic()
            while True:
                done, status, usage = os.wait4(child.pid, os.WNOHANG)
                if done:
                    break
                if time.monotonic() - begin > self.limit_s:
                    child.kill()
                    done, status, usage = os.wait4(child.pid, 0)
                    child.returncode = -9
                    raise Failed("%s: no answer in %g s" % (command[0], self.limit_s))
                time.sleep(0.02)
            child.returncode = os.waitstatus_to_exitcode(status)
            self.seconds += usage.ru_utime + usage.ru_stime
            out.seek(0)
            err.seek(0)
            text, said = out.read().decode(), err.read().decode().strip().splitlines()
        if child.returncode != 0:
            raise Failed("%s: status %d: %s" % (command[0], child.returncode, (said or text.splitlines() or [""])[-1]))
        return json.loads(text) if "--json" in command else text


def errors(answer):
    """Error and residual over noise of fitted records, and the error of those held out."""
    held = (answer.get("check") or {}).get("nrmse")
    return {"nrmse": answer["nrmse"], "noise_ratio": answer["noise_ratio"], "held_out": held,
            "attainable": (answer.get("attainable") or {}).get("nrmse")}


def parameter(answer, effect, name):
    """[value, standard error] of an effect's parameter of a fit, which has a longer name where others have it, too."""
    for key in (effect + "." + name, effect + ".1." + name, name):
        found = answer["parameters"].get(key)
        if found:
            return [found["value"], found.get("sd")]
    return None


def fit(bench, chosen, model, out):
    command = ["fit", model] + [name + ".csv" for name in chosen.fitted]
    if chosen.held_out:
        command += ["--check"] + [name + ".csv" for name in chosen.held_out]
    return bench.run(*command, "-o", out, "--force", "--json")


def diagnose(bench, chosen):
    command = ["diagnose", "fitted.yaml"] + [name + ".csv" for name in chosen.fitted]
    if chosen.held_out:
        command += ["--check"] + [name + ".csv" for name in chosen.held_out]
    return bench.run(*command, "-o", "named.yaml", "--force", "--json")


def with_cause(bench, chosen, row):
    """The fit with what was named, and, where that is not the cause that is known, with this cause added by hand."""
    answer = None
    if row["effects"]:
        answer = fit(bench, chosen, "named.yaml", "named_fitted.yaml")
        row["named_fit"] = errors(answer)
    if chosen.cause and not chosen.by_hand and not is_named(row, chosen):
        bench.run("add", model_of(chosen), *(chosen.add or (chosen.cause,)), "-o", "cause.yaml", "--force")
        answer = fit(bench, chosen, "cause.yaml", "cause_fitted.yaml")
        row["cause_fit"] = errors(answer)
    if answer:
        row["values"] = [parameter(answer, chosen.cause, known[0]) for known in chosen.known]


def model_of(chosen):
    """The model that was written from the README of the recordings."""
    return os.path.join(HERE, chosen.model + ".yaml")


def is_named(row, chosen):
    """The known cause alone, or with others beside it, and not one of several that the records do not tell apart."""
    return row["verdict"] == "missing" and chosen.cause in row["effects"]


def work_through(bench, chosen, row):
    """All steps of one set; what was reached stays in row when a command fails."""
    for name, words in chosen.imports.items():
        bench.run("import", os.path.join(REAL, words[0]), *words[1:], "-o", name + ".csv", "--force")
    model = model_of(chosen)
    row["given"] = errors(bench.run("compare", model, *(name + ".csv" for name in chosen.fitted), "--json"))
    answer = fit(bench, chosen, model, "fitted.yaml")
    row["fitted"] = errors(answer)
    if chosen.by_hand:
        row["values"] = [parameter(answer, chosen.cause, known[0]) for known in chosen.known]
    answer = diagnose(bench, chosen)
    row.update(verdict=answer["verdict"], effects=answer["effects"], probability=answer.get("probability"),
               text=answer.get("text", ""), candidates=[[c["effects"], c["nrmse_after"], c.get("probability")]
                                                        for c in answer["candidates"][:8]])
    with_cause(bench, chosen, row)


def measure(name, options):
    """The row of one set, kept as JSON."""
    chosen, row = sets.SETS[name], {"set": name}
    bench = Bench(os.path.join(options.build, "beamfit"), os.path.join(options.work, name), options.limit)
    try:
        work_through(bench, chosen, row)
    except Failed as failure:
        row["failed"] = str(failure)
    row["seconds"] = bench.seconds
    with open(os.path.join(options.work, name + ".json"), "w", encoding="utf-8") as stream:
        json.dump(row, stream, indent=1)
    return row


# ---- The table ----

def percent(row, step, key="nrmse"):
    value = (row.get(step) or {}).get(key)
    return "" if value is None else "%.3g" % (100 * value)


def judged(row, chosen):
    """Known answer, what was found, and whether that is it."""
    named = "verdict" in row and is_named(row, chosen)
    if not chosen.known:
        if not chosen.cause:
            return "", "", "nobody knows"
        return chosen.cause, "", "named" if named else "NOT FOUND"
    known = "%s: %s" % (chosen.cause, ", ".join("%g %s" % (value, unit) for _, value, _, unit, _ in chosen.known))
    if not row.get("values") or None in row["values"]:
        return known, "", "NOT FOUND"
    right, texts = True, []
    for (_, value, allowed, _, added), (found, sd) in zip(chosen.known, row["values"]):
        right = right and abs(found + added - value) <= allowed
        texts.append("%.4g" % (found + added) + ("" if sd is None else " ± %.2g" % sd))
    text = ", ".join(texts)
    if chosen.by_hand:
        return known, text, "value right" if right else "VALUE OFF"
    if named:
        return known, text, "found" if right else "NAMED, OFF"
    among = "one of %d, " % len(row["effects"]) if chosen.cause in row["effects"] else "NOT NAMED, "
    return known, text + " (added by hand)", among + ("value right" if right else "VALUE OFF")


HEADER = ["set", "given, %", "fitted, %", "held out, %", "named", "with it, %", "held out, %", "attainable, %", "× noise", "known", "found",
          "answer", "s"]


def cells(name, row):
    """The row of one set."""
    chosen = sets.SETS[name]
    last = next(step for step in ("named_fit", "cause_fit", "fitted") if step in row or step == "fitted")
    hand = " (by hand)" if last == "cause_fit" else ""
    with_it = [percent(row, last, key) + hand if last != "fitted" and percent(row, last, key) else "" for key in ("nrmse", "held_out")]
    verdict = row.get("verdict", "failed")
    if row.get("effects"):
        verdict += ": " + " + ".join(row["effects"])
    if row.get("probability") is not None:
        verdict += ", %.2f" % row["probability"]
    noise = (row.get(last) or {}).get("noise_ratio")
    known, found, answer = judged(row, chosen)
    return [chosen.name, percent(row, "given"), percent(row, "fitted"), percent(row, "fitted", "held_out"), verdict,
            *with_it, percent(row, last, "attainable"),
            "" if noise is None else "%.3g" % noise, known, found, answer, "%.0f" % row["seconds"]]


def page(rows):
    """The page of results: the table, and what cells have no room for."""
    tool = os.path.join(TOP, "tools", "results_page.sh")
    text = subprocess.run([tool, "--head", "The bench of measured beams", "make measured"], capture_output=True, text=True,
                          check=True).stdout
    text += "\nRecordings of other laboratories, through import, fit, diagnose and fit; what the columns mean and how the models came about: " \
            "[real_data.md](../real_data.md#the-bench-of-measured-beams).\n\n"
    text += "| " + " | ".join(HEADER) + " |\n|" + "---|" * len(HEADER) + "\n"
    text += "".join("| " + " | ".join(cells(name, row)) + " |\n" for name, row in rows)
    for name, row in rows:
        chosen = sets.SETS[name]
        text += "\n## %s\n\n`tests/measured/%s.yaml`, fitted %s%s.%s\n" % (
            chosen.name, chosen.model, ", ".join(chosen.fitted), ", held out " + ", ".join(chosen.held_out) if chosen.held_out else "",
            " " + chosen.why[0].upper() + chosen.why[1:] + "." if chosen.why else "")
        if "failed" in row:
            text += "\nFAILED: %s\n" % row["failed"]
        if row.get("text"):
            text += "\n> " + row["text"].replace("\n", "\n> ") + "\n"
        if "cause_fit" in row:
            held = percent(row, "cause_fit", "held_out")
            text += "\nWith %s added by hand: error %s %%%s.\n" % (
                chosen.cause, percent(row, "cause_fit"), ", held out %s %%" % held if held else "")
    return text


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sets", nargs="*", help="of: " + " ".join(sets.SETS) + "; none: all")
    parser.add_argument("--build", default="build", help="directory with beamfit")
    parser.add_argument("--work", default=os.path.join("build", "measured"), help="directory for records, models and answers")
    parser.add_argument("--limit", type=float, default=1800, help="seconds for one command")
    parser.add_argument("--page", metavar="FILE", help="write the table of all sets that were run as a page")
    return parser.parse_args()


def main():
    options = arguments()
    unknown = [name for name in options.sets if name not in sets.SETS]
    if unknown:
        raise SystemExit("no set %s; there are: %s" % (" ".join(unknown), " ".join(sets.SETS)))
    if not os.path.isdir(REAL):
        print("SKIPPED: %s is not there (set BEAMFIT_SHARED to the directory that has data/)" % REAL)
        return 0
    os.makedirs(options.work, exist_ok=True)
    print(" | ".join(HEADER), flush=True)
    for name in options.sets or sets.SETS:
        row = measure(name, options)
        print(" | ".join(cells(name, row)) + (" | " + row["failed"] if "failed" in row else ""), flush=True)
    if options.page:
        rows = []
        for name in sets.SETS:
            path = os.path.join(options.work, name + ".json")
            if os.path.exists(path):
                with open(path, encoding="utf-8") as stream:
                    rows.append((name, json.load(stream)))
        with open(options.page, "w", encoding="utf-8") as stream:
            stream.write(page(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
