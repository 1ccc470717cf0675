/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer.c — an answer completed, and printed in the form that was asked for. */
#include "answer_forms.h"
#include "show.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- Names that every answer has ---- */

static struct json *member_list(struct json *root, const char *name)
{
    struct json *list = json_member(root, name);
    return list != NULL ? list : json_put(root, name, json_new_array());
}

/* The word as a shell reads it back. */
static void put_word(FILE *out, const char *word)
{
    const bool plain = word[0] != '\0' && word[strspn(word, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                                            "0123456789_-./=,:@+%")] == '\0';
    if (plain) {
        (void)fputs(word, out);
        return;
    }
    (void)fputc('\'', out);
    for (; *word != '\0'; word++)
        (void)fputs(*word == '\'' ? "'\\''" : (const char[]){*word, '\0'}, out);
    (void)fputc('\'', out);
}

void answer_next(struct json *root, ...)
{
    char *text = NULL;
    size_t size;
    va_list words;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return;
    va_start(words, root);
    for (const char *word, *between = ""; (word = va_arg(words, const char *)) != NULL; between = " ") {
        (void)fputs(between, out);
        put_word(out, word);
    }
    va_end(words);
    if (fclose(out) == 0)
        json_push_text(member_list(root, "next"), text);
    free(text);
}

static void complete(struct json *root)
{
    struct json *warnings = member_list(root, "warnings");
    for (size_t i = 0; bf_warning(i) != NULL; i++)
        json_push_text(warnings, bf_warning(i));
    (void)member_list(root, "next");
}

enum bf_status answer_print_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err)
{
    complete(root);
    switch (options_format()) {
    case OPTIONS_MARKDOWN:
        answer_markdown(stdout, root, fields);
        break;
    case OPTIONS_HTML:
        answer_html(stdout, root, fields);
        break;
    default:
        return json_print_and_free(root, stdout, err);
    }
    json_discard(root);
    return BF_OK; /* main() looks at the state of standard output */
}

enum bf_status answer_print_line_and_free(struct json *root, struct bf_error *err)
{
    complete(root);
    return json_print_line_and_free(root, stdout, err);
}
