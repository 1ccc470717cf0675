#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# table.sh TYPE HEADER FILE... — print the C table TYPEs[] of every `const struct TYPE TYPE_NAME` that the files define at the start of
# a line, in order of the names, and TYPEs_count. HEADER declares struct TYPE and the table.
set -eu
LC_ALL=C
type=$1 header=$2
shift 2
names=$(sed -n "s/^const struct $type \\(${type}_[A-Za-z0-9_]*\\) =.*/\\1/p" "$@" | sort)
[ -n "$names" ] || { echo "table.sh: no 'const struct $type ${type}_NAME = ...' in $*" >&2; exit 1; }
echo '/* Made by tools/table.sh; do not edit. */'
echo "#include \"$header\""
for name in $names; do echo "extern const struct $type $name;"; done
echo "const struct $type *const ${type}s[] = {"
for name in $names; do echo "    &$name,"; done
echo '    0};'
echo "const int ${type}s_count = $(echo "$names" | wc -l);"
