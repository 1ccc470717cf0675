/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "import_resample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import_channel.h"
#include "import_units.h"
#include "maths/maths.h"

static const double most_share = 0.95; /* of the mean rate of the stamps, that can be asked for */
static const double longest_gap =
    4.0; /* steps of the new axis without a stamp: nothing can be known of what is in it */

double import_safe_rate(double mean_Hz)
{
    static const double round_ones[] = {1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0};
    const double most = 0.9 * mean_Hz, decade = pow(10.0, floor(log10(most)));
    double best = decade;
    for (size_t i = 0; i < sizeof round_ones / sizeof *round_ones; i++)
        if (round_ones[i] * decade <= most)
            best = round_ones[i] * decade;
    return best;
}

enum bf_status import_times(const struct import_file *file, const struct import_choice *choice, size_t time,
                            double **times_s, size_t *n, struct bf_error *err)
{
    const struct import_channel *c = &file->channels[time];
    double factor = 1.0;
    struct import_unit unit;
    if (c->unusable != NULL || c->n < 2)
        return bf_fail(err, BF_USAGE, "channel '%.*s' of %s has no two times; see --list", IMPORT_SHOWN, c->name,
                       file->path);
    if (!import_looks_like_time(c, &factor) && import_unit(c->unit, &unit))
        factor = unit.factor;
    if (choice->time_unit != NULL) {
        if (!import_unit(choice->time_unit, &unit) || strcmp(unit.SI, "s") != 0)
            return bf_fail(err, BF_USAGE, "--time-unit %.*s: not a unit of time; give s, ms, us or min", IMPORT_SHOWN,
                           choice->time_unit);
        factor = unit.factor;
    }
    for (size_t k = 0; k < c->n; k++)
        if (!isfinite(c->x[k]) || (k > 0 && c->x[k] < c->x[k - 1]))
            return bf_fail_at(err, file->path, import_line_of(file, k),
                              "channel '%.*s', sample %zu: %s; cut it off, or choose another --time", IMPORT_SHOWN,
                              c->name, k + 1, isfinite(c->x[k]) ? "time runs backwards" : "no number");
    *n = c->n;
    *times_s = bf_alloc(c->n, sizeof **times_s);
    for (size_t k = 0; k < c->n; k++)
        (*times_s)[k] = factor * c->x[k];
    return BF_OK;
}

/* What the stamps are like. */
struct stamps {
    size_t n;
    const double *t;
    double mean_s, jitter_s, gap_s; /* mean step, rms of the steps about it, longest step */
    size_t gap_at, doubled;         /* stamps that equal the one before */
};

static struct stamps look(const double t[], size_t n)
{
    struct stamps s = {.n = n, .t = t, .mean_s = (t[n - 1] - t[0]) / (double)(n - 1)};
    double square = 0.0;
    for (size_t k = 0; k < n; k++) {
        const double step = k > 0 ? t[k] - t[k - 1] : s.mean_s;
        square += (step - s.mean_s) * (step - s.mean_s);
        s.doubled += k > 0 && !(step > 0.0);
        if (step > s.gap_s)
            s.gap_s = step, s.gap_at = k;
    }
    s.jitter_s = sqrt(square / (double)n);
    return s;
}

static enum bf_status check(const struct import_file *file, double rate_Hz, const struct stamps *s,
                            struct bf_error *err)
{
    const double mean_Hz = 1.0 / s->mean_s;
    if (!(s->mean_s > 0.0))
        return bf_fail_at(err, file->path, 0, "all times are the same; choose another --time");
    if (rate_Hz > most_share * mean_Hz)
        return bf_fail(
            err, BF_USAGE,
            "--resample %.6g: the samples of %s come %.6g times a second, which carries no more than %.6g Hz; "
            "give --resample %.6g",
            rate_Hz, file->path, mean_Hz, most_share * mean_Hz, import_safe_rate(mean_Hz));
    if (s->gap_s * rate_Hz > longest_gap)
        return bf_fail_at(err, file->path, import_line_of(file, s->gap_at),
                          "sample %zu: %.6g s without a sample, from %.9g s on; what was in it nobody knows: cut there "
                          "with --from or --to, or give a lower --resample",
                          s->gap_at + 1, s->gap_s, s->t[s->gap_at - 1]);
    return BF_OK;
}

static enum bf_status check_column(const struct import_file *file, const struct import_channel *c, size_t n,
                                   struct bf_error *err)
{
    if (c->n != n)
        return bf_fail(err, BF_USAGE,
                       "channel '%.*s' of %s has %zu samples, its time axis has %zu; choose another "
                       "--time",
                       IMPORT_SHOWN, c->name, file->path, c->n, n);
    for (size_t k = 0; k < n; k++)
        if (!isfinite(c->x[k]))
            return bf_fail_at(err, file->path, import_line_of(file, k),
                              "channel '%.*s', sample %zu: no number; leave the channel out, or delete the line",
                              IMPORT_SHOWN, c->name, k + 1);
    return BF_OK;
}

static void write_down(const struct stamps *s, const struct import_axis *axis, double worst, char said[400])
{
    (void)snprintf(
        said, 400,
        "%zu samples at %.6g Hz, from %zu stamps at %.6g Hz on average (steps differ by %.3g s rms, longest "
        "step %.3g s, %zu stamps doubled); band-limited: nothing above %.4g Hz is kept; at the stamps it leaves "
        "up to %.3g %% of a channel",
        axis->n, 1.0 / axis->dt_s, s->n, 1.0 / s->mean_s, s->jitter_s, s->gap_s, s->doubled, 0.5 / axis->dt_s,
        100.0 * worst);
}

static enum bf_status resample(const struct import_file *file, const struct stamps *s, double rate_Hz, size_t n_columns,
                               const struct import_column columns[], struct import_axis *axis, double *x[],
                               char said[400], struct bf_error *err)
{
    double worst = 0.0;
    if (check(file, rate_Hz, s, err) != BF_OK)
        return err->status;
    axis->t0_s = s->t[0], axis->dt_s = 1.0 / rate_Hz;
    axis->n = (size_t)floor((s->t[s->n - 1] - s->t[0]) * rate_Hz * (1.0 + 1e-12)) + 1;
    for (size_t i = 0; i < n_columns; i++) {
        const struct import_channel *c = &file->channels[columns[i].channel];
        if (check_column(file, c, s->n, err) != BF_OK)
            return err->status;
        x[i] = bf_alloc(axis->n, sizeof *x[i]);
        const double left = resample_jittered(s->t, c->x, s->n, axis->t0_s, axis->dt_s, axis->n, x[i]);
        const double size = root_mean_square(c->x, s->n);
        worst = size > 0.0 ? fmax(worst, left / size) : worst;
    }
    write_down(s, axis, worst, said);
    return BF_OK;
}

enum bf_status import_resample(const struct import_file *file, const struct import_choice *choice, size_t time,
                               size_t n_columns, const struct import_column columns[], struct import_axis *axis,
                               double *x[], char said[400], struct bf_error *err)
{
    double *t = NULL;
    size_t n = 0;
    const struct import_channel *first = &file->channels[columns[0].channel];
    const size_t axis_channel = time != IMPORT_NO_AXIS ? time : first->axis;
    if (axis_channel == IMPORT_NO_AXIS)
        return bf_fail(err, BF_USAGE, "--resample needs time stamps, and %s has none; give --time CHANNEL", file->path);
    if (import_times(file, choice, axis_channel, &t, &n, err) != BF_OK)
        return err->status;
    const struct stamps s = look(t, n);
    const enum bf_status status = resample(file, &s, choice->resample_Hz, n_columns, columns, axis, x, said, err);
    (void)snprintf(axis->from, sizeof axis->from, "channel '%.*s', resampled", IMPORT_SHOWN,
                   file->channels[axis_channel].name);
    free(t);
    return status;
}
