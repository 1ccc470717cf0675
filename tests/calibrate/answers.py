# SPDX-License-Identifier: GPL-3.0-or-later
"""The stored answers of run.py, and what counts as right in them: docs/calibration.md."""

import json
import math
import os

KINDS = ("plain", "changed", "subtle", "pair", "clean", "outside", "faint", "removed")
WORDS = ("right", "class", "also", "ambiguous", "partial", "unknown", "missed", "alarm", "astray", "WRONG", "dear", "failed")
DOMINATES = 2.0  # with less than so many times the clean ratio the rig's own errors are at least a third of the misfit's rms


def load(work, seeds, number):
    """Rows of cases 1 to number (0: all) of the seeds below work, of one program only."""
    rows = []
    for name in sorted(os.listdir(work)):
        seed, _, case = name[1:].partition("_")
        if seed not in map(str, seeds) or not case.isdigit() or int(case) > (number or math.inf):
            continue
        for mode in ("full.json", "without.json"):
            path = os.path.join(work, name, mode)
            if os.path.exists(path):
                with open(path, encoding="utf-8") as stream:
                    rows.append(json.load(stream))
    programs = sorted({row["program"] for row in rows})
    if not rows:
        raise SystemExit("%s: no answers of seeds %s; tests/calibrate/run.py makes them" % (work, " ".join(map(str, seeds))))
    if len(programs) > 1:
        raise SystemExit("%s: answers of several programs (%s): finish run.py with one of them" % (work, ", ".join(programs)))
    return rows


def beside(row):
    """Effects that a rough rig has beside its cause, strong enough to be seen."""
    return {effect["id"] for effect in row.get("beside", [])}


def is_right(row, effects):
    """The set is what hides in the rig: the truth or a mate of it, and beside it only errors of the rig that the catalogue has; or what a rough rig has beside its cause."""
    named, also = set(effects), set(row["also_true"])
    rights = [] if row["kind"] == "removed" else [set(right) for right in row["right"]]
    if any(right <= named and named - right <= also for right in rights):
        return True
    small = row["kind"] == "clean" or row["ratio"] < DOMINATES * max(row["clean_ratio"], 1)
    return named <= also and (bool(named & beside(row)) or (small and len(named) > 0))


def label(row, entry):
    """One of the effects is there: it is the truth or a part of it, or stands beside it in a rough rig, or is an error that the rig has beside the truth."""
    asked, rights = set(entry["effects"]), [] if row["kind"] == "removed" else [set(right) for right in row["right"]]
    return int(any(right & asked for right in rights) or bool(asked & beside(row)) or
               (bool(asked & set(row["also_true"])) and is_right(row, entry["with"])))


def decisions(row):
    return (row.get("answer") or {}).get("decision") or []


def outcome(row):
    """One word for what the program said."""
    if row["state"] != "done":
        return row["state"]
    answer, kind = row["answer"], row["kind"]
    verdict, named = answer["verdict"], answer["effects"]
    nothing_known = kind in ("clean", "outside", "removed", "faint")
    if verdict == "complete":
        return "right" if kind in ("clean", "faint") else "missed"
    if verdict == "unknown":
        return {"clean": "alarm", "outside": "right", "removed": "right"}.get(kind, "unknown")
    listed = [e for e in (d["effects"] for d in answer["candidates"]) if set(e) <= set(named)] if verdict == "ambiguous" else [named]
    if verdict == "ambiguous":
        if any(is_right(row, effects) for effects in listed):
            return "ambiguous"
        return "alarm" if kind == "clean" else "astray"
    if kind != "removed" and any(set(named) == set(right) for right in row["right"]):
        return "right" if set(named) == set(row["truth"]) else "class"
    if is_right(row, named):
        return "also"
    truth = set(row["truth"]) | {e for right in row["right"] for e in right}
    return "partial" if not nothing_known and set(named) < truth | set(row["also_true"]) and set(named) & truth else "WRONG"


def named_probability(row):
    """Probability that the answer gives to what it names; None: it names nothing, or gives none."""
    answer = row.get("answer") or {}
    value = answer.get("probability")
    return float(value) if answer.get("verdict") == "missing" and value is not None else None
