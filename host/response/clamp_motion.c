/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "clamp_motion.h"

#include <math.h>
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

static struct exponentials exponentials_new(const struct clamp_question *q)
{
    struct exponentials x = {.n = 1 + (q->steady ? 0 : q->clamp->system->n_all)};
    x.rate = bf_alloc(3 * x.n, sizeof *x.rate);
    x.a = x.rate + x.n;
    x.b = x.a + x.n;
    return x;
}

/*
 * out += Im(E Σ …). Real arithmetic: the products of C's complex type look after infinities that cannot occur here, at four times the cost. A term that
 * has decayed to below rounding is left.
 */
static void exponentials_add(const struct clamp_question *q, const struct exponentials *x, double complex E,
                             double out[])
{
    enum { LOOK = 64 }; /* samples between two looks at the decay */
    static const double spent = 1e-18;
    for (size_t j = 0; j < x->n; j++) {
        const double complex first = E * cexp(x->rate[j] * q->t0_s), turn = cexp(x->rate[j] * q->h_s);
        const double turn_re = creal(turn), turn_im = cimag(turn), a_re = creal(x->a[j]), a_im = cimag(x->a[j]);
        const double b_re = creal(x->b[j]), b_im = cimag(x->b[j]), end = spent * cabs(first);
        double re = creal(first), im = cimag(first);
        for (size_t k = 0; k < q->n; k++) {
            if (k % LOOK == 0 && hypot(re, im) <= end)
                break;
            const double t = q->t0_s + (double)k * q->h_s, now = re;
            out[k] += (a_re + b_re * t) * im + (a_im + b_im * t) * re;
            re = now * turn_re - im * turn_im;
            im = now * turn_im + im * turn_re;
        }
    }
}

/* Pole i of all, conjugates included, and its residue R = αβ; with a parameter also their derivatives. */
struct fraction {
    double complex p, R, dp, dR;
};

static struct fraction fraction_at(const struct clamp_question *q, size_t i, size_t parameter)
{
    const struct system *s = q->clamp->system;
    const struct functional *f = q->f, *b = q->clamp->load;
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

/* The factor of one tone: the gain, and what a filter makes of it. */
struct factor {
    double complex F, slope; /* and dF/ds */
};

static struct factor factor_at(const struct clamp_question *q, size_t tone)
{
    struct factor at = {.F = q->gain};
    if (q->filter == NULL)
        return at;
    at.slope = q->gain * q->slope[tone];
    at.F = q->gain * q->filter[tone];
    return at;
}

static void fill_value(const struct clamp_question *q, const struct factor *factor, double omega,
                       struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), T = 0.0;
    for (size_t i = 0; i < q->clamp->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, SIZE_MAX);
        T += r.R / (s - r.p);
        if (q->steady)
            continue;
        x->rate[1 + i] = r.p;
        x->a[1 + i] = factor->F * r.R * power(r.p, q->order) / (r.p - s);
    }
    T *= power(s, q->order);
    if (q->absolute)
        T += power(s, q->order - 2);
    x->rate[0] = s;
    x->a[0] = factor->F * T;
}

static void fill_structural(const struct clamp_question *q, const struct factor *factor, double omega, size_t parameter,
                            struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), dT = 0.0;
    for (size_t i = 0; i < q->clamp->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, parameter);
        double complex gap = s - r.p;
        dT += r.dR / gap + r.R * r.dp / (gap * gap);
        if (q->steady)
            continue;
        double complex rise = q->order > 0 ? (double)q->order * power(r.p, q->order - 1) : 0.0,
                       p = power(r.p, q->order);
        x->rate[1 + i] = r.p;
        x->a[1 + i] = -factor->F * ((r.dR * p + r.R * rise * r.dp) / gap + r.R * p * r.dp / (gap * gap));
        x->b[1 + i] = -factor->F * r.R * p / gap * r.dp;
    }
    x->rate[0] = s;
    x->a[0] = factor->F * power(s, q->order) * dT;
}

/* By ω. */
static void fill_frequency(const struct clamp_question *q, const struct factor *factor, double omega,
                           struct exponentials *x)
{
    double complex s = CMPLX(0.0, omega), H = 0.0, H_s = 0.0;
    fill_value(q, factor, omega, x);
    for (size_t i = 0; i < q->clamp->system->n_all; i++) {
        struct fraction r = fraction_at(q, i, SIZE_MAX);
        double complex gap = s - r.p;
        H += r.R / gap;
        H_s -= r.R / (gap * gap);
        if (!q->steady)
            x->a[1 + i] = CMPLX(0.0, 1.0) * factor->F * r.R * power(r.p, q->order) / (gap * gap);
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
    x->a[0] = CMPLX(0.0, 1.0) * (factor->F * T_s + factor->slope * T);
}

/* By the clock: every instant t moves by t/clock. */
static void fill_clock(const struct clamp_question *q, const struct factor *factor, double omega,
                       struct exponentials *x)
{
    fill_value(q, factor, omega, x);
    for (size_t i = 0; i < x->n; i++) {
        x->b[i] = x->a[i] * x->rate[i] / q->clamp->clock;
        x->a[i] = 0.0;
    }
}

void clamp_motion_add(const struct clamp_question *q, double out[])
{
    struct exponentials x = exponentials_new(q);
    for (size_t i = 0; i < q->clamp->n_tones; i++) {
        const struct clamp_tone *at = &q->clamp->tones[i];
        struct factor factor = factor_at(q, i);
        fill_value(q, &factor, clamp_omega(at), &x);
        exponentials_add(q, &x, at->tone.amplitude * cexp(CMPLX(0.0, at->tone.phase_rad)), out);
    }
    free(x.rate);
}

/* The tone's own parameters: amplitude, phase, frequency. */
static bool answer_own(const struct clamp_question *q, const struct factor *factor, const struct clamp_tone *at,
                       size_t parameter, struct exponentials *x, double out[])
{
    const struct beam_tone *tone = &at->tone;
    double complex unit = cexp(CMPLX(0.0, tone->phase_rad));
    for (int s = 0; s < at->n_parameters; s++) {
        if (at->parameter[s] != parameter)
            continue;
        fill_value(q, factor, clamp_omega(at), x);
        exponentials_add(q, x, CMPLX(tone->by_parameter[0][s], tone->amplitude * tone->by_parameter[1][s]) * unit, out);
        fill_frequency(q, factor, clamp_omega(at), x);
        exponentials_add(q, x, 2.0 * acos(-1.0) * tone->by_parameter[2][s] * tone->amplitude * unit, out);
        return true;
    }
    return false;
}

bool clamp_derivative_add(const struct clamp_question *q, size_t parameter, double out[])
{
    const struct clamp *clamp = q->clamp;
    bool any = false, structural = clamp->structural != NULL && clamp->structural[parameter];
    double by_clock = clamp->clock_by[parameter];
    for (size_t i = 0; i < clamp->n_tones; i++) {
        const struct clamp_tone *at = &clamp->tones[i];
        double complex E = at->tone.amplitude * cexp(CMPLX(0.0, at->tone.phase_rad));
        struct exponentials x = exponentials_new(q);
        struct factor factor = factor_at(q, i);
        if (answer_own(q, &factor, at, parameter, &x, out)) {
            any = true;
        } else if (structural) {
            fill_structural(q, &factor, clamp_omega(at), parameter, &x);
            exponentials_add(q, &x, E, out);
            any = true;
        } else if (by_clock < 0.0 || by_clock > 0.0) {
            fill_clock(q, &factor, clamp_omega(at), &x);
            exponentials_add(q, &x, E * by_clock, out);
            any = true;
        }
        free(x.rate);
    }
    return any;
}

struct clamp_question clamp_relative(const struct clamp *clamp, const struct functional *f, int order, double h_s,
                                     size_t n)
{
    return (struct clamp_question){.clamp = clamp, .f = f, .order = order, .gain = 1.0, .h_s = h_s, .n = n};
}
