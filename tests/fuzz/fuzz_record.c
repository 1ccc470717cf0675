/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Any bytes as a record: refused with one line of text, or a record that keeps what record.h promises. */
#include <math.h>
#include <string.h>
#include "fuzz_file.h"
#include "record/record.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    char path[32];
    struct record record;
    struct bf_error err = {0};
    int fd = fuzz_file(data, n, path);
    if (record_read(path, &record, &err) != BF_OK) {
        if (err.status != BF_BAD_FILE || err.text[0] == '\0' || strchr(err.text, '\n') != NULL)
            abort();
        close(fd);
        return 0;
    }
    const size_t least = record.kind == RECORD_FREQUENCIES ? 1 : 2;
    if (record.n < least || !(record.dt_s > 0) || record.n_columns == 0)
        abort();
    for (size_t i = 0; i < record.n_columns; i++) {
        /* of a list of frequencies a damping that nobody measured is no number */
        const bool may_lack = record.kind == RECORD_FREQUENCIES && strcmp(record.columns[i].name, "damping_ratio") == 0;
        for (size_t k = 0; k < record.n; k++)
            if (!isfinite(record.columns[i].x[k]) && !(may_lack && isnan(record.columns[i].x[k])))
                abort();
    }
    record_free(&record);
    close(fd);
    return 0;
}
