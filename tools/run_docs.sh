#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# run_docs.sh BUILD PAGE... — run the ```console blocks of a page, in order, in one temporary directory with the program on
# the PATH and data/ beside it. A line "$ command" is run; the lines below it are what it must print: `...` alone stands
# for any lines, `...` within a line for any text, and a number agrees when it is within 2 % (clocks and rounding differ). A
# block may say what status it expects: ```console status=1
set -u
build=$(realpath "${1:?run_docs.sh BUILD PAGE...}")
shift
top=$(cd "$(dirname "$0")/.." && pwd)
failed=0 ran=0

compare=$(cat <<'AWK'
function number(s) { return s ~ /^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$/ }
function trim(s) { gsub(/^[(\[{",:;=±%]+|[)\]}",:;=±%]+$/, "", s); return s }
function same_word(a, b,   x, y, d) {
    if (a == b || a == "...") return 1
    x = trim(a); y = trim(b)
    if (!number(x) || !number(y)) return 0
    d = x - y
    return d * d <= (0.02 * x) ^ 2 + 1e-24
}
function same(a, b,   i, n, m, p, q) {
    if (a == b) return 1
    n = split(a, p, /[ \t]+/); m = split(b, q, /[ \t]+/)
    for (i = 1; i <= n; i++) {
        if (p[i] == "..." && i == n) return 1
        if (i > m || !same_word(p[i], q[i])) return 0
    }
    return n == m
}
NR == FNR { want[++w] = $0; next }
{ got[++g] = $0 }
END {
    j = 1
    for (i = 1; i <= w; i++) {
        if (want[i] == "...") {
            if (i == w) exit 0
            while (j <= g && !same(want[i + 1], got[j])) j++
        } else if (j <= g && same(want[i], got[j])) {
            j++
        } else {
            printf "  wanted: %s\n  got:    %s\n", want[i], j <= g ? got[j] : "(the end)"
            exit 1
        }
    }
    exit j <= g
}
AWK
)

run_command() { # PAGE LINE COMMAND STATUS; wanted lines in $work/.want
    (cd "$work" && PATH=$build:$PATH bash -c "$3") >"$work/.got" 2>&1 </dev/null
    local status=$?
    ran=$((ran + 1))
    if [ "$status" != "$4" ]; then
        echo "$1:$2: '$3' ended with status $status, wanted $4:"
        sed 's/^/  /' "$work/.got" | head -n 20
        failed=$((failed + 1))
    elif [ -s "$work/.want" ] && ! awk "$compare" "$work/.want" "$work/.got" >"$work/.differ"; then
        echo "$1:$2: '$3' printed something else:"
        cat "$work/.differ"
        failed=$((failed + 1))
    fi
}

run_page() {
    local page=$1 line=0 text inside=0 command='' at=0 status=0
    work=$(mktemp -d)
    ln -s "$top/data" "$work/data"
    while IFS= read -r text || [ -n "$text" ]; do
        line=$((line + 1))
        if [ "$inside" = 0 ]; then
            [[ $text == '```console'* ]] || continue
            inside=1 command='' status=0
            [[ $text =~ status=([0-9]+) ]] && status=${BASH_REMATCH[1]}
            continue
        fi
        if [[ $text == '$ '* || $text == '```' ]]; then
            [ -n "$command" ] && run_command "$page" "$at" "$command" "$status"
            command='' at=$line
            : >"$work/.want"
            [[ $text == '$ '* ]] && command=${text#'$ '}
            [[ $text == '```' ]] && inside=0
        elif [[ $command == *\\ ]]; then
            command+=$'\n'$text
        else
            printf '%s\n' "$text" >>"$work/.want"
        fi
    done <"$top/$page"
    rm -rf "$work"
}

for page in "$@"; do run_page "$page"; done
echo "docs: $ran commands of $# pages, $failed not as written"
[ "$failed" = 0 ] && [ "$ran" -gt 0 ]
