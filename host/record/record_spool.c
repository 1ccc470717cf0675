/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Samples of a record in a file: rows of doubles, time first. */
#include "record_spool.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROWS = 1024 }; /* that are read at a time */

FILE *record_spool_open(const char *beside)
{
    static const char name[] = ".beamfit-samples-XXXXXX";
    struct stat target;
    const bool device = stat(beside, &target) == 0 && !S_ISREG(target.st_mode);
    const size_t directory = device ? 0 : (size_t)(text_base_name(beside) - beside);
    char *path = bf_alloc(directory + sizeof name, 1);
    memcpy(path, beside, directory);
    memcpy(path + directory, name, sizeof name);
    const int fd = mkstemp(path);
    if (fd >= 0)
        (void)unlink(path);
    free(path);
    return fd >= 0 ? fdopen(fd, "w+b") : NULL;
}

size_t record_spool_numbers(const struct record_spool *spool, size_t cell, size_t first, size_t n, double x[])
{
    const size_t width = spool->record.n_columns + 1, most = spool->record.n > first ? spool->record.n - first : 0;
    double *rows = bf_alloc(ROWS * width, sizeof *rows);
    size_t there = 0;
    n = n < most ? n : most;
    bool fine = fseeko(spool->f, (off_t)(first * width * sizeof *rows), SEEK_SET) == 0;
    while (there < n && fine) {
        const size_t wanted = n - there < ROWS ? n - there : ROWS;
        fine = fread(rows, width * sizeof *rows, wanted, spool->f) == wanted;
        for (size_t k = 0; k < wanted && fine; k++)
            x[there + k] = rows[k * width + cell];
        there += fine ? wanted : 0;
    }
    free(rows);
    return there;
}

void record_spool_take(const struct record_spool *spool, size_t column, size_t first, size_t n, double x[])
{
    const size_t there = record_spool_numbers(spool, column + 1, first, n, x);
    memset(x + there, 0, (n - there) * sizeof *x);
}

void record_spool_column(const struct record_spool *spool, const char *name, size_t first, size_t n, double x[])
{
    size_t i = 0;
    while (i < spool->record.n_columns && strcmp(spool->record.columns[i].name, name) != 0)
        i++;
    if (i < spool->record.n_columns)
        record_spool_take(spool, i, first, n, x);
    else
        memset(x, 0, n * sizeof *x);
}

bool record_spool_failed(const struct record_spool *spool)
{
    return spool->f != NULL && ferror(spool->f) != 0;
}

enum bf_status record_spool_rows(const struct record_spool *spool, struct record *record, struct bf_error *err)
{
    for (size_t i = 0; i < record->n_columns; i++) {
        record->columns[i].x = bf_grow(record->columns[i].x, record->n, sizeof(double));
        if (record_spool_numbers(spool, i + 1, 0, record->n, record->columns[i].x) != record->n)
            return bf_fail_at(err, record->path, 0, "its samples cannot be read again: %s", strerror(errno));
    }
    return BF_OK;
}

enum bf_status record_spool_head(const struct record_spool *spool, size_t n, struct record *out, struct bf_error *err)
{
    const struct record *from = &spool->record;
    *out = (struct record){
        .kind = from->kind, .path = bf_strdup(from->path), .n = n, .t0_s = from->t0_s, .dt_s = from->dt_s};
    memcpy(out->sha256, from->sha256, sizeof out->sha256);
    for (size_t i = 0; i < from->n_columns; i++)
        record_add_column(out, from->columns[i].name, NULL);
    for (size_t i = 0; i < from->n_meta; i++)
        record_add_meta(out, from->meta[i].key, from->meta[i].value);
    return record_spool_rows(spool, out, err);
}

enum bf_status record_spool_load(struct record_spool *spool, struct bf_error *err)
{
    if (spool->in_file && record_spool_rows(spool, &spool->record, err) != BF_OK)
        return err->status;
    spool->in_file = false;
    return BF_OK;
}

void record_spool_close(struct record_spool *spool)
{
    record_free(&spool->record);
    if (spool->f != NULL)
        (void)fclose(spool->f);
    *spool = (struct record_spool){.f = NULL};
}
