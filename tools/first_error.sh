#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# first_error.sh LOG COMMAND... — run a build with its output in LOG as well. When it fails, print last, after what the other jobs
# still had to say, the first error: the message, and the line by which make names the step.
set -u
log=${1:?first_error.sh LOG COMMAND...}
shift
mkdir -p "$(dirname "$log")"
"$@" 2>&1 | tee "$log"
status=${PIPESTATUS[0]}
if [ "$status" != 0 ]; then
    echo "---- failed; the first error (all of it: $log)"
    grep -Em 1 -A 4 '(^|: )(fatal )?error: |undefined reference|multiple definition|cannot find|: not found|No rule to make' "$log" |
        sed '/^  [^ ]*$/,$d' # a step that another job announced
    grep -m 1 '^make.*\*\*\* \[' "$log"
fi >&2
exit "$status"
