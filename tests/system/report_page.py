# SPDX-License-Identifier: GPL-3.0-or-later
"""report_page.py PAGE [--compare JSON] [--modes JSON] [--fit JSON] [--figures N] [--title TEXT] [--hostile]

Reads a page of `beamfit report` as a browser would, and says what is wrong with it; exit status 1 then. The page must be
well nested, load nothing, run no script but those that its own policy names by their SHA-256, hold the curves of N channels
as the records have them, and state the numbers that the other commands state.
--hostile: names in it may look like addresses and markup; only what is really markup is judged.
"""

import argparse
import array
import base64
import csv
import hashlib
import html.parser
import json
import os
import re
import sys

VOID = {"meta", "img", "wbr", "br", "hr", "line", "rect", "circle", "path"}
ALLOWED = VOID | set("html head title style body header footer h1 h2 h3 p div table thead tbody tr th td data figure "
                     "figcaption b code span sup ul li svg text script noscript".split())
ATTRIBUTES = set("lang charset content name http-equiv class id value colspan style width height alt src viewbox role "
                 "aria-label font-size font-family x y x1 y1 x2 y2 cx cy r d fill stroke stroke-width text-anchor type".split())


class Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.faults, self.stack, self.tables = [], [], {}
        self.title = self.heading = self.policy = ""
        self.captions = self.svgs = 0
        self.table = self.row = self.cell = self.script = self.curves = None

    def fault(self, text):
        self.faults.append(f"line {self.getpos()[0]}: {text}")

    def handle_starttag(self, tag, attributes):
        if tag not in ALLOWED:
            self.fault(f"<{tag}> does not belong here")
        for name, value in attributes:
            if name not in ATTRIBUTES or (name == "style" and "url" in value):
                self.fault(f"<{tag} {name}=...> does not belong here")
            if name == "src":
                self.fault(f"src={value[:40]} is not inside the page")
        attributes = dict(attributes)
        if tag not in VOID:
            self.stack.append(tag)
        if attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = attributes["content"]
        if tag == "script":
            self.script = attributes.get("type", "")
        self.captions += tag == "figcaption"
        self.svgs += tag == "svg"
        if tag == "table":
            self.table = self.tables.setdefault(attributes["id"], [])
        elif tag == "tr" and self.table is not None:
            self.row = []
            self.table.append(self.row)
        elif tag in ("td", "th"):
            self.cell = {"text": "", "value": None}
            self.row.append(self.cell)
        elif tag == "data" and self.cell is not None:
            self.cell["value"] = float(attributes["value"])

    def handle_startendtag(self, tag, attributes):
        if tag not in VOID:
            self.fault(f"<{tag}/> is no empty element")
        self.handle_starttag(tag, attributes)

    def handle_endtag(self, tag):
        if not self.stack or self.stack[-1] != tag:
            self.fault(f"</{tag}> closes {self.stack[-1:]}")
            return
        self.stack.pop()
        if tag in ("td", "th"):
            self.cell = None
        elif tag == "table":
            self.table = None

    def handle_data(self, data):
        if self.stack[-1:] == ["script"]:
            self.take_script(data)
        if self.cell is not None:
            self.cell["text"] += data
        if self.stack[-1:] == ["title"]:
            self.title += data
        if self.stack[-1:] == ["h1"]:
            self.heading += data

    def take_script(self, text):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        if self.script == "application/json":
            self.curves = json.loads(text)
        elif f"'sha256-{digest}'" not in self.policy:
            self.fault(f"a script that the page's policy does not know: {text[:40]!r}")


def points(curve):
    """Numbers of a curve, None where there is none."""
    numbers = array.array("h", base64.b64decode(curve["data"], validate=True))
    if sys.byteorder == "big":
        numbers.byteswap()
    return [None if n == -32768 else n * curve["scale"] for n in numbers]


def samples(grid):
    return [segment["first"] + i * segment["step"] for segment in grid for i in range(segment["n"])]


def column(path, name):
    with open(path, encoding="utf-8") as stream:
        rows = list(csv.reader(line for line in stream if not line.startswith("#")))
    at = [cell.strip() for cell in rows[0]].index(name)
    return [float(row[at]) for row in rows[1:]]


def check_curves(curves, folder):
    """Every curve has its points; the measured ones are the record's samples, and measured - model is the residual, where the page does not compute it."""
    for channel in curves["channels"]:
        time, name = channel["time"], f"{channel['record']} {channel['name']}"
        where, measured = samples(time["grid"]), points(time["measured"])
        path = os.path.join(folder, channel["record"])
        true = column(path, channel["name"]) if os.path.exists(path) else None
        whole = len(time["grid"]) == 1 and time["grid"][0]["step"] == 1
        if whole != (not time["model"]):
            yield f"{name}: {len(time['model'])} predictions over a grid that is {'whole' if whole else 'not whole'}"
        if any(len(points(residual)) != len(where) for residual in time["residual"]):
            yield f"{name}: residuals of other lengths than {len(where)}"
        for kind, model, residual in zip(range(99), time["model"], time["residual"]):
            y, r = points(model), points(residual)
            off = max((abs(z - a - b) for z, a, b in zip(measured, y, r) if a is not None and b is not None), default=0)
            if not len(y) == len(r) == len(where) == len(measured):
                yield f"{name}: curves of {len(y)}, {len(r)}, {len(measured)} points over {len(where)}"
            elif off > time["measured"]["scale"] + model["scale"] + residual["scale"]:
                yield f"{name}: measured - model differs from residual {kind} by {off}"
        if true and any(abs(true[k] - z) > time["measured"]["scale"] for k, z in zip(where, measured)):
            yield f"{name}: measured is not what the record holds"
        frequency = channel["frequency"]
        lists = [frequency["measured"], frequency["phase"]] + frequency["model"] + frequency["residual"]
        if any(len(points(curve)) != len(samples(frequency["grid"])) for curve in lists):
            yield f"{name}: curves over frequency of different lengths"


def base_name(path):
    return path.rsplit("/", 1)[-1]


def same(a, b, relative=0.0):
    return a == b or (a is not None and b is not None and abs(a - b) <= relative * abs(b))


def check_errors(page, compare):
    """Every channel's and every total's numbers, exactly as `compare --json` has them."""
    rows = page.tables["errors"][1:]
    stated = {(row[0]["text"], row[1]["text"]): row for row in rows if len(row) == 6}
    totals = [row for row in rows if len(row) == 5]
    channels = [(record, channel) for record in compare["records"] for channel in record["channels"]]
    for record, channel in channels:
        row = stated.get((base_name(record["file"]), channel["name"]))
        if row is None:
            yield f"{record['file']} {channel['name']} is not among the errors"
        elif not same(row[2]["value"], channel["nrmse"]) or not same(row[3]["value"], channel["noise_ratio"]):
            yield f"{record['file']} {channel['name']}: {row[2]} {row[3]}, compare says {channel['nrmse']}"
        else:
            shown = float(re.match(r"[0-9.]+", row[2]["text"])[0])
            band = max(channel["bands"], key=lambda band: band["share"])
            if not same(shown, 100 * channel["nrmse"], 6e-4) or not row[2]["text"].endswith(" %"):
                yield f"{row[2]['text']} is shown for {channel['nrmse']}"
            if not row[5]["text"].startswith(f"{100 * band['share']:.0f} % in {band['from_Hz']:.3g}–{band['to_Hz']:.3g} Hz"):
                yield f"{row[5]['text']} is not the band with the largest share, {band}"
    if len(channels) != len(stated):
        yield f"{len(stated)} rows for {len(channels)} channels"
    wanted = [(compare[a], compare[b]) for a, b in (("nrmse", "noise_ratio"), ("check_nrmse", "check_noise_ratio"))
              if compare[a] is not None]
    found = [(row[1]["value"], row[2]["value"]) for row in totals]
    if found != wanted:
        yield f"totals {found}, compare says {wanted}"


def check_modes(page, modes):
    rows = page.tables["modes"][1:]
    if not rows:
        yield "no modes"
    for row, mode, error in zip(rows, modes["modes"], modes["deployed"]["relative_error"]):
        if not same(row[1]["value"], mode["frequency_Hz"]) or not same(row[2]["value"], mode["damping_ratio"]):
            yield f"{row[1]} {row[2]}, modes says {mode}"
        if not same(row[3]["value"], error):
            yield f"{row[3]}, modes says {error}"


def check_parameters(page, fit):
    rows = {row[0]["text"]: row for table in ("parameters", "effects") for row in page.tables.get(table, [])}
    for name, parameter in fit["parameters"].items():
        row = rows.get(name)
        if row is None:
            if parameter["value"] != 0:
                yield f"{name} is not in the tables"
        elif not same(row[2]["value"], parameter["value"], 1e-9) or row[5]["text"] != (parameter["unit"] or "1"):
            yield f"{name}: {row[2]} {row[5]}, fit says {parameter['value']} {parameter['unit']}"
        elif not parameter["held"] and parameter["identifiable"] and not same(row[3]["value"], parameter["sd"], 1e-5):
            yield f"{name}: ± {row[3]}, fit says {parameter['sd']}"


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("page")
    for name in ("compare", "modes", "fit"):
        arguments.add_argument("--" + name)
    arguments.add_argument("--figures", type=int)
    arguments.add_argument("--title")
    arguments.add_argument("--hostile", action="store_true")
    asked = arguments.parse_args()
    with open(asked.page, encoding="utf-8", errors="strict") as stream:
        text = stream.read()
    page = Page()
    page.feed(text)
    page.close()
    faults = page.faults
    if page.stack:
        faults.append(f"never closed: {page.stack}")
    if not asked.hostile and re.search(r"https?:|//[a-z]|javascript:|@import|url\(", re.sub(r"<script.*?</script>", "", text, flags=re.S)):
        faults.append("it holds an address")
    if len(re.findall("<script", text, re.I)) != len(re.findall("</script", text, re.I)) or "default-src 'none'" not in page.policy:
        faults.append("its scripts could be more than its own")
    if asked.title is not None and (page.title, page.heading) != (asked.title, asked.title):
        faults.append(f"title {page.title!r}, heading {page.heading!r}")
    drawn = page.curves["channels"] if page.curves else []
    if asked.figures is not None and len(drawn) != asked.figures:
        faults.append(f"curves of {len(drawn)} channels, wanted {asked.figures}")
    if page.captions != page.svgs:
        faults.append(f"{page.captions} captions for {page.svgs} sketches")
    if page.curves:
        faults.extend(check_curves(page.curves, os.path.dirname(asked.page)))
    for name, check in (("compare", check_errors), ("modes", check_modes), ("fit", check_parameters)):
        if getattr(asked, name):
            with open(getattr(asked, name), encoding="utf-8") as stream:
                faults.extend(check(page, json.load(stream)))
    print("\n".join(faults) if faults else f"curves of {len(drawn)} channels, {len(page.tables)} tables")
    return 1 if faults else 0


sys.exit(main())
