/* SPDX-License-Identifier: GPL-3.0-or-later */
/* help.c — the help text of a command at any width: paragraphs, options with their explanations, examples. */
#include "ground.h"

#include <string.h>

enum {
    MARGIN = 2,
    DEEP = 8,
    TERM = 21,
    WORDS = 4096
};                                                /* TERM: an option as wide as that has its explanation below it */
enum kind { NOTHING, PARAGRAPH, ENTRY, COMMAND }; /* what the last line was part of */

struct block {
    FILE *out;
    size_t columns, indent; /* indent: of the lines after the first */
    enum kind kind;
    char words[WORDS]; /* not yet printed */
    size_t n;
};

static size_t blanks(const char *line, size_t n)
{
    size_t i = 0;
    while (i < n && line[i] == ' ')
        i++;
    return i;
}

static void add_words(struct block *b, const char *text, size_t n)
{
    if (n == 0 || b->n + n + 2 > WORDS)
        return;
    if (b->n > 0)
        b->words[b->n++] = ' ';
    memcpy(b->words + b->n, text, n);
    b->n += n;
    b->words[b->n] = '\0';
}

/* Where a line of so many columns is cut: before a word, and not between an option and its value. */
static size_t cut_of(const char *text, size_t columns)
{
    size_t cut = 0, last = 0;
    for (size_t i = 0; i <= columns && text[i] != '\0'; i++) {
        if (text[i] != ' ')
            continue;
        if (last == 0 || text[last + 1] != '-' || strchr("-=", text[i + 1]) != NULL)
            cut = i;
        last = i;
    }
    return cut;
}

/* A command as it is to be typed: what does not fit goes on behind a backslash. */
static void print_command(const struct block *b)
{
    const char *text = b->words;
    size_t margin = b->indent;
    for (;;) {
        const size_t room = b->columns > margin + 2 ? b->columns - margin - 2 : 0;
        const size_t cut = text_width(text) > room + 2 ? cut_of(text, room) : 0;
        if (cut == 0)
            break;
        (void)fprintf(b->out, "%*s%.*s \\\n", (int)margin, "", (int)cut, text);
        text += cut + 1;
        margin = b->indent + 2 * MARGIN;
    }
    (void)fprintf(b->out, "%*s%s\n", (int)margin, "", text);
}

static void end_block(struct block *b)
{
    if (b->n > 0 && b->kind == COMMAND)
        print_command(b);
    else if (b->n > 0)
        text_print_wrapped(b->out, b->words, b->indent, b->columns);
    b->n = 0;
    b->words[0] = '\0';
    b->kind = NOTHING;
}

/* The block's first words are printed behind `indent` columns of what stands already. */
static void begin_block(struct block *b, enum kind kind, size_t indent)
{
    end_block(b);
    b->kind = kind;
    b->indent = indent;
}

/* "  --option VALUE   what it does": where the explanation begins, in bytes; n when it begins on the next line. */
static size_t explanation(const char *line, size_t n)
{
    const size_t term = blanks(line, n);
    for (size_t i = term; i + 1 < n; i++)
        if (line[i] == ' ' && line[i + 1] == ' ')
            return i + blanks(line + i, n - i);
    return n;
}

static void begin_entry(struct block *b, const char *line, size_t n)
{
    const size_t at = explanation(line, n);
    const bool beside = at < n && at <= b->columns / 2;
    size_t end = at;
    while (end > 0 && line[end - 1] == ' ')
        end--;
    begin_block(b, ENTRY, beside ? at : at < n ? DEEP : 0);
    (void)fprintf(b->out, "%.*s%s%*s", (int)end, line, beside ? "" : "\n", (int)(beside ? at - end : b->indent), "");
    add_words(b, line + at, n - at);
}

/* The first line below a term that stands alone says where the explanation is. */
static void go_on(struct block *b, const char *line, size_t n, size_t in)
{
    if (b->n == 0 && b->indent == 0) {
        b->indent = in <= b->columns / 2 ? in : DEEP;
        (void)fprintf(b->out, "%*s", (int)b->indent, "");
    }
    add_words(b, line + in, n - in);
}

static void command(struct block *b, const char *line, size_t n, size_t in)
{
    const bool more = line[n - 1] == '\\';
    if (b->kind != COMMAND)
        begin_block(b, COMMAND, in);
    n -= more;
    while (n > in && line[n - 1] == ' ')
        n--;
    add_words(b, line + in, n - in);
    if (!more)
        end_block(b);
}

static bool begins(const char *line, size_t n, const char *with)
{
    return n >= strlen(with) && memcmp(line, with, strlen(with)) == 0;
}

static void usage(struct block *b, const char *line, size_t n)
{
    static const char call[] = "Usage: beamfit ";
    begin_block(b, PARAGRAPH, strlen(call));
    (void)fprintf(b->out, "%.*s", (int)strlen(call), line);
    add_words(b, line + strlen(call), n - strlen(call));
    end_block(b);
}

static void paragraph(struct block *b, const char *line, size_t n, size_t in)
{
    if (b->kind != PARAGRAPH || b->indent != in) {
        begin_block(b, PARAGRAPH, in);
        (void)fprintf(b->out, "%*s", (int)in, "");
    }
    add_words(b, line + in, n - in);
    if (line[n - 1] == ':')
        end_block(b);
}

static void take_line(struct block *b, const char *line, size_t n)
{
    static const char call[] = "Usage: beamfit ", again[] = "       beamfit ";
    const size_t in = blanks(line, n);
    if (begins(line, n, call) || begins(line, n, again)) {
        usage(b, line, n);
    } else if (in > 0 && (b->kind == COMMAND || begins(line + in, n - in, "beamfit "))) {
        command(b, line, n, in);
    } else if (in > MARGIN && b->kind == ENTRY) {
        go_on(b, line, n, in);
    } else if (in > MARGIN) {
        end_block(b);
        (void)fprintf(b->out, "%.*s\n", (int)n, line);
    } else if (in == MARGIN && (line[in] == '-' || explanation(line, n) < n)) {
        begin_entry(b, line, n);
    } else {
        paragraph(b, line, n, in);
    }
}

void text_print_help(FILE *out, const char *text, size_t columns)
{
    struct block b = {.out = out, .columns = columns};
    while (*text != '\0') {
        const size_t n = strcspn(text, "\n");
        if (n == 0) {
            end_block(&b);
            (void)fputc('\n', out);
        } else {
            take_line(&b, text, n);
        }
        text += n + (text[n] == '\n');
    }
    end_block(&b);
}

void option_term(const struct option_row *row, char term[OPTION_TERM])
{
    const bool option = row->code != 0;
    char letter[8] = "";
    if (row->letter != 0)
        (void)snprintf(letter, sizeof letter, "-%c%s", row->letter, row->name != NULL ? ", " : "");
    (void)snprintf(term, OPTION_TERM, "%s%s%s%s%s", letter, option && row->name != NULL ? "--" : "",
                   row->name != NULL ? row->name : "", row->value != NULL ? " " : "",
                   row->value != NULL ? row->value : "");
}

/* Where explanations begin: beyond the widest term that is not an exception. */
static size_t explanations_column(const struct option_row rows[])
{
    size_t column = 0;
    char term[OPTION_TERM];
    for (const struct option_row *row = rows; row->what != NULL; row++) {
        option_term(row, term);
        const size_t width = text_width(term);
        column = width <= TERM && width > column ? width : column;
    }
    return column + 2 * MARGIN;
}

static void write_rows(FILE *out, const struct option_row rows[])
{
    const size_t column = explanations_column(rows);
    char term[OPTION_TERM];
    for (const struct option_row *row = rows; row->what != NULL; row++) {
        option_term(row, term);
        if (term[0] == '\0')
            (void)fprintf(out, "%s%s\n", row == rows ? "" : "\n", row->what);
        else if (text_width(term) + 2 * MARGIN <= column)
            (void)fprintf(out, "  %s%*s%s\n", term, (int)(column - MARGIN - text_width(term)), "", row->what);
        else
            (void)fprintf(out, "  %s\n%*s%s\n", term, (int)column, "", row->what);
    }
}

void options_print_help(FILE *out, const char *above, const struct option_row rows[], const char *below, size_t columns)
{
    char *text = NULL;
    size_t size;
    FILE *whole = open_memstream(&text, &size);
    if (whole == NULL)
        return;
    (void)fprintf(whole, "%s\n", above);
    write_rows(whole, rows);
    (void)fprintf(whole, "\n%s", below);
    if (fclose(whole) == 0)
        text_print_help(out, text, columns);
    free(text);
}
