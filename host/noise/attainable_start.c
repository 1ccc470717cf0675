/* SPDX-License-Identifier: GPL-3.0-or-later */
/* attainable_start.c — the poles that the search for a free linear model starts from. */
#include "attainable_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cost grows with the square of the modes; beyond these a record seldom tells more. */
enum { MOST_MODES = 20 };
/* … and pairs of poles at least: a model whose fit went wrong may have lost its modes, and few are cheap. */
enum { LEAST_MODES = 4 };
/* The lowest mode above the band is looked for up to here, in Nyquist frequencies. */
static const double beyond = 4.0;

int attainable_by_frequency(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

/*
 * x[2m], room for 2 (n_pairs + LEAST_MODES): the model's poles up to top_rad and the next, which stands for what lies above.
 * Where these are few, others between (vector fitting moves them).
 */
static size_t take_poles(const struct system *system, double top_rad, double x[])
{
    size_t m = 0, kept = 0;
    for (size_t k = 0; k < system->n_pairs; k++) {
        const double size = cabs(system->p[k]), a = fmax(-creal(system->p[k]), 1e-6 * size);
        if (!(size > 1e-6 * top_rad))
            continue; /* a rigid-body mode of a free beam has no band */
        x[2 * m] = log(size);
        x[2 * m++ + 1] = log(a);
    }
    qsort(x, m, 2 * sizeof *x, attainable_by_frequency);
    while (kept < m && kept < MOST_MODES && x[2 * kept] < log(top_rad))
        kept++;
    kept += kept < m && kept < MOST_MODES ? 1 : 0;
    for (; kept < LEAST_MODES; kept++) {
        x[2 * kept] = log(top_rad) - 0.5 * (double)(LEAST_MODES - kept);
        x[2 * kept + 1] = x[2 * kept] + log(0.01);
    }
    return kept;
}

enum bf_status attainable_start_poles(const struct model *model, double top_rad, size_t *m, double **x,
                                      struct bf_error *err)
{
    const struct reduced_options options = {.top_rad = beyond * top_rad, .min_modes = 1, .max_modes = MOST_MODES + 1};
    struct reduced reduced;
    enum bf_status status = reduced_new(model, &options, &reduced, err);
    if (status != BF_OK)
        return status;
    struct parameter_ref *refs = NULL;
    const size_t n = model_parameters(model, NULL, 0, &refs);
    struct parameter_map map = parameter_map_new(model, refs, n, 0);
    struct system *system = NULL;
    double *theta = bf_alloc(n + 1, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    status = system_new(model, &reduced, &map, &system, err);
    if (status == BF_OK)
        status = system_evaluate(system, theta, NULL, err);
    if (status == BF_OK) {
        *x = bf_alloc(2 * (system->n_pairs + LEAST_MODES), sizeof **x);
        *m = take_poles(system, top_rad, *x);
    }
    system_free(system);
    parameter_map_free(&map);
    reduced_free(&reduced);
    free(theta), free(refs);
    return status;
}
