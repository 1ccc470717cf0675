/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading a record from CSV, line by line: the file may be larger than memory has room for text and numbers both. */
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "record.h"
#include "record_spool.h"

enum { MOST_COLUMNS = 4096, QUOTED = 60 }; /* QUOTED: characters of a bad cell that a message shows */

/* What the commands would take off: "keep" forbids it. */
enum { KEPT = 2 };
static const char *const kept[KEPT] = {"baseline", "input_noise"};

struct reader {
    struct lines in;
    struct record *record;
    FILE *spool;  /* where rows go instead of into memory; NULL: they do not */
    double *row;  /* [1 + columns] time, and the numbers of one line */
    double *time; /* [capacity] */
    struct run {  /* samples on successive lines, for messages */
        size_t sample;
        long line;
    } * runs;
    size_t n_runs, capacity;
    struct number_digits time_digits;
    bool has_header, over_frequency, is_list;
    long excitation_line, free_from_line, window_line, state_line; /* of that metadata */
    long kept_line[KEPT];
};

/* A cell without the blanks and the pair of quotes around it. */
static void trim(const char **s, const char **end)
{
    while (*s < *end && isspace((unsigned char)**s))
        ++*s;
    while (*s < *end && isspace((unsigned char)(*end)[-1]))
        --*end;
    if (*end - *s >= 2 && (**s == '"' || **s == '\'') && (*end)[-1] == **s) {
        ++*s;
        --*end;
    }
}

static const char *cell_end(const char *s, const char *end)
{
    const char *comma = s < end ? memchr(s, ',', (size_t)(end - s)) : NULL;
    return comma != NULL ? comma : end;
}

/* "# key: value", a key is words of letters, digits, '_', '-' and '.'; anything else behind '#' is a comment. */
static void read_comment(struct reader *r, const char *s, const char *end)
{
    while (s < end && (*s == '#' || *s == ' ' || *s == '\t'))
        s++;
    const char *key = s;
    while (s < end && (isalnum((unsigned char)*s) || *s == '_' || (s > key && (*s == '-' || *s == '.' || *s == ' '))))
        s++;
    if (s == key || s == end || *s != ':')
        return;
    char *key_text = strndup(key, (size_t)(s - key));
    const char *value = s + 1;
    trim(&value, &end);
    char *value_text = strndup(value, (size_t)(end - value));
    if (key_text != NULL && value_text != NULL && record_meta(r->record, key_text) == NULL) {
        record_add_meta(r->record, key_text, value_text);
        if (strcmp(key_text, "initial_state") == 0)
            r->state_line = r->in.number;
        if (strcmp(key_text, "excitation") == 0)
            r->excitation_line = r->in.number;
        if (strcmp(key_text, "free_from_s") == 0)
            r->free_from_line = r->in.number;
        if (strcmp(key_text, RECORD_WINDOW) == 0)
            r->window_line = r->in.number;
        for (size_t i = 0; i < KEPT; i++)
            if (strcmp(key_text, kept[i]) == 0)
                r->kept_line[i] = r->in.number;
    }
    free(key_text);
    free(value_text);
}

static enum bf_status fail_first_column(struct reader *r, const char *name, const char *line, const char *line_end,
                                        struct bf_error *err)
{
    const char *path = r->in.path, *end = name + strlen(name);
    double number;
    if (number_parse(name, end, '.', &number))
        return bf_fail_at(err, path, r->in.number,
                          "column 1: a number where the header row should be; put 'time_s,NAME,...' above the numbers");
    for (const char *c = line; c < line_end; c++)
        if (memchr(line, ',', (size_t)(line_end - line)) == NULL && (*c == ';' || *c == '\t'))
            return bf_fail_at(err, path, r->in.number,
                              "columns are separated by %s, not by ','; convert with 'beamfit import %s -o OUT.csv'",
                              *c == ';' ? "';'" : "tabs", path);
    for (const char *c = name; *c != '\0'; c++)
        if ((unsigned char)*c < 0x20)
            return bf_fail_at(err, path, r->in.number,
                              "column 1: not text; give a CSV file, or convert another kind with 'beamfit import'");
    return bf_fail_at(err, path, r->in.number,
                      "column 1 '%.*s': the first column must be 'time_s', in seconds (or 'freq_Hz', for frequency "
                      "responses and lists of frequencies); rename it, or convert the file with 'beamfit import'",
                      QUOTED, name);
}

static enum bf_status read_header(struct reader *r, const char *line, const char *line_end, struct bf_error *err)
{
    struct record *record = r->record;
    const char *s = line;
    r->is_list = frequency_list_begins(line, line_end);
    for (size_t i = 0; s <= line_end && !r->is_list; i++) {
        const char *from = s, *to = cell_end(s, line_end);
        s = to + 1;
        trim(&from, &to);
        char *name = strndup(from, (size_t)(to - from));
        if (name == NULL)
            return bf_fail(err, BF_NUMERIC, "memory is out");
        enum bf_status status = BF_OK;
        r->over_frequency = r->over_frequency || (i == 0 && strcmp(name, "freq_Hz") == 0);
        if (i == 0 && strcmp(name, "time_s") != 0 && !r->over_frequency)
            status = fail_first_column(r, name, line, line_end, err);
        else if (name[0] == '\0')
            status = bf_fail_at(err, r->in.path, r->in.number, "column %zu has no name; name it or remove it", i + 1);
        else if (i > 0 && (strcmp(name, "time_s") == 0 || record_column(record, name) != NULL))
            status =
                bf_fail_at(err, r->in.path, r->in.number,
                           "column %zu '%.*s': the name occurs twice; rename one of the columns", i + 1, QUOTED, name);
        else if (i > MOST_COLUMNS)
            status = bf_fail_at(err, r->in.path, r->in.number, "has more than %d columns; remove some", MOST_COLUMNS);
        else if (i > 0)
            record_add_column(record, name, NULL);
        free(name);
        if (status != BF_OK)
            return status;
    }
    if (record->n_columns == 0 && !r->is_list)
        return bf_fail_at(err, r->in.path, r->in.number,
                          "has no column but time_s; add the measured ones, or convert with 'beamfit import'");
    r->has_header = true;
    return BF_OK;
}

static const char *column_name(const struct reader *r, size_t i)
{
    return i == 0 ? (r->over_frequency ? "freq_Hz" : "time_s") : r->record->columns[i - 1].name;
}

/* Why the cell [s, end) of column i is not a number. */
static enum bf_status fail_cell(const struct reader *r, size_t i, const char *s, const char *end, struct bf_error *err)
{
    static const char *const not_finite[] = {"nan", "+nan", "-nan", "inf", "+inf", "-inf", "infinity", "-infinity"};
    const char *name = column_name(r, i);
    trim(&s, &end);
    int shown = end - s < QUOTED ? (int)(end - s) : QUOTED;
    if (s == end)
        return bf_fail_at(err, r->in.path, r->in.number,
                          "column %zu '%.*s': the cell is empty; every sample needs every column, cut the record here "
                          "or fill the gap",
                          i + 1, QUOTED, name);
    for (size_t k = 0; k < sizeof not_finite / sizeof *not_finite; k++)
        if (strlen(not_finite[k]) == (size_t)(end - s) && strncasecmp(s, not_finite[k], (size_t)(end - s)) == 0)
            return bf_fail_at(err, r->in.path, r->in.number,
                              "column %zu '%.*s': '%.*s' is not a finite number; cut the record here or fill the gap",
                              i + 1, QUOTED, name, shown, s);
    double number;
    if (number_parse(s, end, '.', &number))
        return bf_fail_at(err, r->in.path, r->in.number, "column %zu '%.*s': '%.*s' is too large a number; repair it",
                          i + 1, QUOTED, name, shown, s);
    bool comma = number_parse(s, end, ',', &number);
    return bf_fail_at(
        err, r->in.path, r->in.number, "column %zu '%.*s': '%.*s' is not a number; %s", i + 1, QUOTED, name, shown, s,
        comma ? "write a decimal point, or convert with 'beamfit import'" : "repair it or remove the line");
}

static enum bf_status fail_count(const struct reader *r, const char *line, const char *end, struct bf_error *err)
{
    size_t cells = 1, wanted = r->record->n_columns + 1;
    for (const char *c = line; c < end; c++)
        cells += *c == ',' ? 1 : 0;
    if (cells < wanted)
        return bf_fail_at(err, r->in.path, r->in.number,
                          "column %zu '%.*s' is missing: %zu of %zu cells; complete the line or remove it", cells + 1,
                          QUOTED, column_name(r, cells), cells, wanted);
    return bf_fail_at(err, r->in.path, r->in.number,
                      "column %zu has no name: %zu cells where the header names %zu; remove the extra cells (decimal "
                      "commas: convert with 'beamfit import')",
                      wanted + 1, cells, wanted);
}

static void make_room(struct reader *r)
{
    struct record *record = r->record;
    if (r->row == NULL)
        r->row = bf_alloc(record->n_columns + 1, sizeof *r->row);
    if (record->n < r->capacity || r->spool != NULL)
        return;
    r->capacity = r->capacity > 0 ? 2 * r->capacity : 1024;
    r->time = bf_grow(r->time, r->capacity, sizeof *r->time);
    for (size_t i = 0; i < record->n_columns; i++)
        record->columns[i].x = bf_grow(record->columns[i].x, r->capacity, sizeof *record->columns[i].x);
}

static enum bf_status fail_spool(const struct reader *r, struct bf_error *err)
{
    return bf_fail_at(err, r->in.path, 0, "its samples cannot be kept beside the output: %s", strerror(errno));
}

static enum bf_status take_row(struct reader *r, struct bf_error *err)
{
    struct record *record = r->record;
    const struct run *last = r->n_runs > 0 ? &r->runs[r->n_runs - 1] : NULL;
    if (last == NULL || r->in.number != last->line + (long)(record->n - last->sample)) {
        r->runs = bf_grow(r->runs, r->n_runs + 1, sizeof *r->runs);
        r->runs[r->n_runs++] = (struct run){record->n, r->in.number};
    }
    if (r->spool != NULL) {
        if (fwrite(r->row, sizeof *r->row, record->n_columns + 1, r->spool) != record->n_columns + 1)
            return fail_spool(r, err);
    } else {
        r->time[record->n] = r->row[0];
        for (size_t i = 0; i < record->n_columns; i++)
            record->columns[i].x[record->n] = r->row[i + 1];
    }
    record->n++;
    return BF_OK;
}

/* Where a sample stands. */
static long line_of(const struct reader *r, size_t sample)
{
    size_t k = r->n_runs - 1;
    while (k > 0 && r->runs[k].sample > sample)
        k--;
    return r->runs[k].line + (long)(sample - r->runs[k].sample);
}

static enum bf_status read_sample(struct reader *r, const char *line, const char *end, struct bf_error *err)
{
    struct record *record = r->record;
    const char *s = line;
    make_room(r);
    for (size_t i = 0; i <= record->n_columns; i++) {
        double x;
        if (s > end)
            return fail_count(r, line, end, err);
        const char *after = number_scan(s, end, '.', &x);
        if (after == NULL || (after < end && *after != ',')) { /* blanks, quotes, or no number */
            const char *from = s, *to = cell_end(s, end);
            after = to;
            trim(&from, &to);
            if (!number_parse(from, to, '.', &x))
                return fail_cell(r, i, s, after, err);
        }
        if (!isfinite(x))
            return fail_cell(r, i, s, after, err);
        if (i == 0)
            time_axis_note(&r->time_digits, number_digits(s, after, '.'));
        r->row[i] = x;
        s = after + 1;
    }
    return s <= end ? fail_count(r, line, end, err) : take_row(r, err);
}

static enum bf_status read_lines(struct reader *r, struct bf_error *err)
{
    const char *line;
    size_t n;
    for (;;) {
        if (lines_next(&r->in, &line, &n, err) != BF_OK)
            return err->status;
        if (line == NULL || r->is_list)
            return BF_OK;
        const char *s = line, *end = line + n;
        while (s < end && isspace((unsigned char)*s))
            s++;
        if (s == end)
            continue;
        if (*s == '#') {
            if (r->record->n == 0)
                read_comment(r, s, end);
            continue;
        }
        if ((r->has_header ? read_sample(r, line, end, err) : read_header(r, line, end, err)) != BF_OK)
            return err->status;
    }
}

static enum bf_status check_kept(const struct reader *r, struct bf_error *err)
{
    for (size_t i = 0; i < KEPT; i++) {
        const char *stated = record_meta(r->record, kept[i]);
        if (stated != NULL && strcmp(stated, "keep") != 0)
            return bf_fail_at(err, r->in.path, r->kept_line[i],
                              "'# %s: %.*s' is not known; write keep, or take the line away", kept[i], QUOTED, stated);
    }
    return BF_OK;
}

/* Metadata that changes how a record is used must be understood. */
static enum bf_status check_meta(const struct reader *r, struct bf_error *err)
{
    const struct record *record = r->record;
    const char *excitation = record_meta(record, "excitation"), *from = record_meta(record, "free_from_s");
    if (excitation != NULL && strcmp(excitation, "free_decay") != 0 && strcmp(excitation, "unknown_level") != 0 &&
        strcmp(excitation, "recorded") != 0 && !record_is_periodic(record))
        return bf_fail_at(
            err, r->in.path, r->excitation_line,
            "'# excitation: %.*s' is not known; write free_decay, unknown_level, periodic, " RECORD_RESPONSE
            " or recorded",
            QUOTED, excitation);
    if (record_meta(record, RECORD_WINDOW) != NULL && !(record_window_rate(record) > 0.0 && record_is_periodic(record)))
        return bf_fail_at(err, r->in.path, r->window_line,
                          "'# " RECORD_WINDOW ": %.*s' must be a time constant in seconds, of a frequency response",
                          QUOTED, record_meta(record, RECORD_WINDOW));
    const char *state = record_meta(record, "initial_state");
    if (state != NULL && strcmp(state, "free") != 0 && strcmp(state, "rest") != 0)
        return bf_fail_at(
            err, r->in.path, r->state_line,
            "'# initial_state: %.*s' is not known; write free (the beam moved before the record began) or rest", QUOTED,
            state);
    if (state != NULL && strcmp(state, "rest") == 0 && excitation != NULL && strcmp(excitation, "free_decay") == 0)
        return bf_fail_at(err, r->in.path, r->state_line,
                          "a free decay does not begin at rest: take '# initial_state: rest' away, or the excitation");
    double x, last = record->t0_s + (double)(record->n - 1) * record->dt_s;
    if (from != NULL && !(number_parse(from, from + strlen(from), '.', &x) && x <= last - record->dt_s / 2))
        return bf_fail_at(err, r->in.path, r->free_from_line,
                          "'# free_from_s: %.*s' must be a time in seconds before the last sample (%.9g s)", QUOTED,
                          from, last);
    return check_kept(r, err);
}

/* Lines over frequency become one period of time. */
static enum bf_status take_response(struct reader *r, struct bf_error *err)
{
    struct record period;
    const enum bf_status status = record_from_response(r->record, &period, err);
    if (status)
        return status;
    record_free(r->record);
    *r->record = period;
    return check_meta(r, err);
}

/* A list has another form: its own reader reads it. */
static enum bf_status take_list(struct reader *r, struct bf_error *err)
{
    struct frequency_list list;
    const enum bf_status status = frequency_list_read(r->in.path, &list, err);
    if (status)
        return status;
    record_free(r->record);
    frequency_list_to_record(&list, r->in.path, r->record);
    frequency_list_free(&list);
    return BF_OK;
}

static size_t spooled_times(void *context, size_t first, size_t n, double x[])
{
    return record_spool_numbers(context, 0, first, n, x);
}

static enum bf_status finish(struct reader *r, struct bf_error *err)
{
    if (r->is_list)
        return take_list(r, err);
    struct record *record = r->record;
    if (r->in.number == 0)
        return bf_fail_at(err, r->in.path, 0, "is empty; a record has a header row 'time_s,NAME,...' and numbers");
    if (!r->has_header)
        return bf_fail_at(err, r->in.path, r->in.number, "has no header row; put 'time_s,NAME,...' above the numbers");
    if (record->n < 2)
        return bf_fail_at(err, r->in.path, r->in.number, "has %s; a record needs at least two, at uniform times",
                          record->n == 0 ? "no samples" : "one sample");
    size_t bad;
    char why[256];
    if (r->spool != NULL && fflush(r->spool) != 0)
        return fail_spool(r, err);
    struct record_spool spool = {.record = *record, .f = r->spool};
    struct times times = {.x = r->time, .read = r->spool != NULL ? spooled_times : NULL, .context = &spool};
    if (!times_fit(&times, record->n, r->time_digits, &record->t0_s, &record->dt_s, &bad, why))
        return bf_fail_at(err, r->in.path, line_of(r, bad),
                          "column 1 '%s': %s; cut the record here, or 'beamfit import %s -o OUT.csv' with --rate HZ "
                          "where the samples are steady "
                          "and the times are not, with --resample HZ where the times are right",
                          column_name(r, 0), why, r->in.path);
    if (r->over_frequency && r->spool != NULL && record_spool_rows(&spool, record, err) != BF_OK)
        return err->status;
    for (size_t i = 0; i < record->n_columns && r->spool == NULL; i++)
        record->columns[i].x = bf_grow(record->columns[i].x, record->n, sizeof(double));
    hash_end(&r->in.hash, record->sha256);
    return r->over_frequency ? take_response(r, err) : check_meta(r, err);
}

/* *in_file: the samples are in the spool. */
static enum bf_status read_record(const char *path, FILE *spool, struct record *out, bool *in_file,
                                  struct bf_error *err)
{
    struct reader r = {.record = out, .spool = spool};
    memset(out, 0, sizeof *out);
    if (lines_open(path, &r.in, err) != BF_OK)
        return err->status;
    out->path = bf_strdup(path);
    enum bf_status status = read_lines(&r, err);
    if (status == BF_OK)
        status = finish(&r, err);
    lines_close(&r.in);
    *in_file = spool != NULL && !r.over_frequency && !r.is_list;
    free(r.time), free(r.row), free(r.runs);
    if (status != BF_OK)
        record_free(out);
    return status;
}

enum bf_status record_read(const char *path, struct record *out, struct bf_error *err)
{
    bool in_file;
    return read_record(path, NULL, out, &in_file, err);
}

enum bf_status record_spool_read(const char *path, const char *beside, struct record_spool *out, struct bf_error *err)
{
    *out = (struct record_spool){.f = record_spool_open(beside)};
    enum bf_status status = read_record(path, out->f, &out->record, &out->in_file, err);
    const bool no_room = status != BF_OK && out->f != NULL && ferror(out->f);
    if (status != BF_OK)
        record_spool_close(out);
    if (no_room)
        status = read_record(path, NULL, &out->record, &out->in_file, err);
    return status;
}
