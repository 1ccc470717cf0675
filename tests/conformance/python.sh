#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# python.sh DIR: a Python of its own in DIR with the pinned packages. Status 0: it is there; 75: PyPI cannot be reached.
set -eu
directory=$1
list=$(dirname "$0")/requirements.txt
cmp -s "$list" "$directory/installed.txt" && exit 0
rm -rf "$directory"
python3 -m venv "$directory"
if ! "$directory/bin/pip" install --quiet --disable-pip-version-check --retries 1 --timeout 20 -r "$list" >&2; then
    if "$directory/bin/pip" download --quiet --disable-pip-version-check --retries 1 --timeout 20 --no-deps \
        -d "$directory/reach" pyserial==3.5 >/dev/null 2>&1; then
        echo "python.sh: PyPI answers, and the pinned packages cannot be installed" >&2
        exit 1
    fi
    rm -rf "$directory"
    exit 75
fi
cp "$list" "$directory/installed.txt"
