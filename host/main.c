/* SPDX-License-Identifier: GPL-3.0-or-later */
/* main.c — the command line: which command it names, and the list of them. */
#include <errno.h>
#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "cmd/commands.h"
#include "ground/ground.h"
#include "show/show.h"

static const struct command *find(const char *name)
{
    for (int i = 0; i < commands_count; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

static bool is_listed_before(const struct command *a, const struct command *b)
{
    return a->place != b->place ? a->place < b->place : strcmp(a->name, b->name) < 0;
}

/* The command that is listed after `last` (NULL: the first); NULL when `last` is the last. */
static const struct command *next_in_list(const struct command *last)
{
    const struct command *next = NULL;
    for (int i = 0; i < commands_count; i++)
        if ((last == NULL || is_listed_before(last, commands[i])) &&
            (next == NULL || is_listed_before(commands[i], next)))
            next = commands[i];
    return next;
}

static void list(void)
{
    size_t width = 0;
    (void)fputs("beamfit " BEAMFIT_VERSION ": the model of a vibrating beam, fitted to recordings.\n\n"
                "Usage: beamfit COMMAND [arguments]\n\n",
                stdout);
    for (int i = 0; i < commands_count; i++)
        width = strlen(commands[i]->name) > width ? strlen(commands[i]->name) : width;
    for (const struct command *one = next_in_list(NULL); one != NULL; one = next_in_list(one)) {
        (void)fputs("  ", stdout);
        text_print_padded(stdout, one->name, width + 2);
        text_print_wrapped(stdout, one->summary, width + 4, text_columns());
    }
    (void)fputs("\n`beamfit COMMAND --help` explains one; with --json a command answers in JSON.\n"
                "Start with `beamfit init`.\n",
                stdout);
}

static enum bf_status unknown(const char *name, struct bf_error *err)
{
    static const char *const own[] = {"--help", "--version", "-h"};
    const bool option = name[0] == '-';
    const char **names = bf_alloc((size_t)commands_count, sizeof *names);
    for (int i = 0; i < commands_count; i++)
        names[i] = commands[i]->name;
    const char *closest = option ? text_closest(name, own, 3) : text_closest(name, names, (size_t)commands_count);
    free(names);
    return bf_fail(err, BF_USAGE, "%s '%.60s'; %s%s%s%s", option ? "no such option" : "unknown command", name,
                   option ? "options stand behind a command, and a bare `beamfit` lists those"
                          : "a bare `beamfit` lists them",
                   closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
}

static bool asks_for(const char *word, const char *or_word, int argc, char **argv)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++)
        if (strcmp(argv[i], word) == 0 || strcmp(argv[i], or_word) == 0)
            return true;
    return false;
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    const char *name = argc > 1 ? argv[1] : "help";
    if (strcmp(name, "--version") == 0 || strcmp(name, "version") == 0) {
        (void)puts("beamfit " BEAMFIT_VERSION);
        return BF_OK;
    }
    bool help = strcmp(name, "help") == 0 || strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0;
    if (help && argc < 3) {
        list();
        return BF_OK;
    }
    const struct command *command = find(help ? argv[2] : name);
    if (!command)
        return unknown(help ? argv[2] : name, err);
    if (!help && asks_for("--json-schema", "--json-schema", argc - 1, argv + 1))
        return answer_print_schema(command->name, command->answer, stdout, err);
    if (help || asks_for("--help", "-h", argc - 1, argv + 1)) {
        options_print_help(stdout, command->help, command->options, command->closing, text_columns());
        return BF_OK;
    }
    optind = 1;
    outputs_protect(command->name, command->unrepeatable);
    return command->run(argc - 1, argv + 1, err);
}

/*
 * Fits take arrays of megabytes and give them back thousands of times. They stay with the process: to get their pages from the system each time, and zeroed, was a tenth of the
 * time of long records.
 */
static void keep_memory(void)
{
#ifdef __GLIBC__
    enum { KEPT_BYTES = 1 << 30 };
    (void)mallopt(M_MMAP_THRESHOLD, KEPT_BYTES);
    (void)mallopt(M_TRIM_THRESHOLD, KEPT_BYTES);
#endif
}

int main(int argc, char **argv)
{
    struct bf_error err = {BF_OK, ""};
    keep_memory();
    bf_warn_listen(answer_take_warning, NULL);
    enum bf_status status = run(argc, argv, &err);
    if ((fflush(stdout) != 0 || ferror(stdout)) && (status == BF_OK || status == BF_NO))
        status =
            bf_fail(&err, BF_BAD_FILE, "standard output cannot be written (%s); is the disk full?", strerror(errno));
    if (status != BF_OK && err.text[0])
        (void)fprintf(stderr, "beamfit: %s\n", err.text);
    return (int)status;
}
