/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the fits to the modes (diagnose_by_modes.c) say of an effect. Asked by many files, and calls none of them. */
#include "diagnose_modal.h"

#include <math.h>
#include <stdlib.h>

const struct modal_limits modal_limits = {.promises = 0.7, .nothing = 0.5, .same = 0.02};

bool modal_is_near(const struct modal_road *road, const struct modal_start *start)
{
    return start->left <= search_limits.far * road->starts[0].left &&
           start->left <= modal_limits.promises * road->alone.left;
}

void modal_start_free(struct modal_start *start)
{
    model_free(&start->model);
}

void modal_road_free(struct modal_road *road)
{
    for (size_t k = 0; k < road->n; k++)
        modal_start_free(&road->starts[k]);
    free(road->starts);
    modal_start_free(&road->alone);
    measured_modes_free(&road->modes);
}

void diagnose_modes_free(struct diagnose_state *w)
{
    if (w->modal != NULL)
        modal_road_free(w->modal);
    free(w->modal);
    w->modal = NULL;
}

/* ---- What they say ---- */

static bool was_refitted(const struct modal_road *road, const struct beam_effect *effect)
{
    for (size_t k = 0; k < road->n; k++)
        if (road->starts[k].effect == effect && road->starts[k].refitted)
            return true;
    return false;
}

/* Of the misfit as it is now: a baseline that has found a lower minimum since leaves less to take. */
static bool has_told(const struct diagnose_state *w, double part)
{
    const struct diagnosis *d = w->d;
    bool told = false;
    if (w->modal == NULL || w->modal->of != d->model)
        return false;
    for (size_t i = 0; i < d->n_hypotheses; i++)
        told = told || (d->hypotheses[i].n_effects == 1 && d->hypotheses[i].explained >= part &&
                        was_refitted(w->modal, d->hypotheses[i].effects[0]));
    return told;
}

bool diagnose_modes_have_told(const struct diagnose_state *w)
{
    return has_told(w, search_limits.half);
}

bool diagnose_modes_have_told_all(const struct diagnose_state *w)
{
    return has_told(w, search_limits.nearly_all);
}

/* Of the modes, by the model without any effect or with one that was refitted to the records. */
static double least_left(const struct modal_road *road)
{
    double least = road->alone.left;
    for (size_t k = 0; k < road->n; k++)
        if (road->starts[k].refitted)
            least = fmin(least, road->starts[k].left);
    return least;
}

bool diagnose_modes_clear_beam(const struct diagnose_state *w)
{
    const struct hypothesis_errors *e = &w->d->baseline.fitted;
    if (w->modal == NULL || w->modal->of != w->d->model || w->options->everything || diagnose_modes_have_told(w))
        return false;
    const double floor = diagnose_floor(w->d);
    return least_left(w->modal) <= 1.0 && e->nrmse >= search_limits.fifth &&
           floor * floor <= search_limits.half * e->noise_ratio * e->noise_ratio;
}

bool diagnose_modes_rule_out(const struct diagnose_state *w, const struct beam_effect *effect)
{
    const bool told = diagnose_modes_have_told(w);
    bool tried = false, near = false;
    for (size_t k = 0; w->modal != NULL && k < w->modal->n; k++) {
        const struct modal_start *start = &w->modal->starts[k];
        tried = tried || start->effect == effect;
        near = near || (start->effect == effect && modal_is_near(w->modal, start));
    }
    return tried && ((told && !near) || diagnose_modes_clear_beam(w));
}

bool diagnose_modes_have_refitted(const struct diagnose_state *w, const struct beam_effect *effect)
{
    return diagnose_modes_have_told(w) && was_refitted(w->modal, effect);
}
