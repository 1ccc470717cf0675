#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# desk_tables.sh BUILD — what beamfit does to files that exist, and what it says of mistakes: command, result or message, status. As it prints them now.
set -eu
build=$(realpath "${1:?desk_tables.sh BUILD}")
top=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$top"/data/paper/b1tapih.yaml beam.yaml
cp "$top"/data/paper/b1tapih.csv tap.csv
(cat beam.yaml && printf 'board:\n  sample_Hz: 1000\n  sensor: {output: piezo_V, per_code: 0.001, zero_code: 2048}\n  drive: {input: hammer_N, per_code: 0.02, zero_code: 2048}\n  noise_rms: 0.002\n') >board.yaml
run() { # WORDS: `status` and `said`, the last line of standard error
    status=0
    said=$("$build/beamfit" "$@" 2>&1 >/dev/null) || status=$?
    said=$(printf '%s\n' "$said" | grep '^beamfit: ' | tail -n 1 | sed 's/^beamfit: //') || said=''
}

echo 'Overwriting: the output names a file of somebody else, its own file, its own that was edited, the first again with --force'
echo
printf '%-66s %-10s %-10s %-10s %s\n' command foreign own edited --force
echo 'years of work' >years
overwrite() { # FILE WORDS
    local file=$1 results=()
    shift
    mkdir -p "$(dirname "$file")"
    cp years "$file"
    run "$@"
    results+=("$(cmp -s "$file" years && echo kept || echo replaced) $status")
    run "$@" --force
    local forced
    forced="$(cmp -s "$file" years && echo kept || echo replaced) $status"
    run "$@"
    results+=("$([ "$status" = 0 ] && echo replaced || echo kept) $status")
    echo '# looked at' >>"$file"
    run "$@"
    results+=("$([ "$status" = 0 ] && echo replaced || echo kept) $status")
    printf '%-66s %-10s %-10s %-10s %s\n' "$*" "${results[@]}" "$forced"
}
overwrite new.yaml init -o new.yaml
overwrite sim.csv simulate beam.yaml --input tap.csv -o sim.csv
overwrite shapes.csv modes beam.yaml --shapes shapes.csv
overwrite fitted.yaml fit beam.yaml tap.csv -o fitted.yaml
overwrite mass.yaml add beam.yaml tip_mass -o mass.yaml
overwrite less.yaml drop mass.yaml tip_mass -o less.yaml
overwrite again.csv import sim.csv -o again.csv
overwrite page.html report beam.yaml tap.csv -o page.html --pictures 0
overwrite lines.uff frf beam.yaml -o lines.uff
overwrite found.yaml diagnose beam.yaml tap.csv -o found.yaml
overwrite shots/shapes.png modes beam.yaml --plot shots
overwrite looks/tap-piezo_V.png compare beam.yaml tap.csv --plot looks
overwrite chain/history.png history fitted.yaml --plot chain
overwrite model.img export board.yaml -o model.img
run export board.yaml -o model.img --force
(umask 077 && head -c 32 /dev/urandom >key)
overwrite signed.img sign model.img --key key --device 0123456789abcdef01234567 --counter 1 -o signed.img
overwrite model.a2l export board.yaml -o other.img --a2l model.a2l

printf '\nAn output that names a file which the command reads\n\n'
onto() { # FILE WORDS: named last, behind the option
    local file=$1 before
    shift
    before=$(sha256sum <"$file")
    run "$@" "$file"
    printf '%-66s %s %s\n' "$* $file" "$([ "$(sha256sum <"$file")" = "$before" ] && echo kept || echo replaced)" "$status"
}
for file in beam.yaml tap.csv; do
    onto $file fit beam.yaml tap.csv -o
    onto $file simulate beam.yaml --input tap.csv -o
    onto $file diagnose beam.yaml tap.csv -o
    onto $file report beam.yaml tap.csv -o
    onto $file compare beam.yaml tap.csv --plot
done
onto beam.yaml modes beam.yaml --shapes
onto beam.yaml modes beam.yaml --plot
onto beam.yaml add beam.yaml tip_mass -o
onto mass.yaml drop mass.yaml tip_mass -o
onto beam.yaml frf beam.yaml -o
onto tap.csv import tap.csv -o
onto board.yaml export board.yaml -o
onto board.yaml export board.yaml -o new.img --a2l
onto model.img sign model.img --key key --device 0123456789abcdef01234567 --counter 2 -o
onto key sign model.img --key key --device 0123456789abcdef01234567 --counter 2 -o
run fit beam.yaml tap.csv -o beam.yaml
printf '\nfit onto the model that it reads: status %s, %s\n' "$status" "$said"

printf '\nMistakes: status and what is said\n\n'
mistake() {
    run "$@"
    printf 'beamfit %s\n    %s  %s\n' "$*" "$status" "$said"
}
printf 'time_s,hammer_N,piezo_V\n0,0,0\n0.01,nan,1\n' >nan.csv
printf 'time_s,hammer_N,piezo_V\n0,0,0\n0.01,1,1\n0.05,1,1\n' >uneven.csv
awk -F, -v OFS=, '/^[0-9]/ {$2 = 0} {print}' tap.csv >silent.csv
sed 's/EI_beam_Nm2:/EI_baem_Nm2:/' beam.yaml >typo.yaml
mistake fti beam.yaml
mistake compare beam.yaml tap.csv --chek tap.csv
mistake compare beam.yaml tap.csv --intersample blx
mistake compare beam.yaml tap.csv --format jsn
mistake fit beam.yaml tap.csv
mistake fit beam.yaml tap.csv --check tap.csv -o out.yaml
mistake fit beam.yaml silent.csv -o out.yaml
mistake fit typo.yaml tap.csv -o out.yaml
mistake fit beam.yaml nowhere.csv -o out.yaml
mistake fit beam.yaml nan.csv -o out.yaml
mistake fit beam.yaml uneven.csv -o out.yaml
mistake fit beam.yaml tap.csv -o nowhere/out.yaml
mistake add beam.yaml tip_mas -o out.yaml
mistake add beam.yaml tip_mass mas_kg=1 -o out.yaml
mistake init --length 457 -o long.yaml
mistake modes beam.yaml -n 99
mistake verify beam.yaml
mistake info --port /dev/nowhere
