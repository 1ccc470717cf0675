/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "long_records.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "noise/noise.h"

enum { LEAST_BYTES = 8 * COMPARE_HEAD }; /* of a file that may hold two heads: four characters a sample at least */

static bool may_be_long(const char *path)
{
    struct stat file;
    return stat(path, &file) == 0 && (!S_ISREG(file.st_mode) || file.st_size >= LEAST_BYTES);
}

static void read_column(void *context, const char *column, size_t first, size_t n, double x[])
{
    record_spool_column(context, column, first, n, x);
}

/* A file for the samples, on a disk: /tmp may be memory. */
static enum bf_status read_spool(const char *path, struct record_spool *out, struct bf_error *err)
{
    char beside[4096];
    const char *directory = getenv("TMPDIR");
    (void)snprintf(beside, sizeof beside, "%s/.", directory != NULL && directory[0] != '\0' ? directory : "/var/tmp");
    return record_spool_read(path, beside, out, err);
}

/* The head into *out, and the sums; where these cannot be had, nothing. */
static enum bf_status sum_up(const struct long_records *list, struct record_spool *spool, struct record *out,
                             struct long_record **sums, struct bf_error *err)
{
    const struct long_reader reader = {.read = read_column, .context = spool};
    bool in_motion = false; /* then its state has to be solved for */
    enum bf_status status = record_spool_head(spool, COMPARE_HEAD, out, err);
    if (status == BF_OK)
        status = initial_state_find(list->model, out, &in_motion, err);
    if (status == BF_OK && !in_motion)
        status = long_record_sum(list->model, out, spool->record.n, list->options, &reader, sums, err);
    if (status == BF_OK && *sums != NULL && record_spool_failed(spool))
        status = bf_fail_at(err, out->path, 0, "its samples cannot be read again from below TMPDIR");
    if (status != BF_OK || *sums == NULL)
        record_free(out);
    return status;
}

static enum bf_status take_whole(struct record_spool *spool, struct record *out, struct bf_error *err)
{
    if (record_spool_load(spool, err) != BF_OK)
        return err->status;
    *out = spool->record;
    spool->record = (struct record){0};
    return BF_OK;
}

enum bf_status long_records_read(void *context, const char *path, struct record *out, struct bf_error *err)
{
    struct long_records *list = context;
    struct long_record *sums = NULL;
    struct record_spool spool;
    if (!may_be_long(path))
        return record_read(path, out, err);
    *out = (struct record){0};
    enum bf_status status = read_spool(path, &spool, err);
    if (status != BF_OK)
        return status;
    if (spool.in_file && spool.record.n >= 2 * COMPARE_HEAD)
        status = sum_up(list, &spool, out, &sums, err);
    if (status == BF_OK && sums == NULL)
        status = take_whole(&spool, out, err);
    record_spool_close(&spool);
    if (status != BF_OK || sums == NULL) {
        long_record_free(sums);
        return status;
    }
    list->all = bf_grow(list->all, list->n + 1, sizeof *list->all);
    list->all[list->n++] = (struct one_long_record){.path = out->path, .sums = sums};
    return BF_OK;
}

void long_records_take(const struct long_records *list, struct comparison *comparison)
{
    for (size_t r = 0; r < comparison->n_records; r++)
        for (size_t i = 0; i < list->n; i++)
            if (list->all[i].path == comparison->records[r].path)
                compare_take_long(comparison, r, list->all[i].sums);
}

void long_records_free(struct long_records *list)
{
    for (size_t i = 0; i < list->n; i++)
        long_record_free(list->all[i].sums);
    free(list->all);
    *list = (struct long_records){0};
}
