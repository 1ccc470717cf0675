/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_starts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"

/* ---- The list ---- */

struct starts starts_new(size_t room, size_t n_refs, const struct parameter_ref refs[], size_t first_effect)
{
    struct starts s = {.room = room,
                       .n_refs = n_refs,
                       .compared = bf_alloc(n_refs, sizeof(bool)),
                       .half_square = bf_alloc(room, sizeof(double)),
                       .theta = bf_alloc(room * n_refs, sizeof(double))};
    for (size_t i = 0; i < n_refs; i++)
        s.compared[i] = refs[i].role == ROLE_EFFECT && refs[i].owner >= first_effect && refs[i].record < 0;
    return s;
}

void starts_free(struct starts *starts)
{
    free(starts->compared), free(starts->half_square), free(starts->theta);
    *starts = (struct starts){0};
}

static bool same_start(const struct starts *s, size_t k, const double theta[], double half_square)
{
    static const double same = 0.05;
    const double *other = s->theta + k * s->n_refs;
    if (fabs(half_square - s->half_square[k]) > same * fmax(half_square, s->half_square[k]))
        return false;
    for (size_t i = 0; i < s->n_refs; i++)
        if (s->compared[i] && fabs(theta[i] - other[i]) > same * fmax(fabs(theta[i]), fabs(other[i])))
            return false;
    return true;
}

static void move_start(struct starts *s, size_t from, size_t to)
{
    s->half_square[to] = s->half_square[from];
    memcpy(s->theta + to * s->n_refs, s->theta + from * s->n_refs, s->n_refs * sizeof *s->theta);
}

void starts_add(struct starts *s, const double theta[], double half_square)
{
    if (!isfinite(half_square))
        return;
    for (size_t k = 0; k < s->n; k++) {
        if (!same_start(s, k, theta, half_square))
            continue;
        if (s->half_square[k] <= half_square)
            return;
        for (size_t i = k; i + 1 < s->n; i++)
            move_start(s, i + 1, i);
        s->n--;
        break;
    }
    size_t at = 0;
    while (at < s->n && s->half_square[at] <= half_square)
        at++;
    if (at >= s->room)
        return;
    s->n += s->n < s->room;
    for (size_t i = s->n - 1; i > at; i--)
        move_start(s, i - 1, i);
    s->half_square[at] = half_square;
    memcpy(s->theta + at * s->n_refs, theta, s->n_refs * sizeof *theta);
}

void starts_prune(struct starts *s, double factor)
{
    while (s->n > 1 && s->half_square[s->n - 1] > factor * s->half_square[0])
        s->n--;
}

void starts_to_x(struct fit_problem *p, const double theta[], double x[])
{
    fit_problem_to_x(p, theta, x);
    fit_problem_rescale(p, x);
}

static const double floor_share = 0.02; /* of the signal */
static const double vanished = 0.1;     /* in floors */

/* Root mean square that a row changes by with ln θ. */
static double size_of(const struct fit_problem *p, size_t i)
{
    return dense_norm(p->n_jacobian, p->jacobian + i * p->n_jacobian) / sqrt((double)p->n_rows);
}

static bool can_vanish(const struct fit_problem *p, size_t i)
{
    return p->unknowns[i].logarithmic && p->refs[p->unknowns[i].ref].role != ROLE_EFFECT;
}

bool starts_none_vanished(const struct fit_problem *p, const double x[])
{
    if (p->shares != NULL || p->held_at != HOLDS_JACOBIAN || !fit_problem_holds(p, x))
        return false;
    const double part = fit_problem_floor_part(p, floor_share);
    bool none = true;
    for (size_t i = 0; i < p->n_unknowns && none; i++)
        none = !can_vanish(p, i) || part * size_of(p, i) > vanished;
    return none;
}

enum bf_status starts_restore_vanished(struct fit_problem *p, double theta[], struct bf_error *err)
{
    static const double restored = 0.5, most = 1e6; /* restored: in floors */
    double square, *x = bf_alloc(p->n_unknowns + 1, sizeof *x);
    starts_to_x(p, theta, x);
    enum bf_status status = fit_problem_stage(p, 0.0, floor_share, x, err);
    if (!status)
        status = fit_problem_evaluate(p, x, true, &square, err);
    for (size_t i = 0; i < p->n_unknowns && !status; i++) {
        const size_t r = p->unknowns[i].ref;
        if (!can_vanish(p, i) || size_of(p, i) > vanished)
            continue;
        const double factor = fmin(restored / size_of(p, i), most);
        theta[r] *= p->refs[r].role == ROLE_EI ? 1.0 / factor : factor;
    }
    free(x);
    return status;
}

/* ---- Grids ---- */

const struct beam_parameter_info *effect_parameter(const struct fit_problem *p, size_t unknown)
{
    const struct parameter_ref *ref = &p->refs[p->unknowns[unknown].ref];
    if (ref->role != ROLE_EFFECT)
        return NULL;
    return &p->model->effects[ref->owner].effect->parameters[ref->slot];
}

bool is_position(const struct beam_parameter_info *info)
{
    return info && info->role == BEAM_ROLE_PLACE;
}

bool is_strength(const struct beam_parameter_info *info)
{
    return info && !(info->flags & (BEAM_PARAMETER_INNER | BEAM_PARAMETER_PER_RECORD));
}

/* start · 10^(k/per_decade) for k = least … most, and the negatives where allowed. */
static size_t sizes(double start, int least, int most, int per_decade, bool both_signs, double out[])
{
    size_t n = 0;
    for (int k = least; k <= most; k++) {
        const double size = start * pow(10.0, (double)k / per_decade);
        out[n++] = size;
        if (both_signs)
            out[n++] = -size;
    }
    return n;
}

/* Values of unknown i that are worth a start; none when it should stay where it is. */
static size_t values_of(const struct fit_problem *p, size_t i, int density, bool strengths, double out[GRID_VALUES])
{
    const struct unknown *u = &p->unknowns[i];
    const struct parameter_ref *ref = &p->refs[u->ref];
    const struct beam_parameter_info *info = effect_parameter(p, i);
    const bool both = ref->info->min < 0.0;
    double start = isfinite(info->start) && info->start != 0.0 ? fabs(info->start) : u->least_scale;
    if (is_strength(info) && ref->value != 0.0 && isfinite(ref->value))
        start = fabs(ref->value);
    if (p->held[i] || (is_strength(info) && !strengths))
        return 0;
    if (is_position(info)) {
        const int places = density > 1 ? 12 : 6;
        for (int k = 1; k <= places; k++)
            out[k - 1] = fmin(p->model->length_m * k / places, model_last_place_m(p->model));
        return (size_t)places;
    }
    if (info->role == BEAM_ROLE_PHASE) {
        for (int k = 0; k < 4; k++)
            out[k] = ref->value + 0.5 * M_PI * k;
        return 4;
    }
    if (density == 1)
        return sizes(start, -1, 1, 1, both, out);
    return is_strength(info) ? sizes(start, -4, 6, 2, both, out) : sizes(start, -3, 3, 2, false, out);
}

struct start_grid start_grid_new(const struct fit_problem *p, size_t first_effect, size_t end_effect, int density,
                                 bool strengths)
{
    const size_t n = p->n_unknowns;
    struct start_grid grid = {.n_unknowns = n,
                              .n = 1,
                              .count = bf_alloc(n, sizeof *grid.count),
                              .same = bf_alloc(n, sizeof *grid.same),
                              .theta = bf_alloc(n, sizeof *grid.theta)};
    for (size_t i = 0; i < n; i++) {
        const struct parameter_ref *ref = &p->refs[p->unknowns[i].ref];
        grid.same[i] = i;
        if (ref->role != ROLE_EFFECT || ref->owner < first_effect || ref->owner >= end_effect)
            continue;
        for (size_t j = 0; j < i && grid.same[i] == i; j++) {
            const struct parameter_ref *other = &p->refs[p->unknowns[j].ref];
            if (other->role == ROLE_EFFECT && other->owner == ref->owner && other->slot == ref->slot)
                grid.same[i] = j;
        }
        if (grid.same[i] != i)
            continue;
        double all[GRID_VALUES];
        const size_t m = values_of(p, i, density, strengths, all);
        for (size_t k = 0; k < m; k++)
            if (all[k] >= ref->info->min && all[k] <= ref->info->max)
                grid.theta[i][grid.count[i]++] = all[k];
        grid.n *= grid.count[i] ? grid.count[i] : 1;
    }
    return grid;
}

void start_grid_at(const struct start_grid *grid, const struct fit_problem *p, size_t k, double theta[])
{
    for (size_t i = 0; i < grid->n_unknowns; i++) {
        if (grid->same[i] != i) {
            if (grid->count[grid->same[i]] > 0)
                theta[p->unknowns[i].ref] = theta[p->unknowns[grid->same[i]].ref];
            continue;
        }
        if (grid->count[i] == 0)
            continue;
        theta[p->unknowns[i].ref] = grid->theta[i][k % grid->count[i]];
        k /= grid->count[i];
    }
}

void start_grid_free(struct start_grid *grid)
{
    free(grid->count), free(grid->same), free(grid->theta);
    *grid = (struct start_grid){0};
}
