#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# help.sh MAKEFILE... — the targets that have a line "target: ... ## group: text", by groups, in at most 100 columns.
set -eu
awk -v groups='build test check measure documents install' '
    match($0, /^[a-z-]+:[^#]*## [a-z]+: /) {
        target = $0; sub(/:.*/, "", target)
        text = substr($0, RSTART + RLENGTH)
        group = substr($0, RSTART, RLENGTH); sub(/.*## /, "", group); sub(/: $/, "", group)
        lines[group] = lines[group] entry(target, text)
    }
    function entry(target, text,   variables) { # [variables] on a line of their own where they do not fit
        variables = index(text, " [")
        if (16 + length(text) > 100 && variables)
            text = substr(text, 1, variables - 1) sprintf("\n%16s", "") substr(text, variables + 1)
        return sprintf("  %-13s %s\n", target, text)
    }
    END {
        n = split(groups, order, " ")
        for (i = 1; i <= n; i++) printf "%s%s\n%s", (i > 1 ? "\n" : ""), order[i], lines[order[i]]
    }' "$@"
cat <<'END'

one test, one file
  make build/tests/test_dense && build/tests/test_dense
  make unit BEAMFIT_TESTS=test_beam         the programs whose names begin so
  make lint FILES='host/a.c tools/b.c'

variables, as in make JOBS=4 test
  B=build         where everything is built         JOBS=2          jobs of test, lint, ...
  CC=gcc          compiler                          OPT='-O2 -g'    optimisation
  CFLAGS=...      more flags for the compiler       WERROR=1        a warning is an error
  V=1             print whole commands              FUZZ_SECONDS=20 for each reader
  PREFIX=/usr/local  DESTDIR=...  where install puts things
END
