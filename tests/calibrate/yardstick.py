# SPDX-License-Identifier: GPL-3.0-or-later
"""The noise that `beamfit` judges a channel to have, against what the true model leaves of it, on perfect rigs whose force has noise.

    python3 tests/calibrate/yardstick.py --seed 4001 --number 120

The model is fitted to the records without noise; nothing is fitted to those with it.
"""

import argparse
import json
import math
import os
import sys
from concurrent.futures import ThreadPoolExecutor

import page
import records
import rigs
import run
import settle

EXACT = 3e-4  # of the signal: a model that leaves more of the records without noise is not the truth
WORDS = {"raised_cosine": "hammer", "chirp": "sweep", "multisine": "multisine"}


class QuietRig(rigs.Rig):
    """Nothing is off, the outputs' noise is white, and only records with a recorded force are kept."""

    def __init__(self, seed, number):
        super().__init__(seed, rigs.CAREFUL * number)
        self.pieces, self.rough, self.shift = [], False, {}
        self.repeats = {record: 1.0 for record in self.records}
        for noise in self.noise.values():
            noise["colour"] = "white"
        self.records = {name: plan for name, plan in self.records.items() if not plan["decay"] and self.inputs[plan["input"]][0] == "point_force"}

    def write(self, exact, directory, kind):
        """kind "noisy": as measured; "exact": by instruments that are nearly perfect."""
        kept = {name: noise["level"] for name, noise in self.noise.items()}, self.bits, self.filter_stated
        if kind == "exact":
            self.bits, self.filter_stated = 22, True
            for noise in self.noise.values():
                noise["level"] = 1e-5
        reference = records.references(self, exact)
        for name in self.records:
            records.write_record(self, name, exact[name], reference, directory)
        levels, self.bits, self.filter_stated = kept
        for name, level in levels.items():
            self.noise[name]["level"] = level


def channels(rig, tools, work):
    """[(drive, ratio, standard error of the noise over it)] of a rig; empty where the records cannot be made or the model is not found."""
    directory, exact = os.path.join(work, rig.name), {}
    for name in rig.records:
        exact[name], message = records.simulate(rig, name, [], tools["truth"], os.path.join(directory, "raw"))
        if exact[name] is None:
            return []
    if not exact:
        return []
    records.write_text(os.path.join(directory, "model.yaml"), rig.model())
    rig.write(exact, directory, "exact")
    answer, _, _ = settle.fit(tools["beamfit"], directory, list(rig.records))
    if not answer or not answer["nrmse"] or answer["nrmse"] > EXACT:
        return []
    rig.write(exact, directory, "noisy")
    paths = [os.path.join(directory, name + ".csv") for name in rig.records]
    status, out, _, _ = records.run([tools["beamfit"], "compare", os.path.join(directory, "fitted.yaml")] + paths + ["--json"], settle.FIT_LIMIT_S)
    found = []
    for record in json.loads(out)["records"] if status == 0 else []:
        drive = WORDS[rig.records[os.path.basename(record["file"])[:-4]]["line"].split()[0]]
        found += [(drive, c["noise_ratio"], c["noise"]["rms_sd"] / c["noise"]["rms"]) for c in record["channels"] if c["noise_ratio"]]
    return found


def row_of(name, found):
    logs = sorted(math.log(ratio) for _, ratio, _ in found)
    mean = sum(logs) / len(logs)
    z = [(ratio - 1) / sd for _, ratio, sd in found if sd > 0]
    at = lambda share: "%.2f" % math.exp(logs[min(len(logs) - 1, int(share * len(logs)))])
    return (name, len(found), "%.2f" % math.exp(mean), at(0.1), at(0.5), at(0.9), at(1), "%.2f" % math.sqrt(sum(x * x for x in z) / len(z)),
            "%.1f %%" % (100 * sum(abs(x) > 2 for x in z) / len(z)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--work", default=os.path.join("build", "yardstick"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, default=100, help="rigs that are drawn; those without a recorded force are left out")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--page", metavar="FILE")
    options = parser.parse_args()
    options.build = os.path.abspath(options.build)
    tools = run.prepare(options)
    drawn = [QuietRig(options.seed, number) for number in range(1, options.number + 1)]
    with ThreadPoolExecutor(options.jobs) as pool:
        found = [entry for rig in pool.map(lambda rig: channels(rig, tools, options.work), drawn) for entry in rig]
    if not found:
        sys.exit("no rig of this seed has a recorded force: draw more")
    rows = [row_of(drive, [entry for entry in found if entry[0] == drive]) for drive in WORDS.values() if any(entry[0] == drive for entry in found)]
    table = page.table(("drive", "channels", "mean", "10 %", "median", "90 %", "largest", "error over standard error", "beyond 2"), rows + [row_of("all", found)])
    sys.stdout.write(table)
    if options.page:
        records.write_text(options.page, page.head("The noise of a force, as judged", "make yardstick SEED=%d N=%d" % (options.seed, options.number))
                           + "\n" + __doc__.split("\n\n")[0] + " Ratios are of what the true model leaves to the judged noise; 1 is right. The last two columns "
                           "say whether the standard error of the judged noise is honest: 1 and 5 % would be.\n\n" + table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
