#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# deps.sh GROUP... — install the packages of these groups (tools/packages) that are missing.
# apt-get as root, else through sudo; the network is asked only when something is missing.
set -eu
here=$(dirname "$0")

missing=
for group in "$@"; do
    for package in $(sed -n "s/^$group //p" "$here/packages"); do
        status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
        [ "$status" = installed ] || missing="$missing $package"
    done
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null; then
    echo "make deps: these Debian packages are missing, and there is no apt-get to install them:$missing" >&2
    exit 1
fi
if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo >/dev/null; then
    as_root=sudo
else
    echo "make deps: neither root nor sudo; ask an administrator to run: apt-get install$missing" >&2
    exit 1
fi

apt() {
    # shellcheck disable=SC2086 # $as_root is empty or one word
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o Acquire::Retries=3 "$@"
}
retry() { # networks hiccup
    for pause in 5 15 45; do
        "$@" && return
        echo "make deps: apt-get failed; once more in $pause s" >&2
        sleep "$pause"
    done
    "$@"
}

echo "make deps: installing$missing"
retry apt update
# shellcheck disable=SC2086 # a list of words
retry apt install -y --no-install-recommends $missing >/dev/null
