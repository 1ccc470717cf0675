/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The patch at another place: its region edges move, and the knots of the splines with them, so that the shifted modes stay
 * in the reduced space to first order. Matrices and functionals are smooth in the shift; their derivatives are differences
 * of order four over a shift so small beside every region that both errors are near 1e-10.
 */
#include "predictor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Step of the differences, relative to the shortest region: small, because y″ of a place jumps where an edge passes it. */
static const double difference_part = 1e-4;
enum { STENCIL = 4 };
static const double stencil_at[STENCIL] = {-2.0, -1.0, 1.0, 2.0};
static const double stencil_weight[STENCIL] = {1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};

void geometry_original(const struct predictor *p, struct model *out)
{
    struct bf_error err;
    (void)model_copy(&p->model, out, &err);
    if (p->geometry.patch_moves)
        (void)model_shift_patch(&p->geometry.fixed, 0.0, out, &err);
}

/* ---- The space ---- */

void patch_free(struct geometry *g)
{
    for (size_t b = 0; g->block_by_shift != NULL && b < g->base.n_blocks; b++)
        free(g->block_by_shift[b]);
    free(g->block_by_shift);
    g->block_by_shift = NULL;
    reduced_free(&g->base);
}

static enum bf_status patch_shift(const struct predictor *p, const double theta[], double *shift_m,
                                  struct bf_error *err)
{
    *shift_m = 0.0;
    enum bf_status status = BF_OK;
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        struct beam_geometry at;
        status = read_geometry(p, 0, e, theta, &at, err);
        *shift_m += at.patch_shift_m;
    }
    if (status == BF_OK && !isfinite(*shift_m))
        status = bf_fail(err, BF_NUMERIC, "the patch's shift is not a number");
    return status;
}

enum bf_status geometry_place(struct predictor *p, const double theta[], struct bf_error *err)
{
    if (!p->geometry.patch_moves)
        return BF_OK;
    enum bf_status status = patch_shift(p, theta, &p->geometry.base_shift_m, err);
    if (status == BF_OK)
        status = model_shift_patch(&p->geometry.fixed, p->geometry.base_shift_m, &p->model, err);
    p->geometry.patch_shift_m = p->geometry.base_shift_m;
    return status;
}

enum bf_status patch_rebase(struct predictor *p, struct bf_error *err)
{
    struct geometry *g = &p->geometry;
    patch_free(g);
    enum bf_status status = reduced_move(&p->reduced, &p->model, &p->model, &g->base, err);
    g->block_by_shift = bf_alloc(g->base.n_blocks, sizeof *g->block_by_shift);
    return status;
}

/* A model and its space at one shift. */
struct moved {
    struct model model;
    struct reduced reduced;
};

static enum bf_status move_to(const struct predictor *p, double shift_m, struct moved *out, struct bf_error *err)
{
    struct model from;
    *out = (struct moved){0};
    (void)model_copy(&p->model, &from, err);
    (void)model_copy(&p->model, &out->model, err);
    enum bf_status status = model_shift_patch(&p->geometry.fixed, p->geometry.base_shift_m, &from, err);
    if (status == BF_OK)
        status = model_shift_patch(&p->geometry.fixed, shift_m, &out->model, err);
    if (status == BF_OK)
        status = reduced_move(&p->geometry.base, &from, &out->model, &out->reduced, err);
    model_free(&from);
    return status;
}

static void moved_free(struct moved *moved)
{
    model_free(&moved->model);
    reduced_free(&moved->reduced);
}

/* One parameter's share: dg of every functional gains scale · (its g in the moved space). */
static void add_channels(const struct run *run, const struct moved *at, size_t j, double scale, double g[])
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    for (size_t o = 0; o < p->model.n_outputs; o++) {
        reduced_output(&at->reduced, &at->model.outputs[o], g);
        add_scaled(n, scale, g, functional_change(&p->outputs[o], n, j));
    }
    for (size_t i = 0; i < p->n_sources; i++) {
        double shift_m = 0.0;
        struct bf_error err;
        struct model_input input = at->model.inputs[p->sources[i].input];
        if (i >= p->model.n_inputs)
            (void)geometry_input_shift(p, p->sources[i].record, p->sources[i].input, run->theta, &shift_m, &err);
        input.at_m += shift_m;
        reduced_input(&at->reduced, &input, g);
        add_scaled(n, scale, g, functional_change(&p->inputs[i], n, j));
    }
}

static void add_load(const struct run *run, const struct moved *at, size_t j, double scale, double g[])
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    if (p->base_load == NULL)
        return;
    for (size_t m = 0; m < p->model.n_materials; m++) {
        reduced_load(&at->reduced, &at->model, m, g);
        add_scaled(n, -scale * run->theta[p->map.rho[m]], g, functional_change(p->base_load, n, j));
    }
    for (size_t o = 0; o < p->model.n_outputs; o++) {
        const size_t place = p->map.output_place[o];
        reduced_point(&at->reduced, 0, place == SIZE_MAX ? p->model.outputs[o].at_m : run->theta[place], g);
        add_scaled(n, -scale * p->model.outputs[o].mass_kg, g, functional_change(p->base_load, n, j));
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_term term;
        for (int t = 0; t < p->model.effects[e].effect->n_terms; t++) {
            if (!point_mass(p, e, t, run->theta, &term))
                continue;
            reduced_point(&at->reduced, 0, term.place.at_m, g);
            add_scaled(n, -scale * term.value.mass, g, functional_change(p->base_load, n, j));
        }
    }
}

/* dg of every functional and dB of every block gain weight · (their values in the moved space). */
static void add_moved(const struct run *run, const struct moved *at, double weight)
{
    struct predictor *p = run->p;
    size_t n = p->reduced.n;
    double *g = bf_alloc(n, sizeof *g);
    for (size_t b = 0; b < at->reduced.n_blocks; b++)
        if (p->geometry.block_by_shift[b] != NULL)
            add_scaled(n * n, weight, at->reduced.blocks[b].B, p->geometry.block_by_shift[b]);
    for (size_t j = 0; j < p->map.n; j++) {
        double scale = p->geometry.patch_by[j] * weight;
        if (!not_zero(scale))
            continue;
        add_channels(run, at, j, scale, g);
        add_load(run, at, j, scale, g);
        laws_add_moved(run, &at->model, &at->reduced, j, scale);
    }
    free(g);
}

static void clear_changes(struct predictor *p, struct functional list[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < list[i].n_changes; c++)
            if (not_zero(p->geometry.patch_by[list[i].changes[c].parameter]))
                memset(list[i].changes[c].g, 0, p->reduced.n * sizeof(double));
}

static enum bf_status differentiate_shift(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    struct geometry *g = &p->geometry;
    size_t n = p->reduced.n;
    double shortest = p->model.length_m;
    for (size_t r = 0; r < p->model.n_regions; r++)
        shortest = fmin(shortest, p->model.regions[r].to_m - p->model.regions[r].from_m);
    double h = difference_part * shortest;
    for (size_t b = 0; b < g->base.n_blocks; b++) {
        if (g->block_by_shift[b] == NULL && g->base.blocks[b].B != NULL)
            g->block_by_shift[b] = bf_alloc(n * n, sizeof(double));
        if (g->block_by_shift[b] != NULL)
            memset(g->block_by_shift[b], 0, n * n * sizeof(double));
    }
    clear_changes(p, p->inputs, p->n_sources);
    clear_changes(p, p->outputs, p->model.n_outputs);
    clear_changes(p, p->coordinates, p->n_coordinates);
    if (p->base_load != NULL)
        clear_changes(p, p->base_load, 1);
    enum bf_status status = BF_OK;
    for (int i = 0; status == BF_OK && i < STENCIL; i++) {
        struct moved at;
        status = move_to(p, g->patch_shift_m + stencil_at[i] * h, &at, err);
        if (status == BF_OK)
            add_moved(run, &at, stencil_weight[i] / h);
        moved_free(&at);
    }
    return status;
}

enum bf_status patch_evaluate(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    struct geometry *g = &p->geometry;
    struct moved at;
    double shift_m;
    enum bf_status status = patch_shift(p, run->theta, &shift_m, err);
    if (status != BF_OK)
        return status;
    predictor_use(p, run->theta); /* places of effects may be parameters too */
    if (not_zero(shift_m - g->patch_shift_m)) {
        status = move_to(p, shift_m, &at, err);
        if (status == BF_OK) {
            status = model_shift_patch(&g->fixed, shift_m, &p->model, err);
            struct reduced old = p->reduced;
            p->reduced = at.reduced;
            at.reduced = old;
            g->patch_shift_m = shift_m;
            functionals_place(&p->model, &p->reduced, p->inputs, p->outputs);
        }
        moved_free(&at);
    }
    bool wanted = false;
    for (size_t j = 0; j < p->map.n; j++)
        wanted = wanted || (run_wants(run, j) && not_zero(g->patch_by[j]));
    p->system->block_by_shift = NULL;
    if (status == BF_OK && wanted) {
        status = differentiate_shift(run, err);
        p->system->block_by_shift = g->block_by_shift;
        p->system->shift_by = g->patch_by;
    }
    return status;
}
