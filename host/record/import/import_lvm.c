/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * LabVIEW measurement files (LVM, version 2): a file header, then segments of a header and rows of numbers. Header cells
 * stand in the column of their channel. Segments that continue one another in time are joined.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "import_channel.h"
#include "import_format.h"
#include "import_units.h"
#include "ground/ground.h"
#include "record/record.h"

enum { MOST_COLUMNS = 1024, SHOWN = 40 };

struct cell {
    const char *s, *end;
};

/* What a column of a segment is. */
struct column {
    bool is_channel, is_x;
    struct cell name, unit, dimension;
    double x0, dx;   /* dx 0: not stated */
    size_t x_column; /* of a channel: the column of its X values, MOST_COLUMNS none */
    double *x;       /* owned until it becomes a channel */
    size_t n;        /* up to the last value */
    bool steady;     /* an X column: every value is x0 + k dx as printed */
    struct number_digits digits;
};

struct segment {
    long number;
    size_t n_columns, n_rows, capacity;
    struct column column[MOST_COLUMNS];
    long *lines;
};

struct reader {
    struct import_file *file;
    struct lines in;
    char separator, point;
    bool has_x;
    struct segment *segment;
    size_t last_first, last_n; /* channels of the segment before */
};

static struct cell next_cell(struct cell *line, char separator)
{
    const char *at = line->s < line->end ? memchr(line->s, separator, (size_t)(line->end - line->s)) : NULL;
    struct cell out = {line->s, at != NULL ? at : line->end};
    line->s = at != NULL ? at + 1 : line->end;
    return out;
}

static bool is(struct cell c, const char *text)
{
    return (size_t)(c.end - c.s) == strlen(text) && strncasecmp(c.s, text, (size_t)(c.end - c.s)) == 0;
}

static bool is_blank(struct cell line)
{
    for (; line.s < line.end; line.s++)
        if (*line.s != ' ' && *line.s != '\t' && *line.s != ',')
            return false;
    return true;
}

/* The next line; false at the end of the file. */
static enum bf_status take_line(struct reader *r, struct cell *line, bool *more, struct bf_error *err)
{
    const char *text;
    size_t n;
    if (lines_next(&r->in, &text, &n, err) != BF_OK)
        return err->status;
    *more = text != NULL;
    *line = (struct cell){text, text != NULL ? text + n : NULL};
    return BF_OK;
}

static enum bf_status fail_cut_off(const struct reader *r, struct bf_error *err)
{
    return bf_fail_at(err, r->file->path, r->in.number, "ends within a header; the file is cut off, export it again");
}

static enum bf_status read_file_header(struct reader *r, struct bf_error *err)
{
    struct cell line = {NULL, NULL};
    bool more = false;
    for (bool first = true;; first = false) {
        if (take_line(r, &line, &more, err) != BF_OK)
            return err->status;
        if (!more)
            return fail_cut_off(r, err);
        if (first && (line.end - line.s < 19 || memcmp(line.s, "LabVIEW Measurement", 19) != 0))
            return bf_fail_at(err, r->file->path, 1,
                              "does not begin with 'LabVIEW Measurement'; if it is a plain table, "
                              "give --format csv");
        if (first && memchr(line.s, ',', (size_t)(line.end - line.s)) != NULL)
            r->separator = ',';
        char mark = memchr(line.s, '\t', (size_t)(line.end - line.s)) != NULL ? '\t' : ',';
        struct cell key = next_cell(&line, mark), value = next_cell(&line, mark);
        if (is(key, "***End_of_Header***"))
            return BF_OK;
        if (is(key, "Separator"))
            r->separator = is(value, "Comma") ? ',' : '\t';
        else if (is(key, "Decimal_Separator"))
            r->point = value.s < value.end && *value.s == ',' ? ',' : '.';
        else if (is(key, "X_Columns") && is(value, "No"))
            r->has_x = false;
        else if (is(key, "Date") || is(key, "Time") || is(key, "Operator") || is(key, "Description"))
            import_add_meta(r->file,
                            is(key, "Date")       ? "date"
                            : is(key, "Time")     ? "clock"
                            : is(key, "Operator") ? "operator"
                                                  : "description",
                            value.s, (size_t)(value.end - value.s));
    }
}

/* One row of a segment's header: its cells go to the columns they stand in. */
static void read_segment_row(struct reader *r, struct cell key, struct cell rest)
{
    struct segment *s = r->segment;
    for (size_t i = 1; i < MOST_COLUMNS && rest.s < rest.end; i++) {
        struct cell value = next_cell(&rest, r->separator);
        double x;
        if (is(key, "Y_Unit_Label"))
            s->column[i].unit = value;
        else if (is(key, "X_Dimension"))
            s->column[i].dimension = value;
        else if (is(key, "X0") && number_parse(value.s, value.end, r->point, &x))
            s->column[i].x0 = x;
        else if (is(key, "Delta_X") && number_parse(value.s, value.end, r->point, &x) && x > 0 && isfinite(x))
            s->column[i].dx = time_axis_round_step(x, number_digits(value.s, value.end, r->point).significant);
    }
}

/* "X_Value  Force  X_Value  Accel  Comment" */
static enum bf_status read_names(struct reader *r, struct cell line, struct bf_error *err)
{
    struct segment *s = r->segment;
    size_t x_column = MOST_COLUMNS;
    while (line.s < line.end) {
        if (s->n_columns == MOST_COLUMNS)
            return bf_fail_at(err, r->file->path, r->in.number, "has more than %d columns; export fewer channels",
                              MOST_COLUMNS);
        size_t i = s->n_columns++;
        struct column *c = &s->column[i];
        c->name = next_cell(&line, r->separator);
        c->is_x = is(c->name, "X_Value");
        c->is_channel = !c->is_x && !(line.s == line.end && is(c->name, "Comment"));
        if (c->is_x && r->has_x)
            x_column = i;
        c->x_column = x_column;
        c->steady = true;
    }
    for (size_t i = 0; i + 1 < s->n_columns; i++) /* X values have the axis of the channel behind them */
        if (s->column[i].is_x) {
            s->column[i].x0 = s->column[i + 1].x0;
            s->column[i].dx = s->column[i + 1].dx;
        }
    return BF_OK;
}

static enum bf_status read_segment_header(struct reader *r, struct cell line, struct bf_error *err)
{
    bool more = true;
    for (;;) {
        struct cell key = next_cell(&line, r->separator);
        if (is(key, "***End_of_Header***"))
            break;
        read_segment_row(r, key, line);
        if (take_line(r, &line, &more, err) != BF_OK)
            return err->status;
        if (!more)
            return fail_cut_off(r, err);
    }
    if (take_line(r, &line, &more, err) != BF_OK)
        return err->status;
    return more ? read_names(r, line, err) : fail_cut_off(r, err);
}

static void make_room(struct segment *s)
{
    if (s->n_rows < s->capacity)
        return;
    s->capacity = s->capacity > 0 ? 2 * s->capacity : 1024;
    s->lines = bf_grow(s->lines, s->capacity, sizeof *s->lines);
    for (size_t i = 0; i < s->n_columns; i++)
        if (s->column[i].is_channel || s->column[i].is_x)
            s->column[i].x = bf_grow(s->column[i].x, s->capacity, sizeof(double));
}

static enum bf_status read_row(struct reader *r, struct cell line, struct bf_error *err)
{
    struct segment *s = r->segment;
    struct cell rest = line;
    make_room(s);
    for (size_t i = 0; i < s->n_columns; i++) {
        struct column *c = &s->column[i];
        struct cell cell = next_cell(&rest, r->separator);
        double x = NAN;
        if (!c->is_channel && !c->is_x)
            continue;
        if (!number_parse(cell.s, cell.end, r->point, &x) && !is_blank(cell) && !is(cell, "NaN"))
            return bf_fail_at(err, r->file->path, r->in.number,
                              "column %zu: '%.*s' is not a number; repair it or remove "
                              "the line",
                              i + 1, cell.end - cell.s < SHOWN ? (int)(cell.end - cell.s) : SHOWN, cell.s);
        c->x[s->n_rows] = x;
        if (isnan(x))
            continue;
        c->n = s->n_rows + 1;
        if (!c->is_x)
            continue;
        struct number_digits digits = number_digits(cell.s, cell.end, r->point);
        time_axis_note(&c->digits, digits);
        double printed = pow(10, -digits.decimals), stated = c->x0 + (double)s->n_rows * c->dx;
        c->steady &= c->dx > 0 && printed <= 0.5 * c->dx && fabs(x - stated) <= 0.51 * printed + 1e-6 * c->dx;
    }
    s->lines[s->n_rows++] = r->in.number;
    return BF_OK;
}

/* Channels of the segment continue those of the one before it: same names and steps, start where those end. */
static bool continues(const struct reader *r, size_t first, size_t n)
{
    const struct import_channel *channels = r->file->channels;
    if (n == 0 || n != r->last_n)
        return false;
    for (size_t i = 0; i < n; i++) {
        const struct import_channel *before = &channels[r->last_first + i], *now = &channels[first + i];
        size_t length = strlen(before->name);
        double end_s = before->t0_s + (double)before->n * before->dt_s;
        if (before->dt_s <= 0 || before->dt_s != now->dt_s || fabs(now->t0_s - end_s) > 0.01 * now->dt_s ||
            strncmp(before->name, now->name, length) != 0 || strchr("_", now->name[length]) == NULL ||
            strcmp(before->unit, now->unit) != 0) /* a repeated name has a number behind '_' */
            return false;
    }
    return true;
}

static void join(struct reader *r, size_t first, size_t n)
{
    struct import_file *file = r->file;
    for (size_t i = 0; i < n; i++) {
        struct import_channel *before = &file->channels[r->last_first + i], *now = &file->channels[first + i];
        before->x = bf_grow(before->x, before->n + now->n, sizeof(double));
        if (now->n > 0)
            memcpy(before->x + before->n, now->x, now->n * sizeof(double));
        before->n += now->n;
        free(now->name);
        free(now->unit);
        free(now->about);
        free(now->x);
    }
    file->n_channels = first;
    file->lines = bf_grow(file->lines, file->n_lines + r->segment->n_rows, sizeof *file->lines);
    if (r->segment->n_rows > 0)
        memcpy(file->lines + file->n_lines, r->segment->lines, r->segment->n_rows * sizeof *file->lines);
    file->n_lines += r->segment->n_rows;
}

static void add_channel(struct reader *r, size_t i, const size_t axis_of[])
{
    struct column *c = &r->segment->column[i];
    const char *unit;
    size_t unit_n, name_n = import_split_unit(c->name.s, (size_t)(c->name.end - c->name.s), &unit, &unit_n);
    struct import_channel *ch = import_add(r->file, c->name.s, name_n, c->x, c->n);
    c->x = NULL;
    if (c->unit.s != c->unit.end) {
        unit = c->unit.s;
        unit_n = (size_t)(c->unit.end - c->unit.s);
    }
    import_set_text(&ch->unit, unit, unit_n);
    if (r->segment->number > 1) {
        char about[32];
        int n = snprintf(about, sizeof about, "segment %ld", r->segment->number);
        import_set_text(&ch->about, about, (size_t)n);
    }
    if (c->dimension.s != c->dimension.end && !is(c->dimension, "Time"))
        ch->unusable = "its X values are not time";
    if (c->x_column < MOST_COLUMNS && axis_of[c->x_column] != IMPORT_NO_AXIS) {
        ch->axis = axis_of[c->x_column];
    } else if (c->dx > 0) {
        ch->t0_s = c->x0;
        ch->dt_s = c->dx;
    }
}

/* The columns of a segment that was read become channels. X values that only repeat X0 and Delta_X do not. */
static void add_segment(struct reader *r)
{
    struct segment *s = r->segment;
    size_t axis_of[MOST_COLUMNS], first;
    for (size_t i = 0; i < s->n_columns; i++) {
        struct column *c = &s->column[i];
        axis_of[i] = IMPORT_NO_AXIS;
        if (!c->is_x || !r->has_x || (c->steady && c->n > 0))
            continue;
        axis_of[i] = r->file->n_channels;
        struct import_channel *t = import_add(r->file, "X_Value", 7, c->x, c->n);
        import_set_text(&t->unit, "s", 1);
        t->digits = c->digits;
        c->x = NULL;
    }
    first = r->file->n_channels;
    for (size_t i = 0; i < s->n_columns; i++)
        if (s->column[i].is_channel && s->column[i].name.s != s->column[i].name.end)
            add_channel(r, i, axis_of);
    size_t n = r->file->n_channels - first;
    if (s->number > 1 && continues(r, first, n)) {
        join(r, first, n);
        return;
    }
    free(r->file->lines);
    r->file->lines = s->number == 1 ? s->lines : NULL; /* lines are of use when there is one axis only */
    r->file->n_lines = s->number == 1 ? s->n_rows : 0;
    if (s->number == 1)
        s->lines = NULL;
    r->last_first = first;
    r->last_n = n;
}

/* A segment from the first line of its header to the blank line or header behind its rows. */
static enum bf_status read_segment(struct reader *r, struct cell *line, bool *more, struct bf_error *err)
{
    if (read_segment_header(r, *line, err) != BF_OK)
        return err->status;
    for (;;) {
        if (take_line(r, line, more, err) != BF_OK)
            return err->status;
        struct cell rest = *line;
        if (!*more || is_blank(*line) || is(next_cell(&rest, r->separator), "Channels"))
            return BF_OK;
        if (read_row(r, *line, err) != BF_OK)
            return err->status;
    }
}

static void free_segment(struct segment *s)
{
    for (size_t i = 0; i < s->n_columns; i++)
        free(s->column[i].x);
    free(s->lines);
    free(s);
}

static enum bf_status read_lvm(struct import_file *file, const char *data, size_t n, const struct import_reading *how,
                               struct bf_error *err)
{
    struct reader r = {.file = file, .separator = '\t', .point = '.', .has_x = true};
    struct cell line = {NULL, NULL};
    bool more = true;
    lines_from_memory(file->path, data, n, &r.in);
    if (read_file_header(&r, err) != BF_OK)
        return err->status;
    if (how->point != '\0')
        r.point = how->point;
    for (long number = 1;; number++) {
        while (more && is_blank(line))
            if (take_line(&r, &line, &more, err) != BF_OK)
                return err->status;
        if (!more)
            return BF_OK;
        r.segment = bf_alloc(1, sizeof *r.segment);
        r.segment->number = number;
        enum bf_status status = read_segment(&r, &line, &more, err);
        if (status == BF_OK)
            add_segment(&r);
        free_segment(r.segment);
        if (status != BF_OK)
            return status;
    }
}

static enum import_match recognise(const char *path, const char *data, size_t n)
{
    (void)path;
    return import_starts_with(data, n, "LabVIEW Measurement", 19) ? IMPORT_MATCH_CONTENT : IMPORT_NO_MATCH;
}

const struct import_format import_format_lvm = {
    .name = "lvm", .title = "LabVIEW", .recognise = recognise, .read = read_lvm};
