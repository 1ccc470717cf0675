/* SPDX-License-Identifier: GPL-3.0-or-later */
/* factors.c — which pairs of an output and an input there are, what each says, and the channel that explains them all. */
#include "factor_pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compare_predict.h"
#include "estimate/estimate.h"

/* Error of the model as given, or of a fit that kept its size: neither sign nor size can be wrong. */
static const double fits_already = 0.5;
static const double drives = 0.02; /* an input that is weaker than this, of its largest in any record, is its noise */

struct search {
    const struct model *model;
    const struct record *records;
    size_t n_records;
    const struct predict_options *options;
    const struct fit_result *fitted; /* of this model to these records; NULL: not known */
    double time_factor;
    size_t n_pairs;
    struct factor_pair *pairs;
    double *given; /* [n_records · n_outputs] error of the model as given or fitted; infinite: unknown */
};

/* ---- Pairs ---- */

static double largest(const struct record *record, const char *name)
{
    const double *u = record_column(record, name);
    double most = 0.0;
    for (size_t k = 0; u && k < record->n; k++)
        most = fmax(most, fabs(u[k]));
    return most;
}

/* The input that drives a record alone; SIZE_MAX: several; n_inputs: none that can be judged by. */
static size_t driving_input(const struct search *s, size_t r)
{
    const struct record *record = &s->records[r];
    size_t found = s->model->n_inputs;
    if (record_is_free_decay(record) || excitation_level_unknown(s->model, record))
        return found;
    for (size_t i = 0; i < s->model->n_inputs; i++) {
        double most = 0.0;
        for (size_t q = 0; q < s->n_records; q++)
            most = fmax(most, largest(&s->records[q], s->model->inputs[i].name));
        if (most > 0.0 && largest(record, s->model->inputs[i].name) >= drives * most)
            found = found == s->model->n_inputs ? i : SIZE_MAX;
    }
    return found;
}

static struct factor_pair *pair_of(struct search *s, size_t output, size_t input)
{
    for (size_t p = 0; p < s->n_pairs; p++)
        if (s->pairs[p].output == output && s->pairs[p].input == input)
            return &s->pairs[p];
    s->pairs = bf_grow(s->pairs, s->n_pairs + 1, sizeof *s->pairs);
    s->pairs[s->n_pairs] = (struct factor_pair){.output = output, .input = input, .factor = 1.0};
    return &s->pairs[s->n_pairs++];
}

static double signal(const struct search *s, size_t r, size_t output)
{
    const double *z = record_column(&s->records[r], s->model->outputs[output].name);
    return z ? root_mean_square(z, s->records[r].n) : 0.0;
}

/* Keeps the records in which the output moves most. */
static void add_record(const struct search *s, struct factor_pair *pair, size_t r)
{
    if (pair->n_records < FACTOR_RECORDS) {
        pair->record[pair->n_records++] = r;
        return;
    }
    size_t weakest = 0;
    for (size_t k = 1; k < FACTOR_RECORDS; k++)
        if (signal(s, pair->record[k], pair->output) < signal(s, pair->record[weakest], pair->output))
            weakest = k;
    if (signal(s, r, pair->output) > signal(s, pair->record[weakest], pair->output))
        pair->record[weakest] = r;
}

static void find_pairs(struct search *s)
{
    for (size_t r = 0; r < s->n_records; r++) {
        const size_t input = driving_input(s, r);
        for (size_t o = 0; o < s->model->n_outputs && input != s->model->n_inputs; o++)
            if (signal(s, r, o) > 0.0)
                add_record(s, pair_of(s, o, input), r);
    }
}

/* ---- What the model leaves ---- */

static double given_error(const struct search *s, const struct factor_pair *pair)
{
    double square = 0.0;
    for (size_t k = 0; k < pair->n_records; k++)
        square += pow(s->given[pair->record[k] * s->model->n_outputs + pair->output], 2.0);
    return sqrt(square / (double)pair->n_records);
}

static enum bf_status judge_pairs(struct search *s, bool *any, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    *any = false;
    for (size_t p = 0; p < s->n_pairs && !status; p++) {
        struct factor_pair *pair = &s->pairs[p];
        const double given = given_error(s, pair);
        pair->time_factor = s->time_factor;
        pair->told = s->time_factor == 1.0 && given < fits_already;
        pair->factor = pair->found = 1.0;
        pair->before = pair->after = given;
        if (!pair->told)
            status = factor_pair_judge(s->model, s->records, s->options, pair, err);
        *any = *any || pair->told;
    }
    return status;
}

/* The other output under the same input whose factor is nearest to 1; NULL: none. */
static const struct factor_pair *reference_of(const struct search *s, const struct factor_pair *pair)
{
    const struct factor_pair *best = pair;
    for (size_t p = 0; p < s->n_pairs; p++) {
        const struct factor_pair *other = &s->pairs[p];
        if (other->told && other->input == pair->input &&
            s->model->outputs[other->output].kind != OUTPUT_PATCH_STRAIN &&
            fabs(log(fabs(other->found))) < fabs(log(fabs(best->found))))
            best = other;
    }
    return best == pair ? NULL : best;
}

/* Where an input's own gain is open, its outputs still tell each other's size. */
static enum bf_status judge_against_others(struct search *s, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    for (size_t p = 0; p < s->n_pairs && !status; p++) {
        struct factor_pair *pair = &s->pairs[p];
        const bool point = s->model->outputs[pair->output].kind != OUTPUT_PATCH_STRAIN;
        const struct factor_pair *reference =
            pair->told && point && !factor_size_is_stated(s->model, pair) ? reference_of(s, pair) : NULL;
        if (!reference || fabs(log(fabs(pair->found / reference->found))) < 1.0)
            continue;
        pair->reference = reference->found, pair->against = reference->output;
        status = factor_pair_judge(s->model, s->records, s->options, pair, err);
    }
    return status;
}

/* ---- The channel that explains them ---- */

static bool same(double a, double b)
{
    return fabs(a - b) <= 1e-9 * fabs(b);
}

static bool has_channel(const struct factor_pair *pair, bool is_input, size_t channel)
{
    return is_input ? pair->input == channel : pair->output == channel;
}

/* The one factor of all pairs with this channel, or 0; with `alone` all others must have 1. */
static double factor_of(const struct search *s, bool is_input, size_t channel, bool alone)
{
    double factor = 0.0;
    for (size_t p = 0; p < s->n_pairs; p++) {
        const struct factor_pair *pair = &s->pairs[p];
        if (!pair->told)
            continue;
        if (!has_channel(pair, is_input, channel)) {
            if (alone && !same(pair->factor, 1.0))
                return 0.0;
        } else if (factor != 0.0 && !same(pair->factor, factor)) {
            return 0.0;
        } else {
            factor = pair->factor;
        }
    }
    return same(factor, 1.0) ? 0.0 : factor;
}

static struct channel_factor *add(struct channel_factors *out, struct channel_factor finding)
{
    out->all = bf_grow(out->all, out->n + 1, sizeof *out->all);
    out->all[out->n] = finding;
    return &out->all[out->n++];
}

static void take_pair(struct channel_factor *f, const struct factor_pair *pair)
{
    f->before = pair->before, f->after = pair->after;
    f->relative = pair->reference != 0.0 && fabs(log(fabs(pair->factor))) > 0.0;
    f->against = pair->against;
    f->found = f->relative ? pair->found / fabs(pair->reference) : pair->found;
}

static void add_channel(const struct search *s, bool is_input, size_t channel, double factor,
                        struct channel_factors *out)
{
    struct channel_factor *f =
        add(out, (struct channel_factor){.kind = FACTOR_CHANNEL, .is_input = is_input, .channel = channel});
    f->factor = factor;
    for (size_t p = 0; p < s->n_pairs; p++) {
        const struct factor_pair *pair = &s->pairs[p];
        if (pair->told && has_channel(pair, is_input, channel) && pair->before > f->before)
            take_pair(f, pair);
    }
}

/* One channel alone: outputs first, and an input that does as well is named beside it. */
static bool explain_by_one(const struct search *s, struct channel_factors *out)
{
    size_t found = 0;
    for (size_t o = 0; o < s->model->n_outputs; o++) {
        const double factor = factor_of(s, false, o, true);
        if (factor != 0.0 && found++ == 0)
            add_channel(s, false, o, factor, out);
    }
    for (size_t i = 0; i < s->model->n_inputs; i++) {
        const double factor = factor_of(s, true, i, true);
        if (factor != 0.0 && found++ == 0)
            add_channel(s, true, i, factor, out);
        else if (factor != 0.0)
            out->all[0].either = true, out->all[0].other = i;
    }
    return found > 0;
}

static bool explain_by_each(const struct search *s, bool is_input, struct channel_factors *out)
{
    const size_t n = is_input ? s->model->n_inputs : s->model->n_outputs;
    for (size_t p = 0; p < s->n_pairs; p++) {
        const struct factor_pair *pair = &s->pairs[p];
        const size_t channel = is_input ? pair->input : pair->output;
        if (pair->told && !same(pair->factor, 1.0) && (channel >= n || factor_of(s, is_input, channel, false) == 0.0))
            return false; /* this channel does not have one factor */
    }
    for (size_t c = 0; c < n; c++) {
        const double factor = factor_of(s, is_input, c, false);
        if (factor != 0.0)
            add_channel(s, is_input, c, factor, out);
    }
    return out->n > 0;
}

static void explain(const struct search *s, struct channel_factors *out)
{
    if (!explain_by_one(s, out) && !explain_by_each(s, false, out))
        (void)explain_by_each(s, true, out);
}

/* ---- Time ---- */

/* Of the pairs' records: the strongest line of the output, the lowest Nyquist frequency. */
static enum bf_status strongest_line(const struct search *s, double *line_Hz, double *nyquist_Hz, struct bf_error *err)
{
    *line_Hz = HUGE_VAL, *nyquist_Hz = 0.0;
    for (size_t p = 0; p < s->n_pairs; p++) {
        const struct record *record = &s->records[s->pairs[p].record[0]];
        const double *z = record_column(record, s->model->outputs[s->pairs[p].output].name);
        double one_Hz;
        const enum bf_status status = factor_strongest_line(record, z, &one_Hz, err);
        if (status)
            return status;
        *line_Hz = fmin(*line_Hz, one_Hz);
        *nyquist_Hz = fmax(*nyquist_Hz, 0.5 / record->dt_s);
    }
    return BF_OK;
}

/* Times in ms that are read as seconds, or the reverse: the band and the beam's lowest mode cannot meet. 1: nothing of the kind. */
static enum bf_status suspected_time(const struct search *s, double *factor, struct bf_error *err)
{
    static const double below = 0.7, beyond = 100.0; /* of the lowest mode */
    double mode_Hz, line_Hz, nyquist_Hz;
    *factor = 1.0;
    for (size_t r = 0; r < s->n_records; r++)
        if (record_is_periodic(&s->records[r]))
            return BF_OK; /* its times are made of the lines' frequencies */
    enum bf_status status = factor_lowest_mode(s->model, &mode_Hz, err);
    if (!status)
        status = strongest_line(s, &line_Hz, &nyquist_Hz, err);
    if (!status && nyquist_Hz < below * mode_Hz)
        *factor = 1e-3;
    else if (!status && line_Hz > beyond * mode_Hz)
        *factor = 1e3;
    return status == BF_NUMERIC ? BF_OK : status;
}

static void add_time(const struct search *s, struct channel_factors *out)
{
    struct channel_factor *f = add(out, (struct channel_factor){.kind = FACTOR_TIME, .factor = s->time_factor});
    f->found = s->time_factor, f->before = 1.0;
    for (size_t p = 0; p < s->n_pairs; p++)
        f->after = s->pairs[p].told ? fmax(f->after, s->pairs[p].after) : f->after;
}

/* ---- Neither ---- */

/* A beam was found in it, with the factor that the model states, or with any where a patch's gain is open. */
static bool is_settled(const struct search *s, const struct factor_pair *pair)
{
    static const double explained = 0.3, near_one = 0.35; /* error; |ln| of the factor that was found */
    return pair->told && pair->found > 0.0 && (pair->after < explained || same(pair->found, 1.0)) &&
           (fabs(log(pair->found)) < near_one || !factor_size_is_stated(s->model, pair));
}

/* The records of the first output that no factor explains. */
static enum bf_status find_place(const struct search *s, bool places, struct channel_factors *out, struct bf_error *err)
{
    for (size_t p = 0; p < s->n_pairs; p++) {
        struct channel_factor found;
        if (is_settled(s, &s->pairs[p]))
            continue;
        const enum bf_status status = factor_place_find(s->model, s->records, s->pairs[p].record, s->pairs[p].n_records,
                                                        given_error(s, &s->pairs[p]), places, s->options, &found, err);
        if (status == BF_OK && isfinite(found.after))
            (void)add(out, found);
        return status;
    }
    return BF_OK;
}

/* ---- All of it ---- */

static bool all_fit(const struct search *s)
{
    for (size_t p = 0; p < s->n_pairs; p++)
        if (!(given_error(s, &s->pairs[p]) < fits_already))
            return false;
    return true;
}

static enum bf_status find(struct search *s, bool places, struct channel_factors *out, struct bf_error *err)
{
    bool any = false;
    s->given = bf_alloc(s->n_records * s->model->n_outputs + 1, sizeof *s->given);
    enum bf_status status = factor_errors(s->model, s->records, s->n_records, s->options, s->fitted, s->given, err);
    if (status || all_fit(s) ||
        (!places && factor_modes_agree(s->model, s->records, s->n_records, s->options, &out->free_model)))
        return status;
    status = suspected_time(s, &s->time_factor, err);
    if (!status)
        status = judge_pairs(s, &any, err);
    if (!status)
        status = judge_against_others(s, err);
    if (!status && any && s->time_factor != 1.0)
        add_time(s, out);
    if (!status && !any && s->time_factor != 1.0)
        (void)add(out, (struct channel_factor){.kind = FACTOR_NO_TIME, .factor = 1.0, .found = 1.0});
    if (!status)
        explain(s, out);
    if (!status && out->n == 0)
        status = find_place(s, places, out, err);
    for (size_t i = 0; i < out->n; i++)
        factor_words(s->model, &out->all[i]);
    return status;
}

enum bf_status channel_factors_find(const struct model *model, const struct record records[], size_t n_records,
                                    const struct predict_options *options, const struct fit_result *fitted, bool places,
                                    struct channel_factors *out, struct bf_error *err)
{
    struct search s = {.model = model,
                       .records = records,
                       .n_records = n_records,
                       .options = options,
                       .fitted = fitted,
                       .time_factor = 1};
    *out = (struct channel_factors){0};
    find_pairs(&s);
    const enum bf_status status = s.n_pairs > 0 ? find(&s, places, out, err) : BF_OK;
    free(s.pairs), free(s.given);
    return status;
}

void channel_factors_free(struct channel_factors *factors)
{
    free(factors->all);
    attainable_free(&factors->free_model);
    *factors = (struct channel_factors){0};
}
