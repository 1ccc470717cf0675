# SPDX-License-Identifier: GPL-3.0-or-later
"""report_page.py PAGE [--compare JSON] [--modes JSON] [--fit JSON] [--figures N] [--title TEXT] [--hostile]

Reads a page of `beamfit report` as a browser would, and says what is wrong with it; exit status 1 then. The page must be
well nested, load nothing, hold whole PNG pictures, and state the numbers that the other commands state.
--hostile: names in it may look like addresses and markup; only what is really markup is judged.
"""

import argparse
import base64
import html.parser
import json
import re
import struct
import sys
import zlib

VOID = {"meta", "img", "wbr", "br", "hr", "line", "rect", "circle", "path"}
ALLOWED = VOID | set("html head title style body header footer h1 h2 h3 p div table thead tbody tr th td data figure "
                     "figcaption b code span sup ul li svg text".split())
ATTRIBUTES = set("lang charset content name http-equiv class id value colspan style width height alt src viewbox role "
                 "aria-label font-size font-family x y x1 y1 x2 y2 cx cy r d fill stroke stroke-width text-anchor".split())


class Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.faults, self.stack, self.pictures, self.tables = [], [], [], {}
        self.title = self.heading = ""
        self.captions = self.svgs = 0
        self.table = self.row = self.cell = None

    def fault(self, text):
        self.faults.append(f"line {self.getpos()[0]}: {text}")

    def handle_starttag(self, tag, attributes):
        if tag not in ALLOWED:
            self.fault(f"<{tag}> does not belong here")
        for name, value in attributes:
            if name not in ATTRIBUTES or (name == "style" and "url" in value):
                self.fault(f"<{tag} {name}=...> does not belong here")
            if name == "src":
                self.picture(value)
        attributes = dict(attributes)
        if tag not in VOID:
            self.stack.append(tag)
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
        if self.cell is not None:
            self.cell["text"] += data
        if self.stack[-1:] == ["title"]:
            self.title += data
        if self.stack[-1:] == ["h1"]:
            self.heading += data

    def picture(self, source):
        head = "data:image/png;base64,"
        if not source.startswith(head):
            self.fault(f"src={source[:40]} is not inside the page")
            return
        try:
            self.pictures.append(decode_png(base64.b64decode(source[len(head):], validate=True)))
        except ValueError as error:
            self.fault(f"a picture: {error}")


def decode_png(data):
    """(width, height) of a PNG whose every chunk and pixel row is there; ValueError otherwise."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("no PNG signature")
    at, pixels, size = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body, check = data[at + 8:at + 8 + length], data[at + 8 + length:at + 12 + length]
        if len(check) != 4 or zlib.crc32(kind + body) != struct.unpack(">I", check)[0]:
            raise ValueError(f"chunk {kind} is damaged")
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            pixels += body
        at += 12 + length
    if kind != b"IEND" or size is None:
        raise ValueError("it does not end")
    width, height, depth, colour = size[:4]
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    rows = zlib.decompress(pixels)
    if len(rows) != height * (1 + (width * channels * depth + 7) // 8) or len(set(rows)) < 3:
        raise ValueError("its pixels are not all there, or it is blank")
    return width, height


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
    if not asked.hostile and re.search(r"https?:|//[a-z]|javascript:|@import|url\(", re.sub(r"base64,[^\"]*", "", text)):
        faults.append("it holds an address")
    if asked.title is not None and (page.title, page.heading) != (asked.title, asked.title):
        faults.append(f"title {page.title!r}, heading {page.heading!r}")
    if asked.figures is not None and len(page.pictures) != asked.figures:
        faults.append(f"{len(page.pictures)} pictures, wanted {asked.figures}")
    if page.captions != len(page.pictures) + page.svgs:
        faults.append(f"{page.captions} captions for {len(page.pictures)} pictures and {page.svgs} sketches")
    for name, check in (("compare", check_errors), ("modes", check_modes), ("fit", check_parameters)):
        if getattr(asked, name):
            with open(getattr(asked, name), encoding="utf-8") as stream:
                faults.extend(check(page, json.load(stream)))
    print("\n".join(faults) if faults else f"{len(page.pictures)} pictures, {len(page.tables)} tables")
    return 1 if faults else 0


sys.exit(main())
