#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# live_demo.sh BUILD OUT BOARD HIDES [MOVING OFFSET_CODES]: docs/live_demo.md. A beam that hides something from its model, under a board.
# MOVING=1: first the beam hides nothing but swings when the board is switched on; OFFSET_CODES: the sensor's converter is off by so many.
set -eu
build=$1
out=$2
board=$3
hidden=$4
moving=${5:-0}
offset=${6:-0}
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
right_first=0
if [ "$moving" != 0 ] || [ "$offset" != 0 ]; then right_first=1; fi
sed "s/^live /live sensor_zero_code=$((2048 + offset)) /" "$data/$hidden.txt" > "$out/hides.txt"
sed '/^effect /d' "$out/hides.txt" > "$out/right.txt"
beams=("$out/hides.txt")
[ $right_first = 0 ] || beams=("$out/right.txt" "$out/hides.txt") # SIGUSR1: from the one to the other
"$build/beam_truth" --live "${beams[@]}" --socket "$work/plant" &
plant=$!
disown $plant
wait_for "$work/plant" $plant

power_off() {
    kill -KILL "$device" && wait "$device" 2>/dev/null || true
    rm -f "$work/port"
}

power_on() {
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
}
power_on
port=(--port "$work/port" --baud 921600)
key=(--key "$work/key")

watch() { # NAME MODEL VOLTS
    "$beamfit" monitor "${port[@]}" "${key[@]}" --model "$2" --chirp "4:200:4:$3" --seconds 16 --plot "$out/$1" --json > "$out/monitor_$1.json"
}

live() { # NAME MODEL: give the board this model, record, watch
    "$beamfit" export "$2" -o "$out/$1.image" --json > "$out/export_$1.json"
    "$beamfit" download "$out/$1.image" "${port[@]}" "${key[@]}" --json > "$out/download_$1.json"
    "$beamfit" upload "${port[@]}" -o "$out/$1.running" > /dev/null
    for level in "${volts[@]}"; do
        for _ in $(seq 8); do # a busy machine may leave no room on the line; the record then says so
            "$beamfit" record "${port[@]}" "${key[@]}" --model "$2" --chirp "4:200:4:$level" --settle 5 --seconds 8 \
                --force -o "$out/$1_${level}V.csv" --json > "$out/record_$1_$level.json"
            ! grep -q '"gaps": *0' "$out/record_$1_$level.json" || break
        done
        "$beamfit" replay "$out/$1_${level}V.csv" --image "$out/$1.running" --json > "$out/replay_$1_$level.json"
    done
    watch "$1" "$2" "${volts[-1]}"
}
say() {
    echo "live-demo: $*"
}
swing() { # a hand at the plant: near the first resonance, 20 V, 3 s; what it leaves moves on when the next controller comes
    python3 -B - "$work/plant" <<'END'
import math
import socket
import struct
import sys

with socket.socket(socket.AF_UNIX) as plant:
    plant.connect(sys.argv[1])
    codes = []
    for k in range(3000):
        plant.sendall(struct.pack("<HH", 0x5042, 2048 + round(2000 * math.sin(2 * math.pi * 6.8e-3 * k))))
        codes += struct.unpack("<H", plant.recv(2, socket.MSG_WAITALL))
print(f"the beam swings through {max(codes[-500:]) - min(codes[-500:])} codes")
END
}

# ---- A model that is right: a beam that swings at power-on, and an offset, are no reason for its alarm ----
if [ $right_first = 1 ]; then
    say "the board is given the model of the bench, which is right, and switched off"
    "$beamfit" export "$out/baseline.yaml" -o "$out/right.image" --json > "$out/export_right.json"
    "$beamfit" download "$out/right.image" "${port[@]}" "${key[@]}" --json > "$out/download_right.json"
    power_off
    [ "$moving" = 0 ] || swing > "$out/swing"
    say "switched on: $(cat "$out/swing" 2> /dev/null || echo 'the beam is at rest')"
    power_on
    "$beamfit" monitor "${port[@]}" --model "$out/baseline.yaml" --seconds 20 --json > "$out/monitor_on.json"
    "$beamfit" info "${port[@]}" --json > "$out/info_on.json"
    watch right "$out/baseline.yaml" "${volts[0]}"
    "$beamfit" info "${port[@]}" --json > "$out/info_right.json"
    kill -USR1 "$plant"
    say "$hidden: the beam hides it now, the model does not know"
    watch hung "$out/baseline.yaml" "${volts[-1]}"
    "$beamfit" info "${port[@]}" --json > "$out/info_hung.json"
fi

say "the board runs the model of the bench"
live before "$out/baseline.yaml"
say "diagnosis of what the board recorded"
kill -STOP "$device" # virtual time runs as fast as it can: not meanwhile
model=$out/baseline.yaml
if [ "$offset" != 0 ]; then # the board has said so: latched in info_right.json
    "$beamfit" add "$model" sensor_offset drift_per_s=0 --fix drift_per_s -o "$out/offset.yaml" > /dev/null
    model=$out/offset.yaml
fi
records=()
for level in "${volts[@]}"; do records+=("$out/before_${level}V.csv"); done
"$beamfit" diagnose "$model" "${records[@]}" --intersample zoh --json > "$out/diagnose.json"
effects=$(python3 -c 'import json, sys; print(*json.load(open(sys.argv[1]))["effects"])' "$out/diagnose.json")
[ -n "$effects" ] || fail "the diagnosis names no effect; see $out/diagnose.json"
for effect in $effects; do
    "$beamfit" add "$model" "$effect" -o "$out/with_$effect.yaml" > /dev/null
    model=$out/with_$effect.yaml
done
"$beamfit" fit "$model" "${records[@]}" --intersample zoh -o "$out/fitted.yaml" --json > "$out/fit_live.json"
kill -CONT "$device"
say "the board runs the model with $effects"
live after "$out/fitted.yaml"
"$beamfit" info "${port[@]}" --json > "$out/info.json"

python3 -B - "$out" $right_first "$offset" "${volts[@]}" <<'END'
import json
import sys

out, right_first, offset, levels = sys.argv[1], sys.argv[2] == "1", int(sys.argv[3]), sys.argv[4:]


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


def latched(name):
    info = answer(f"info_{name}")
    print(f"{'':<10} since power-on: {info['alarms']} alarms, latched: {', '.join(info['latched']) or 'nothing'}")
    return info


def right_model_first():
    """Neither a beam that swings at power-on nor an offset is taken for a wrong model; what is hung on is."""
    _, alarm_on = watched("on")
    on = latched("on")
    _, alarm_right = watched("right")
    right = latched("right")
    _, alarm_hung = watched("hung")
    hung = latched("hung")
    faults = {name for info in (on, right) for name in info["latched"]}
    return (not (alarm_on or alarm_right or on["alarms"] or right["alarms"]) and alarm_hung and hung["alarms"] == 1
            and on["counter"] == answer("download_right")["counter"] and faults == ({"sensor has an offset"} if offset else set())
            and hung["missed"] == 0)


with open(f"{out}/hides.txt") as file:
    hides = next(line.split()[1:] for line in file if line.startswith("effect "))
truth = dict(pair.split("=") for pair in hides[1:])
missing, info, fit, download = answer("diagnose"), answer("info"), answer("fit_live"), answer("download_after")
records = [answer(f"record_{name}_{level}") for name in ("before", "after") for level in levels]
replays = [answer(f"replay_{name}_{level}") for name in ("before", "after") for level in levels]
print(f"bench      model fitted to {answer('fit_bench')['noise_ratio']:.2f} x its noise")
first = right_model_first() if right_first else True
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
fine = (first and alarm_before and min(before) > 5 and not alarm_after and max(after) < 1.5 and missing["effects"] == hides[:1]
        and info["missed"] == 0 and equal and not any(r["gaps"] or r["crc_failures"] for r in records))
sys.exit(0 if fine else "live-demo: NOT as it should be")
END
