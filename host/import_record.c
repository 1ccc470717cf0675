/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The second step of an import: chosen channels of a foreign file over one uniform time axis. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"
#include "time_axis.h"

enum { SHOWN = 60 }; /* characters of a name in a message */

/* A column to be: channel and name (owned). */
struct column {
    size_t channel;
    char *name;
};

/* The uniform axis of the record and where it is from. */
struct axis {
    size_t n;
    double t0_s, dt_s;
    size_t channel; /* that held the times, or IMPORT_NO_AXIS */
    char from[160];
};

struct work {
    const struct import_file *file;
    const struct import_choice *choice;
    size_t n_columns;
    struct column *columns;
    struct axis axis;
    size_t first, last; /* samples kept, both included */
};

static long line_of(const struct import_file *file, size_t sample)
{
    return sample < file->n_lines ? file->lines[sample] : 0;
}

/* By the name in the file, by the column's name to be, or "#3". IMPORT_NO_AXIS when there is none. */
static size_t find_channel(const struct import_file *file, const char *name)
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

static enum bf_status fail_no_channel(const struct import_file *file, const char *option, const char *name,
                                      struct bf_error *err)
{
    char list[400] = "";
    for (size_t i = 0; i < file->n_channels && strlen(list) + SHOWN + 8 < sizeof list; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%.*s", i > 0 ? ", " : "", SHOWN,
                 file->channels[i].name);
    return bf_fail(err, BF_USAGE, "%s %.*s: %s has no such channel; it has %s (see --list)", option, SHOWN, name,
                   file->path, list);
}

static enum bf_status add_column(struct work *w, size_t channel, const char *name, struct bf_error *err)
{
    const struct import_channel *c = &w->file->channels[channel];
    if (c->unusable != NULL)
        return bf_fail(err, BF_USAGE, "channel '%.*s' of %s cannot become a column: %s", SHOWN, c->name, w->file->path,
                       c->unusable);
    char *own = name != NULL ? bf_strdup(name) : import_column_name(c);
    for (size_t i = 0; i < w->n_columns; i++)
        if (strcmp(w->columns[i].name, own) == 0) {
            bf_fail(err, BF_USAGE, "two channels would become column '%.*s'; rename one with --channel %.*s=NEW", SHOWN,
                    own, SHOWN, c->name);
            free(own);
            return err->status;
        }
    if (own[0] == '\0' || own[strcspn(own, ",\"'\n\r\t #")] != '\0' || strcmp(own, "time_s") == 0) {
        bf_fail(err, BF_USAGE, "'%.*s' cannot be the name of a column; use letters, digits and '_'", SHOWN, own);
        free(own);
        return err->status;
    }
    w->columns = bf_grow(w->columns, w->n_columns + 1, sizeof *w->columns);
    w->columns[w->n_columns++] = (struct column){channel, own};
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

static bool is_axis(const struct import_file *file, size_t channel)
{
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].axis == channel)
            return true;
    return false;
}

/* Every channel that is neither time nor a lone number, when all fit together. */
static enum bf_status take_all(struct work *w, size_t time, struct bf_error *err)
{
    const struct import_file *file = w->file;
    double factor;
    for (size_t i = 0; i < file->n_channels; i++) {
        const struct import_channel *c = &file->channels[i];
        if (i == time || is_axis(file, i) || c->unusable != NULL || c->n < 2)
            continue;
        if (import_looks_like_time(c, &factor)) {
            bf_warn("%s: channel '%.*s' is left out, it looks like another time axis (--channel takes it)", file->path,
                    SHOWN, c->name);
            continue;
        }
        if (w->n_columns > 0 && !same_group(file, w->columns[0].channel, i))
            return bf_fail(err, BF_USAGE,
                           "%s: channels '%.*s' and '%.*s' have different samples or time axes; choose those of one "
                           "with --channel (see --list)",
                           file->path, SHOWN, file->channels[w->columns[0].channel].name, SHOWN, c->name);
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

static enum bf_status take_picks(struct work *w, struct bf_error *err)
{
    for (size_t i = 0; i < w->choice->n_picks; i++) {
        const struct import_pick *pick = &w->choice->picks[i];
        size_t channel = find_channel(w->file, pick->from);
        if (channel == IMPORT_NO_AXIS)
            return fail_no_channel(w->file, "--channel", pick->from, err);
        if (w->n_columns > 0 && !same_group(w->file, w->columns[0].channel, channel))
            return bf_fail(err, BF_USAGE,
                           "channels '%.*s' and '%.*s' of %s have different samples or time axes; import them into two "
                           "records",
                           SHOWN, w->file->channels[w->columns[0].channel].name, SHOWN, pick->from, w->file->path);
        if (add_column(w, channel, pick->to, err) != BF_OK)
            return err->status;
    }
    return BF_OK;
}

/* The channel that looks like time, if there is exactly one; *count says how many do. */
static size_t guess_time(const struct import_file *file, size_t *count)
{
    size_t found = IMPORT_NO_AXIS;
    double factor;
    *count = 0;
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].n >= 2 && file->channels[i].unusable == NULL && !is_axis(file, i) &&
            import_looks_like_time(&file->channels[i], &factor)) {
            found = *count == 0 ? i : found;
            ++*count;
        }
    return found;
}

/* Does the first channel increase uniformly, and not by 1 as a counter of samples does? */
static bool first_is_uniform(const struct import_file *file)
{
    const struct import_channel *c = &file->channels[0];
    double t0, dt;
    size_t bad;
    char why[256];
    for (size_t k = 0; k < c->n; k++)
        if (!isfinite(c->x[k]))
            return false;
    return file->n_channels > 1 && c->n >= 3 && c->unusable == NULL &&
           time_axis_fit(c->x, c->n, c->digits, &t0, &dt, &bad, why) && dt != 1;
}

/* Which channel holds the times of the record; IMPORT_NO_AXIS: none, the file or the user states a rate. */
static enum bf_status choose_time(const struct work *w, size_t *time, struct bf_error *err)
{
    const struct import_file *file = w->file;
    size_t count, guess = guess_time(file, &count);
    *time = IMPORT_NO_AXIS;
    if (w->choice->time != NULL) {
        *time = find_channel(file, w->choice->time);
        return *time != IMPORT_NO_AXIS ? BF_OK : fail_no_channel(file, "--time", w->choice->time, err);
    }
    if (w->choice->rate_Hz > 0) {
        *time = count == 1 ? guess : IMPORT_NO_AXIS; /* left out of the columns */
        return BF_OK;
    }
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].axis != IMPORT_NO_AXIS || file->channels[i].dt_s > 0)
            return BF_OK; /* the file states an axis by itself */
    if (count > 1) {
        size_t other = guess + 1;
        double factor;
        while (!import_looks_like_time(&file->channels[other], &factor))
            other++;
        return bf_fail(err, BF_USAGE, "%s: '%.*s' and '%.*s' both look like time; choose one with --time", file->path,
                       SHOWN, file->channels[guess].name, SHOWN, file->channels[other].name);
    }
    if (count == 1) {
        *time = guess;
    } else if (!(file->rate_Hz > 0) && !file->has_names && first_is_uniform(file)) {
        *time = 0;
        bf_warn("%s: channel '%.*s' increases uniformly and is taken as time in %s (--time, --time-unit and --rate say "
                "otherwise)",
                file->path, SHOWN, file->channels[0].name, w->choice->time_unit != NULL ? w->choice->time_unit : "s");
    }
    return BF_OK;
}

static enum bf_status axis_of_channel(struct work *w, size_t time, struct bf_error *err)
{
    const struct import_file *file = w->file;
    const struct import_channel *c = &file->channels[time];
    struct import_unit unit = {"s", "s", 1};
    size_t bad;
    char why[256];
    if (c->unusable != NULL || c->n < 2)
        return bf_fail(err, BF_USAGE, "--time: channel '%.*s' of %s has no two samples; see --list", SHOWN, c->name,
                       file->path);
    if (!import_looks_like_time(c, &unit.factor) && import_unit(c->unit, &unit) && strcmp(unit.SI, "s") != 0)
        return bf_fail(err, BF_USAGE, "--time: channel '%.*s' of %s is in %s, not in a unit of time", SHOWN, c->name,
                       file->path, c->unit);
    if (w->choice->time_unit != NULL && (!import_unit(w->choice->time_unit, &unit) || strcmp(unit.SI, "s") != 0))
        return bf_fail(err, BF_USAGE, "--time-unit %.*s: not a unit of time; give s, ms, us or min", SHOWN,
                       w->choice->time_unit);
    if (!time_axis_fit(c->x, c->n, c->digits, &w->axis.t0_s, &w->axis.dt_s, &bad, why))
        return bf_fail_at(
            err, file->path, line_of(file, bad),
            "channel '%.*s', sample %zu: %s; when the samples are uniform give --rate HZ, else resample them", SHOWN,
            c->name, bad + 1, why);
    w->axis.t0_s *= unit.factor;
    w->axis.dt_s = unit.factor < 1 ? w->axis.dt_s / round(1 / unit.factor) : w->axis.dt_s * unit.factor;
    w->axis.n = c->n;
    w->axis.channel = time;
    snprintf(w->axis.from, sizeof w->axis.from, "channel '%.*s' in %s", SHOWN, c->name,
             unit.factor == 1      ? "s"
             : unit.factor == 1e-3 ? "ms"
             : unit.factor == 1e-6 ? "us"
             : unit.factor == 60   ? "min"
                                   : "ns");
    return BF_OK;
}

static enum bf_status make_axis(struct work *w, size_t time, struct bf_error *err)
{
    const struct import_file *file = w->file;
    const struct import_channel *first = &file->channels[w->columns[0].channel];
    struct axis *axis = &w->axis;
    axis->n = first->n;
    axis->channel = IMPORT_NO_AXIS;
    if (w->choice->rate_Hz > 0) {
        axis->dt_s = 1 / w->choice->rate_Hz;
        snprintf(axis->from, sizeof axis->from, "--rate %.9g Hz", w->choice->rate_Hz);
    } else if (time != IMPORT_NO_AXIS || first->axis != IMPORT_NO_AXIS) {
        if (axis_of_channel(w, time != IMPORT_NO_AXIS ? time : first->axis, err) != BF_OK)
            return err->status;
    } else if (first->dt_s > 0) {
        axis->t0_s = first->t0_s;
        axis->dt_s = first->dt_s;
        snprintf(axis->from, sizeof axis->from, "the file's start and step");
    } else if (file->rate_Hz > 0) {
        axis->dt_s = 1 / file->rate_Hz;
        snprintf(axis->from, sizeof axis->from, "%.9g Hz as stated in the file (%.80s)", file->rate_Hz,
                 file->rate_from);
    } else {
        return bf_fail(err, BF_USAGE, "%s has no time axis; give --time CHANNEL or --rate HZ (see --list)%s%.*s%s",
                       file->path, first_is_uniform(file) ? "; channel '" : "", first_is_uniform(file) ? SHOWN : 0,
                       file->channels[0].name, first_is_uniform(file) ? "' increases uniformly" : "");
    }
    for (size_t i = 0; i < w->n_columns; i++) {
        const struct import_channel *c = &file->channels[w->columns[i].channel];
        if (c->n != axis->n)
            return bf_fail(err, BF_USAGE,
                           "channel '%.*s' of %s has %zu samples, its time axis has %zu; choose another --time", SHOWN,
                           c->name, file->path, c->n, axis->n);
    }
    if (axis->n < 2 || !(axis->dt_s > 0) || !isfinite(axis->dt_s) || !isfinite(axis->t0_s))
        return bf_fail_at(err, file->path, 0, "the recording has no two samples with a positive time step");
    return BF_OK;
}

/* --from and --to: samples within, with half a millionth of a step of mercy for rounding. */
static enum bf_status cut(struct work *w, struct bf_error *err)
{
    const struct import_choice *choice = w->choice;
    const struct axis *axis = &w->axis;
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
static const struct import_scale *scale_of(const struct work *w, const struct column *column)
{
    for (size_t i = 0; i < w->choice->n_scales; i++) {
        const char *name = w->choice->scales[i].name;
        if (strcmp(name, column->name) == 0 || find_channel(w->file, name) == column->channel)
            return &w->choice->scales[i];
    }
    return NULL;
}

static void warn_of_unit(const struct column *column, const struct import_channel *c)
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

static enum bf_status fill_column(const struct work *w, const struct column *column, struct record *out,
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
        return bf_fail_at(err, file->path, line_of(file, w->first + k),
                          "channel '%.*s', sample %zu: %s; cut it off with --from or --to, or leave the channel out",
                          SHOWN, c->name, w->first + k + 1, isnan(c->x[w->first + k]) ? "no number" : "too large");
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
    snprintf(key, sizeof key, "channel_%.*s", SHOWN, column->name);
    snprintf(text, sizeof text, "'%.*s'%s%.*s", SHOWN, c->name, c->about[0] != '\0' ? ", " : "", 120, c->about);
    record_add_meta(out, key, text);
    if (stated[0] != '\0') {
        snprintf(key, sizeof key, "unit_%.*s", SHOWN, column->name);
        record_add_meta(out, key, stated);
    }
    if (scale != NULL) {
        snprintf(key, sizeof key, "scale_%.*s", SHOWN, column->name);
        snprintf(text, sizeof text, "%.12g%s%.*s", factor, c->unit[0] != '\0' ? " applied to values in " : "", SHOWN,
                 c->unit);
        record_add_meta(out, key, text);
    }
    return BF_OK;
}

/* Provenance first, then what beamfit acts on, then what the file said of itself. */
static void fill_meta(const struct work *w, struct record *out)
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
    for (size_t i = 0; i < file->n_meta; i++)
        if (record_meta(out, file->meta[i].key) == NULL && file->meta[i].value[0] != '\0')
            record_add_meta(out, file->meta[i].key, file->meta[i].value);
}

static enum bf_status check_scales(const struct work *w, struct bf_error *err)
{
    for (size_t i = 0; i < w->choice->n_scales; i++) {
        bool used = false;
        for (size_t k = 0; k < w->n_columns; k++)
            used |= scale_of(w, &w->columns[k]) == &w->choice->scales[i];
        if (!used)
            return fail_no_channel(w->file, "--scale", w->choice->scales[i].name, err);
    }
    return BF_OK;
}

static enum bf_status make_record(struct work *w, struct record *out, struct bf_error *err)
{
    size_t time;
    if (choose_time(w, &time, err) != BF_OK)
        return err->status;
    if ((w->choice->n_picks > 0 ? take_picks(w, err) : take_all(w, time, err)) != BF_OK)
        return err->status;
    if (make_axis(w, time, err) != BF_OK || cut(w, err) != BF_OK || check_scales(w, err) != BF_OK)
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
    struct work w = {.file = file, .choice = choice};
    memset(out, 0, sizeof *out);
    enum bf_status status = make_record(&w, out, err);
    for (size_t i = 0; i < w.n_columns; i++)
        free(w.columns[i].name);
    free(w.columns);
    if (status != BF_OK)
        record_free(out);
    return status;
}
