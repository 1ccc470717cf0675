#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# size.sh DIR — compile lib/ as the target does (float) into DIR, for this machine and, where arm-none-eabi-gcc is
# installed, for a Cortex-M4F; print size and stack of every function; fail when an object needs something that the
# target must not need: an allocator, printed text, double-precision arithmetic, writable data, unbounded stack, recursion.
set -eu
cd "$(dirname "$0")/.."
out=${1:?size.sh DIR}
flags=(-std=c11 -O2 -ffp-contract=off -DBEAM_FLOAT -Ilib -fstack-usage -fcallgraph-info -ffunction-sections -Wall -Wextra
    -Wdouble-promotion -fno-pie)
# All that the library may ask of others: the C library's float mathematics, block moves, lengths of texts.
# Assembly reads the catalogue's ranges, which are double for the host's sake: one conversion, before the first step.
may_need='^(__aeabi_d2f|sqrtf|fabsf|memcpy|memmove|memset|memcmp|strcmp|strlen|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_|beamf_.*)$'
mkdir -p "$out/gen"
sh tools/effects_table.sh lib/effects >"$out/gen/effects_table.c"
gcc -std=c11 -O2 tools/galerkin_tables.c -lm -o "$out/galerkin_tables"
"$out/galerkin_tables" >"$out/gen/galerkin_tables.c"
bad=0
must() { echo "size: $*" >&2; bad=1; }

survey() { # PREFIX of the tools, directory, extra flags...
    local prefix=$1 dir=$out/$2 source object
    shift 2
    rm -rf "$dir" && mkdir -p "$dir"
    local objects=()
    for source in lib/*.c lib/effects/*.c "$out"/gen/*.c; do
        [ -e "$source" ] || continue
        object=$dir/$(echo "${source%.c}" | tr / _).o
        "${prefix}gcc" "${flags[@]}" "$@" -c "$source" -o "$object"
        objects+=("$object")
    done
    [ ${#objects[@]} -gt 0 ] || { echo 'size: lib/ has no sources' >&2; exit 1; }

    printf '\n%s (%s)\n' "$("${prefix}gcc" -dumpmachine)" "${flags[*]:0:3} $*"
    echo '   text    data     bss  file'
    "${prefix}size" "${objects[@]}" | awk 'NR > 1 {sub(/.*\//, "", $6); sub(/\.o$/, "", $6)
        printf "%7d %7d %7d  %s\n", $1, $2, $3, $6; t += $1; d += $2; b += $3}
        END {printf "%7d %7d %7d  total\n", t, d, b}'
    echo '  bytes   stack  function'
    for object in "${objects[@]}"; do # static functions of different files share names
        join <("${prefix}nm" -S "$object" | awk 'NF == 4 && tolower($3) == "t" {print $4, $2}' |
                while read -r name hex; do echo "$name $((16#$hex))"; done | sort -k1,1) \
            <(awk -F'\t' '{n = split($1, place, ":"); print place[n], $2}' "${object%.o}.su" | sort -k1,1) |
            sed "s|^\([^ ]*\)|\1 $(basename "$object" .o)|"
    done | sort -k3,3nr | awk '{printf "%7d %7d  %s (%s)\n", $3, $4, $1, $2}'

    grep -h 'dynamic$' "$dir"/*.su && must 'a function takes stack of unknown size (above)'
    "${prefix}nm" -u "${objects[@]}" | awk 'NF == 2 {print $2}' | sort -u >"$dir/undefined"
    "${prefix}nm" "${objects[@]}" | awk 'NF == 3 && $2 ~ /[TRDV]/ {print $3}' | sort -u >"$dir/defined"
    while read -r name; do must "needs $name, which a target may not have"; done < <(
        comm -23 "$dir/undefined" "$dir/defined" | grep -Ev "$may_need")
    while read -r name; do must "writable data: $name (no globals)"; done < <(
        "${prefix}nm" "${objects[@]}" | awk 'NF == 3 && $2 ~ /^[bBCsS]$/ {print $3} NF == 3 && $2 == "D" {print $3}')
    # a cycle in the call graph is a recursion
    sed -n 's/^edge: { sourcename: "\([^"]*\)" targetname: "\([^"]*\)".*/\1 \2/p' "$dir"/*.ci | grep -v __indirect_call |
        tsort >/dev/null 2>"$dir/cycles" || must "recursion: $(paste -sd' ' "$dir/cycles")"
    local running=("${objects[@]/*beam_assemble.o/}")
    mapfile -t running < <(printf '%s\n' "${running[@]}" | grep .)
    case $prefix in
    '') if objdump -d --no-show-raw-insn "${running[@]}" | grep -E '\b(cvtss2sd|cvtsd2ss|(add|sub|mul|div|sqrt|ucomi|comi|max|min)sd)\b' >"$dir/double"; then
            must "double-precision instructions: $(sort -u "$dir/double" | wc -l), first $(head -n 1 "$dir/double")"
        fi ;;
    *) "${prefix}nm" -u "${running[@]}" | grep -E '__aeabi_[df]' && must 'software floating point (above)' ;;
    esac
    return 0
}

survey '' host
if command -v arm-none-eabi-gcc >/dev/null; then
    survey arm-none-eabi- cortex-m4f -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard
else
    printf '\narm-none-eabi-gcc is not installed: sizes of this machine only\n'
fi
[ "$bad" = 0 ] && printf '\nsize: no allocator, no printing, no double arithmetic, no writable data, no recursion, bounded stack\n'
exit "$bad"
