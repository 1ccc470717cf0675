/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A clamp that shakes with a_b(t) = Im(E e^(iωt)): the load −ρ(x) a_b on the motion relative to it, from relative rest at
 * the record's first sample. In partial fractions it is a closed form,
 *     y = Im(E (T(iω) e^(iωt) + Σ_k R_k p_k^ν/(p_k − iω) e^(p_k t))),   T(s) = s^ν Σ_k R_k/(s − p_k),
 * so neither samples nor a step are involved. A sensor that stands on the ground adds (iω)^(ν−2) to T. In a free decay
 * the second sum is left to the unknown initial state.
 */
#include "predict_base.h"

#include <stdint.h>
#include <stdlib.h>

/* Σ (a + b t) e^(rate t); the first term is the tone itself. */
struct exponentials {
    size_t n;
    double complex *rate, *a, *b;
};

static double complex power(double complex s, int n)
{
    double complex result = 1.0;
    for (int i = 0; i < n; i++)
        result *= s;
    return n < 0 ? 1.0 / power(s, -n) : result;
}

static struct exponentials exponentials_new(const struct question *q)
{
    struct exponentials x = {.n = 1 + (q->steady ? 0 : q->run->p->system->n_all)};
    x.rate = bf_alloc(3 * x.n, sizeof *x.rate);
    x.a = x.rate + x.n;
    x.b = x.a + x.n;
    return x;
}

/* out += Im(E Σ …). */
static void exponentials_add(const struct question *q, const struct exponentials *x, double complex E, double out[])
{
    for (size_t j = 0; j < x->n; j++) {
        double complex now = E * cexp(x->rate[j] * q->t0_s), turn = cexp(x->rate[j] * q->h_s);
        for (size_t k = 0; k < q->n; k++) {
            double t = q->t0_s + (double)k * q->h_s;
            out[k] += cimag((x->a[j] + x->b[j] * t) * now);
            now *= turn;
        }
    }
}

/* Pole i of all, conjugates included, and its residue R = αβ; with a parameter also their derivatives. */
struct fraction {
    double complex p, R, dp, dR;
};

static struct fraction fraction_at(const struct question *q, size_t i, size_t parameter)
{
    const struct system *s = q->run->p->system;
    const struct functional *f = q->f, *b = q->run->p->base_load;
    size_t k = i < s->n_poles ? i : i - s->n_poles;
    struct fraction x = {.p = s->p[k], .R = f->alpha[k] * b->alpha[k]};
    if (parameter != SIZE_MAX) {
        const double complex *df = f->d_alpha + parameter * s->n_poles, *db = b->d_alpha + parameter * s->n_poles;
        x.dp = s->derivative[parameter].p != NULL ? s->derivative[parameter].p[k] : 0.0;
        x.dR = df[k] * b->alpha[k] + f->alpha[k] * db[k];
    }
    if (i >= s->n_poles)
        x = (struct fraction){conj(x.p), conj(x.R), conj(x.dp), conj(x.dR)};
    return x;
}

static void fill_value(const struct question *q, double omega, struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), T = 0.0;
    for (size_t i = 0; i < q->run->p->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, SIZE_MAX);
        T += r.R / (s - r.p);
        if (q->steady)
            continue;
        x->rate[1 + i] = r.p;
        x->a[1 + i] = q->F * r.R * power(r.p, q->order) / (r.p - s);
    }
    T *= power(s, q->order);
    if (q->absolute)
        T += power(s, q->order - 2);
    x->rate[0] = s;
    x->a[0] = q->F * T;
}

static void fill_structural(const struct question *q, double omega, size_t parameter, struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), dT = 0.0;
    for (size_t i = 0; i < q->run->p->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, parameter);
        double complex gap = s - r.p;
        dT += r.dR / gap + r.R * r.dp / (gap * gap);
        if (q->steady)
            continue;
        double complex rise = q->order > 0 ? (double)q->order * power(r.p, q->order - 1) : 0.0,
                       p = power(r.p, q->order);
        x->rate[1 + i] = r.p;
        x->a[1 + i] = -q->F * ((r.dR * p + r.R * rise * r.dp) / gap + r.R * p * r.dp / (gap * gap));
        x->b[1 + i] = -q->F * r.R * p / gap * r.dp;
    }
    x->rate[0] = s;
    x->a[0] = q->F * power(s, q->order) * dT;
}

/* By ω. */
static void fill_frequency(const struct question *q, double omega, struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), H = 0.0, H_s = 0.0;
    fill_value(q, omega, x);
    for (size_t i = 0; i < q->run->p->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, SIZE_MAX);
        double complex gap = s - r.p;
        H += r.R / gap;
        H_s -= r.R / (gap * gap);
        if (!q->steady)
            x->a[1 + i] = CMPLX(0.0, 1.0) * q->F * r.R * power(r.p, q->order) / (gap * gap);
    }
    double complex T_s = power(s, q->order) * H_s;
    if (q->order > 0)
        T_s += (double)q->order * power(s, q->order - 1) * H;
    double complex T = power(s, q->order) * H;
    if (q->absolute) {
        T += power(s, q->order - 2);
        T_s += (double)(q->order - 2) * power(s, q->order - 3);
    }
    x->b[0] = CMPLX(0.0, 1.0) * x->a[0];
    x->a[0] = CMPLX(0.0, 1.0) * (q->F * T_s + q->slope * T);
}

/* By the clock: every instant t moves by t/clock. */
static void fill_clock(const struct question *q, double omega, struct exponentials *x)
{
    fill_value(q, omega, x);
    for (size_t i = 0; i < x->n; i++) {
        x->b[i] = x->a[i] * x->rate[i] / q->run->p->geometry.clock;
        x->a[i] = 0.0;
    }
}

bool base_tone(const struct question *q, size_t e, struct beam_tone *tone)
{
    const struct predictor *p = q->run->p;
    double parameters[BEAM_EFFECT_PARAMETERS];
    if (p->model.effects[e].effect->tone == NULL)
        return false;
    parameter_map_effect(&p->map, q->record, e, q->run->theta, parameters);
    *tone = (struct beam_tone){0};
    return p->model.effects[e].effect->tone(parameters, tone) == 0;
}

/* The question with the sensor's filters at this tone. */
static struct question at_tone(const struct question *q, double omega)
{
    struct question at = *q;
    struct bf_error err;
    double complex s = CMPLX(0.0, omega), F = 0.0, slope = 0.0;
    bool filtered;
    if (q->output == SIZE_MAX)
        return at;
    if (q->filter_parameter != SIZE_MAX)
        (void)channel_filter_derivative(q->run, q->record, q->output, q->filter_parameter, &s, 1, &F);
    else if (channel_filter(q->run, q->record, q->output, &s, 1, &F, &filtered, &err) == BF_OK)
        (void)channel_filter_slope(q->run, q->record, q->output, &s, 1, &slope, &err);
    at.slope = q->F * slope;
    at.F = q->F * F;
    return at;
}

void base_answer(const struct question *q, double out[])
{
    struct beam_tone tone;
    struct exponentials x = exponentials_new(q);
    for (size_t e = 0; e < q->run->p->model.n_effects; e++) {
        if (!base_tone(q, e, &tone))
            continue;
        struct question at = at_tone(q, base_omega(&tone));
        fill_value(&at, base_omega(&tone), &x);
        exponentials_add(&at, &x, tone.amplitude * cexp(CMPLX(0.0, tone.phase_rad)), out);
    }
    free(x.rate);
}

/* An effect's own parameters: amplitude, phase, frequency. */
static bool answer_own(const struct question *q, size_t e, const struct beam_tone *tone, size_t parameter,
                       struct exponentials *x, double out[])
{
    const struct predictor *p = q->run->p;
    double complex unit = cexp(CMPLX(0.0, tone->phase_rad));
    for (int s = 0; s < p->model.effects[e].effect->n_parameters; s++) {
        if (parameter_map_slot(&p->map, q->record, e, s) != parameter)
            continue;
        fill_value(q, base_omega(tone), x);
        exponentials_add(q, x, CMPLX(tone->by_parameter[0][s], tone->amplitude * tone->by_parameter[1][s]) * unit, out);
        fill_frequency(q, base_omega(tone), x);
        exponentials_add(q, x, 2.0 * acos(-1.0) * tone->by_parameter[2][s] * tone->amplitude * unit, out);
        return true;
    }
    return false;
}

bool base_answer_derivative(const struct question *q, size_t parameter, double out[])
{
    const struct run *run = q->run;
    const struct predictor *p = run->p;
    bool any = false, structural = run_structural(run, parameter);
    for (size_t e = 0; e < p->model.n_effects; e++) {
        struct beam_tone tone;
        if (!base_tone(q, e, &tone))
            continue;
        double complex E = tone.amplitude * cexp(CMPLX(0.0, tone.phase_rad));
        struct exponentials x = exponentials_new(q);
        struct question at = at_tone(q, base_omega(&tone));
        if (answer_own(&at, e, &tone, parameter, &x, out)) {
            any = true;
        } else if (structural) {
            fill_structural(&at, base_omega(&tone), parameter, &x);
            exponentials_add(q, &x, E, out);
            any = true;
        } else if (p->geometry.clock_by[parameter] < 0.0 || p->geometry.clock_by[parameter] > 0.0) {
            fill_clock(&at, base_omega(&tone), &x);
            exponentials_add(q, &x, E * p->geometry.clock_by[parameter], out);
            any = true;
        }
        free(x.rate);
    }
    return any;
}

/* ---- Laws ---- */

static struct question relative_motion(const struct run *run, size_t record, const struct functional *f, int order,
                                       double h_s, size_t n)
{
    return (struct question){.run = run,
                             .record = record,
                             .f = f,
                             .order = order,
                             .F = 1.0,
                             .output = SIZE_MAX,
                             .filter_parameter = SIZE_MAX,
                             .t0_s = 0.0,
                             .h_s = h_s,
                             .n = n};
}

void base_response_add(const struct run *run, size_t record, const struct functional *f, int order, double h_s,
                       size_t n, double out[])
{
    struct question q = relative_motion(run, record, f, order, h_s, n);
    if (run->p->base_load != NULL)
        base_answer(&q, out);
}

bool base_derivative_add(const struct run *run, size_t record, const struct functional *f, int order, size_t parameter,
                         double h_s, size_t n, double out[])
{
    struct question q = relative_motion(run, record, f, order, h_s, n);
    return run->p->base_load != NULL && base_answer_derivative(&q, parameter, out);
}
