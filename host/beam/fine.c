/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "beam.h"
#include "fine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Gauss–Legendre, 4 points: exact to degree 7; a product of two cubics has degree 6. */
enum { GAUSS = 4 };
static const double gauss_x[GAUSS] = {-0.86113631159405257522, -0.33998104358485626480, 0.33998104358485626480,
                                      0.86113631159405257522};
static const double gauss_w[GAUSS] = {0.34785484513745385737, 0.65214515486254614263, 0.65214515486254614263,
                                      0.34785484513745385737};

static void boundary(enum model_support support, bool root_released, size_t *lead, size_t *trail)
{
    switch (support) {
    case SUPPORT_CLAMPED_FREE:
        *lead = 2, *trail = 0;
        break;
    case SUPPORT_CLAMPED_CLAMPED:
        *lead = 2, *trail = 2;
        break;
    case SUPPORT_PINNED_PINNED:
        *lead = 1, *trail = 1;
        break;
    case SUPPORT_FREE_FREE:
        *lead = 0, *trail = 0;
        break;
    }
    if (root_released && *lead == 2)
        *lead = 1; /* φ(0) = 0 stays, φ'(0) is free */
}

/* An edge in its place among the others; none nearer to another or to an end than `least_m`. Returns how many there are. */
static size_t insert_edge(double edges[], size_t n, double at_m, double length_m, double least_m)
{
    size_t i = n;
    if (at_m < least_m || at_m > length_m - least_m)
        return n;
    while (i > 0 && edges[i - 1] > at_m)
        i--;
    if ((i > 0 && at_m - edges[i - 1] < least_m) || (i < n && edges[i] - at_m < least_m))
        return n;
    memmove(edges + i + 1, edges + i, (n - i) * sizeof *edges);
    edges[i] = at_m;
    return n + 1;
}

/* A law over a short span pulls with a pair of moments: y'' jumps at the span's ends. */
static size_t add_law_spans(const struct model *model, double edges[], size_t n)
{
    const double least_m = 1e-4 * model->length_m; /* shorter elements cost the low modes their digits */
    const struct beam_place place = model_place(model);
    for (size_t e = 0; e < model->n_effects; e++) {
        const struct model_effect *own = &model->effects[e];
        double p[BEAM_EFFECT_PARAMETERS] = {0};
        struct beam_law_place law = {0};
        for (int i = 0; i < own->effect->n_parameters; i++)
            p[i] = own->parameters[i].value;
        if (own->effect->law_place == NULL || own->effect->law_place(p, &place, &law) != 0 ||
            law.points != BEAM_LAW_AT_SPAN)
            continue;
        n = insert_edge(edges, n, law.at_m - 0.5 * law.width_m, model->length_m, least_m);
        n = insert_edge(edges, n, law.at_m + 0.5 * law.width_m, model->length_m, least_m);
    }
    return n;
}

void fine_fill_gauss(struct fine_space *space)
{
    const double *t = space->spline.knots;
    space->gauss = bf_alloc(GAUSS * space->spline.n, sizeof *space->gauss);
    for (size_t i = 3; i < space->spline.n; i++)
        for (size_t q = 0; q < GAUSS && t[i] < t[i + 1]; q++)
            spline_evaluate(&space->spline, 0.5 * (t[i] + t[i + 1]) + 0.5 * (t[i + 1] - t[i]) * gauss_x[q],
                            &space->gauss[GAUSS * i + q]);
}

enum bf_status fine_new(const struct model *model, size_t n_splines, bool root_released, bool knots_on_edges,
                        struct fine_space *out, struct bf_error *err)
{
    double *edges = bf_alloc(model->n_regions + 2 * model->n_effects + 1, sizeof *edges);
    size_t n_edges = 0;
    for (size_t r = 0; knots_on_edges && r + 1 < model->n_regions; r++)
        edges[n_edges++] = model->regions[r].to_m;
    if (knots_on_edges)
        n_edges = add_law_spans(model, edges, n_edges);
    *out = (struct fine_space){.length_m = model->length_m};
    enum bf_status status = spline_new(model->length_m, edges, n_edges, n_splines, &out->spline, err);
    free(edges);
    if (status != BF_OK)
        return status;
    boundary(model->support, root_released, &out->lead, &out->trail);
    out->n = out->spline.n - out->lead - out->trail;
    fine_fill_gauss(out);
    return BF_OK;
}

void fine_free(struct fine_space *space)
{
    spline_free(&space->spline);
    free(space->gauss);
    *space = (struct fine_space){0};
}

/* band += scale · v vᵀ for the four functions of v (those that were left out are skipped). */
static void add_outer(const struct fine_space *space, size_t first, const double v[SPLINE_ORDER], double scale,
                      double band[])
{
    for (size_t a = 0; a < SPLINE_ORDER; a++) {
        size_t i = first + a;
        if (i < space->lead || i - space->lead >= space->n)
            continue;
        for (size_t b = a; b < SPLINE_ORDER && first + b - space->lead < space->n; b++)
            band[(i - space->lead) * FINE_BAND + (b - a)] += scale * v[a] * v[b];
    }
}

void fine_add_form(const struct fine_space *space, int derivative, double from_m, double to_m, double scale,
                   double band[])
{
    const double *t = space->spline.knots;
    for (size_t i = 3; i < space->spline.n; i++) {
        double from = fmax(t[i], from_m), to = fmin(t[i + 1], to_m); /* a region edge may lie inside an element */
        double h = to - from, middle = 0.5 * (from + to);
        if (!(h > 0.0))
            continue;
        const bool whole = h == t[i + 1] - t[i];
        for (size_t q = 0; q < GAUSS; q++) {
            const struct spline_values *values = &space->gauss[GAUSS * i + q];
            struct spline_values inside;
            if (!whole) {
                spline_evaluate(&space->spline, middle + 0.5 * h * gauss_x[q], &inside);
                values = &inside;
            }
            add_outer(space, values->first, values->d[derivative], scale * 0.5 * h * gauss_w[q], band);
        }
    }
}

void fine_add_point(const struct fine_space *space, int derivative, double at_m, double scale, double band[])
{
    struct spline_values values;
    spline_evaluate(&space->spline, at_m, &values);
    add_outer(space, values.first, values.d[derivative], scale, band);
}

void fine_add_functional(const struct fine_space *space, int derivative, double at_m, double scale, double g[])
{
    const double sides[2] = {at_m, nextafter(at_m, 0.0)}; /* limit from the right, and from the left */
    const int n_sides = derivative < 2 ? 1 : 2;
    for (int side = 0; side < n_sides; side++) {
        struct spline_values values;
        spline_evaluate(&space->spline, sides[side], &values);
        for (size_t a = 0; a < SPLINE_ORDER; a++) {
            size_t i = values.first + a;
            if (i >= space->lead && i - space->lead < space->n)
                g[i - space->lead] += scale / n_sides * values.d[derivative][a];
        }
    }
}

/* One row: the upper diagonals from the row itself, the lower ones from the rows above. */
static double multiply_row(const double band[], const double x[], size_t i, size_t above, size_t below)
{
    double sum = band[i * FINE_BAND] * x[i];
    for (size_t d = 1; d <= below; d++)
        sum += band[i * FINE_BAND + d] * x[i + d];
    for (size_t d = 1; d <= above; d++)
        sum += band[(i - d) * FINE_BAND + d] * x[i - d];
    return sum;
}

void fine_multiply(const struct fine_space *space, const double band[], const double x[], double y[])
{
    const size_t n = space->n, most = FINE_BAND - 1;
    for (size_t i = 0; i < n; i++) {
        const size_t above = i < most ? i : most, below = n - 1 - i < most ? n - 1 - i : most;
        y[i] = above == most && below == most ? multiply_row(band, x, i, most, most)
                                              : multiply_row(band, x, i, above, below);
    }
}
