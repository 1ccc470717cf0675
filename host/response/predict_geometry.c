/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Shifts of places and of the clock. The clock: a grid of interval (1 + e)·dt is the same grid with s divided by 1 + e. A
 * point force: its functional at a + d, in each record of its own. The patch and the length: predict_moved.c.
 */
#include "predictor.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- Life ---- */

void geometry_new(struct predictor *p)
{
    struct bf_error err;
    struct geometry *g = &p->geometry;
    double *theta = bf_alloc(p->map.n, sizeof *theta);
    *g = (struct geometry){.clock = 1.0};
    for (size_t i = 0; i < p->map.n; i++)
        theta[i] = p->refs[i].value;
    g->move_by = bf_alloc(p->map.n * MODEL_MOVES, sizeof *g->move_by);
    g->clock_by = bf_alloc(p->map.n, sizeof *g->clock_by);
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_geometry at;
        if (read_geometry(p, 0, e, theta, &at, &err) != BF_OK)
            continue;
        for (int s = 0; s < p->model.effects[e].effect->n_parameters; s++) {
            size_t j = parameter_map_slot(&p->map, 0, e, s);
            g->move_by[j * MODEL_MOVES + MOVE_SHIFT] = at.by_parameter[0][s];
            g->clock_by[j] = at.by_parameter[2][s];
            g->moves = g->moves || not_zero(at.by_parameter[0][s]);
        }
    }
    for (int m = 0; m < MODEL_MOVES; m++) {
        if (p->map.move[m] == SIZE_MAX)
            continue;
        g->move_by[p->map.move[m] * MODEL_MOVES + (size_t)m] = 1.0;
        g->moves = true;
    }
    free(theta);
    (void)model_copy(&p->model, &g->fixed, &err);
}

void geometry_free(struct predictor *p)
{
    moved_space_free(&p->geometry);
    free(p->geometry.move_by);
    free(p->geometry.clock_by);
    model_free(&p->geometry.fixed);
    p->geometry = (struct geometry){0};
}

/* ---- Functionals ---- */

/* g of a free place at theta and its derivative by it, which is the slope there. */
static void place_free(const struct run *run, struct functional *f, size_t parameter)
{
    struct predictor *p = run->p;
    const size_t n = p->reduced.n;
    reduced_point(&p->reduced, 0, run->theta[parameter], f->g);
    if (run->want == NULL)
        return;
    reduced_point(&p->reduced, 1, run->theta[parameter], functional_change(f, n, parameter));
    p->moves[parameter] = true;
}

static enum bf_status place_channel(const struct run *run, const char *name, struct functional *f, size_t parameter,
                                    struct bf_error *err)
{
    if (parameter == SIZE_MAX) /* held: it stands where the base has it */
        return BF_OK;
    const double at_m = run->theta[parameter];
    if (!(at_m >= 0.0 && at_m <= run->p->model.length_m))
        return bf_fail(err, BF_NUMERIC, "%s at %.4g m is outside the beam", name, at_m);
    place_free(run, f, parameter);
    return BF_OK;
}

static enum bf_status place_channels(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    for (size_t o = 0; o < p->model.n_outputs && !status; o++)
        status = place_channel(run, p->model.outputs[o].name, &p->outputs[o], p->map.output_place[o], err);
    for (size_t i = 0; i < p->model.n_inputs && !status; i++)
        status = place_channel(run, p->model.inputs[i].name, &p->inputs[i], p->map.input_place[i], err);
    return status;
}

/* dg of a shifted source by the parameters of the effects that shift it. */
static void source_changes(const struct run *run, const struct source *source, struct functional *f, double at_m)
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    double *slope = bf_alloc(n, sizeof *slope);
    struct bf_error err;
    reduced_point(&p->reduced, 1, at_m, slope);
    for (size_t c = 0; c < f->n_changes; c++)
        if (!moves_space(p, f->changes[c].parameter))
            memset(f->changes[c].g, 0, n * sizeof(double));
    if (p->map.input_place[source->input] != SIZE_MAX) {
        memcpy(functional_change(f, n, p->map.input_place[source->input]), slope, n * sizeof *slope);
        p->moves[p->map.input_place[source->input]] = true;
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_geometry at;
        if (p->model.effects[e].effect->geometry == NULL || !effect_on_input(&p->model, e, source->input) ||
            read_geometry(p, source->record, e, run->theta, &at, &err) != BF_OK)
            continue;
        for (int s = 0; s < p->model.effects[e].effect->n_parameters; s++) {
            size_t j = parameter_map_slot(&p->map, source->record, e, s);
            if (!not_zero(at.by_parameter[1][s]))
                continue;
            double *dg = functional_change(f, n, j);
            for (size_t i = 0; i < n; i++)
                dg[i] += at.by_parameter[1][s] * slope[i];
            p->moves[j] = true;
        }
    }
    free(slope);
}

static enum bf_status place_sources(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    for (size_t i = p->model.n_inputs; status == BF_OK && i < p->n_sources; i++) {
        const struct source *source = &p->sources[i];
        double shift_m;
        status = geometry_input_shift(p, source->record, source->input, run->theta, &shift_m, err);
        if (status != BF_OK)
            break;
        double at_m = input_place(p, source->input, run->theta) + shift_m;
        reduced_point(&p->reduced, 0, at_m, p->inputs[i].g);
        if (run->want != NULL)
            source_changes(run, source, &p->inputs[i], at_m);
    }
    return status;
}

/* −Σ m φ(a) of masses at a point and its derivatives by m and a. */
static void add_point_masses(const struct run *run)
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    double *g = bf_alloc(2 * n, sizeof *g), *g_at = g + n;
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_term term;
        for (int t = 0; t < p->model.effects[e].effect->n_terms; t++) {
            if (!point_mass(p, &p->model, e, t, run->theta, &term))
                continue;
            reduced_effect_place(&p->reduced, &term.place, &p->model, e, g, g_at);
            add_scaled(n, -term.value.mass, g, p->base_load->g);
            for (int s = 0; s < p->model.effects[e].effect->n_parameters; s++) {
                size_t j = parameter_map_slot(&p->map, 0, e, s);
                if (not_zero(term.by_parameter[s].mass))
                    add_scaled(n, -term.by_parameter[s].mass, g, functional_change(p->base_load, n, j));
                if (term.place.at_parameter == s + 1 && not_zero(term.value.mass))
                    add_scaled(n, -term.value.mass, g_at, functional_change(p->base_load, n, j));
            }
        }
    }
    free(g);
}

/* The same of the sensors' masses, by a where the model frees it. */
static void add_sensor_masses(const struct run *run)
{
    struct predictor *p = run->p;
    const size_t n = p->reduced.n;
    double *g = bf_alloc(n, sizeof *g);
    for (size_t o = 0; o < p->model.n_outputs; o++) {
        const size_t j = p->map.output_place[o];
        const double m = p->model.outputs[o].mass_kg, at_m = j == SIZE_MAX ? p->model.outputs[o].at_m : run->theta[j];
        if (!(m > 0.0))
            continue;
        reduced_point(&p->reduced, 0, at_m, g);
        add_scaled(n, -m, g, p->base_load->g);
        if (j == SIZE_MAX)
            continue;
        reduced_point(&p->reduced, 1, at_m, g);
        add_scaled(n, -m, g, functional_change(p->base_load, n, j));
    }
    free(g);
}

/* g = −Σ ρ_m L_m − Σ m φ(a) and its derivatives. */
static void place_load(const struct run *run)
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    if (p->base_load == NULL)
        return;
    memset(p->base_load->g, 0, n * sizeof(double));
    for (size_t c = 0; c < p->base_load->n_changes; c++)
        if (!moves_space(p, p->base_load->changes[c].parameter))
            memset(p->base_load->changes[c].g, 0, n * sizeof(double));
    for (size_t m = 0; m < p->model.n_materials; m++) {
        double *dg = functional_change(p->base_load, n, p->map.rho[m]);
        reduced_load(&p->reduced, &p->model, m, dg);
        for (size_t i = 0; i < n; i++) {
            dg[i] = -dg[i];
            p->base_load->g[i] += run->theta[p->map.rho[m]] * dg[i];
        }
    }
    add_point_masses(run);
    add_sensor_masses(run);
}

enum bf_status geometry_rebase(struct predictor *p, struct bf_error *err)
{
    bool shakes = false;
    for (size_t e = 0; e < p->model.n_effects; e++)
        shakes = shakes || p->model.effects[e].effect->tone != NULL;
    p->inputs = functionals_new(p->n_sources, p->reduced.n);
    p->outputs = functionals_new(p->model.n_outputs, p->reduced.n);
    p->base_load = shakes ? functionals_new(1, p->reduced.n) : NULL;
    functionals_place(&p->model, &p->reduced, p->inputs, p->outputs);
    return p->geometry.moves ? moved_rebase(p, err) : BF_OK;
}

/* ---- The clock ---- */

static enum bf_status set_clock(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    double clock = 1.0;
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        struct beam_geometry at;
        status = read_geometry(p, 0, e, run->theta, &at, err);
        clock += at.clock_relative;
    }
    if (status == BF_OK && !(clock > 0.0 && isfinite(clock)))
        status = bf_fail(err, BF_NUMERIC, "a clock cannot run backwards: its relative error is below −1");
    if (status != BF_OK)
        return status;
    p->geometry.clock = clock;
    for (size_t r = 0; r < p->n_records && !p->in_pieces; r++) {
        struct response_grid *grid = &p->grids[p->plans[r].grid];
        double factor = p->plans[r].record->dt_s * clock / grid->dt_s;
        if (!(fabs(factor - 1.0) > 1e-15))
            continue;
        grid->dt_s *= factor;
        grid->sigma /= factor;
        for (size_t k = 0; k < grid->m; k++)
            grid->s[k] /= factor;
    }
    return BF_OK;
}

enum bf_status geometry_evaluate(const struct run *run, struct bf_error *err)
{
    enum bf_status status = set_clock(run, err);
    if (status == BF_OK && run->p->geometry.moves)
        status = moved_evaluate(run, err);
    if (status == BF_OK)
        status = place_channels(run, err);
    if (status == BF_OK)
        status = place_sources(run, err);
    if (status == BF_OK)
        place_load(run);
    return status;
}
