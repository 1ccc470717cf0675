#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# man_page.sh BEAMFIT — the manual page on standard output, made of what the program itself says with --help.
set -eu
beamfit=${1:?man_page.sh BEAMFIT}
list=$(COLUMNS=120 "$beamfit")
commands=$(printf '%s\n' "$list" | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p')

# Text that roff must not read as its own: backslashes, and a dot or quote that begins a line.
literal() {
    printf '.Bd -literal\n'
    sed -e 's/\\/\\e/g' -e "s/^\\([.']\\)/\\\\\&\\1/"
    printf '.Ed\n'
}

cat <<EOF
.\" Made by tools/man_page.sh from the help texts of beamfit; do not edit.
.Dd $(LC_ALL=C date -u ${SOURCE_DATE_EPOCH:+-d "@$SOURCE_DATE_EPOCH"} '+%B %e, %Y' | tr -s ' ')
.Dt BEAMFIT 1
.Os
.Sh NAME
.Nm beamfit
.Nd the model of a vibrating beam, fitted to recordings
.Sh SYNOPSIS
.Nm
.Ar command
.Op Ar arguments
.Nm
.Ar command
.Fl -help
.Nm
.Fl -version
.Sh DESCRIPTION
.Nm
estimates bending stiffness, mass, damping and gains of a beam
with a bonded piezo patch from hammer and patch recordings,
says how well each is known,
compares the model with measurements,
and adds physical effects that the model lacks.
Everything is in SI units.
A model is a commented YAML file;
a recording is a CSV file with a header row and a first column
.Li time_s .
.Pp
With
.Fl -json
a command answers with one JSON object on standard output and nothing else.
Errors go to standard error as
.Dl beamfit: file:line: what is wrong; what to do
.Pp
A file is written whole or not at all.
Long work shows a progress bar on a terminal and nothing when piped.
.Sh COMMANDS
EOF
for command in $commands; do
    printf '.Ss %s\n' "$command"
    "$beamfit" "$command" --help | literal
done
cat <<'EOF'
.Sh ENVIRONMENT
.Bl -tag -width COLUMNS
.It Ev COLUMNS
width of wrapped text when it is not the terminal's
.El
.Sh EXIT STATUS
.Bl -tag -width 1
.It 0
done
.It 1
a clear
.Sq no
where a command asks a question
.It 2
the command line must change
.It 3
an input file must change, or an output cannot be written
.It 4
the computation failed
.It 5
a device or port failed
.El
EOF
