#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# docs_check.sh — every link of every page leads to a file and, behind a #, to a heading of it; every page that a source or tool names exists;
# the page of constants is what the sources say.
set -u
cd "$(dirname "$0")/.." || exit 1
broken=0 links=0
broke() { echo "docs: $*" >&2; broken=1; }

anchors() { # PAGE: its headings as GitHub names them
    sed -n 's/^#\{1,6\} \(.*\)/\1/p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^[:alnum:]_ -]//g; s/ /-/g'
}
pages=$(find README.md CHANGELOG.md docs data firmware -name '*.md' | sort)
for page in $pages; do
    while read -r link; do
        [[ $link == *://* ]] && continue
        links=$((links + 1))
        file=${link%%#*} anchor=${link#"${link%%#*}"}
        if [ -z "$file" ]; then file=$page; else file=$(dirname "$page")/$file; fi
        [ -e "$file" ] || { broke "$page: no such page: $link"; continue; }
        [ -z "$anchor" ] || anchors "$file" | grep -qxF -- "${anchor#\#}" || broke "$page: no such heading: $link"
    done < <(grep -o ']([^) ]*)' "$page" | sed 's/^](//; s/)$//')
done
while IFS=: read -r file name; do
    [ -e "$name" ] || broke "$file names $name, which does not exist"
done < <(grep -rIo --exclude-dir=build 'docs/[a-z_0-9/]*\.\(md\|csv\)' README.md CHANGELOG.md docs data firmware host lib tests tools Makefile .ci | sort -u)
while read -r page; do # the map has every page
    grep -qF "](${page#docs/})" docs/README.md || broke "docs/README.md does not name $page"
done < <(find docs -name '*.md' ! -name README.md)
tools/constants.py check || broken=1
[ "$broken" = 0 ] && echo "docs: $links links and every page named elsewhere are there"
exit "$broken"
