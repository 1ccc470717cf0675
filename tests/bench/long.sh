#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# long.sh BUILD DIR N... — time and memory of simulate, compare and fit on recordings of N samples (one input, three outputs) from the truth simulator,
# as rows of a table. Recordings that are in DIR are not made again. The truth simulator takes 1.8 kB a sample.
set -eu
build=$(realpath "${1:?long.sh BUILD DIR N...}") dir=${2:?long.sh BUILD DIR N...}
shift 2
mkdir -p "$dir"
cd "$dir"
export OPENBLAS_NUM_THREADS=1
cat >model.yaml <<'END'
format: beamfit-model/1
beam: {length_m: 0.4573, patch_m: [0.02535, 0.08905]}
parameters:
  EI_beam_Nm2: {value: 0.5}
  EI_patch_Nm2: {value: 0.8}
  rho_beam_kgpm: {value: 0.093, fixed: true}
  rho_patch_kgpm: {value: 0.433, fixed: true}
  cDI_beam_sNm2: {value: 2e-5}
  cDI_patch_sNm2: {value: 2e-5, fixed: true}
  gamma_sNpm2: {value: 0.05}
  Ks_V: {value: 40}
inputs: {hammer_N: {kind: point_force, at_m: 0.0254}}
outputs:
  piezo_V: {kind: patch_strain}
  accel_mps2: {kind: acceleration, at_m: 0.0214}
  tip_mps: {kind: velocity, at_m: 0.44}
effects: []
END
spec() { # N: eight multisines, one after the other
    cat <<END
length_m 0.4573
patch_m 0.02535 0.08905
EI_beam_Nm2 0.491
EI_patch_Nm2 0.793
rho_beam_kgpm 0.093
rho_patch_kgpm 0.433
cDI_beam_sNm2 2e-5
cDI_patch_sNm2 2e-5
gamma_sNpm2 0.05
Ks_V 40
input hammer_N point_force at_m=0.0254
output piezo_V patch_strain
output accel_mps2 acceleration at_m=0.0214
output tip_mps velocity at_m=0.44
sample_rate_Hz 512
noise 0.004
modes 16
seed 3
blind 1
END
    awk -v n="$1" 'BEGIN {s = n / 512; printf "duration_s %.9g\n", s
        for (k = 0; k < 8; k++) printf "signal hammer_N multisine start_s=%.9g width_s=%.9g level=2 from_Hz=3 to_Hz=180 taper_s=0.2 count=40 seed=%d\n",
            0.2 + k * s / 8, s / 8 - 1, k + 1}'
}
echo "| samples | command | seconds | processor seconds | memory, MB | bytes a sample and channel |"
echo "|---|---|---|---|---|---|"
for n in "$@"; do
    spec "$n" >"r$n.txt"
    [ -e "r$n.csv" ] || "$build/beam_truth" "r$n.txt" -o . >/dev/null
    rm -f "s$n.csv" "f$n.yaml"
    for command in "simulate model.yaml --input r$n.csv -o s$n.csv" "compare model.yaml r$n.csv" "fit model.yaml r$n.csv -o f$n.yaml"; do
        # shellcheck disable=SC2086 # a list of words
        /usr/bin/time -f '%e %U %M' -o used "$build/beamfit" $command >/dev/null 2>said || { cat said >&2; exit 1; }
        awk -v n="$n" -v command="${command%% *}" 'END {printf "| %d | %s | %.1f | %.1f | %.0f | %.0f |\n", n, command, $1, $2, $3 / 1024, $3 * 1024 / n / 4}' used
    done
done
rm -f used said
