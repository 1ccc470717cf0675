#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# watch_clicks.sh BUILD [PICTURES] — `beamfit watch` in headless Chromium, on two taps of the tutorial's beam to fit and one to check: every
# control is operated, and the time from its click to its answer printed. PICTURES: a folder for screens.
set -eu
build=$(realpath "${1:?watch_clicks.sh BUILD [PICTURES]}")
top=$(cd "$(dirname "$0")/.." && pwd)
pictures=${2:+$(realpath "$2")}
command -v chromium >/dev/null || { echo "watch_clicks.sh: chromium is missing; apt-get install chromium" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$build/beam_truth" "$top"/data/tutorial/tap{1,2,3}.txt -o .
mv tap1.csv soft.csv && mv tap2.csv hard.csv && mv tap3.csv check.csv
"$build/beamfit" init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input hammer_N=point_force@0.0254 \
    --output piezo_V=patch_strain -o beam.yaml >/dev/null
"$build/beamfit" fit beam.yaml soft.csv hard.csv --check check.csv -o fitted.yaml >/dev/null
PYTHONPATH=$top/tests python3 -B "$top/tests/system/watch_browser.py" "$build/beamfit" ${pictures:+"$pictures"}
