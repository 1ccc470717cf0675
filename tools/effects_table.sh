#!/bin/sh
# SPDX-License-Identifier: MIT
# Print the C table of all effects: one file lib/effects/ID.c defines BEAM_NAME(effect_ID).
set -eu
LC_ALL=C
dir=$1
echo '/* Made by tools/effects_table.sh; do not edit. */'
echo '#include "beam_effect.h"'
for f in "$dir"/*.c; do
    [ -e "$f" ] || continue
    id=$(basename "$f" .c)
    echo "extern const struct beam_effect BEAM_NAME(effect_$id);"
done
echo 'const struct beam_effect *const beam_effects[] = {'
count=0
for f in "$dir"/*.c; do
    [ -e "$f" ] || continue
    echo "    &BEAM_NAME(effect_$(basename "$f" .c)),"
    count=$((count + 1))
done
echo '    0};'
echo "const int beam_effects_count = $count;"
