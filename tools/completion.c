/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * completion.c — completion of beamfit's command line, made of the tables that --help prints: `completion bash FRAME` and `completion zsh`.
 * What fits a word is told by its name in the help: a MODEL is a YAML file, an ID an effect (kinds[]).
 */
#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "beam_effect.h"
#include "cmd/commands.h"
#include "ground/ground.h"
#include "record/import/import.h"

/* A word of the help, and what it stands for: a kind that completion.bash knows, or the ends of names of files. */
static const struct {
    const char *word, *kind;
} kinds[] = {
    {"MODEL", "yaml|yml"}, {"FITTED", "yaml|yml"}, {"NEW", "yaml|yml"},
    {"RECORD", "csv"},     {"RECORDING", "csv"},   {"OUT", "csv"},
    {"OUT.csv", "csv"},    {"DRIVE", "csv"},       {"IMAGE", "bfi|img"},
    {"SIGNED", "bfi|img"}, {"FILE", "file"},       {"FILE2", "file"},
    {"FILE.html", "html"}, {"DIR", "directory"},   {"PORT", "port"},
    {"ID", "effect"},      {"RIVAL", "effect"},    {"ID,ID...", "effect,..."},
};

enum { KIND = 400, MOST_PLACES = 8 };

/* ---- What fits ---- */

/* Words of a list "a|b" or "a, b or c", parted by blanks. */
static void spread(const char *list, size_t size, char out[])
{
    size_t n = 0;
    for (const char *c = list; *c != '\0' && n + 2 < size; c++) {
        const bool part = strchr("|, ", *c) != NULL;
        if (!part)
            out[n++] = *c;
        else if (n > 0 && out[n - 1] != ' ')
            out[n++] = ' ';
    }
    out[n] = '\0';
}

/* "=a b" for a fixed set, "=a b,..." for several of it, else a kind; "" when nothing is known. */
static void kind_of(const char *word, size_t n, const char *of, char kind[KIND])
{
    char list[KIND - 8];
    kind[0] = '\0';
    if (of != NULL) {
        spread(of, sizeof list, list);
        (void)snprintf(kind, KIND, "=%s%s", list, strchr(word, ',') != NULL ? ",..." : "");
    } else if (n == strlen("FORMAT") && strncmp(word, "FORMAT", n) == 0) {
        char formats[KIND - 8];
        import_format_list(sizeof formats, formats);
        spread(formats, sizeof list, list);
        (void)snprintf(kind, KIND, "=%s", list);
    }
    for (size_t i = 0; kind[0] == '\0' && i < sizeof kinds / sizeof *kinds; i++)
        if (strlen(kinds[i].word) == n && strncmp(word, kinds[i].word, n) == 0)
            (void)snprintf(kind, KIND, "%s", kinds[i].kind);
}

static void kind_of_value(const struct option_row *row, char kind[KIND])
{
    size_t n = strlen(row->value);
    if (n > 3 && strcmp(row->value + n - 3, "...") == 0 && strchr(row->value, ',') == NULL)
        n -= 3;
    kind_of(row->value, n, row->of, kind);
}

static const struct option_row *option_of(const struct option_row rows[], const char *word)
{
    for (const struct option_row *row = rows; row->what != NULL; row++) {
        const size_t n = row->name != NULL ? strlen(row->name) : 0;
        if (row->code != 0 && n > 0 && strncmp(word, "--", 2) == 0 && strncmp(word + 2, row->name, n) == 0 &&
            !isalnum((unsigned char)word[2 + n]) && word[2 + n] != '-')
            return row;
        if (row->code != 0 && row->letter != 0 && word[0] == '-' && word[1] == row->letter &&
            !isalnum((unsigned char)word[2]))
            return row;
    }
    return NULL;
}

struct places {
    size_t n;
    char word[MOST_PLACES][24];
    char kind[MOST_PLACES][KIND];
    bool again[MOST_PLACES]; /* "..." */
};

static void take_place(struct places *places, const char *word, size_t n)
{
    size_t bare = n;
    while (bare > 0 && word[bare - 1] == '.')
        bare--;
    if (places->n == MOST_PLACES || bare == 0 || !isupper((unsigned char)word[0]))
        return;
    (void)snprintf(places->word[places->n], sizeof places->word[0], "%.*s", (int)bare, word);
    kind_of(word, bare, NULL, places->kind[places->n]);
    places->again[places->n++] = bare < n;
}

/* The words of the usage's first line that are no options and no values of one, in their order. */
static void find_places(const struct command *command, struct places *out)
{
    const char *at = strstr(command->help, command->name) + strlen(command->name);
    const char *end = strchr(command->help, '\n');
    const struct option_row *option = NULL;
    *out = (struct places){0};
    while (at < end) {
        at += strspn(at, " []|");
        const size_t n = strcspn(at, " []|\n");
        if (at >= end || n == 0)
            break;
        if (at[0] == '-')
            option = option_of(command->options, at);
        else if (option != NULL && option->value != NULL)
            option = NULL;
        else
            take_place(out, at, n);
        at += n;
    }
}

/* ---- bash ---- */

static void bash_command(const struct command *command)
{
    struct places places;
    char kind[KIND];
    find_places(command, &places);
    (void)printf("    %s)\n        options='--help", command->name);
    for (const struct option_row *row = command->options; row->what != NULL; row++)
        if (row->code != 0)
            (void)printf(" %s%s", row->name != NULL ? "--" : "-",
                         row->name != NULL ? row->name : (const char[]){row->letter, '\0'});
    (void)printf("'\n        values=(");
    for (const struct option_row *row = command->options; row->what != NULL; row++) {
        if (row->code == 0 || row->value == NULL)
            continue;
        kind_of_value(row, kind);
        if (row->name != NULL)
            (void)printf(" [--%s]='%s'", row->name, kind);
        if (row->letter != 0)
            (void)printf(" [-%c]='%s'", row->letter, kind);
    }
    (void)printf(" )\n        places=(");
    for (size_t i = 0; i < places.n; i++)
        (void)printf(" '%s'", places.kind[i]);
    (void)printf(" )\n        again=%d\n        ;;\n", places.n > 0 && places.again[places.n - 1]);
}

static void bash(void)
{
    (void)puts("# Made by tools/completion.c from the tables of the commands; do not edit.");
    (void)fputs("_beamfit_commands='help", stdout);
    for (int i = 0; i < commands_count; i++)
        (void)printf(" %s", commands[i]->name);
    (void)fputs("'\n_beamfit_effects='", stdout);
    for (int i = 0; i < beam_effects_count; i++)
        (void)printf("%s%s", i > 0 ? " " : "", beam_effects[i]->id);
    (void)puts("'\n\n# What a command takes, in the caller's options, values, places and again.\n_beamfit_table() {\n  "
               "  case $1 in");
    for (int i = 0; i < commands_count; i++)
        bash_command(commands[i]);
    (void)puts("    *) return 1 ;;\n    esac\n}");
}

/* ---- zsh ---- */

/* Text within single quotes, where `marks` stand behind a backslash; only its first clause. */
static void zsh_text(const char *text, const char *marks)
{
    for (; *text != '\0' && !((*text == '.' || *text == ';') && text[1] == ' '); text++) {
        if (*text == '\'')
            (void)fputs("'\\''", stdout);
        else
            (void)printf("%s%c", strchr(marks, *text) != NULL ? "\\" : "", *text);
    }
}

static void zsh_action(const char *kind)
{
    const char *more = strstr(kind, ",...");
    if (kind[0] == '=' && more != NULL)
        (void)printf("_values -s , value %.*s", (int)(more - kind - 1), kind + 1);
    else if (kind[0] == '=')
        (void)printf("(%s)", kind + 1);
    else if (strcmp(kind, "effect") == 0)
        (void)fputs("_beamfit_effects", stdout);
    else if (strcmp(kind, "effect,...") == 0)
        (void)fputs("_sequence _beamfit_effects", stdout);
    else if (strcmp(kind, "directory") == 0)
        (void)fputs("_files -/", stdout);
    else if (strcmp(kind, "port") == 0)
        (void)fputs("_files -g \"/dev/tty(USB|ACM)*(N)\"", stdout);
    else if (strcmp(kind, "file") == 0)
        (void)fputs("_files", stdout);
    else if (kind[0] != '\0')
        (void)printf("_files -g \"*.(%s)(-.)\"", kind);
}

static void zsh_option(const struct option_row *row)
{
    char kind[KIND];
    for (int form = 0; form < 2; form++) {
        if (form == 0 ? row->name == NULL : row->letter == 0)
            continue;
        (void)fputs(" \\\n            '*", stdout);
        if (form == 0)
            (void)printf("--%s%s[", row->name, row->value != NULL ? "=" : "");
        else
            (void)printf("-%c%s[", row->letter, row->value != NULL ? "+" : "");
        zsh_text(row->what, "[]:\\");
        (void)putchar(']');
        if (row->value != NULL) {
            kind_of_value(row, kind);
            (void)putchar(':');
            zsh_text(row->value, ":[]\\");
            (void)putchar(':');
            zsh_action(kind);
        }
        (void)putchar('\'');
    }
}

static void zsh_command(const struct command *command)
{
    struct places places;
    find_places(command, &places);
    (void)printf("    %s)\n        _arguments '--help[explain the command]'", command->name);
    for (const struct option_row *row = command->options; row->what != NULL; row++)
        if (row->code != 0)
            zsh_option(row);
    for (size_t i = 0; i < places.n; i++) {
        if (i + 1 == places.n && places.again[i])
            (void)printf(" \\\n            '*:%s:", places.word[i]);
        else
            (void)printf(" \\\n            '%zu:%s:", i + 1, places.word[i]);
        zsh_action(places.kind[i]);
        (void)putchar('\'');
    }
    (void)puts("\n        ;;");
}

static void zsh(void)
{
    (void)puts("#compdef beamfit\n# Made by tools/completion.c from the tables of the commands; do not edit.\n"
               "_beamfit_effects() {\n    local -a effects=(");
    for (int i = 0; i < beam_effects_count; i++) {
        (void)printf("        '%s:", beam_effects[i]->id);
        zsh_text(beam_effects[i]->title, ":\\");
        (void)puts("'");
    }
    (void)puts("    )\n    _describe -t effects effect effects \"$@\"\n}\n\n_beamfit_commands() {\n    local -a "
               "names=(\n        'help:explain a "
               "command'");
    for (int i = 0; i < commands_count; i++) {
        (void)printf("        '%s:", commands[i]->name);
        zsh_text(commands[i]->summary, ":\\");
        (void)puts("'");
    }
    (void)puts(
        "    )\n    _describe -t commands command names\n}\n\n_beamfit() {\n    if ((CURRENT == 2)); then\n        "
        "_beamfit_commands\n        return\n    fi\n    shift words\n    ((CURRENT--))\n    case $words[1] in\n"
        "    help) _beamfit_commands ;;");
    for (int i = 0; i < commands_count; i++)
        zsh_command(commands[i]);
    (void)puts("    esac\n}\n\n_beamfit \"$@\"");
}

int main(int argc, char **argv)
{
    if (argc != 2 || (strcmp(argv[1], "bash") != 0 && strcmp(argv[1], "zsh") != 0)) {
        (void)fputs("completion bash|zsh\n", stderr);
        return 2;
    }
    if (strcmp(argv[1], "bash") == 0)
        bash();
    else
        zsh();
    return fflush(stdout) == 0 && !ferror(stdout) ? 0 : 1;
}
