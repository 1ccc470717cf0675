#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# layers.sh — reads every #include and SPDX line, and docs/architecture.md, and says who breaks the layering:
#   lib -> C standard headers that a microcontroller has, and lib
#   firmware -> lib, itself, standard headers that a microcontroller has; a board's files only for that board;
#   board_host also POSIX, authentic.c also BearSSL
#   host -> lib, and files of its own or an earlier stage (rows of the stage table of docs/architecture.md)
#   an outside library -> only the file that the table of docs/architecture.md names (tests are free)
#   tests/truth -> itself and outside libraries only;   nobody -> tests
set -u
cd "$(dirname "$0")/.." || exit 1
page=docs/architecture.md
areas='lib host firmware tests tools'
broken=0
broke() { echo "layers: $*" >&2; broken=1; }

# library -> pattern of its headers (names as in the page's table)
declare -A headers=(
    [libfyaml]='libfyaml\.h' [jansson]='jansson\.h' [matio]='matio(_pubconf)?\.h' [libsndfile]='sndfile\.h'
    [BearSSL]='bearssl.*\.h' [FFTW]='fftw3?\.h' [CHOLMOD]='(suitesparse/)?(cholmod|SuiteSparse).*\.h'
    [ARPACK]='(arpack/)?arpack.*\.h' [LAPACKE]='(openblas/)?lapacke?.*\.h' [CBLAS]='(openblas/)?cblas.*\.h'
    [NLopt]='nlopt\.h' [libserialport]='libserialport\.h' [SUNDIALS]='(sundials|cvode|cvodes|arkode|nvector|sunmatrix|sunlinsol)/.*\.h')
# library -> the one file of host/ that may see it; a cell may say "`a.c` (LIB), `b.c` (LIB)"
allowed_file() {
    awk -F'|' -v lib="$1" '
        index($2, lib) && $3 ~ /`.*\.c`/ {
            n = split($3, cell, ",")
            for (i = 1; i <= n; i++)
                if (n == 1 || index(cell[i], lib) || cell[i] !~ /\(/) {
                    file = cell[i]; sub(/^[^`]*`/, "", file); sub(/`.*/, "", file); print file
                }
        }' "$page"
}
# stage of a host file: the first row of the stage table that names it (x.[ch], x.c, x_*.c, cmd/*.c)
stages=$(awk -F'|' '/^\| *stage *\|/ {on = 1; next} on && /^\|[- |]*$/ {next} on && !/^\|/ {exit}
    on {row++; cell = $3; while (match(cell, /`[^`]*`/)) {
        print row, substr(cell, RSTART + 1, RLENGTH - 2); cell = substr(cell, RSTART + RLENGTH)}}' "$page")
stage_of() { # FILE (below host/) -> row, or nothing
    local row pattern
    while read -r row pattern; do
        # shellcheck disable=SC2053 # the page's names are patterns
        [[ $1 == $pattern ]] && { echo "$row"; return; }
    done <<<"$stages"
}
declare -A stage_cache
stage() {
    [ -n "${stage_cache[$1]+known}" ] || stage_cache[$1]=$(stage_of "$1")
    echo "${stage_cache[$1]}"
}

includes() { sed -n 's/^[ \t]*#[ \t]*include[ \t]*\([<"][^>"]*[>"]\).*/\1/p' "$1"; }
in_tree() { # header -> path in this tree, or nothing
    local dir
    for dir in "$(dirname "$2")" lib host tests tests/truth tools firmware; do
        [ -e "$dir/$1" ] && { realpath --relative-to=. "$dir/$1"; return; }
    done
}
freestanding='^(float|iso646|limits|stdalign|stdarg|stdbool|stddef|stdint|stdnoreturn|math|complex|string)\.h$'

check() { # FILE
    local file=$1 area=${1%%/*} include name target mine theirs
    while read -r include; do
        name=${include:1:-1}
        target=
        [[ $include == \"* ]] && target=$(in_tree "$name" "$file")
        [[ $include == \"* && -z $target && $file != *bench* ]] && broke "$file includes $include, which is not in the tree"
        case $target in
        tests/*) [ "$area" = tests ] || broke "$file includes $target: nobody includes tests" ;;
        esac
        case $file in
        lib/*)
            if [ -n "$target" ]; then
                [[ $target == lib/* ]] || broke "$file includes $target: lib knows only lib"
            else
                [[ $name =~ $freestanding ]] || broke "$file includes <$name>: a microcontroller may not have it"
                [[ $name =~ ^(math|complex)\.h$ && $file != lib/beam_real.h ]] &&
                    broke "$file includes <$name>: only lib/beam_real.h does"
            fi ;;
        firmware/*)
            [[ -z $target || $target == lib/* || $target == firmware/* ]] ||
                broke "$file includes $target: firmware knows lib and itself"
            [[ $target == firmware/board_*/* && $file != "${target%/*}"/* ]] &&
                broke "$file includes $target: a board's own files are its own"
            [[ -n $target || $file == firmware/board_host/* || $name =~ $freestanding || $name == stdatomic.h ||
                $file:$name == firmware/authentic.c:bearssl.h ]] ||
                broke "$file includes <$name>: a microcontroller may not have it" ;;
        tests/truth/*)
            [[ -z $target || $target == tests/truth/* ]] ||
                broke "$file includes $target: the truth shares nothing with what it judges" ;;
        host/*)
            if [ -n "$target" ]; then
                [[ $target == lib/* || $target == host/* ]] || broke "$file includes $target: host knows lib and host"
                if [[ $target == host/* ]]; then
                    mine=$(stage "${file#host/}") theirs=$(stage "${target#host/}")
                    [ -n "$mine" ] || broke "$file stands in no stage of $page"
                    [ -n "$mine" ] && [ -n "$theirs" ] && [ "$theirs" -gt "$mine" ] &&
                        broke "$file (stage row $mine) includes $target (row $theirs): data flows one way"
                fi
            fi ;;
        esac
        [[ $area == tests || -n $target ]] && continue
        for library in "${!headers[@]}"; do
            [[ $name =~ ^${headers[$library]}$ ]] || continue
            [[ $file == firmware/authentic.c && $library == BearSSL ]] && continue
            [[ $area == host ]] && allowed_file "$library" | grep -qx "${file#host/}" ||
                broke "$file includes <$name>: $page gives $library to: $(allowed_file "$library" | paste -sd' ')"
        done
    done < <(includes "$file")
}

licence() { # FILE
    local wanted=GPL-3.0-or-later
    [[ $1 == lib/* || $1 == firmware/* ]] && wanted=MIT
    [[ $1 == tools/* ]] && wanted='(GPL-3.0-or-later|MIT)'
    [[ $1 == tests/target/plugin/* ]] && wanted=GPL-2.0-or-later # it runs inside QEMU, which is GPL version 2
    head -n 3 "$1" | grep -Eq "SPDX-License-Identifier: $wanted\\b" || broke "$1: no 'SPDX-License-Identifier: $wanted' at its top"
}

files=0
while read -r file; do
    check "$file"
    files=$((files + 1))
done < <(find $areas -name '*.[ch]' | sort)
while read -r file; do licence "$file"; done < <(
    find $areas -name '*.[ch]' -o -name '*.sh' -o -name '*.mk'
    printf '%s\n' Makefile tests/run .ci/run)
while read -r file; do
    [[ $file == host/plot.c || $file == host/plot_*.c ]] || broke "$file names gnuplot: only host/plot.c runs it"
done < <(grep -l -E '"[^"]*gnuplot[ "]' host/*.c)
[ "$files" -gt 0 ] || broke 'no sources found'

[ "$broken" = 0 ] && echo "layers: clean ($files files)"
exit "$broken"
