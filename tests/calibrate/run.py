# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws imperfect rigs and runs `beamfit diagnose` on them: docs/calibration.md. Resumable; every answer is one file.

    python3 tests/calibrate/run.py --seed 1 --number 400 --jobs 2

Case k of a seed is always the same rig. What is finished for this very program is not run again.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed

import records
import settle

DIAGNOSE_LIMIT_S = 120  # of processor time: an answer that takes longer is 'dear'


def diagnose(case, directory, tools, without):
    """The row that is stored: truth, ratios, processor seconds, the whole answer."""
    folder = os.path.join(directory, "records")
    names = sorted(name for name in os.listdir(folder) if name.endswith(".csv"))
    command = [tools["beamfit"], "diagnose", os.path.join(folder, "model.yaml")]
    command += [os.path.join(folder, name) for name in names if name.startswith("train")]
    check = [os.path.join(folder, name) for name in names if name.startswith("check")]
    command += (["--check"] + check if check else []) + (["--without", ",".join(case["removed"])] if without else [])
    status, out, err, seconds = records.run(command + ["--json", "--threads", "1"], DIAGNOSE_LIMIT_S)
    row = {key: value for key, value in case.items() if key != "source"}
    row.update(kind="removed" if without else case["kind"], drawn_as=case["kind"], cpu_s=seconds, program=tools["version"],
               state="dear" if status is None else "done" if status == 0 else "failed", message=err.strip()[-300:], answer=None)
    if status == 0:
        try:
            row["answer"] = json.loads(out)
        except json.JSONDecodeError:
            row.update(state="failed", message="not JSON")
    return row


def with_truth(case, directory, tools):
    """The handbook model with the true effects added, fitted: what an ideal answer would leave. None: there is nothing to add."""
    folder = os.path.join(directory, "records")
    model, made = os.path.join(folder, "model.yaml"), os.path.join(folder, "with_truth.yaml")
    for effect in case["effects"]:
        # beam_truth's section is of another thickness than this beam's, so its factor of the rotary inertia is no start value
        skip = ("power", "curve", "rounding_rad", "settling_s") + (("scale",) if effect["id"] == "rotary_inertia" else ())
        known = {n: v for n, v in effect["values"].items() if n not in skip and not isinstance(v, dict)}
        command = [tools["beamfit"], "add", model, effect["id"], "-o", made + ".start"] + ["%s=%.6g" % item for item in known.items()]
        command += (["--channel", effect["channel"]] if effect["channel"] else []) + (["--free", "at_m"] if "at_m" in known else [])
        status, _, err, _ = records.run(command, 20)
        if status != 0:
            return {"ratio": None, "message": err.strip()[-200:]}
        os.replace(made + ".start", made)
        model = made
    names = sorted(name[:-4] for name in os.listdir(folder) if name.endswith(".csv"))
    train, check = ([n for n in names if n.startswith(word)] for word in ("train", "check"))
    answer, message, seconds = settle.fit(tools["beamfit"], folder, train, "with_truth.yaml", check=check)
    if answer is None or not answer["noise_ratio"] or answer["noise_ratio"] > 1.2 * max(case["clean_ratio"], 1):  # not there yet: with the search
        again, message, seconds = settle.fit(tools["beamfit"], folder, train, "with_truth.yaml", check=check, more=())
        answer = again or answer
    if answer is None:
        return {"ratio": None, "message": message}
    return {"ratio": answer["noise_ratio"], "nrmse": answer["nrmse"], "check_ratio": (answer.get("check") or {}).get("noise_ratio"), "cpu_s": seconds}


def known_answer(path, tools):
    if not os.path.exists(path):
        return None
    with open(path, encoding="utf-8") as stream:
        row = json.load(stream)
    return row if row["program"] == tools["version"] else None


def one(seed, number, options, tools):
    """All answers of one case, made or read."""
    case, directory = settle.make_case(seed, number, tools, options.work, "changed" if options.changed else None)
    rows = []
    if case["kind"] == "refused":
        return [{**case, "state": "refused"}]
    modes = ["full"] if not options.without_only else []
    lottery = random.Random("beamfit without %d %d" % (seed, number)).random()
    if len(case["truth"]) == 1 and case["removed"] and case["kind"] in ("plain", "changed") and lottery < options.without:
        modes.append("without")
    if options.draw_only:
        modes = []
        rows.append({**case, "state": "drawn"})
    if options.with_truth and case["removed"] and "with_truth" not in case:
        case["with_truth"] = with_truth(case, directory, tools)
        records.write_text(os.path.join(directory, "case.json"), json.dumps(case, indent=1))
        rows = [{**case, "state": "drawn"}] if options.draw_only else []
    for mode in modes:
        path = os.path.join(directory, mode + ".json")
        row = known_answer(path, tools)
        if row is None:
            row = diagnose(case, directory, tools, mode == "without")
            records.write_text(path, json.dumps(row))
        rows.append(row)
    return rows


def show(row):
    answer = row.get("answer") or {}
    text = "%-10s %-8s %-34s" % (row["case"], row["kind"], "+".join(row.get("truth", [])) or "-")
    if row["state"] == "refused":
        return text + " " + "; ".join(row["refused"])[:120]
    text += " clean %6.2f now %7.2f" % (row["clean_ratio"], row["ratio"])
    if row.get("with_truth"):
        text += " with the truth %s" % row["with_truth"].get("ratio")
    return text + " %-6s %-9s %-40s %5.1f s" % (row["state"], answer.get("verdict", ""), "+".join(answer.get("effects", [])), row.get("cpu_s", 0))


def prepare(options):
    """The programs as they are now, copied, so that a build in between cannot mix two of them."""
    os.makedirs(options.work, exist_ok=True)
    tools = {"source": records.source_hash()}
    for key, name in (("beamfit", "beamfit"), ("truth", "beam_truth")):
        path = os.path.join(options.build, name)
        with open(path, "rb") as stream:
            version = hashlib.sha256(stream.read()).hexdigest()[:12]
        tools[key] = os.path.join(os.path.abspath(options.work), "%s-%s" % (name, version))
        if not os.path.exists(tools[key]):
            shutil.copy2(path, tools[key] + ".new")
            os.replace(tools[key] + ".new", tools[key])
        if key == "beamfit":
            tools["version"] = version
    return tools


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", help="directory with beamfit and beam_truth")
    parser.add_argument("--work", default=os.path.join("build", "calibrate"), help="directory for cases and answers")
    parser.add_argument("--seed", type=int, nargs="+", default=[1])
    parser.add_argument("--number", type=int, default=100, help="cases 1 to NUMBER of each seed")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="cases at once; each diagnosis has one thread")
    parser.add_argument("--without", type=float, default=0.5, help="share of plain single effects that are diagnosed once more without the truth")
    parser.add_argument("--without-only", action="store_true", help="only those")
    parser.add_argument("--changed", action="store_true", help="every case is a change as laboratories make them, as large as the signal")
    parser.add_argument("--with-truth", action="store_true", help="also fit the model with the true effects added")
    parser.add_argument("--draw-only", action="store_true", help="no diagnosis")
    return parser.parse_args()


def main():
    options = arguments()
    tools = prepare(options)
    count = {}

    def interrupted(*_):
        raise KeyboardInterrupt
    signal.signal(signal.SIGTERM, interrupted)
    with ThreadPoolExecutor(options.jobs) as pool:
        waiting = [pool.submit(one, seed, number, options, tools) for seed in options.seed for number in range(options.first, options.number + 1)]
        try:
            for done in as_completed(waiting):
                for row in done.result():
                    count[row["state"]] = count.get(row["state"], 0) + 1
                    print(show(row), flush=True)
        except BaseException as error:
            for number in (signal.SIGINT, signal.SIGTERM):  # a second one must not hinder the clearing up
                signal.signal(number, signal.SIG_IGN)
            for future in waiting:
                future.cancel()
            records.stop()
            if not isinstance(error, (KeyboardInterrupt, records.Stopped)):
                raise
            print("interrupted; what is finished is kept: the same command goes on", file=sys.stderr)
            return 130
    print(", ".join("%d %s" % (n, state) for state, n in sorted(count.items())) + ": " + options.work)
    return 0


if __name__ == "__main__":
    sys.exit(main())
