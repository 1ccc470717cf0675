/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Derivatives of a nonlinear record by every parameter: the stepped equations, linearised along the stored motion. */
#include "law_lanes.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "law_transfer.h"

static double (*take(double **next, size_t rows))[LANES]
{
    double(*block)[LANES] = (double(*)[LANES]) * next;
    *next += rows * LANES;
    return block;
}

static void lanes_new(struct lanes *a, const struct law_run *l)
{
    size_t P = l->P, D = l->D, states = l->n_laws * BEAM_LAW_STATES;
    *a = (struct lanes){.l = l};
    size_t rows = (4 + 2 * HOLD_CUBIC) * P + 2 * D * P + 2 * D * D + states;
    a->storage = bf_alloc(LANES * rows + (l->uses_a ? 4u : 3u) * LANES * D * l->N, sizeof(double));
    double *next = a->storage;
    a->q_re = take(&next, P), a->q_im = take(&next, P);
    a->p_re = take(&next, P), a->p_im = take(&next, P);
    for (size_t i = 0; i < HOLD_CUBIC; i++)
        a->F_re[i] = take(&next, P), a->F_im[i] = take(&next, P);
    a->a_re = take(&next, D * P), a->a_im = take(&next, D * P);
    a->far = next;
    next += D * D * LANES;
    a->jump = next;
    next += D * D * LANES;
    a->z = (double(*)[BEAM_LAW_STATES][LANES])next;
    next += states * LANES;
    a->w_lin = next;
    a->v_lin = a->w_lin + LANES * D * l->N;
    a->f = a->v_lin + LANES * D * l->N;
    a->a_lin = l->uses_a ? a->f + LANES * D * l->N : NULL;
}

/* ---- What the parameters change ---- */

static void set_complex(double (*re)[LANES], double (*im)[LANES], size_t row, size_t lane, double complex x)
{
    re[row][lane] = creal(x);
    im[row][lane] = cimag(x);
}

static void fill_far(struct lanes *a, size_t lane, size_t k, double complex dp)
{
    const struct law_run *l = a->l;
    const struct system *s = l->system->system;
    size_t at = a->parameter[lane] * s->n_poles + k;
    double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
    for (size_t x = 0; x < l->D; x++) {
        for (size_t y = 0; y < l->D; y++) {
            const struct functional *f = &l->system->coordinates[x], *g = &l->system->coordinates[y];
            double complex change =
                f->d_alpha[at] * g->alpha[k] + f->alpha[k] * g->d_alpha[at] - f->alpha[k] * g->alpha[k] * dp / s->p[k];
            a->far[(x * l->D + y) * LANES + lane] += multiplicity * creal(change / s->p[k]);
        }
    }
}

/* What a force does to the accelerations at once, by a pole that is stepped. */
static void fill_jump(struct lanes *a, size_t lane, size_t k, double complex dp)
{
    const struct law_run *l = a->l;
    const struct system *s = l->system->system;
    size_t at = a->parameter[lane] * s->n_poles + k;
    double complex pole = s->p[k];
    double multiplicity = k < s->n_pairs ? 2.0 : 1.0;
    for (size_t x = 0; x < l->D; x++) {
        for (size_t y = 0; y < l->D; y++) {
            const struct functional *f = &l->system->coordinates[x], *g = &l->system->coordinates[y];
            double complex change =
                (f->d_alpha[at] * g->alpha[k] + f->alpha[k] * g->d_alpha[at]) * pole + f->alpha[k] * g->alpha[k] * dp;
            a->jump[(x * l->D + y) * LANES + lane] += multiplicity * creal(change);
        }
    }
}

static void fill_structure(struct lanes *a, size_t lane)
{
    const struct law_run *l = a->l;
    const struct system *s = l->system->system;
    size_t j = a->parameter[lane], next = 0;
    if (j >= l->system->n_parameters || !l->system->parameters[j].structural)
        return;
    a->structural = true;
    for (size_t k = 0; k < s->n_poles; k++) {
        double complex dp = s->derivative[j].p != NULL ? s->derivative[j].p[k] : 0.0;
        if (next == l->n_dynamic || l->pole[next] != k) {
            fill_far(a, lane, k, dp);
            continue;
        }
        set_complex(a->p_re, a->p_im, next, lane, dp);
        if (l->uses_a)
            fill_jump(a, lane, k, dp);
        for (size_t c = 0; c < l->D; c++)
            set_complex(a->a_re, a->a_im, c * l->P + next, lane, l->system->coordinates[c].d_alpha[j * s->n_poles + k]);
        next++;
    }
}

static void fill_direct(struct lanes *a, size_t lane)
{
    const struct law_run *l = a->l;
    size_t first = 0, dependency = 0;
    for (size_t e = 0; e < l->n_laws; e++) {
        const struct law *law = l->laws[e].law;
        for (size_t d = 0; d < law->n_dependencies; d++)
            if (law->dependency[d] == a->parameter[lane])
                a->direct[a->n_direct++] =
                    (struct direct){.lane = lane, .first = first, .d = law->d, .dependency = dependency + d};
        first += law->d;
        dependency += law->n_dependencies;
    }
}

/* Into the lane of coordinate c: the order-th time derivative of the motion with spectrum W (NULL: none) and base tones. */
static enum bf_status fill_lane(struct lanes *a, size_t lane, size_t c, int order, const double complex W[],
                                double scratch[], double out[], struct bf_error *err)
{
    const struct law_run *l = a->l;
    enum bf_status status = BF_OK;
    if (W != NULL)
        status = law_upsample(l, W, scratch, err);
    else
        memset(scratch, 0, l->N * sizeof *scratch);
    if (a->parameter[lane] >= l->system->n_parameters) {
        law_state_column_add(l, c, order, a->parameter[lane] - l->system->n_parameters, scratch);
    } else {
        (void)law_state_derivative_add(l, c, order, a->parameter[lane], scratch);
        if (l->system->clamp != NULL) {
            struct clamp_question q = law_clamp(l, c, order);
            (void)clamp_derivative_add(&q, a->parameter[lane], scratch);
        }
    }
    for (size_t k = 0; k < l->N; k++)
        out[(k * l->D + c) * LANES + lane] = scratch[k];
    return status;
}

/* δw_lin: the linear response of coordinate c to the inputs, differentiated. */
static enum bf_status fill_linear(struct lanes *a, size_t lane, size_t c, double complex W[], double scratch[],
                                  struct bf_error *err)
{
    const struct law_run *l = a->l;
    bool any =
        a->parameter[lane] < l->system->n_parameters && law_source_derivative(l->system, c, a->parameter[lane], W);
    enum bf_status status = BF_OK;
    if (l->has_T_w)
        status = fill_lane(a, lane, c, 0, any ? W : NULL, scratch, a->w_lin, err);
    for (size_t k = 0; any && k < l->grid->m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK && l->has_T_v)
        status = fill_lane(a, lane, c, 1, any ? W : NULL, scratch, a->v_lin, err);
    for (size_t k = 0; any && l->uses_a && k < l->grid->m; k++)
        W[k] *= l->grid->s[k];
    if (status == BF_OK && l->uses_a)
        status = fill_lane(a, lane, c, 2, any ? W : NULL, scratch, a->a_lin, err);
    return status;
}

/* ---- Outputs ---- */

static double *column_of(const struct law_run *l, const struct modal_output *output, size_t j)
{
    size_t n = l->system->n_parameters;
    return j < n ? modal_column(l->system, output, j) : output->states + (j - n) * l->system->n_rows;
}

static enum bf_status add_output(const struct lanes *a, size_t lane, const struct modal_output *output,
                                 const double complex dF[], struct bf_error *err)
{
    const struct law_run *l = a->l;
    size_t m = l->grid->m, j = a->parameter[lane];
    double complex *Y = bf_alloc(m, sizeof *Y);
    for (size_t c = 0; c < l->D; c++) {
        const struct modal_path *path = &output->paths[c];
        const double complex *dH = j < l->system->n_parameters ? path->dH[j] : NULL, *f = l->F + c * m,
                             *df = dF + c * m;
        for (size_t k = 0; k < m; k++)
            Y[k] -= path->H[k] * df[k];
        for (size_t k = 0; dH != NULL && k < m; k++)
            Y[k] -= dH[k] * f[k];
    }
    enum bf_status status = law_add_output(l, output->gain, output->filter, Y, column_of(l, output, j), err);
    free(Y);
    return status;
}

static enum bf_status run_block(struct lanes *a, const struct law_row *R, struct bf_error *err)
{
    const struct law_run *l = a->l;
    size_t m = l->grid->m;
    enum bf_status status = BF_OK;
    double complex *dF = bf_grow(NULL, l->D * m, sizeof *dF);
    double *scratch = bf_grow(NULL, l->N, sizeof *scratch);
    for (size_t lane = 0; lane < a->count; lane++) {
        fill_structure(a, lane);
        fill_direct(a, lane);
        for (size_t c = 0; status == BF_OK && c < l->D; c++)
            status = fill_linear(a, lane, c, dF, scratch, err);
    }
    if (status == BF_OK)
        law_lanes_march(a, R);
    for (size_t lane = 0; status == BF_OK && lane < a->count; lane++) {
        for (size_t c = 0; status == BF_OK && c < l->D; c++)
            status = law_transform(l, a->f + c * LANES + lane, l->D * LANES, dF + c * m, err);
        for (size_t i = 0; status == BF_OK && i < l->system->n_outputs; i++)
            status = add_output(a, lane, &l->system->outputs[i], dF, err);
    }
    free(dF);
    free(scratch);
    return status;
}

/* The nonlinear motion depends on this parameter. */
static bool matters(const struct law_run *l, size_t j)
{
    if (l->system->parameters == NULL)
        return false;
    const struct modal_parameter *role = &l->system->parameters[j];
    if (!role->wanted)
        return false;
    bool yes = role->structural || role->of_input;
    for (size_t e = 0; e < l->n_laws; e++)
        for (size_t d = 0; d < l->laws[e].law->n_dependencies; d++)
            yes = yes || l->laws[e].law->dependency[d] == j;
    return yes;
}

/* Those that change the structure first, so that the others share blocks that do without; then the unknowns of the initial state. */
static size_t list_parameters(const struct law_run *l, size_t list[])
{
    size_t n = 0;
    for (int structural = 1; structural >= 0; structural--)
        for (size_t j = 0; j < l->system->n_parameters; j++)
            if (matters(l, j) && l->system->parameters[j].structural == (structural == 1))
                list[n++] = j;
    for (size_t i = 0; i < 2 * l->system->n_states; i++)
        list[n++] = l->system->n_parameters + i;
    return n;
}

enum bf_status law_run_derivatives(const struct law_run *l, struct bf_error *err)
{
    enum bf_status status = BF_OK;
    size_t *list = bf_alloc(l->system->n_parameters + 2 * l->system->n_states, sizeof *list),
           n = list_parameters(l, list);
    struct law_row R = law_pole_changes(l);
    for (size_t j = 0; status == BF_OK && j < n;) {
        struct lanes a;
        lanes_new(&a, l);
        while (j < n && a.count < LANES)
            a.parameter[a.count++] = list[j++];
        for (size_t i = a.count; i < LANES; i++)
            a.parameter[i] = SIZE_MAX;
        status = run_block(&a, &R, err);
        free(a.storage);
    }
    free(R.re);
    free(list);
    return status;
}
