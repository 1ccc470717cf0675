# SPDX-License-Identifier: GPL-3.0-or-later
"""fleet_fit.py CHECK — one check of `beamfit fleet fit` in the current directory (test_fleet_fit.c)."""

import json
import math
import os
import random
import subprocess
import sys

from fleet import mpirun, run

TRUE = {"EI_beam_Nm2": 0.491, "EI_patch_Nm2": 0.793, "cDI_beam_sNm2": 2.2e-5, "gamma_sNpm2": 0.06, "Ks_V": 43.0}
MODEL = """format: beamfit-model/1
beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}
parameters:
  EI_beam_Nm2: {value: %(EI_beam_Nm2)g}
  EI_patch_Nm2: {value: %(EI_patch_Nm2)g}
  rho_beam_kgpm: {value: 0.093, fixed: true}
  rho_patch_kgpm: {value: 0.433, fixed: true}
  cDI_beam_sNm2: {value: %(cDI_beam_sNm2)g}
  cDI_patch_sNm2: {value: 2e-5, fixed: true}
  gamma_sNpm2: {value: %(gamma_sNpm2)g}
  Ks_V: {value: %(Ks_V)g}
inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}
outputs: {piezo_V: {kind: patch_strain}, tip_mps: {kind: velocity, at_m: 0.44}}
effects: []
"""
START = {"EI_beam_Nm2": 0.5, "EI_patch_Nm2": 0.8, "cDI_beam_sNm2": 2e-5, "gamma_sNpm2": 0.05, "Ks_V": 40.0}


def hit(k, n):
    """A hammer's force of hit k, with noise of its own."""
    dice = random.Random("hit %d" % k)
    level, width, at = dice.uniform(1, 10), dice.uniform(0.006, 0.012), 0.1 + 0.02 * dice.random()
    return [level * (0.5 + 0.5 * math.cos(math.pi * min(1.0, abs(j / 512 - at) / width))) for j in range(n)]


def make_records(count):
    """Records of one beam, and list.txt that names them; three shares of them."""
    os.makedirs("records", exist_ok=True)
    for name, values in (("true.yaml", TRUE), ("model.yaml", START)):
        with open(name, "w", encoding="utf-8") as stream:
            stream.write(MODEL % values)
    names = ["r%02d.csv" % k for k in range(count)]
    for k, name in enumerate(names):
        n = 768 + 256 * (k % 2)
        with open("u.csv", "w", encoding="utf-8") as stream:
            stream.write("time_s,hammer_N\n" + "".join("%.9g,%.9g\n" % (j / 512, u) for j, u in enumerate(hit(k, n))))
        run("simulate", "true.yaml", "--input", "u.csv", "-o", "s.csv", "--force")
        with open("s.csv", encoding="utf-8") as stream:
            lines = [line for line in stream.read().splitlines() if line and line[0] != "#"]
        rows = [[float(x) for x in line.split(",")] for line in lines[1:]]
        dice = random.Random("noise %d" % k)
        for c in (2, 3):
            size = 0.005 * math.sqrt(sum(row[c] ** 2 for row in rows) / n)
            for row in rows:
                row[c] += dice.gauss(0, size)
        with open("records/" + name, "w", encoding="utf-8") as stream:
            stream.write(lines[0] + "\n" + "".join(",".join("%.9g" % x for x in row) + "\n" for row in rows))
        os.remove("s.csv")
    with open("records/list.txt", "w", encoding="utf-8") as stream:
        stream.write("# of one beam\n" + "\n".join(names) + "\n")
    return ["records/" + name for name in names]


def without_times(answer):
    """The text of an answer but for what differs from run to run."""
    answer = json.loads(answer)
    answer.pop("fitted_model")
    answer["fit"].pop("seconds")
    return answer["fit"]


def off(shared, whole):
    """How far the two fits are apart, in standard errors; these are the same."""
    for name in TRUE:
        a, b = shared["parameters"][name], whole["parameters"][name]
        assert abs(a["sd"] / b["sd"] - 1) < 1e-6, (name, a, b)
    return max(abs(shared["parameters"][name]["value"] - whole["parameters"][name]["value"]) / whole["parameters"][name]["sd"]
               for name in TRUE)


def one_model_is_that_of_fit():
    records = make_records(18)
    shared = without_times(run("fleet", "fit", "model.yaml", "@records/list.txt", "-o", "shared.yaml", "--json").stdout)
    whole = json.loads(run("fit", "model.yaml", *records, "-o", "whole.yaml", "--json").stdout)
    assert shared["converged"] and whole["converged"], shared
    assert off(shared, whole) < 0.01, off(shared, whole)  # both end within that of the optimum
    for name, true in TRUE.items():
        said = shared["parameters"][name]
        assert abs(said["value"] - true) < 5 * said["sd"], (name, said, true)
    near = [without_times(run("fleet", "fit", "whole.yaml", *records, "-o", "a.yaml", "--start", "near", "--json").stdout),
            json.loads(run("fit", "whole.yaml", *records, "-o", "b.yaml", "--start", "near", "--json").stdout)]
    assert off(*near) < 1e-7, off(*near)  # the same steps
    assert [r["file"] for r in shared["records"]] == records == [r["file"] for r in whole["records"]]
    for a, b in zip(shared["records"], whole["records"]):
        for c, d in zip(a["channels"], b["channels"]):
            assert c["name"] == d["name"] and abs(c["noise_ratio"] / d["noise_ratio"] - 1) < 1e-6, (a, b)
    ratios = [sum(c["noise_ratio"] ** 2 for c in r["channels"]) for r in shared["records"]]
    assert len(shared["worst"]) == 10 and shared["worst"][0]["file"] == records[ratios.index(max(ratios))], shared["worst"]
    assert "18 records" in run("fleet", "fit", "model.yaml", "@records/list.txt", "-o", "again.yaml").stdout
    with open("shared.yaml", encoding="utf-8") as stream:
        text = stream.read()
    assert text.count("sha256") >= 18, text[-400:]
    assert run("compare", "shared.yaml", records[0]).stdout


def processes_and_ranks_have_the_same_bits():
    make_records(18)
    words = ["fit", "model.yaml", "@records/list.txt", "--json"]
    one = without_times(run("fleet", *words, "-o", "p1.yaml", "--processes", "1").stdout)
    assert without_times(run("fleet", *words, "-o", "p3.yaml", "--processes", "3").stdout) == one
    for ranks in (1, 2, 5):
        done = subprocess.run(mpirun(ranks, *words, "-o", "m%d.yaml" % ranks), capture_output=True, text=True, check=False)
        assert done.returncode == 0, (done.stdout, done.stderr)
        assert without_times(done.stdout) == one, (ranks, done.stdout)


def what_cannot_be_fitted_is_said():
    records = make_records(9)
    said = run("fleet", "fit", "model.yaml", *records, "lost.csv", "-o", "f.yaml", status=3).stderr
    assert said.count("lost.csv") == 1, said
    said = run("fleet", "fit", "model.yaml", *records, "-o", "f.yaml", "--start", "search", status=2).stderr
    assert "does not search" in said, said
    with open("model.yaml", encoding="utf-8") as stream:
        text = stream.read()
    with open("law.yaml", "w", encoding="utf-8") as stream:
        stream.write(text.replace("effects: []", "effects: [{kind: coulomb_friction}]"))
    assert "nonlinear law" in run("fleet", "fit", "law.yaml", *records, "-o", "f.yaml", status=2).stderr
    assert "@LIST" in run("fleet", "fit", "model.yaml", "-o", "f.yaml", status=2).stderr
    assert "-o" in run("fleet", "fit", "model.yaml", *records, status=2).stderr
    assert not os.path.exists("f.yaml")
    done = subprocess.run(mpirun(2, "fit", "model.yaml", *records, "lost.csv", "-o", "f.yaml"), capture_output=True,
                          text=True, check=False)
    assert done.returncode == 3 and done.stderr.count("lost.csv") == 1, done.stderr


if __name__ == "__main__":
    globals()[sys.argv[1]]()
