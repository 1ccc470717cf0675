/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "import.h"
#include "import_private.h"
#include "ground/ground.h"

enum { MOST_CHANNELS = 4096 };

static const struct {
    const char *name;
    import_reader *read;
    enum import_format format;
    bool outside; /* by an outside library */
} kinds[] = {{"uff", import_uff, IMPORT_UFF, false},
             {"mat", import_mat, IMPORT_MAT, true},
             {"lvm", import_lvm, IMPORT_LVM, false},
             {"wav", import_wav, IMPORT_WAV, true},
             {"csv", import_csv, IMPORT_CSV, false}};
enum { KINDS = sizeof kinds / sizeof *kinds };

const char *import_format_name(enum import_format format)
{
    for (size_t i = 0; i < KINDS; i++)
        if (kinds[i].format == format)
            return kinds[i].name;
    return "unknown";
}

enum import_format import_format_by_name(const char *name)
{
    for (size_t i = 0; i < KINDS; i++)
        if (strcasecmp(kinds[i].name, name) == 0)
            return kinds[i].format;
    return IMPORT_UNKNOWN;
}

static bool starts_with(const char *data, size_t n, const char *start, size_t length)
{
    return n >= length && memcmp(data, start, length) == 0;
}

/* "    -1" on the first line that is not blank. */
static bool looks_like_uff(const char *data, size_t n)
{
    const char *s = data, *end = data + (n < 400 ? n : 400);
    while (s < end && (*s == ' ' || *s == '\r' || *s == '\n'))
        s++;
    if (!starts_with(s, (size_t)(end - s), "-1", 2))
        return false;
    for (s += 2; s < end && (*s == ' ' || *s == '\r' || *s == '\n'); s++)
        if (*s == '\n')
            return true;
    return false;
}

/* The content decides; the extension only where the content does not tell. */
static enum import_format recognise(const char *path, const char *data, size_t n)
{
    if (starts_with(data, n, "MATLAB ", 7) || starts_with(data, n, "\x89HDF\r\n\x1a\n", 8) ||
        (n > 520 && starts_with(data + 512, 8, "\x89HDF\r\n\x1a\n", 8)))
        return IMPORT_MAT;
    if (n > 12 && (memcmp(data + 8, "WAVE", 4) == 0 || memcmp(data + 8, "AIFF", 4) == 0))
        return IMPORT_WAV;
    if (starts_with(data, n, "fLaC", 4) || starts_with(data, n, "riff", 4))
        return IMPORT_WAV;
    if (starts_with(data, n, "LabVIEW Measurement", 19))
        return IMPORT_LVM;
    if (looks_like_uff(data, n))
        return IMPORT_UFF;
    const char *dot = strrchr(path, '.');
    if (dot != NULL && strcasecmp(dot, ".mat") == 0)
        return IMPORT_MAT; /* MATLAB 4 has no signature */
    return memchr(data, '\0', n < 65536 ? n : 65536) == NULL ? IMPORT_CSV : IMPORT_UNKNOWN;
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
    out->format = how->format != IMPORT_UNKNOWN ? how->format : recognise(path, data, n);
    enum bf_status status = BF_OK;
    if (n == 0)
        status = bf_fail_at(err, path, 0, "is empty; export the recording again");
    else if (out->format == IMPORT_UNKNOWN)
        status = bf_fail_at(err, path, 0,
                            "is no kind of recording that beamfit knows (UFF 58, MATLAB, LVM, WAV, CSV); give --format "
                            "if it is one, or export it as one");
    for (size_t i = 0; i < KINDS && status == BF_OK; i++)
        if (kinds[i].format == out->format)
            status = kinds[i].outside ? import_isolated(kinds[i].read, out, data, n, how, err)
                                      : kinds[i].read(out, data, n, how, err);
    if (status == BF_OK && out->n_channels == 0)
        status = bf_fail_at(err, path, 0, "has no channel of numbers; check what was exported");
    if (status == BF_OK && out->n_channels > MOST_CHANNELS)
        status =
            bf_fail_at(err, path, 0, "has %zu channels, more than %d; export fewer", out->n_channels, MOST_CHANNELS);
    free(data);
    if (status != BF_OK)
        import_free(out);
    return status;
}

void import_free(struct import_file *file)
{
    for (size_t i = 0; i < file->n_channels; i++) {
        free(file->channels[i].name);
        free(file->channels[i].unit);
        free(file->channels[i].about);
        free(file->channels[i].x);
    }
    for (size_t i = 0; i < file->n_meta; i++) {
        free(file->meta[i].key);
        free(file->meta[i].value);
    }
    free(file->channels);
    free(file->meta);
    free(file->rate_from);
    free(file->lines);
    memset(file, 0, sizeof *file);
}

void import_set_text(char **text, const char *s, size_t n)
{
    while (n > 0 && (unsigned char)*s <= ' ') {
        s++;
        n--;
    }
    while (n > 0 && (unsigned char)s[n - 1] <= ' ')
        n--;
    char *copy = bf_alloc(n + 1, 1);
    for (size_t i = 0; i < n; i++)
        copy[i] = (unsigned char)s[i] < ' ' || s[i] == 0x7f ? ' ' : s[i];
    free(*text);
    *text = copy;
}

static bool name_is_taken(const struct import_file *file, size_t but, const char *name)
{
    for (size_t i = 0; i < file->n_channels; i++)
        if (i != but && strcmp(file->channels[i].name, name) == 0)
            return true;
    return false;
}

struct import_channel *import_add(struct import_file *file, const char *name, size_t name_n, double *x, size_t n)
{
    size_t self = file->n_channels++;
    file->channels = bf_grow(file->channels, file->n_channels, sizeof *file->channels);
    struct import_channel *channel = &file->channels[self];
    *channel = (struct import_channel){.n = n, .axis = IMPORT_NO_AXIS};
    channel->x = x;
    import_set_text(&channel->name, name, name_n);
    import_set_text(&channel->unit, "", 0);
    import_set_text(&channel->about, "", 0);
    char *wanted = bf_strdup(channel->name[0] != '\0' ? channel->name : "channel");
    bool numbered = channel->name[0] == '\0';
    size_t size = strlen(wanted) + 24;
    for (size_t k = numbered ? self + 1 : 2; (numbered || name_is_taken(file, self, channel->name)) && k != 0; k++) {
        char *next = bf_alloc(size, 1);
        snprintf(next, size, "%s_%zu", wanted, k);
        free(channel->name);
        channel->name = next;
        numbered = false;
    }
    free(wanted);
    return channel;
}

void import_add_meta(struct import_file *file, const char *key, const char *value, size_t value_n)
{
    file->meta = bf_grow(file->meta, file->n_meta + 1, sizeof *file->meta);
    struct record_meta *meta = &file->meta[file->n_meta++];
    meta->key = bf_strdup(key);
    meta->value = NULL;
    import_set_text(&meta->value, value, value_n);
}

void import_set_rate(struct import_file *file, double rate_Hz, const char *from)
{
    if (file->rate_Hz > 0 || !(rate_Hz > 0 && rate_Hz < 1e12))
        return;
    file->rate_Hz = rate_Hz;
    file->rate_from = bf_strdup(from);
}
