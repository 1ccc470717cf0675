#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# fuzz.sh DIR — build every tests/fuzz/fuzz_NAME.c with clang's libFuzzer and both sanitizers into DIR, and feed each
# FUZZ_SECONDS of bytes grown from tests/fuzz/corpus/NAME. What breaks a reader is left in DIR/found/.
set -eu
cd "$(dirname "$0")/.."
out=${1:?fuzz.sh DIR}
: "${FUZZ_SECONDS:=20}" "${JOBS:=2}"
sanitize='-fsanitize=address,undefined -fno-sanitize-recover=undefined -fgnuc-version=4.8'
sanitize="$sanitize -fsanitize-coverage-ignorelist=$PWD/tools/fuzz_uncounted.txt -fsanitize-ignorelist=$PWD/tools/fuzz_uncounted.txt"
tools/first_error.sh "$out/make.log" make --no-print-directory -j"$JOBS" B="$out" CC=clang OPT='-O2 -g1' CFLAGS="$sanitize -fsanitize=fuzzer-no-link" \
    "$out/libhost.a" "$out/libbeam.a" "$out/libbeamt.a" "$out/libfirmware.a" WARN=-Wall
mkdir -p "$out/found"

packages='libmicrohttpd nlopt libserialport libfyaml jansson matio fftw3 lapacke openblas sndfile sqlite3'
fuzz_one=$(cat <<'SH'
set -eu
source=$1 out=$2 sanitize=$3 packages=$4
name=$(basename "$source" .c); name=${name#fuzz_}
flags=; [ "$name" != slave ] || flags='-DBEAM_FLOAT -DBEAM_TARGET -ffp-contract=off -Ifirmware' # as the firmware is built
clang -std=c11 -D_GNU_SOURCE -g1 -O2 $sanitize -fsanitize=fuzzer $flags -Ilib -Ihost -Itests -Itests/fuzz "$source" \
    "$out/libfirmware.a" "$out/libhost.a" "$out/libbeam.a" "$out/libbeamt.a" $(pkg-config --cflags --libs $packages) -lcholmod -larpack -lbearssl -lpthread -lm \
    -o "$out/fuzz_$name"
mkdir -p "$out/corpus/$name"
# A damaged MATLAB file may claim a million empty cells, each of which matio allocates: 1 s, under the sanitizers on a busy machine 15.
seeds=; [ ! -d "tests/fuzz/corpus/$name" ] || seeds=tests/fuzz/corpus/$name
if "$out/fuzz_$name" -max_total_time="$FUZZ_SECONDS" -timeout=120 -rss_limit_mb=3000 -close_fd_mask=3 \
    -print_final_stats=1 -artifact_prefix="$out/found/$name-" "$out/corpus/$name" $seeds >"$out/$name.log" 2>&1
then echo "fuzz: $name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$out/$name.log") inputs, nothing found"
else tail -n 40 "$out/$name.log"; echo "fuzz: $name: FAILED, the input is in $out/found/"; exit 1
fi
SH
)
export FUZZ_SECONDS
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
printf '%s\0' tests/fuzz/fuzz_*.c | xargs -0 -P "$JOBS" -I{} bash -c "$fuzz_one" fuzz {} "$out" "$sanitize" "$packages"
