#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""stack.py DIR ROOT... — worst stack below each ROOT, from gcc's -fstack-usage and -fcallgraph-info files under DIR.

A call through a pointer may reach what POINTERS says of its caller. Functions of the C library have no such files and are listed in LIBRARY. Prints bytes and the path.
Status 1: a recursion, stack of unknown size, or a function nobody knows.
"""
import glob
import os
import re
import sys

# Bytes of what is linked from newlib and libgcc; read from their disassembly (arm-none-eabi-objdump -d).
LIBRARY = {"memcpy": 24, "memset": 24, "memmove": 24, "memcmp": 16, "strcmp": 16, "strlen": 8, "sqrtf": 16,
           "__aeabi_uldivmod": 48, "__aeabi_ldivmod": 48, "__udivmoddi4": 40}


def read(folder):
    """key -> (bytes, bounded), key -> called keys; a key is 'file.c:function' or a global function's name."""
    size, calls = {}, {}
    for path in glob.glob(os.path.join(folder, "**", "*.ci"), recursive=True):
        text = open(path, encoding="utf-8").read()
        here = os.path.relpath(path, folder)[:-3]
        name = {}
        for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
            if label.count("\\n") < 2 or "bytes" not in label:
                continue  # somebody else's function
            plain = title.split(":")[-1]
            name[title] = f"/{here}:{plain}" if ":" in title else plain
            found = re.search(r"(\d+) bytes \((.*)\)", label)
            size[name[title]] = (int(found[1]), found[2])
        for source, target in re.findall(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            if source in name:
                target = "<pointer>" if target == "__indirect_call" else name.get(target, target.split(":")[-1])
                calls.setdefault(name[source], set()).add(target)
    return size, calls


# Who calls through a pointer -> what the pointer may hold
POINTERS = [(r"/lib/beam_law:evaluate|beamt_laws_solve", r"/lib/effects/[^:]*:law$"),
            (r"beamt_(general_)?step$|:take_inputs$", r"/lib/effects/[^:]*:(drive|base)$"),
            (r"beamt_chain_step$", r"/lib/effects/[^:]*:(map|signal)$"),
            (r"xcp_command$", r"/firmware/xcp[^:]*:(?!.*isr)")]


def from_pointer(caller, size):
    for who, what in POINTERS:
        if re.search(who, caller):
            return [key for key in size if re.search(what, key)]
    return []


class Walk:
    def __init__(self, size, calls):
        self.size, self.calls, self.known, self.path = size, calls, {}, []
        self.wrong = []

    def worst(self, key):
        if key in self.known:
            return self.known[key]
        if key in self.path:
            self.wrong.append("recursion: " + " ".join(self.path[self.path.index(key):] + [key]))
            return 0, []
        if key not in self.size:
            if key not in LIBRARY:
                self.wrong.append(f"unknown function: {key}")
            return LIBRARY.get(key, 0), [f"{key} {LIBRARY.get(key, 0)}"]
        own, kind = self.size[key]
        if "dynamic" in kind and "bounded" not in kind:
            self.wrong.append(f"stack of unknown size: {key}")
        self.path.append(key)
        below = (0, [])
        for called in self.calls.get(key, ()):
            targets = from_pointer(key, self.size) if called == "<pointer>" else [called]
            if not targets:
                self.wrong.append(f"a pointer that POINTERS does not know: {key}")
            for target in targets:
                below = max(below, self.worst(target))
        self.path.pop()
        self.known[key] = own + below[0], [f"{key} {own}"] + below[1]
        return self.known[key]


def main():
    folder, roots = sys.argv[1], sys.argv[2:]
    walk = Walk(*read(folder))
    for root in roots:
        total, path = walk.worst(root)
        print(f"{total:6d}  {root}: {' > '.join(path)}")
    for text in walk.wrong:
        print(f"stack: {text}", file=sys.stderr)
    return 1 if walk.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
