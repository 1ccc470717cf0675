/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "record.h"

double times_at(struct times *t, size_t k)
{
    if (t->read == NULL)
        return t->x[k];
    if (k < t->first || k >= t->first + t->n) {
        t->first = k - k % TIMES_BLOCK;
        t->n = t->read(t->context, t->first, TIMES_BLOCK, t->block);
    }
    return t->block[k - t->first];
}

void time_axis_note(struct number_digits *most, struct number_digits one)
{
    if (one.significant > most->significant)
        most->significant = one.significant;
    if (one.decimals > most->decimals)
        most->decimals = one.decimals;
}

/*
 * A unit of the last digit of t. '%.4f' shows in the decimals (all times have 4), '%.7g' in the significant digits
 * (most times have 7); the coarser of the two is right for both.
 */
static double unit_of_last_digit(double t, struct number_digits most)
{
    if (most.significant == 0)
        return 0;
    double fixed = pow(10, -most.decimals);
    double general = t != 0 ? pow(10, floor(log10(fabs(t))) + 1 - most.significant) : 0;
    return fixed > general ? fixed : general;
}

static void least_squares(struct times *t, size_t n, double *t0, double *dt)
{
    const double begin = times_at(t, 0);
    long double centre = ((long double)n - 1) / 2, sum = 0, moment = 0;
    for (size_t k = 0; k < n; k++) {
        long double u = (long double)times_at(t, k) - (long double)begin;
        sum += u;
        moment += ((long double)k - centre) * u;
    }
    long double count = (long double)n;
    long double slope = moment / (count * (count * count - 1) / 12); /* Σ (k − c)² = n (n² − 1)/12 */
    *dt = (double)slope;
    *t0 = (double)((long double)begin + sum / count - slope * centre);
}

/* Does the line t0 + k dt explain every printed time? */
static bool explains(struct times *t, size_t n, struct number_digits most, double t0, double dt)
{
    for (size_t i = 0; i < n; i++) {
        size_t k = n - 1 - i; /* a wrong step shows at the end first */
        double slack = 1e-9 * dt + 4 * 2.3e-16 * fabs(times_at(t, k));
        if (!(fabs(times_at(t, k) - (t0 + (double)k * dt)) <=
              0.50001 * unit_of_last_digit(times_at(t, k), most) + slack))
            return false;
    }
    return true;
}

static double round_to_digits(double x, int digits)
{
    char text[40];
    double rounded;
    int n = snprintf(text, sizeof text, "%.*e", digits - 1, x);
    return number_parse(text, text + n, '.', &rounded) ? rounded : x;
}

/* Clocks tick in round numbers: take the roundest rate or step that the data allow. */
static void make_round(struct times *t, size_t n, struct number_digits most, double *t0, double *dt)
{
    const double start[2] = {times_at(t, 0), *t0};
    for (int digits = 1; digits <= 12; digits++) {
        const double step[2] = {1 / round_to_digits(1 / *dt, digits), round_to_digits(*dt, digits)};
        for (int i = 0; i < 4; i++) {
            if (!explains(t, n, most, start[i / 2], step[i % 2]))
                continue;
            *t0 = start[i / 2];
            *dt = step[i % 2];
            return;
        }
    }
}

double time_axis_round_step(double dt, int significant)
{
    if (significant > 15)
        significant = 15; /* a double has no more */
    for (int digits = 1; digits < significant; digits++) {
        double step = round_to_digits(dt, digits), rate = round_to_digits(1 / dt, digits);
        if (step == dt)
            return dt;
        if (round_to_digits(1 / rate, significant) == dt)
            return 1 / rate;
    }
    return dt;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_step(struct times *t, size_t n)
{
    double *step = bf_alloc(n - 1, sizeof *step);
    for (size_t k = 1; k < n; k++)
        step[k - 1] = times_at(t, k) - times_at(t, k - 1);
    qsort(step, n - 1, sizeof *step, compare_doubles);
    double median = step[(n - 1) / 2];
    free(step);
    return median;
}

/* The first step that differs from the usual one; when each is within rounding, the first sample off the line. */
static size_t find_offender(struct times *t, size_t n, struct number_digits most, double t0, double dt, char why[256])
{
    static const char too_few_digits[] = ", or time is printed with too few digits";
    double usual = median_step(t, n), coarsest = unit_of_last_digit(times_at(t, n - 1), most);
    for (size_t k = 1; k < n; k++) {
        double unit = unit_of_last_digit(times_at(t, k), most), step = times_at(t, k) - times_at(t, k - 1);
        double allowed = (unit < 0.5 * usual ? unit : 0.5 * usual) + 0.02 * usual;
        if (fabs(step - usual) <= allowed)
            continue;
        const char *guess = step > 1.5 * usual       ? " (are samples missing?)"
                            : coarsest > 0.4 * usual ? too_few_digits
                                                     : "";
        snprintf(why, 256, "time advances by %.6g s here and by %.6g s elsewhere: the samples are not uniform%s", step,
                 usual, guess);
        return k;
    }
    size_t worst = 0;
    double most_off = times_at(t, 0) - t0;
    for (size_t k = 1; k < n; k++) {
        const double off = times_at(t, k) - t0 - (double)k * dt;
        if (fabs(off) > fabs(most_off))
            worst = k, most_off = off;
    }
    snprintf(why, 256, "time is %.3g s off an axis with the mean step %.6g s: the samples are not uniform%s", most_off,
             dt, coarsest > 0.4 * usual ? too_few_digits : " (the clock drifts)");
    return worst;
}

bool time_axis_fit(const double t[], size_t n, struct number_digits most, double *t0, double *dt, size_t *bad,
                   char why[256])
{
    struct times times = {.x = t};
    return times_fit(&times, n, most, t0, dt, bad, why);
}

bool times_fit(struct times *t, size_t n, struct number_digits most, double *t0, double *dt, size_t *bad, char why[256])
{
    for (size_t k = 1; k < n; k++) {
        if (times_at(t, k) > times_at(t, k - 1))
            continue;
        *bad = k;
        snprintf(why, 256, "time does not increase: %.9g s after %.9g s", times_at(t, k), times_at(t, k - 1));
        return false;
    }
    least_squares(t, n, t0, dt);
    for (size_t k = 0; k < n; k++) {
        double printed = 0.75 * unit_of_last_digit(times_at(t, k), most);
        double allowed = (printed < 0.3 * *dt ? printed : 0.3 * *dt) + 0.01 * *dt;
        if (fabs(times_at(t, k) - (*t0 + (double)k * *dt)) <= allowed)
            continue;
        *bad = find_offender(t, n, most, *t0, *dt, why);
        return false;
    }
    make_round(t, n, most, t0, dt);
    return true;
}
