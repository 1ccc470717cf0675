/* SPDX-License-Identifier: GPL-3.0-or-later */
/* findings.c — overload, hits and windows of a record's columns, in words; the gate of a force. */
#include "findings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_RUN = 3 };                 /* samples at the extreme value; 2 where noise would part them (short hits) */
static const double parts_equals = 3.0; /* noise at rest over the smallest step between values */
static const double run_up = 0.02; /* of the range: the step into an overload; a smooth top is reached more slowly */
static const double logic_share = 0.2; /* of the record at the extreme value: a trigger, no overload */
static const double still_on = 0.05;   /* of the peak, at the last sample */

static struct record_finding *findings_add(struct record_findings *out, enum record_finding_kind kind, size_t column,
                                           size_t sample)
{
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n] = (struct record_finding){.kind = kind, .column = column, .sample = sample};
    return &out->all[out->n++];
}

void record_findings_free(struct record_findings *findings)
{
    free(findings->all);
    *findings = (struct record_findings){0};
}

static double time_of(const struct record *record, size_t sample)
{
    return record->t0_s + (double)sample * record->dt_s;
}

/* ---- Overload ---- */

/* Runs of the value `extreme`: the first that an overload makes, and the samples in all of them. */
static size_t overload_runs(const double x[], size_t n, double extreme, double range, size_t least, size_t *first,
                            size_t *count, size_t *all)
{
    size_t runs = 0;
    *count = *all = 0;
    for (size_t k = 0; k < n; k++) {
        const size_t begin = k;
        while (k < n && !(fabs(x[k] - extreme) > 1e-9 * range))
            k++;
        *all += k - begin;
        if (k - begin < least)
            continue;
        const double before = begin > 0 ? fabs(x[begin] - x[begin - 1]) : 0.0;
        const double after = k < n ? fabs(x[k] - x[k - 1]) : 0.0;
        if (fmax(before, after) < run_up * range)
            continue;
        if (runs++ == 0)
            *first = begin;
        *count += k - begin;
    }
    return runs;
}

static void find_overload(const struct record *record, size_t column, double rest, size_t least,
                          struct record_findings *out)
{
    const double *x = record->columns[column].x;
    double low = x[0], high = x[0];
    for (size_t k = 1; k < record->n; k++)
        low = fmin(low, x[k]), high = fmax(high, x[k]);
    const double range = high - low, ends[2] = {low, high};
    for (size_t e = 0; e < 2; e++) {
        size_t first = 0, count, all;
        if (!(fabs(ends[e] - rest) > 0.1 * range))
            continue; /* rest itself */
        const size_t runs = overload_runs(x, record->n, ends[e], range, least, &first, &count, &all);
        if (runs == 0 || (double)all > logic_share * (double)record->n)
            continue;
        struct record_finding *f = findings_add(out, FINDING_OVERLOAD, column, first);
        f->n = count, f->value = ends[e];
        (void)snprintf(
            f->text, sizeof f->text,
            "%.60s: overload. %zu samples in %zu stretch%s stand at %.5g, the end of the recorder's range, the first "
            "from sample %zu (%.5g s) on. What was above is lost: record again with a wider range, or leave the "
            "record out.",
            record->columns[column].name, count, runs, runs == 1 ? "" : "es", ends[e], first + 1,
            time_of(record, first));
    }
}

/* Two equal samples at a hit's top are no chance where the noise is larger than the steps of the recorder. */
static size_t least_run(const double u[], size_t n, const struct hits *hits)
{
    double step = HUGE_VAL;
    for (size_t k = 1; k < n; k++) {
        const double one = fabs(u[k] - u[k - 1]);
        step = one > 0.0 && one < step ? one : step;
    }
    return hits->noise > parts_equals * step ? 2 : LEAST_RUN;
}

/* ---- Hits ---- */

static void say_hits(const struct record *record, size_t column, const struct hits *hits, struct record_findings *out)
{
    size_t largest = 0, second = SIZE_MAX;
    for (size_t i = 1; i < hits->n; i++)
        largest = fabs(hits->hit[i].peak) > fabs(hits->hit[largest].peak) ? i : largest;
    for (size_t i = 0; i < hits->n; i++)
        if (i != largest && (second == SIZE_MAX || fabs(hits->hit[i].peak) > fabs(hits->hit[second].peak)))
            second = i;
    const struct hit *a = &hits->hit[largest], *b = &hits->hit[second];
    struct record_finding *f = findings_add(out, FINDING_HITS, column, b->top);
    f->n = hits->n, f->value = b->peak / a->peak;
    (void)snprintf(
        f->text, sizeof f->text,
        "%.60s: %zu hits. The largest (%.4g) is at sample %zu (%.5g s), the next (%.4g) at sample %zu (%.5g s). A fit "
        "in time takes both, because the force was recorded; a frequency response or a free decay after the first "
        "does not.",
        record->columns[column].name, hits->n, a->peak, a->top + 1, time_of(record, a->top), b->peak, b->top + 1,
        time_of(record, b->top));
}

static void say_open_end(const struct record *record, size_t column, const struct hit *hit, struct record_findings *out)
{
    struct record_finding *f = findings_add(out, FINDING_OPEN_END, column, hit->first);
    (void)snprintf(
        f->text, sizeof f->text,
        "%.60s: the hit that begins at sample %zu (%.5g s) is not over at the record's end; record longer, or cut "
        "before it (import --to %.5g).",
        record->columns[column].name, hit->first + 1, time_of(record, hit->first),
        time_of(record, hit->first > 2 ? hit->first - 2 : 0));
}

static void say_open_begin(const struct record *record, size_t column, const struct hit *hit,
                           struct record_findings *out)
{
    struct record_finding *f = findings_add(out, FINDING_OPEN_BEGIN, column, 0);
    f->n = hit->last + 1;
    (void)snprintf(
        f->text, sizeof f->text,
        "%.60s: the record begins within a hit, which is over at sample %zu (%.5g s); what the hammer did before is "
        "lost. Trigger earlier, or cut to after the hit and fit a free decay (import --from %.5g --free-decay).",
        record->columns[column].name, hit->last + 1, time_of(record, hit->last),
        time_of(record, hit->last + 2 < record->n ? hit->last + 2 : hit->last));
}

/*
 * Exactly one value from some sample after the last hit on, and noise between or before the first: a recorder's idle code would flicker. Not where the noise was
 * taken off here.
 */
static void find_window(const struct record *record, size_t column, const struct hits *hits,
                        struct record_findings *out)
{
    enum { LEAST_STILL = 64, LEAST_NOISY = 16 };
    static const double same = 1e-12, noise = 1e-5; /* of the peak */
    const double *u = record->columns[column].x, peak = fabs(hits->hit[hits->n - 1].peak);
    const size_t last = hits->hit[hits->n - 1].last, n = record->n;
    size_t still = n - 1, noisy = 0;
    while (still > last + 1 && !(fabs(u[still - 1] - u[n - 1]) > same * peak))
        still--;
    for (size_t k = last + 1; k < still; k++)
        noisy += fabs(u[k] - u[n - 1]) > noise * peak;
    size_t before = 0, noisy_before = 0;
    for (; before < hits->hit[0].first; before++)
        noisy_before += fabs(u[before] - u[n - 1]) > noise * peak;
    const bool between = noisy >= LEAST_NOISY && 2 * noisy >= still - last;
    if (record->columns[column].noise != NULL || n - still < LEAST_STILL ||
        !(between || (noisy_before >= LEAST_NOISY && 2 * noisy_before >= before)))
        return;
    struct record_finding *f = findings_add(out, FINDING_WINDOW, column, still);
    f->n = n - still;
    (void)snprintf(
        f->text, sizeof f->text,
        "%.60s: from sample %zu (%.5g s) on it is exactly %.4g: a force window. A second hit after that would not be "
        "seen; if the answers had an exponential window too, their damping is too high by its time constant.",
        record->columns[column].name, still + 1, time_of(record, still), u[n - 1]);
}

static void find_in_force(const struct record *record, size_t column, struct hits *hits, struct record_findings *out)
{
    const double *u = record->columns[column].x;
    hits_find(u, record->n, hits);
    find_overload(record, column, hits->offset, least_run(u, record->n, hits), out);
    if (hits->n == 0)
        return;
    const struct hit *last = &hits->hit[hits->n - 1];
    if (hits->n > 1)
        say_hits(record, column, hits, out);
    if (hits->hit[0].first == 0 && fabs(u[0] - hits->offset) > still_on * fabs(hits->hit[0].peak))
        say_open_begin(record, column, &hits->hit[0], out);
    if (last->last == record->n - 1 && fabs(u[record->n - 1] - hits->offset) > still_on * fabs(last->peak))
        say_open_end(record, column, last, out);
    else
        find_window(record, column, hits, out);
}

static double mean(const double x[], size_t n)
{
    double sum = 0.0;
    for (size_t k = 0; k < n; k++)
        sum += x[k];
    return sum / (double)n;
}

/* ---- Channels that do not answer ---- */

/* rms about the mean of the part; 0 for an empty one */
static double spread(const double x[], size_t n)
{
    const double centre = n > 0 ? mean(x, n) : 0.0;
    double square = 0.0;
    for (size_t k = 0; k < n; k++)
        square += (x[k] - centre) * (x[k] - centre);
    return n > 0 ? sqrt(square / (double)n) : 0.0;
}

/* quiet: samples before the first hit, last: the last of the last hit */
static void find_no_answer(const struct record *record, size_t column, size_t quiet, size_t last,
                           struct record_findings *out)
{
    enum { LEAST = 32, LOOK = 512 }; /* samples before, after the hits */
    static const double louder = 1.3;
    const double *x = record->columns[column].x;
    const size_t left = record->n - last - 1, look = left < LOOK ? left : LOOK;
    const double before = spread(x, quiet), after = spread(x + last + 1, look);
    const bool constant = !(spread(x, record->n) > 0.0);
    if (!constant && (quiet < LEAST || look < LEAST || after > louder * before))
        return;
    struct record_finding *f = findings_add(out, FINDING_NO_ANSWER, column, last);
    f->value = after;
    (void)snprintf(
        f->text, sizeof f->text,
        "%.60s: no answer. %s after the hit, at sample %zu (%.5g s), as before it (%.3g rms): is the cable in, the "
        "sensor glued, the column the right one?",
        record->columns[column].name, constant ? "It is one value throughout," : "It is as quiet", last + 1,
        time_of(record, last), before);
}

void record_findings_find(const struct record *record, bool (*is_force)(const void *, const char *),
                          bool (*is_signal)(const void *, const char *), const void *context,
                          struct record_findings *out)
{
    size_t quiet = SIZE_MAX, last = 0; /* samples before the first hit of any force; end of the last */
    struct record_finding hum;
    *out = (struct record_findings){0};
    if (record->kind != RECORD_SAMPLES || record->over_frequency || record_is_periodic(record))
        return; /* no time has gone by in it */
    for (size_t c = 0; c < record->n_columns; c++) {
        struct hits hits;
        if (!is_force(context, record->columns[c].name))
            continue;
        find_in_force(record, c, &hits, out);
        if (hits.n > 0 && hits.hit[0].first < quiet)
            quiet = hits.hit[0].first;
        if (hits.n > 0 && hits.hit[hits.n - 1].last > last)
            last = hits.hit[hits.n - 1].last;
    }
    for (size_t c = 0; c < record->n_columns; c++) {
        if (is_force(context, record->columns[c].name) || !is_signal(context, record->columns[c].name))
            continue;
        find_overload(record, c, mean(record->columns[c].x, record->n), LEAST_RUN, out);
        if (quiet != SIZE_MAX && findings_hum(record, c, quiet, &hum))
            *findings_add(out, FINDING_HUM, c, 0) = hum;
        else if (quiet != SIZE_MAX)
            find_no_answer(record, c, quiet, last, out);
    }
}

/* ---- By their names ---- */

static bool ends_with(const char *column, const char *const units[], size_t n)
{
    const char *last = strrchr(column, '_');
    for (size_t i = 0; last != NULL && i < n; i++)
        if (strcmp(last + 1, units[i]) == 0)
            return true;
    return false;
}

bool record_is_force(const void *context, const char *column)
{
    static const char *const units[] = {"N", "lbf", "kN", "mN"};
    (void)context;
    return ends_with(column, units, sizeof units / sizeof *units);
}

bool record_is_signal(const void *context, const char *column)
{
    static const char *const units[] = {"mps2", "g", "mps", "m", "V", "mV", "mm", "um", "mmps", "strain", "ustrain"};
    (void)context;
    return ends_with(column, units, sizeof units / sizeof *units);
}

/* ---- The gate ---- */

/* inside[n] */
static void mark_hits(const struct hits *hits, size_t n, bool inside[])
{
    enum { LEAST_MARGIN = 2 };
    for (size_t i = 0; i < hits->n; i++) {
        const struct hit *hit = &hits->hit[i];
        const size_t half = (hit->last - hit->first + 1) / 2, margin = half > LEAST_MARGIN ? half : LEAST_MARGIN;
        const size_t first = hit->first > margin ? hit->first - margin : 0;
        for (size_t k = first; k <= hit->last + margin && k < n; k++)
            inside[k] = true;
    }
}

enum bf_status record_gate(struct record *record, const char *column, double from_s, double to_s, char said[200],
                           struct bf_error *err)
{
    struct hits hits;
    size_t c = 0, kept = 0;
    while (c < record->n_columns && strcmp(record->columns[c].name, column) != 0)
        c++;
    if (c == record->n_columns)
        return bf_fail(err, BF_USAGE, "--gate %.60s: the record has no such column", column);
    double *u = record->columns[c].x;
    hits_find(u, record->n, &hits);
    if (hits.n == 0 && !(from_s < to_s))
        return bf_fail(
            err, BF_USAGE,
            "--gate %.60s: no hit stands out of what is there most of the time; a shaker's force has no gate, or "
            "say when the hit is: --gate %.60s=FROM:TO in seconds",
            column, column);
    bool *inside = bf_alloc(record->n, sizeof *inside);
    for (size_t k = 0; k < record->n && from_s < to_s; k++)
        inside[k] = time_of(record, k) >= from_s && time_of(record, k) <= to_s;
    if (!(from_s < to_s))
        mark_hits(&hits, record->n, inside);
    for (size_t k = 0; k < record->n; k++) {
        u[k] = inside[k] ? u[k] - hits.offset : 0.0;
        kept += inside[k];
    }
    free(inside);
    if (kept == 0)
        return bf_fail(err, BF_USAGE, "--gate %.60s: %.9g s to %.9g s is outside the record", column, from_s, to_s);
    (void)snprintf(said, 200,
                   "0 outside %zu samples around %zu hit%s; offset of %.4g taken off, noise of %.3g rms left out", kept,
                   hits.n, hits.n == 1 ? "" : "s", hits.offset, hits.noise);
    return BF_OK;
}
