#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# own_effect.sh BUILD — what docs/own_effect.md promises: the effect printed there goes into lib/effects/ of a copy of the tree and
# nothing else is changed; make; the tests of effects; then the page's commands with that program. BUILD is below the tree
# and holds an up-to-date build, whose objects are copied, so that only the new effect is compiled and the program linked.
set -eu
build=${1:?own_effect.sh BUILD}
top=$(cd "$(dirname "$0")/.." && pwd)
page=docs/own_effect.md
cd "$top"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cp -a Makefile lib host firmware tools tests data docs "$work/"
mkdir -p "$work/$build"
cp -a "$build"/{host,double,float,target,gen,truth} "$build"/lib{host,beam,beamf,beamt,truth}.a "$build"/beam_truth "$work/$build/"

awk '/^```c$/ {inside = 1; next} /^```$/ {inside = 0} inside' "$page" >"$work/effect.c"
id=$(sed -n 's/^ *\.id = "\([a-z_]*\)",$/\1/p' "$work/effect.c")
[ -n "$id" ] || { echo "$page: the listing has no .id" >&2; exit 1; }
mv "$work/effect.c" "$work/lib/effects/$id.c"

cd "$work"
make -s WERROR=1 B="$build" "$build/beamfit" "$build/libbeamf.a"
nm "$build/libbeamf.a" | grep -q "effect_$id" || { echo "$id is not in the target's library" >&2; exit 1; }
tools/run_docs.sh "$build" "$page"
