/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_GAP_LINES = 100 };

void recording_begin(struct recording *r, double sample_Hz, unsigned prescale)
{
    *r = (struct recording){.prescale = prescale, .sample_Hz = sample_Hz};
}

void recording_add(struct recording *r, const struct beam_live *live)
{
    if (r->n > 0 && (int32_t)(live->sequence - r->live[r->n - 1].sequence) <= 0)
        return;
    if (r->n == r->room) {
        r->room = r->room > 0 ? 2 * r->room : 4096;
        r->live = bf_grow(r->live, r->room, sizeof *r->live);
    }
    r->live[r->n++] = *live;
}

void recording_drop_before(struct recording *r, uint32_t sequence)
{
    size_t keep = 0;
    while (keep < r->n && (int32_t)(r->live[keep].sequence - sequence) < 0)
        keep++;
    if (keep > 0)
        memmove(r->live, r->live + keep, (r->n - keep) * sizeof *r->live);
    r->n -= keep;
}

void recording_drop_after(struct recording *r, uint32_t sequence)
{
    while (r->n > 0 && (int32_t)(r->live[r->n - 1].sequence - sequence) > 0)
        r->n--;
}

void recording_free(struct recording *r)
{
    free(r->live);
    *r = (struct recording){0};
}

/* ---- Holes ---- */

enum recording_break recording_between(const struct recording *r, size_t i, uint64_t *lost)
{
    const struct beam_live *a = &r->live[i], *b = &r->live[i + 1];
    const uint32_t ahead = b->sequence - a->sequence;
    *lost = ahead / r->prescale - (ahead >= r->prescale);
    if (*lost > 0 || ahead != r->prescale)
        return RECORDING_LOST;
    if (a->status >> BEAM_LIVE_COUNTER != b->status >> BEAM_LIVE_COUNTER ||
        (a->status & BEAM_LIVE_BUILT_IN) != (b->status & BEAM_LIVE_BUILT_IN))
        return RECORDING_MODEL;
    return b->step - a->step == ahead ? RECORDING_WHOLE : RECORDING_REST;
}

static void count_flags(const struct recording *r, struct recording_summary *s)
{
    double ratios = 0.0;
    const size_t tail = s->n / 10 + 1;
    for (size_t i = s->from; i < s->from + s->n; i++) {
        const uint32_t status = r->live[i].status;
        s->alarms += (status & BEAM_LIVE_ALARM) != 0;
        s->clipped += (status & BEAM_LIVE_CLIPPED) != 0;
        s->sensor_faults += (status & BEAM_LIVE_SENSOR) != 0;
        s->sensor_flags |= status & BEAM_LIVE_SENSOR;
        s->resets += (status & BEAM_LIVE_RESET) != 0;
        s->unsolved += (status & BEAM_LIVE_SOLVE) != 0;
        if (i + tail >= s->from + s->n)
            ratios += (double)r->live[i].ratio;
    }
    s->noise_ratio = s->n > 0 ? ratios / (double)(tail < s->n ? tail : s->n) : 0.0;
}

struct recording_summary recording_summarise(const struct recording *r)
{
    struct recording_summary s = {.n = r->n > 0};
    size_t from = 0;
    for (size_t i = 0; i + 1 < r->n; i++) {
        uint64_t lost;
        if (recording_between(r, i, &lost) != RECORDING_WHOLE) {
            s.breaks++;
            s.lost += lost;
            from = i + 1;
        }
        if (i + 2 - from > s.n) {
            s.from = from;
            s.n = i + 2 - from;
        }
    }
    count_flags(r, &s);
    return s;
}

/* ---- The record ---- */

static void __attribute__((format(printf, 3, 4)))
add_meta(struct record *record, const char *key, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    record_add_meta(record, key, text);
}

static void name_gaps(const struct recording *r, const struct recording_summary *s, struct record *out)
{
    static const char *const words[] = {"", "lost", "the model was put to rest", "another model"};
    size_t named = 0;
    for (size_t i = 0; i + 1 < r->n; i++) {
        uint64_t lost;
        const enum recording_break what = recording_between(r, i, &lost);
        if (what == RECORDING_WHOLE)
            continue;
        if (named++ == MOST_GAP_LINES) {
            add_meta(out, "gap", "and %zu more", s->breaks - MOST_GAP_LINES);
            return;
        }
        if (what == RECORDING_LOST)
            add_meta(out, "gap", "%llu lost after sequence %u", (unsigned long long)lost,
                     (unsigned)r->live[i].sequence);
        else
            add_meta(out, "gap", "%s after sequence %u", words[what], (unsigned)r->live[i].sequence);
    }
}

enum column {
    INPUT,
    OUTPUT,
    PREDICTED,
    RESIDUAL,
    RATIO,
    SEQUENCE,
    STEP,
    CODES,
    STATUS,
    INNOVATION,
    INNOVATION_RATIO,
    COLUMNS
};

static double cell(enum column column, const struct beam_live *live)
{
    switch (column) {
    case INPUT:
        return (double)live->input;
    case OUTPUT:
        return (double)live->measured;
    case PREDICTED:
        return (double)live->predicted;
    case RESIDUAL:
        return (double)live->residual;
    case RATIO:
        return (double)live->ratio;
    case SEQUENCE:
        return (double)live->sequence;
    case STEP:
        return (double)live->step;
    case CODES:
        return (double)live->codes;
    case INNOVATION:
        return (double)live->innovation;
    case INNOVATION_RATIO:
        return (double)live->innovation_ratio;
    default:
        return (double)live->status;
    }
}

enum bf_status recording_make_record(const struct recording *r, const struct recording_summary *s, const char *input,
                                     const char *output, int latency, struct record *out, struct bf_error *err)
{
    const char *const names[COLUMNS] = {input,  output,  "predicted", "residual",   "ratio",           "sequence",
                                        "step", "codes", "status",    "innovation", "innovation_ratio"};
    const size_t shift = ((size_t)latency + r->prescale - 1) / r->prescale;
    *out = (struct record){0};
    if (s->n < shift + 2)
        return bf_fail(err, BF_DEVICE,
                       "no two samples in a row arrived (%zu came, in %zu pieces): there is no record; check cable and "
                       "--baud",
                       r->n, s->breaks + 1);
    const struct beam_live *live = r->live + s->from;
    out->n = s->n - shift;
    out->dt_s = (double)r->prescale / r->sample_Hz;
    out->t0_s = live->step < r->prescale ? (double)live->step / r->sample_Hz : 0.0;
    double *x = bf_alloc(out->n, sizeof *x);
    for (enum column c = INPUT; c < COLUMNS; c++) {
        for (size_t i = 0; i < out->n; i++)
            x[i] = cell(c, &live[c == OUTPUT ? i + shift : i]);
        record_add_column(out, names[c], x);
    }
    free(x);
    add_meta(out, "sample_Hz", "%.9g", r->sample_Hz);
    add_meta(out, "prescale", "%u", r->prescale);
    if (latency > 0)
        add_meta(out, "latency", "%d samples: predicted, residual and ratio belong to the %s so many rows above",
                 latency, output);
    if (live->step < r->prescale)
        add_meta(out, "start", "model at rest, step %u", (unsigned)live->step);
    else
        add_meta(out, "start", "in motion, step %u", (unsigned)live->step);
    add_meta(out, "received", "%zu samples, %zu of them in this record, %zu gaps, %llu lost", r->n, out->n, s->breaks,
             (unsigned long long)s->lost);
    name_gaps(r, s, out);
    return BF_OK;
}
