#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# coverage.sh BUILD — run the unit tests of lib/ and firmware/ that stand in BUILD/tests, built with gcc --coverage, and print which
# share of each file's lines they run. A line counts as run when any build of it runs it: lib/ is compiled as double, float,
# complex, and float in a controller's sizes. Fails when a test fails, or when lib/ or firmware/ (boards apart) stay below FLOOR per cent.
set -eu
build=$(realpath "${1:?coverage.sh BUILD}")
cd "$(dirname "$0")/.."
: "${FLOOR:=95}"
work=$(mktemp -d)
counts_away() { find "$build" -name '*.gcda' -delete; } # of tools that ran while it was built; of this run, when sources change
trap 'rm -rf "$work"; counts_away' EXIT

counts_away
built=$(find "$build/tests" -type f -executable -name 'test_*' -printf '%f|')
BEAMFIT_TESTS="/tests/(${built%|})\$" tests/run "$build" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
tail -n 1 "$work/log"

# An object that no test links has its notes (gcno) all the same, and its lines count as not run.
find "$build"/{double,float,target,complex}/lib "$build"/firmware -name '*.gcno' -print0 |
    xargs -0 gcov --stdout 2>"$work/errors" >"$work/lines" || { cat "$work/errors" >&2; exit 1; }
awk -F: -v floor="$FLOOR" '
    function share(run, all) { return all ? 100 * run / all : 100 }
    $2 + 0 == 0 && $3 == "Source" { file = $4; next }
    file !~ /^(lib|firmware)\// || file ~ /\/board_/ { next }
    $2 + 0 > 0 {
        count = $1
        gsub(/[ *]/, "", count)
        if (count == "-") next
        line = $2 + 0
        if (!((file, line) in seen)) { seen[file, line] = 1; all[file]++; if (line > last[file]) last[file] = line }
        if (count !~ /^[#=]/ && !((file, line) in done)) { done[file, line] = 1; run[file]++ }
    }
    END {
        sorted = "sort -k6"
        for (file in all) {
            missing = ""
            for (line = 1; line <= last[file]; line++)
                if (((file, line) in seen) && !((file, line) in done)) missing = missing " " line
            printf "%7.1f %%  %4d of %4d  %s%s\n", share(run[file], all[file]), run[file], all[file], file,
                missing ? "  not run:" missing : "" | sorted
            part = file; sub(/\/.*/, "/", part)
            runs[part] += run[file]; alls[part] += all[file]
        }
        close(sorted)
        for (part in alls) {
            printf "%7.1f %%  %4d of %4d  %s\n", share(runs[part], alls[part]), runs[part], alls[part], part
            if (share(runs[part], alls[part]) < floor) bad = 1
        }
        if (!("lib/" in alls) || !("firmware/" in alls)) { print "coverage: no lines found"; bad = 1 }
        else print bad ? "coverage: below " floor " %" : "coverage: at least " floor " % of lib/ and of firmware/"
        exit bad
    }' "$work/lines"
