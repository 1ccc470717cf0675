#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bearssl.sh DIR — BearSSL's source, as Debian 12 has it, unpacked into DIR/bearssl-0.6. Nothing of it is kept in this tree.
# apt-get verifies Debian's signatures, this script the tarball's own sum. A tarball that lies in DIR already is used.
# An apt of its own is set up below DIR: the system's sources need no deb-src line, and root is not needed.
set -eu
out=${1:?bearssl.sh DIR}
version='0.6+dfsg.1-3'
tarball='bearssl_0.6+dfsg.1.orig.tar.xz'
sum=102a625bd8f6155260867a50c508df8d8c3f796985dd744df1a68e5cd1a79004
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
[ ! -e "$out/bearssl-0.6/inc/bearssl_hash.h" ] || exit 0

fetch() {
    (
        cd "$out"
        apt-get -qq -o Acquire::Retries=3 update && apt-get -qq -o Acquire::Retries=3 source --download-only "bearssl=$version"
    )
}

mkdir -p "$out/apt/lists/partial" "$out/apt/cache/archives/partial"
out=$(cd "$out" && pwd)
if [ ! -e "$out/$tarball" ]; then
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" >"$out/apt/sources.list"
    cat >"$out/apt/apt.conf" <<CONF
Dir::State::Lists "$out/apt/lists";
Dir::Cache "$out/apt/cache";
Dir::Etc::SourceList "$out/apt/sources.list";
Dir::Etc::SourceParts "/nonexistent";
APT::Sandbox::User "root";
CONF
    export APT_CONFIG="$out/apt/apt.conf"
    for pause in 5 15 45 0; do
        fetch && break
        if [ "$pause" = 0 ]; then
            echo "bearssl.sh: $mirror does not answer. Without a network: put Debian's $tarball into $out and run make again" >&2
            exit 1
        fi
        echo "bearssl.sh: no answer from $mirror; once more in $pause s" >&2
        sleep "$pause"
    done
fi
if ! echo "$sum  $out/$tarball" | sha256sum --check --status; then
    echo "bearssl.sh: $out/$tarball is not the file it should be (SHA-256 $sum): delete it and run make again" >&2
    exit 1
fi
tar -xJf "$out/$tarball" -C "$out"
