/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_search.c — rounds of vector fitting and refinement, from two starts. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Steps of vector fitting from one start: it settles in a handful or goes round in circles … */
enum { RELOCATIONS = 12 };
/* … and is left after so many that did not lower the error by `worth`. */
enum { PATIENCE = 4 };
/* A refinement that left less than half the form error it was weighted by is followed by another one, at most this often. */
enum { ROUNDS = 2 };
static const double much_less = 0.5;
/* Gauss–Newton steps of one round. */
enum { STEPS = 20 };
/* Share of what is left (½Σr², or the error of a step of vector fitting) below which a step is not worth its time. */
static const double worth = 3e-3;
/* How often a spare pair of poles is put to use, as long as that gains. */
enum { REUSES = 3 };
/* What it must gain, as a share of the error: a third of what two starts may differ by. */
static const double reuse_gain = 0.02;
/* With a form error below this share of the whole error the records are explained (1.15 times the noise). */
static const double noise_alone = 0.5;

/* Samples times pairs from which the second start and the reuse of spares are left out: they would take many seconds. */
enum { LARGE = 400000 };

struct search {
    struct attainable_problem *problem;
    struct attainable_rows *rows; /* [n_records], of the last point */
    double *low, *high;           /* [2m] */
};

static enum bf_status compress(struct search *s, const double x[], enum attainable_extra extra, struct bf_error *err)
{
    attainable_rows_free(s->rows, s->problem->n_records);
    return attainable_compress(s->problem, x, extra, s->rows, err);
}

static enum bf_status value(void *context, const double x[], double *half_square, struct bf_error *err)
{
    struct search *s = context;
    const enum bf_status status = compress(s, x, EXTRA_NONE, err);
    return status != BF_OK ? status : attainable_value(s->problem, s->rows, half_square, NULL, err);
}

static enum bf_status derivative(void *context, const double x[], double *half_square, double gradient[], double gram[],
                                 struct bf_error *err)
{
    struct search *s = context;
    const enum bf_status status = compress(s, x, EXTRA_DERIVATIVES, err);
    return status != BF_OK ? status : attainable_derivative(s->problem, x, s->rows, half_square, gradient, gram, err);
}

/* Errors of all channels from Σr² of each; what noise does not explain of them becomes the form error. */
static double judge(struct attainable_problem *p, const double square[], struct attainable *out)
{
    double errors = 0.0, ratios = 0.0, form = 0.0;
    size_t n_ratios = 0;
    for (size_t r = 0; r < p->n_records; r++)
        for (size_t d = 0; p->records[r].first && d < p->records[r].n_data; d++) {
            const struct attainable_data *data = &p->records[r].data[d];
            const size_t c = data->channel;
            const double rms = sqrt(square[c] / (double)p->records[r].n_whole), nrmse = rms / data->rms;
            const double noise = data->noise / data->rms, ratio = data->noise > 0.0 ? rms / data->noise : nan("");
            errors += nrmse * nrmse;
            form += fmax(0.0, nrmse * nrmse - noise * noise);
            if (isfinite(ratio))
                ratios += ratio * ratio, n_ratios++;
            if (out != NULL)
                out->channels[c] = (struct attainable_channel){data->record, data->output, nrmse, ratio};
        }
    if (out != NULL)
        out->noise_ratio = n_ratios > 0 ? sqrt(ratios / (double)n_ratios) : nan("");
    p->form_error = sqrt(form / (double)p->n_channels);
    return sqrt(errors / (double)p->n_channels);
}

/* nrmse at the poles of the rows at hand, the form error taken from it. */
static enum bf_status errors_at(struct search *s, double *nrmse, struct attainable *out, struct bf_error *err)
{
    double *square = bf_alloc(s->problem->n_channels, sizeof *square), half_square;
    const enum bf_status status = attainable_value(s->problem, s->rows, &half_square, square, err);
    *nrmse = status == BF_OK ? judge(s->problem, square, out) : HUGE_VAL;
    free(square);
    return status;
}

/* Vector fitting from start[2m]; best[2m] is replaced, and the form error taken, where it leaves less than *least. */
static void relocate(struct search *s, const double start[], double best[], double *least)
{
    const size_t n = 2 * s->problem->m;
    double *x = bf_alloc(n, sizeof *x), nrmse, lowest = HUGE_VAL;
    double form_error = s->problem->form_error;
    struct bf_error ignored;
    memcpy(x, start, n * sizeof *x);
    for (int i = 0, idle = 0; i <= RELOCATIONS && idle <= PATIENCE; i++, idle++) {
        if (compress(s, x, EXTRA_MEASURED, &ignored) != BF_OK || errors_at(s, &nrmse, NULL, &ignored) != BF_OK)
            break;
        if (nrmse < (1.0 - worth) * lowest) {
            lowest = nrmse;
            idle = 0;
        }
        if (nrmse < *least) {
            *least = nrmse;
            form_error = s->problem->form_error;
            memcpy(best, x, n * sizeof *x);
        }
        if (attainable_relocate(s->problem, x, s->rows, x, &ignored) != BF_OK)
            break;
        for (size_t k = 0; k < n; k++)
            x[k] = fmin(fmax(x[k], s->low[k]), s->high[k]);
    }
    s->problem->form_error = form_error;
    free(x);
}

static void refine(struct search *s, double best[], double *least)
{
    const size_t n = 2 * s->problem->m;
    const struct least_squares problem = {
        .n = n, .lower = s->low, .upper = s->high, .context = s, .value = value, .derivative = derivative};
    const struct optimise_options options = {.iterations = STEPS, .relative = worth};
    double *x = bf_alloc(n, sizeof *x), nrmse;
    struct optimise_result result;
    struct bf_error ignored;
    memcpy(x, best, n * sizeof *x);
    if (optimise_local(&problem, &options, x, &result, &ignored) == BF_OK &&
        compress(s, x, EXTRA_NONE, &ignored) == BF_OK && errors_at(s, &nrmse, NULL, &ignored) == BF_OK) {
        memcpy(best, x, n * sizeof *x);
        *least = nrmse;
    }
    free(x);
}

static double longest_s(const struct attainable_problem *p)
{
    double longest = 0.0;
    for (size_t r = 0; r < p->n_records; r++)
        longest = fmax(longest, (double)p->records[r].n_whole * p->records[r].dt_s);
    return longest;
}

/* Poles may be slower than the records are long and lie above the band; what they do there is all that is left of them. */
static void set_bounds(struct search *s, double top_rad)
{
    const double slowest = 1.0 / longest_s(s->problem);
    for (size_t k = 0; k < s->problem->m; k++) {
        s->low[2 * k] = log(0.1 * slowest);
        s->low[2 * k + 1] = log(1e-3 * slowest);
        s->high[2 * k] = s->high[2 * k + 1] = log(1.5 * top_rad);
    }
}

/* Poles of 1 % damping, evenly spaced in the logarithm over all that the records can tell. */
static void spread(const struct attainable_problem *p, double top_rad, double x[])
{
    const double bottom = log(10.0 / longest_s(p)), top = log(top_rad);
    for (size_t k = 0; k < p->m; k++) {
        x[2 * k] = bottom + (top - bottom) * ((double)k + 0.5) / (double)p->m;
        x[2 * k + 1] = x[2 * k] + log(0.01);
    }
}

/* Where pair j of x[2m] does most beside another (as it does under a nonlinearity, which blurs a mode): x_j is put there. */
static void put_beside(struct search *s, double x[], size_t j)
{
    const size_t m = s->problem->m;
    struct bf_error ignored;
    size_t beside = j;
    double least = HUGE_VAL, now;
    for (size_t k = 0; k <= m; k++) {
        const size_t at = k < m ? k : beside; /* the last time: the best of them */
        if (at == j)
            continue;
        x[2 * j] = log1p(exp(x[2 * at + 1] - x[2 * at])) + x[2 * at]; /* half a bandwidth higher … */
        x[2 * j + 1] = x[2 * at + 1] + log(2.0);                      /* … and damped twice as much */
        if (k < m && value(s, x, &now, &ignored) == BF_OK && now < least) {
            least = now;
            beside = at;
        }
    }
}

/* Rows of x[2m] without pair k, which is put far above the band, overdamped. */
static enum bf_status compress_without(struct search *s, double x[], size_t k, struct bf_error *err)
{
    const double kept[2] = {x[2 * k], x[2 * k + 1]};
    x[2 * k] = s->high[2 * k], x[2 * k + 1] = s->high[2 * k + 1];
    const enum bf_status status = compress(s, x, EXTRA_NONE, err);
    x[2 * k] = kept[0], x[2 * k + 1] = kept[1];
    return status;
}

/* The pair of x[2m] that is missed least: the one whose removal costs least. */
static size_t spare_pair(struct search *s, double x[])
{
    const size_t m = s->problem->m;
    struct bf_error ignored;
    size_t spare = 0;
    double least = HUGE_VAL, now;
    for (size_t k = 0; k < m; k++)
        if (compress_without(s, x, k, &ignored) == BF_OK &&
            attainable_value(s->problem, s->rows, &now, NULL, &ignored) == BF_OK && now < least) {
            least = now;
            spare = k;
        }
    return spare;
}

static bool is_large(const struct attainable_problem *p)
{
    size_t samples = 0;
    for (size_t r = 0; r < p->n_records; r++)
        samples += p->records[r].n;
    return samples * p->m > LARGE;
}

/* Vector fitting leaves some pair where it does little: it is tried beside each other one. best[2m], *least as before or better. */
static void reuse_spare(struct search *s, double best[], double *least)
{
    const size_t n = 2 * s->problem->m;
    const double form_error = s->problem->form_error;
    double *x = bf_alloc(n, sizeof *x), nrmse = *least;
    memcpy(x, best, n * sizeof *x);
    put_beside(s, x, spare_pair(s, x));
    refine(s, x, &nrmse);
    if (nrmse < *least) {
        memcpy(best, x, n * sizeof *x);
        *least = nrmse;
    } else {
        s->problem->form_error = form_error;
    }
    free(x);
}

/* From start[2m], whose errors are known; best[2m] out. */
static double improve(struct search *s, double top_rad, const double start[], double start_nrmse, double best[])
{
    const size_t n = 2 * s->problem->m;
    double *other = bf_alloc(n, sizeof *other), least = start_nrmse, before;
    const bool large = is_large(s->problem);
    memcpy(best, start, n * sizeof *best);
    if (!(s->problem->form_error <=
          noise_alone * start_nrmse)) { /* else the start explains them, and there is nowhere to go */
        relocate(s, start, best, &least);
        spread(s->problem, top_rad, other);
        if (!large)
            relocate(s, other, best, &least);
    }
    for (int round = 0; round < ROUNDS; round++) {
        before = s->problem->form_error;
        refine(s, best, &least);
        if (s->problem->form_error > much_less * before)
            break;
    }
    for (int i = 0; i < REUSES && !large && !s->problem->rough && s->problem->form_error > noise_alone * least; i++) {
        before = least;
        reuse_spare(s, best, &least);
        if (!(least < (1.0 - reuse_gain) * before))
            break;
    }
    free(other);
    return least;
}

static struct search search_of(struct attainable_problem *p, double top_rad)
{
    struct search s = {.problem = p};
    s.rows = bf_alloc(p->n_records, sizeof *s.rows);
    s.low = bf_alloc(2 * p->m, sizeof *s.low);
    s.high = bf_alloc(2 * p->m, sizeof *s.high);
    set_bounds(&s, top_rad);
    return s;
}

static void search_free(struct search *s)
{
    attainable_rows_free(s->rows, s->problem->n_records);
    free(s->rows), free(s->low), free(s->high);
}

enum bf_status attainable_search(struct attainable_problem *p, double top_rad, double x[], struct attainable *out,
                                 struct bf_error *err)
{
    const size_t n = 2 * p->m;
    struct search s = search_of(p, top_rad);
    double *best = bf_alloc(n, sizeof *best);
    for (size_t k = 0; k < n; k++)
        x[k] = fmin(fmax(x[k], s.low[k]), s.high[k]);
    p->form_error = 1.0; /* nothing is known: all channels weigh by their size */
    enum bf_status status = compress(&s, x, EXTRA_NONE, err);
    if (status == BF_OK)
        status = errors_at(&s, &out->start_nrmse, NULL, err);
    if (status == BF_OK) {
        if (improve(&s, top_rad, x, out->start_nrmse, best) < out->start_nrmse)
            memcpy(x, best, n * sizeof *x);
        status = compress(&s, x, EXTRA_NONE, err);
    }
    if (status == BF_OK)
        status = errors_at(&s, &out->nrmse, out, err);
    search_free(&s);
    free(best);
    return status;
}

void attainable_leave_each_out(struct attainable_problem *p, double top_rad, double x[], double without[])
{
    const double form_error = p->form_error;
    struct search s = search_of(p, top_rad);
    struct attainable left = {.channels = bf_alloc(p->n_channels, sizeof *left.channels)};
    struct bf_error ignored;
    for (size_t k = 0; k < p->m; k++) {
        double nrmse;
        without[k] = (double)NAN;
        if (!is_large(p) && compress_without(&s, x, k, &ignored) == BF_OK &&
            errors_at(&s, &nrmse, &left, &ignored) == BF_OK)
            without[k] = left.noise_ratio;
        p->form_error = form_error;
    }
    free(left.channels);
    search_free(&s);
}
