/* SPDX-License-Identifier: GPL-3.0-or-later */
/* answer.c — an answer completed, and printed in the form that was asked for. */
#include "answer_forms.h"
#include "show.h"

#include <pthread.h>
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

void answer_next_words(struct json *root, const char *const words[])
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        return;
    for (size_t i = 0; words[i] != NULL; i++) {
        (void)fputs(i > 0 ? " " : "", out);
        put_word(out, words[i]);
    }
    if (fclose(out) == 0)
        json_push_text(member_list(root, "next"), text);
    free(text);
}

void answer_next(struct json *root, ...)
{
    const char *words[32];
    size_t n = 0;
    va_list all;
    va_start(all, root);
    while (n < sizeof words / sizeof *words - 1 && (words[n] = va_arg(all, const char *)) != NULL)
        n++;
    va_end(all);
    words[n] = NULL;
    answer_next_words(root, words);
}

/* The first warnings of this run; kept to the end of the program. */
enum { MOST_WARNINGS = 64 };
static struct {
    pthread_mutex_t lock;
    size_t n;
    char *text[MOST_WARNINGS];
} warned = {.lock = PTHREAD_MUTEX_INITIALIZER};

void answer_take_warning(void *context, const char *text)
{
    (void)context;
    (void)pthread_mutex_lock(&warned.lock);
    if (warned.n < MOST_WARNINGS)
        warned.text[warned.n++] = bf_strdup(text);
    (void)pthread_mutex_unlock(&warned.lock);
}

static void complete(struct json *root)
{
    struct json *warnings = member_list(root, "warnings");
    for (size_t i = 0; i < warned.n; i++)
        json_push_text(warnings, warned.text[i]);
    (void)member_list(root, "next");
}

enum bf_status answer_print_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err)
{
    if (options_format() != OPTIONS_TEXT) /* whose warnings are on standard error */
        complete(root);
    switch (options_format()) {
    case OPTIONS_TEXT:
        answer_print_text(stdout, root, fields);
        break;
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

enum bf_status answer_print_line_and_free(struct json *root, const struct answer_field fields[], struct bf_error *err)
{
    if (options_format() == OPTIONS_TEXT) {
        answer_print_text(stdout, root, fields);
        json_discard(root);
        return fflush(stdout) == 0 ? BF_OK : BF_BAD_FILE;
    }
    complete(root);
    return json_print_line_and_free(root, stdout, err);
}
