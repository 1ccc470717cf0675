#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# run.sh BUILD — the tables of `make bench`: everything measured now, on this machine, on one core. No pass or fail.
set -eu
build=$(realpath "${1:?run.sh BUILD}")
here=$(cd "$(dirname "$0")" && pwd)
work=$build/bench
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
one_core=()
command -v taskset >/dev/null && one_core=(taskset -c 0)

"$build/beam_truth" "$here"/hit_*.txt "$here"/chirp_*.txt -o "$work"
records=("$work"/hit_soft.csv "$work"/hit_hard.csv "$work"/chirp_weak.csv "$work"/chirp_strong.csv)
value() { sed -n "s/^$1 //p" "$2"; }
ratio() { awk -v a="$1" -v b="$2" 'BEGIN {printf "%.1f", a / b}'; }

echo "Fit: 4 records x 4096 samples, 6 channels, 9 parameters, from handbook values, noise 0.4 %, one core"
begin=$(date +%s.%N)
"${one_core[@]}" "$build/beamfit" fit "$here/model.yaml" "${records[@]}" -o "$work/fitted.yaml" --json >"$work/fit.json"
ours=$(awk -v a="$begin" -v b="$(date +%s.%N)" 'BEGIN {printf "%.3f", b - a}')
ours_ratio=$(sed -n 's/^  "noise_ratio": *\([0-9.eE+-]*\).*/\1/p' "$work/fit.json") # of the whole fit: one level deep
printf '  %-58s %9s  %12s  %s\n' program seconds noise_ratio 'times ours'
printf '  %-58s %9.3f  %12.3f  %s\n' 'beamfit fit (whole process, files included)' "$ours" "${ours_ratio:-nan}" 1
for variant in 24x16 40x64 60x128; do
    "${one_core[@]}" "$work/reference_fit_$variant" "$here/model.yaml" "${records[@]}" >"$work/reference_$variant" 2>/dev/null
    seconds=$(value seconds "$work/reference_$variant")
    printf '  %-58s %9.3f  %12.3f  %s\n' "plain: dense state space, ${variant%x*} modes, hold on ${variant#*x}x grid" \
        "$seconds" "$(value noise_ratio "$work/reference_$variant")" "$(ratio "$seconds" "$ours")"
done

echo
echo "One prediction of the same four records"
"${one_core[@]}" "$work/simulate" "$here/model.yaml" "${records[@]}" >"$work/simulate.out"
ours=$(value ours "$work/simulate.out")
printf '  %-58s %9s  %s\n' program ms 'times ours'
while read -r name text; do
    seconds=$(value "$name" "$work/simulate.out")
    printf '  %-58s %9.3f  %s\n' "$text" "$(awk -v s="$seconds" 'BEGIN {print 1000 * s}')" "$(ratio "$seconds" "$ours")"
done <<'ROWS'
ours beamfit, outputs only
ours_with_derivatives beamfit, outputs and their derivatives by all parameters
plain plain dense loop, 60 modes, hold on 128x grid, outputs only
ROWS

echo
echo "One step of the library, instructions on this machine (valgrind --tool=callgrind, mean of 2000 steps)"
if command -v valgrind >/dev/null; then
    instructions() { # PROGRAM N EFFECT...
        valgrind --tool=callgrind --callgrind-out-file=/dev/null "$@" 2>&1 >/dev/null | sed -n 's/.*Collected : //p'
    }
    printf '  %-58s %9s  %9s\n' model float double
    for effect in '' quadratic_drag cubic_stiffness coulomb_friction stop_contact sensor_highpass; do
        row=()
        for type in float double; do
            # shellcheck disable=SC2086 # no effect, no argument
            many=$(instructions "$work/step_$type" 3000 $effect) few=$(instructions "$work/step_$type" 1000 $effect)
            row+=("$(awk -v a="$many" -v b="$few" 'BEGIN {if (a > b) printf "%.0f", (a - b) / 2000; else print "-"}')")
        done
        printf '  %-58s %9s  %9s\n' "linear${effect:+ + $effect}" "${row[@]}"
    done
else
    echo '  valgrind is not installed (make deps)'
fi
