/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * commands.h — the interface of a command. A new command is one new file host/cmd/NAME.c that defines
 * `const struct command command_NAME`: the table commands[] is made from the sources (tools/table.sh).
 */
#ifndef BEAMFIT_COMMANDS_H
#define BEAMFIT_COMMANDS_H

#include "ground/ground.h"
#include "show/show.h"

struct command {
    int place; /* in the list of a bare `beamfit`: 10 for the first, 20 for the next, so that new ones fit between */
    const char *name;
    const char *summary; /* one line for `beamfit` and `beamfit help` */
    /* --help and the manual page: usage and what it does; options with units; an example, exit statuses ("Example:", "Exit status: 0 done; ...") */
    const char *help;
    const struct option_row *options;
    const char *closing;
    const struct answer_field *answer; /* of --json; --json-schema prints it */
    /*
     * Parses the options of argv[1 … argc − 1] with options_next() (optind is 1 again; argv[0] is the name), prints the answer on standard
     * output and returns a status; main() prints err->text and exits with it. main() also answers --help.
     */
    enum bf_status (*run)(int argc, char **argv, struct bf_error *err);
    bool unrepeatable; /* its output is measured: never replaced without --force, not even by the command itself */
};

extern const struct command *const commands[]; /* in order of their names */
extern const int commands_count;

#endif
