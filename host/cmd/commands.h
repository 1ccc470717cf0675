/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * commands.h — the table of commands. Each host/cmd/NAME.c defines one `const struct command command_NAME`.
 * run() gets argv[0] = the command's name, parses its options with getopt_long (optind already reset to 1), prints its
 * answer on standard output, and returns a status; main() prints err->text and exits with it. `--help` is handled by main().
 */
#ifndef BEAMFIT_COMMANDS_H
#define BEAMFIT_COMMANDS_H

#include "ground/ground.h"

struct command {
    const char *name;
    const char *summary; /* one line for `beamfit` and `beamfit help` */
    const char *help;    /* whole text of --help: usage, what it does, options with units, an example, exit statuses */
    enum bf_status (*run)(int argc, char **argv, struct bf_error *err);
};

extern const struct command command_init, command_modes, command_simulate, command_fit, command_compare,
    command_effects, command_add, command_diagnose, command_discriminate, command_drop, command_history, command_import,
    command_export, command_sign, command_verify, command_replay, command_report;
extern const struct command command_info, command_record, command_monitor, command_download, command_upload;

#endif
