#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# firmware_size.sh BUILD BOARD... — what each firmware of BUILD takes of its controller: flash, RAM, worst stack. Fails above the bounds,
# and when nm finds what a controller must not need: an allocator, printing, double arithmetic.
set -eu
cd "$(dirname "$0")/.."
build=${1:?firmware_size.sh BUILD BOARD...}
shift
flash_bound=$((64 * 1024)) ram=$((16 * 1024))
ram_bound=$((ram * 95 / 100)) # a twentieth stays free
cross=${CROSS:-arm-none-eabi-}
# Exception frames that can lie on each other: background (with FPU), sample (with FPU), port. 8 bytes of alignment each.
declare -A frames=([default]=$((104 + 104 + 2 * 8)) [stm32f405]=$((104 + 104 + 32 + 3 * 8)) [mps2]=$((104 + 104 + 2 * 8)))
declare -A interrupts=([default]='board_tick_isr board_port_isr' [stm32f405]='board_sample_isr board_port_isr board_tick_isr' [mps2]='board_tick_isr board_port_isr')
must_not='malloc|free|calloc|realloc|_sbrk|v?f?s?n?i?printf|puts|putchar|strto[dlfu]+|__aeabi_(d[a-z0-9]+|[a-z0-9]+2d)|__(add|sub|mul|div)df3|_Unwind_.*|exit|abort'
bad=0
must() { echo "size: $*" >&2; bad=1; }

worst() { # DIR ROOT -> bytes
    local line
    line=$(python3 -B tools/stack.py "$1" "$2") || must "stack of $2 (above)"
    printf '  %s\n' "$line" >&2
    awk '{print $1}' <<<"$line"
}

for board in "$@"; do
    elf=$build/firmware_$board.elf
    read -r text data bss _ < <("${cross}size" "$elf" | tail -n 1)
    reserve=$((16#$("${cross}nm" "$elf" | awk '$3 == "board_stack_top" {print $1}') - 16#20000000))
    # only objects that this board links
    objects=$build/size/stack_$board
    rm -rf "$objects" && mkdir -p "$objects"
    for directory in lib firmware bearssl; do
        [ -d "$build/arm/$directory" ] && cp -r "$build/arm/$directory" "$objects/"
    done
    for other in "$objects"/firmware/board_*; do
        [ "$other" = "$objects/firmware/board_$board" ] || rm -rf "$other"
    done
    printf '\n%s: deepest calls, bytes of stack\n' "$elf"
    boot=$(worst "$objects" app_init)
    poll=$(worst "$objects" app_poll)
    stack=$((${frames[$board]:-${frames[default]}} + 8 + poll))
    for isr in ${interrupts[$board]:-${interrupts[default]}}; do
        # a tick that finds a sample under way only counts it
        [ "$board $isr" = 'stm32f405 board_tick_isr' ] && { stack=$((stack + 16)); continue; }
        stack=$((stack + $(worst "$objects" "$isr")))
    done
    ((boot + 8 + 120 > stack)) && stack=$((boot + 8 + 120))
    printf '%s: flash %d of %d bytes; RAM %d of %d, of which a twentieth stays free: data %d, stack %d, of which %d at worst (interrupts on each other)\n' \
        "$board" $((text + data)) "$flash_bound" $((data + bss)) "$ram" $((data + bss - reserve)) "$reserve" "$stack"
    ((text + data <= flash_bound)) || must "$board: flash above its bound"
    ((data + bss <= ram_bound)) || must "$board: RAM above its bound"
    ((stack <= reserve)) || must "$board: the stack needs $stack bytes and has $reserve: BOARD_STACK of firmware/board_$board/$board.ld"
    found=$("${cross}nm" "$elf" | awk '{print $NF}' | grep -Ex "$must_not" || true)
    [ -z "$found" ] || must "$board needs $(paste -sd' ' <<<"$found")"
done
[ "$bad" = 0 ] && printf '\nsize: every firmware within its bounds; no allocator, no printing, no double arithmetic\n'
exit "$bad"
