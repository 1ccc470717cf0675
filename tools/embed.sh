#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# embed.sh HEADER FILE... — print a C table page_assets[] of the files' names and bytes, each with a closing NUL, in the order given.
# HEADER declares struct page_asset and the table. Lines that name a source map, which only a debugger would load, are left out.
set -eu
LC_ALL=C
header=$1
shift
echo '/* Made by tools/embed.sh; do not edit. */'
echo "#include \"$header\""
i=0
for file in "$@"; do
    echo "static const char asset_$i[] = {"
    sed '/^\/[/*][#] sourceMappingURL=/d; s/\/[/*]# sourceMappingURL=[^ ]*\( \*\/\)\{0,1\}//' "$file" | od -An -v -td1 | sed 's/  */ /g; s/ \(-\{0,1\}[0-9][0-9]*\)/\1,/g'
    echo '0};'
    i=$((i + 1))
done
echo 'const struct page_asset page_assets[] = {'
i=0
for file in "$@"; do
    echo "    {\"$(basename "$file")\", asset_$i, sizeof asset_$i - 1},"
    i=$((i + 1))
done
echo '};'
echo "const int page_assets_count = $i;"
