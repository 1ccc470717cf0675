/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The road by way of the modes: a free linear model has told poles and residues of the records, and each of the beam's own effects is fitted to those first, from the
 * model as given (refit_to_modes()). That takes milliseconds, has no wrong cycle to lock in, and leaves much where an effect cannot make the modes what they are. What
 * comes nearest is refitted to the records from there.
 */
#include "diagnose_relatives.h"
#include "diagnose_road.h"
#include "diagnose_shortlist.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

/* All that is set by hand. */
static const struct by_modes_limits {
    double in_band;  /* of the Nyquist frequency: above it a pole stands for what lies beyond */
    double counts;   /* times the floor: without a pole that counts the free linear model leaves more */
    double promises; /* of what the model without any effect leaves of the modes */
    double near;     /* times what the nearest leaves: what is refitted */
    double same;     /* of that: two starts of one effect that have come to the same end */
} limits = {.in_band = 0.8, .counts = 1.1, .promises = 0.7, .near = 3.0, .same = 0.02};
/* Places along the span; refits at most, and their evaluations: from a start that has the modes it is done in 20 to 60. */
enum { PLACES = 8, MOST_REFITS = 4, QUICK_RUNS = 100 };

/* An effect fitted to the modes from one start. */
struct modal_start {
    const struct candidate *candidate;
    struct model model;
    double left; /* rms, in what a good model may be off by */
};

struct modal_road {
    struct diagnose_state *w;
    struct model given;
    struct measured_modes modes;
    double left; /* by the model without any effect */
    size_t n;
    struct modal_start *starts;
};

/* ---- The modes ---- */

static bool counts(const struct diagnosis *d, const struct attainable_pole *pole)
{
    return pole->frequency_Hz < limits.in_band * diagnose_band_Hz(d) &&
           diagnose_is_mode(d, pole->frequency_Hz, pole->damping_ratio) &&
           !(pole->without_noise_ratio < limits.counts * d->attainable.noise_ratio);
}

static struct measured_modes modes_of(const struct diagnosis *d)
{
    const struct attainable *a = &d->attainable;
    const size_t n_paths = a->n_outputs * a->n_inputs;
    struct measured_modes modes = {.pole = bf_alloc(a->modes + 1, sizeof *modes.pole),
                                   .residue = bf_alloc(a->modes * n_paths + 1, sizeof *modes.residue)};
    for (size_t k = 0; k < a->modes; k++) {
        const struct attainable_pole *pole = &a->poles[k];
        if (!counts(d, pole))
            continue;
        const double size = 2.0 * M_PI * pole->frequency_Hz, damping = pole->damping_ratio;
        memcpy(modes.residue + modes.n * n_paths, a->residue + k * n_paths, n_paths * sizeof *modes.residue);
        modes.pole[modes.n++] = CMPLX(-damping * size, sqrt(1.0 - damping * damping) * size);
    }
    return modes;
}

/* ---- Fits to them ---- */

static void fit_to_modes(struct modal_road *road, const struct candidate *candidate, const double start[])
{
    struct modal_start one = {.candidate = candidate};
    struct bf_error ignored;
    if (candidate_model(&road->given, candidate, start, &one.model, &ignored) != BF_OK)
        return;
    if (refit_to_modes(&one.model, &road->modes, road->w->predict, &one.left, &ignored) != BF_OK ||
        !isfinite(one.left)) {
        model_free(&one.model);
        return;
    }
    road->starts = bf_grow(road->starts, road->n + 1, sizeof *road->starts);
    road->starts[road->n++] = one;
}

/* At places along the span, if it has one. */
static void fit_along(struct modal_road *road, const struct candidate *candidate, const double start[])
{
    const int place = effect_slot(candidate->effect, BEAM_ROLE_PLACE);
    double p[BEAM_EFFECT_PARAMETERS];
    memcpy(p, start, sizeof p);
    if (place < 0) {
        fit_to_modes(road, candidate, p);
        return;
    }
    for (int k = 1; k <= PLACES; k++) {
        p[place] = fmin(road->given.length_m * k / PLACES, candidate->upper[place]);
        fit_to_modes(road, candidate, p);
    }
}

static int by_left(const void *a, const void *b)
{
    const double x = ((const struct modal_start *)a)->left, y = ((const struct modal_start *)b)->left;
    return (x > y) - (x < y);
}

static void fit_all(struct modal_road *road, const struct candidate_list *list)
{
    for (size_t i = 0; i < list->n && !progress_interrupted(); i++) {
        const struct candidate *candidate = &list->candidates[i];
        struct road roads[ROADS];
        if (!road_is_structural(candidate->effect) || effect_kind(candidate->effect) != KIND_LINEAR)
            continue;
        const size_t n = roads_lay(list->candidates, &road->given, &i, 1, true, roads);
        for (size_t k = 0; k < n; k++)
            fit_along(road, candidate, roads[k].start);
    }
    if (road->n > 0)
        qsort(road->starts, road->n, sizeof *road->starts, by_left);
}

/* ---- Refits from there ---- */

/* The same effect at the same misfit has been taken. */
static bool is_taken(const struct modal_road *road, size_t k)
{
    for (size_t i = 0; i < k; i++)
        if (road->starts[i].candidate->effect == road->starts[k].candidate->effect &&
            road->starts[k].left - road->starts[i].left <= limits.same * road->left)
            return true;
    return false;
}

static enum bf_status refit_nearest(struct modal_road *road, struct bf_error *err)
{
    struct refit_job jobs[MOST_REFITS];
    size_t n = 0;
    enum bf_status status = BF_OK;
    for (size_t k = 0; k < road->n && n < MOST_REFITS && !status; k++) {
        const struct modal_start *start = &road->starts[k];
        if (start->left > limits.near * road->starts[0].left || start->left > limits.promises * road->left)
            break;
        if (is_taken(road, k))
            continue;
        jobs[n] = (struct refit_job){.n_effects = 1, .n_tried = road->w->n_tried, .most_runs = QUICK_RUNS};
        status = model_copy(&start->model, &jobs[n].model, err);
        jobs[n].first_new = jobs[n].model.n_effects;
        n += !status;
    }
    return diagnose_try(road->w, jobs, n, status, 0.0);
}

static void road_free(struct modal_road *road)
{
    for (size_t k = 0; k < road->n; k++)
        model_free(&road->starts[k].model);
    free(road->starts);
    free(road->modes.pole), free(road->modes.residue);
    model_free(&road->given);
}

/* What the model without any effect leaves of them. */
static enum bf_status fit_none(struct modal_road *road, struct bf_error *err)
{
    struct model none;
    enum bf_status status = model_copy(&road->given, &none, err);
    if (status)
        return status;
    status = refit_to_modes(&none, &road->modes, road->w->predict, &road->left, err);
    model_free(&none);
    return status;
}

enum bf_status diagnose_by_modes(struct diagnose_state *w, const struct candidate_list *list, struct bf_error *err)
{
    struct modal_road road = {.w = w};
    struct bf_error ignored;
    enum bf_status status = diagnose_as_given(w->d->model, &road.given, err);
    if (status)
        return status;
    road.modes = modes_of(w->d);
    if (road.modes.n > 1 && fit_none(&road, &ignored) == BF_OK) {
        fit_all(&road, list);
        status = refit_nearest(&road, err);
    }
    road_free(&road);
    w->by_modes = !status && diagnose_explained(w->d, 1);
    return status;
}
