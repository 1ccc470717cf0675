/* SPDX-License-Identifier: GPL-3.0-or-later */
/* long_records.h — records of a command line that are too long for memory: a head each, and sums over all samples. */
#ifndef BEAMFIT_LONG_RECORDS_H
#define BEAMFIT_LONG_RECORDS_H

#include "compare/compare.h"
#include "record_sets.h"

/* Starts with the first two; what has been read is freed with long_records_free(). */
struct long_records {
    const struct model *model;
    const struct predict_options *options;
    size_t n;
    struct one_long_record {
        const char *path; /* of the head in the list, which owns it: pointers tell the records apart */
        struct long_record *sums;
    } * all; /* [n] */
};

/* A record_reader (record_sets.h) whose context are long_records: *out is a head where the sums over the whole are among them, else the record. */
enum bf_status long_records_read(void *context, const char *path, struct record *out, struct bf_error *err);
/* Into a comparison of the list's records. */
void long_records_take(const struct long_records *long_records, struct comparison *comparison);
void long_records_free(struct long_records *long_records);

#endif
