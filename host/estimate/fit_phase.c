/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sinusoidal effects: amplitude, phases and frequency from the residual instead of by descent. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "maths/maths.h"
#include "fit_phase.h"

enum { PEAKS = 6 }; /* lines of the residual that are tried */

/* The unknowns of one sinusoidal effect; none where it is held. */
struct sinusoid {
    size_t amplitude, frequency;
    size_t *phase; /* [n_records] */
};
static const size_t none = (size_t)-1;

/* False when effect e is none, or its amplitude or a phase is held. Free out->phase in any case. */
static bool find_sinusoid(const struct fit_problem *p, size_t e, struct sinusoid *out)
{
    *out = (struct sinusoid){none, none, bf_alloc(p->n_records, sizeof *out->phase)};
    const struct beam_effect *effect = p->model->effects[e].effect;
    size_t phases = 0;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct parameter_ref *ref = &p->refs[p->unknowns[i].ref];
        if (ref->role != ROLE_EFFECT || ref->owner != e)
            continue;
        const struct beam_parameter_info *info = &effect->parameters[ref->slot];
        if (info->role == BEAM_ROLE_PHASE && ref->record >= 0) {
            out->phase[ref->record] = i;
            phases++;
        } else if (info->role == BEAM_ROLE_FREQUENCY) {
            out->frequency = i;
        } else if (info->role == BEAM_ROLE_STRENGTH) {
            out->amplitude = i;
        }
    }
    return phases == p->n_records && out->amplitude != none;
}

static void set_held(struct fit_problem *p, const struct sinusoid *s, bool held)
{
    fit_problem_hold(p, s->amplitude, held);
    if (s->frequency != none)
        fit_problem_hold(p, s->frequency, held);
    for (size_t r = 0; r < p->n_records; r++)
        fit_problem_hold(p, s->phase[r], held);
}

bool phases_any(const struct fit_problem *p, size_t first_effect)
{
    bool any = false;
    for (size_t e = first_effect; e < p->model->n_effects && !any; e++) {
        struct sinusoid s;
        any = find_sinusoid(p, e, &s);
        free(s.phase);
    }
    return any;
}

void phases_hold(struct fit_problem *p, double x[])
{
    for (size_t e = 0; e < p->model->n_effects; e++) {
        struct sinusoid s;
        if (find_sinusoid(p, e, &s)) {
            set_held(p, &s, true);
            x[s.amplitude] = 0.0;
        }
        free(s.phase);
    }
}

/* Rows that a unit amplitude at this phase adds to the weighted residual; base is the residual without it. */
static enum bf_status unit_rows(struct fit_problem *p, const struct sinusoid *s, double x[], double phase,
                                const double base[], double rows[], struct bf_error *err)
{
    double square;
    x[s->amplitude] = 1.0;
    for (size_t r = 0; r < p->n_records; r++)
        x[s->phase[r]] = phase / p->unknowns[s->phase[r]].scale;
    const enum bf_status status = fit_problem_evaluate(p, x, false, &square, err);
    for (size_t k = 0; k < p->n_rows && !status; k++)
        rows[k] = p->residual[k] - base[k];
    x[s->amplitude] = 0.0;
    return status;
}

/* min ‖r + a c + b d‖ over the rows of one record; returns the fall of the sum of squares. */
static double fit_pair(const struct fit_problem *p, size_t record, const double r[], const double c[], const double d[],
                       double ab[2])
{
    double cc = 0.0, cd = 0.0, dd = 0.0, cr = 0.0, dr = 0.0;
    for (size_t i = 0; i < p->n_channels; i++) {
        if (p->channels[i].record != record)
            continue;
        const size_t row = p->channels[i].row, n = p->channels[i].n;
        cc += dense_dot(n, c + row, c + row), cd += dense_dot(n, c + row, d + row);
        dd += dense_dot(n, d + row, d + row);
        cr += dense_dot(n, c + row, r + row), dr += dense_dot(n, d + row, r + row);
    }
    const double det = cc * dd - cd * cd;
    ab[0] = ab[1] = 0.0;
    if (!(det > 1e-9 * cc * dd))
        return 0.0;
    ab[0] = -(dd * cr - cd * dr) / det, ab[1] = -(cc * dr - cd * cr) / det;
    return -(ab[0] * cr + ab[1] * dr);
}

/* Best pairs at one frequency: ab[2 n_records]; *fall of the sum of squares over all records. */
static enum bf_status fit_pairs(struct fit_problem *p, const struct sinusoid *s, double x[], const double base[],
                                double ab[], double *fall, struct bf_error *err)
{
    double *c = bf_alloc(p->n_rows, sizeof *c), *d = bf_alloc(p->n_rows, sizeof *d);
    enum bf_status status = unit_rows(p, s, x, 0.0, base, c, err);
    if (!status)
        status = unit_rows(p, s, x, 0.5 * M_PI, base, d, err);
    *fall = 0.0;
    for (size_t r = 0; r < p->n_records && !status; r++)
        *fall += fit_pair(p, r, base, c, d, ab + 2 * r);
    free(c), free(d);
    return status;
}

/* A sin(ωt + φ) = A cos φ sin ωt + A sin φ cos ωt; one amplitude for all records that show the effect. */
static void take_pairs(const struct fit_problem *p, const struct sinusoid *s, const double ab[], double x[])
{
    double square = 0.0, records = 0.0;
    for (size_t r = 0; r < p->n_records; r++) {
        const double size = ab[2 * r] * ab[2 * r] + ab[2 * r + 1] * ab[2 * r + 1];
        square += size;
        records += size > 0.0;
        x[s->phase[r]] = atan2(ab[2 * r + 1], ab[2 * r]) / p->unknowns[s->phase[r]].scale;
    }
    x[s->amplitude] = records > 0.0 ? sqrt(square / records) : 0.0;
}

/* ---- Which frequencies ---- */

/* The frequencies within low … high at which lines stand out of the residual of all channels. */
static enum bf_status find_lines(const struct fit_problem *p, const double residual[], double low_Hz, double high_Hz,
                                 double lines_Hz[PEAKS], size_t *n, struct bf_error *err)
{
    struct residual_channel *channels = bf_alloc(p->n_channels + 1, sizeof *channels);
    for (size_t c = 0; c < p->n_channels; c++)
        channels[c] = (struct residual_channel){
            .r = residual + p->channels[c].row, .n = p->channels[c].n, .dt_s = p->channels[c].dt_s, .scale = 1.0};
    const enum bf_status status = residual_lines(channels, p->n_channels, low_Hz, high_Hz, PEAKS, lines_Hz, n, err);
    free(channels);
    return status;
}

static void set_frequency(const struct fit_problem *p, size_t unknown, double f_Hz, double x[])
{
    const struct unknown *u = &p->unknowns[unknown];
    x[unknown] = u->logarithmic ? log(f_Hz) : f_Hz / u->scale;
}

static enum bf_status find_one(struct fit_problem *p, const struct sinusoid *s, double x[], struct bf_error *err)
{
    double square, best_fall = -1.0, tried_Hz[PEAKS + 1] = {0.0}, best_Hz = 0.0;
    double *base = bf_alloc(p->n_rows, sizeof *base), *ab = bf_alloc(2 * p->n_records, sizeof *ab);
    double *best = bf_alloc(2 * p->n_records, sizeof *best);
    size_t n = 0;
    x[s->amplitude] = 0.0;
    enum bf_status status = fit_problem_evaluate(p, x, false, &square, err);
    if (!status)
        memcpy(base, p->residual, p->n_rows * sizeof *base);
    if (!status && s->frequency != none) {
        const struct unknown *u = &p->unknowns[s->frequency];
        const struct parameter *info = p->refs[u->ref].info;
        status = find_lines(p, base, info->min, info->max, tried_Hz, &n, err);
        tried_Hz[n] = u->logarithmic ? exp(x[s->frequency]) : x[s->frequency] * u->scale;
    }
    for (size_t k = 0; k <= n && !status; k++) {
        if (s->frequency != none)
            set_frequency(p, s->frequency, tried_Hz[k], x);
        double fall;
        status = fit_pairs(p, s, x, base, ab, &fall, err);
        if (!status && fall > best_fall) {
            best_fall = fall, best_Hz = tried_Hz[k];
            memcpy(best, ab, 2 * p->n_records * sizeof *best);
        }
    }
    if (!status) {
        take_pairs(p, s, best, x);
        if (s->frequency != none)
            set_frequency(p, s->frequency, best_Hz, x);
    }
    free(base), free(ab), free(best);
    return status;
}

enum bf_status phases_find(struct fit_problem *p, double x[], struct bf_error *err)
{
    enum bf_status status = BF_OK;
    bool staged = false;
    for (size_t e = 0; e < p->model->n_effects && !status; e++) {
        struct sinusoid s;
        if (find_sinusoid(p, e, &s)) {
            if (!staged)
                status = fit_problem_stage(p, 0.0, 0.0, x, err);
            staged = true;
            set_held(p, &s, false);
            if (!status)
                status = find_one(p, &s, x, err);
        }
        free(s.phase);
    }
    return status;
}

void phases_wrap(const struct fit_problem *p, double x[])
{
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct unknown *u = &p->unknowns[i];
        const struct parameter_ref *ref = &p->refs[u->ref];
        if (ref->role == ROLE_EFFECT && ref->record >= 0 && !u->logarithmic &&
            p->model->effects[ref->owner].effect->parameters[ref->slot].role == BEAM_ROLE_PHASE)
            x[i] = remainder(x[i] * u->scale, 2.0 * M_PI) / u->scale;
    }
}
