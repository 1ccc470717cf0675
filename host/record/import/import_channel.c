/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The channels of a foreign file: added by its reader, found by the names that a user gives. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import_channel.h"
#include "import_units.h"

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

long import_line_of(const struct import_file *file, size_t sample)
{
    return sample < file->n_lines ? file->lines[sample] : 0;
}

size_t import_find_channel(const struct import_file *file, const char *name)
{
    char *end;
    unsigned long number = name[0] == '#' ? strtoul(name + 1, &end, 10) : 0;
    if (number >= 1 && number <= file->n_channels && *end == '\0')
        return number - 1;
    for (size_t i = 0; i < file->n_channels; i++)
        if (strcmp(file->channels[i].name, name) == 0)
            return i;
    for (size_t i = 0; i < file->n_channels; i++) {
        char *own = import_column_name(&file->channels[i]);
        bool found = strcmp(own, name) == 0;
        free(own);
        if (found)
            return i;
    }
    const char *unit;
    size_t unit_n, n = import_split_unit(name, strlen(name), &unit, &unit_n); /* "Force [N]" as the file writes it */
    for (size_t i = 0; unit_n > 0 && i < file->n_channels; i++)
        if (strncmp(file->channels[i].name, name, n) == 0 && file->channels[i].name[n] == '\0' &&
            strncmp(file->channels[i].unit, unit, unit_n) == 0)
            return i;
    return IMPORT_NO_AXIS;
}

enum bf_status import_fail_no_channel(const struct import_file *file, const char *option, const char *name,
                                      struct bf_error *err)
{
    char list[400] = "";
    for (size_t i = 0; i < file->n_channels && strlen(list) + IMPORT_SHOWN + 8 < sizeof list; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%.*s", i > 0 ? ", " : "", IMPORT_SHOWN,
                 file->channels[i].name);
    return bf_fail(err, BF_USAGE, "%s %.*s: %s has no such channel; it has %s (see --list)", option, IMPORT_SHOWN, name,
                   file->path, list);
}

bool import_is_axis(const struct import_file *file, size_t channel)
{
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].axis == channel)
            return true;
    return false;
}
