/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "model_yaml_splice.h"

#include <stdlib.h>
#include <string.h>

void splice_replace(struct splicer *s, size_t from, size_t to, const char *text)
{
    s->splices = bf_grow(s->splices, s->n + 1, sizeof *s->splices);
    s->splices[s->n] = (struct splice){.from = from, .to = to, .text = bf_strdup(text), .order = s->n};
    s->n++;
}

void splice_replace3(struct splicer *s, size_t from, size_t to, const char *before, const char *text, const char *after)
{
    struct yaml_text all = {0};
    yaml_text_add(&all, before);
    yaml_text_add(&all, text);
    yaml_text_add(&all, after);
    splice_replace(s, from, to, all.s);
    free(all.s);
}

/* ---- Places in the text ---- */

size_t splice_end_of_line(const struct splicer *s, size_t at)
{
    const char *newline = at < s->n_text ? memchr(s->text + at, '\n', s->n_text - at) : NULL;
    size_t end = newline ? (size_t)(newline - s->text) : s->n_text;
    return end > at && s->text[end - 1] == '\r' ? end - 1 : end;
}

static size_t start_of_next_line(const struct splicer *s, size_t at)
{
    const char *newline = at < s->n_text ? memchr(s->text + at, '\n', s->n_text - at) : NULL;
    return newline ? (size_t)(newline - s->text) + 1 : s->n_text;
}

/* Start of the line of `at` when nothing but the characters of `allowed` stands before it; else fails. */
static size_t start_of_line(struct splicer *s, size_t at, const char *allowed)
{
    while (at > 0 && s->text[at - 1] != '\n') {
        at--;
        if (!strchr(allowed, s->text[at]))
            s->failed = true;
    }
    return at;
}

size_t splice_after_colon(struct splicer *s, const struct yaml_node *key)
{
    const char *colon = memchr(s->text + key->to, ':', s->n_text - key->to);
    if (!colon)
        s->failed = true;
    return colon ? (size_t)(colon - s->text) + 1 : 0;
}

/* "\n" and so many blanks. */
char *splice_line_break(long indent)
{
    char *text = bf_alloc((size_t)indent + 2, 1);
    text[0] = '\n';
    memset(text + 1, ' ', (size_t)indent);
    return text;
}

/* ---- Mappings ---- */

/* index < 0: the key is absent. */
long splice_index(const struct yaml_node *mapping, const char *key)
{
    for (size_t i = 0; i < mapping->n; i++)
        if (strcmp(mapping->key[i]->text, key) == 0)
            return (long)i;
    return -1;
}

/* "key: value" after the last pair of a mapping that has one. */
void splice_append_pair(struct splicer *s, const struct yaml_node *mapping, const char *key, const char *value)
{
    struct yaml_text pair = {0};
    const struct yaml_node *last = mapping->n > 0 ? mapping->value[mapping->n - 1] : NULL;
    if (!last) {
        s->failed = true;
        return;
    }
    if (mapping->flow) {
        yaml_text_add(&pair, ", ");
    } else {
        char *indent = splice_line_break(mapping->key[0]->column);
        yaml_text_add(&pair, indent);
        free(indent);
    }
    yaml_text_add(&pair, key);
    yaml_text_add(&pair, ": ");
    yaml_text_add(&pair, value);
    size_t at = mapping->flow ? last->to : splice_end_of_line(s, last->to);
    splice_replace(s, at, at, pair.s);
    free(pair.s);
}

void splice_delete_pair(struct splicer *s, const struct yaml_node *mapping, size_t i)
{
    if (!mapping->flow)
        splice_replace(s, start_of_line(s, mapping->key[i]->from, " "), start_of_next_line(s, mapping->value[i]->to),
                       "");
    else if (i > 0)
        splice_replace(s, mapping->value[i - 1]->to, mapping->value[i]->to, "");
    else
        splice_replace(s, mapping->key[0]->from, mapping->n > 1 ? mapping->key[1]->from : mapping->value[0]->to, "");
}

/* value "" takes the key out. */
void splice_set_pair(struct splicer *s, const struct yaml_node *mapping, const char *key, const char *value)
{
    long i = splice_index(mapping, key);
    if (i >= 0 && value[0] && mapping->value[i]->from == mapping->value[i]->to)
        splice_replace3(s, mapping->value[i]->from, mapping->value[i]->to, " ", value, "");
    else if (i >= 0 && value[0])
        splice_replace(s, mapping->value[i]->from, mapping->value[i]->to, value);
    else if (i >= 0)
        splice_delete_pair(s, mapping, (size_t)i);
    else if (value[0])
        splice_append_pair(s, mapping, key, value);
}

void splice_delete_item(struct splicer *s, const struct yaml_node *list, size_t i, bool is_first_left)
{
    if (!list->flow)
        splice_replace(s, start_of_line(s, list->value[i]->from, " -"), start_of_next_line(s, list->value[i]->to), "");
    else if (!is_first_left)
        splice_replace(s, list->value[i - 1]->to, list->value[i]->to, "");
    else
        splice_replace(s, list->value[i]->from, i + 1 < list->n ? list->value[i + 1]->from : list->value[i]->to, "");
}

static int by_place(const void *a, const void *b)
{
    const struct splice *p = a, *q = b;
    if (p->from != q->from)
        return p->from < q->from ? -1 : 1;
    return p->order < q->order ? -1 : p->order > q->order;
}

static void add_bytes(struct yaml_text *out, const char *text, size_t n)
{
    char *piece = bf_alloc(n + 1, 1);
    memcpy(piece, text, n);
    yaml_text_add(out, piece);
    free(piece);
}

/* The old text with all edits; line ends of the inserted pieces follow the file's. */
char *splice_apply(struct splicer *s)
{
    struct yaml_text out = {0};
    size_t at = 0, first_line = splice_end_of_line(s, 0);
    bool crlf = first_line < s->n_text && s->text[first_line] == '\r';
    yaml_text_add(&out, "");
    if (s->n > 0)
        qsort(s->splices, s->n, sizeof *s->splices, by_place);
    for (size_t i = 0; i < s->n; i++) {
        const struct splice *splice = &s->splices[i];
        if (splice->from < at || splice->to < splice->from) {
            s->failed = true; /* two edits want the same bytes */
            break;
        }
        add_bytes(&out, s->text + at, splice->from - at);
        for (const char *c = splice->text; *c; c++)
            add_bytes(&out, crlf && *c == '\n' ? "\r\n" : c, crlf && *c == '\n' ? 2 : 1);
        at = splice->to;
    }
    add_bytes(&out, s->text + at, s->n_text - at);
    return out.s;
}

void splice_free(struct splicer *s)
{
    for (size_t i = 0; i < s->n; i++)
        free(s->splices[i].text);
    free(s->splices);
    *s = (struct splicer){0};
}
