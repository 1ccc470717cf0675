/* SPDX-License-Identifier: GPL-3.0-or-later */
/* measured_shapes.c — the poles of the records and their residues beside the modes and shapes of a model. */
#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "compare_predict.h"
#include "measured_poles.h"
#include "response/response.h"

enum { SHAPE_POINTS = 401, MORE_MODES = 4, MOST_MODES = 24 };
static const double one_place = 1e-3; /* of the length: places nearer than this are one */

/* A residue at its places, comparable with the others of its group. */
struct sample {
    const struct residue *residue;
    size_t group;        /* 0: records of known excitation; else a record of its own, + 1 */
    double from_m, to_m; /* of the input (NAN: none) and of the output */
    double gain;         /* of both */
};

/* ---- Places ---- */

/* False: a patch, which has no place. */
static bool sample_of(const struct comparison *all, const struct residue *residue, struct sample *out)
{
    const struct model *model = all->model;
    const struct record *record = &all->records[residue->record];
    const struct model_output *output = &model->outputs[residue->output];
    const bool driven = residue->input != SIZE_MAX;
    const struct model_input *input = driven ? &model->inputs[residue->input] : NULL;
    if (output->kind == OUTPUT_PATCH_STRAIN || (driven && input->kind == INPUT_PATCH_MOMENT))
        return false;
    *out = (struct sample){
        .residue = residue, .from_m = nan(""), .to_m = output->at_m, .gain = model_output_gain(model, residue->output)};
    (void)record_place(model, record, output->name, &out->to_m);
    out->group = driven && !excitation_level_unknown(model, record) ? 0 : residue->record + 1;
    if (driven) {
        out->from_m = input->at_m;
        (void)record_place(model, record, input->name, &out->from_m);
        out->gain *= model_input_gain(model, residue->input);
    }
    return true;
}

static bool same_place(const struct comparison *all, const struct sample *a, const struct sample *b)
{
    const double apart_m = one_place * all->model->length_m;
    return fabs(a->to_m - b->to_m) < apart_m && !(fabs(a->from_m - b->from_m) >= apart_m);
}

/* How many pairs of places a group has. */
static size_t places_of(const struct comparison *all, const struct sample samples[], size_t n, size_t group)
{
    size_t places = 0;
    for (size_t i = 0; i < n; i++) {
        bool first = samples[i].group == group;
        for (size_t j = 0; j < i && first; j++)
            first = samples[j].group != group || !same_place(all, &samples[i], &samples[j]);
        places += first;
    }
    return places;
}

/* ---- The modal assurance criterion ---- */

/* Of the deflection. */
static double complex measured_of(const struct comparison *all, const struct sample *sample, size_t pole,
                                  double complex p)
{
    const enum output_kind kind = all->model->outputs[sample->residue->output].kind;
    const double complex r = sample->residue->of_pole[pole] / sample->gain;
    return kind == OUTPUT_ACCELERATION ? r / (p * p) : kind == OUTPUT_VELOCITY ? r / p : r;
}

/* |Σ φᴴψ|²/(φᴴφ ψᴴψ) over the samples of the group. */
static double criterion(const struct comparison *all, const struct sample samples[], size_t n, size_t group,
                        const struct measured_poles *poles, size_t pole, const struct modes *modes, size_t mode)
{
    double complex both = 0.0;
    double ours = 0.0, theirs = 0.0;
    for (size_t i = 0; i < n; i++) {
        if (samples[i].group != group)
            continue;
        const double complex z = measured_of(all, &samples[i], pole, poles->pole[pole]);
        double y = pole_table_shape_at(modes, mode, samples[i].to_m);
        if (!isnan(samples[i].from_m))
            y *= pole_table_shape_at(modes, mode, samples[i].from_m);
        both += z * y, ours += y * y, theirs += creal(z * conj(z));
    }
    return ours * theirs > 0.0 ? creal(both * conj(both)) / (ours * theirs) : nan("");
}

static void compare_shapes(const struct comparison *all, const struct measured_poles *poles, const struct modes *modes,
                           struct pole_table *out)
{
    struct sample *samples = bf_alloc(poles->n_residues + 1, sizeof *samples);
    size_t n = 0, group = 0;
    for (size_t i = 0; i < poles->n_residues; i++)
        n += sample_of(all, &poles->residues[i], &samples[n]);
    for (size_t g = 0; g <= all->n_records; g++) {
        const size_t places = places_of(all, samples, n, g);
        if (places > out->places)
            out->places = places, group = g;
    }
    for (size_t i = 0; i < out->n && out->places >= 2; i++)
        if (out->pairs[i].mode > 0)
            out->pairs[i].mac = criterion(all, samples, n, group, poles, i, modes, out->pairs[i].mode - 1);
    free(samples);
}

/* ---- All ---- */

static enum bf_status beside_modes(const struct comparison *all, const struct measured_poles *poles,
                                   struct pole_table *out, struct bf_error *err)
{
    const struct frequency_list list = {.n = poles->n, .modes = poles->values};
    const size_t wanted = poles->n + MORE_MODES < MOST_MODES ? poles->n + MORE_MODES : MOST_MODES;
    struct modes modes;
    double model_Hz[MOST_MODES];
    const enum bf_status status = modes_compute(all->model, wanted, 0.0, SHAPE_POINTS, &modes, err);
    if (status != BF_OK)
        return status;
    for (size_t k = 0; k < modes.n; k++)
        model_Hz[k] = modes.mode[k].undamped_Hz;
    pole_table_make(&list, model_Hz, modes.n, out);
    pole_table_damping(out, &modes);
    compare_shapes(all, poles, &modes, out);
    modes_free(&modes);
    return status;
}

enum bf_status pole_table_of_records(const struct comparison *all, const struct stabilisation *stable,
                                     struct pole_table *out, struct bf_error *err)
{
    struct measured_poles poles;
    *out = (struct pole_table){0};
    enum bf_status status = measured_poles_find(all, stable, &poles, err);
    if (status == BF_OK && poles.n > 0)
        status = beside_modes(all, &poles, out, err);
    measured_poles_free(&poles);
    return status;
}
