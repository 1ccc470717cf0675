#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# experiments.sh BUILD DIR — two numerical experiments with the paper's beam (docs/experiments.md), on records of the truth
# simulator: what a coarse spline space does to the estimates, and how many pieces of EI(x) a record carries. Into DIR.
set -eu
cd "$(dirname "$0")/.."
top=$PWD
beamfit=$(realpath "$1/beamfit") beam_truth=$(realpath "$1/beam_truth")
mkdir -p "$2"
cd "$2"
length=0.4573 patch_end=0.08905
declare -A truth=([EI_beam_Nm2]=0.491 [EI_patch_Nm2]=0.793 [rho_patch_kgpm]=0.433 [cDI_beam_sNm2]=0.649e-5
    [cDI_patch_sNm2]=1.255e-5 [gamma_sNpm2]=0.013 [Ks_V]=4682.342)

record() { # NAME NOISE: a hammer blow of 4 ms at 2.54 cm, 1024 Hz, 4 s: five modes in the band
    cat >"$1.txt" <<SPEC
length_m = $length
patch_m = 0.02535 $patch_end
rho_beam_kgpm = 0.093
$(for name in "${!truth[@]}"; do echo "$name = ${truth[$name]}"; done)
input hammer_N point_force at_m=0.0254
signal hammer_N raised_cosine start_s=0.0625 width_s=0.004 level=5
output piezo_V patch_strain
sample_rate_Hz = 1024
duration_s = 4
filter_order = 8
filter_ratio = 0.4
noise = $2
adc_bits = 24
seed = 7
SPEC
    "$beam_truth" "$1.txt" -o .
}

fit() { # NAME RECORD OPTIONS...: NAME_start.yaml -> NAME.yaml, NAME.out
    "$beamfit" fit "$1_start.yaml" "$2.csv" -o "$1.yaml" --no-search "${@:3}" >"$1.out"
}
estimate() { sed -n "s/^  $1: {value: \([^,}]*\).*/\1/p" "$2.yaml"; } # all digits
channel_error() { awk '$1 ~ /\.csv$/ {print $3; exit}' "$1.out"; } # record, channel, error in %, times the noise
relative() { awk -v a="$1" -v b="$2" 'BEGIN {print a / b - 1}'; }

channels() {
    cat <<YAML
inputs:
  hammer_N: {kind: point_force, at_m: 0.0254}
outputs:
  piezo_V: {kind: patch_strain}
YAML
}

# ---- 1. Theorem 2 in practice ----

one_start() { # all: everything free but rho_beam; stiffness: one stiffness and the gain free, the rest true
    local held=''
    [ "$1" = stiffness ] && held=', fixed: true'
    value() { if [ -n "$held" ]; then echo "${truth[$1]}$held"; else echo "$2"; fi; }
    cat <<YAML
format: beamfit-model/1
beam: {length_m: $length, patch_m: [0.02535, $patch_end]}
parameters:
  EI_beam_Nm2: {value: 0.495}
  EI_patch_Nm2: {value: $(value EI_patch_Nm2 1.05)}
  rho_beam_kgpm: {value: 0.093, fixed: true}
  rho_patch_kgpm: {value: $(value rho_patch_kgpm 0.168)}
  cDI_beam_sNm2: {value: $(value cDI_beam_sNm2 0.825e-5)}
  cDI_patch_sNm2: {value: $(value cDI_patch_sNm2 0.825e-5)}
  gamma_sNpm2: {value: $(value gamma_sNpm2 0.00183)}
  Ks_V: {value: 3000}
YAML
    channels
}

convergence() { # WHAT KNOTS; a row per N
    local n name=$1-$2 option=''
    [ "$2" = uniform ] && option=,uniform
    for n in 10 20 40 80; do
        one_start "$1" >"$name-${n}_start.yaml"
        fit "$name-$n" clean --splines "$n$option"
        local row=$n parameter
        for parameter in EI_beam_Nm2 EI_patch_Nm2 rho_patch_kgpm Ks_V; do
            row+=" $(relative "$(estimate $parameter "$name-$n")" "${truth[$parameter]}")"
        done
        echo "$row $(channel_error "$name-$n")"
    done | tee "$name.dat" | awk '{printf "  %4d %+12.5f %+12.5f %+12.5f %+12.5f %12s\n", $1, 100 * $2, 100 * $3, 100 * $4, 100 * $5, $6}'
}

draw_convergence() {
    cat >convergence.gp <<'GP'
set logscale xy
set format y "10^{%L}"
set xlabel "Elements N of the spline space"
set ylabel "|estimate / truth - 1|"
set xtics (10, 20, 40, 80)
set xrange [8:100]
set grid
set key bottom left
plot "all-uniform.dat" using 1:(abs($2)) with linespoints pt 6 lw 2 lc rgb "#0072b2" title "EI beam, equidistant knots", \
     "all-uniform.dat" using 1:(abs($3)) with linespoints pt 4 lw 2 lc rgb "#0072b2" dt 2 title "EI patch, equidistant knots", \
     "all-edges.dat" using 1:(abs($2)) with linespoints pt 7 lw 2 lc rgb "#d55e00" title "EI beam, knots on the edges", \
     "all-edges.dat" using 1:(abs($3)) with linespoints pt 5 lw 2 lc rgb "#d55e00" dt 2 title "EI patch, knots on the edges"
GP
    gnuplot -e 'set terminal pngcairo size 1000,750 font ",12"; set output "convergence.png"' convergence.gp
    gnuplot -e 'set terminal pdfcairo size 5in,3.75in font ",10"; set output "convergence.pdf"' convergence.gp
}

# ---- 2. EI(x) in M pieces ----

pieces_start() { # M EI_PATCH EI_BEAM (start values): the patch, and M - 1 equal pieces of the span beyond it; the root before it belongs to the first
    local m=$1 i name
    piece_edge() { awk -v i="$1" -v k=$((m - 1)) -v a="$patch_end" -v l="$length" 'BEGIN {printf "%.6g", i == k ? l : a + i * (l - a) / k}'; }
    echo 'format: beamfit-model/1'
    echo "beam: {length_m: $length, regions: [{name: patch, from_m: 0.02535, to_m: $patch_end}, {name: p1, from_m: 0, to_m: 0.02535},"
    for ((i = 1; i < m; i++)); do
        echo "  {name: p$i, from_m: $(piece_edge $((i - 1))), to_m: $(piece_edge "$i")}$([ "$i" -lt $((m - 1)) ] && echo , || echo ']}')"
    done
    echo 'parameters:'
    for ((i = 0; i < m; i++)); do
        name=p$i start=$3 rho=0.093 cDI=${truth[cDI_beam_sNm2]}
        [ "$i" = 0 ] && name=patch start=$2 rho=${truth[rho_patch_kgpm]} cDI=${truth[cDI_patch_sNm2]}
        echo "  EI_${name}_Nm2: {value: $start}"
        echo "  rho_${name}_kgpm: {value: $rho, fixed: true}"
        echo "  cDI_${name}_sNm2: {value: $cDI, fixed: true}"
    done
    echo "  gamma_sNpm2: {value: 0.00183}"
    echo "  Ks_V: {value: 3000}"
    channels
}

# Two pieces start from the handbook, more from the estimates of two.
pieces() { # M RECORD: a row per stiffness; its logarithm is what was estimated, so the interval is value · exp(± 1.96 sd/value)
    local name=pieces-$1-$2
    if [ "$1" = 2 ]; then pieces_start 2 1.05 0.495
    else pieces_start "$1" "$(estimate EI_patch_Nm2 "pieces-2-$2")" "$(estimate EI_p1_Nm2 "pieces-2-$2")"
    fi >"${name}_start.yaml"
    fit "$name" "$2"
    sed -n 's/^  EI_\([a-z0-9]*\)_Nm2: {value: \([^,}]*\)\(, sd: \([^,}]*\)\)\{0,1\}.*/\1 \2 \4/p' "$name.yaml" |
        awk -v m="$1" -v beam="${truth[EI_beam_Nm2]}" -v patch="${truth[EI_patch_Nm2]}" '
            {true_value = $1 == "patch" ? patch : beam}
            $3 == "" {printf "  %d  %-6s %10.6f  not identifiable\n", m, $1, $2; next}
            {low = $2 * exp(-1.96 * $3 / $2); high = $2 * exp(1.96 * $3 / $2)
             printf "  %d  %-6s %10.6f  %9.6f … %-9.6f  %9.2g %%  %+9.2g %%  %s\n", m, $1, $2, low, high, 196 * $3 / $2,
                 100 * ($2 / true_value - 1), low <= true_value && true_value <= high ? "yes" : "no"}'
}

record clean 0.0001
record noisy 0.004

echo "1. Theorem 2 in practice: estimates in a space of splines on N elements, from the same clean record (noise 0.01 %)"
declare -A free=([all]='everything free but rho_beam' [stiffness]='EI_beam and Ks free, the rest true')
declare -A knots=([uniform]='equidistant knots' [edges]='knots on the edges of the patch')
for what in all stiffness; do
    for where in uniform edges; do
        echo
        echo "${knots[$where]}, ${free[$what]}; estimate / truth - 1 in %"
        echo "     N      EI_beam     EI_patch    rho_patch           Ks   misfit (%)"
        convergence $what "$where"
    done
done
draw_convergence

echo
echo "2. EI(x) in M pieces (the patch and M - 1 equal pieces), rho and cDI held at the truth"
declare -A said=([clean]='1024 Hz, 4 s, five modes and a trace of the sixth; noise 0.01 %' [noisy]='the same, noise 0.4 %'
    [b1tapih]="the paper's experiment: 256 Hz, 8 s, a soft hammer, two modes and a trace of the third; noise 0.4 %")
cp "$top/data/paper/b1tapih.csv" .
for name in clean noisy b1tapih; do
    echo
    echo "${said[$name]}"
    echo "  M  piece    EI (N·m²)  95 % interval            half width   off truth   holds it"
    for m in 2 4 8; do pieces $m $name; done
done
echo
echo "Picture: $(pwd)/convergence.png"
