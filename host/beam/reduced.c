/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reduced.c — the parameter-free blocks of a reduced space, projected once. */
#include "reduced_basis.h"
#include "reduced_place.h"

#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "fine.h"

enum { DEFAULT_SPLINES = 160 };

/* ---- Projected blocks ---- */

static void project_band(const struct reduced *r, const double band[], double B[])
{
    size_t N = r->space.n, n = r->n;
    double *MV = bf_alloc(N * n, sizeof *MV);
    for (size_t k = 0; k < n; k++)
        fine_multiply(&r->space, band, r->V + k * N, MV + k * N);
    dense_gemm(true, false, n, n, N, 1.0, r->V, MV, 0.0, B); /* Vᵀ A V */
    free(MV);
}

static struct block *add_block(struct reduced *r, struct block block)
{
    r->blocks = bf_grow(r->blocks, r->n_blocks + 1, sizeof *r->blocks);
    r->blocks[r->n_blocks] = block;
    if (block.kind != BLOCK_MODES)
        r->blocks[r->n_blocks].B = bf_alloc(r->n * r->n, sizeof(double));
    return &r->blocks[r->n_blocks++];
}

static void add_form_block(struct reduced *r, const struct model *model, struct block block, int derivative)
{
    double *band = bf_alloc(r->space.n * FINE_BAND, sizeof *band);
    reduced_material_form(&r->space, model, block.material, derivative, 1.0, band);
    project_band(r, band, add_block(r, block)->B);
    free(band);
}

static void add_place_block(struct reduced *r, const struct model *model, struct block block,
                            const struct beam_operator *place)
{
    double *g = bf_alloc(r->n, sizeof *g), *g_at = bf_alloc(r->n, sizeof *g_at);
    reduced_effect_place(r, place, model, block.effect, g, g_at);
    double *B = add_block(r, block)->B;
    for (size_t j = 0; j < r->n; j++)
        for (size_t i = 0; i < r->n; i++)
            B[i + j * r->n] = g[i] * g[j];
    free(g);
    free(g_at);
}

/* The masses of sensors. */
static void project_sensors(struct reduced *r, const struct model *model)
{
    for (size_t o = 0; o < model->n_outputs; o++) {
        const struct beam_operator place = sensor_place(model->outputs[o].at_m);
        if (model->outputs[o].mass_kg > 0.0)
            add_place_block(r, model, (struct block){.kind = BLOCK_SENSOR, .output = o}, &place);
    }
}

static enum bf_status project_blocks(struct reduced *r, const struct model *model, struct bf_error *err)
{
    for (size_t m = 0; m < model->n_materials; m++) {
        add_form_block(r, model, (struct block){.kind = BLOCK_MASS, .material = m}, 0);
        add_form_block(r, model, (struct block){.kind = BLOCK_STIFFNESS, .material = m}, 2);
    }
    project_sensors(r, model);
    for (size_t e = 0; e < model->n_effects; e++) {
        struct beam_term terms[BEAM_EFFECT_TERMS];
        enum bf_status status = effect_terms(model, e, terms, err);
        if (status != BF_OK)
            return status;
        for (size_t t = 0; t < (size_t)model->effects[e].effect->n_terms; t++) {
            struct block block = {.kind = BLOCK_FORM, .effect = e, .term = t};
            enum beam_operator_kind kind = terms[t].place.kind;
            for (size_t m = 0; is_form(kind) && m < model->n_materials; m++) {
                block.material = m;
                add_form_block(r, model, block, form_derivative(kind));
            }
            block.kind = kind == BEAM_OVER_MODES ? BLOCK_MODES : BLOCK_PLACE;
            if (kind == BEAM_OVER_MODES)
                add_block(r, block);
            else if (is_place(kind))
                add_place_block(r, model, block, &terms[t].place);
        }
    }
    return BF_OK;
}

static bool root_released(const struct model *model)
{
    for (size_t e = 0; e < model->n_effects; e++)
        if (model->effects[e].effect->releases_root)
            return true;
    return false;
}

enum bf_status reduced_new(const struct model *model, const struct reduced_options *options, struct reduced *out,
                           struct bf_error *err)
{
    *out = (struct reduced){.uniform = options->uniform};
    enum bf_status status = fine_new(model, options->n_splines ? options->n_splines : DEFAULT_SPLINES,
                                     root_released(model), !options->uniform, &out->space, err);
    if (status != BF_OK)
        return status;
    size_t N = out->space.n, n_own = own_index(model, model->n_effects);
    size_t capacity = options->max_modes + 2 * (model->n_inputs + model->n_outputs + 3 * model->n_effects) + 4;
    if (options->limit > 0 && n_own >= options->limit) {
        fine_free(&out->space);
        return bf_fail(err, BF_NUMERIC, "%zu effects have a mode of their own, which leaves none for the beam", n_own);
    }
    struct basis basis = {.space = &out->space,
                          .corrections = options->statics - 1,
                          .limit = options->limit ? options->limit - n_own : capacity};
    basis.M = bf_alloc(N * FINE_BAND, sizeof *basis.M);
    basis.V = bf_alloc(N * (capacity + n_own), sizeof *basis.V);
    basis.work = bf_alloc(N, sizeof *basis.work);
    status = reduced_basis(&basis, model, options, out, err);
    out->V = basis.V;
    out->n = basis.n + n_own;
    out->n_own = n_own;
    sparse_free(basis.factor);
    free(basis.M);
    free(basis.work);
    if (status == BF_OK)
        status = project_blocks(out, model, err);
    if (status != BF_OK)
        reduced_free(out);
    return status;
}

/* x of the region it lies in, stretched from the one model's edges to the other's. */
static double stretched(const struct model *from, const struct model *to, double x)
{
    for (size_t r = 0; r < from->n_regions; r++) {
        const struct region *a = &from->regions[r], *b = &to->regions[r];
        if (x <= a->to_m || r + 1 == from->n_regions)
            return x < a->to_m ? b->from_m + (x - a->from_m) * ((b->to_m - b->from_m) / (a->to_m - a->from_m))
                               : b->to_m;
    }
    return x;
}

enum bf_status reduced_move(const struct reduced *from, const struct model *from_model, const struct model *to_model,
                            struct reduced *out, struct bf_error *err)
{
    const struct spline *old = &from->space.spline;
    *out = (struct reduced){
        .space = from->space, .n = from->n, .n_own = from->n_own, .n_modes = from->n_modes, .uniform = from->uniform};
    double *knots = out->space.spline.knots = bf_alloc(old->n_knots, sizeof *knots);
    for (size_t k = 0; k < old->n_knots; k++)
        knots[k] = from->uniform ? old->knots[k] * (to_model->length_m / from_model->length_m)
                                 : stretched(from_model, to_model, old->knots[k]);
    out->space.length_m = to_model->length_m;
    fine_fill_gauss(&out->space);
    out->V = bf_alloc(from->space.n * from->n, sizeof *out->V);
    memcpy(out->V, from->V, from->space.n * from->n * sizeof *out->V);
    out->frequency_rad = bf_alloc(from->n_modes, sizeof *out->frequency_rad);
    memcpy(out->frequency_rad, from->frequency_rad, from->n_modes * sizeof *out->frequency_rad);
    enum bf_status status = project_blocks(out, to_model, err);
    if (status != BF_OK)
        reduced_free(out);
    return status;
}

void reduced_free(struct reduced *reduced)
{
    fine_free(&reduced->space);
    for (size_t b = 0; b < reduced->n_blocks; b++)
        free(reduced->blocks[b].B);
    free(reduced->blocks);
    free(reduced->V);
    free(reduced->frequency_rad);
    *reduced = (struct reduced){0};
}
