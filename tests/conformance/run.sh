#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# run.sh BUILD BOARD [LOAD]: pyxcp and pya2ldb against a board, host or stm32f405; pyuff on the file of `beamfit frf`. Skips, loudly, where PyPI cannot be reached.
set -eu
build=$1
here=$(dirname "$0")
status=0
sh "$here/python.sh" "$build/python" || status=$?
if [ $status -eq 75 ]; then
    echo "conformance: SKIPPED, NOTHING WAS TESTED: PyPI cannot be reached, so there is no pyxcp"
    exit 0
fi
[ $status -eq 0 ] || exit $status
"$build/python/bin/python" -B "$here/uff.py" --build "$build"
exec "$build/python/bin/python" -B "$here/run.py" --build "$build" --board "$2" --load "${3:-0}"
