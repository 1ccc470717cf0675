/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "maths.h"

static const double of_normal = 0.6744897501960817; /* median of |x|, unit variance */

/* Runs that are sorted by insertion. */
enum { RUN = 16 };

static void sort_run(double x[], size_t n)
{
    for (size_t i = 1; i < n; i++) {
        const double one = x[i];
        size_t k = i;
        for (; k > 0 && x[k - 1] > one; k--)
            x[k] = x[k - 1];
        x[k] = one;
    }
}

/* to[n] from its two sorted parts in from[n]. */
static void merge(const double from[], size_t n, size_t middle, double to[])
{
    size_t i = 0, k = middle;
    for (size_t at = 0; at < n; at++)
        to[at] = k == n || (i < middle && from[i] <= from[k]) ? from[i++] : from[k++];
}

/* Merge sort: qsort() asks a function for every comparison, at four times the cost. */
void sort_ascending(size_t n, double x[])
{
    double *other = bf_alloc(n + 1, sizeof *other), *from = x, *to = other;
    for (size_t first = 0; first < n; first += RUN)
        sort_run(x + first, n - first < RUN ? n - first : RUN);
    for (size_t width = RUN; width < n; width *= 2) {
        for (size_t first = 0; first < n; first += 2 * width) {
            const size_t rest = n - first, both = rest < 2 * width ? rest : 2 * width;
            merge(from + first, both, width < both ? width : both, to + first);
        }
        double *swap = from;
        from = to, to = swap;
    }
    if (from != x)
        memcpy(x, from, n * sizeof *x);
    free(other);
}

double median(size_t n, double x[])
{
    if (n == 0)
        return nan("");
    sort_ascending(n, x);
    return n % 2 == 1 ? x[n / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

double robust_deviation(size_t n, const double x[], double *middle)
{
    double *work = bf_alloc(n + 1, sizeof *work);
    memcpy(work, x, n * sizeof *work);
    *middle = median(n, work);
    for (size_t i = 0; i < n; i++)
        work[i] = fabs(x[i] - *middle);
    const double deviation = median(n, work) / of_normal;
    free(work);
    return deviation;
}
