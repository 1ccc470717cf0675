/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum bf_status laws_new(struct predictor *p, struct bf_error *err)
{
    double dt = INFINITY;
    for (size_t r = 0; r < p->n_records; r++)
        dt = fmin(dt, p->records[r].dt_s);
    p->laws = bf_alloc(p->model.n_effects, sizeof *p->laws);
    p->n_coordinates = 0;
    p->nonlinear = false;
    p->moves = bf_alloc(p->map.n, sizeof *p->moves);
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        status = law_new(&p->model, &p->reduced, &p->map, e, acos(-1.0) / dt, &p->laws[e], err);
        p->n_coordinates += p->laws[e].d;
        p->nonlinear = p->nonlinear || p->laws[e].d > 0;
        if (p->laws[e].at_parameter != SIZE_MAX)
            p->moves[p->laws[e].at_parameter] = true;
        if (p->laws[e].width_parameter != SIZE_MAX)
            p->moves[p->laws[e].width_parameter] = true;
    }
    if (status == BF_OK && p->n_coordinates > MOST_COORDINATES)
        status = bf_fail(err, BF_NUMERIC, "the nonlinear effects need %zu coordinates, %d are possible; drop one",
                         p->n_coordinates, MOST_COORDINATES);
    if (status != BF_OK)
        return status;
    p->coordinates = bf_alloc(p->n_coordinates, sizeof *p->coordinates);
    size_t c = 0, n = p->reduced.n;
    for (size_t e = 0; e < p->model.n_effects; e++) {
        for (size_t j = 0; j < p->laws[e].d; j++, c++) {
            p->coordinates[c].g = bf_alloc(n, sizeof(double));
            memcpy(p->coordinates[c].g, p->laws[e].g + j * n, n * sizeof(double));
        }
    }
    return BF_OK;
}

void laws_free(struct predictor *p)
{
    for (size_t e = 0; p->laws != NULL && e < p->model.n_effects; e++)
        law_free(&p->laws[e]);
    free(p->laws);
    p->laws = NULL;
    free(p->moves);
    p->moves = NULL;
}

size_t law_first_coordinate(const struct predictor *p, size_t effect)
{
    size_t first = 0;
    for (size_t e = 0; e < effect; e++)
        first += p->laws[e].d;
    return first;
}

size_t law_first_dependency(const struct predictor *p, size_t effect)
{
    size_t first = 0;
    for (size_t e = 0; e < effect; e++)
        first += p->laws[e].n_dependencies;
    return first;
}

/* A point law whose place is a parameter: its functional follows the parameter. */
static void add_move(const struct run *run, struct functional *f, size_t parameter, const double g_move[])
{
    if (parameter == SIZE_MAX || !run_wants(run, parameter))
        return;
    size_t n_poles = run->p->system->n_poles;
    double complex *moved = bf_alloc(n_poles, sizeof *moved);
    system_functional(run->p->system, g_move, moved);
    for (size_t k = 0; k < n_poles; k++)
        f->d_alpha[parameter * n_poles + k] += moved[k];
    free(moved);
}

enum bf_status law_coordinates_evaluate(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct law *law = &p->laws[e];
        struct functional *first = p->coordinates + law_first_coordinate(p, e);
        double parameters[BEAM_EFFECT_PARAMETERS];
        if (law->d == 0)
            continue;
        parameter_map_effect(&p->map, 0, e, run->theta, parameters);
        enum bf_status status = law_move(law, &p->model, &p->reduced, parameters, err);
        if (status != BF_OK)
            return status;
        memcpy(first->g, law->g, p->reduced.n * sizeof(double)); /* a law over the span never moves: the same again */
        functionals_evaluate(run, first, law->d);
        add_move(run, first, law->at_parameter, law->g_at);
        add_move(run, first, law->width_parameter, law->g_width);
    }
    return BF_OK;
}
