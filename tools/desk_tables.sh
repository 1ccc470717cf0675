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
run() { # WORDS: `status` and `said`, the last line of standard error
    status=0
    said=$("$build/beamfit" "$@" 2>&1 >/dev/null) || status=$?
    said=$(printf '%s\n' "$said" | grep '^beamfit: ' | tail -n 1 | sed 's/^beamfit: //') || said=''
}

echo 'Overwriting: the output names a file of somebody else, its own file, its own that was edited, the first again with --force'
echo
printf '%-66s %-10s %-10s %-10s %s\n' command foreign own edited --force
overwrite() { # FILE WORDS
    local file=$1 results=()
    shift
    echo 'years of work' >"$file"
    run "$@"
    results+=("$([ "$(cat "$file")" = 'years of work' ] && echo kept || echo replaced) $status")
    run "$@" --force
    local forced="$([ "$(head -c 13 "$file")" = 'years of work' ] && echo kept || echo replaced) $status"
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
