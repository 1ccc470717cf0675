/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "facts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "diagnose_relatives.h"
#include "plausible.h"

/* What any model's own computation is wrong by, of the power in a band: two explanations closer than this are one. */
static const double computed = 2e-3;

/* Degrees of freedom of a fact: how soon a large misfit in one band stops to count more. Amplitude and phase, twice. */
static const double freedom = 4.0;
/* What a parameter must gain, in nats: what one more gains by chance, and by having been chosen out of dozens. */
static const double price = 2.0;

/* ---- The bands ---- */

/* A channel without a noise level has its noise spread evenly, at the level that stands for it. */
static double noise_in_band(const struct misfit_channel *c, double sigma, double from_Hz, double to_Hz)
{
    if (c->noise->method != NOISE_NONE && c->noise->rms > 0.0 && c->noise->n_bins > 0)
        return noise_power(c->noise, from_Hz, to_Hz);
    return sigma * sigma * (to_Hz - from_Hz) * 2.0 * c->dt_s;
}

void facts_of_channels(struct diagnosis *d, const struct misfit_channel channels[], const double sigma[],
                       const double frequency_Hz[], size_t n_modes)
{
    enum { MORE_EDGES = 12 };
    double *edge = bf_alloc(n_modes + MORE_EDGES, sizeof *edge);
    free(d->facts);
    d->facts = bf_alloc(d->n_channels * (n_modes + MORE_EDGES) + 1, sizeof *d->facts);
    d->n_facts = 0;
    for (size_t c = 0; c < d->n_channels; c++) {
        const double nyquist_Hz = 0.5 / channels[c].dt_s, length_s = (double)channels[c].n * channels[c].dt_s;
        size_t used = 0;
        while (used < n_modes && frequency_Hz[used] < nyquist_Hz)
            used++;
        const size_t n_edges = residual_band_edges(frequency_Hz, used, channels[c].dt_s, edge);
        for (size_t b = 0; b + 1 < n_edges; b++) {
            const double noise = noise_in_band(&channels[c], sigma[c], edge[b], edge[b + 1]);
            if (noise > 0.0)
                d->facts[d->n_facts++] =
                    (struct fact){.channel = c,
                                  .from_Hz = edge[b],
                                  .to_Hz = edge[b + 1],
                                  .noise = noise,
                                  .bins = noise_bins(channels[c].noise, edge[b], edge[b + 1], length_s),
                                  .doubt = noise_doubt(channels[c].noise)};
        }
    }
    free(edge);
}

/* ---- What a hypothesis leaves of each ---- */

/* |1 − e^(−iω)|^(2 order) of bin k of n: what so many differences make of power. */
static double power_of_differences(size_t k, size_t n, int order)
{
    const double of_one = 2.0 - 2.0 * cos(2.0 * M_PI * (double)k / (double)n);
    double power = 1.0;
    for (int i = 0; i < order; i++)
        power *= of_one;
    return power;
}

/* Of x[n] from the power X of its differences; infinite: they have lost it. */
static double band_power(const double X[], size_t n, int order, double dt_s, const struct fact *fact)
{
    const double bins_a_Hz = (double)n * dt_s;
    const size_t from = (size_t)ceil(fact->from_Hz * bins_a_Hz - 1e-9);
    const size_t to = fact->to_Hz * dt_s >= 0.5 ? n / 2 + 1 : (size_t)ceil(fact->to_Hz * bins_a_Hz - 1e-9);
    double sum = 0.0;
    if (from == 0 && order > 0)
        return INFINITY;
    for (size_t k = from; k < to; k++)
        sum += (k == 0 || 2 * k == n ? 1.0 : 2.0) * X[k] / power_of_differences(k, n, order);
    return sum / ((double)n * (double)n);
}

static void difference(double x[], size_t n)
{
    for (size_t i = 0; i + 1 < n; i++)
        x[i] = x[i + 1] - x[i];
}

/*
 * Power of x[n] in the bands of one channel, over the noise's; facts [from, to) are the channel's. A large misfit at low frequency leaks into all
 * bands above it, as a record does not end where it began, and would decide there. Its first and second differences leak less: the least is taken.
 */
static enum bf_status over_noise(const struct diagnosis *d, size_t from, size_t to, const double x[], size_t n,
                                 double dt_s, double out[], struct bf_error *err)
{
    enum { ORDERS = 3 };
    double *X = bf_alloc(n / 2 + 1, sizeof *X), *y = bf_alloc(n, sizeof *y);
    enum bf_status status = BF_OK;
    memcpy(y, x, n * sizeof *y);
    for (size_t f = from; f < to; f++)
        out[f] = INFINITY;
    for (int order = 0; order < ORDERS && (size_t)order + 1 < n && !status; order++) {
        const size_t left = n - (size_t)order;
        status = spectrum_power(y, left, X, err);
        for (size_t f = from; f < to && !status; f++)
            out[f] = fmin(out[f], band_power(X, left, order, dt_s, &d->facts[f]) / d->facts[f].noise);
        difference(y, left);
    }
    free(X);
    free(y);
    return status;
}

/* A prediction that is farther from the measured signal than none at all has explained nothing: more cannot be lost. */
static enum bf_status measure_channel(const struct diagnosis *d, const struct misfit_channel *c, size_t from, size_t to,
                                      double left[], struct bf_error *err)
{
    double *signal = bf_alloc(d->n_facts + 1, sizeof *signal);
    enum bf_status status = over_noise(d, from, to, c->residual, c->n, c->dt_s, left, err);
    if (!status)
        status = over_noise(d, from, to, c->measured, c->n, c->dt_s, signal, err);
    for (size_t f = from; f < to && !status; f++)
        left[f] = fmin(left[f], fmax(signal[f], 1.0));
    free(signal);
    return status;
}

enum bf_status facts_measure(const struct diagnosis *d, const struct misfit_channel channels[], struct hypothesis *h,
                             struct bf_error *err)
{
    enum bf_status status = BF_OK;
    free(h->left);
    h->left = bf_alloc(d->n_facts + 1, sizeof *h->left);
    for (size_t from = 0, to = 0; from < d->n_facts && !status; from = to) {
        const struct misfit_channel *c = &channels[d->facts[from].channel];
        while (to < d->n_facts && d->facts[to].channel == d->facts[from].channel)
            to++;
        if (c->n > 1)
            status = measure_channel(d, c, from, to, h->left, err);
    }
    return status;
}

/* ---- Scores ---- */

/* NULL where the hypothesis was only scored and has no model. */
static const struct model_effect *own_effect(const struct hypothesis *h, size_t i)
{
    return h->n_base + i < h->model.n_effects ? &h->model.effects[h->n_base + i] : NULL;
}

/* A signal, a filter or a map of outputs that a record does not have is not there; whatever else there is acts in every record. */
static bool acts_in(const struct hypothesis *h, size_t i, const struct record *record)
{
    bool on_outputs = false;
    for (size_t o = 0; o < h->model.n_outputs; o++) {
        const bool acts = effect_on_output(&h->model, h->n_base + i, o);
        if (acts && record_column(record, h->model.outputs[o].name) != NULL)
            return true;
        on_outputs = on_outputs || acts;
    }
    return !on_outputs;
}

/* Records, held-out ones too, in which an effect acts. */
static size_t n_acting(const struct diagnosis *d, const struct hypothesis *h, size_t i)
{
    size_t n = 0;
    for (size_t r = 0; r < d->n_records; r++)
        n += acts_in(h, i, &d->records[r]);
    for (size_t r = 0; r < d->n_checks; r++)
        n += acts_in(h, i, &d->checks[r]);
    return n;
}

size_t hypothesis_parameters(const struct diagnosis *d, const struct hypothesis *h)
{
    size_t n = 0;
    for (size_t i = 0; i < h->n_effects; i++)
        for (int slot = 0; slot < h->effects[i]->n_parameters; slot++) {
            const struct model_effect *own = own_effect(h, i);
            const bool place = h->effects[i]->parameters[slot].role == BEAM_ROLE_PLACE;
            if (!place && hypothesis_has_support(h, h->effects[i]))
                continue; /* how stiff a rigid support is the records do not tell */
            if (own == NULL || place || !own->parameters[slot].fixed)
                n += own != NULL && effect_per_record(own, slot) ? n_acting(d, h, i) : 1;
        }
    return n;
}

/* One fact in all hypotheses: what an explanation that leaves `left` loses against the least, in units of what the least stands for. */
struct fact_weight {
    double least, unit, bins;
};

/* Of few bins an effect with as many parameters takes everything. What is then left is less than their noise by chance, and is no unit to measure by. */
static struct fact_weight weigh(double least, double bins, double doubt)
{
    const double noise = 1.0 + 2.0 * hypot(doubt, sqrt(2.0 / bins));
    const double form = fmax(least - noise, 0.0) / fmax(least, noise);
    return (struct fact_weight){.least = least,
                                .unit = fmax(least, 1.0 / noise),
                                .bins = 1.0 / (1.0 / bins + form * form + computed * computed)};
}

/* Nats of a square that is one on average where all is well. */
static double nats_of(double square)
{
    return 0.5 * freedom * log1p(square / freedom);
}

static double lost(const struct fact_weight *w, double left)
{
    return nats_of(w->bins * (left - w->least) / w->unit);
}

/* The hypotheses, and last the baseline. */
static const struct hypothesis *nth(const struct diagnosis *d, size_t i)
{
    return i < d->n_hypotheses ? &d->hypotheses[i] : &d->baseline;
}

static void add_fitted(const struct diagnosis *d, double score[])
{
    for (size_t f = 0; f < d->n_facts; f++) {
        double least = INFINITY;
        for (size_t i = 0; i <= d->n_hypotheses; i++)
            least = fmin(least, nth(d, i)->left[f]);
        const struct fact_weight w = weigh(least, d->facts[f].bins, d->facts[f].doubt);
        for (size_t i = 0; i <= d->n_hypotheses; i++)
            score[i] -= lost(&w, nth(d, i)->left[f]);
    }
}

/* Only what every hypothesis was asked; a cross-validation asks the best ones alone. */
static void add_held_out(const struct diagnosis *d, double score[])
{
    const size_t n = d->baseline.check.n_channels;
    for (size_t i = 0; i <= d->n_hypotheses; i++)
        if (nth(d, i)->check.n_channels != n)
            return;
    for (size_t c = 0; c < n; c++) {
        double least = INFINITY;
        for (size_t i = 0; i <= d->n_hypotheses; i++)
            least = fmin(least, nth(d, i)->check.ratio[c] * nth(d, i)->check.ratio[c]);
        if (!isfinite(least))
            continue;
        const struct fact_weight w = weigh(least, d->baseline.check.bins[c], d->baseline.check.doubt[c]);
        for (size_t i = 0; i <= d->n_hypotheses; i++)
            score[i] -= lost(&w, nth(d, i)->check.ratio[c] * nth(d, i)->check.ratio[c]);
    }
}

static bool is_believed(const struct parameter_ref *ref)
{
    return ref->info->prior > 0.0 && !ref->info->fixed;
}

/* Each prior of the beam, its patches and channels is a fact: an explanation that has to bend what is believed is believed less. A prior that is wrong costs all alike. */
static double strain(const struct hypothesis *h)
{
    struct parameter_ref *refs;
    const size_t n = model_parameters(&h->model, NULL, 0, &refs);
    double nats = 0.0;
    for (size_t i = 0; i < n; i++) {
        const double away = is_believed(&refs[i]) ? sds_from_prior(refs[i].info, refs[i].value) : 0.0;
        nats += nats_of(away * away);
    }
    free(refs);
    return nats;
}

void facts_scores(const struct diagnosis *d, double score[])
{
    for (size_t i = 0; i <= d->n_hypotheses; i++)
        score[i] = -strain(nth(d, i));
    add_fitted(d, score);
    add_held_out(d, score);
    for (size_t i = 0; i < d->n_hypotheses; i++)
        score[i] -=
            price * (double)hypothesis_parameters(d, &d->hypotheses[i]) + implausible_nats(d, &d->hypotheses[i]);
}
