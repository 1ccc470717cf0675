/* SPDX-License-Identifier: GPL-3.0-or-later */
/* fuzz_import.h — any bytes as a foreign recording: refused with one line of text, or whole channels and, with every
 * way to choose from them, a record or a refusal. */
#ifndef BEAMFIT_FUZZ_IMPORT_H
#define BEAMFIT_FUZZ_IMPORT_H

#include <math.h>
#include <string.h>
#include "fuzz_file.h"
#include "record/import/import.h"
#include "record/import/import_format.h"

static inline void fuzz_check(enum bf_status status, const struct bf_error *err)
{
    if (status != BF_OK && (err->status != status || err->text[0] == '\0' || strchr(err->text, '\n') != NULL))
        abort();
}

static inline void fuzz_choose(const struct import_file *file, const struct import_choice *choice)
{
    struct record record;
    struct bf_error err = {0};
    enum bf_status status = import_record(file, choice, &record, &err);
    fuzz_check(status, &err);
    if (status != BF_OK)
        return;
    if (record.n < 2 || !(record.dt_s > 0) || record.n_columns == 0)
        abort();
    for (size_t i = 0; i < record.n_columns; i++)
        for (size_t k = 0; k < record.n; k++)
            if (!isfinite(record.columns[i].x[k]))
                abort();
    record_free(&record);
}

/* In this process, though import_read() runs some readers in another: here their faults must show. */
static inline void fuzz_import(const uint8_t *data, size_t n, const char *name)
{
    const struct import_format *format = import_format_by_name(name);
    const struct import_reading how = {.format = NULL};
    const struct import_pick pick[2] = {{"#1", "first_V"}, {"#2", NULL}};
    const struct import_choice choices[] = {
        {.from_s = (double)NAN, .to_s = (double)NAN, .free_from_s = (double)NAN},
        {.rate_Hz = 100, .from_s = 0.01, .to_s = 1, .free_decay = true, .free_from_s = 0.02},
        {.from_s = (double)NAN,
         .to_s = (double)NAN,
         .free_from_s = (double)NAN,
         .time = "#1",
         .n_picks = 2,
         .picks = pick}};
    struct import_file file = {.n_channels = 0};
    struct bf_error err = {0};
    char path[32] = "fuzz", *text = malloc(n + 1);
    const int fd = strcmp(name, "mat") == 0 ? fuzz_file(data, n, path) : -1; /* matio opens the file itself */
    file.path = path;
    memcpy(text, data, n);
    text[n] = '\0';
    enum bf_status status = format->read(&file, text, n, &how, &err);
    fuzz_check(status, &err);
    for (size_t i = 0; status == BF_OK && file.n_channels > 0 && i < sizeof choices / sizeof *choices; i++)
        fuzz_choose(&file, &choices[i]);
    import_free(&file);
    free(text);
    if (fd >= 0)
        close(fd);
}

#endif
