# SPDX-License-Identifier: GPL-3.0-or-later
"""fleet_population.py CHECK — `beamfit fleet report` on drawn estimates, against another way to the same numbers (test_fleet.c)."""

import json
import math
import os
import random
import shutil
import sqlite3
import subprocess
import sys

BEAMFIT = os.environ["BEAMFIT"]


def make_tables(path):
    """The tables of RESULTS as the program makes them, without rows."""
    if not os.path.exists("none.sqlite"):
        with open("none.csv", "w", encoding="utf-8") as stream:
            stream.write("unit,model,records\nnone,,\n")
        subprocess.run([BEAMFIT, "fleet", "none.csv", "-o", "none.sqlite"], check=True, stdout=subprocess.DEVNULL)
    shutil.copyfile("none.sqlite", path)
    db = sqlite3.connect(path)
    db.execute("PRAGMA synchronous = OFF")
    for table in ("manifest", "units", "inputs", "warnings", "runs"):
        db.execute("DELETE FROM " + table)
    return db


def write_results(path, names, units, columns=()):
    """units: [(name, {parameter: x}, {(a, b): covariance}, {column: text})], x the logarithm of a value in metres."""
    db = make_tables(path)
    for place, (unit, x, covariance, cells) in enumerate(units):
        db.execute("INSERT INTO manifest VALUES (?, ?, '')", (unit, place))
        db.execute("INSERT INTO units (unit, status) VALUES (?, 'done')", (unit,))
        for name in columns:
            db.execute("INSERT INTO columns VALUES (?, ?, ?)", (unit, name, cells[name]))
        for name in names:
            if name in x:
                value = math.exp(x[name])
                db.execute("INSERT INTO parameters VALUES (?, 'fit', ?, 'm', ?, ?, NULL, NULL, 1, 1, 0, 1)",
                           (unit, name, value, value * math.sqrt(covariance[name, name])))
        for (a, b), value in covariance.items():
            if a in x and b in x:
                db.execute("INSERT INTO covariances VALUES (?, ?, ?, ?)", (unit, a, b, value))
    db.commit()
    db.close()


def report(path, *words):
    done = subprocess.run([BEAMFIT, "fleet", "report", path, "--json", *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["population"]


def minimise(f, start, step):
    """Nelder and Mead's simplex."""
    n = len(start)
    simplex = [(f(start), list(start))]
    for k in range(n):
        point = list(start)
        point[k] += step
        simplex.append((f(point), point))
    for _ in range(4000):
        simplex.sort(key=lambda one: one[0])
        if simplex[-1][0] - simplex[0][0] < 1e-11:
            break
        middle = [sum(point[k] for _, point in simplex[:-1]) / n for k in range(n)]

        def at(share, middle=middle):
            point = [m + share * (w - m) for m, w in zip(middle, simplex[-1][1])]
            return f(point), point
        reflected = at(-1)
        if reflected[0] < simplex[0][0]:
            simplex[-1] = min(reflected, at(-2), key=lambda one: one[0])
        elif reflected[0] < simplex[-2][0]:
            simplex[-1] = reflected
        else:
            shrunk = at(0.5)
            if shrunk[0] < simplex[-1][0]:
                simplex[-1] = shrunk
            else:
                best = simplex[0][1]
                simplex = [(f(p), p) for p in ([(b + q) / 2 for b, q in zip(best, point)] for _, point in simplex)]
    return simplex[0][1]


def reml(units, names):
    """Mean and covariance of two parameters by direct maximisation of the restricted likelihood; units may have one only."""
    def sums(spread):
        total, precision, right = 0.0, [[0.0, 0.0], [0.0, 0.0]], [0.0, 0.0]
        for _, x, S, _ in units:
            if len(x) == 2:
                a, b = names
                v = [[spread[0] + S[a, a], spread[1] + S[a, b]], [spread[1] + S[a, b], spread[2] + S[b, b]]]
                det = v[0][0] * v[1][1] - v[0][1] ** 2
                if det <= 0:
                    return None
                w = [[v[1][1] / det, -v[0][1] / det], [-v[0][1] / det, v[0][0] / det]]
                y = [x[a], x[b]]
            else:
                (name,), w, y = x, [[0.0, 0.0], [0.0, 0.0]], [0.0, 0.0]
                k = names.index(name)
                det = spread[2 * k] + S[name, name]
                w[k][k], y[k] = 1 / det, x[name]
            total += math.log(det)
            wy = [w[0][0] * y[0] + w[0][1] * y[1], w[1][0] * y[0] + w[1][1] * y[1]]
            total += y[0] * wy[0] + y[1] * wy[1]
            for i in range(2):
                right[i] += wy[i]
                for j in range(2):
                    precision[i][j] += w[i][j]
        det = precision[0][0] * precision[1][1] - precision[0][1] ** 2
        mean = [(precision[1][1] * right[0] - precision[0][1] * right[1]) / det,
                (precision[0][0] * right[1] - precision[0][1] * right[0]) / det]
        return total + math.log(det) - mean[0] * right[0] - mean[1] * right[1], mean

    def spread_of(q):  # of a Cholesky factor with a positive diagonal
        a, b, c = math.exp(q[0]), q[1], math.exp(q[2])
        return a * a, a * b, b * b + c * c

    def value(q):
        found = sums(spread_of(q))
        return 1e300 if found is None else found[0]
    best = minimise(value, [math.log(0.05), 0.0, math.log(0.05)], 0.3)
    best = minimise(value, best, 0.05)
    return sums(spread_of(best))[1], spread_of(best)


def draw(dice, n, poor=0.0, missing=0.0):
    """Two parameters with spreads 4 and 8 %, correlation 0.6, and errors of their own of 0.5 to 5 % (poor: 20 %)."""
    units = []
    for i in range(n):
        first, second = dice.gauss(0, 1), dice.gauss(0, 1)
        true = [math.log(0.5) + 0.04 * first, math.log(20) + 0.08 * (0.6 * first + 0.8 * second)]
        sd = [0.2 if dice.random() < poor else dice.uniform(0.005, 0.05) for _ in range(2)]
        rho, e, f = dice.uniform(-0.8, 0.8), dice.gauss(0, 1), dice.gauss(0, 1)
        x = {"a_m": true[0] + sd[0] * e, "b_m": true[1] + sd[1] * (rho * e + math.sqrt(1 - rho * rho) * f)}
        if dice.random() < missing:
            del x[dice.choice(sorted(x))]
        S = {("a_m", "a_m"): sd[0] ** 2, ("b_m", "b_m"): sd[1] ** 2, ("a_m", "b_m"): rho * sd[0] * sd[1]}
        units.append(("u%03d" % i, x, S, {}))
    return units


NAMES = ["a_m", "b_m"]


def population_is_the_maximum_of_the_likelihood():
    for seed in (1, 2, 3):
        units = draw(random.Random(seed), 40, poor=0.2, missing=0.1)
        write_results("r.sqlite", NAMES, units)
        said = report("r.sqlite", "--false-alarms", "1e-9")
        assert said["used"] == 40 and not said["outliers"], said["outliers"]
        mean, (aa, ab, bb) = reml(units, NAMES)
        for k, name in enumerate(NAMES):
            one = said["parameters"][name]
            assert abs(math.log(one["mean"]) - mean[k]) < 2e-4 * math.sqrt((aa, bb)[k]), (one, mean)
            assert abs(one["spread"] / math.sqrt((aa, bb)[k]) - 1) < 1e-3, (one, aa, bb)
        assert abs(said["parameters"]["a_m"]["correlation"][1] - ab / math.sqrt(aa * bb)) < 2e-3
        unit = units[next(i for i, u in enumerate(units) if len(u[1]) == 2 and u[2]["a_m", "a_m"] > 0.03)]
        found = next(e for e in said["estimates"] if e["unit"] == unit[0])["parameters"]["a_m"]
        assert 0.3 < found["borrowed"] < 1 and abs(math.log(found["value"]) - mean[0]) < abs(unit[1]["a_m"] - mean[0]), found


def false_alarms_are_as_stated():
    fleets, rate = 80, 0.2
    for n in (12, 40):
        alarms = 0
        for seed in range(fleets):
            write_results("r.sqlite", NAMES, draw(random.Random("%d %d" % (n, seed)), n))
            alarms += bool(report("r.sqlite", "--false-alarms", str(rate))["outliers"])
        bound = rate + 3 * math.sqrt(rate * (1 - rate) / fleets)
        assert rate * fleets / 5 < alarms <= bound * fleets, "%d of %d fleets of %d" % (alarms, fleets, n)
        print("%d of %d fleets of %d units have an outlier; stated %g" % (alarms, fleets, n, rate))


def what_differs_stands_out():
    dice = random.Random(7)
    units = draw(dice, 50)
    for i, (_, x, _, cells) in enumerate(units):
        cells["day"] = "2026-%02d-%02d" % (1 + i // 28, 1 + i % 28)
        cells["temperature_C"] = "%.1f" % dice.uniform(10, 30)
        cells["colour"] = dice.choice(("red", "blue"))
        x["b_m"] += 0.01 * (float(cells["temperature_C"]) - 20)
    units[11][1]["a_m"] += 0.5
    units[30][1]["b_m"] -= 0.8
    write_results("r.sqlite", NAMES, units, ("day", "temperature_C", "colour"))
    said = report("r.sqlite", "-o", "page.html")
    assert {o["unit"]: o["parameter"] for o in said["outliers"]} == {"u011": "a_m", "u030": "b_m"}, said["outliers"]
    (drift,) = said["drifts"]
    assert (drift["parameter"], drift["column"]) == ("b_m", "temperature_C") and abs(drift["slope"] - 0.01) < 4 * drift["sd"]
    assert said["used"] == 48
    with open("page.html", encoding="utf-8") as stream:
        page = stream.read()
    assert page.count("<svg") == 3 and "u011: p " in page and "made_by" in page and " src=" not in page
    text = subprocess.run([BEAMFIT, "fleet", "report", "r.sqlite"], capture_output=True, text=True, check=True).stdout
    assert "2 units stand out" in text and "rises by" in text and all(len(line) <= 80 for line in text.splitlines()), text


def few_units_are_no_population():
    write_results("r.sqlite", NAMES, draw(random.Random(1), 3))
    said = report("r.sqlite")
    assert "too few" in said["why_not"] and said["parameters"] == {} and said["estimates"] == [], said
    write_results("r.sqlite", NAMES, [])
    assert report("r.sqlite", "-o", "page.html")["units"] == 0
    with open("note.txt", "w", encoding="utf-8") as stream:
        stream.write("mine")
    done = subprocess.run([BEAMFIT, "fleet", "report", "r.sqlite", "-o", "note.txt"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "has not made it" in done.stderr
    done = subprocess.run([BEAMFIT, "fleet", "report", "lost.sqlite"], capture_output=True, text=True, check=False)
    assert done.returncode == 3 and "lost.sqlite" in done.stderr


if __name__ == "__main__":
    globals()[sys.argv[1]]()
