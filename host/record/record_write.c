/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writing a record as CSV, row by row. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "record.h"

/* What record_read() would refuse must not be written. */
static enum bf_status check_before_writing(const char *path, const struct record *record, struct bf_error *err)
{
    if (record->n < 2 || !(record->dt_s > 0) || !isfinite(record->t0_s) || !isfinite(record->dt_s))
        return bf_fail(err, BF_NUMERIC, "%s: not written: a record needs two samples and a positive time step", path);
    for (size_t i = 0; i < record->n_columns; i++) {
        const char *name = record->columns[i].name;
        if (name[0] == '\0' || name[strcspn(name, ",\"\n\r\t")] != '\0' || strcmp(name, "time_s") == 0)
            return bf_fail(err, BF_BAD_FILE,
                           "%s: not written: '%s' cannot be the name of a column; use letters, digits and '_'", path,
                           name);
    }
    return BF_OK;
}

static void write_meta(FILE *f, const struct record_meta *meta)
{
    if (strcmp(meta->key, OUTPUTS_KEY) == 0) /* of the file that the record was read from */
        return;
    fprintf(f, "# %s: ", meta->key);
    for (const char *c = meta->value; *c != '\0'; c++)
        putc(*c == '\n' || *c == '\r' ? ' ' : *c, f);
    putc('\n', f);
}

enum bf_status record_writer_open(const char *path, const struct record *head, int digits, struct record_writer *w,
                                  struct bf_error *err)
{
    *w = (struct record_writer){.head = head, .digits = digits > 0 ? digits : 9};
    w->time_digits = w->digits > 12 ? w->digits : 12; /* the step must survive a long record */
    if (check_before_writing(path, head, err) != BF_OK || atomic_open(path, &w->out, err) != BF_OK)
        return err->status;
    outputs_mark(&w->out, "# ", "\n");
    for (size_t i = 0; i < head->n_meta; i++)
        write_meta(w->out.f, &head->meta[i]);
    fprintf(w->out.f, head->over_frequency ? "freq_Hz" : "time_s");
    for (size_t i = 0; i < head->n_columns; i++)
        fprintf(w->out.f, ",%s", head->columns[i].name);
    putc('\n', w->out.f);
    return BF_OK;
}

enum bf_status record_writer_add(struct record_writer *w, size_t n, const double *const x[], struct bf_error *err)
{
    const struct record *head = w->head;
    for (size_t k = 0; k < n && !ferror(w->out.f); k++, w->written++) {
        const double t_s = head->t0_s + (double)w->written * head->dt_s;
        fprintf(w->out.f, "%.*g", w->time_digits, t_s);
        for (size_t i = 0; i < head->n_columns; i++) {
            if (!isfinite(x[i][k])) /* every column has rows: NOLINT(clang-analyzer-core.NullDereference) */
                return bf_fail(err, BF_NUMERIC, "%s: not written: column '%s' is %g at %.9g s", w->out.path,
                               head->columns[i].name, x[i][k], t_s);
            fprintf(w->out.f, ",%.*g", w->digits, x[i][k]);
        }
        putc('\n', w->out.f);
    }
    return BF_OK;
}

enum bf_status record_writer_commit(struct record_writer *w, struct bf_error *err)
{
    return atomic_commit(&w->out, err);
}

void record_writer_abort(struct record_writer *w)
{
    atomic_abort(&w->out);
}

enum bf_status record_write(const char *path, const struct record *record, int digits, struct bf_error *err)
{
    struct record_writer w;
    const double **x = bf_alloc(record->n_columns, sizeof *x);
    for (size_t i = 0; i < record->n_columns; i++)
        x[i] = record->columns[i].x;
    enum bf_status status = record_writer_open(path, record, digits, &w, err);
    if (status == BF_OK)
        status = record_writer_add(&w, record->n, x, err);
    if (status == BF_OK)
        status = record_writer_commit(&w, err);
    record_writer_abort(&w);
    free(x);
    return status;
}
