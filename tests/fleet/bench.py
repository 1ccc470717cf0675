#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A drawn fleet on ranks: time, efficiency, memory; population against what was drawn; hidden ones found; kills. Writes a page."""

import argparse
import datetime
import json
import math
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time

from processes import session

HERE = os.path.dirname(os.path.abspath(__file__))


class Bench:
    def __init__(self, options):
        self.options, self.lines = options, []
        self.beamfit = os.path.abspath(os.path.join(options.build, "beamfit"))
        self.program = os.path.abspath(os.path.join(options.build, "beamfit-fleet"))
        os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OPENBLAS_NUM_THREADS="1")
        with open(os.path.join(options.work, "truth.json"), encoding="utf-8") as stream:
            self.truth = json.load(stream)

    def say(self, text=""):
        self.lines.append(text)
        print(text, flush=True)

    def path(self, name):
        return os.path.join(self.options.work, name)

    def command(self, ranks, results, *words):
        return ["mpirun", "--oversubscribe", "-n", str(ranks), self.program, self.path("units.csv"), "-o", results, *words]

    def ask(self, results, sql):
        with sqlite3.connect("file:%s?mode=ro" % results, uri=True) as db:
            return db.execute(sql).fetchall()

    def rows(self, results):
        """All rows but the times, with every bit."""
        names = [row[0] for row in self.ask(results, "SELECT name FROM sqlite_master WHERE type = 'table'") if row[0] != "runs"]
        exact = {float: float.hex}
        return {name: sorted(repr([exact.get(type(v), repr)(v) for v in row]) for row in self.ask(results, "SELECT * FROM " + name))
                for name in names}

    def fresh(self, name):
        path = self.path(name)
        for end in ("", "-journal"):
            if os.path.exists(path + end):
                os.remove(path + end)
        return path

    # ---- Ranks ----

    def ranks(self):
        self.say("| ranks | seconds | efficiency | busy | processor seconds of the units | memory of a unit's process, MiB |\n|---|---|---|---|---|---|")
        first, rows = None, None
        for ranks in self.options.ranks:
            path = self.fresh("ranks%d.sqlite" % ranks)
            begin = time.monotonic()
            subprocess.run(self.command(ranks, path, "--diagnose"), check=True, stdout=subprocess.DEVNULL)
            seconds = time.monotonic() - begin
            first = first or (seconds, ranks)
            (worked, used, most), = self.ask(path, "SELECT sum(seconds), sum(processor_seconds), max(peak_MiB) FROM runs")
            cores = min(ranks, os.cpu_count())
            share = first[0] * min(first[1], os.cpu_count()) / (seconds * cores)
            self.say("| %d | %.0f | %.2f | %.2f | %.0f | %.0f |" % (ranks, seconds, share, worked / (ranks * seconds), used, most))
            rows = rows or self.rows(path)
            if self.rows(path) != rows:
                raise SystemExit("rows of %d ranks differ" % ranks)
        self.say("\nEfficiency: against %d rank, over the ranks or the machine's %d cores, whichever is less; it needs a quiet machine. Busy: "
                 "share of the ranks' time in which a unit ran. Rows of all: equal, bit for bit." % (first[1], os.cpu_count()))
        return self.path("ranks%d.sqlite" % self.options.ranks[0])

    # ---- What was found ----

    def population(self, results):
        said = json.loads(subprocess.run([self.beamfit, "fleet", "report", results, "--json"], capture_output=True, text=True,
                                         check=True).stdout)["population"]
        good = [u for u in self.truth["units"] if not u["broken"]]
        self.say("\n## Population\n\n| parameter | mean found | ± | of the units drawn | off, in ± | spread found | of the units drawn | drawn from |\n"
                 "|---|---|---|---|---|---|---|---|")
        for name, (_, spread) in self.truth["drawn"].items():
            if name not in said["parameters"]:
                continue
            one = said["parameters"][name]
            true = [math.log(u["values"][name]) for u in good]
            mean = sum(true) / len(true)
            width = math.sqrt(sum((x - mean) ** 2 for x in true) / (len(true) - 1))
            self.say("| `%s` | %.5g | %.2g | %.5g | %.2f | %.2f %% | %.2f %% | %.0f %% |" % (
                name, one["mean"], one["sd"], math.exp(mean), (math.log(one["mean"]) - mean) * one["mean"] / one["sd"],
                100 * one["spread"], 100 * width, 100 * spread))
        first, second, rho = self.truth["correlated"]
        names = list(said["parameters"])
        self.say("\nCorrelation of `%s` and `%s`: %.2f (drawn from %.2f). Drift drawn: `%s` by %g %% for each unit of %s; said: %s." % (
            first, second, said["parameters"][first]["correlation"][names.index(second)], rho, self.truth["drift"][0],
            100 * self.truth["drift"][2], self.truth["drift"][1],
            "; ".join("%s by %.2f ± %.2f %% a unit of %s" % (d["parameter"], 100 * d["slope"], 100 * d["sd"], d["column"])
                      for d in said["drifts"]) or "none"))
        self.say("\nUnits that stand out: %s. Said: %s" % (", ".join(o["unit"] for o in said["outliers"]) or "none", said["text"]))

    def hidden(self, results):
        named = {}
        for unit, effect in self.ask(results, "SELECT DISTINCT e.unit, e.effect FROM effects e JOIN verdicts v ON v.unit = e.unit "
                                              "AND v.verdict = 'missing'"):
            named.setdefault(unit, []).append(effect)
        verdict = dict(self.ask(results, "SELECT unit, verdict FROM verdicts"))
        state = dict(self.ask(results, "SELECT unit, status FROM units"))
        units = self.truth["units"]
        hidden = [u for u in units if u["hidden"]]
        clean = [u for u in units if not u["hidden"] and not u["broken"]]
        broken = [u for u in units if u["broken"]]
        right = sum(named.get(u["unit"]) == [u["hidden"].split()[0]] for u in hidden)
        wrong = sum(u["unit"] in named and named[u["unit"]] != [u["hidden"].split()[0]] for u in hidden)
        others = {}
        for unit in clean:
            word = verdict.get(unit["unit"], "none")
            others[word] = others.get(word, 0) + 1
        self.say("\n## Hidden effects and broken inputs\n\n* Of %d hidden ones %d are named alone and right, %d otherwise, %d are not named." % (
            len(hidden), right, wrong, len(hidden) - right - wrong))
        self.say("* Of %d without any: %s." % (len(clean), ", ".join("%d %s" % (n, word) for word, n in sorted(others.items()))))
        self.say("* Of %d with broken inputs %d are rows with a reason; of the others %d failed." % (
            len(broken), sum(state[u["unit"]] == "failed" for u in broken),
            sum(state[u["unit"]] != "done" for u in units if not u["broken"])))

    # ---- Kills ----

    def kill_until_it_ends(self, path, dice, hit):
        """One run, from which random processes are killed until it ends or `kills` are made; True: it went to its end by itself."""
        with subprocess.Popen(self.command(2, path), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              start_new_session=True) as child:
            time.sleep(0.5)
            while child.poll() is None and sum(hit.values()) < self.options.kills:
                time.sleep(dice.uniform(0.1, 2.0))
                alive = session(child.pid)
                if not alive or child.poll() is not None:
                    break
                victim = dice.choice(alive)
                kind = "mpirun" if victim == child.pid else "rank" if self.parent(victim) == child.pid else "unit"
                try:
                    os.kill(victim, signal.SIGKILL)
                except ProcessLookupError:
                    continue
                hit[kind] = hit.get(kind, 0) + 1
            child.wait()
        while session(child.pid):
            time.sleep(0.02)
        return child.returncode == 0

    def kills(self):
        """Fits without diagnosis, random processes of mpirun's killed again and again; what was done must stay as it was. Begun anew when all is done."""
        whole, path, dice = self.fresh("whole.sqlite"), self.fresh("killed.sqlite"), random.Random(1)
        subprocess.run(self.command(2, whole), check=True, stdout=subprocess.DEVNULL)
        kept, lost, hit, runs, fleets, equal = {}, 0, {}, 0, 1, True
        while sum(hit.values()) < self.options.kills:
            ended = self.kill_until_it_ends(path, dice, hit)
            runs += 1
            with sqlite3.connect(path) as db:
                there = db.execute("SELECT 1 FROM sqlite_master WHERE name = 'units'").fetchone()
                rows = dict(db.execute("SELECT unit, identity FROM units WHERE status = 'done'")) if there else {}
            lost += sum(rows.get(unit) != identity for unit, identity in kept.items())
            kept = rows
            if ended and sum(hit.values()) < self.options.kills:
                subprocess.run(self.command(2, path), check=True, stdout=subprocess.DEVNULL)  # units whose process was killed
                equal = equal and self.rows(whole) == self.rows(path)
                path, kept, fleets = self.fresh("killed.sqlite"), {}, fleets + 1
        subprocess.run(self.command(2, path), check=True, stdout=subprocess.DEVNULL)
        equal = equal and self.rows(whole) == self.rows(path)
        self.say("\n## Kills\n\n%d processes were killed at random (%s) while 2 ranks fitted %d units, %d runs of %s: %d units that were "
                 "done were lost; the rows at the end are %s those of a run in one piece." % (
                     sum(hit.values()), ", ".join("%d %s" % (n, k) for k, n in sorted(hit.items())), self.options.units, runs, "one fleet" if fleets == 1 else "%d fleets, one after the other" % fleets, lost,
                     "bit for bit" if equal else "NOT"))
        return lost == 0 and equal

    # ---- Growth ----

    def growth(self, results):
        """100 000 units on 64 hosts of 32 cores, from measured parts."""
        empty, hosts, cores, many = self.path("empty.csv"), 64, 32, 100000
        with open(empty, "w", encoding="utf-8") as stream:
            stream.write("unit,model,records\n" + "".join("e%d,none.yaml,none.csv\n" % k for k in range(500)))
        path = self.fresh("empty.sqlite")
        seconds = []
        for _ in range(2):
            begin = time.monotonic()
            subprocess.run([self.beamfit, "fleet", empty, "-o", path, "--processes", "2"], check=True, stdout=subprocess.DEVNULL)
            seconds.append((time.monotonic() - begin) / 500)
        (used, n), = self.ask(results, "SELECT sum(processor_seconds), count(*) FROM runs")
        each, size = used / n, os.path.getsize(results) / n
        self.say("\n## Growth, on paper\n\nMeasured: a unit takes %.2f s of processor, its rows %.0f kB of RESULTS; a unit without inputs, from its hand-out to "
                 "its transaction on this disk, %.1f ms with two processes, and %.1f ms when it is there already." % (
                     each, size / 1e3, 1e3 * seconds[0], 1e3 * seconds[1]))
        work, write = many * each / hosts / cores, many * seconds[0]
        self.say("\n%d such units on %d hosts of %d cores: %.1f min of the ranks, %.0f min of rank 0, %.1f GB of RESULTS. The first limit is %s: "
                 "above %.0f ranks more of them bring nothing." % (
                     many, hosts, cores, work / 60, write / 60, many * size / 1e9,
                     "rank 0, which hands out and writes" if write > work else "the ranks", each / seconds[0]))

    @staticmethod
    def parent(pid):
        try:
            with open("/proc/%d/stat" % pid, encoding="utf-8") as stream:
                return int(stream.read().rsplit(")", 1)[1].split()[1])
        except OSError:
            return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default="build/fleet")
    parser.add_argument("--units", type=int, default=200)
    parser.add_argument("--hidden", type=int, help="default: 1 in 50")
    parser.add_argument("--broken", type=int, help="default: 1 in 100")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--parts", nargs="+", choices=["ranks", "kills", "growth"], default=["ranks", "kills", "growth"],
                        help="without `ranks`: those sections of the page anew; growth needs the results of an earlier `ranks`")
    parser.add_argument("--page", metavar="FILE")
    options = parser.parse_args()
    hidden = options.units // 50 if options.hidden is None else options.hidden
    broken = options.units // 100 if options.broken is None else options.broken
    subprocess.run([sys.executable, "-B", os.path.join(HERE, "draw.py"), options.work, "--build", options.build, "--units",
                    str(options.units), "--hidden", str(hidden), "--broken", str(broken), "--jobs", str(options.jobs)], check=True)
    bench = Bench(options)
    version = subprocess.run([bench.beamfit, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    bench.say("# Fleet\n\nMade by `make fleet-bench UNITS=%d RANKS='%s'`, %s, %s, %d cores. %d simulated units, two records fitted and one held out, 1536 samples, two outputs each; %d "
              "with a hidden effect, %d with broken inputs; one in ten with tenfold noise.\n\n## Ranks, fit and diagnosis\n" % (
                  options.units, " ".join(map(str, options.ranks)), datetime.date.today(), version, os.cpu_count(), options.units, hidden, broken))
    results = bench.path("ranks%d.sqlite" % options.ranks[0])
    if "ranks" in options.parts:
        bench.ranks()
        bench.population(results)
        bench.hidden(results)
    good = bench.kills() if "kills" in options.parts and options.kills else True
    if "growth" in options.parts:
        bench.growth(results)
    if options.page:
        write_page(options.page, bench.lines, whole="ranks" in options.parts)
    return 0 if good else 1


def sections(text):
    """{heading: section}, in order; what is before the first has the heading ''."""
    parts = text.split("\n## ")
    return {"": parts[0], **{part.split("\n")[0]: part for part in parts[1:]}}


def write_page(path, lines, whole):
    """The page, or in it the sections that were measured."""
    made = sections("\n".join(lines))
    if not whole:
        with open(path, encoding="utf-8") as stream:
            page = sections(stream.read().rstrip("\n"))
        del made[""], made["Ranks, fit and diagnosis"]
        made = {heading: made.get(heading, section).rstrip("\n") + "\n" for heading, section in page.items()}
    with open(path, "w", encoding="utf-8") as stream:
        stream.write("\n## ".join(made.values()).rstrip("\n") + "\n")


if __name__ == "__main__":
    sys.exit(main())
