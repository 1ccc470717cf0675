/* SPDX-License-Identifier: GPL-3.0-or-later */
/* ground_command.h — the command line, progress and Ctrl-C; part of ground.h */
#ifndef BEAMFIT_GROUND_COMMAND_H
#define BEAMFIT_GROUND_COMMAND_H

#include <getopt.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "ground/ground_error.h"

/* OPTIONS — a table for each command: parsed, explained by --help and the manual page, completed by the shell; one wording of mistakes. */

enum {
    OPTION_WORD = 1,
    OPTION_FORCE = -2,
    OPTION_ANSWER_FORMAT = -3,
    OPTION_SCHEMA = -4,
    OPTION_ALL = -5,
    OPTION_JSON = -6
};

/* Rows of a command that answers something, for options_format(). main() answers --json-schema. */
#define OPTIONS_JSON                                                                                                   \
    {OPTION_JSON, 0, "json", NULL, NULL, "the answer as JSON on standard output, and nothing else"},                   \
    {                                                                                                                  \
        OPTION_SCHEMA, 0, "json-schema", NULL, NULL, "what each name in that JSON is, as a JSON Schema, and no more"   \
    }
#define OPTIONS_ANSWER                                                                                                 \
    OPTIONS_JSON,                                                                                                      \
    {                                                                                                                  \
        OPTION_ANSWER_FORMAT, 0, "format", "HOW", "text|json|markdown|html",                                           \
            "the answer as text (default), json, markdown or html"                                                     \
    }
enum options_format { OPTIONS_TEXT, OPTIONS_AS_JSON, OPTIONS_MARKDOWN, OPTIONS_HTML };
enum options_format options_format(void); /* of the command line so far */
bool options_all(void);                   /* --all (OPTION_ALL) was there: text with every column */

/*
 * One row of a table, which ends with {0}. A row with code 0 is no option: with a name it explains an argument, without one its words stand
 * above the rows that follow.
 */
struct option_row {
    int code;         /* what options_next() returns; OPTION_FORCE: --force, which it takes care of */
    char letter;      /* of the short option; 0: none */
    const char *name; /* of the long option, without dashes; NULL: only the letter */
    const char
        *value; /* what it takes, in capitals that also tell a shell what fits (tools/completion.c); NULL: nothing */
    const char *of;   /* "bl|foh|zoh": all values that there are; NULL: any */
    const char *what; /* in words, on one line */
};

/*
 * The code of the next option of argv[1 … argc − 1], its value in optarg; −1 at the end of the options, optind is then at the first word that is none.
 * A mistake fills err and returns '?': then return BF_USAGE. The message has the nearest option where one is near.
 */
int options_next(int argc, char **argv, const struct option_row rows[], struct bf_error *err);

/* The same, and a word that is no option is returned as OPTION_WORD where it stands, in optarg. */
int options_next_or_word(int argc, char **argv, const struct option_row rows[], struct bf_error *err);

/* The help of a command: text_print_help() of what stands above its options, of the options, and of what stands below. */
void options_print_help(FILE *out, const char *above, const struct option_row rows[], const char *below,
                        size_t columns);

/* "-o, --output FILE", as --help and the manual page show it; "" for words between rows. */
enum { OPTION_TERM = 120 };
void option_term(const struct option_row *row, char term[OPTION_TERM]);

/* A finite number, else BF_USAGE with a message that names `what`. */
enum bf_status options_number(const char *what, const char *text, double *out, struct bf_error *err);

/* The same, above 0 and at most `most` (INFINITY: any). */
enum bf_status options_positive(const char *what, const char *text, double most, double *out, struct bf_error *err);

/* A whole number in [least, most]. */
enum bf_status options_count(const char *what, const char *text, long least, long most, long *out,
                             struct bf_error *err);

/* The place of text among names[n], else BF_USAGE with the nearest of them, or all. */
enum bf_status options_choice(const char *what, const char *text, const char *const names[], size_t n, size_t *out,
                              struct bf_error *err);

/* BF_USAGE when --json (--format) and the output "-" (NULL: none) both want standard output. */
enum bf_status options_one_answer(const char *output, struct bf_error *err);

/* After options_next() has said −1, of a command without names: BF_USAGE when a word is left over. */
enum bf_status options_only(int argc, char **argv, struct bf_error *err);

/* PROGRESS — a progress bar with an estimate on a terminal (standard error), nothing when piped; and Ctrl-C as a flag. */

struct progress;

struct progress *progress_begin(const char *what);

/* fraction in [0, 1]; note may be NULL, else one short phrase ("stage 3 of 6, error 0.041"). Cheap: redraws ≤ 10/s. */
void progress_update(struct progress *progress, double fraction, const char *note);
/* The same, always drawn: the beginning of another part of the work. */
void progress_stage(struct progress *progress, double fraction, const char *note);
void progress_end(struct progress *progress); /* clears the line */

/* After progress_catch_interrupts(), Ctrl-C sets a flag once; a second Ctrl-C ends the program the ordinary way. */
void progress_catch_interrupts(void);
bool progress_interrupted(void);
/* The same as Ctrl-C, from any thread; progress_catch_interrupts() forgets it. */
void progress_interrupt(void);

/* Who is told of progress besides, at most ten times a second, on the thread that works; NULL: nobody. Call while one thread runs. */
typedef void progress_listener(void *context, const char *what, double fraction, const char *note);
void progress_listen(progress_listener *tell, void *context);

#endif
