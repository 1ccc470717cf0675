#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# live_demo.sh BUILD OUT BOARD HIDES: docs/live_demo.md. A beam that hides something from its model, under a board.
set -eu
build=$1
out=$2
board=$3
hidden=$4
data=$(dirname "$0")/../data/live
beamfit=$build/beamfit
export OPENBLAS_NUM_THREADS=1
case $hidden in
mass) volts=(15) ;; # a weak motion leaves as much to a patch that was glued half a millimetre aside
spring) volts=(4 15) ;; # what is not linear shows when the level changes
*) echo "live-demo: HIDES=$hidden is not known; give mass or spring" >&2 && exit 2 ;;
esac

rm -rf "$out"
mkdir -p "$out"
work=$(mktemp -d "${TMPDIR:-/tmp}/beamfit_live.XXXXXX") # sockets have short paths
plant='' device=''
end() {
    for process in $device $plant; do
        kill -KILL "$process" 2>/dev/null && wait "$process" 2>/dev/null || true
    done
    rm -rf "$work"
}
trap end EXIT

fail() {
    echo "live-demo: $*" >&2
    exit 1
}

wait_for() { # FILE-OR-SOCKET PROCESS
    for _ in $(seq 600); do
        [ -e "$1" ] && return
        kill -0 "$2" 2>/dev/null || fail "$1 does not appear"
        sleep 0.05
    done
    fail "$1 does not appear"
}

# ---- The bench: a first model ----
"$build/beam_truth" "$data/bench.txt" -o "$out"
"$beamfit" fit "$data/model.yaml" "$out/bench.csv" -o "$out/baseline.yaml" --json > "$out/fit_bench.json"

# ---- The beam, and the board that drives and hears it ----
(umask 077 && head -c 32 /dev/urandom > "$work/key")
"$build/beam_truth" --live "$data/$hidden.txt" --socket "$work/plant" &
plant=$!
disown $plant
wait_for "$work/plant" $plant
case $board in
host)
    "$build/board_host" --virtual --plant "$work/plant" --key "$work/key" --nvm "$out/flash" --pty-link "$work/port" \
        > "$out/board.log" &
    device=$!
    disown $device
    wait_for "$work/port" $device
    ;;
stm32f405) # the product's firmware on QEMU 7.2, with the devices of tests/target/plugin; in virtual time
    qemu-system-arm -M netduinoplus2 -display none -monitor none -serial pty -icount shift=3,sleep=off \
        -device loader,addr=0x2001FF00,data=0x5EED,data-len=4 \
        -device loader,file="$work/key",addr=0x08010000,force-raw=on \
        -plugin "$build/stm32f405.so,plant=$work/plant,flash=$out/flash" -kernel "$build/firmware_stm32f405.elf" \
        > "$out/board.log" 2>&1 &
    device=$!
    disown $device # killed at the end: a QEMU that spins does not hear SIGTERM
    for _ in $(seq 100); do
        pty=$(sed -n 's/.*redirected to \([^ ]*\).*/\1/p' "$out/board.log")
        [ -z "$pty" ] || break
        kill -0 $device 2>/dev/null || fail "QEMU ended: $(tail -n 1 "$out/board.log")"
        sleep 0.1
    done
    [ -n "$pty" ] || fail "QEMU names no pseudo terminal"
    exec 9<> "$pty" # held open: QEMU looks for a new host once a second only
    stty raw -echo < "$pty"
    ln -s "$pty" "$work/port"
    sleep 1.5
    ;;
*) fail "BOARD=$board is not known; give host or stm32f405" ;;
esac
port=(--port "$work/port" --baud 921600)
key=(--key "$work/key")


live() { # NAME MODEL: give the board this model, record, watch
    "$beamfit" export "$2" -o "$out/$1.image" --json > "$out/export_$1.json"
    "$beamfit" download "$out/$1.image" "${port[@]}" "${key[@]}" --json > "$out/download_$1.json"
    "$beamfit" upload "${port[@]}" -o "$out/$1.running" > /dev/null
    for level in "${volts[@]}"; do
        for _ in 1 2 3; do # a busy machine may leave no room on the line; the record then says so
            "$beamfit" record "${port[@]}" "${key[@]}" --model "$2" --chirp "4:200:4:$level" --settle 5 --seconds 8 \
                --force -o "$out/$1_${level}V.csv" --json > "$out/record_$1_$level.json"
            ! grep -q '"gaps": *0' "$out/record_$1_$level.json" || break
        done
        "$beamfit" replay "$out/$1_${level}V.csv" --image "$out/$1.running" --json > "$out/replay_$1_$level.json"
    done
    "$beamfit" monitor "${port[@]}" "${key[@]}" --model "$2" --chirp "4:200:4:${volts[-1]}" --seconds 16 --plot "$out/$1" --json > "$out/monitor_$1.json"
}
say() {
    echo "live-demo: $*"
}

say "the board runs the model of the bench"
live before "$out/baseline.yaml"
say "diagnosis of what the board recorded"
kill -STOP "$device" # virtual time runs as fast as it can: not meanwhile
records=()
for level in "${volts[@]}"; do records+=("$out/before_${level}V.csv"); done
"$beamfit" diagnose "$out/baseline.yaml" "${records[@]}" --intersample zoh --json > "$out/diagnose.json"
effects=$(python3 -c 'import json, sys; print(*json.load(open(sys.argv[1]))["effects"])' "$out/diagnose.json")
[ -n "$effects" ] || fail "the diagnosis names no effect; see $out/diagnose.json"
model=$out/baseline.yaml
for effect in $effects; do
    "$beamfit" add "$model" "$effect" -o "$out/with_$effect.yaml" > /dev/null
    model=$out/with_$effect.yaml
done
"$beamfit" fit "$model" "${records[@]}" --intersample zoh -o "$out/fitted.yaml" --json > "$out/fit_live.json"
kill -CONT "$device"
say "the board runs the model with $effects"
live after "$out/fitted.yaml"
"$beamfit" info "${port[@]}" --json > "$out/info.json"

python3 -B - "$out" "$data/$hidden.txt" "${volts[@]}" <<'END'
import json
import sys

out, spec, levels = sys.argv[1], sys.argv[2], sys.argv[3:]


def answer(name):
    with open(f"{out}/{name}.json") as file:
        return json.load(file)


def watched(name):
    with open(f"{out}/monitor_{name}.json") as file:
        lines = [json.loads(line) for line in file]
    ratios = [line["ratio"] for line in lines]
    alarm = any(line["alarm"] for line in lines)
    print(f"{name:<10} live residual {min(ratios):.3g} to {max(ratios):.3g} x the noise, alarm {'on' if alarm else 'off'}")
    return ratios, alarm


with open(spec) as file:
    hides = next(line.split()[1:] for line in file if line.startswith("effect "))
truth = dict(pair.split("=") for pair in hides[1:])
missing, info, fit, download = answer("diagnose"), answer("info"), answer("fit_live"), answer("download_after")
records = [answer(f"record_{name}_{level}") for name in ("before", "after") for level in levels]
replays = [answer(f"replay_{name}_{level}") for name in ("before", "after") for level in levels]
print(f"bench      model fitted to {answer('fit_bench')['noise_ratio']:.2f} x its noise")
before, alarm_before = watched("before")
print(f"diagnosis  {missing['verdict']}: {' + '.join(missing['effects'])}; "
      f"{missing['noise_ratio_before']:.2f} -> {missing['noise_ratio_after']:.2f} x the noise when refitted")
print("fit        " + "; ".join(f"{name} = {fit['parameters'][name]['value']:.4g} +- {fit['parameters'][name]['sd']:.1g} "
                                f"(true {float(value):g})" for name, value in truth.items() if name in fit["parameters"]))
print(f"download   {download['bytes']} bytes while running, {download['seconds']:.2f} s; "
      f"{info['missed']} samples missed since power-on")
after, alarm_after = watched("after")
print(f"recorded   {sum(r['samples'] for r in records)} samples at {records[0]['sample_Hz']:g} Hz, "
      f"{sum(r['gaps'] for r in records)} gaps, {sum(r['crc_failures'] for r in records)} CRC failures")
equal = all(r["equal"] and r["compared"] == r["rows"] for r in replays)
print(f"replay     {sum(r['compared'] for r in replays)} predictions {'equal' if equal else 'NOT EQUAL'}, bit for bit")
print(f"pictures   {out}/before, {out}/after")
fine = (alarm_before and min(before) > 5 and not alarm_after and max(after) < 1.5 and missing["effects"] == hides[:1]
        and info["missed"] == 0 and equal and not any(r["gaps"] or r["crc_failures"] for r in records))
sys.exit(0 if fine else "live-demo: NOT as it should be")
END
