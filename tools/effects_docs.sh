#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# effects_docs.sh          write the catalogue's table into docs/effects.md
# effects_docs.sh check    build the worked examples of docs/effects.md and docs/own_effect.md as effects and run every
#                          effect's tests on them
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)
page=$top/docs/effects.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: "${CC:=cc}"
mkdir "$work/effects"
cp "$top"/lib/effects/*.c "$work/effects/"

# build NUMBER_DEFINE OBJECT_DIRECTORY: the effects, their elementary functions, their table and the tests' view of them
build() {
    mkdir "$work/$2"
    for source in "$work"/effects/*.c "$work/table.c" "$top/lib/beam_math.c" "$top/tests/effects_shadow.c"; do
        $CC -std=c11 -D_GNU_SOURCE -Wall -Wextra -Werror -O1 $1 -I"$top/lib" -I"$top/tests" -c "$source" \
            -o "$work/$2/$(basename "$source" .c).o"
    done
}

if [ "${1:-write}" = check ]; then
    for page in "$page" "$top/docs/own_effect.md"; do
        awk '/^```c$/ {inside = 1; next} /^```$/ {inside = 0} inside' "$page" >"$work/example.c"
        id=$(sed -n 's/^ *\.id = "\([a-z_]*\)",$/\1/p' "$work/example.c")
        [ -n "$id" ] || { echo "$page: the worked example has no .id" >&2; exit 1; }
        mv "$work/example.c" "$work/effects/$id.c"
    done
    sh "$top/tools/effects_table.sh" "$work/effects" >"$work/table.c"
    build "" double
    build -DBEAM_FLOAT float
    build -DBEAM_COMPLEX complex
    for test in test_effects test_effects_roles test_effects_derivatives test_effects_laws; do
        $CC -std=c11 -D_GNU_SOURCE -O1 -I"$top/lib" -I"$top/tests" "$top/tests/unit/$test.c" "$work"/double/*.o \
            "$work"/float/*.o "$work"/complex/*.o -lcmocka -lm -o "$work/$test"
        "$work/$test"
    done
    exit 0
fi

sh "$top/tools/effects_table.sh" "$work/effects" >"$work/table.c"
$CC -std=c11 -I"$top/lib" -I"$top/tools" "$top/tools/effects_markdown.c" "$work/table.c" "$work"/effects/*.c -lm \
    -o "$work/table"
"$work/table" >"$work/table.md"
awk -v table="$work/table.md" '
    /^<!-- catalogue: / {while ((getline line < table) > 0) print line; skip = 1; written = 1}
    !skip {print}
    /^<!-- end of catalogue -->$/ {skip = 0}
    END {exit !written}' "$page" >"$work/page.md" || { echo "$page: the catalogue markers are gone" >&2; exit 1; }
cat "$work/page.md" >"$page"
