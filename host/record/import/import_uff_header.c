/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lines, fields and numbers of the Universal File Format, and the header of a dataset 58. */
#include <math.h>
#include <string.h>
#include <strings.h>
#include "import_uff_header.h"
#include "ground/ground.h"

bool uff_take_line(struct uff_cursor *c, struct uff_line *out)
{
    if (c->s >= c->end)
        return false;
    const char *newline = memchr(c->s, '\n', (size_t)(c->end - c->s));
    out->s = c->s;
    out->end = newline != NULL ? newline : c->end;
    c->s = newline != NULL ? newline + 1 : c->end;
    c->line++;
    if (out->end > out->s && out->end[-1] == '\r')
        out->end--;
    return true;
}

struct uff_line uff_field(struct uff_line l, size_t from, size_t width)
{
    size_t n = (size_t)(l.end - l.s);
    struct uff_line out = {l.s + (from < n ? from : n), l.s + (from + width < n ? from + width : n)};
    while (out.s < out.end && *out.s == ' ')
        out.s++;
    while (out.s < out.end && out.end[-1] == ' ')
        out.end--;
    return out;
}

bool uff_number(const char *s, const char *end, double *x)
{
    char text[64];
    size_t n = 0;
    if (number_parse(s, end, '.', x))
        return true;
    for (; s < end && n < sizeof text - 2; s++) {
        bool digit_before = n > 0 && (text[n - 1] == '.' || (text[n - 1] >= '0' && text[n - 1] <= '9'));
        if ((*s == '+' || *s == '-') && digit_before)
            text[n++] = 'e';
        text[n++] = *s == 'd' || *s == 'D' ? 'e' : *s;
    }
    return s == end && number_parse(text, text + n, '.', x);
}

bool uff_take_word(struct uff_line *l, struct uff_line *out)
{
    while (l->s < l->end && (*l->s == ' ' || *l->s == '\t'))
        l->s++;
    out->s = l->s;
    while (l->s < l->end && *l->s != ' ' && *l->s != '\t')
        l->s++;
    out->end = l->s;
    return out->end > out->s;
}

bool uff_take_integer(struct uff_line *l, long *out)
{
    struct uff_line word;
    double x;
    if (!uff_take_word(l, &word) || !number_parse(word.s, word.end, '.', &x) || x != floor(x) || fabs(x) > 2e9)
        return false;
    *out = (long)x;
    return true;
}

bool uff_is_delimiter(struct uff_line l)
{
    l = uff_field(l, 0, UFF_WIDTH);
    return l.end - l.s == 2 && memcmp(l.s, "-1", 2) == 0;
}

static void read_axis_text(struct uff_line l, struct uff_axis_text *out)
{
    long kind;
    struct uff_line numbers = l;
    out->kind = uff_take_integer(&numbers, &kind) ? (int)kind : 0;
    out->label = uff_field(l, 26, 20);
    out->unit = uff_field(l, 47, 20);
}

bool uff_is_none(struct uff_line l)
{
    return l.s == l.end || (l.end - l.s == 4 && strncasecmp(l.s, "NONE", 4) == 0);
}

/* Record 7: data type, number of values, spacing, first abscissa, step. */
static enum bf_status read_shape(const struct uff_cursor *c, struct uff_line l, struct uff_header *h,
                                 struct bf_error *err)
{
    long type, n, even;
    struct uff_line x0, dx;
    if (!uff_take_integer(&l, &type) || !uff_take_integer(&l, &n) || !uff_take_integer(&l, &even))
        return bf_fail_at(err, c->path, c->line,
                          "dataset 58, record 7: no three whole numbers (data type, values, spacing); export again");
    if (type != 2 && type != 4 && type != 5 && type != 6)
        return bf_fail_at(err, c->path, c->line,
                          "dataset 58, record 7: data type %ld is none of 2, 4, 5, 6; export again", type);
    if (n < 1 || (size_t)n > (size_t)(c->end - c->s))
        return bf_fail_at(err, c->path, c->line,
                          "dataset 58, record 7: %ld values, but only %td bytes follow; the file is "
                          "cut off or damaged",
                          n, c->end - c->s);
    h->data_type = (int)type;
    h->n = (unsigned long)n;
    h->even = even != 0;
    if (h->even && !(uff_take_word(&l, &x0) && uff_take_word(&l, &dx) && uff_number(x0.s, x0.end, &h->x0) &&
                     uff_number(dx.s, dx.end, &h->dx) && isfinite(h->x0) && isfinite(h->dx)))
        return bf_fail_at(err, c->path, c->line, "dataset 58, record 7: no abscissa start and step; export again");
    return BF_OK;
}

enum bf_status uff_read_header(struct uff_cursor *c, struct uff_line first, struct uff_header *h, struct bf_error *err)
{
    struct uff_line l[UFF_HEADER_LINES];
    *h = (struct uff_header){.line = c->line};
    struct uff_line word;
    uff_take_word(&first, &word);
    h->binary = word.end[-1] == 'b' || word.end[-1] == 'B';
    if (!h->binary && uff_take_word(&first, &word) && word.end - word.s == 1 && (*word.s == 'b' || *word.s == 'B'))
        h->binary = true; /* "58 b" */
    if (h->binary) {
        long order, format, lines, bytes;
        if (!uff_take_integer(&first, &order) || !uff_take_integer(&first, &format) ||
            !uff_take_integer(&first, &lines) || !uff_take_integer(&first, &bytes))
            return bf_fail_at(err, c->path, c->line,
                              "dataset 58b: no byte order, float format and sizes; export again");
        if ((order != 1 && order != 2) || format != 2 || lines != UFF_HEADER_LINES)
            return bf_fail_at(
                err, c->path, c->line,
                "dataset 58b: byte order %ld, float format %ld, %ld lines of text; only IEEE floats (2), order "
                "1 or 2 and 11 lines can be read; export as text",
                order, format, lines);
        h->big_endian = order == 2;
        h->bytes = bytes > 0 ? (unsigned long)bytes : 0;
    }
    for (int i = 0; i < UFF_HEADER_LINES; i++) {
        if (!uff_take_line(c, &l[i]) || uff_is_delimiter(l[i]))
            return bf_fail_at(err, c->path, c->line,
                              "dataset 58: ends within its header; the file is cut off or damaged");
        if (i == 6 && read_shape(c, l[i], h, err) != BF_OK)
            return err->status;
    }
    h->title = uff_field(l[0], 0, UFF_WIDTH);
    struct uff_line function = l[5], node = uff_field(l[5], 41, 10), direction = uff_field(l[5], 51, 4);
    long number;
    h->function = uff_take_integer(&function, &number) ? (int)number : 0;
    h->response_node = uff_take_integer(&node, &number) ? (int)number : 0;
    h->response_direction = uff_take_integer(&direction, &number) ? (int)number : 0;
    read_axis_text(l[7], &h->abscissa);
    read_axis_text(l[8], &h->ordinate);
    return BF_OK;
}
