#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# journey.sh BUILD — a new user's way, each command as typed with what it prints: a steel ruler clamped at both ends, with a patch, recorded in a format of
# its own; two patches; a free decay; what is missing on the machine. The truth simulator (BUILD/beam_truth) plays the beams; what it hides stands at the end.
set -u
build=$(realpath "${1:?journey.sh BUILD}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
export PATH=$build:$PATH OPENBLAS_NUM_THREADS=1 COLUMNS=80

part() { printf '\n# %s\n' "$*"; }
typed() { # COMMAND: as a person types it
    printf '\n$ %s\n' "$1"
    local status=0
    bash -c "$1" 2>&1 </dev/null || status=$?
    [ "$status" = 0 ] || printf '(status %s)\n' "$status"
}

# What the simulator plays: a beam of steel, and one of aluminium that rings after a blow before the recording.
ruler() { # HIDDEN DURATION LEVEL SEED
    printf '%s\n' 'length_m 0.3' 'support clamped-clamped' 'patch_m 0.02 0.07' 'EI_beam_Nm2 0.43' 'EI_patch_Nm2 0.71' 'rho_beam_kgpm 0.2' \
        'rho_patch_kgpm 0.32' 'cDI_beam_sNm2 6e-6' 'cDI_patch_sNm2 1.2e-5' 'gamma_sNpm2 0.05' 'Ks_V 41' 'KB_NmpV 0.0163' "effect $1" 'noise 0.004' \
        'sample_rate_Hz 2048' 'modes 16' 'tolerance 3e-7' "duration_s $2" 'input hammer_N point_force at_m=0.12' 'output piezo_V patch_strain' \
        'output accel_mps2 acceleration at_m=0.18' "signal hammer_N raised_cosine start_s=0.05 width_s=0.003 level=$3" "seed $4"
}
recorder() { # NAME: the simulator's record as this recorder writes it
    (echo 'Zeit;Hammer;Piezo;Beschl'
     grep '^[0-9]' "$1.csv" | awk -F, '{printf "%.7g;%.6g;%.6g;%.6g\n", 1e3 * $1, $2, 1e3 * $3, $4 / 9.80665}' | tr . ,) >"$1.txt"
    rm "$1.csv"
}
spring='cubic_stiffness coefficient_Npm3=2e8 at_m=0.24'
for run in 'weak 3 1' 'strong 20 2' 'check 40 3'; do
    read -r name level seed <<<"$run"
    ruler "$spring" 1 "$level" "$seed" >"$name.spec"
    beam_truth "$name.spec" -o . >/dev/null
    recorder "$name"
done
two() { # DRIVE_LEVEL SEED
    printf '%s\n' 'length_m 0.4' 'patch_m 0.2 0.25' 'region 0.02 0.07 0.9 0.35 1.2e-5' 'EI_beam_Nm2 0.5' 'EI_patch_Nm2 0.9' 'rho_beam_kgpm 0.1' 'rho_patch_kgpm 0.35' \
        'cDI_beam_sNm2 6e-6' 'cDI_patch_sNm2 1.2e-5' 'gamma_sNpm2 0.02' 'KB_NmpV 0.0163' 'noise 0.004' 'sample_rate_Hz 1024' 'duration_s 3' \
        'input drive_V patch_moment' 'output tip_mps velocity at_m=0.39' "signal drive_V chirp width_s=2.5 level=$1 from_Hz=3 to_Hz=300 taper_s=0.1" "seed $2"
}
two 20 4 >two.spec
two 10 5 >less.spec
beam_truth two.spec less.spec -o . >/dev/null
mv two.csv patches.csv
mv less.csv patches_check.csv
decay() { # LEVEL SEED
    printf '%s\n' 'length_m 0.4573' 'patch_m 0.02535 0.08905' 'noise 0.004' 'sample_rate_Hz 512' 'duration_s 3' 'keep_from_s 0.2' 'input hammer_N point_force at_m=0.2' \
        'output tip_m displacement at_m=0.44' "signal hammer_N raised_cosine start_s=0.05 width_s=0.02 level=$1" "seed $2"
}
decay 2 6 >let_go.spec
beam_truth let_go.spec -o . >/dev/null
(echo 'Time (ms),Laser (mm)'; grep '^[0-9]' let_go.csv | awk -F, '{printf "%.7g,%.7g\n", 1e3 * $1, 1e3 * $3}') >laser.csv
rm let_go.csv

part 'The machine'
typed 'beamfit doctor'

part 'A steel ruler clamped at both ends, with a patch: measured with a ruler, recorded in ms, mV and g, with semicolons and decimal commas'
typed 'head -n 3 weak.txt'
typed 'beamfit init --length 0.3 --width 0.025 --thickness 0.001 --material steel --support clamped-clamped --patch 0.02 0.07 --patch-sides 1 --input hammer_N=point_force@0.12 --output piezo_V=patch_strain --output accel_mps2=acceleration@0.18 -o ruler.yaml'
typed 'beamfit modes ruler.yaml'
typed 'beamfit import weak.txt --list'
for name in weak strong check; do
    typed "beamfit import $name.txt --time Zeit --time-unit ms --channel Hammer=hammer_N --channel Piezo=piezo_V --channel Beschl=accel_mps2 --scale piezo_V=0.001:V --scale accel_mps2=9.80665 -o $name.csv"
done
typed 'beamfit fit ruler.yaml weak.csv strong.csv --check check.csv -o fitted.yaml'
typed 'beamfit diagnose fitted.yaml weak.csv strong.csv --check check.csv | tee said.txt'
part "The lines behind 'Next', as they are printed"
while read -r line; do typed "$line"; done < <(sed -n 's/^  \(beamfit .*\)/\1/p' said.txt)
typed 'beamfit history ruler.yaml fitted.yaml added1.yaml with_cubic_stiffness.yaml'
typed 'beamfit report with_cubic_stiffness.yaml weak.csv strong.csv --check check.csv -o page.html'

part 'Mistakes on the way'
typed 'beamfit compare fitted.yaml weak.csv --chek check.csv'
typed 'beamfit fit ruler.yaml weak.csv --check weak.csv -o again.yaml'
typed "sed 's/^\\([0-9][^,]*\\),[^,]*/\\1,0/' weak.csv > silent.csv; beamfit compare fitted.yaml silent.csv | tail -n 6"
typed 'beamfit fit ruler.yaml silent.csv -o again.yaml | tail -n 9; exit ${PIPESTATUS[0]}'
typed 'beamfit fit ruler.yaml weak.csv -o weak.csv'
typed 'beamfit compare fitted.yaml weak.csv --max-nrmse 0.5 --plot weak.csv > plot.txt; tail -n 2 plot.txt'
typed 'mkdir bin; ln -s $(command -v beamfit) bin; PATH=$PWD/bin beamfit compare fitted.yaml weak.csv --plot pictures > plot.txt; /bin/ls pictures | /usr/bin/head -n 3'

part 'Two patches; driven by the second, listened to at the tip'
typed 'beamfit init --length 0.4 --width 0.02 --thickness 0.0015 --patch 0.02 0.07 --patch 0.2 0.25 --input drive_V=patch_moment@0.22 --output tip_mps=velocity@0.39 -o two.yaml'
typed "grep -n 'from_m\\|drive_V' two.yaml"
typed 'beamfit fit two.yaml patches.csv --check patches_check.csv -o two_fitted.yaml'

part 'A free decay: pulled, let go, recorded with a laser'
typed 'beamfit init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input hammer_N=point_force@0.2 --output tip_m=displacement@0.44 -o beam.yaml'
typed "beamfit import laser.csv --time 'Time (ms)' --time-unit ms --channel 'Laser (mm)=tip_m' --scale tip_m=0.001:m --free-decay -o decay.csv"
typed 'beamfit fit beam.yaml decay.csv -o decay_fitted.yaml'

part 'What was hidden'
printf '\nThe ruler: %s; EI 0.43 N m2, rho 0.2 kg/m.\n' "$spring"
