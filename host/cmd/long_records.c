/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "long_records.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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
    const struct record_spool *spool = context;
    for (size_t c = 0; c < spool->record.n_columns; c++)
        if (strcmp(spool->record.columns[c].name, column) == 0) {
            record_spool_take(spool, c, first, n, x);
            return;
        }
    memset(x, 0, n * sizeof *x);
}

/* A file for the samples, on a disk: /tmp may be memory. */
static enum bf_status read_spool(const char *path, struct record_spool *out, struct bf_error *err)
{
    char beside[4096];
    const char *directory = getenv("TMPDIR");
    (void)snprintf(beside, sizeof beside, "%s/.", directory != NULL && directory[0] != '\0' ? directory : "/var/tmp");
    return record_spool_read(path, beside, out, err);
}

static void one_free(struct one_long_record *one)
{
    if (one != NULL) {
        long_record_free(one->sums);
        record_spool_close(&one->spool);
    }
    free(one);
}

/* The record of a spool that is closed. */
static enum bf_status take_whole(struct record_spool *spool, struct record *out, struct bf_error *err)
{
    if (record_spool_load(spool, err) != BF_OK)
        return err->status;
    *out = spool->record;
    spool->record = (struct record){0};
    return BF_OK;
}

/* A head that begins in motion has to have its state solved for. */
static enum bf_status begins_at_rest(const struct model *model, const struct record *head, bool *rest,
                                     struct bf_error *err)
{
    struct record copy = *head; /* it would get metadata */
    copy.meta = bf_alloc(head->n_meta + 1, sizeof *copy.meta);
    for (size_t i = 0; i < head->n_meta; i++)
        copy.meta[i] = head->meta[i];
    bool found;
    const enum bf_status status = initial_state_find(model, &copy, &found, err);
    for (size_t i = head->n_meta; i < copy.n_meta; i++)
        free(copy.meta[i].key), free(copy.meta[i].value);
    free(copy.meta);
    *rest = status == BF_OK && !found;
    return status;
}

/* *out: the head, where the sums are had; else nothing. */
static enum bf_status sum_up(const struct long_records *list, struct one_long_record *one, struct record *out,
                             struct bf_error *err)
{
    bool rest = false;
    enum bf_status status = record_spool_head(&one->spool, COMPARE_HEAD, &one->head, err);
    if (status == BF_OK)
        status = begins_at_rest(list->model, &one->head, &rest, err);
    if (status == BF_OK && rest)
        status =
            long_record_sum(list->model, &one->head, one->spool.record.n, list->options, &one->reader, &one->sums, err);
    if (status == BF_OK && one->sums != NULL && record_spool_failed(&one->spool))
        status = bf_fail_at(err, one->head.path, 0, "its samples cannot be read again from below TMPDIR");
    if (status == BF_OK && one->sums != NULL)
        *out = one->head, one->path = out->path;
    else
        record_free(&one->head);
    return status;
}

enum bf_status long_records_read(void *context, const char *path, struct record *out, struct bf_error *err)
{
    struct long_records *list = context;
    if (!may_be_long(path))
        return record_read(path, out, err);
    struct one_long_record *one = bf_alloc(1, sizeof *one);
    *out = (struct record){0};
    enum bf_status status = read_spool(path, &one->spool, err);
    one->reader = (struct long_reader){.read = read_column, .context = &one->spool};
    if (status == BF_OK && one->spool.in_file && one->spool.record.n >= 2 * COMPARE_HEAD)
        status = sum_up(list, one, out, err);
    if (status == BF_OK && one->sums == NULL)
        status = take_whole(&one->spool, out, err);
    if (status == BF_OK && one->sums != NULL) {
        list->all = bf_grow(list->all, list->n + 1, sizeof *list->all);
        list->all[list->n++] = one;
        return BF_OK;
    }
    one_free(one);
    return status;
}

bool long_records_has(const struct long_records *list, const struct record *record)
{
    bool has = false;
    for (size_t i = 0; i < list->n; i++)
        has = has || list->all[i]->path == record->path;
    return has;
}

void long_records_take(const struct long_records *list, struct comparison *comparison)
{
    for (size_t r = 0; r < comparison->n_records; r++)
        for (size_t i = 0; i < list->n; i++)
            if (list->all[i]->path == comparison->records[r].path)
                compare_take_long(comparison, r, list->all[i]->sums);
}

void long_records_free(struct long_records *list)
{
    for (size_t i = 0; i < list->n; i++)
        one_free(list->all[i]);
    free(list->all);
    *list = (struct long_records){0};
}
