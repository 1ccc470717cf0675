/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The patch at another place, its edges, the free end: the edges of regions move, and the knots of the splines with them, so that the
 * modes stay in the reduced space to first order. Matrices and functionals are smooth in each move; their derivatives are differences of order four
 * over a move so small beside every region that both errors are near 1e-10. A law over the span keeps its points and shapes until the next base.
 */
#include "predictor.h"

#include <math.h>
#include <stdint.h>
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
    if (p->geometry.moves)
        (void)model_move(&p->geometry.fixed, (const double[MODEL_MOVES]){0.0}, out, &err);
}

bool moves_space(const struct predictor *p, size_t parameter)
{
    for (size_t m = 0; m < MODEL_MOVES; m++)
        if (not_zero(p->geometry.move_by[parameter * MODEL_MOVES + m]))
            return true;
    return false;
}

/* ---- The space ---- */

void moved_space_free(struct geometry *g)
{
    for (int m = 0; m < MODEL_MOVES; m++) {
        for (size_t b = 0; g->block_by[m] != NULL && b < g->base.n_blocks; b++)
            free(g->block_by[m][b]);
        free(g->block_by[m]);
        g->block_by[m] = NULL;
    }
    reduced_free(&g->base);
}

/* How far everything is from where the file has it. */
static enum bf_status moves_at(const struct predictor *p, const double theta[], double by_m[MODEL_MOVES],
                               struct bf_error *err)
{
    const struct model *fixed = &p->geometry.fixed;
    double from = 0.0, to = 0.0;
    enum bf_status status = BF_OK;
    memset(by_m, 0, MODEL_MOVES * sizeof *by_m);
    for (size_t e = 0; status == BF_OK && e < p->model.n_effects; e++) {
        struct beam_geometry at;
        status = read_geometry(p, 0, e, theta, &at, err);
        by_m[MOVE_SHIFT] += at.patch_shift_m;
    }
    (void)model_patch(fixed, &from, &to);
    const double stated[MODEL_MOVES] = {[MOVE_LENGTH] = fixed->length_m, [MOVE_FROM] = from, [MOVE_TO] = to};
    for (int m = 0; m < MODEL_MOVES; m++) {
        if (p->map.move[m] != SIZE_MAX)
            by_m[m] = theta[p->map.move[m]] - stated[m];
        if (status == BF_OK && !isfinite(by_m[m]))
            status = bf_fail(err, BF_NUMERIC, "a length or the patch's shift is not a number");
    }
    return status;
}

enum bf_status geometry_place(struct predictor *p, const double theta[], struct bf_error *err)
{
    struct geometry *g = &p->geometry;
    if (!g->moves)
        return BF_OK;
    enum bf_status status = moves_at(p, theta, g->base_m, err);
    if (status == BF_OK)
        status = model_move(&g->fixed, g->base_m, &p->model, err);
    memcpy(g->by_m, g->base_m, sizeof g->by_m);
    return status;
}

enum bf_status moved_rebase(struct predictor *p, struct bf_error *err)
{
    moved_space_free(&p->geometry);
    return reduced_move(&p->reduced, &p->model, &p->model, &p->geometry.base, err);
}

/* A model and its space at one geometry. */
struct moved {
    struct model model;
    struct reduced reduced;
};

static enum bf_status move_to(const struct predictor *p, const double by_m[MODEL_MOVES], struct moved *out,
                              struct bf_error *err)
{
    struct model from;
    *out = (struct moved){0};
    (void)model_copy(&p->model, &from, err);
    (void)model_copy(&p->model, &out->model, err);
    enum bf_status status = model_move(&p->geometry.fixed, p->geometry.base_m, &from, err);
    if (status == BF_OK)
        status = model_move(&p->geometry.fixed, by_m, &out->model, err);
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

/* g, unused: [n] */
static void add_load(const struct run *run, const struct moved *at, size_t j, double scale, double g[], double unused[])
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
        reduced_point(&at->reduced, 0, place == SIZE_MAX ? at->model.outputs[o].at_m : run->theta[place], g);
        add_scaled(n, -scale * p->model.outputs[o].mass_kg, g, functional_change(p->base_load, n, j));
    }
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_term term;
        for (int t = 0; t < p->model.effects[e].effect->n_terms; t++) {
            if (!point_mass(p, &at->model, e, t, run->theta, &term))
                continue;
            reduced_effect_place(&at->reduced, &term.place, &at->model, e, g, unused);
            add_scaled(n, -scale * term.value.mass, g, functional_change(p->base_load, n, j));
        }
    }
}

/* dg of every functional and dB of every block by one move gain weight · (their values in the moved space). */
static void add_moved(const struct run *run, const struct moved *at, size_t move, double weight)
{
    struct predictor *p = run->p;
    double *const *block_by = p->geometry.block_by[move];
    size_t n = p->reduced.n;
    double *g = bf_alloc(2 * n, sizeof *g);
    for (size_t b = 0; b < at->reduced.n_blocks; b++)
        if (block_by[b] != NULL)
            add_scaled(n * n, weight, at->reduced.blocks[b].B, block_by[b]);
    for (size_t j = 0; j < p->map.n; j++) {
        double scale = p->geometry.move_by[j * MODEL_MOVES + move] * weight;
        if (!not_zero(scale))
            continue;
        add_channels(run, at, j, scale, g);
        add_load(run, at, j, scale, g, g + n);
        laws_add_moved(run, &at->model, &at->reduced, j, scale);
    }
    free(g);
}

static void clear_changes(struct predictor *p, struct functional list[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < list[i].n_changes; c++)
            if (moves_space(p, list[i].changes[c].parameter))
                memset(list[i].changes[c].g, 0, p->reduced.n * sizeof(double));
}

static void clear_blocks(struct predictor *p, size_t move)
{
    struct geometry *g = &p->geometry;
    const size_t n = p->reduced.n;
    if (g->block_by[move] == NULL)
        g->block_by[move] = bf_alloc(g->base.n_blocks, sizeof **g->block_by);
    for (size_t b = 0; b < g->base.n_blocks; b++) {
        if (g->block_by[move][b] == NULL && g->base.blocks[b].B != NULL)
            g->block_by[move][b] = bf_alloc(n * n, sizeof(double));
        else if (g->block_by[move][b] != NULL)
            memset(g->block_by[move][b], 0, n * n * sizeof(double));
    }
}

static enum bf_status differentiate_move(const struct run *run, size_t move, struct bf_error *err)
{
    struct predictor *p = run->p;
    double shortest = p->model.length_m, by_m[MODEL_MOVES];
    for (size_t r = 0; r < p->model.n_regions; r++)
        shortest = fmin(shortest, p->model.regions[r].to_m - p->model.regions[r].from_m);
    const double h = difference_part * shortest;
    clear_blocks(p, move);
    memcpy(by_m, p->geometry.by_m, sizeof by_m);
    enum bf_status status = BF_OK;
    for (int i = 0; status == BF_OK && i < STENCIL; i++) {
        struct moved at;
        by_m[move] = p->geometry.by_m[move] + stencil_at[i] * h;
        status = move_to(p, by_m, &at, err);
        if (status == BF_OK)
            add_moved(run, &at, move, stencil_weight[i] / h);
        moved_free(&at);
    }
    return status;
}

/* Some parameter whose derivative is wanted acts by this move. */
static bool move_wanted(const struct run *run, size_t move)
{
    for (size_t j = 0; j < run->p->map.n; j++)
        if (run_wants(run, j) && not_zero(run->p->geometry.move_by[j * MODEL_MOVES + move]))
            return true;
    return false;
}

static enum bf_status differentiate(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    enum bf_status status = BF_OK;
    clear_changes(p, p->inputs, p->n_sources);
    clear_changes(p, p->outputs, p->model.n_outputs);
    clear_changes(p, p->coordinates, p->n_coordinates);
    if (p->base_load != NULL)
        clear_changes(p, p->base_load, 1);
    p->system->move_by = p->geometry.move_by;
    for (size_t m = 0; m < MODEL_MOVES; m++) {
        p->system->block_by_move[m] = NULL;
        if (status != BF_OK || !move_wanted(run, m))
            continue;
        status = differentiate_move(run, m, err);
        p->system->block_by_move[m] = p->geometry.block_by[m];
    }
    return status;
}

/* Model, space and functionals at these moves. */
static enum bf_status take_moves(struct predictor *p, const double by_m[MODEL_MOVES], struct bf_error *err)
{
    struct geometry *g = &p->geometry;
    struct moved at;
    enum bf_status status = move_to(p, by_m, &at, err);
    if (status == BF_OK)
        status = model_move(&g->fixed, by_m, &p->model, err);
    if (status == BF_OK) {
        struct reduced old = p->reduced;
        p->reduced = at.reduced;
        at.reduced = old;
        memcpy(g->by_m, by_m, sizeof g->by_m);
        functionals_place(&p->model, &p->reduced, p->inputs, p->outputs);
    }
    moved_free(&at);
    return status;
}

enum bf_status moved_evaluate(const struct run *run, struct bf_error *err)
{
    struct predictor *p = run->p;
    double by_m[MODEL_MOVES];
    enum bf_status status = moves_at(p, run->theta, by_m, err);
    if (status != BF_OK)
        return status;
    predictor_use(p, run->theta); /* places of effects may be parameters too */
    bool moved = false;
    for (size_t m = 0; m < MODEL_MOVES; m++)
        moved = moved || not_zero(by_m[m] - p->geometry.by_m[m]);
    if (moved)
        status = take_moves(p, by_m, err);
    else
        status = model_move(&p->geometry.fixed, by_m, &p->model, err); /* predictor_use() knows no effects' shifts */
    return status == BF_OK ? differentiate(run, err) : status;
}
