#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# deb.sh BUILD VERSION — beamfit_VERSION_ARCH.deb and libbeam-dev_VERSION_ARCH.deb in BUILD, made of what `make install` puts in place.
# Needs dpkg-dev. What the program needs is found in it (dpkg-shlibdeps).
set -eu
build=$(realpath "${1:?deb.sh BUILD VERSION}") version=${2:?deb.sh BUILD VERSION}
top=$(cd "$(dirname "$0")/.." && pwd)
arch=$(dpkg --print-architecture)
stage=$build/deb
for tool in dpkg-deb dpkg-shlibdeps; do
    command -v "$tool" >/dev/null || { echo "make deb: $tool is missing; apt-get install dpkg-dev" >&2; exit 1; }
done
rm -rf "$stage"
mkdir -p "$stage"
umask 022
# without beamfit-fleet: the package would need MPI
make -s --no-print-directory -C "$top" B="$build" MPI= DESTDIR="$stage/beamfit" PREFIX=/usr install >/dev/null

# What a program of one's own needs is a package of its own.
mkdir -p "$stage/libbeam-dev/usr/share"
mv "$stage/beamfit/usr/lib" "$stage/beamfit/usr/include" "$stage/libbeam-dev/usr/"
mv "$stage/beamfit/usr/share/beamfit" "$stage/libbeam-dev/usr/share/"
strip --strip-unneeded "$stage/beamfit/usr/bin/beamfit"
strip --strip-debug "$stage"/libbeam-dev/usr/lib/*.a
gzip -9n "$stage"/beamfit/usr/share/man/man1/*.1
for package in beamfit libbeam-dev; do
    mkdir -p "$stage/$package/DEBIAN" "$stage/$package/usr/share/doc/$package"
    case $package in beamfit) licence=host/LICENSE ;; *) licence=lib/LICENSE ;; esac
    cat "$top/LICENSE" "$top/$licence" >"$stage/$package/usr/share/doc/$package/copyright"
    [ "$package" = libbeam-dev ] || cat /usr/share/doc/libjs-dygraphs/copyright >>"$stage/$package/usr/share/doc/$package/copyright" # it is in the program
    gzip -9nc "$top/CHANGELOG.md" >"$stage/$package/usr/share/doc/$package/changelog.gz"
done
# The pages that help texts name, with what they lead to.
cp "$top/README.md" "$stage/beamfit/usr/share/doc/beamfit/"
cp -r "$top/docs" "$stage/beamfit/usr/share/doc/beamfit/"

mkdir -p "$stage/debian"
printf 'Source: beamfit\n\nPackage: beamfit\nArchitecture: %s\n' "$arch" >"$stage/debian/control" # what dpkg-shlibdeps asks for
depends=$(cd "$stage" && dpkg-shlibdeps -O beamfit/usr/bin/beamfit | sed -n 's/^shlibs:Depends=//p')
[ -n "$depends" ] || { echo "make deb: dpkg-shlibdeps found nothing that the program needs" >&2; exit 1; }

control() { # PACKAGE SECTION FIELDS... and the description on standard input
    local package=$1 section=$2
    shift 2
    {
        printf '%s\n' "Package: $package" "Version: $version" "Architecture: $arch" "Section: $section" "Priority: optional" \
            "Maintainer: beamfit <beamfit@localhost>" "Installed-Size: $(du -sk --exclude=DEBIAN "$stage/$package" | cut -f1)" "$@"
        cat
    } >"$stage/$package/DEBIAN/control"
    (cd "$stage/$package" && find usr -type f -print0 | sort -z | xargs -0 md5sum) >"$stage/$package/DEBIAN/md5sums"
    dpkg-deb --root-owner-group --build "$stage/$package" "$build/${package}_${version}_$arch.deb" >/dev/null
    echo "$build/${package}_${version}_$arch.deb"
}
control beamfit science "Depends: $depends" "Recommends: gnuplot-nox, fonts-dejavu-core" <<'END'
Description: model of a vibrating beam, fitted to recordings
 Fits Euler-Bernoulli beams with piezo patches to measured responses, says how
 well each number is known, and which physical effect a model lacks.
END
control libbeam-dev libdevel "Recommends: pkg-config" <<'END'
Description: step of a beam model for programs and microcontrollers
 Static libraries (double, float, a controller's sizes) and headers of the
 ten-dimensional model that beamfit fits: no allocation, bounded time. Its
 sources with a makefile, CMake and an example, to compile for a controller.
END
