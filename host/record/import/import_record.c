/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The second step of an import: chosen channels of a foreign file over one uniform time axis. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import_axis.h"
#include "import_channel.h"
#include "import_resample.h"
#include "import_scale.h"
#include "import_units.h"

/* A record in the making. */
struct draft {
    const struct import_file *file;
    const struct import_choice *choice;
    size_t n_columns;
    struct import_column *columns;
    struct import_axis axis;
    double **resampled; /* [n_columns][axis.n]; NULL: the file's own samples */
    char said[400];     /* of resampling; "" */
    size_t first, last; /* samples kept, both included */
};

static enum bf_status add_column(struct draft *draft, size_t channel, const char *name, struct bf_error *err)
{
    const struct import_channel *c = &draft->file->channels[channel];
    if (c->unusable != NULL)
        return bf_fail(err, BF_USAGE, "channel '%.*s' of %s cannot become a column: %s", IMPORT_SHOWN, c->name,
                       draft->file->path, c->unusable);
    char *own = name != NULL ? bf_strdup(name) : import_column_name(c);
    for (size_t i = 0; i < draft->n_columns; i++)
        if (strcmp(draft->columns[i].name, own) == 0) {
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
    draft->columns = bf_grow(draft->columns, draft->n_columns + 1, sizeof *draft->columns);
    draft->columns[draft->n_columns++] = (struct import_column){channel, own};
    return BF_OK;
}

/* Do two channels have the same samples in time, as far as the file says? */
static bool same_group(const struct import_file *file, size_t a, size_t b)
{
    const struct import_channel *x = &file->channels[a], *y = &file->channels[b];
    if (x->n != y->n || x->over_frequency != y->over_frequency || x->dt_s != y->dt_s || x->t0_s != y->t0_s)
        return false;
    if (x->axis == y->axis)
        return true;
    if (x->axis == IMPORT_NO_AXIS || y->axis == IMPORT_NO_AXIS)
        return false;
    const struct import_channel *s = &file->channels[x->axis], *t = &file->channels[y->axis];
    return s->n == t->n && memcmp(s->x, t->x, s->n * sizeof *s->x) == 0;
}

/* Every channel that is neither time nor a lone number, when all fit together. */
static enum bf_status take_all(struct draft *draft, size_t time, struct bf_error *err)
{
    const struct import_file *file = draft->file;
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
        if (draft->n_columns > 0 && c->over_frequency != file->channels[draft->columns[0].channel].over_frequency) {
            bf_warn("%s: channel '%.*s' is left out, it is over %s (--channel takes it)", file->path, IMPORT_SHOWN,
                    c->name, c->over_frequency ? "frequency" : "time");
            continue;
        }
        if (draft->n_columns > 0 && !same_group(file, draft->columns[0].channel, i))
            return bf_fail(err, BF_USAGE,
                           "%s: channels '%.*s' and '%.*s' have different samples or time axes; choose those of one "
                           "with --channel (see --list)",
                           file->path, IMPORT_SHOWN, file->channels[draft->columns[0].channel].name, IMPORT_SHOWN,
                           c->name);
        if (add_column(draft, i, NULL, err) != BF_OK)
            return err->status;
    }
    if (draft->n_columns > 0)
        return BF_OK;
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].unusable != NULL)
            return add_column(draft, i, NULL, err);
    return bf_fail_at(err, file->path, 0, "has no channel beside time with two samples or more; see --list");
}

static enum bf_status take_picks(struct draft *draft, struct bf_error *err)
{
    for (size_t i = 0; i < draft->choice->n_picks; i++) {
        const struct import_pick *pick = &draft->choice->picks[i];
        size_t channel = import_find_channel(draft->file, pick->from);
        if (channel == IMPORT_NO_AXIS)
            return import_fail_no_channel(draft->file, "--channel", pick->from, err);
        if (draft->n_columns > 0 && !same_group(draft->file, draft->columns[0].channel, channel))
            return bf_fail(err, BF_USAGE,
                           "channels '%.*s' and '%.*s' of %s have different samples or time axes; import them into two "
                           "records",
                           IMPORT_SHOWN, draft->file->channels[draft->columns[0].channel].name, IMPORT_SHOWN,
                           pick->from, draft->file->path);
        if (add_column(draft, channel, pick->to, err) != BF_OK)
            return err->status;
    }
    return BF_OK;
}

/* --from and --to: samples within, a time that is off by rounding (1e-6 of a step) still counts. */
static enum bf_status cut(struct draft *draft, struct bf_error *err)
{
    const struct import_choice *choice = draft->choice;
    const struct import_axis *axis = &draft->axis;
    double end_s = axis->t0_s + (double)(axis->n - 1) * axis->dt_s;
    double from = isnan(choice->from_s) ? 0 : ceil((choice->from_s - axis->t0_s) / axis->dt_s - 1e-6);
    double to = isnan(choice->to_s) ? (double)(axis->n - 1) : floor((choice->to_s - axis->t0_s) / axis->dt_s + 1e-6);
    from = fmax(from, 0);
    to = fmin(to, (double)(axis->n - 1));
    if (!(to >= from + 1))
        return bf_fail(err, BF_USAGE, "--from and --to leave no two samples of %s, which goes from %.9g s to %.9g s",
                       draft->file->path, axis->t0_s, end_s);
    draft->first = (size_t)from;
    draft->last = (size_t)to;
    if (choice->free_decay && !isnan(choice->free_from_s) &&
        !(choice->free_from_s >= axis->t0_s + (from - 0.5) * axis->dt_s &&
          choice->free_from_s < axis->t0_s + to * axis->dt_s))
        return bf_fail(err, BF_USAGE, "--free-from %.9g: outside the record, which goes from %.9g s to %.9g s",
                       choice->free_from_s, axis->t0_s + from * axis->dt_s, axis->t0_s + to * axis->dt_s);
    return BF_OK;
}

/* The scale of a column; NULL when the user gave none. */
static const struct import_scale *scale_of(const struct draft *draft, const struct import_column *column)
{
    for (size_t i = 0; i < draft->choice->n_scales; i++) {
        const char *name = draft->choice->scales[i].name;
        if (strcmp(name, column->name) == 0 || import_find_channel(draft->file, name) == column->channel)
            return &draft->choice->scales[i];
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

static enum bf_status fill_column(const struct draft *draft, const struct import_column *column, struct record *out,
                                  struct bf_error *err)
{
    const struct import_file *file = draft->file;
    const struct import_channel *c = &file->channels[column->channel];
    const struct import_scale *scale = scale_of(draft, column);
    double factor = 1;
    const char *stated = c->unit;
    char key[128], text[256];
    if (scale != NULL && import_scale_factor(scale, file, c, column->name, &factor, &stated, err) != BF_OK)
        return err->status;
    double *x = bf_alloc(out->n, sizeof *x);
    const double *from = draft->resampled != NULL ? draft->resampled[column - draft->columns] : c->x;
    for (size_t k = 0; k < out->n; k++) {
        x[k] = factor * from[draft->first + k];
        if (isfinite(x[k]))
            continue;
        free(x);
        return bf_fail_at(err, file->path, import_line_of(file, draft->first + k),
                          "channel '%.*s', sample %zu: %s; cut it off with --from or --to, or leave the channel out",
                          IMPORT_SHOWN, c->name, draft->first + k + 1,
                          isnan(from[draft->first + k]) ? "no number" : "too large");
    }
    record_add_column(out, column->name, x);
    free(x);
    if (scale == NULL)
        warn_of_unit(column, c);
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
        if (scale->sensitivity != NULL)
            snprintf(text + strlen(text), sizeof text - strlen(text), " (%.9g %.40s)", scale->factor,
                     scale->sensitivity);
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

static void fill_response_meta(const struct import_choice *choice, struct record *out)
{
    char text[64];
    if (choice->averages > 0) {
        snprintf(text, sizeof text, "%.12g", choice->averages);
        record_add_meta(out, RECORD_AVERAGES, text);
    }
    if (choice->window_s > 0) {
        snprintf(text, sizeof text, "%.12g s", choice->window_s);
        record_add_meta(out, RECORD_WINDOW, text);
    }
}

/* Lines over frequency that are no responses cannot be read back. */
static enum bf_status check_response(const struct import_file *file, const struct record *lines, struct bf_error *err)
{
    struct record period, named = *lines;
    named.path = bf_strdup(file->path);
    const enum bf_status status = record_from_response(&named, &period, err);
    free(named.path);
    if (status == BF_OK)
        record_free(&period);
    return status == BF_OK ? BF_OK : (err->status = BF_USAGE);
}

/* Provenance first, then what beamfit acts on, then what the file said of itself. */
static void fill_meta(const struct draft *draft, struct record *out)
{
    const struct import_file *file = draft->file;
    const struct import_choice *choice = draft->choice;
    char text[64];
    record_add_meta(out, "source", file->path);
    record_add_meta(out, "source_sha256", file->sha256);
    record_add_meta(out, "source_format", import_format_name(file->format));
    record_add_meta(out, "imported_by", choice->command != NULL ? choice->command : "beamfit import");
    record_add_meta(out, draft->axis.over_frequency ? "frequency_from" : "time_from", draft->axis.from);
    if (draft->axis.over_frequency)
        fill_response_meta(choice, out);
    if (draft->said[0] != '\0')
        record_add_meta(out, "resampled", draft->said);
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

static enum bf_status check_scales(const struct draft *draft, struct bf_error *err)
{
    for (size_t i = 0; i < draft->choice->n_scales; i++) {
        bool used = false;
        for (size_t k = 0; k < draft->n_columns; k++)
            used |= scale_of(draft, &draft->columns[k]) == &draft->choice->scales[i];
        if (!used)
            return import_fail_no_channel(draft->file, "--scale", draft->choice->scales[i].name, err);
    }
    return BF_OK;
}

static enum bf_status make_axis(struct draft *draft, size_t time, struct bf_error *err)
{
    if (!(draft->choice->resample_Hz > 0))
        return import_make_axis(draft->file, draft->choice, time, draft->n_columns, draft->columns, &draft->axis, err);
    draft->resampled = bf_alloc(draft->n_columns, sizeof *draft->resampled);
    return import_resample(draft->file, draft->choice, time, draft->n_columns, draft->columns, &draft->axis,
                           draft->resampled, draft->said, err);
}

static enum bf_status make_record(struct draft *draft, struct record *out, struct bf_error *err)
{
    size_t time;
    if (import_choose_time(draft->file, draft->choice, &time, err) != BF_OK)
        return err->status;
    if ((draft->choice->n_picks > 0 ? take_picks(draft, err) : take_all(draft, time, err)) != BF_OK)
        return err->status;
    if (make_axis(draft, time, err) != BF_OK || cut(draft, err) != BF_OK || check_scales(draft, err) != BF_OK)
        return err->status;
    out->n = draft->last - draft->first + 1;
    out->over_frequency = draft->axis.over_frequency;
    out->dt_s = draft->axis.dt_s;
    out->t0_s = draft->axis.t0_s + (double)draft->first * draft->axis.dt_s;
    fill_meta(draft, out);
    for (size_t i = 0; i < draft->n_columns; i++)
        if (fill_column(draft, &draft->columns[i], out, err) != BF_OK)
            return err->status;
    return out->over_frequency ? check_response(draft->file, out, err) : BF_OK;
}

enum bf_status import_record(const struct import_file *file, const struct import_choice *choice, struct record *out,
                             struct bf_error *err)
{
    struct draft draft = {.file = file, .choice = choice};
    memset(out, 0, sizeof *out);
    enum bf_status status = make_record(&draft, out, err);
    for (size_t i = 0; i < draft.n_columns; i++) {
        free(draft.columns[i].name);
        if (draft.resampled != NULL)
            free(draft.resampled[i]);
    }
    free(draft.resampled);
    free(draft.columns);
    if (status != BF_OK)
        record_free(out);
    return status;
}
