#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# live_demo.sh BUILD OUT BOARD: docs/live_demo.md. A beam with 0.4 g at its tip under a board whose model does not know.
set -eu
build=$1
out=$2
board=$3
data=$(dirname "$0")/../data/live
beamfit=$build/beamfit
export OPENBLAS_NUM_THREADS=1

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
"$build/beam_truth" --live "$data/beam.txt" --socket "$work/plant" &
plant=$!
disown $plant
wait_for "$work/plant" $plant
case $board in
host)
    "$build/board_host" --plant "$work/plant" --key "$work/key" --nvm "$out/flash" --pty-link "$work/port" \
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
chirp=(--chirp 4:200:4:10)


live() { # NAME MODEL: give the board this model, record, watch
    "$beamfit" export "$2" -o "$out/$1.image" --json > "$out/export_$1.json"
    "$beamfit" download "$out/$1.image" "${port[@]}" "${key[@]}" --json > "$out/download_$1.json"
    "$beamfit" record "${port[@]}" --model "$2" "${chirp[@]}" --settle 5 --seconds 8 -o "$out/$1.csv" --json \
        > "$out/record_$1.json"
    "$beamfit" monitor "${port[@]}" --model "$2" --seconds 4 --plot "$out/$1" --json > "$out/monitor_$1.json"
    "$beamfit" upload "${port[@]}" -o "$out/$1.running" > /dev/null
    "$beamfit" replay "$out/$1.csv" --image "$out/$1.running" --json > "$out/replay_$1.json"
}
say() {
    echo "live-demo: $*"
}

say "the board runs the model of the bench"
live before "$out/baseline.yaml"
say "diagnosis of what the board recorded"
"$beamfit" diagnose "$out/baseline.yaml" "$out/before.csv" --intersample zoh --json > "$out/diagnose.json"
effects=$(python3 -c 'import json, sys; print(*json.load(open(sys.argv[1]))["effects"])' "$out/diagnose.json")
[ -n "$effects" ] || fail "the diagnosis names no effect; see $out/diagnose.json"
model=$out/baseline.yaml
for effect in $effects; do
    "$beamfit" add "$model" "$effect" -o "$out/with_$effect.yaml" > /dev/null
    model=$out/with_$effect.yaml
done
"$beamfit" fit "$model" "$out/before.csv" --intersample zoh -o "$out/fitted.yaml" --json > "$out/fit_live.json"
say "the board runs the model with $effects"
live after "$out/fitted.yaml"
"$beamfit" info "${port[@]}" --json > "$out/info.json"

python3 -B - "$out" <<'END'
import json
import sys

def answer(name):
    with open(f"{out}/{name}.json") as file:
        return json.loads(file.read().splitlines()[-1] if name.startswith("monitor") else file.read())

def ratios(name):
    with open(f"{out}/monitor_{name}.json") as file:
        lines = [json.loads(line) for line in file]
    return min(x["ratio"] for x in lines), max(x["ratio"] for x in lines), any(x["alarm"] for x in lines)

out = sys.argv[1]
before, after, missing, info = answer("record_before"), answer("record_after"), answer("diagnose"), answer("info")
replays = [answer("replay_before"), answer("replay_after")]
low, high, alarm = ratios("before")
low_after, high_after, alarm_after = ratios("after")
bench, live = answer("fit_bench"), answer("fit_live")
print(f"bench      model fitted to {bench['noise_ratio']:.2f} x its noise")
print(f"before     live residual {low:.3g} to {high:.3g} x the noise, alarm {'on' if alarm else 'off'}")
print(f"recording  {before['samples']} samples at {before['sample_Hz']:g} Hz, {before['gaps']} gaps, "
      f"{before['crc_failures']} CRC failures")
print(f"diagnosis  {missing['verdict']}: {' + '.join(missing['effects'])}; "
      f"{missing['noise_ratio_before']:.2f} -> {missing['noise_ratio_after']:.2f} x the noise when refitted")
values = {k: v for k, v in live["parameters"].items() if k.startswith("mass_kg")}
print("fit        " + "; ".join(f"{k} = {v['value']:.4g} +- {v['sd']:.1g} (true 0.0004)" for k, v in values.items()))
print(f"download   {answer('download_after')['bytes']} bytes while running, {answer('download_after')['seconds']:.2f} s; "
      f"{info['missed']} samples missed since power-on")
print(f"after      live residual {low_after:.3g} to {high_after:.3g} x the noise, alarm {'on' if alarm_after else 'off'}")
print("replay     " + ", ".join(f"{r['compared']} of {r['rows']} predictions {'equal' if r['equal'] else 'NOT EQUAL'}"
                               for r in replays) + ", bit for bit")
print(f"pictures   {out}/before, {out}/after")
fine = (alarm and low > 5 and not alarm_after and high_after < 1.5 and missing["effects"] == ["tip_mass"]
        and info["missed"] == 0 and all(r["equal"] and r["compared"] == r["rows"] for r in replays)
        and before["gaps"] == after["gaps"] == 0)
sys.exit(0 if fine else "live-demo: NOT as it should be")
END
