#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# diagnose.sh BUILD — tables of `make bench`, the diagnosis: the search beside refitting every candidate, and the cost of a diagnosis
# against the number of samples and of candidates. Measured now, on this machine, one after the other. No pass or fail.
set -eu
build=$(realpath "${1:?diagnose.sh BUILD}")
here=$(cd "$(dirname "$0")" && pwd)
work=$build/bench/diagnose
mkdir -p "$work"
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1

# records NAME SECONDS EFFECT: the four bench records with a hidden effect, in $work/NAME
records() {
    mkdir -p "$work/$1"
    for spec in "$here"/hit_*.txt "$here"/chirp_*.txt; do
        { sed "s/^duration_s = .*/duration_s = $2/; s/width_s=3.8/width_s=$(awk -v t="$2" 'BEGIN {print t - 0.2}')/" "$spec"
          echo "effect $3"; } >"$work/$1/$(basename "$spec")"
    done
    "$build/beam_truth" "$work/$1"/*.txt -o "$work/$1"
}
# diagnose NAME OPTIONS...: sets verdict, seconds, evaluations
diagnose() {
    local name=$1
    shift
    "$build/beamfit" diagnose "$here/model.yaml" "$work/$name"/hit_*.csv "$work/$name"/chirp_*.csv --effects 1 --json "$@" \
        >"$work/answer.json"
    read -r verdict seconds evaluations < <(python3 - "$work/answer.json" <<'PY'
import json, sys
a = json.load(open(sys.argv[1]))
print(a["verdict"] + ":" + ("+".join(a["effects"]) or "-"), round(a["seconds"], 2), a["evaluations"])
PY
    )
}
quotient() { awk -v a="$1" -v b="$2" 'BEGIN {printf "%.1f", a / b}'; }

echo "Diagnosis: 4 records x 2048 samples, one hidden effect, explanations of one effect, $(nproc --all) processors"
printf '  %-22s %-44s %8s %12s  %s\n' hidden answer seconds evaluations 'times ours'
for effect in 'tip_mass mass_kg=0.0006' 'root_compliance compliance_radpNm=0.001 loss_s=3e-5'; do
    name=${effect%% *}
    records "$name" 2 "$effect"
    diagnose "$name"
    ours=$seconds
    printf '  %-22s %-44s %8s %12s  %s\n' "$name" "search: $verdict" "$seconds" "$evaluations" 1
    diagnose "$name" --everything
    printf '  %-22s %-44s %8s %12s  %s\n' "$name" "every candidate refitted: $verdict" "$seconds" "$evaluations" "$(quotient "$seconds" "$ours")"
done

echo
echo "Cost against samples (hidden: tip_mass)"
printf '  %12s %-34s %8s %12s  %s\n' 'samples' answer seconds evaluations 'microseconds a sample'
for seconds_long in 2 4 8 16; do
    records "long_$seconds_long" "$seconds_long" 'tip_mass mass_kg=0.0006'
    diagnose "long_$seconds_long"
    samples=$((4 * 1024 * seconds_long))
    printf '  %12s %-34s %8s %12s  %s\n' "$samples" "$verdict" "$seconds" "$evaluations" "$(awk -v s="$seconds" -v n=$samples 'BEGIN {printf "%.0f", 1e6 * s / n}')"
done

echo
echo "Cost against candidates (hidden: tip_mass, 4 x 2048 samples; the truth is among them)"
mapfile -t ids < <("$build/beamfit" effects --json | sed -n 's/^      "id": "\(.*\)",/\1/p' | grep -v -e '^tip_mass$' -e '^point_mass$')
printf '  %12s %-34s %8s %12s\n' 'candidates' answer seconds evaluations
for part in 4 2 1; do
    left_out=()
    for i in "${!ids[@]}"; do
        (((i % part) == 0)) || left_out+=("${ids[i]}")
    done
    without=$(IFS=, && echo "${left_out[*]}")
    diagnose tip_mass ${without:+--without "$without"}
    printf '  %12s %-34s %8s %12s\n' "$((${#ids[@]} + 2 - ${#left_out[@]}))" "$verdict" "$seconds" "$evaluations"
done
