/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "law_run.h"

#include <math.h>
#include <stdlib.h>

#include "maths/maths.h"

/* A pole with |p| h above this follows the force without dynamics of its own: the same frequency for both oversamplings. */
static const double far_smooth = 4.0, far_kinked = 2.0;
/* Steps a sample: forces that are smooth in time are followed by cubics, kinks by shorter straight lines. */
enum { OVERSAMPLE_SMOOTH = 4, OVERSAMPLE_KINKED = 8 };

int predict_steps(const struct model *model, const struct predict_options *options)
{
    if (options->oversample > 0)
        return options->oversample;
    return model->steps_per_sample > 0 ? model->steps_per_sample : OVERSAMPLE_KINKED;
}

static bool all_smooth(const struct law_run *l)
{
    for (size_t e = 0; e < l->n_laws; e++)
        if (!l->laws[e].law->smooth)
            return false;
    return true;
}

/* A force that jumps where the velocity changes its sign. Drag beside a contact is none: the contact alone has the kinks then. */
static bool has_dry_friction(const struct law_run *l)
{
    for (size_t e = 0; e < l->n_laws; e++)
        if (l->laws[e].law->resists && !l->laws[e].law->smooth)
            return true;
    return false;
}

/*
 * Poles that move on the grid are stepped; the others add Re(αα'/p) to the compliance (their static response). The velocity that a force makes at once is that of the
 * fastest modes: friction without them is off by tens of per cent. Of an overdamped mode the slow pole alone has it the wrong way round, so real ones are always stepped.
 */
static void split_poles(struct law_run *l)
{
    const struct system *s = l->system->system;
    const bool all = has_dry_friction(l);
    const double far_step = l->held == HOLD_CUBIC ? far_smooth : far_kinked;
    l->pole = bf_alloc(s->n_poles, sizeof *l->pole);
    l->hold = bf_alloc(s->n_poles, sizeof *l->hold);
    l->multiplicity = bf_alloc(s->n_poles, sizeof *l->multiplicity);
    for (size_t k = 0; k < s->n_poles; k++) {
        double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
        if (all || k >= s->n_pairs || cabs(s->p[k]) * l->h_s <= far_step) {
            l->pole[l->n_dynamic] = k;
            l->multiplicity[l->n_dynamic] = multiplicity;
            l->hold[l->n_dynamic++] = law_hold(s->p[k], l->h_s, l->held);
            continue;
        }
        for (size_t a = 0; a < l->D; a++)
            for (size_t b = 0; b < l->D; b++)
                l->far[a * l->D + b] += multiplicity * creal(l->system->coordinates[a].alpha[k] *
                                                             l->system->coordinates[b].alpha[k] / s->p[k]);
    }
}

static struct law_row take_row(double **next, size_t n)
{
    struct law_row row = {.re = *next, .im = *next + n};
    *next += 2 * n;
    return row;
}

static void set(const struct law_row *row, size_t i, double complex x)
{
    row->re[i] = creal(x);
    row->im[i] = cimag(x);
}

static void fill_rows(struct law_run *l)
{
    const struct system *s = l->system->system;
    size_t D = l->D, P = l->P = vector_round(l->n_dynamic);
    l->rows = bf_alloc(2 * P * (2 + HOLD_CUBIC + (l->uses_a ? 4u : 3u) * D), sizeof *l->rows);
    double *next = l->rows;
    l->p = take_row(&next, P);
    l->e = take_row(&next, P);
    for (size_t i = 0; i < HOLD_CUBIC; i++)
        l->g[i] = take_row(&next, P);
    l->alpha = take_row(&next, D * P);
    l->to_w = take_row(&next, D * P);
    l->to_v = take_row(&next, D * P);
    if (l->uses_a)
        l->to_a = take_row(&next, D * P);
    for (size_t k = 0; k < l->n_dynamic; k++) {
        double complex p = s->p[l->pole[k]];
        set(&l->p, k, p);
        set(&l->e, k, l->hold[k].e);
        for (size_t i = 0; i < HOLD_CUBIC; i++)
            set(&l->g[i], k, l->hold[k].g[i]);
        for (size_t c = 0; c < D; c++) {
            double complex alpha = l->system->coordinates[c].alpha[l->pole[k]];
            set(&l->alpha, c * P + k, alpha);
            set(&l->to_w, c * P + k, l->multiplicity[k] * alpha);
            set(&l->to_v, c * P + k, l->multiplicity[k] * alpha * p);
            if (l->uses_a)
                set(&l->to_a, c * P + k, l->multiplicity[k] * alpha * p * p);
        }
    }
}

/* S: what a force at the end of the step does to the coordinates there. */
static void fill_compliance(struct law_run *l)
{
    size_t D = l->D, P = l->P;
    for (size_t a = 0; a < D; a++) {
        for (size_t b = 0; b < D; b++) {
            double w = l->far[a * D + b], v = 0.0;
            for (size_t k = 0; k < l->n_dynamic; k++) {
                size_t i = a * P + k;
                double complex alpha = l->system->coordinates[b].alpha[l->pole[k]];
                double complex q = l->hold[k].g[0] * alpha;
                w -= l->to_w.re[i] * creal(q) - l->to_w.im[i] * cimag(q);
                v -= l->to_v.re[i] * creal(q) - l->to_v.im[i] * cimag(q);
            }
            l->S_w[a * D + b] = w;
            l->S_v[a * D + b] = v;
        }
    }
}

/* The same of the accelerations: through q, and at once, as a force does on a mass. */
static void fill_accelerance(struct law_run *l)
{
    size_t D = l->D, P = l->P;
    for (size_t a = 0; l->uses_a && a < D; a++) {
        for (size_t b = 0; b < D; b++) {
            double sum = 0.0;
            for (size_t k = 0; k < l->n_dynamic; k++) {
                size_t i = a * P + k;
                double complex alpha = l->system->coordinates[b].alpha[l->pole[k]];
                double complex q = l->hold[k].g[0] * alpha;
                sum -= l->to_a.re[i] * creal(q) - l->to_a.im[i] * cimag(q);
                sum -= l->to_v.re[i] * creal(alpha) - l->to_v.im[i] * cimag(alpha);
            }
            l->S_a[a * D + b] = sum;
        }
    }
}

/* Steps before and after a record that did not begin at rest; forces are faded there by a step with all derivatives (Planck's). */
static void fill_lead(struct law_run *l)
{
    enum { LEAD_SAMPLES = 32 };
    size_t room = (l->grid->n_fft - l->grid->n) / 4, samples = room < LEAD_SAMPLES ? room : LEAD_SAMPLES;
    if (!l->system->free_state)
        return;
    l->lead = samples * (size_t)l->oversample;
    l->N += 2 * l->lead;
    l->fade = bf_alloc(l->N, sizeof *l->fade);
    for (size_t k = 0; k < l->N; k++)
        l->fade[k] = 1.0;
    for (size_t k = 0; k < l->lead; k++) {
        double x = ((double)k + 0.5) / (double)l->lead;
        l->fade[k] = l->fade[l->N - 1 - k] = 1.0 / (1.0 + exp(1.0 / x - 1.0 / (1.0 - x)));
    }
}

/* e^(σt) at every step, by products of a coarse and a fine table. */
static void fill_growth(struct law_run *l)
{
    enum { FINE = 64 };
    double fine[FINE], rate = l->grid->sigma * l->h_s;
    for (size_t i = 0; i < FINE; i++)
        fine[i] = exp(rate * (double)i);
    l->growth = bf_grow(NULL, l->N, sizeof *l->growth);
    for (size_t first = 0; first < l->N; first += FINE) {
        double coarse = exp(rate * ((double)first - (double)l->lead));
        for (size_t i = 0; i < FINE && first + i < l->N; i++)
            l->growth[first + i] = coarse * fine[i];
    }
}

static void ask_laws(struct law_run *l)
{
    for (size_t e = 0; e < l->n_laws; e++) {
        const struct law *law = l->laws[e].law;
        l->uses_w = l->uses_w || law->uses_w || law->uses_w_old || law->shortening != NULL;
        l->uses_v = l->uses_v || law->uses_v || law->shortening != NULL;
        l->uses_a = l->uses_a || law->shortening != NULL;
    }
}

static bool has_states(const struct law_run *l)
{
    for (size_t e = 0; e < l->n_laws; e++)
        if (l->laws[e].law->effect->n_law_states > 0)
            return true;
    return false;
}

/* What the derivatives need. Every number is written by the steps. */
static void make_history(struct law_run *l)
{
    size_t squares = l->N * l->D * l->D;
    for (size_t e = 0; e < l->n_laws; e++)
        l->n_dependencies += l->laws[e].law->n_dependencies;
    l->q.re = bf_grow(NULL, 2 * l->N * l->P, sizeof(double));
    l->q.im = l->q.re + l->N * l->P;
    l->T_w = bf_alloc((l->uses_a ? 5u : 4u) * squares, sizeof(double)); /* zero between the blocks of two laws */
    l->T_v = l->T_w + squares;
    l->T_old = l->T_v + squares;
    l->inverse = l->T_old + squares;
    l->T_a = l->uses_a ? l->inverse + squares : NULL;
    l->f_p = bf_grow(NULL, l->N * l->n_dependencies * LAW_COORDINATES, sizeof(double));
    l->state = has_states(l) ? bf_alloc(l->N * l->n_laws, sizeof *l->state) : NULL;
}

enum bf_status law_run_new(struct law_run *l, struct bf_error *err)
{
    bool smooth = all_smooth(l);
    l->grid = l->system->grid;
    l->held = smooth ? HOLD_CUBIC : HOLD_LINE;
    if (l->oversample <= 0)
        l->oversample = smooth ? OVERSAMPLE_SMOOTH : OVERSAMPLE_KINKED;
    l->D = l->system->n_coordinates;
    l->N = l->grid->n * (size_t)l->oversample;
    l->h_s = l->grid->dt_s / (double)l->oversample;
    fill_lead(l);
    ask_laws(l);
    split_poles(l);
    fill_rows(l);
    fill_compliance(l);
    fill_accelerance(l);
    fill_growth(l);
    l->f = bf_grow(NULL, l->N * l->D, sizeof(double));
    if (law_run_differentiates(l))
        make_history(l);
    return law_linear_motion(l, err);
}

void law_run_free(struct law_run *l)
{
    free(l->pole);
    free(l->hold);
    free(l->multiplicity);
    free(l->rows);
    free(l->growth);
    free(l->fade);
    free(l->w_lin);
    free(l->f);
    free(l->F);
    free(l->q.re);
    free(l->T_w);
    free(l->f_p);
    free(l->state);
}
