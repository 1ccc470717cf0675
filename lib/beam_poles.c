/* SPDX-License-Identifier: MIT */
/*
 * Poles of Q(s) = s² + ω² + s Ĉ + Σ (τ − 1/(s + 1/τ)) λλᵀ in modal coordinates: QR on the first-order form for a start,
 * then Rayleigh quotient iteration on Q itself, which restores the relative accuracy of the low modes
 * (Lancaster, Lambda-Matrices and Vibrating Systems, 1966).
 */
#include "beam_modal.h"

/* REAL_AXIS: |im p|/|p| below which a start value counts as real; coinciding memory poles scatter that far. */
#ifdef BEAM_FLOAT
#define MOVED     BEAM_K(0.05) /* relative move of a pole by polishing that means another pole was found */
#define COMPLETE  BEAM_K(0.02) /* error of Σ residues */
#define RANK      BEAM_K(1e-5)
#define GROWTH    BEAM_K(1e-4) /* rounding of a start value, in units of the highest frequency */
#define REAL_AXIS BEAM_K(0.02)
#else
#define MOVED     BEAM_K(1e-4)
#define COMPLETE  BEAM_K(1e-5)
#define RANK      BEAM_K(1e-11)
#define GROWTH    BEAM_K(1e-10)
#define REAL_AXIS BEAM_K(1e-9)
#endif

struct complex_number {
    beam_real re, im;
};

static struct complex_number times(struct complex_number a, struct complex_number b)
{
    return (struct complex_number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

static struct complex_number over(struct complex_number a, struct complex_number b)
{
    const beam_real size = b.re * b.re + b.im * b.im;
    return (struct complex_number){(a.re * b.re + a.im * b.im) / size, (a.im * b.re - a.re * b.im) / size};
}

static beam_real magnitude(struct complex_number a)
{
    return beam_sqrt(a.re * a.re + a.im * a.im);
}

static struct complex_number root(struct complex_number a)
{
    const beam_real size = magnitude(a);
    const beam_real re = beam_sqrt(BEAM_K(0.5) * (size + beam_fabs(a.re)));
    const beam_real im = beam_less(BEAM_K(0.0), re) ? BEAM_K(0.5) * a.im / re : BEAM_K(0.0);
    if (!beam_less(a.re, BEAM_K(0.0)))
        return (struct complex_number){re, im};
    return beam_less(a.im, BEAM_K(0.0)) ? (struct complex_number){-im, -re} : (struct complex_number){im, re};
}

/* ω of a mode, 1 for a rigid one. */
static beam_real scale_of(const struct beam_work *work, int mode)
{
    const beam_real omega = work->modes.omega_radps[mode];
    return beam_less(BEAM_K(0.0), omega) ? omega : BEAM_K(1.0);
}

/* Modal damping and the internal states of the memory: √(E/τ) L with E X = E L Lᵀ. */
static enum beam_status modal_forms(const struct beam_model *model, struct beam_work *work)
{
    beam_real form[BEAM_N][BEAM_N], size[BEAM_N];
    beam_modal_form(&work->modes, model->C, work->damping);
    work->n_memory_states = 0;
    for (int m = 0; m < model->n_memories; m++) {
        const beam_real tau = model->memory[m].relaxation_s;
        if (!beam_less(BEAM_K(0.0), tau))
            return BEAM_ERROR_MEMORY;
        beam_modal_form(&work->modes, model->memory[m].form, form);
        for (int i = 0; i < BEAM_N; i++) /* scaled by ω, so that the rank of a form like K shows */
            for (int j = 0; j < BEAM_N; j++)
                work->a[i][j] = form[i][j] / (scale_of(work, i) * scale_of(work, j));
        if (beam_symmetric_eigen(BEAM_N, BEAM_STATES, work->a[0], work->b[0], size) != 0)
            return BEAM_ERROR_MEMORY;
        const beam_real least = RANK * size[BEAM_N - 1];
        if (beam_less(size[0], -least) || beam_less(size[BEAM_N - 1], BEAM_K(0.0)))
            return BEAM_ERROR_MEMORY;
        for (int k = 0; k < BEAM_N; k++) {
            if (!beam_less(least, size[k]))
                continue;
            if (work->n_memory_states == BEAM_MEMORY_STATES)
                return BEAM_ERROR_CAPACITY;
            const int n = work->n_memory_states++;
            work->memory_rate[n] = BEAM_K(1.0) / tau;
            for (int i = 0; i < BEAM_N; i++)
                work->memory_vector[n][i] = beam_sqrt(size[k] / tau) * scale_of(work, i) * work->b[i][k];
        }
    }
    return BEAM_OK;
}

/* A of the states (s q, q̇, h), s = ω or 1: q̈ = −K∞ q − Ĉ q̇ − Λ h, ḣ = −Λᵀ q − h/τ, K∞ = ω² + Λ τ Λᵀ. */
static void first_order_form(struct beam_work *work, int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            work->a[i][j] = BEAM_K(0.0);
    for (int j = 0; j < BEAM_N; j++) {
        const beam_real omega = work->modes.omega_radps[j], scale = scale_of(work, j);
        work->a[j][BEAM_N + j] = scale;
        work->a[BEAM_N + j][j] = -omega * omega / scale;
        for (int i = 0; i < BEAM_N; i++)
            work->a[BEAM_N + i][BEAM_N + j] = -work->damping[i][j];
        for (int m = 0; m < work->n_memory_states; m++) {
            const beam_real *lambda = work->memory_vector[m], rate = work->memory_rate[m];
            for (int i = 0; i < BEAM_N; i++)
                work->a[BEAM_N + i][j] -= lambda[i] * lambda[j] / rate / scale;
            work->a[BEAM_N + j][2 * BEAM_N + m] = -lambda[j];
            work->a[2 * BEAM_N + m][j] = -lambda[j] / scale;
            work->a[2 * BEAM_N + m][2 * BEAM_N + m] = -rate;
        }
    }
}

/* Q(p) into (re, im), and Q'(p) φ into y. */
static void pencil(const struct beam_work *work, struct complex_number p, beam_real re[BEAM_N][BEAM_N],
                   beam_real im[BEAM_N][BEAM_N])
{
    const struct complex_number p2 = times(p, p);
    for (int i = 0; i < BEAM_N; i++) {
        for (int j = 0; j < BEAM_N; j++) {
            re[i][j] = p.re * work->damping[i][j];
            im[i][j] = p.im * work->damping[i][j];
        }
        re[i][i] += p2.re + work->modes.omega_radps[i] * work->modes.omega_radps[i];
        im[i][i] += p2.im;
    }
    for (int m = 0; m < work->n_memory_states; m++) {
        const beam_real rate = work->memory_rate[m];
        const struct complex_number g = /* s/(r(s + r)) */
            over(p, (struct complex_number){rate * (p.re + rate), rate * p.im});
        for (int i = 0; i < BEAM_N; i++)
            for (int j = 0; j < BEAM_N; j++) {
                const beam_real ll = work->memory_vector[m][i] * work->memory_vector[m][j];
                re[i][j] += g.re * ll;
                im[i][j] += g.im * ll;
            }
    }
}

/* φᵀ Q'(p) φ = 2p φᵀφ + φᵀĈφ + Σ (λᵀφ)²/(p + 1/τ)² */
static struct complex_number slope_form(const struct beam_work *work, struct complex_number p,
                                        const struct complex_number phi[BEAM_N])
{
    struct complex_number sum = {BEAM_K(0.0), BEAM_K(0.0)};
    for (int i = 0; i < BEAM_N; i++) {
        struct complex_number row = times((struct complex_number){BEAM_K(2.0) * p.re, BEAM_K(2.0) * p.im}, phi[i]);
        for (int j = 0; j < BEAM_N; j++) {
            row.re += work->damping[i][j] * phi[j].re;
            row.im += work->damping[i][j] * phi[j].im;
        }
        row = times(phi[i], row);
        sum.re += row.re;
        sum.im += row.im;
    }
    for (int m = 0; m < work->n_memory_states; m++) {
        struct complex_number h = {BEAM_K(0.0), BEAM_K(0.0)};
        for (int i = 0; i < BEAM_N; i++) {
            h.re += work->memory_vector[m][i] * phi[i].re;
            h.im += work->memory_vector[m][i] * phi[i].im;
        }
        h = over(h, (struct complex_number){p.re + work->memory_rate[m], p.im});
        h = times(h, h);
        sum.re += h.re;
        sum.im += h.im;
    }
    return sum;
}

/* One inverse iteration and Rayleigh correction; returns |Δp|. */
static beam_real rayleigh_step(const struct beam_work *work, struct complex_number *p,
                               struct complex_number phi[BEAM_N])
{
    beam_real q_re[BEAM_N][BEAM_N], q_im[BEAM_N][BEAM_N], x_re[BEAM_N], x_im[BEAM_N], largest = BEAM_K(0.0);
    int at = 0;
    pencil(work, *p, q_re, q_im);
    for (int i = 0; i < BEAM_N; i++) {
        x_re[i] = phi[i].re;
        x_im[i] = phi[i].im;
    }
    beam_complex_solve(BEAM_N, q_re, q_im, x_re, x_im);
    for (int i = 0; i < BEAM_N; i++) {
        const beam_real size = beam_fabs(x_re[i]) + beam_fabs(x_im[i]);
        if (beam_less(largest, size)) {
            largest = size;
            at = i;
        }
    }
    /* y = Q⁻¹φ, scaled by its largest entry m: yᵀQy/m² = yᵀφ/m² */
    const struct complex_number m = {x_re[at], x_im[at]};
    struct complex_number top = {BEAM_K(0.0), BEAM_K(0.0)};
    for (int i = 0; i < BEAM_N; i++) {
        const struct complex_number y = over((struct complex_number){x_re[i], x_im[i]}, m);
        const struct complex_number product = times(y, over(phi[i], m));
        top.re += product.re;
        top.im += product.im;
        phi[i] = y;
    }
    const struct complex_number move = over(top, slope_form(work, *p, phi));
    p->re -= move.re;
    p->im -= move.im;
    return magnitude(move);
}

/* Polish a start value; φ is scaled to φᵀQ'φ = 1 (complex) or ±1 (real, sign returned). 0 on failure. */
static int polish(const struct beam_work *work, struct complex_number *p, struct complex_number phi[BEAM_N], int steps)
{
    const struct complex_number start = *p;
    const beam_real size = magnitude(start);
    for (int i = 0; i < BEAM_N; i++) {
        const beam_real apart = beam_fabs(work->modes.omega_radps[i] - size);
        phi[i] = (struct complex_number){BEAM_K(1.0) / (BEAM_K(1.0) + apart), BEAM_K(0.0)};
    }
    for (int step = 0; step < steps; step++) {
        const beam_real move = rayleigh_step(work, p, phi);
        if (!beam_finite(move))
            return 0;
        if (step > 1 && beam_less(move, BEAM_K(2.0) * BEAM_EPSILON * size))
            break;
    }
    const beam_real moved = magnitude((struct complex_number){p->re - start.re, p->im - start.im});
    if (steps > 1 &&
        !beam_less(moved, MOVED * size + BEAM_EPSILON * BEAM_K(100.0) * work->modes.omega_radps[BEAM_N - 1]))
        return 0;
    struct complex_number form = slope_form(work, *p, phi);
    const int sign = beam_less(form.re, BEAM_K(0.0)) && !beam_less(BEAM_K(0.0), beam_fabs(start.im)) ? -1 : 1;
    form = root((struct complex_number){(beam_real)sign * form.re, form.im});
    if (!beam_less(BEAM_K(0.0), magnitude(form)))
        return 0;
    for (int i = 0; i < BEAM_N; i++)
        phi[i] = over(phi[i], form);
    return sign;
}

static void append(struct beam_poles *poles, struct complex_number p, const struct complex_number phi[BEAM_N], int sign)
{
    const int n = poles->n_complex + poles->n_real;
    poles->re[n] = p.re;
    poles->im[n] = p.im;
    poles->sign[n] = (beam_real)sign;
    for (int i = 0; i < BEAM_N; i++) {
        poles->shape_re[n][i] = phi[i].re;
        poles->shape_im[n][i] = phi[i].im;
    }
}

/* All poles from the start values, complex first; real ones with negative form one by one, the others together. */
static enum beam_status refine(struct beam_work *work, int n, const beam_real re[], const beam_real im[])
{
    struct complex_number phi[BEAM_N];
    int positive = 0;
    for (int k = 0; k < n; k++) {
        struct complex_number p = {re[k], im[k]};
        if (!beam_less(REAL_AXIS * magnitude(p), p.im))
            continue;
        if (polish(work, &p, phi, 12) == 0 || work->poles.n_complex == BEAM_N)
            return BEAM_ERROR_DEFECTIVE;
        append(&work->poles, p, phi, 1);
        work->poles.n_complex++;
    }
    for (int k = 0; k < n; k++) {
        struct complex_number p = {re[k], BEAM_K(0.0)};
        if (beam_less(REAL_AXIS * magnitude((struct complex_number){re[k], im[k]}), beam_fabs(im[k])))
            continue;
        const int sign = polish(work, &p, phi, 1);
        if (sign == 0)
            return BEAM_ERROR_DEFECTIVE;
        if (sign > 0) {
            positive++;
            continue;
        }
        p.re = re[k];
        if (polish(work, &p, phi, 12) != -1)
            return BEAM_ERROR_DEFECTIVE;
        append(&work->poles, p, phi, -1);
        work->poles.n_real++;
    }
    if (2 * work->poles.n_complex + work->poles.n_real + positive != n)
        return BEAM_ERROR_DEFECTIVE;
    return beam_real_poles(work, positive);
}

/* Σ φφᵀ = 0 (no velocity jumps without a force) and Σ p φφᵀ = 1 (Newton's law): no pole missing, none twice. */
static int complete(const struct beam_work *work)
{
    const struct beam_poles *poles = &work->poles;
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j <= i; j++) {
            beam_real sum = BEAM_K(0.0), moment = BEAM_K(0.0), size = BEAM_K(0.0);
            for (int k = 0; k < poles->n_complex + poles->n_real; k++) {
                const beam_real twice = k < poles->n_complex ? BEAM_K(2.0) : poles->sign[k];
                const beam_real *a = poles->shape_re[k], *b = poles->shape_im[k];
                const beam_real re = twice * (a[i] * a[j] - b[i] * b[j]), im = twice * (a[i] * b[j] + b[i] * a[j]);
                sum += re;
                size += beam_fabs(re) + beam_fabs(im);
                moment += poles->re[k] * re - poles->im[k] * im;
            }
            const beam_real error = beam_fabs(moment - (i == j ? BEAM_K(1.0) : BEAM_K(0.0)));
            if (!beam_less(error, COMPLETE) || !beam_less(beam_fabs(sum), COMPLETE * size + BEAM_EPSILON))
                return 0;
        }
    return 1;
}

/* Order within each group, refuse growth, and turn modal shapes into the model's basis. */
static enum beam_status finish(struct beam_work *work)
{
    struct beam_poles *poles = &work->poles;
    const int n = poles->n_complex + poles->n_real;
    for (int k = 0; k < n; k++) {
        const beam_real size = beam_sqrt(poles->re[k] * poles->re[k] + poles->im[k] * poles->im[k]);
        const beam_real rounding =
            BEAM_EPSILON * (BEAM_K(100.0) * size + BEAM_K(10.0) * work->modes.omega_radps[BEAM_N - 1]);
        if (beam_less(rounding, poles->re[k]))
            return BEAM_ERROR_UNSTABLE;
        if (beam_less(BEAM_K(0.0), poles->re[k]))
            poles->re[k] = BEAM_K(0.0);
        beam_real re[BEAM_N], im[BEAM_N];
        for (int i = 0; i < BEAM_N; i++) {
            re[i] = im[i] = BEAM_K(0.0);
            for (int j = 0; j < BEAM_N; j++) {
                re[i] += work->modes.shape[i][j] * poles->shape_re[k][j];
                im[i] += work->modes.shape[i][j] * poles->shape_im[k][j];
            }
        }
        for (int i = 0; i < BEAM_N; i++) {
            poles->shape_re[k][i] = re[i];
            poles->shape_im[k][i] = im[i];
        }
    }
    return BEAM_OK;
}

/* Ascending imaginary part of the complex, ascending real part of the real start values. */
static void sort_starts(int n, beam_real re[], beam_real im[])
{
    for (int i = 1; i < n; i++)
        for (int j = i; j > 0; j--) {
            const int later =
                beam_less(im[j], im[j - 1]) || (!beam_less(im[j - 1], im[j]) && beam_less(re[j], re[j - 1]));
            if (!later)
                break;
            const beam_real r = re[j], s = im[j];
            re[j] = re[j - 1];
            im[j] = im[j - 1];
            re[j - 1] = r;
            im[j - 1] = s;
        }
}

enum beam_status beam_find_poles(const struct beam_model *model, struct beam_work *work)
{
    beam_real re[BEAM_STATES], im[BEAM_STATES];
    enum beam_status status = beam_model_check(model);
    if (status == BEAM_OK)
        status = beam_find_modes(model, &work->modes);
    if (status == BEAM_OK)
        status = modal_forms(model, work);
    if (status != BEAM_OK)
        return status;
    const int n = 2 * BEAM_N + work->n_memory_states;
    work->poles.n_complex = work->poles.n_real = 0;
    first_order_form(work, n);
    if (beam_eigenvalues(n, work->a, re, im) != 0)
        return BEAM_ERROR_DEFECTIVE;
    for (int k = 0; k < n; k++) /* growth before anything else: its remedy is another than a defect's */
        if (beam_less(BEAM_K(1e-4) * beam_sqrt(re[k] * re[k] + im[k] * im[k]) +
                          GROWTH * work->modes.omega_radps[BEAM_N - 1],
                      re[k]))
            return BEAM_ERROR_UNSTABLE;
    sort_starts(n, re, im);
    status = refine(work, n, re, im);
    if (status != BEAM_OK)
        return status;
    if (!complete(work))
        return BEAM_ERROR_DEFECTIVE;
    return finish(work);
}
