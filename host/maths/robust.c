/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ground/ground.h"
#include "maths.h"

static const double of_normal = 0.6744897501960817; /* median of |x|, unit variance */

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void sort_ascending(size_t n, double x[])
{
    qsort(x, n, sizeof *x, ascending);
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
