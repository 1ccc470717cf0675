# SPDX-License-Identifier: GPL-3.0-or-later
"""Diagnoses the cases of data/hidden, whose rigs are perfect, and stores the answers as run.py does, as seed 0: docs/calibration.md.

    python3 tests/calibrate/perfect.py --work build/calibrate --records build/hidden
"""

import argparse
import json
import os
import sys

import records
import run

sys.path.insert(0, os.path.join(records.TOP, "tests", "hidden"))
import cases as hidden  # noqa: E402


def row_of(case):
    """What answers.py asks of a case; its rig has no error of its own."""
    rights = [case.truth] + [[mate] for mate in case.mates] if case.truth and case.strength != "outside" else []
    return {"case": "c0_%04d" % int(case.name[1:]), "kind": case.strength, "truth": case.truth, "right": rights, "also_true": [],
            "removed": sorted(set(case.truth) | set(case.mates)), "clean_ratio": 1.0, "ratio": 10.0}


def answer(case, directory, tools, without):
    row = row_of(case)
    command = [tools["beamfit"], "diagnose", os.path.join(directory, "model.yaml")] + hidden.record_files(directory, "train")
    command += ["--check"] + hidden.record_files(directory, "check") + (["--without", ",".join(row["removed"])] if without else [])
    status, out, err, seconds = records.run(command + ["--json", "--threads", "1"], run.DIAGNOSE_LIMIT_S)
    row.update(drawn_as=row["kind"], kind="removed" if without else row["kind"], cpu_s=seconds, program=tools["version"],
               state="dear" if status is None else "done" if status == 0 else "failed", message=err.strip()[-300:],
               answer=json.loads(out) if status == 0 else None)
    row["ratio"] = (row["answer"] or {}).get("noise_ratio_before") or row["ratio"]
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default=os.path.join("build", "calibrate"))
    parser.add_argument("--records", default=os.path.join("build", "hidden"), help="where the recordings are, or are simulated")
    parser.add_argument("--every", type=int, default=6, help="each so many single effects once more without the truth")
    options = parser.parse_args()
    options.build = os.path.abspath(options.build)
    tools = run.prepare(options)
    for case in hidden.read_cases():
        directory = os.path.join(options.records, case.name)
        hidden.make_records(case, os.path.join(options.build, "beam_truth"), directory, hidden.simulator_hash())
        single = case.strength in ("plain", "subtle")
        for mode in ["full"] + (["without"] if single and int(case.name[1:]) % options.every == 0 else []):
            path = os.path.join(options.work, row_of(case)["case"], mode + ".json")
            os.makedirs(os.path.dirname(path), exist_ok=True)
            row = run.known_answer(path, tools)
            if row is None:
                row = answer(case, directory, tools, mode == "without")
                records.write_text(path, json.dumps(row))
            print("%s %-7s %-8s %-34s %-9s %-40s %5.1f s" % (row["case"], mode, row["kind"], "+".join(row["truth"]) or "-",
                  (row["answer"] or {}).get("verdict", row["state"]), "+".join((row["answer"] or {}).get("effects", [])), row["cpu_s"]), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
