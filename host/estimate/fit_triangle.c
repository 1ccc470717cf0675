/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_triangle.h"

#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

struct triangle triangle_new(size_t n_unknowns)
{
    const size_t n = n_unknowns + 1;
    return (struct triangle){.n = n, .R = bf_alloc(n * n, sizeof(double))};
}

void triangle_free(struct triangle *t)
{
    free(t->R), free(t->A);
    *t = (struct triangle){0};
}

enum bf_status triangle_add(struct triangle *t, size_t some, size_t stride, const double J[], const double r[],
                            struct bf_error *err)
{
    const size_t height = t->n + some;
    if (some > t->most) {
        t->most = some;
        t->A = bf_grow(t->A, height * t->n, sizeof *t->A);
    }
    for (size_t j = 0; j < t->n; j++) {
        memcpy(t->A + j * height, t->R + j * t->n, t->n * sizeof *t->A);
        if (some > 0)
            memcpy(t->A + j * height + t->n, j + 1 < t->n ? J + j * stride : r, some * sizeof *t->A);
    }
    return dense_qr_triangle(height, t->n, t->A, t->R, err);
}

void triangle_into(const struct triangle *t, size_t stride, double jacobian[], double beside[])
{
    for (size_t j = 0; j + 1 < t->n; j++)
        memcpy(jacobian + j * stride, t->R + j * t->n, t->n * sizeof *t->R);
    memcpy(beside, t->R + (t->n - 1) * t->n, t->n * sizeof *t->R);
}
