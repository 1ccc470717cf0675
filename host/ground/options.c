/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ground.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROWS = 64, FIRST_ROW = 1000 };

/* The table as getopt_long() wants it; val is the row's place from FIRST_ROW on. */
struct getopt_tables {
    struct option by_name[MOST_ROWS + 1];
    char by_letter[2 * MOST_ROWS + 3];
};

static void make_tables(const struct option_row rows[], bool words, struct getopt_tables *out)
{
    size_t n = 0, at = 0;
    *out = (struct getopt_tables){0};
    at += (size_t)snprintf(out->by_letter, sizeof out->by_letter, words ? "-:" : ":");
    for (size_t i = 0; i < MOST_ROWS && rows[i].what != NULL; i++) {
        if (rows[i].code == 0)
            continue;
        if (rows[i].name != NULL)
            out->by_name[n++] = (struct option){rows[i].name, rows[i].value != NULL ? required_argument : no_argument,
                                                NULL, FIRST_ROW + (int)i};
        if (rows[i].letter != 0) {
            out->by_letter[at++] = rows[i].letter;
            if (rows[i].value != NULL)
                out->by_letter[at++] = ':';
        }
    }
}

static const struct option_row *row_of(int found, const struct option_row rows[])
{
    if (found >= FIRST_ROW)
        return &rows[found - FIRST_ROW];
    for (const struct option_row *row = rows; row->what != NULL; row++)
        if (row->letter != 0 && row->letter == found)
            return row;
    return NULL;
}

/* How many options the word --WORD is a beginning of, when it is none itself. */
static size_t count_beginnings(const char *word, size_t n, const struct option *long_options)
{
    size_t count = 0;
    for (const struct option *one = long_options; one->name != NULL; one++)
        count += strncmp(one->name, word, n) == 0;
    return count;
}

static const char *nearest(const char *word, const struct option *long_options)
{
    const char *names[MOST_ROWS], *closest = NULL;
    size_t n = 0;
    for (const struct option *one = long_options; one->name != NULL; one++)
        names[n++] = one->name;
    char *copy = bf_strdup(word);
    copy[strcspn(copy, "=")] = '\0';
    closest = text_closest(copy, names, n);
    free(copy);
    return closest;
}

static void explain_long(const char *command, const char *text, bool known, const struct option *long_options,
                         struct bf_error *err)
{
    const char *word = text + strspn(text, "-"), *closest = nearest(word, long_options);
    const size_t n = strcspn(word, "=");
    if (known)
        (void)bf_fail(err, BF_USAGE, "option '--%.*s' takes no value; see 'beamfit %s --help'", (int)n, word, command);
    else if (n > 0 && count_beginnings(word, n, long_options) > 1)
        (void)bf_fail(err, BF_USAGE, "option '%.60s' can mean several; write it out, see 'beamfit %s --help'", text,
                      command);
    else if (closest != NULL)
        (void)bf_fail(err, BF_USAGE, "no such option '%.60s'; did you mean '--%s'?", text, closest);
    else
        (void)bf_fail(err, BF_USAGE, "no such option '%.60s'; see 'beamfit %s --help'", text, command);
}

static enum options_format format_asked;
static bool all_asked;

bool options_all(void)
{
    return all_asked;
}

enum options_format options_format(void)
{
    return format_asked;
}

/* What is no business of the command. */
static enum bf_status take_common(const struct option_row *row, struct bf_error *err)
{
    static const char *const forms[] = {"text", "json", "markdown", "html"}; /* order of enum options_format */
    size_t form = OPTIONS_AS_JSON;
    if (row->code == OPTION_FORCE)
        outputs_force();
    else if (row->code == OPTION_ALL)
        all_asked = true;
    if (row->code == OPTION_ANSWER_FORMAT && options_choice("--format", optarg, forms, 4, &form, err) != BF_OK)
        return BF_USAGE;
    if (row->code == OPTION_ANSWER_FORMAT || row->code == OPTION_JSON)
        format_asked = (enum options_format)form;
    return BF_OK;
}

static int next(int argc, char **argv, const struct option_row rows[], bool words, struct bf_error *err)
{
    struct getopt_tables tables;
    const struct option_row *row = NULL;
    int found;
    make_tables(rows, words, &tables);
    opterr = 0;
    while ((found = getopt_long(argc, argv, tables.by_letter, tables.by_name, NULL)) != -1 &&
           (row = row_of(found, rows)) != NULL) {
        if (take_common(row, err) != BF_OK)
            return '?';
        if (row->code >= 0)
            return row->code;
    }
    const char *text = found == -1 ? "" : argv[optind - 1];
    if (found == ':')
        (void)bf_fail(err, BF_USAGE, "option '%.60s' needs a value; see 'beamfit %s --help'", text, argv[0]);
    else if (found == '?' && optopt > 0 && optopt < 128 && strncmp(text, "--", 2) != 0)
        (void)bf_fail(err, BF_USAGE, "no such option '-%c'; see 'beamfit %s --help'", optopt, argv[0]);
    else if (found == '?')
        explain_long(argv[0], text, optopt != 0, tables.by_name, err);
    return found == ':' ? '?' : found;
}

int options_next(int argc, char **argv, const struct option_row rows[], struct bf_error *err)
{
    return next(argc, argv, rows, false, err);
}

int options_next_or_word(int argc, char **argv, const struct option_row rows[], struct bf_error *err)
{
    return next(argc, argv, rows, true, err);
}

enum bf_status options_number(const char *what, const char *text, double *out, struct bf_error *err)
{
    if (decimal_parse(text, out) && isfinite(*out))
        return BF_OK;
    return bf_fail(err, BF_USAGE, "%s '%.60s' is not a number; write e.g. 0.05 or 1e-3", what, text);
}

enum bf_status options_positive(const char *what, const char *text, double most, double *out, struct bf_error *err)
{
    if (options_number(what, text, out, err) != BF_OK)
        return BF_USAGE;
    if (*out > 0.0 && *out <= most)
        return BF_OK;
    return isfinite(most) ? bf_fail(err, BF_USAGE, "%s '%.60s': give a number above 0, at most %g", what, text, most)
                          : bf_fail(err, BF_USAGE, "%s '%.60s': give a number above 0", what, text);
}

enum bf_status options_count(const char *what, const char *text, long least, long most, long *out, struct bf_error *err)
{
    char *end;
    errno = 0;
    *out = strtol(text, &end, 10);
    if (end == text || isspace((unsigned char)text[0]) || errno != 0 || *end != '\0' || *out < least || *out > most)
        return bf_fail(err, BF_USAGE, "%s '%.60s': give a whole number from %ld to %ld", what, text, least, most);
    return BF_OK;
}

enum bf_status options_choice(const char *what, const char *text, const char *const names[], size_t n, size_t *out,
                              struct bf_error *err)
{
    char known[400] = "";
    size_t used = 0;
    for (size_t i = 0; i < n; i++) {
        if (strcmp(text, names[i]) == 0) {
            *out = i;
            return BF_OK;
        }
        const int more = snprintf(known + used, sizeof known - used, "%s%s",
                                  i == 0      ? ""
                                  : i + 1 < n ? ", "
                                              : " or ",
                                  names[i]);
        used = used + (size_t)more < sizeof known ? used + (size_t)more : sizeof known - 1;
    }
    const char *closest = text_closest(text, names, n);
    if (closest != NULL)
        return bf_fail(err, BF_USAGE, "%s '%.60s' is unknown; did you mean '%s'?", what, text, closest);
    return bf_fail(err, BF_USAGE, "%s '%.60s' is unknown; give %s", what, text, known);
}

enum bf_status options_one_answer(const char *output, struct bf_error *err)
{
    if (options_format() == OPTIONS_TEXT || output == NULL || strcmp(output, "-") != 0)
        return BF_OK;
    return bf_fail(err, BF_USAGE, "--json and -o - both want standard output; give a file to -o");
}

enum bf_status options_only(int argc, char **argv, struct bf_error *err)
{
    if (optind >= argc)
        return BF_OK;
    return bf_fail(err, BF_USAGE, "'%.60s': %s takes options only; see 'beamfit %s --help'", argv[optind], argv[0],
                   argv[0]);
}
