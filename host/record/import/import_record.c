/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The second step of an import: chosen channels of a foreign file over one uniform time axis. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import_work.h"

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

static enum bf_status add_column(struct import_work *w, size_t channel, const char *name, struct bf_error *err)
{
    const struct import_channel *c = &w->file->channels[channel];
    if (c->unusable != NULL)
        return bf_fail(err, BF_USAGE, "channel '%.*s' of %s cannot become a column: %s", IMPORT_SHOWN, c->name,
                       w->file->path, c->unusable);
    char *own = name != NULL ? bf_strdup(name) : import_column_name(c);
    for (size_t i = 0; i < w->n_columns; i++)
        if (strcmp(w->columns[i].name, own) == 0) {
            bf_fail(err, BF_USAGE, "two channels would become column '%.*s'; rename one with --channel %.*s=NEW",
                    IMPORT_SHOWN, own, IMPORT_SHOWN, c->name);
            free(own);
            return err->status;
        }
    if (own[0] == '\0' || own[strcspn(own, ",\"'\n\r\t #")] != '\0' || strcmp(own, "time_s") == 0) {
        bf_fail(err, BF_USAGE, "'%.*s' cannot be the name of a column; use letters, digits and '_'", IMPORT_SHOWN, own);
        free(own);
        return err->status;
    }
    w->columns = bf_grow(w->columns, w->n_columns + 1, sizeof *w->columns);
    w->columns[w->n_columns++] = (struct import_column){channel, own};
    return BF_OK;
}

/* Do two channels have the same samples in time, as far as the file says? */
static bool same_group(const struct import_file *file, size_t a, size_t b)
{
    const struct import_channel *x = &file->channels[a], *y = &file->channels[b];
    if (x->n != y->n || x->dt_s != y->dt_s || x->t0_s != y->t0_s)
        return false;
    if (x->axis == y->axis)
        return true;
    if (x->axis == IMPORT_NO_AXIS || y->axis == IMPORT_NO_AXIS)
        return false;
    const struct import_channel *s = &file->channels[x->axis], *t = &file->channels[y->axis];
    return s->n == t->n && memcmp(s->x, t->x, s->n * sizeof *s->x) == 0;
}

bool import_is_axis(const struct import_file *file, size_t channel)
{
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].axis == channel)
            return true;
    return false;
}

/* Every channel that is neither time nor a lone number, when all fit together. */
static enum bf_status take_all(struct import_work *w, size_t time, struct bf_error *err)
{
    const struct import_file *file = w->file;
    double factor;
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        if (i == time || import_is_axis(file, i) || c->unusable != NULL || c->n < 2)
            continue;
        if (import_looks_like_time(c, &factor)) {
            bf_warn("%s: channel '%.*s' is left out, it looks like another time axis (--channel takes it)", file->path,
                    IMPORT_SHOWN, c->name);
            continue;
        }
        if (w->n_columns > 0 && !same_group(file, w->columns[0].channel, i))
            return bf_fail(err, BF_USAGE,
                           "%s: channels '%.*s' and '%.*s' have different samples or time axes; choose those of one "
                           "with --channel (see --list)",
                           file->path, IMPORT_SHOWN, file->channels[w->columns[0].channel].name, IMPORT_SHOWN, c->name);
        if (add_column(w, i, NULL, err) != BF_OK)
            return err->status;
    }
    if (w->n_columns > 0)
        return BF_OK;
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].unusable != NULL)
            return add_column(w, i, NULL, err);
    return bf_fail_at(err, file->path, 0, "has no channel beside time with two samples or more; see --list");
}

static enum bf_status take_picks(struct import_work *w, struct bf_error *err)
{
    for (size_t i = 0; i < w->choice->n_picks; i++) {
        const struct import_pick *pick = &w->choice->picks[i];
        size_t channel = import_find_channel(w->file, pick->from);
        if (channel == IMPORT_NO_AXIS)
            return import_fail_no_channel(w->file, "--channel", pick->from, err);
        if (w->n_columns > 0 && !same_group(w->file, w->columns[0].channel, channel))
            return bf_fail(err, BF_USAGE,
                           "channels '%.*s' and '%.*s' of %s have different samples or time axes; import them into two "
                           "records",
                           IMPORT_SHOWN, w->file->channels[w->columns[0].channel].name, IMPORT_SHOWN, pick->from,
                           w->file->path);
        if (add_column(w, channel, pick->to, err) != BF_OK)
            return err->status;
    }
    return BF_OK;
}

/* --from and --to: samples within, with half a millionth of a step of mercy for rounding. */
static enum bf_status cut(struct import_work *w, struct bf_error *err)
{
    const struct import_choice *choice = w->choice;
    const struct import_axis *axis = &w->axis;
    double end_s = axis->t0_s + (double)(axis->n - 1) * axis->dt_s;
    double from = isnan(choice->from_s) ? 0 : ceil((choice->from_s - axis->t0_s) / axis->dt_s - 1e-6);
    double to = isnan(choice->to_s) ? (double)(axis->n - 1) : floor((choice->to_s - axis->t0_s) / axis->dt_s + 1e-6);
    from = fmax(from, 0);
    to = fmin(to, (double)(axis->n - 1));
    if (!(to >= from + 1))
        return bf_fail(err, BF_USAGE, "--from and --to leave no two samples of %s, which goes from %.9g s to %.9g s",
                       w->file->path, axis->t0_s, end_s);
    w->first = (size_t)from;
    w->last = (size_t)to;
    if (choice->free_decay && !isnan(choice->free_from_s) &&
        !(choice->free_from_s >= axis->t0_s + (from - 0.5) * axis->dt_s &&
          choice->free_from_s < axis->t0_s + to * axis->dt_s))
        return bf_fail(err, BF_USAGE, "--free-from %.9g: outside the record, which goes from %.9g s to %.9g s",
                       choice->free_from_s, axis->t0_s + from * axis->dt_s, axis->t0_s + to * axis->dt_s);
    return BF_OK;
}

/* The scale of a column; NULL when the user gave none. */
static const struct import_scale *scale_of(const struct import_work *w, const struct import_column *column)
{
    for (size_t i = 0; i < w->choice->n_scales; i++) {
        const char *name = w->choice->scales[i].name;
        if (strcmp(name, column->name) == 0 || import_find_channel(w->file, name) == column->channel)
            return &w->choice->scales[i];
    }
    return NULL;
}

static void warn_of_unit(const struct import_column *column, const struct import_channel *c)
{
    struct import_unit file, name;
    if (!import_unit(c->unit, &file) || !import_unit_of_name(column->name, &name) ||
        strcmp(file.suffix, name.suffix) == 0)
        return;
    if (strcmp(file.SI, name.SI) == 0)
        bf_warn("column '%s': the file gives '%s', the name says %s; nothing is converted: --scale %s=%.9g does it",
                column->name, c->unit, name.suffix, column->name, file.factor / name.factor);
    else
        bf_warn("column '%s': the file gives '%s', the name says %s; is it the right channel?", column->name, c->unit,
                name.suffix);
}

static enum bf_status fill_column(const struct import_work *w, const struct import_column *column, struct record *out,
                                  struct bf_error *err)
{
    const struct import_file *file = w->file;
    const struct import_channel *c = &file->channels[column->channel];
    const struct import_scale *scale = scale_of(w, column);
    double factor = scale != NULL ? scale->factor : 1;
    double *x = bf_alloc(out->n, sizeof *x);
    char key[128], text[256];
    for (size_t k = 0; k < out->n; k++) {
        x[k] = factor * c->x[w->first + k];
        if (isfinite(x[k]))
            continue;
        free(x);
        return bf_fail_at(err, file->path, import_line_of(file, w->first + k),
                          "channel '%.*s', sample %zu: %s; cut it off with --from or --to, or leave the channel out",
                          IMPORT_SHOWN, c->name, w->first + k + 1,
                          isnan(c->x[w->first + k]) ? "no number" : "too large");
    }
    record_add_column(out, column->name, x);
    free(x);
    if (scale == NULL)
        warn_of_unit(column, c);
    struct import_unit unit;
    const char *stated = scale == NULL                              ? c->unit
                         : scale->unit != NULL                      ? scale->unit
                         : import_unit_of_name(column->name, &unit) ? unit.suffix
                                                                    : "";
    snprintf(key, sizeof key, "channel_%.*s", IMPORT_SHOWN, column->name);
    snprintf(text, sizeof text, "'%.*s'%s%.*s", IMPORT_SHOWN, c->name, c->about[0] != '\0' ? ", " : "", 120, c->about);
    record_add_meta(out, key, text);
    if (stated[0] != '\0') {
        snprintf(key, sizeof key, "unit_%.*s", IMPORT_SHOWN, column->name);
        record_add_meta(out, key, stated);
    }
    if (scale != NULL) {
        snprintf(key, sizeof key, "scale_%.*s", IMPORT_SHOWN, column->name);
        snprintf(text, sizeof text, "%.12g%s%.*s", factor, c->unit[0] != '\0' ? " applied to values in " : "",
                 IMPORT_SHOWN, c->unit);
        record_add_meta(out, key, text);
    }
    return BF_OK;
}

/* What the foreign file says under a key that beamfit acts on must be what beamfit means by it. */
static const char *key_of_foreign_meta(const struct record_meta *meta, const struct record *record)
{
    static const char *const known[] = {"free_decay", "unknown_level", "recorded"};
    double from_s, end_s = record->t0_s + (double)(record->n - 1) * record->dt_s;
    if (strcmp(meta->key, "free_from_s") == 0)
        return number_parse(meta->value, meta->value + strlen(meta->value), '.', &from_s) &&
                       from_s < end_s - record->dt_s / 2
                   ? meta->key
                   : "source_free_from_s";
    if (strcmp(meta->key, "excitation") != 0)
        return meta->key;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcmp(meta->value, known[i]) == 0)
            return meta->key;
    return "source_excitation";
}

/* Provenance first, then what beamfit acts on, then what the file said of itself. */
static void fill_meta(const struct import_work *w, struct record *out)
{
    const struct import_file *file = w->file;
    const struct import_choice *choice = w->choice;
    char text[64];
    record_add_meta(out, "source", file->path);
    record_add_meta(out, "source_sha256", file->sha256);
    record_add_meta(out, "source_format", import_format_name(file->format));
    record_add_meta(out, "imported_by", choice->command != NULL ? choice->command : "beamfit import");
    record_add_meta(out, "time_from", w->axis.from);
    if (choice->free_decay)
        record_add_meta(out, "excitation", "free_decay");
    else if (choice->unknown_level)
        record_add_meta(out, "excitation", "unknown_level");
    if (choice->free_decay && !isnan(choice->free_from_s)) {
        snprintf(text, sizeof text, "%.12g", choice->free_from_s);
        record_add_meta(out, "free_from_s", text);
    }
    for (size_t i = 0; i < file->n_meta; i++) {
        const char *key = key_of_foreign_meta(&file->meta[i], out);
        if (record_meta(out, key) == NULL && file->meta[i].value[0] != '\0')
            record_add_meta(out, key, file->meta[i].value);
    }
}

static enum bf_status check_scales(const struct import_work *w, struct bf_error *err)
{
    for (size_t i = 0; i < w->choice->n_scales; i++) {
        bool used = false;
        for (size_t k = 0; k < w->n_columns; k++)
            used |= scale_of(w, &w->columns[k]) == &w->choice->scales[i];
        if (!used)
            return import_fail_no_channel(w->file, "--scale", w->choice->scales[i].name, err);
    }
    return BF_OK;
}

static enum bf_status make_record(struct import_work *w, struct record *out, struct bf_error *err)
{
    size_t time;
    if (import_choose_time(w, &time, err) != BF_OK)
        return err->status;
    if ((w->choice->n_picks > 0 ? take_picks(w, err) : take_all(w, time, err)) != BF_OK)
        return err->status;
    if (import_make_axis(w, time, err) != BF_OK || cut(w, err) != BF_OK || check_scales(w, err) != BF_OK)
        return err->status;
    out->n = w->last - w->first + 1;
    out->dt_s = w->axis.dt_s;
    out->t0_s = w->axis.t0_s + (double)w->first * w->axis.dt_s;
    fill_meta(w, out);
    for (size_t i = 0; i < w->n_columns; i++)
        if (fill_column(w, &w->columns[i], out, err) != BF_OK)
            return err->status;
    return BF_OK;
}

enum bf_status import_record(const struct import_file *file, const struct import_choice *choice, struct record *out,
                             struct bf_error *err)
{
    struct import_work w = {.file = file, .choice = choice};
    memset(out, 0, sizeof *out);
    enum bf_status status = make_record(&w, out, err);
    for (size_t i = 0; i < w.n_columns; i++)
        free(w.columns[i].name);
    free(w.columns);
    if (status != BF_OK)
        record_free(out);
    return status;
}
