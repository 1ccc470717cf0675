#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# lint.sh [FILE...] — clang-format, cppcheck, clang-tidy and shell syntax over the given or all sources of the tree.
# LINT_FLAGS: the compiler's flags (the Makefile gives them). JOBS: how many programs at once.
# LINT_NODES: states of a program's paths that clang-analyzer looks at in one function (clang's own 225000: four times as long).
set -u
cd "$(dirname "$0")/.." || exit 1
: "${LINT_FLAGS:?run make lint, which knows the compiler flags}" "${JOBS:=2}" "${LINT_NODES:=50000}"
failed=''

if [ $# -gt 0 ]; then sources=("$@"); else mapfile -t sources < <(find lib host firmware tests tools -name '*.[ch]' | sort); fi
mapfile -t units < <(printf '%s\n' "${sources[@]}" | grep '\.c$')

echo "clang-format: ${#sources[@]} files"
printf '%s\0' "${sources[@]}" | xargs -0 -r clang-format --dry-run -Werror || failed+=' clang-format'

# A controller's sizes where a controller's code is; elsewhere cppcheck must not suppose them, nor lib/'s other numbers outside lib/
# (each is one more pass over every file), nor another compiler.
controller='^(firmware/|tests/target/|tests/driver/|tests/unit/test_firmware|tests/fuzz/fuzz_slave)'
cppcheck_all() {
    xargs -0 -r cppcheck -q -j "$JOBS" --std=c11 --language=c --platform=unix64 --error-exitcode=1 --inline-suppr \
        --enable=warning,performance,portability --library=posix --suppressions-list=tools/cppcheck.suppressions \
        -Ilib -Ihost -Ifirmware -Itests -Itests/truth "$@"
}
echo "cppcheck: ${#units[@]} files"
one_pass=(-UBEAM_TARGET -UBEAM_FLOAT -UBEAM_COMPLEX -U__clang_analyzer__ -U__clang__ -U__SANITIZE_ADDRESS__ -U__cplusplus)
printf '%s\n' "${units[@]}" | grep -Ev "$controller|^lib/" | tr '\n' '\0' | cppcheck_all "${one_pass[@]}" || failed+=' cppcheck'
printf '%s\n' "${units[@]}" | grep '^lib/' | tr '\n' '\0' | cppcheck_all -UBEAM_TARGET || failed+=' cppcheck-of-lib'
printf '%s\n' "${units[@]}" | grep -E "$controller" | tr '\n' '\0' | cppcheck_all -DBEAM_FLOAT -DBEAM_TARGET || failed+=' cppcheck-of-firmware'

echo "clang-tidy: ${#units[@]} files"
# glibc gives CMPLX to a compiler that says it is gcc >= 4.7; clang says 4.2 unless told
eval "flags=(-fgnuc-version=4.8 $LINT_FLAGS -Itests -Itests/truth -Itests/fuzz -Xclang -analyzer-config -Xclang max-nodes=$LINT_NODES)"
tidy_one=$(cat <<'SH'
file=$1; shift
case $file in # float and a controller's sizes only
tests/beam_shadow.c) set -- "$@" -DBEAM_FLOAT ;;
firmware/* | tests/unit/test_firmware* | tests/fuzz/fuzz_slave.c) set -- "$@" -DBEAM_FLOAT -DBEAM_TARGET -Ifirmware ;;
esac
case $file in # what only a controller runs: its registers and instructions
firmware/board_stm32f405/* | firmware/board_mps2/* | firmware/examples/* | tests/target/start.c | tests/target/store_run.c)
    for flag; do # without the directories of this machine's C library
        shift
        case $flag in -I/usr/*) ;; *) set -- "$@" "$flag" ;; esac
    done
    set -- "$@" --target=arm-none-eabi -mcpu=cortex-m4 -mfloat-abi=hard -isystem /usr/lib/arm-none-eabi/include ;;
esac
case $file in
tests/target/shim/* | tests/target/plugin/*) ;;
tests/driver/*) set -- "$@" -DBEAM_FLOAT -DBEAM_TARGET -DDRIVER_ON_PC -Ifirmware ;;
tests/target/*) set -- "$@" -DBEAM_FLOAT -DBEAM_TARGET -Ifirmware ;;
esac
answer=$(clang-tidy --quiet "$file" -- "$@" 2>/dev/null) || { printf '%s\n' "$answer"; exit 1; }
SH
)
for unit in "${units[@]}"; do printf '%s\0' "$unit"; done |
    xargs -0 -r -P "$JOBS" -I{} sh -c "$tidy_one" tidy {} "${flags[@]}" || failed+=' clang-tidy'

for script in tools/*.sh tests/*/*.sh tests/run .ci/run; do bash -n "$script" || failed+=" $script"; done

[ -z "$failed" ] && echo 'lint: clean' && exit
echo "lint: found something (above):$failed" >&2
exit 1
