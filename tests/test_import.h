/* SPDX-License-Identifier: GPL-3.0-or-later */
/* test_import.h — what the tests of the readers of foreign files share. Include after cmocka.h. */
#ifndef BEAMFIT_TEST_IMPORT_H
#define BEAMFIT_TEST_IMPORT_H

#include <math.h>
#include <stdint.h>
#include "record/import/import.h"
#include "test_files.h"

/* Bytes being put together; the file's content in memory. */
struct bytes {
    char data[1 << 16];
    size_t n;
};

static inline void put_bytes(struct bytes *b, const void *data, size_t n)
{
    assert_true(b->n + n <= sizeof b->data);
    memcpy(b->data + b->n, data, n);
    b->n += n;
}

static inline void put_text(struct bytes *b, const char *text)
{
    put_bytes(b, text, strlen(text));
}

/* Reads bytes as a file of this name; path (caller frees) must outlive *file. */
static inline enum bf_status read_as(const char *name, const void *data, size_t n, const struct import_reading *how,
                                     struct import_file *file, char **path, struct bf_error *err)
{
    static const struct import_reading find_out = {.format = NULL};
    *path = temporary_file(name, data, n);
    err->text[0] = '\0';
    enum bf_status status = import_read(*path, how != NULL ? how : &find_out, file, err);
    unlink(*path);
    return status;
}

static inline char *reads(const char *name, const void *data, size_t n, struct import_file *file)
{
    char *path;
    struct bf_error err;
    if (read_as(name, data, n, NULL, file, &path, &err) != BF_OK)
        fail_msg("%s", err.text);
    return path;
}

static inline void refuses(const char *name, const void *data, size_t n, const char *phrase1, const char *phrase2)
{
    char *path;
    struct import_file file;
    struct bf_error err;
    assert_int_equal(read_as(name, data, n, NULL, &file, &path, &err), BF_BAD_FILE);
    assert_contains(err.text, path);
    assert_contains(err.text, phrase1);
    assert_contains(err.text, phrase2);
    free(path);
}

static inline struct import_choice no_choice(void)
{
    return (struct import_choice){.from_s = (double)NAN, .to_s = (double)NAN, .free_from_s = (double)NAN};
}

static inline void makes(const struct import_file *file, const struct import_choice *choice, struct record *record)
{
    struct bf_error err;
    if (import_record(file, choice, record, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static inline void makes_none(const struct import_file *file, const struct import_choice *choice, enum bf_status status,
                              const char *phrase1, const char *phrase2)
{
    struct record record;
    struct bf_error err;
    assert_int_equal(import_record(file, choice, &record, &err), status);
    assert_contains(err.text, phrase1);
    assert_contains(err.text, phrase2);
    assert_null(record.columns);
}

static inline const struct import_channel *channel_named(const struct import_file *file, const char *name)
{
    for (size_t i = 0; i < file->n_channels; i++)
        if (strcmp(file->channels[i].name, name) == 0)
            return &file->channels[i];
    fail_msg("no channel '%s'", name);
    return NULL;
}

/*
 * A damaged file must be refused or read, but never break the reader: cut off at every step-th byte, and every step-th
 * byte changed. Readers that run in a process of their own need a larger step, for time.
 */
static inline void survives_damage(const char *name, const struct bytes *good, const char *format, size_t step)
{
    const struct import_reading how = {.format = import_format_by_name(format)};
    struct bytes *bad = malloc(sizeof *bad);
    for (size_t i = 0; i < 2 * good->n; i += step) {
        struct import_file file;
        struct bf_error err;
        char *path;
        *bad = *good;
        if (i < good->n)
            bad->n = i;
        else
            bad->data[i - good->n] ^= (char)(1 << i % 8);
        enum bf_status status = read_as(name, bad->data, bad->n, &how, &file, &path, &err);
        if (status == BF_OK)
            import_free(&file);
        else
            assert_int_equal(err.status, BF_BAD_FILE);
        free(path);
    }
    free(bad);
}

#endif
