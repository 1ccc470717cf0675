# SPDX-License-Identifier: GPL-3.0-or-later
"""The hidden cases: data/hidden (its README states the forms) as Python objects, and their spec files for beam_truth."""

import hashlib
import math
import os
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.path.join(TOP, "data", "hidden")
STRENGTHS = ("clean", "plain", "subtle", "pair", "outside")


def statements(path):
    """Lines of a file without comments and blank ones."""
    with open(path, encoding="utf-8") as stream:
        for line in stream:
            line = line.split("#")[0].rstrip()
            if line:
                yield line


class Rig:
    """What stands on the bench: spec lines for each record, in the order the rig's file names the records."""

    def __init__(self, name):
        self.name = name
        self.model = os.path.join(DATA, "rigs", name + ".yaml")
        self.common, self.records = [], {}
        self.read(name)
        self.noise = next(float(line.split()[1]) for line in self.common if line.startswith("noise "))

    def read(self, name):
        """Lines before the first 'record' are for all records; 'like OTHER' takes over another rig's lines first."""
        current = None
        for line in statements(os.path.join(DATA, "rigs", name + ".txt")):
            words = line.split()
            if words[0] == "like":
                self.read(words[1])
            elif words[0] == "record":
                current = words[1:]
                for record in current:
                    self.records.setdefault(record, list(self.common))
            elif current is not None:
                for record in current:
                    self.records[record].append(line)
            else:
                self.common.append(line)
                for lines in self.records.values():
                    lines.append(line)

    def outputs(self, record):
        return {line.split()[1] for line in self.records[record] if line.startswith("output ")}


class Case:
    """One case: its rig, the drawn values of its beam, and what answers.txt says about it."""

    def __init__(self, name, rig, beam):
        self.name, self.rig, self.beam = name, rig, beam
        self.strength, self.truth, self.mates, self.hidden = "clean", [], [], []

    def effects(self):
        """[(id, {parameter: value}, channel)] as hidden; a per-record value is a dict {record: value}."""
        found = {}
        for records, line in self.hidden:
            words = line.split()
            if words[0] != "effect":
                continue
            values = dict(word.split("=") for word in words[2:])
            channel = values.pop("channel", None)
            entry = found.setdefault((words[1], channel), (words[1], {}, channel))
            for parameter, value in values.items():
                if records:
                    entry[1].setdefault(parameter, {}).update({record: float(value) for record in records})
                else:
                    entry[1][parameter] = float(value)
        return list(found.values())

    def spec(self, record):
        """The spec file of one record, as beam_truth reads it."""
        lines = ["%s %s" % item for item in self.beam.items() if item[0] != "seed"]
        lines += self.rig.records[record]
        for records, line in self.hidden:
            channel = next((word[8:] for word in line.split() if word.startswith("channel=")), None)
            if (not records or record in records) and (not channel or channel in self.rig.outputs(record)):
                lines.append(line)
        seed = 100 * int(self.beam["seed"]) + list(self.rig.records).index(record)
        return "\n".join(lines + ["blind 1", "seed %d" % seed]) + "\n"


def read_answers(cases, path):
    """answers.txt: 'CASE STRENGTH ID...', then indented spec lines ('RECORD,RECORD: line' for those only) and mates."""
    case = None
    for line in statements(path):
        words = line.split()
        if not line[0].isspace():
            case = cases[words[0]]
            case.strength, case.truth = words[1], words[2:]
            if case.strength not in STRENGTHS:
                raise SystemExit("%s: %s: strength '%s'" % (path, case.name, case.strength))
        elif words[0] == "mates":
            case.mates = words[1:]
        elif words[0].endswith(":"):
            case.hidden.append((words[0][:-1].split(","), " ".join(words[1:])))
        else:
            case.hidden.append(([], " ".join(words)))


def read_cases(wanted=None, data=DATA):
    """All cases in the order of data's cases.txt, or those wanted (names, or words that stand in strength or truth)."""
    rows = [line.split() for line in statements(os.path.join(data, "cases.txt"))]
    rigs, cases = {}, {}
    for row in rows[1:]:
        rig = rigs.setdefault(row[1], Rig(row[1]))
        beam = {key: value for key, value in zip(rows[0][2:], row[2:]) if value != "-"}
        cases[row[0]] = Case(row[0], rig, beam)
    read_answers(cases, os.path.join(data, "answers.txt"))
    if not wanted:
        return list(cases.values())
    chosen = [c for c in cases.values() if {c.name, c.strength, c.rig.name, *c.truth} & set(wanted)]
    if not chosen:
        raise SystemExit("no case is named or holds: " + " ".join(wanted))
    return chosen


def simulator_hash():
    """Changes when the truth simulator's source does: then every record is made again."""
    digest = hashlib.sha256()
    folder = os.path.join(TOP, "tests", "truth")
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), "rb") as stream:
            digest.update(stream.read())
    return digest.hexdigest()


def make_records(case, truth_program, directory, version):
    """The case's model and records in directory, unless they are there already. Returns how many were simulated."""
    os.makedirs(os.path.join(directory, "spec"), exist_ok=True)
    shutil.copyfile(case.rig.model, os.path.join(directory, "model.yaml"))
    made = 0
    for record in case.rig.records:
        text = "# simulator %s\n%s" % (version, case.spec(record))
        spec = os.path.join(directory, "spec", record + ".txt")
        if os.path.exists(spec) and os.path.exists(os.path.join(directory, record + ".csv")):
            with open(spec, encoding="utf-8") as stream:
                if stream.read() == text:
                    continue
        with open(spec + ".new", "w", encoding="utf-8") as stream:
            stream.write(text)
        os.replace(spec + ".new", spec)
        answer = subprocess.run([truth_program, spec, "-o", directory], capture_output=True, text=True, check=False)
        if answer.returncode != 0:
            os.remove(spec)
            raise SystemExit("%s %s: %s" % (case.name, record, answer.stderr.strip()))
        made += 1
    return made


def make_all(cases, truth_program, directory, jobs):
    """Records of all cases below directory, jobs at a time."""
    version = simulator_hash()
    with ThreadPoolExecutor(jobs) as pool:
        return sum(pool.map(lambda c: make_records(c, truth_program, os.path.join(directory, c.name), version), cases))


def record_files(directory, kind):
    """train*.csv or check*.csv of a case's directory."""
    return sorted(os.path.join(directory, name) for name in os.listdir(directory)
                  if name.startswith(kind) and name.endswith(".csv"))


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan
