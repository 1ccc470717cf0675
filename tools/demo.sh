#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# demo.sh BUILD DIR — the seed paper's two experiments, from the 'given' values to fitted models: fit, table beside the
# paper's Table 3 (docs/paper_table3.csv), agreement of the two experiments, pictures, convergence in N; then a beam that hides
# an effect: compare, diagnose, add, fit, history, report. Into DIR.
set -eu
cd "$(dirname "$0")/.."
build=$(realpath "$1")
beamfit=$build/beamfit
mkdir -p "$2"
out=$(realpath --relative-to=. "$2")

declare -A title=([b1tapih]='B1TAPIH: impulse hammer, patch voltage' [b1taoiv]='B1TAOIV: triangle voltage on the patch, accelerometer')

echo "1. Fit from the 'given' values"
for name in b1tapih b1taoiv; do
    echo
    echo "${title[$name]}"
    "$beamfit" fit "data/paper/$name.yaml" "data/paper/$name.csv" -o "$out/$name.yaml"
done

# With one uncalibrated channel a record fixes only ratios. A weighed beam fixes the scale: rho_beam as in Table 3.
table3() { awk -F, -v p="$1" -v column="$2" '$1 == "parameter" {for (i = 2; i <= NF; i++) if ($i == column) c = i}
    $1 == p {print $c}' docs/paper_table3.csv; }
weigh() { # NAME, column of Table 3
    sed "s|^  rho_beam_kgpm:.*|  rho_beam_kgpm:  {value: $(table3 rho_beam_kgpm "$2"), fixed: true}|" "data/paper/$1.yaml" \
        >"$out/$1_weighed_start.yaml"
    "$beamfit" fit "$out/$1_weighed_start.yaml" "data/paper/$1.csv" -o "$out/$1_weighed.yaml" >"$out/$1_weighed.txt"
}
weigh b1tapih B1TAPIH
weigh b1taoiv B1TAOIV

# parameter -> "value sd" of a fitted model (one parameter a line)
fitted() { sed -n "s/^  $1: *{\(.*\)}.*/\1/p" "$2" | tr ',' '\n' |
    awk '/^ *value:/ {v = $2} /^ *sd:/ {s = $2} END {print v, (s == "" ? 0 : s)}'; }

echo
echo "2. Beside the paper's Table 3 (beam weighed: rho_beam held at the paper's value, so that no scale is free)"
echo
awk 'BEGIN {printf "  %-15s %10s  %21s %10s %7s  %21s %10s %7s\n", "", "given", "B1TAPIH here ± 2 sd", "paper", "off/sd", "B1TAOIV here ± 2 sd", "paper", "off/sd"}'
inside=0 compared=0
while IFS=, read -r parameter given tapih taoiv; do
    [[ $parameter == \#* || $parameter == parameter ]] && continue
    row=$(printf '  %-15s %10s' "$parameter" "${given:--}")
    for pair in "b1tapih:$tapih" "b1taoiv:$taoiv"; do
        paper=${pair#*:}
        read -r value sd < <(fitted "$parameter" "$out/${pair%:*}_weighed.yaml")
        if [ -z "$paper" ] || [ -z "$value" ]; then row+=$(printf '  %21s %10s %7s' '' '' ''); continue; fi
        row+=$(awk -v v="$value" -v s="$sd" -v p="$paper" 'BEGIN {
            if (s > 0) printf "  %10.5g ± %8.2g %10.5g %+7.2f", v, 2 * s, p, (v - p) / s
            else printf "  %10.5g %10s %10.5g %7s", v, "held", p, ""}')
        if awk -v s="$sd" 'BEGIN {exit !(s > 0)}'; then
            compared=$((compared + 1))
            if awk -v v="$value" -v s="$sd" -v p="$paper" 'BEGIN {exit !((v - p) ^ 2 <= (1.96 * s) ^ 2)}'; then inside=$((inside + 1)); fi
        fi
    done
    echo "$row"
done <docs/paper_table3.csv
echo
echo "  $inside of $compared estimates hold the value that made the recording in their 95 % interval."

echo
echo "3. Do the two experiments agree? Ratios, which need no scale (the paper's two columns differ by as much)"
echo
awk 'BEGIN {printf "  %-26s %12s %12s %11s %14s\n", "", "B1TAPIH", "B1TAOIV", "difference", "in the paper"}'
ratio() { # name numerator denominator
    local a b
    a=$(awk -v x="$(fitted "$2" "$out/b1tapih.yaml")" -v y="$(fitted "$3" "$out/b1tapih.yaml")" \
        'BEGIN {split(x, p, " "); split(y, q, " "); print p[1] / q[1]}')
    b=$(awk -v x="$(fitted "$2" "$out/b1taoiv.yaml")" -v y="$(fitted "$3" "$out/b1taoiv.yaml")" \
        'BEGIN {split(x, p, " "); split(y, q, " "); print p[1] / q[1]}')
    awk -v n="$1" -v a="$a" -v b="$b" -v pa="$(table3 "$2" B1TAPIH)" -v qa="$(table3 "$3" B1TAPIH)" \
        -v pb="$(table3 "$2" B1TAOIV)" -v qb="$(table3 "$3" B1TAOIV)" \
        'BEGIN {printf "  %-26s %12.6g %12.6g %+10.2f%% %+13.2f%%\n", n, a, b, 100 * (b / a - 1), 100 * (pb / qb / (pa / qa) - 1)}'
}
ratio 'EI_beam / rho_beam' EI_beam_Nm2 rho_beam_kgpm
ratio 'EI_patch / rho_beam' EI_patch_Nm2 rho_beam_kgpm
ratio 'rho_patch / rho_beam' rho_patch_kgpm rho_beam_kgpm
ratio 'cDI_beam / EI_beam' cDI_beam_sNm2 EI_beam_Nm2
ratio 'gamma / rho_beam' gamma_sNpm2 rho_beam_kgpm

echo
echo "4. Measured against model"
for name in b1tapih b1taoiv; do
    echo
    "$beamfit" compare "$out/$name.yaml" "data/paper/$name.csv" --plot "$out/$name" | tee "$out/$name.txt"
done

echo
echo "5. Convergence in the dimension N (Theorem 2 in practice)"
echo
"$beamfit" modes --convergence --plot "$out/convergence" "$out/b1tapih_weighed.yaml" | tee "$out/convergence.txt"

echo
echo "6. Something is missing: case h08 of data/hidden, whose beam hides an effect that its model lacks"
echo
hidden=$out/hidden
python3 -B - "$build/beam_truth" "$hidden" <<'PYTHON'
import os, sys
sys.path.insert(0, "tests/hidden")
import cases
program, directory = (os.path.abspath(path) for path in sys.argv[1:])
case, = cases.read_cases(["h08"])
cases.make_records(case, program, directory, cases.simulator_hash())
PYTHON
fitted_records=("$hidden"/train?.csv)
check_records=("$hidden"/check?.csv)
"$beamfit" fit "$hidden/model.yaml" "${fitted_records[@]}" --check "${check_records[@]}" -o "$hidden/fitted.yaml" \
    >"$hidden/fit.txt"
"$beamfit" compare "$hidden/fitted.yaml" "${check_records[@]}" --plot "$hidden/compare" | tee "$hidden/compare.txt"
echo
"$beamfit" diagnose "$hidden/fitted.yaml" "${fitted_records[@]}" --check "${check_records[@]}" --plot "$hidden/diagnose" |
    tee "$hidden/diagnose.txt"
named=$(sed -n 's/^Verdict: missing: //p' "$hidden/diagnose.txt")
[[ $named =~ ^[a-z_]+$ ]] || { echo "demo: diagnose named no single effect" >&2; exit 1; }
echo
"$beamfit" add "$hidden/fitted.yaml" "$named" -o "$hidden/added.yaml"
"$beamfit" fit "$hidden/added.yaml" "${fitted_records[@]}" --check "${check_records[@]}" -o "$hidden/added_fitted.yaml" \
    >"$hidden/added_fit.txt"
"$beamfit" compare "$hidden/added_fitted.yaml" "${check_records[@]}" --plot "$hidden/compare_added" >"$hidden/compare_added.txt"
echo
"$beamfit" history "$hidden"/{model,fitted,added,added_fitted}.yaml --plot "$hidden/history" | tee "$hidden/history.txt"
echo
"$beamfit" report "$hidden/added_fitted.yaml" "${fitted_records[@]}" --check "${check_records[@]}" -o "$out/report.html" \
    --title 'A beam that hid an effect'

total() { sed -n 's/^all channels (root mean square): //p' "$out/$1.txt"; }
frequencies=$(awk '$1 == 1 {a = $2} $1 == 2 {b = $2; exit} END {print a, "and", b, "Hz"}' "$out/convergence.txt")
cat <<EOT

Summary
  B1TAPIH, hammer to patch voltage:        $(total b1tapih)
  B1TAOIV, patch voltage to acceleration:  $(total b1taoiv)
  First two modes of the fitted B1TAPIH: $frequencies (the paper measured 6.625 and 38.375 Hz)
  $inside of $compared estimates hold the true value in their 95 % interval
  The beam that hides an effect (records never fitted): $(total hidden/compare)
    diagnose, $(sed -n "1s/^V/v/p" "$hidden/diagnose.txt")
    added and fitted:  $(total hidden/compare_added)
    the number found: $(awk '/^mass_kg / {print $1, "=", $3, $4, $5, "kg"}' "$hidden/added_fit.txt")
    what was hidden (read after the diagnosis): $(sed -n '/^h08 /{n; s/^ *effect //p}' data/hidden/answers.txt)
  All of the last one on a page, to send or to print: $out/report.html
  Pictures and fitted models: $out/
EOT
find "$out" -name '*.png' | sort | sed 's/^/    /'
