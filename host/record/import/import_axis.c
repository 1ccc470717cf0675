/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The uniform time axis of an import: from a channel, from what the file states, or from the user. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "import_axis.h"
#include "import_channel.h"
#include "import_resample.h"
#include "import_units.h"
#include "record/record.h"

/* The channel that looks like time, if there is exactly one; *count says how many do. */
static size_t guess_time(const struct import_file *file, size_t *count)
{
    size_t found = IMPORT_NO_AXIS;
    double factor;
    *count = 0;
    for (size_t i = 0; i < file->n_channels; i++)
        if (file->channels[i].n >= 2 && file->channels[i].unusable == NULL && !import_is_axis(file, i) &&
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

enum bf_status import_choose_time(const struct import_file *file, const struct import_choice *choice, size_t *time,
                                  struct bf_error *err)
{
    size_t count, guess = guess_time(file, &count);
    *time = IMPORT_NO_AXIS;
    if (choice->frequency != NULL) {
        *time = import_find_channel(file, choice->frequency);
        return *time != IMPORT_NO_AXIS ? BF_OK : import_fail_no_channel(file, "--frequency", choice->frequency, err);
    }
    if (choice->time != NULL) {
        *time = import_find_channel(file, choice->time);
        return *time != IMPORT_NO_AXIS ? BF_OK : import_fail_no_channel(file, "--time", choice->time, err);
    }
    if (choice->rate_Hz > 0) {
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
                       IMPORT_SHOWN, file->channels[guess].name, IMPORT_SHOWN, file->channels[other].name);
    }
    if (count == 1) {
        *time = guess;
    } else if (!(file->rate_Hz > 0) && !file->has_names && first_is_uniform(file)) {
        *time = 0;
        bf_warn("%s: channel '%.*s' increases uniformly and is taken as time in %s (--time, --time-unit and --rate say "
                "otherwise)",
                file->path, IMPORT_SHOWN, file->channels[0].name, choice->time_unit != NULL ? choice->time_unit : "s");
    }
    return BF_OK;
}

static enum bf_status fail_uneven(const struct import_file *file, const struct import_channel *c, double factor_to_s,
                                  size_t bad, const char *why, struct bf_error *err)
{
    const double mean_Hz = (double)(c->n - 1) / (factor_to_s * (c->x[c->n - 1] - c->x[0]));
    char rate[40] = "HZ";
    if (mean_Hz > 0.0 && isfinite(mean_Hz))
        snprintf(rate, sizeof rate, "%.6g", import_safe_rate(mean_Hz));
    return bf_fail_at(
        err, file->path, import_line_of(file, bad),
        "channel '%.*s', sample %zu: %s; when the samples are uniform and only their times are wrong give "
        "--rate HZ, when the times are right --resample %s",
        IMPORT_SHOWN, c->name, bad + 1, why, rate);
}

static enum bf_status axis_of_channel(const struct import_file *file, const struct import_choice *choice, size_t time,
                                      struct import_axis *axis, struct bf_error *err)
{
    const struct import_channel *c = &file->channels[time];
    struct import_unit unit = {"s", "s", 1};
    size_t bad;
    char why[256];
    if (c->unusable != NULL || c->n < 2)
        return bf_fail(err, BF_USAGE, "--time: channel '%.*s' of %s has no two samples; see --list", IMPORT_SHOWN,
                       c->name, file->path);
    if (!import_looks_like_time(c, &unit.factor) && import_unit(c->unit, &unit) && strcmp(unit.SI, "s") != 0)
        return bf_fail(err, BF_USAGE, "--time: channel '%.*s' of %s is in %s, not in a unit of time", IMPORT_SHOWN,
                       c->name, file->path, c->unit);
    if (choice->time_unit != NULL && (!import_unit(choice->time_unit, &unit) || strcmp(unit.SI, "s") != 0))
        return bf_fail(err, BF_USAGE, "--time-unit %.*s: not a unit of time; give s, ms, us or min", IMPORT_SHOWN,
                       choice->time_unit);
    if (!time_axis_fit(c->x, c->n, c->digits, &axis->t0_s, &axis->dt_s, &bad, why))
        return fail_uneven(file, c, unit.factor, bad, why, err);
    axis->t0_s *= unit.factor;
    axis->dt_s = unit.factor < 1 ? axis->dt_s / round(1 / unit.factor) : axis->dt_s * unit.factor;
    axis->n = c->n;
    snprintf(axis->from, sizeof axis->from, "channel '%.*s' in %s", IMPORT_SHOWN, c->name,
             unit.factor == 1      ? "s"
             : unit.factor == 1e-3 ? "ms"
             : unit.factor == 1e-6 ? "us"
             : unit.factor == 60   ? "min"
                                   : "ns");
    return BF_OK;
}

static enum bf_status axis_of_frequencies(const struct import_file *file, size_t channel, struct import_axis *axis,
                                          struct bf_error *err)
{
    const struct import_channel *c = &file->channels[channel];
    size_t bad;
    char why[256];
    if (c->unusable != NULL || c->n < 2)
        return bf_fail(err, BF_USAGE, "--frequency: channel '%.*s' of %s has no two lines; see --list", IMPORT_SHOWN,
                       c->name, file->path);
    if (!time_axis_fit(c->x, c->n, c->digits, &axis->t0_s, &axis->dt_s, &bad, why))
        return bf_fail_at(err, file->path, import_line_of(file, bad),
                          "channel '%.*s', line %zu: %s; a frequency response needs lines at one distance, in Hz",
                          IMPORT_SHOWN, c->name, bad + 1, why);
    axis->n = c->n;
    axis->over_frequency = true;
    snprintf(axis->from, sizeof axis->from, "channel '%.*s' in Hz", IMPORT_SHOWN, c->name);
    return BF_OK;
}

enum bf_status import_make_axis(const struct import_file *file, const struct import_choice *choice, size_t time,
                                size_t n_columns, const struct import_column columns[], struct import_axis *axis,
                                struct bf_error *err)
{
    const struct import_channel *first = &file->channels[columns[0].channel];
    axis->n = first->n;
    if (choice->frequency != NULL) {
        if (axis_of_frequencies(file, time, axis, err) != BF_OK)
            return err->status;
    } else if (choice->rate_Hz > 0) {
        axis->dt_s = 1 / choice->rate_Hz;
        snprintf(axis->from, sizeof axis->from, "--rate %.9g Hz", choice->rate_Hz);
    } else if (time != IMPORT_NO_AXIS || first->axis != IMPORT_NO_AXIS) {
        if (axis_of_channel(file, choice, time != IMPORT_NO_AXIS ? time : first->axis, axis, err) != BF_OK)
            return err->status;
    } else if (first->dt_s > 0) {
        axis->over_frequency = first->over_frequency;
        axis->t0_s = first->t0_s;
        axis->dt_s = first->dt_s;
        snprintf(axis->from, sizeof axis->from, "the file's start and step");
    } else if (file->rate_Hz > 0) {
        axis->dt_s = 1 / file->rate_Hz;
        snprintf(axis->from, sizeof axis->from, "%.9g Hz as stated in the file (%.80s)", file->rate_Hz,
                 file->rate_from);
    } else {
        return bf_fail(err, BF_USAGE, "%s has no time axis; give --time CHANNEL or --rate HZ (see --list)%s%.*s%s",
                       file->path, first_is_uniform(file) ? "; channel '" : "",
                       first_is_uniform(file) ? IMPORT_SHOWN : 0, file->channels[0].name,
                       first_is_uniform(file) ? "' increases uniformly" : "");
    }
    for (size_t i = 0; i < n_columns; i++) {
        const struct import_channel *c = &file->channels[columns[i].channel];
        if (c->n != axis->n)
            return bf_fail(err, BF_USAGE,
                           "channel '%.*s' of %s has %zu samples, its time axis has %zu; choose another --time",
                           IMPORT_SHOWN, c->name, file->path, c->n, axis->n);
    }
    if (axis->n < 2 || !(axis->dt_s > 0) || !isfinite(axis->dt_s) || !isfinite(axis->t0_s))
        return bf_fail_at(err, file->path, 0, "the recording has no two samples with a positive time step");
    return BF_OK;
}
