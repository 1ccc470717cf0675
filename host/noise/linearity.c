/* SPDX-License-Identifier: GPL-3.0-or-later */
/* linearity.c — which channels of which records can be paired, and the verdict over all pairs. */
#include "linearity_added.h"
#include "linearity_pair.h"
#include "noise.h"
#include "maths/maths.h"
#include "response/response.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAST_SAMPLES = 256, /* of a record that says something */
    ALL_PAIRS = 5, /* records of one path that are paired each with each; more: with the weakest and the strongest */
    ADDED_PER_CHANNEL = 6,
    REST_SAMPLES = 8 /* at the start, in which the channel is still at rest */
};
static const double level_ratio = 1.5; /* of the channel between two records, for a test of linearity */
static const double rest_share = 0.1;  /* of the channel's rms, at the start */

const char *linearity_verdict_text(enum linearity_verdict verdict)
{
    switch (verdict) {
    case LINEARITY_LINEAR:
        return "linear";
    case LINEARITY_NONLINEAR:
        return "nonlinear";
    case LINEARITY_ADDITIVE:
        return "linear, with added signals";
    case LINEARITY_CANNOT_TELL:
        break;
    }
    return "cannot be told";
}

/* ---- Which channels of which records can be paired ---- */

static bool moves(const double *u, size_t n)
{
    for (size_t i = 1; i < n; i++)
        if (u[i] < u[0] || u[i] > u[0])
            return true;
    return false;
}

/* Sum of the signals that were found added to a channel, at sample i. */
static double sum_of_added(const struct linearity *l, const struct linearity_signal *s, size_t i)
{
    double sum = 0.0;
    for (size_t k = 0; k < l->n_added; k++)
        if (l->added[k].record == s->record && l->added[k].output == s->output)
            sum += linearity_added_at(&l->added[k], i, s->n, s->dt_s);
    return sum;
}

/* A channel begins at rest when its first samples, with or without what was found added, are noise or small. */
static bool begins_at_rest(const struct linearity_signal *s)
{
    const double head = fmin(root_mean_square(s->cleaned, REST_SAMPLES), root_mean_square(s->y, REST_SAMPLES));
    return head < fmax(4.0 * s->noise->rms, rest_share * s->level);
}

static size_t collect(const struct model *model, const struct record records[], size_t n_records,
                      const struct noise_estimate noise[], const struct linearity *l, struct linearity_signal *out)
{
    size_t n = 0;
    for (size_t r = 0; r < n_records; r++) {
        const struct record *record = &records[r];
        const char *excitation = record_meta(record, "excitation");
        size_t active = 0, input = 0;
        for (size_t i = 0; i < model->n_inputs; i++) {
            const double *u = record_column(record, model->inputs[i].name);
            if (u != NULL && moves(u, record->n)) {
                active++;
                input = i;
            }
        }
        const bool known = excitation == NULL || (strcmp(excitation, "free_decay") != 0 && !record_is_periodic(record));
        for (size_t o = 0; o < model->n_outputs && active == 1 && known && record->n >= LEAST_SAMPLES; o++) {
            struct linearity_signal s = {.record = r, .output = o, .input = input, .n = record->n};
            s.dt_s = record->dt_s;
            s.y = record_column(record, model->outputs[o].name);
            s.u = record_column(record, model->inputs[input].name);
            s.noise = &noise[r * model->n_outputs + o];
            if (s.y == NULL || s.noise->method == NOISE_NONE || !(s.noise->rms > 0.0))
                continue;
            s.cleaned = bf_alloc(s.n, sizeof *s.cleaned);
            for (size_t i = 0; i < s.n; i++)
                s.cleaned[i] = s.y[i] - sum_of_added(l, &s, i);
            s.level = root_mean_square(s.cleaned, s.n);
            if (begins_at_rest(&s))
                out[n++] = s;
            else
                free(s.cleaned);
        }
    }
    return n;
}

static bool same_path(const struct linearity_signal *a, const struct linearity_signal *b)
{
    return a->output == b->output && a->input == b->input && fabs(a->dt_s / b->dt_s - 1.0) < 1e-9;
}

/* Rank by level among the signals of its path: 0 the weakest; *of: how many there are. */
static size_t rank_of(const struct linearity_signal *s, size_t n, size_t i, size_t *of)
{
    size_t rank = 0;
    *of = 0;
    for (size_t j = 0; j < n; j++) {
        if (!same_path(&s[i], &s[j]))
            continue;
        ++*of;
        rank += s[j].level < s[i].level || (!(s[j].level > s[i].level) && j < i);
    }
    return rank;
}

/* ---- Added signals ---- */

static void find_added(const struct model *model, const struct record records[], size_t n_records,
                       struct linearity *out)
{
    out->added = bf_alloc(n_records * model->n_outputs * ADDED_PER_CHANNEL + 1, sizeof *out->added);
    const double **u = bf_alloc(model->n_inputs + 1, sizeof *u);
    for (size_t r = 0; r < n_records; r++) {
        size_t n_inputs = 0;
        for (size_t i = 0; i < model->n_inputs; i++) {
            u[n_inputs] = record_column(&records[r], model->inputs[i].name);
            n_inputs += u[n_inputs] != NULL && moves(u[n_inputs], records[r].n);
        }
        for (size_t o = 0; o < model->n_outputs; o++) {
            const double *y = record_column(&records[r], model->outputs[o].name);
            if (y == NULL)
                continue;
            struct linearity_added *found = out->added + out->n_added;
            const size_t n =
                linearity_find_added(y, records[r].n, records[r].dt_s, u, n_inputs, found, ADDED_PER_CHANNEL);
            for (size_t i = 0; i < n; i++) {
                found[i].record = r;
                found[i].output = o;
            }
            out->n_added += n;
        }
    }
    free(u);
}

static struct linearity_lines lines_of(const struct linearity *l, const struct linearity_signal *a,
                                       const struct linearity_signal *b)
{
    struct linearity_lines lines = {0};
    for (size_t i = 0; i < l->n_added; i++) {
        const struct linearity_added *x = &l->added[i];
        const bool theirs = x->record == a->record || x->record == b->record;
        if (theirs && x->output == a->output && lines.n < sizeof lines.frequency_Hz / sizeof *lines.frequency_Hz)
            lines.frequency_Hz[lines.n++] = x->frequency_Hz;
    }
    return lines;
}

/* ---- Pairs ---- */

static enum bf_status measure_pairs(const struct linearity_signal *s, size_t n, struct linearity *out,
                                    struct bf_error *err)
{
    enum bf_status status = BF_OK;
    out->pairs = bf_alloc(n * n + 1, sizeof *out->pairs);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = i + 1; j < n && status == BF_OK; j++) {
            size_t of;
            if (!same_path(&s[i], &s[j]))
                continue;
            const size_t ri = rank_of(s, n, i, &of), rj = rank_of(s, n, j, &of);
            if (of > ALL_PAIRS && ri != 0 && rj != 0 && ri + 1 != of && rj + 1 != of)
                continue;
            const struct linearity_signal *weak = ri < rj ? &s[i] : &s[j], *strong = ri < rj ? &s[j] : &s[i];
            const struct linearity_lines lines = lines_of(out, weak, strong);
            struct linearity_pair *pair = &out->pairs[out->n_pairs++];
            *pair = (struct linearity_pair){.record = {weak->record, strong->record},
                                            .output = weak->output,
                                            .input = weak->input,
                                            .level = {weak->level, strong->level}};
            status = linearity_pair_measure(weak, strong, &lines, pair, err);
        }
    }
    return status;
}

/*
 * A signal that is added to one record makes it disagree with the others. Where the records agree although the signal was not
 * taken out, it is a part of the motion and is no longer listed.
 */
static void keep_confirmed(struct linearity *out)
{
    size_t kept = 0;
    for (size_t i = 0; i < out->n_added; i++) {
        const struct linearity_added *a = &out->added[i];
        size_t pairs = 0, broken = 0;
        for (size_t j = 0; j < out->n_pairs; j++) {
            const struct linearity_pair *p = &out->pairs[j];
            if (p->output != a->output || (p->record[0] != a->record && p->record[1] != a->record))
                continue;
            pairs++;
            broken += p->ratio > linearity_threshold;
        }
        if (pairs == 0 || broken > 0)
            out->added[kept++] = *a;
    }
    out->n_added = kept;
}

static int by_ratio(const void *a, const void *b)
{
    const struct linearity_pair *x = a, *y = b;
    return (x->ratio < y->ratio) - (x->ratio > y->ratio);
}

static int by_significance(const void *a, const void *b)
{
    const struct linearity_added *x = a, *y = b;
    const double p = fabs(x->amplitude) / x->sd, q = fabs(y->amplitude) / y->sd;
    return (p < q) - (p > q);
}

static bool differs_in_level(const struct linearity_pair *pair)
{
    return pair->level[1] > level_ratio * pair->level[0];
}

static void conclude(const struct model *model, const struct record records[], struct linearity *out)
{
    const struct linearity_pair *worst = NULL;
    size_t compared = 0, n_nonlinear = 0, added = out->n_added;
    double lowest = INFINITY, highest = 0.0;
    for (size_t i = 0; i < out->n_pairs; i++) {
        const struct linearity_pair *p = &out->pairs[i];
        compared += differs_in_level(p);
        n_nonlinear += p->nonlinear;
        added += p->n_added;
        lowest = fmin(lowest, p->ratio_broad);
        highest = fmax(highest, p->ratio_broad);
        if (p->nonlinear && (worst == NULL || p->ratio_broad > worst->ratio_broad))
            worst = p;
    }
    out->verdict = worst != NULL   ? LINEARITY_NONLINEAR
                   : compared == 0 ? LINEARITY_CANNOT_TELL
                   : added > 0     ? LINEARITY_ADDITIVE
                                   : LINEARITY_LINEAR;
    if (worst != NULL)
        (void)snprintf(out->text, sizeof out->text,
                       "No linear time-invariant system explains both %s and %s: in %s what is left is %.3g times the "
                       "noise, most of it between %.3g and %.3g Hz; %zu of %zu pairs of records show it.",
                       record_base_name(&records[worst->record[0]]), record_base_name(&records[worst->record[1]]),
                       model->outputs[worst->output].name, worst->ratio_broad, worst->worst_from_Hz, worst->worst_to_Hz,
                       n_nonlinear, out->n_pairs);
    else if (compared == 0)
        (void)snprintf(out->text, sizeof out->text,
                       "Whether the beam is linear cannot be told without a model: no two records excite it from rest "
                       "by the same input at levels that differ by %.1f or more.",
                       level_ratio);
    else
        (void)snprintf(out->text, sizeof out->text,
                       "Records of different level agree with one linear system (or one of degree 1, as a breathing "
                       "crack): %.2f to %.2f times the noise over %zu pairs.%s",
                       lowest, highest, out->n_pairs,
                       added > 0 ? " Signals that do not come from the input are added to them." : "");
}

/* ---- All ---- */

static enum bf_status estimate_noise(const struct model *model, const struct record records[], size_t n_records,
                                     struct noise_estimate *noise, struct bf_error *err)
{
    for (size_t r = 0; r < n_records; r++)
        for (size_t o = 0; o < model->n_outputs; o++) {
            if (record_column(&records[r], model->outputs[o].name) == NULL)
                continue;
            const enum bf_status status =
                noise_of_channel(model, &records[r], model->outputs[o].name, &noise[r * model->n_outputs + o], err);
            if (status != BF_OK)
                return status;
        }
    return BF_OK;
}

/* Records of one beam, hit and watched at the same places. */
static bool same_beam(const struct model *model, const struct record records[], size_t n_records)
{
    bool same = !model_differs_by_record(model);
    for (size_t r = 0; r < n_records; r++)
        same = same && !record_has_places(model, &records[r]);
    return same;
}

enum bf_status linearity_test(const struct model *model, const struct record records[], size_t n_records,
                              const struct noise_estimate noise[], struct linearity *out, struct bf_error *err)
{
    const size_t n_all = n_records * model->n_outputs;
    enum bf_status status = BF_OK;
    *out = (struct linearity){0};
    struct noise_estimate *own = NULL;
    if (noise == NULL) {
        own = bf_alloc(n_all + 1, sizeof *own);
        status = estimate_noise(model, records, n_records, own, err);
        noise = own;
    }
    struct linearity_signal *signals = bf_alloc(n_all + 1, sizeof *signals);
    size_t n = 0;
    if (status == BF_OK) {
        find_added(model, records, n_records, out);
        n = same_beam(model, records, n_records) ? collect(model, records, n_records, noise, out, signals) : 0;
        status = measure_pairs(signals, n, out, err);
    }
    if (status == BF_OK) {
        keep_confirmed(out);
        qsort(out->pairs, out->n_pairs, sizeof *out->pairs, by_ratio);
        qsort(out->added, out->n_added, sizeof *out->added, by_significance);
        conclude(model, records, out);
    }
    for (size_t i = 0; i < n_all && own != NULL; i++)
        noise_free(&own[i]);
    free(own);
    for (size_t i = 0; i < n; i++)
        free(signals[i].cleaned);
    free(signals);
    return status;
}

void linearity_free(struct linearity *linearity)
{
    free(linearity->pairs);
    free(linearity->added);
    *linearity = (struct linearity){0};
}
