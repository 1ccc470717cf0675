/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The first step of an import: which format the bytes of a file have, and its reader run on them. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "import.h"
#include "import_channel.h"
#include "import_format.h"
#include "import_isolated.h"

enum { MOST_CHANNELS = 4096 };

const char *import_format_name(const struct import_format *format)
{
    return format != NULL ? format->name : "unknown";
}

const struct import_format *import_format_by_name(const char *name)
{
    for (int i = 0; i < import_formats_count; i++)
        if (strcasecmp(import_formats[i]->name, name) == 0)
            return import_formats[i];
    return NULL;
}

void import_format_list(size_t size, char text[])
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; i < import_formats_count && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%s (%s)", i > 0 ? ", " : "", import_formats[i]->name,
                                 import_formats[i]->title);
}

/* The format that is surest of the file; NULL when none can be. */
static const struct import_format *recognise(const char *path, const char *data, size_t n)
{
    const struct import_format *best = NULL;
    enum import_match surest = IMPORT_NO_MATCH;
    for (int i = 0; i < import_formats_count; i++) {
        const struct import_format *format = import_formats[i];
        const enum import_match match = format->recognise(path, data, n);
        if (match > surest) {
            surest = match;
            best = format;
        }
    }
    return best;
}

static enum bf_status read_bytes(struct import_file *out, const char *data, size_t n, const struct import_reading *how,
                                 struct bf_error *err)
{
    char known[400];
    if (n == 0)
        return bf_fail_at(err, out->path, 0, "is empty; export the recording again");
    out->format = how->format != NULL ? how->format : recognise(out->path, data, n);
    if (out->format == NULL) {
        import_format_list(sizeof known, known);
        return bf_fail_at(err, out->path, 0,
                          "is no kind of recording that beamfit knows; give --format if it is one, or export it as "
                          "one: %s",
                          known);
    }
    const enum bf_status status = out->format->by_outside_library
                                      ? import_isolated(out->format->read, out, data, n, how, err)
                                      : out->format->read(out, data, n, how, err);
    if (status != BF_OK)
        return status;
    if (out->n_channels == 0)
        return bf_fail_at(err, out->path, 0, "has no channel of numbers; check what was exported");
    if (out->n_channels > MOST_CHANNELS)
        return bf_fail_at(err, out->path, 0, "has %zu channels, more than %d; export fewer", out->n_channels,
                          MOST_CHANNELS);
    return BF_OK;
}

enum bf_status import_read(const char *path, const struct import_reading *how, struct import_file *out,
                           struct bf_error *err)
{
    char *data;
    size_t n;
    memset(out, 0, sizeof *out);
    out->path = path;
    if (lines_read_all(path, &data, &n, out->sha256, err) != BF_OK)
        return err->status;
    const enum bf_status status = read_bytes(out, data, n, how, err);
    free(data);
    if (status != BF_OK)
        import_free(out);
    return status;
}
