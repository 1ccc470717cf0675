/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A frequency response as a record. Lines k·df of H are the answer, in the steady state, to any input of period 1/df that has power at these lines
 * alone. A pulse is taken whose lines are as strong as they are well measured, so that the noise of the answer is white. Its period and
 * the answer's are the record; nothing is lost, and no state at the beginning is unknown.
 */
#include "record.h"

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"

enum {
    MOST_LINES = 1 << 22, /* up to the last one, those that the file leaves out included: what a period has room for */
    PULSE_AT = 32,        /* sample: before it the pulse's first ripples */
    NEIGHBOURS = 4        /* lines to either side, over which noise is smooth */
};
static const double largest = 1e100; /* |H| */
/* Of the mean variance of a response: no line is taken to be better known, so that none outweighs all others. */
static const double least_variance = 1e-6;
/* Coherence is taken to lie in this range: 0 would be no measurement, and nothing is known to better than 0.1 %. */
static const double least_coherence = 1e-6, most_coherence = 1.0 - 1e-6;

/* One output over one input, line by line. */
struct response {
    char *output;
    size_t n;
    double complex *H;
    const double *coherence; /* NULL: not stated */
    double *variance;        /* E|δH|², NULL likewise */
};

/* What is known while the record is made over. */
struct conversion {
    const struct record *record; /* lines over frequency */
    char *input;
    bool without_phase; /* of every response */
    size_t n_responses;
    struct response *responses;
    size_t first, n_period; /* line number of the first row; samples of a period */
    double averages;        /* 0: not stated */
    double *level;          /* [record->n] amplitude of the pulse's lines */
};

static double complex turn(double angle_rad)
{
    return CMPLX(cos(angle_rad), sin(angle_rad));
}

/* ---- Columns ---- */

static const char *const parts[] = {"re", "im", "magnitude", "dB", "deg", "rad", "coherence"};
enum part { PART_RE, PART_IM, PART_MAGNITUDE, PART_DB, PART_DEG, PART_RAD, PART_COHERENCE, PARTS };

/* "accel_mps2/hammer_N_re": the part, and where the names end; PARTS: none of these. */
static enum part part_of(const char *name, size_t *slash, size_t *end)
{
    const char *over = strchr(name, '/'), *last = strrchr(name, '_');
    if (over == NULL || last == NULL || last <= over + 1 || over == name)
        return PARTS;
    *slash = (size_t)(over - name);
    *end = (size_t)(last - name);
    for (int p = 0; p < PARTS; p++)
        if (strcmp(last + 1, parts[p]) == 0)
            return (enum part)p;
    return PARTS;
}

static const double *column_part(const struct record *record, const char *output, const char *input, enum part part)
{
    char *name = NULL;
    const double *x = NULL;
    if (asprintf(&name, "%s/%s_%s", output, input, parts[part]) >= 0)
        x = record_column(record, name);
    free(name);
    return x;
}

static enum bf_status fail_column(const struct record *record, const char *name, struct bf_error *err)
{
    return bf_fail_at(
        err, record->path, 1,
        "column '%.60s' of a frequency response: give OUTPUT/INPUT_re and OUTPUT/INPUT_im, or _magnitude or _dB "
        "with _deg or _rad, and OUTPUT/INPUT_coherence where it is known (accel_mps2/hammer_N_re)",
        name);
}

static bool is_known(const struct conversion *c, const char *name, size_t length)
{
    for (size_t i = 0; i < c->n_responses; i++)
        if (strlen(c->responses[i].output) == length && strncmp(c->responses[i].output, name, length) == 0)
            return true;
    return false;
}

/* Sizes to compute with, and a coherence that is one. */
static enum bf_status check_lines(const struct record *record, const struct response *r, struct bf_error *err)
{
    static const double above_one = 1e-3; /* what rounding may add */
    for (size_t k = 0; k < r->n; k++) {
        const double f_Hz = record->t0_s + (double)k * record->dt_s, g = r->coherence != NULL ? r->coherence[k] : 0.0;
        if (!(cabs(r->H[k]) <= largest))
            return bf_fail_at(err, record->path, 1, "%.60s at %.9g Hz: too large a response; are the units right?",
                              r->output, f_Hz);
        if (!(g >= 0.0 && g <= 1.0 + above_one))
            return bf_fail_at(err, record->path, 1, "coherence of %.60s at %.9g Hz is %.6g; it lies between 0 and 1",
                              r->output, f_Hz, g);
    }
    return BF_OK;
}

/* H of one output from whichever pair of columns it has. */
static enum bf_status take_response(struct conversion *c, const char *name, size_t length, struct bf_error *err)
{
    const struct record *record = c->record;
    c->responses = bf_grow(c->responses, c->n_responses + 1, sizeof *c->responses);
    struct response *r = &c->responses[c->n_responses++];
    *r = (struct response){.output = strndup(name, length), .n = record->n};
    r->H = bf_alloc(record->n, sizeof *r->H);
    const double *column[PARTS];
    for (int p = 0; p < PARTS; p++)
        column[p] = column_part(record, r->output, c->input, (enum part)p);
    const double *size = column[PART_MAGNITUDE] ? column[PART_MAGNITUDE] : column[PART_DB];
    const double *angle = column[PART_DEG] ? column[PART_DEG] : column[PART_RAD];
    const double degree = column[PART_DEG] ? acos(-1.0) / 180.0 : 1.0;
    const bool complete = (column[PART_RE] && column[PART_IM]) || (size && (angle || c->without_phase));
    r->coherence = column[PART_COHERENCE];
    for (size_t k = 0; k < record->n && complete; k++) {
        if (column[PART_RE] && column[PART_IM])
            r->H[k] = CMPLX(column[PART_RE][k], column[PART_IM][k]);
        else
            r->H[k] = (column[PART_MAGNITUDE] ? size[k] : pow(10.0, size[k] / 20.0)) *
                      turn(c->without_phase ? 0.0 : degree * angle[k]);
    }
    return complete ? check_lines(record, r, err) : fail_column(record, r->output, err);
}

/* A magnitude and nothing that has a phase. */
static bool has_no_phase(const struct record *record)
{
    bool magnitude = false;
    for (size_t i = 0; i < record->n_columns; i++) {
        size_t slash, end;
        const enum part part = part_of(record->columns[i].name, &slash, &end);
        if (part == PART_RE || part == PART_IM || part == PART_DEG || part == PART_RAD)
            return false;
        magnitude = magnitude || part == PART_MAGNITUDE || part == PART_DB;
    }
    return magnitude;
}

static enum bf_status take_columns(struct conversion *c, struct bf_error *err)
{
    const struct record *record = c->record;
    enum bf_status status = BF_OK;
    c->without_phase = has_no_phase(record);
    for (size_t i = 0; i < record->n_columns && status == BF_OK; i++) {
        const char *name = record->columns[i].name;
        size_t slash, end;
        if (part_of(name, &slash, &end) == PARTS)
            return fail_column(record, name, err);
        if (c->input == NULL)
            c->input = strndup(name + slash + 1, end - slash - 1);
        if (strlen(c->input) != end - slash - 1 || strncmp(c->input, name + slash + 1, end - slash - 1) != 0)
            return bf_fail_at(err, record->path, 1,
                              "column '%.60s': responses to '%.40s' and to another input; give one file for each input",
                              name, c->input);
        if (strlen(c->input) == slash && strncmp(c->input, name, slash) == 0)
            return fail_column(record, name, err);
        if (!is_known(c, name, slash))
            status = take_response(c, name, slash, err);
    }
    return status;
}

/* ---- The axis ---- */

static enum bf_status take_axis(struct conversion *c, struct bf_error *err)
{
    const struct record *record = c->record;
    const double first = record->t0_s / record->dt_s;
    if (!(first > -1e-3) || fabs(first - round(first)) > 0.01)
        return bf_fail_at(
            err, record->path, 1,
            "freq_Hz begins at %.9g Hz, which is no multiple of the distance of the lines, %.9g Hz; export "
            "lines at 0, df, 2 df, ...",
            record->t0_s, record->dt_s);
    if (!(first + (double)record->n <= MOST_LINES))
        return bf_fail_at(
            err, record->path, 1,
            "freq_Hz goes up to line %.9g of the distance %.9g Hz; at most %d can be taken: export fewer lines",
            first + (double)record->n, record->dt_s, MOST_LINES);
    c->first = (size_t)llround(first);
    c->n_period = fft_good_size(2 * (c->first + record->n)); /* the last line is below the Nyquist frequency */
    return BF_OK;
}

/* ---- Noise ---- */

/*
 * E|δH|² = |H|² (1 − γ²)/(γ² (n − 1)): what the n spectra scatter about H, one of their n degrees of freedom spent on H (Bendat and Piersol, Random Data, 4th ed.,
 * table 9.6, have n and the true γ², of which the estimate of few averages is too high). Where it is large H
 * itself is noise, and a line that happens to be small would seem well measured: so it is a mean over neighbours.
 */
static void find_variance(const struct conversion *c, struct response *r)
{
    if (r->coherence == NULL)
        return;
    double *of_line = bf_alloc(r->n, sizeof *of_line);
    for (size_t k = 0; k < r->n; k++) {
        const double g = fmin(fmax(r->coherence[k], least_coherence), most_coherence), size = cabs(r->H[k]);
        of_line[k] = size * size * (1.0 - g) / (g * fmax(c->averages - 1.0, 1.0));
    }
    r->variance = bf_alloc(r->n, sizeof *r->variance);
    for (size_t k = 0; k < r->n; k++) {
        const size_t from = k > NEIGHBOURS ? k - NEIGHBOURS : 0, to = k + NEIGHBOURS < r->n ? k + NEIGHBOURS : r->n - 1;
        for (size_t i = from; i <= to; i++)
            r->variance[k] += of_line[i] / (double)(to - from + 1);
    }
    free(of_line);
}

static double mean_variance(const struct response *r)
{
    double sum = 0.0;
    for (size_t k = 0; k < r->n; k++)
        sum += r->variance[k] / (double)r->n;
    return sum;
}

/* As strong as well measured, over all outputs; the line at 0 Hz, which no shaker drives, is left out. */
static void find_levels(struct conversion *c)
{
    const size_t n = c->record->n;
    double *relative = bf_alloc(n, sizeof *relative), best = INFINITY;
    for (size_t i = 0; i < c->n_responses; i++) {
        struct response *r = &c->responses[i];
        const double mean = r->variance != NULL ? mean_variance(r) : 0.0;
        for (size_t k = 0; k < n; k++)
            relative[k] += r->variance != NULL && mean > 0.0 ? fmax(r->variance[k] / mean, least_variance) : 1.0;
    }
    for (size_t k = 0; k < n; k++)
        best = fmin(best, relative[k]);
    for (size_t k = 0; k < n; k++)
        c->level[k] = c->first + k == 0 ? 0.0 : sqrt(best / relative[k]);
    free(relative);
}

/* One-sided spectrum of the noise of an output's column, times scale²: [n_period/2 + 1]. Lines without the pulse get the mean. */
static double *noise_psd(const struct conversion *c, const struct response *r, double scale)
{
    const size_t m = c->n_period / 2 + 1;
    const double to_psd = 2.0 * scale * scale / ((double)c->n_period * (double)c->n_period * c->record->dt_s);
    double *psd = bf_alloc(m, sizeof *psd), sum = 0.0;
    for (size_t k = 0; k < r->n; k++)
        sum += psd[c->first + k] = to_psd * r->variance[k] * c->level[k] * c->level[k];
    for (size_t k = 0; k < m; k++)
        if (!(psd[k] > 0.0))
            psd[k] = sum / (double)r->n;
    return psd;
}

/* ---- One period ---- */

/* x[n_period] of the lines level · H (H NULL: 1), behind PULSE_AT samples. */
static enum bf_status one_period(const struct conversion *c, const double complex H[], double x[], struct bf_error *err)
{
    const size_t N = c->n_period;
    const struct fft *plan;
    const enum bf_status status = fft_get(N, &plan, err);
    if (status)
        return status;
    double complex *X = bf_alloc(N / 2 + 1, sizeof *X);
    for (size_t k = 0; k < c->record->n; k++) {
        const size_t line = c->first + k;
        X[line] = c->level[k] * (H != NULL ? H[k] : 1.0) *
                  turn(-2.0 * acos(-1.0) * (double)(line * PULSE_AT % N) / (double)N);
    }
    fft_inverse(plan, X, x);
    free(X);
    return BF_OK;
}

static void add_period(struct record *out, const char *name, double x[], double scale, double *psd)
{
    for (size_t k = 0; k < out->n; k++)
        x[k] *= scale;
    record_add_column(out, name, x);
    out->columns[out->n_columns - 1].noise_psd = psd;
}

/* The pulse's peak is 1 unit of the input. */
static enum bf_status make_record(struct conversion *c, struct record *out, struct bf_error *err)
{
    double *x = bf_alloc(c->n_period, sizeof *x), peak = 0.0;
    *out = (struct record){.n = c->n_period, .dt_s = 1.0 / (c->record->dt_s * (double)c->n_period)};
    enum bf_status status = one_period(c, NULL, x, err);
    for (size_t k = 0; k < c->n_period && !status; k++)
        peak = fmax(peak, fabs(x[k]));
    const double scale = peak > 0.0 ? 1.0 / peak : 1.0;
    if (!status)
        add_period(out, c->input, x, scale, NULL);
    for (size_t i = 0; i < c->n_responses && !status; i++) {
        const struct response *r = &c->responses[i];
        status = one_period(c, r->H, x, err);
        if (!status)
            add_period(out, r->output, x, scale,
                       r->variance != NULL && c->averages > 0.0 ? noise_psd(c, r, scale) : NULL);
    }
    free(x);
    return status;
}

/* |H|, and its standard error where coherence and averages are known: half of the variance is the phase's. */
static void make_magnitudes(const struct conversion *c, struct record *out)
{
    const size_t n = c->record->n;
    double *x = bf_alloc(n, sizeof *x);
    *out = (struct record){.kind = RECORD_MAGNITUDES, .n = n, .t0_s = c->record->t0_s, .dt_s = c->record->dt_s};
    for (size_t i = 0; i < c->n_responses; i++) {
        const struct response *r = &c->responses[i];
        char name[300];
        for (size_t k = 0; k < n; k++)
            x[k] = cabs(r->H[k]);
        (void)snprintf(name, sizeof name, "%.120s/%.120s", r->output, c->input);
        record_add_column(out, name, x);
        for (size_t k = 0; k < n; k++)
            x[k] = r->variance != NULL && c->averages > 0.0 ? sqrt(0.5 * r->variance[k]) : 0.0;
        (void)snprintf(name, sizeof name, "%.120s/%.120s" RECORD_SD, r->output, c->input);
        record_add_column(out, name, x);
    }
    free(x);
}

/* What the lines were read from, and their comments, go along. */
static void hand_over(const struct record *from, struct record *to)
{
    to->path = from->path != NULL ? bf_strdup(from->path) : NULL;
    memcpy(to->sha256, from->sha256, sizeof to->sha256);
    for (size_t i = 0; i < from->n_meta; i++)
        if (strcmp(from->meta[i].key, "excitation") != 0)
            record_add_meta(to, from->meta[i].key, from->meta[i].value);
    record_add_meta(to, "excitation", RECORD_RESPONSE);
}

static void conversion_free(struct conversion *c)
{
    for (size_t i = 0; i < c->n_responses; i++)
        free(c->responses[i].output), free(c->responses[i].H), free(c->responses[i].variance);
    free(c->responses), free(c->input), free(c->level);
}

static enum bf_status take_averages(struct conversion *c, struct bf_error *err)
{
    const char *text = record_meta(c->record, RECORD_AVERAGES);
    if (text == NULL || (record_meta_number(c->record, RECORD_AVERAGES, &c->averages) && c->averages >= 1.0))
        return BF_OK;
    return bf_fail_at(err, c->record->path, 1, "'# averages: %.40s' must be a number of averages, 1 or more", text);
}

enum bf_status record_from_response(const struct record *lines, struct record *out, struct bf_error *err)
{
    struct conversion c = {.record = lines};
    *out = (struct record){0};
    c.level = bf_alloc(lines->n, sizeof *c.level);
    enum bf_status status = take_averages(&c, err);
    if (!status)
        status = take_axis(&c, err);
    if (!status)
        status = take_columns(&c, err);
    for (size_t i = 0; i < c.n_responses && !status; i++)
        find_variance(&c, &c.responses[i]);
    if (!status && c.without_phase) {
        make_magnitudes(&c, out);
    } else if (!status) {
        find_levels(&c);
        status = make_record(&c, out, err);
    }
    conversion_free(&c);
    if (status)
        record_free(out);
    else
        hand_over(lines, out);
    return status;
}
