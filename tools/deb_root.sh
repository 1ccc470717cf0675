#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# deb_root.sh BUILD WORK VERSION — the packages that `make deb` made, in a Debian that has nothing else: apt installs beamfit there,
# without and then with what it recommends; its program, doctor, manual pages and completion; a model made, fitted, reported; a program
# linked with libbeam-dev; both removed. Needs root, debootstrap and a Debian mirror. The system made once stays in WORK/base.
set -eu
build=$(realpath "${1:?deb_root.sh BUILD WORK VERSION}") work=${2:?deb_root.sh BUILD WORK VERSION} version=${3:?deb_root.sh BUILD WORK VERSION}
top=$(cd "$(dirname "$0")/.." && pwd)
mirror=${MIRROR:-http://deb.debian.org/debian}
[ "$(id -u)" = 0 ] || { echo "make deb-root: only root can enter another root; sudo make deb-root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "make deb-root: debootstrap is missing; apt-get install debootstrap" >&2; exit 1; }
mkdir -p "$work"
work=$(realpath "$work")
if ! [ -e "$work/base/made" ]; then
    rm -rf "$work/base"
    debootstrap --variant=minbase bookworm "$work/base" "$mirror" >"$work/debootstrap.log" || { tail -n 5 "$work/debootstrap.log" >&2; exit 1; }
    touch "$work/base/made"
fi
root=$work/root
rm -rf "$root"
cp -a "$work/base" "$root"
cp "$build"/{beamfit,libbeam-dev}_"$version"_*.deb "$root/tmp/"
mkdir "$root/tmp/desk"
cp "$top"/data/paper/b1tapih.{yaml,csv} "$root/tmp/desk/"
[ ! -e /etc/resolv.conf ] || cp /etc/resolv.conf "$root/etc/"

cat >"$root/tmp/inside.sh" <<'INSIDE'
set -eu
version=$1
cd /tmp/desk
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
ok() { printf '%-34s %s\n' "$1" "$2"; }
fail() { echo "FAILED: $*" >&2; exit 1; }
apt() { apt-get -qq -y "$@" >/tmp/apt.log 2>&1 || { tail -n 20 /tmp/apt.log >&2; fail "apt-get $*"; }; }
run() { # STATUS WORDS: output in said
    local want=$1 status=0
    shift
    said=$("$@" 2>&1) || status=$?
    [ "$status" = "$want" ] || { printf '%s\n' "$said" >&2; fail "$*: wanted status $want, got $status"; }
}
says() { case $said in *"$1"*) ;; *) printf '%s\n' "$said" >&2; fail "'$1' is not said" ;; esac }

apt update
before=$(dpkg-query -f '${db:Status-Abbrev}\n' -W | grep -c '^ii')
apt install --no-install-recommends /tmp/beamfit_*.deb
ok 'apt-get install beamfit' "$(($(dpkg-query -f '${db:Status-Abbrev}\n' -W | grep -c '^ii') - before)) packages without what is recommended"
run 0 beamfit --version
[ "$said" = "beamfit $version" ] || fail "beamfit --version: $said"
ok 'beamfit --version' "$said"

run 1 beamfit doctor
says 'apt-get install gnuplot-nox'
says 'apt-get install fonts-dejavu-core'
ok 'beamfit doctor' 'status 1, names gnuplot-nox and fonts-dejavu-core'
run 0 beamfit init --length 0.4573 --width 0.0203 --thickness 0.0016 --patch 0.02535 0.08905 --input hammer_N=point_force@0.0254 --output piezo_V=patch_strain -o ruler.yaml
run 0 beamfit modes ruler.yaml
ok 'beamfit init, modes' 'status 0'
run 0 beamfit fit b1tapih.yaml b1tapih.csv -o fitted.yaml
[ -s fitted.yaml ] || fail 'no fitted.yaml'
run 0 beamfit compare fitted.yaml b1tapih.csv --json
error=$(printf '%s\n' "$said" | sed -n 's/^ *"noise_ratio": \([0-9.]*\),*$/\1/p' | tail -n 1)
awk -v x="$error" 'BEGIN {exit !(x > 0.9 && x < 1.1)}' || fail "the fitted model is at '$error' times the noise"
ok 'beamfit fit, compare' "$(printf %.3g "$error") times the noise"
run 0 beamfit compare fitted.yaml b1tapih.csv --plot pictures
says 'gnuplot is not installed'
[ -s pictures/b1tapih-piezo_V.gp ] && [ ! -e pictures/b1tapih-piezo_V.png ] || fail 'scripts without pictures were promised'
ok 'compare --plot without gnuplot' 'says so before, keeps scripts and data'
run 0 beamfit report fitted.yaml b1tapih.csv -o page.html
grep -q '</html>' page.html || fail 'the page is not whole'
ok 'beamfit report' "$(stat -c %s page.html) bytes"
gzip -t /usr/share/man/man1/beamfit*.1.gz
for command in $(beamfit --help | sed -n 's/^  \([a-z]\{3,\}\)  .*/\1/p'); do
    [ -s /usr/share/man/man1/beamfit-$command.1.gz ] || fail "no manual page of $command"
    beamfit $command --help >/dev/null || fail "beamfit $command --help"
done
for page in $(gunzip -c /usr/share/man/man1/beamfit*.1.gz | grep -o 'docs/[a-z_]*\.md' | sort -u); do
    [ -s /usr/share/doc/beamfit/$page ] || fail "$page, which a manual page names, is not there"
done
bash -n /usr/share/bash-completion/completions/beamfit
[ -s /usr/share/zsh/vendor-completions/_beamfit ] || fail 'no completion of zsh'
ok 'manual pages, completion' "$(ls /usr/share/man/man1/beamfit*.1.gz | wc -l) pages"

apt install gnuplot-nox fonts-dejavu-core man-db
run 0 beamfit doctor
ok 'beamfit doctor, as it advised' 'status 0'
run 0 beamfit compare fitted.yaml b1tapih.csv --plot pictures
[ "$(head -c 4 pictures/b1tapih-piezo_V.png | tail -c 3)" = PNG ] && [ -s pictures/b1tapih-piezo_V.pdf ] || fail 'no picture'
ok 'compare --plot' 'PNG and PDF'
MANWIDTH=80 run 0 man --warnings beamfit-fit
says 'SYNOPSIS'
ok 'man beamfit-fit' 'no warning'

apt install --no-install-recommends /tmp/libbeam-dev_*.deb gcc g++ libc6-dev pkg-config
printf '%s\n' '#include <stdio.h>' '#include <beam_effect.h>' '#include <beam_image.h>' \
    'int main(void) { printf("%d %s\n", beam_effects_count, beam_effects[0]->id); return beam_effects_count > 30 ? 0 : 1; }' >try.c
cp try.c try.cc
for package in beamfit beamfit-float beamfit-target; do
    run 0 gcc -Wall -Wextra -Werror try.c $(pkg-config --cflags --libs $package) -o try
    run 0 ./try
    [ "$(pkg-config --modversion $package)" = "$version" ] || fail "pkg-config --modversion $package"
    run 0 g++ -Wall -Wextra -Werror try.cc $(pkg-config --cflags --libs $package) -o try
    run 0 ./try
    ok "a program of $package" "C and C++: $said"
done
apt remove --purge beamfit libbeam-dev
left=$(find / -xdev -path /proc -prune -o -path /tmp -prune -o -path /var/cache/man -prune -o -name '*beamfit*' -print -o -name 'libbeam*' -print)
[ -z "$left" ] || fail "left behind: $left"
ok 'apt-get remove' 'nothing is left'
INSIDE
# In namespaces of its own: /proc goes with them.
unshare --mount --pid --fork sh -c 'mount -t proc proc "$1/proc" 2>/dev/null; shift; exec "$@"' sh "$root" \
    chroot "$root" /bin/bash /tmp/inside.sh "$version" </dev/null
