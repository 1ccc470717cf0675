/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * target_image_model.c — the space a controller has: lowest modes and static responses, ten in all, projected from the fine
 * model at the fitted values, so that it is exact there.
 */
#include "deployment.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Space ---- */

size_t deploy_statics(const struct model *model)
{
    size_t n = 2;
    for (size_t e = 0; e < model->n_effects; e++)
        n += model->effects[e].effect->law != NULL || model->effects[e].effect->terms != NULL ? 1 : 0;
    return n < 4 ? n : 4;
}

/* As many modes as leave room for so many static responses; more where those depend on each other. */
static enum bf_status find_space(struct deployment *d, size_t statics, struct bf_error *err)
{
    const size_t own = own_index(&d->model, d->model.n_effects);
    if (own > 2)
        return bf_fail(err, BF_BAD_FILE, "%zu effects have a mode of their own: the ten shapes of a controller hold 2",
                       own);
    for (;; statics--) {
        const struct reduced_options options = {.top_rad = INFINITY,
                                                .min_modes = BEAM_N - statics - own,
                                                .max_modes = BEAM_N - statics - own,
                                                .statics = statics > 0 ? 1 : 0,
                                                .limit = BEAM_N};
        const enum bf_status status = reduced_new(&d->model, &options, &d->reduced, err);
        if (status != BF_OK || d->reduced.n == BEAM_N)
            return status;
        reduced_free(&d->reduced);
        if (statics == 0)
            return bf_fail(err, BF_NUMERIC, "no ten independent shapes describe this beam; check its regions");
    }
}

static enum bf_status evaluate(const struct model *model, const struct reduced *reduced,
                               const struct parameter_map *map, const double theta[], struct system **out,
                               struct bf_error *err)
{
    enum bf_status status = system_new(model, reduced, map, out, err);
    return status == BF_OK ? system_evaluate(*out, theta, NULL, err) : status;
}

/* ---- Matrices ---- */

static void copy_matrix(const double from[], double scale, double out[BEAM_N][BEAM_N])
{
    for (size_t i = 0; i < BEAM_N; i++)
        for (size_t j = 0; j < BEAM_N; j++)
            out[i][j] += scale * 0.5 * (from[i + j * BEAM_N] + from[j + i * BEAM_N]);
}

/* Blocks of one term share a branch. */
static enum bf_status copy_memories(const struct deployment *d, struct beam_model *out, struct bf_error *err)
{
    const struct block *last = NULL;
    for (size_t b = 0; b < d->reduced.n_blocks; b++) {
        const struct block *block = &d->reduced.blocks[b];
        double E, relaxation_s;
        const double *B;
        if (!system_memory(d->system, b, &E, &relaxation_s, &B))
            continue;
        if (last == NULL || last->effect != block->effect || last->term != block->term) {
            if (out->n_memories == BEAM_MEMORIES)
                return bf_fail(err, BF_BAD_FILE,
                               "the model's effects need more than the %d memories a controller carries; drop one",
                               BEAM_MEMORIES);
            out->memory[out->n_memories++].relaxation_s = relaxation_s;
        }
        last = block;
        copy_matrix(B, E, out->memory[out->n_memories - 1].form);
    }
    return BF_OK;
}

static void scale_vector(double scale, double v[BEAM_N])
{
    for (int i = 0; i < BEAM_N; i++)
        v[i] *= scale;
}

static void copy_channels(const struct deployment *d, struct beam_model *out)
{
    const struct model_input *input = &d->model.inputs[0];
    const struct model_output *output = &d->model.outputs[0];
    static const enum beam_output_kind kinds[] = {[OUTPUT_DISPLACEMENT] = BEAM_OUTPUT_DISPLACEMENT,
                                                  [OUTPUT_VELOCITY] = BEAM_OUTPUT_VELOCITY,
                                                  [OUTPUT_ACCELERATION] = BEAM_OUTPUT_ACCELERATION,
                                                  [OUTPUT_PATCH_STRAIN] = BEAM_OUTPUT_PATCH_STRAIN};
    out->n_inputs = out->n_outputs = 1;
    out->input[0].kind = input->kind == INPUT_PATCH_MOMENT ? BEAM_INPUT_PATCH_MOMENT : BEAM_INPUT_POINT_FORCE;
    reduced_input(&d->reduced, input, out->input[0].vector);
    if (model_input_gain(&d->model, 0) != 1.0)
        scale_vector(model_input_gain(&d->model, 0), out->input[0].vector);
    out->output[0].kind = kinds[output->kind];
    reduced_output(&d->reduced, output, out->output[0].vector);
    if (model_output_gain(&d->model, 0) != 1.0)
        scale_vector(model_output_gain(&d->model, 0), out->output[0].vector);
}

static void forget_space(struct deployment *d)
{
    system_free(d->system);
    parameter_map_free(&d->map);
    free(d->theta);
    free(d->refs);
    reduced_free(&d->reduced);
    d->system = NULL;
    d->theta = NULL;
    d->refs = NULL;
    d->out = (struct beam_model){.n_inputs = 0};
    d->n_beside = 0;
}

enum bf_status deploy_space(struct deployment *d, size_t statics, struct target_image *image, struct bf_error *err)
{
    forget_space(d);
    enum bf_status status = find_space(d, statics, err);
    if (status != BF_OK)
        return status;
    struct parameter_ref *refs = NULL;
    struct system *system = NULL;
    const size_t n = model_parameters(&d->model, NULL, 0, &refs);
    double *theta = bf_alloc(n, sizeof *theta);
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].value;
    d->refs = refs;
    d->theta = theta;
    d->map = parameter_map_new(&d->model, refs, n, 0);
    status = evaluate(&d->model, &d->reduced, &d->map, theta, &system, err);
    d->system = system;
    if (status != BF_OK || system == NULL)
        return status;
    static const char *const units[] = {[OUTPUT_DISPLACEMENT] = "m",
                                        [OUTPUT_VELOCITY] = "m/s",
                                        [OUTPUT_ACCELERATION] = "m/s^2",
                                        [OUTPUT_PATCH_STRAIN] = "V"};
    image->sensor_unit = units[d->model.outputs[0].kind];
    image->drive_unit = d->model.inputs[0].kind == INPUT_PATCH_MOMENT ? "V" : "N";
    image->n_modes = d->reduced.n_modes;
    image->n_statics = d->reduced.n - d->reduced.n_modes; /* coordinates beside the beam among them */
    copy_matrix(system->M, 1.0, d->out.M);
    copy_matrix(system->C, 1.0, d->out.C);
    copy_matrix(system->K, 1.0, d->out.K);
    copy_channels(d, &d->out);
    return copy_memories(d, &d->out, err);
}

void deployment_free(struct deployment *d)
{
    forget_space(d);
    free(d->origin);
    model_free(&d->model);
}
