/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * manual.c — the manual pages, made of the tables that --help prints: `manual` writes beamfit(1), `manual COMMAND` beamfit-COMMAND(1), `manual names`
 * the names of all commands. The language is mdoc; SOURCE_DATE_EPOCH sets the date.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cmd/commands.h"
#include "ground/ground.h"

/* ---- Text that roff must not read as its own ---- */

static void put(const char *text, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const bool first = i == 0, option = text[i] == '-' && (first || strchr(" [(`-", text[i - 1]) != NULL);
        if (first && (text[i] == '.' || text[i] == '\''))
            (void)fputs("\\&", stdout);
        if (text[i] == '\\')
            (void)fputs("\\e", stdout);
        else if (option)
            (void)fputs("\\-", stdout);
        else
            (void)putchar(text[i]);
    }
}

static void put_line(const char *text, size_t n)
{
    put(text, n);
    (void)putchar('\n');
}

/* A new line behind each full stop, as roff likes it. */
static void put_sentences(const char *text, size_t n)
{
    size_t start = 0;
    for (size_t i = 0; i + 1 < n; i++)
        if (strchr(".?!", text[i]) != NULL && text[i + 1] == ' ') {
            put_line(text + start, i + 1 - start);
            start = i + 2;
        }
    put_line(text + start, n - start);
}

/* ---- Pieces of a help text ---- */

static size_t line_length(const char *text)
{
    return strcspn(text, "\n");
}

static const char *next_line(const char *text)
{
    const size_t n = line_length(text);
    return text + n + (text[n] == '\n');
}

static bool begins(const char *text, const char *with)
{
    return strncmp(text, with, strlen(with)) == 0;
}

/* "Usage: beamfit NAME ..." and the lines "       beamfit ..." below it; returns what follows. */
static const char *put_usage(const char *text, const char *name)
{
    static const char lead[] = "Usage: beamfit ";
    while (begins(text, "Usage: ") || begins(text, "       ")) {
        const size_t n = line_length(text);
        (void)printf(".Nm beamfit %s\n", name);
        const size_t skip = strlen(lead) + strlen(name);
        if (begins(text + strlen("Usage: "), "beamfit ") && n > skip + 1)
            put_line(text + skip + 1, n - skip - 1);
        else if (!begins(text + strlen("Usage: "), "beamfit "))
            put_line(text + strspn(text, " "), n - strspn(text, " "));
        text = next_line(text);
    }
    return text;
}

/* Indented lines stay as they are; returns what follows them. */
static const char *put_literal(const char *text)
{
    (void)puts(".Bd -literal -offset indent");
    for (; *text == ' '; text = next_line(text)) {
        const size_t n = line_length(text), indent = strspn(text, " ") < 2 ? 0 : 2;
        put_line(text + indent, n - indent);
    }
    (void)puts(".Ed");
    return text;
}

/* Paragraphs up to `end`; the first follows a heading, so that nothing parts it from there. */
static void put_paragraphs(const char *text, const char *end, bool heading)
{
    bool apart = !heading;
    while (text < end && *text != '\0') {
        if (*text == '\n') {
            apart = true;
            text = next_line(text);
        } else if (*text == ' ') {
            text = put_literal(text);
            apart = false;
        } else {
            if (apart)
                (void)puts(".Pp");
            apart = false;
            put_sentences(text, line_length(text));
            text = next_line(text);
        }
    }
}

static void put_term(const struct option_row *row)
{
    (void)fputs(".It", stdout);
    if (row->code == 0) {
        (void)printf(" Ar \\&%s\n", row->name);
        return;
    }
    if (row->letter != 0)
        (void)printf(" Fl %c%s", row->letter, row->name != NULL ? " ," : "");
    if (row->name != NULL)
        (void)printf(" Fl \\-%s", row->name);
    if (row->value != NULL)
        (void)printf(" Ar \"\\&%s\"", row->value);
    (void)putchar('\n');
}

static void put_options(const struct option_row rows[])
{
    bool open = false;
    (void)puts(".Pp\nThe options are as follows:");
    for (const struct option_row *row = rows; row->what != NULL; row++) {
        const bool words = row->code == 0 && row->name == NULL;
        if (words) {
            (void)puts(open ? ".El\n.Pp" : ".Pp");
            put_sentences(row->what, strlen(row->what));
        } else {
            if (!open)
                (void)puts(".Bl -tag -width Ds");
            put_term(row);
            put_sentences(row->what, strlen(row->what));
        }
        open = !words;
    }
    if (open)
        (void)puts(".El");
}

/* "Exit status: 0 done; 1 no; ..." as a list: a code begins behind "; " with a digit and a blank. */
static void put_statuses(const char *text)
{
    char *all = bf_strdup(text), *at = all;
    for (char *c = all; *c != '\0'; c++)
        *c = *c == '\n' ? ' ' : *c;
    (void)puts(".Sh EXIT STATUS\n.Bl -tag -width Ds");
    while (at != NULL && isdigit((unsigned char)*at)) {
        char *end = at;
        do
            end = strstr(end + 1, "; ");
        while (end != NULL && !(isdigit((unsigned char)end[2]) && end[3] == ' '));
        size_t n = end != NULL ? (size_t)(end - at) : strlen(at);
        while (n > 0 && strchr(" .", at[n - 1]) != NULL)
            n--;
        (void)printf(".It %c\n", *at);
        put_line(at + 2, n - 2);
        at = end != NULL ? end + 2 : NULL;
    }
    (void)puts(".El");
    free(all);
}

/* Lines of words, and commands as they are typed, with what continues them. */
static void put_examples(const char *text, const char *end)
{
    bool first = true;
    (void)puts(".Sh EXAMPLES");
    text = next_line(text);
    while (text < end && *text != '\0') {
        const char *words = text + strspn(text, " ");
        if (begins(words, "beamfit ")) {
            (void)puts(".Bd -literal -offset indent");
            for (bool more = true; (more || begins(text + strspn(text, " "), "beamfit ")) && text < end;) {
                const size_t n = line_length(text), indent = strspn(text, " ");
                more = n > 0 && text[n - 1] == '\\';
                (void)fputs(begins(text + indent, "beamfit ") ? "" : "    ", stdout);
                put_line(text + indent, n - indent);
                text = next_line(text);
            }
            (void)puts(".Ed");
        } else {
            if (!first && *text != '\n')
                (void)puts(".Pp");
            if (*text != '\n')
                put_sentences(words, line_length(words));
            text = next_line(text);
        }
        first = false;
    }
}

/* Names of the JSON answer with what they are: "modes[].frequency_Hz". */
static void put_answer(const struct answer_field fields[], const char *within)
{
    for (const struct answer_field *f = fields; f->name != NULL; f++) {
        char name[200];
        const bool list = f->kind == ANSWER_LIST, map = f->kind == ANSWER_MAP;
        if (!answer_is_name(f))
            continue;
        (void)snprintf(name, sizeof name, "%s%s", within, f->name);
        (void)printf(".It Li \\&%s\n", name);
        if (answer_unit(f)[0] != '\0')
            (void)printf("(%s) ", answer_unit(f));
        put_sentences(f->what, strlen(f->what));
        (void)snprintf(name, sizeof name, "%s%s%s", within, f->name, list ? "[]." : map ? ".NAME." : ".");
        if (f->fields != NULL)
            put_answer(f->fields, name);
    }
}

/* ---- Pages ---- */

static void put_head(const char *title)
{
    const char *epoch = getenv("SOURCE_DATE_EPOCH");
    const time_t when = epoch != NULL ? (time_t)strtoll(epoch, NULL, 10) : time(NULL);
    struct tm day;
    char month[32];
    (void)gmtime_r(&when, &day);
    (void)strftime(month, sizeof month, "%B", &day);
    (void)printf(
        ".\\\" Made by tools/manual.c from the tables of the commands; do not edit.\n.Dd %s %d, %d\n.Dt %s 1\n.Os\n",
        month, day.tm_mday, day.tm_year + 1900, title);
}

static void put_command(const struct command *command)
{
    char title[64];
    const char *examples = strstr(command->closing, "Example"), *statuses = strstr(command->closing, "Exit status: ");
    const char *end = command->closing + strlen(command->closing);
    (void)snprintf(title, sizeof title, "BEAMFIT-%s", command->name);
    for (char *c = title; *c != '\0'; c++)
        *c = (char)toupper((unsigned char)*c);
    put_head(title);
    (void)printf(".Sh NAME\n.Nm beamfit-%s\n.Nd %s\n.Sh SYNOPSIS\n", command->name, command->summary);
    const char *rest = put_usage(command->help, command->name);
    (void)puts(".Sh DESCRIPTION");
    rest += strspn(rest, "\n");
    put_paragraphs(rest, rest + strlen(rest), true);
    put_options(command->options);
    const char *first = examples != NULL ? examples : statuses != NULL ? statuses : end;
    put_paragraphs(command->closing, first, false);
    if (statuses != NULL)
        put_statuses(statuses + strlen("Exit status: "));
    (void)puts(".Sh JSON\nNames in the answer with\n.Fl \\-json ;\n.Fl \\-json-schema\n"
               "prints them as a JSON Schema.\nEvery answer also has the lists\n.Li warnings\nand\n.Li next\n"
               "(commands to go on with).\n.Bl -tag -width Ds");
    put_answer(command->answer, "");
    (void)puts(".El");
    if (examples != NULL)
        put_examples(examples, statuses != NULL && statuses > examples ? statuses : end);
    (void)puts(".Sh SEE ALSO\n.Xr beamfit 1");
}

static const struct command *listed_after(const struct command *last)
{
    const struct command *next = NULL;
    for (int i = 0; i < commands_count; i++)
        if ((last == NULL || commands[i]->place > last->place) && (next == NULL || commands[i]->place < next->place))
            next = commands[i];
    return next;
}

static void put_program(void)
{
    put_head("BEAMFIT");
    (void)puts(
        ".Sh NAME\n.Nm beamfit\n.Nd the model of a vibrating beam, fitted to recordings\n"
        ".Sh SYNOPSIS\n.Nm\n.Ar command\n.Op Ar arguments\n.Nm\n.Ar command\n.Fl -help\n.Nm\n.Fl -version\n"
        ".Sh DESCRIPTION\n.Nm\n"
        "estimates bending stiffness, mass, damping and gains of a beam\n"
        "with bonded piezo patches from hammer and patch recordings,\n"
        "says how well each is known,\ncompares the model with measurements,\n"
        "and finds physical effects that the model lacks.\nEverything is in SI units.\n"
        "A model is a commented YAML file;\n"
        "a recording is a CSV file with a header row and a first column\n.Li time_s .\n"
        ".Pp\nWith\n.Fl -json\na command answers with one JSON object on standard output and nothing else.\n"
        "Errors go to standard error as\n.Dl beamfit: file:line: what is wrong; what to do\n"
        ".Pp\nA file is written whole or not at all, and none is replaced that the command has not made itself,\n"
        "unless\n.Fl -force\nsays so.\n"
        "Long work shows a progress bar on a terminal and nothing when piped.\n"
        ".Sh COMMANDS\n.Bl -tag -width discriminate");
    for (const struct command *one = listed_after(NULL); one != NULL; one = listed_after(one))
        (void)printf(".It Xr beamfit-%s 1\n%s\n", one->name, one->summary);
    (void)puts(".El\n.Sh ENVIRONMENT\n.Bl -tag -width Ds\n"
               ".It Ev COLUMNS\nwidth of wrapped text when it is not the terminal's\n"
               ".It Ev TMPDIR\nwhere pictures are drawn before they are put in place\n"
               ".It Ev SOURCE_DATE_EPOCH\ndate on pages, instead of today\n.El\n"
               ".Sh EXIT STATUS\n.Bl -tag -width Ds\n.It 0\ndone\n"
               ".It 1\na clear\n.Sq no\nwhere a command asks a question\n"
               ".It 2\nthe command line must change\n.It 3\nan input file must change, or an output cannot be written\n"
               ".It 4\nthe computation failed\n.It 5\na device or port failed\n.El");
}

int main(int argc, char **argv)
{
    bool known = argc < 2 || strcmp(argv[1], "names") == 0;
    if (argc < 2)
        put_program();
    for (int i = 0; argc > 1 && i < commands_count; i++) {
        if (strcmp(argv[1], "names") == 0) {
            (void)puts(commands[i]->name);
        } else if (strcmp(argv[1], commands[i]->name) == 0) {
            put_command(commands[i]);
            known = true;
        }
    }
    return known && fflush(stdout) == 0 && !ferror(stdout) ? 0 : 1;
}
