#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# long.sh BUILD DIR PAGE N... — time and memory of simulate, compare and fit on recordings of N samples (one input, three outputs), N ascending, and of replay on
# a board's recordings of N samples, into PAGE.
# The recordings are of a beam 2 % off the model, simulated, with noise. Those that are in DIR are not made again.
set -eu
build=$(realpath "${1:?long.sh BUILD DIR PAGE N...}") dir=${2:?long.sh BUILD DIR PAGE N...} page=$(realpath "${3:?long.sh BUILD DIR PAGE N...}")
shift 3
mkdir -p "$dir"
cd "$dir"
export OPENBLAS_NUM_THREADS=1
model() { # EI of the beam, gamma
    cat <<END
format: beamfit-model/1
beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}
parameters:
  EI_beam_Nm2: {value: $1}
  EI_patch_Nm2: {value: 0.8}
  rho_beam_kgpm: {value: 0.093, fixed: true}
  rho_patch_kgpm: {value: 0.433, fixed: true}
  cDI_beam_sNm2: {value: 2e-5}
  cDI_patch_sNm2: {value: 2e-5, fixed: true}
  gamma_sNpm2: {value: $2}
  Ks_V: {value: 40}
inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}
outputs:
  piezo_V: {kind: patch_strain}
  accel_mps2: {kind: acceleration, at_m: 0.0214}
  tip_mps: {kind: velocity, at_m: 0.44}
effects: []
END
}
model 0.5 0.05 >model.yaml
model 0.491 0.06 >true.yaml
record() { # N: noise drives the beam, and each output has 0.3 % of its size of noise
    awk -v n="$1" 'BEGIN {srand(5); print "time_s,hammer_N"
        for (k = 0; k < n; k++) {u = 0.6 * u + rand() - 0.5; printf "%.10g,%.6g\n", k / 512, u}}' >"u$1.csv"
    "$build/beamfit" simulate true.yaml --input "u$1.csv" -o "c$1.csv" >/dev/null
    awk -F, -v OFS=, 'BEGIN {srand(6)} /^[0-9]/ {for (c = 3; c <= NF; c++) {v[c] += $c * $c; m[c]++
        $c = sprintf("%.9g", $c + 0.01 * sqrt(v[c] / m[c]) * (rand() - 0.5))}} {print}' "c$1.csv" >"r$1.part"
    rm -f "u$1.csv" "c$1.csv"
    mv "r$1.part" "r$1.csv"
}
played() { # N: what a board records whose drive rests at its zero
    awk -v n="$1" 'BEGIN {print "time_s,drive_V,piezo_V,predicted,residual,ratio,sequence,step,codes,status"
        for (k = 0; k < n; k++) printf "%.10g,0,0,0,0,0,%d,%d,134219776,16777216\n", k / 1024, k, k}' >"p$1.csv"
}
sed 's/^outputs:/  drive_V: {kind: patch_moment}\n&/; /^  Ks_V/a\  KB_NmpV: {value: 0.01, fixed: true}' model.yaml |
    sed 's/^inputs: {\(.*\)}$/inputs:\n  \1/' >board.yaml
cat >>board.yaml <<END
board:
  sample_Hz: 1024
  sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}
  drive: {input: drive_V, per_code: 0.02, zero_code: 2048}
  noise_rms: 0.002
END
rm -f board.key
(umask 077; printf '%064d' 7 >board.key)
"$build/beamfit" export board.yaml --key board.key --device 0123456789abcdef01234567 --counter 1 -o board.bfi --force >/dev/null
for n in "$@"; do
    [ -e "r$n.csv" ] || record "$n"
    played "$n"
done
{
    echo "# Long recordings"
    echo
    echo "Made by \`make long-bench SAMPLES='$*'\`, $(date +%F), $("$build/beamfit" --version), $(nproc) cores, on one of them, beside whatever else ran. One input and"
    echo "three outputs, 512 samples a second; noise drives the beam, and each output has 0.3 % of noise; of replay what a board with a resting drive records, two channels. Growth:"
    echo "against the row above of the same command, for each sample more of each channel; what does not grow is the program and one piece of the record."
    echo
    echo "| samples | command | seconds | processor seconds | of these a million samples | memory, MiB | growth, bytes |"
    echo "|---|---|---|---|---|---|---|"
} >table
declare -A memory_of
before=0
for n in "$@"; do
    rm -f "s$n.csv" "f$n.yaml"
    for command in "simulate model.yaml --input r$n.csv -o s$n.csv" "compare model.yaml r$n.csv" "fit model.yaml r$n.csv -o f$n.yaml" \
        "replay p$n.csv --image board.bfi"; do
        # shellcheck disable=SC2086 # a list of words
        /usr/bin/time -f '%e %U %S %M' -o used "$build/beamfit" $command >/dev/null 2>said || { cat said >&2; exit 1; }
        word=${command%% *}
        channels=4
        [ "$word" = replay ] && channels=2
        awk -v n="$n" -v word="$word" -v channels=$channels -v before="$before" -v was="${memory_of[$word]:-0}" 'END {
            growth = before > 0 ? sprintf("%.1f", ($4 - was) * 1024 / (n - before) / channels) : ""
            printf "| %d | %s | %.1f | %.1f | %.1f | %.0f | %s |\n", n, word, $1, $2 + $3, ($2 + $3) * 1e6 / n, $4 / 1024, growth}' used | tee -a table
        memory_of[$word]=$(awk 'END {print $4}' used)
    done
    rm -f "s$n.csv" "p$n.csv"
    before=$n
done
mv table "$page"
rm -f used said
