/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_geometry.c — a model whose patch and free end have moved. */
#include "model.h"

#include <math.h>
#include <string.h>

/* No region may become shorter than this part of itself. */
static const double shortest_part = 0.02;
static const double same_place = 1e-9; /* of the length */

static bool not_zero(double x)
{
    return x < 0.0 || x > 0.0;
}

static bool is_patch(const struct region *region)
{
    return strcmp(region->name, "patch") == 0;
}

/* The first region of the patch begins from_m later, its last one ends to_m later; what lies between them moves by shift_m. */
static void move_regions(const struct model *fixed, double shift_m, double from_m, double to_m, double length_m,
                         struct model *out)
{
    size_t first = 0, n = fixed->n_regions;
    memcpy(out->regions, fixed->regions, n * sizeof *out->regions);
    while (first < n && !is_patch(&fixed->regions[first]))
        first++;
    size_t end = first;
    while (end < n && is_patch(&fixed->regions[end]))
        end++;
    for (size_t r = first; r < end; r++) {
        out->regions[r].from_m += r == first ? from_m : shift_m;
        out->regions[r].to_m += r + 1 == end ? to_m : shift_m;
    }
    if (first > 0 && first < end)
        out->regions[first - 1].to_m += from_m;
    if (end > first && end < n)
        out->regions[end].from_m += to_m;
    out->regions[n - 1].to_m += length_m;
}

static bool on_patch(double from, double to, double patch_from, double patch_to, double length)
{
    return fabs(from - patch_from) < same_place * length && fabs(to - patch_to) < same_place * length;
}

static enum bf_status check_regions(const struct model *fixed, const struct model *out, double shift_m,
                                    struct bf_error *err)
{
    for (size_t r = 0; r < fixed->n_regions; r++)
        if (!(out->regions[r].to_m - out->regions[r].from_m >
              shortest_part * (fixed->regions[r].to_m - fixed->regions[r].from_m)) ||
            (r > 0 && not_zero(out->regions[r].from_m - out->regions[r - 1].to_m)))
            return bf_fail(err, BF_NUMERIC, "the patch, shifted by %.4g m, would leave no room for region '%s'",
                           shift_m, fixed->regions[r].name);
    return BF_OK;
}

/* A point channel: held at the end it stays there, else it must still be on the beam. */
static enum bf_status move_point(const struct model *fixed, const char *name, const struct channel_parameters *own,
                                 double fixed_m, double length_m, double *at_m, struct bf_error *err)
{
    if (!own->lists_at)
        *at_m = fabs(fixed_m - fixed->length_m) < same_place * fixed->length_m ? length_m : fixed_m;
    if (*at_m > length_m)
        return bf_fail(err, BF_NUMERIC, "%s at %.4g m would be off a beam of %.4g m", name, *at_m, length_m);
    return BF_OK;
}

enum bf_status model_move(const struct model *fixed, const double by_m[MODEL_MOVES], struct model *out,
                          struct bf_error *err)
{
    const double L = fixed->length_m, shift_m = by_m[MOVE_SHIFT];
    const double from_by = shift_m + by_m[MOVE_FROM], to_by = shift_m + by_m[MOVE_TO];
    double from = 0.0, to = 0.0;
    const bool patch = model_patch(fixed, &from, &to), moves = not_zero(from_by) || not_zero(to_by);
    if (moves && !patch)
        return bf_fail(err, BF_BAD_FILE, "an effect shifts the patch, but the model has none");
    out->length_m = L + by_m[MOVE_LENGTH];
    if (moves && (!(from + from_by > 0.0) || !(to + to_by < out->length_m)))
        return bf_fail(err, BF_NUMERIC, "the patch, shifted by %.4g m, would leave the beam", shift_m);
    move_regions(fixed, shift_m, from_by, to_by, by_m[MOVE_LENGTH], out);
    enum bf_status status = check_regions(fixed, out, shift_m, err);
    for (size_t i = 0; i < fixed->n_inputs && !status; i++) {
        const struct model_input *was = &fixed->inputs[i];
        const bool along = was->kind == INPUT_PATCH_MOMENT && on_patch(was->from_m, was->to_m, from, to, L);
        out->inputs[i].from_m = was->from_m + (along ? from_by : 0.0);
        out->inputs[i].to_m = was->to_m + (along ? to_by : 0.0);
        if (was->kind == INPUT_POINT_FORCE)
            status = move_point(fixed, was->name, &was->own, was->at_m, out->length_m, &out->inputs[i].at_m, err);
    }
    for (size_t o = 0; o < fixed->n_outputs && !status; o++) {
        const struct model_output *was = &fixed->outputs[o];
        const bool along = was->kind == OUTPUT_PATCH_STRAIN && on_patch(was->from_m, was->to_m, from, to, L);
        out->outputs[o].from_m = was->from_m + (along ? from_by : 0.0);
        out->outputs[o].to_m = was->to_m + (along ? to_by : 0.0);
        if (was->kind != OUTPUT_PATCH_STRAIN)
            status = move_point(fixed, was->name, &was->own, was->at_m, out->length_m, &out->outputs[o].at_m, err);
    }
    return status;
}
