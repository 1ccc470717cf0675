#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# results_page.sh NAME...                run what docs/results/NAME.md shows and write the page anew
# results_page.sh --head TITLE COMMAND   only print how such a page begins: command, date, version, machine
# `hidden` and `false_alarms` are written by their own programs (make hidden PAGE=…), which call --head.
set -eu -o pipefail
cd "$(dirname "$0")/.."

declare -A title=(
    [bench]='Time and instructions: fit, prediction, diagnosis, one step'
    [board_checks]='The board, attack by attack'
    [boards]='Boards: flash, RAM, stack, instructions, and what was tried on the emulated boards'
    [conformance]='Another host on the line: pyxcp and pya2ldb'
    [coverage]='Line coverage of lib/ and firmware/ by their unit tests'
    [desk]='At the desk: what is overwritten, what is said of mistakes, how soon a click is answered'
    [experiments]='Two experiments with the numbers'
    [fuzz]='Hostile bytes for every reader'
    [journey]='The way of a new user: each command as typed, and its output'
    [live_demo]='The live demonstration'
    [survival]='What a board survived'
    [survival_stm32f405]='What the emulated product survived'
    [wrong_inputs]='Wrong inputs, and what is said of them')
# the commands of a page, one a line
declare -A made_by=(
    [bench]='make bench'
    [board_checks]='tools/board_checks.py build'
    [boards]=$'make size | sed -n \'/deepest calls/,$p\'\nmake target'
    [conformance]=$'make conformance\nmake conformance BOARD=stm32f405'
    [coverage]='make coverage'
    [desk]=$'tools/desk_tables.sh build\ntools/watch_clicks.sh build'
    [experiments]='make experiments'
    [fuzz]='make fuzz'
    [journey]='tools/journey.sh build'
    [live_demo]=$'make live-demo\nmake live-demo HIDES=spring\nmake live-demo BOARD=stm32f405\nmake live-demo MOVING=1 OFFSET_CODES=6\nmake live-demo BOARD=stm32f405 MOVING=1 OFFSET_CODES=6\nmake live-demo HIDES=spring MOVING=1 OFFSET_CODES=6'
    [survival]='make survival'
    [survival_stm32f405]='make survival BOARD=stm32f405 SHARE=0.35'
    [wrong_inputs]='tools/wrong_inputs.py build')

head_of() { # TITLE COMMAND
    printf '# %s\n\nMade by `%s`: %s, beamfit %s (commit %s), %s cores, load %s when it began.\nWritten by a program: run the command again instead of editing.\n' \
        "$1" "$2" "$(date -u +%F)" "$(sed -n 's/^VERSION := //p' Makefile)" "$(git describe --always --dirty 2>/dev/null || echo unknown)" \
        "$(nproc)" "$(cut -d' ' -f1 /proc/loadavg)"
}

if [ "${1:-}" = --head ]; then
    head_of "$2" "$3"
    exit
fi
[ $# -gt 0 ] || { echo "results_page.sh NAME...: one of ${!title[*]}" >&2; exit 2; }
failed=0
for name in "$@"; do
    name=${name//-/_}
    [ -n "${title[$name]:-}" ] || { echo "results_page.sh: no page '$name'; there are: ${!title[*]}" >&2; exit 2; }
    page=docs/results/$name.md
    mkdir -p docs/results
    {
        head_of "${title[$name]}" "make results WHAT=$name"
        while read -r command; do
            printf '\n    %s\n\n```\n' "$command"
            status=0
            MAKEFLAGS='' bash -o pipefail -c "$command" </dev/null 2>&1 | tee /dev/stderr | sed "/^make\[/d; \|^  build/|d; s|$PWD/||g" || status=$?
            printf '```\n'
            [ "$status" = 0 ] || { printf '\nIt ended with status %s.\n' "$status"; failed=1; }
        done <<<"${made_by[$name]}"
    } >"$page.new"
    mv "$page.new" "$page"
done
exit $failed
