#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""constants.py [check] — the hand-set constants of estimation and diagnosis, out of the sources into docs/constants.md.

Listed is every `const` number or array of numbers, every number in a `const` structure and every enumerator with a value; the meaning is the comment
behind or above it, or of the structure's member.
`check` writes nothing and fails when the page is out of date."""

import difflib
import os
import re
import sys

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = "docs/constants.md"
# Which sources: files in one of these folders of host/, or (in any folder) with one of these beginnings.
FOLDERS = ("estimate", "explain", "noise")
BEGINNINGS = ("amplitude", "candidate", "diagnose", "discriminate", "evidence", "fit", "identifiability", "intervals", "linearity",
              "local_rational", "localise", "motion", "noise", "optimise", "reconstruct", "refit", "regression", "residual", "score",
              "trial")
NOT_FOLDERS = ("cmd", "show")
NOT = re.compile(r"_(plot|json)")      # how pictures and answers are laid out
MATHEMATICS = ("pi", "golden", "none")  # not set by hand
FITTED = ("probability_table",)         # likewise: by `make calibrate`

HEAD = """# Constants of estimation and diagnosis

Written by `make constants` from the sources of `host/`; `make docs` fails when it is out of date. A constant is changed in its source,
where its reason stands.

| file | constant | value | meaning |
|---|---|---|---|
"""
COMMENT = re.compile(r"/\*.*?\*/", re.S)
NUMBERS = re.compile(r"[-+*/ ().0-9eExXuUlL\n]+")
DECLARED = re.compile(r"^([ \t]*)(static )?const (?:double|float|int|size_t|unsigned|long|uint\d+_t)\s+([^;]*?)\s*;", re.M | re.S)
ENUM = re.compile(r"\benum(?:\s+\w+)?\s*\{([^}]*)\}", re.S)
STRUCTURE = re.compile(r"\bconst struct (\w+)\s*(?:\{[^}]*\})?\s*(\w+)\s*=\s*\{([^{};]*)\}")
MEMBERS = r"\bstruct %s\s*\{([^}]*)\}"
DEFINED = re.compile(r"^#define (\w+) ([-+.0-9eE]+)[ \t]*$", re.M)


def sources():
    for folder, folders, names in os.walk(os.path.join(TOP, "host")):
        folders[:] = sorted(set(folders) - set(NOT_FOLDERS))
        for name in names:
            if name.endswith((".c", ".h")) and not NOT.search(name):
                if os.path.basename(folder) in FOLDERS or name.startswith(BEGINNINGS):
                    yield os.path.relpath(os.path.join(folder, name), os.path.join(TOP, "host"))


def blank(text):
    """The text with its comments made blanks, so that places stay."""
    return COMMENT.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def words(comment):
    return squeeze(" ".join(re.sub(r"^\s*\*", "", line) for line in comment[2:-2].splitlines()))


def squeeze(text):
    return re.sub(r"\s+", " ", text).strip()


def declarators(text, at):
    """(name, value, place of its end) of `a = 1, b[] = {2, 3}`; commas within braces and brackets do not part."""
    depth, begin = 0, 0
    for i, c in enumerate(text + ","):
        depth += (c in "{[(") - (c in "}])")
        if c == "," and depth == 0:
            found = re.match(r"\s*\*?(\w+)\s*(?:\[[^]]*\])?\s*=\s*(.*)", text[begin:i], re.S)
            if found:
                yield found.group(1), squeeze(found.group(2)), at + begin + len(text[begin:i].rstrip())
            begin = i + 1


def meaning(text, comments, begin, end):
    """The comment behind `end` on its line, else the one that ends on the line above `begin`."""
    line_end = text.find("\n", end)
    line_end = len(text) if line_end < 0 else line_end
    for first, last in comments:
        if end <= first < line_end:
            return words(text[first:last])
    line = text.rfind("\n", 0, begin) + 1
    for first, last in comments:
        if last <= line and text[last:line].strip() == "" and text[last:line].count("\n") == 1 and text[text.rfind("\n", 0, first) + 1:first].strip() == "":
            return words(text[first:last])
    return ""


def member_meaning(texts, structure, member):
    """What the definition of a structure, in whichever file, says of a member."""
    for text in texts:
        defined = re.search(MEMBERS % structure, blank(text))
        found = defined and re.search(r"\b%s\s*[,;]" % member, defined.group(1))
        if found:
            at = defined.start(1) + found.start()
            begin, end = text.rfind("\n", 0, at) + 1, text.find(";", at) + 1
            return meaning(text, [m.span() for m in COMMENT.finditer(text)], begin, end)
    return ""


def structures(text, texts):
    """[(place, name, value, meaning)] of the numbers in the structures of one file."""
    rows = []
    for m in STRUCTURE.finditer(blank(text)):
        for member in re.finditer(r"\.(\w+)\s*=\s*([^,]+)", m.group(3)):
            value = squeeze(member.group(2))
            if m.group(2) not in FITTED and re.search(r"\d", value) and NUMBERS.fullmatch(value + " "):
                rows.append((m.start(3) + member.end(2), "%s.%s" % (m.group(2), member.group(1)), value, member_meaning(texts, m.group(1), member.group(1))))
    return rows


def constants(text):
    """[(place, name, value, meaning)] of one file, without those in structures."""
    code, comments = blank(text), [m.span() for m in COMMENT.finditer(text)]
    rows = []
    for m in DECLARED.finditer(code):
        for name, value, end in declarators(m.group(3), m.start(3)):
            plain = re.sub(r"\[\w+\] =|[{},]", " ", value)
            if m.group(2) or not m.group(1):
                plain = re.sub(r"\b[A-Z][A-Z_0-9]*\b", " ", plain)
            if NUMBERS.fullmatch(plain + " ") and name not in MATHEMATICS:
                rows.append((end, name, value, meaning(text, comments, m.start(), end)))
    for m in ENUM.finditer(code):
        for name, value, end in declarators(m.group(1), m.start(1)):
            plain = re.sub(r"\b[A-Z][A-Z_0-9]*\b", " ", value)
            if "sizeof" not in value and NUMBERS.fullmatch(plain + " "):
                one_line = "\n" not in m.group(1)
                begin = m.start() if one_line else text.rfind("\n", 0, end) + 1
                rows.append((end, name, value, meaning(text, comments, begin, end)))
    for m in DEFINED.finditer(code):
        rows.append((m.end(2), m.group(1), m.group(2), meaning(text, comments, m.start(), m.end(2))))
    return rows


def page():
    texts = {}
    for path in sorted(sources()):
        with open(os.path.join(TOP, "host", path), encoding="utf-8") as stream:
            texts[path] = stream.read()
    told = {}  # what a header says of a constant that a source defines
    for path, text in texts.items():
        spans = [m.span() for m in COMMENT.finditer(text)]
        for m in re.finditer(r"^extern const \w+ (\w+);", blank(text), re.M):
            told[m.group(1)] = meaning(text, spans, m.start(), m.end())
    lines = []
    for path, text in texts.items():
        for _, name, value, what in sorted(constants(text) + structures(text, texts.values())):
            what = (what or told.get(name, "")).replace("|", "\\|")
            lines.append("| `%s` | `%s` | %s | %s |\n" % (path, name, value.replace("|", "\\|"), what))
    return HEAD + "".join(lines)


def main():
    new, path = page(), os.path.join(TOP, PAGE)
    if sys.argv[1:] == ["check"]:
        try:
            with open(path, encoding="utf-8") as stream:
                old = stream.read()
        except OSError:
            old = ""
        if old == new:
            return 0
        sys.stderr.writelines(list(difflib.unified_diff(old.splitlines(True), new.splitlines(True), PAGE, "the sources", n=0))[:20])
        print("constants: %s is out of date; run `make constants`" % PAGE, file=sys.stderr)
        return 1
    if sys.argv[1:]:
        raise SystemExit("usage: constants.py [check]")
    with open(path, "w", encoding="utf-8") as stream:
        stream.write(new)
    print("%s: %d constants" % (PAGE, new.count("\n") - HEAD.count("\n")))
    return 0


if __name__ == "__main__":
    sys.exit(main())
