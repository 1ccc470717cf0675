/* SPDX-License-Identifier: GPL-3.0-or-later */
/* findings_hum.c — mains and harmonics in what was recorded before anything moved. */
#include "findings.h"

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { HARMONICS = FINDING_LINES };

static const double mains[] = {50.0, 60.0}; /* Hz */
static const double off = 0.01;             /* mains are within this share of their frequency, and clocks too */
static const double least_periods = 5.0;    /* of the mains before the hit */
static const double over_background = 6.0;  /* amplitude of a line over those beside it */
static const double steady = 1.5;           /* amplitude in one half of the stretch over that in the other */
static const double least_part = 0.002;     /* of the rms of the whole column: less does no harm */

/* Complex amplitude of x[n], mean removed, at f cycles a sample, under Hann's window. */
static double complex line_at(const double x[], size_t n, double mean, double f)
{
    const double complex turn = cexp(CMPLX(0.0, -2.0 * M_PI * f));
    double complex sum = 0.0, phase = 1.0;
    double weight = 0.0;
    for (size_t k = 0; k < n; k++, phase *= turn) {
        const double w = 1.0 - cos(2.0 * M_PI * ((double)k + 0.5) / (double)n);
        sum += w * (x[k] - mean) * phase;
        weight += w;
    }
    return 2.0 * sum / weight;
}

struct stretch {
    const double *x;
    size_t n;
    double mean, dt_s;
};

/* rms of the amplitudes beside a line, 2.5 to 4.5 bins away on either side: Hann's window is blind there. */
static double background(const struct stretch *s, double f)
{
    double square = 0.0;
    for (int k = -4; k <= 4; k++) {
        if (k >= -1 && k <= 1)
            continue;
        const double beside = f + ((double)k + (k > 0 ? 0.5 : -0.5)) / (double)s->n;
        const double a = cabs(line_at(s->x, s->n, s->mean, fabs(beside)));
        square += a * a / 6.0;
    }
    return sqrt(square);
}

static bool is_line(const struct stretch *s, double f)
{
    const size_t half = s->n / 2;
    const double a = cabs(line_at(s->x, s->n, s->mean, f));
    const double early = cabs(line_at(s->x, half, s->mean, f)), late = cabs(line_at(s->x + half, half, s->mean, f));
    return a > over_background * background(s, f) && early < steady * late && late < steady * early;
}

/* Σ of squared amplitudes of the harmonics of f0. */
static double power(const struct stretch *s, double f0)
{
    double sum = 0.0;
    for (int k = 1; k <= HARMONICS && k * f0 < 0.5; k++) {
        const double a = cabs(line_at(s->x, s->n, s->mean, k * f0));
        sum += a * a;
    }
    return sum;
}

/* The best fundamental near nominal_Hz, cycles a sample. */
static double fundamental(const struct stretch *s, double nominal_Hz)
{
    const double nominal = nominal_Hz * s->dt_s, step = 0.1 / (double)s->n / 3.0;
    double best = nominal, most = 0.0;
    const int count = (int)fmin(ceil(off * nominal / step), 60.0);
    for (int k = -count; k <= count; k++) {
        const double f = nominal * (1.0 + off * (double)k / (double)(count > 0 ? count : 1));
        const double p = power(s, f);
        if (p > most)
            most = p, best = f;
    }
    return best;
}

static void say(const struct record *record, double rms, struct record_finding *f)
{
    size_t used =
        (size_t)snprintf(f->text, sizeof f->text, "%.60s: hum before the hit, %.3g rms (%.2g %% of the signal): ",
                         record->columns[f->column].name, f->value, 100.0 * f->value / rms);
    for (size_t k = 0; k < f->n_lines && used < sizeof f->text; k++)
        used += (size_t)snprintf(f->text + used, sizeof f->text - used, "%s%.2f Hz (%.3g)", k > 0 ? ", " : "",
                                 f->line[k].frequency_Hz, f->line[k].amplitude);
    if (used < sizeof f->text)
        (void)snprintf(
            f->text + used, sizeof f->text - used,
            ". The model takes %s as {kind: mains_hum, channel: %.60s, frequency_Hz: %.2f, amplitude: %.3g}.",
            f->n_lines > 1 ? "each of these lines" : "it", record->columns[f->column].name, f->line[0].frequency_Hz,
            f->line[0].amplitude);
}

static bool try_mains(const struct stretch *s, double nominal_Hz, struct record_finding *f)
{
    const double f0 = fundamental(s, nominal_Hz);
    double square = 0.0;
    f->n_lines = 0, f->mains_Hz = f0 / s->dt_s;
    for (int k = 1; k <= HARMONICS && k * f0 < 0.45; k++) {
        if (!is_line(s, k * f0))
            continue;
        const double a = cabs(line_at(s->x, s->n, s->mean, k * f0));
        f->line[f->n_lines].frequency_Hz = k * f0 / s->dt_s;
        f->line[f->n_lines++].amplitude = a;
        square += 0.5 * a * a;
    }
    f->value = sqrt(square);
    return f->n_lines > 0;
}

bool findings_hum(const struct record *record, size_t column, size_t quiet, struct record_finding *out)
{
    struct stretch s = {.x = record->columns[column].x, .n = quiet, .dt_s = record->dt_s};
    struct record_finding best = {.kind = FINDING_HUM, .column = column};
    double square = 0.0;
    for (size_t k = 0; k < record->n; k++)
        square += s.x[k] * s.x[k];
    for (size_t k = 0; k < quiet; k++)
        s.mean += s.x[k] / (double)quiet;
    const double rms = sqrt(square / (double)record->n);
    for (size_t m = 0; m < sizeof mains / sizeof *mains; m++) {
        struct record_finding one = {.kind = FINDING_HUM, .column = column};
        if ((double)quiet * s.dt_s * mains[m] < least_periods || mains[m] * s.dt_s > 0.45)
            continue;
        if (try_mains(&s, mains[m], &one) && one.value > best.value)
            best = one;
    }
    if (best.value <= least_part * rms)
        return false;
    say(record, rms, &best);
    *out = best;
    return true;
}
