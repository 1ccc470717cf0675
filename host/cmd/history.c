/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "commands.h"
#include "compare/compare.h"
#include "ground/ground.h"
#include "show/show.h"

static const char help[] =
    "Usage: beamfit history MODEL... [--json] [--plot DIR]\n"
    "\n"
    "Puts models in the order in which they were made from each other (each file knows the SHA-256 of the file it\n"
    "was made from) and shows what each step brought: the effects gained and lost, and the errors its fit stated,\n"
    "on fitted records and on held-out ones. Nothing is computed again. A model whose parent is not given hangs\n"
    "on the nearest ancestor that is.\n";

static const struct option_row options[] = {
    OPTIONS_ANSWER,
    {'p', 0, "plot", "DIR", NULL, "error against model, with the noise floor as a line, as DIR/history.png and .pdf"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace pictures even when `history` has not made them or somebody has changed them"},
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit history start.yaml fitted.yaml with_mass.yaml with_mass_fitted.yaml --plot pictures\n"
    "\n"
    "Exit status: 0 done; 2 usage; 3 bad model file or pictures not writable.\n";

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    const char *directory = NULL;
    struct history h = {0};
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == '?')
            return BF_USAGE;
        directory = optarg;
    }
    if (optind == argc)
        return bf_fail(err, BF_USAGE, "give the models to put in order; see 'beamfit history --help'");
    enum bf_status status = history_read((const char *const *)argv + optind, (size_t)(argc - optind), &h, err);
    if (status == BF_OK)
        status = plot_prepare(directory, (const char *const[]){"history"}, 1, err);
    if (status == BF_OK)
        status = answer_print_and_free(history_json(&h), history_fields, err);
    if (status == BF_OK && directory)
        status = history_plot(&h, directory, err);
    history_free(&h);
    return status;
}

const struct command command_history = {
    .place = 100,
    .name = "history",
    .summary = "the chain of models with their errors, as a table and a picture",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = history_fields,
    .run = run,
};
