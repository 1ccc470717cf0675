/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Forces that are not linear, and stiffness that changes with time, as additions to ẋ. */
#include "truth_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double cube(double x)
{
    return x * x * x;
}

/* |x|ⁿ sign x */
static double odd_power(double x, double n)
{
    return copysign(pow(fabs(x), n), x);
}

/* Odd, slope 1 at 0, ±1 far away, by one of TRUTH_CURVES. */
double truth_curve(double curve, double x)
{
    switch ((int)curve) {
    case TRUTH_ROOT:
        return x / sqrt(1 + x * x);
    case TRUTH_ARCTANGENT:
        return 2 / TRUTH_PI * atan(TRUTH_PI / 2 * x);
    case TRUTH_CLIP:
        return fmax(-1, fmin(1, x));
    default:
        return tanh(x);
    }
}

static double curve_slope(double curve, double x)
{
    double c = cosh(fmin(fabs(x), 300));
    switch ((int)curve) {
    case TRUTH_ROOT:
        return 1 / (1 + x * x) / sqrt(1 + x * x);
    case TRUTH_ARCTANGENT:
        return 1 / (1 + TRUTH_PI * TRUTH_PI / 4 * x * x);
    case TRUTH_CLIP:
        return fabs(x) < 1 ? 1 : 0;
    default:
        return 1 / (c * c);
    }
}

/* max(w, 0) with a corner rounded over r: (w + √(w² + r²) − r)/2 */
static double opening(double w, double r)
{
    return r > 0 ? (w + sqrt(w * w + r * r) - r) / 2 : fmax(w, 0);
}

/* Force (or moment) against the coordinate w and its rate. */
static double law_force(const struct truth_law *law, double w, double rate, double delayed_rate)
{
    const double *p = law->p;
    switch (law->kind) {
    case TRUTH_CUBIC_STIFFNESS:
        return p[0] * odd_power(w, p[2]);
    case TRUTH_QUINTIC_SPRING:
        return p[0] * cube(w) * w * w;
    case TRUTH_PATCH_SOFTENING:
        return p[0] * odd_power(w, p[1]);
    case TRUTH_COULOMB_FRICTION:
        return p[0] * truth_curve(p[2], rate / p[1]);
    case TRUTH_BILINEAR_STIFFNESS:
        return -p[0] * opening(w, p[3]);
    case TRUTH_STOP_CONTACT:
        return w > p[1] ? p[0] * pow(w - p[1], p[3]) : 0;
    case TRUTH_TIP_MAGNET: { /* pulls outwards, strongest near the reach, gone far away */
        double r = w / p[1];
        return -p[0] * r / ((1 + r * r) * (1 + r * r));
    }
    case TRUTH_DELAYED_FEEDBACK:
        return p[0] * delayed_rate;
    default:
        return 0;
    }
}

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* ∂force/∂w and ∂force/∂ẇ */
static void law_tangent(const struct truth_law *law, double w, double rate, double *stiffness, double *damping)
{
    const double *p = law->p;
    *stiffness = *damping = 0;
    switch (law->kind) {
    case TRUTH_CUBIC_STIFFNESS:
        *stiffness = p[2] * p[0] * pow(fabs(w), p[2] - 1);
        break;
    case TRUTH_QUINTIC_SPRING:
        *stiffness = 5 * p[0] * w * w * w * w;
        break;
    case TRUTH_PATCH_SOFTENING:
        *stiffness = p[1] * p[0] * pow(fabs(w), p[1] - 1);
        break;
    case TRUTH_COULOMB_FRICTION:
        *damping = p[0] / p[1] * curve_slope(p[2], rate / p[1]);
        break;
    case TRUTH_BILINEAR_STIFFNESS:
        *stiffness = p[3] > 0 ? -p[0] / 2 * (1 + w / hypot(w, p[3])) : w > 0 ? -p[0] : 0;
        break;
    case TRUTH_STOP_CONTACT:
        *stiffness = w > p[1] ? p[3] * p[0] * pow(w - p[1], p[3] - 1) : 0;
        break;
    case TRUTH_TIP_MAGNET: {
        double r2 = w * w / (p[1] * p[1]);
        *stiffness = -p[0] / p[1] * (1 - 3 * r2) / cube(1 + r2);
        break;
    }
    default:
        break;
    }
}

/* ⟨c |ẏ|ⁿ sign ẏ, φ⟩, n = 2 unless bent */
static void drag_add(const struct truth_system *s, const double *v, double *vdot)
{
    double *force = truth_array(s->n_points);
    truth_multiply_add(s->n_points, s->n_modes, s->Y, v, force);
    for (size_t k = 0; k < s->n_points; k++)
        force[k] = -s->drag * s->weight[k] * odd_power(force[k], s->drag_power);
    truth_multiply_add_transposed(s->n_points, s->n_modes, s->Y, force, vdot);
    free(force);
}

/* out_k = ∫₀^{x_k} f dx from two Gauss values an element: f is the line through them */
static void integrate_from_root(const struct truth_system *s, const double *f, double *out)
{
    const double late = sqrt(3) / 6;
    double before = 0;
    for (size_t k = 0; k + 1 < s->n_points; k += 2) {
        double h = 2 * s->weight[k];
        out[k] = before + h * (f[k] / 4 + (0.25 - late) * f[k + 1]);
        out[k + 1] = before + h * ((0.25 + late) * f[k] + f[k + 1] / 4);
        before += h * (f[k] + f[k + 1]) / 2;
    }
}

/* Inextensible beam to third order: curvature² = y''²(1 + y'²), u = −½∫y'². Stiffness force
 * ⟨EI y'' y'², φ''⟩ + ⟨EI y''² y', φ'⟩; inertia force −∫ρ u_tt G_φ, G_φ = ∫₀ˣ y' φ', u_tt = −∫₀ˣ ẏ'² − Σ G_j v̇_j, so
 * (1 + κ∫ρ GᵀG) v̇ = v̇₀ − κ∫ρ G ∫₀ˣ ẏ'². */
static void rotation_add(const struct truth_system *s, const double *q, const double *v, double *vdot)
{
    size_t n = s->n_modes, K = s->n_points;
    double *slope = truth_array(K), *rate2 = truth_array(K), *fall = truth_array(K), *G = truth_array(K * n);
    double *column = truth_array(K), *integral = truth_array(K), *S = truth_array(n * n);
    for (size_t k = 0; k < K; k++) {
        double curvature = dot(n, s->ddY + k * n, q), rate = dot(n, s->dY + k * n, v);
        double scale = s->rotation * s->EI_point[k] * s->weight[k] * curvature;
        slope[k] = dot(n, s->dY + k * n, q);
        rate2[k] = rate * rate;
        for (size_t j = 0; j < n; j++)
            vdot[j] -= scale * slope[k] * (slope[k] * s->ddY[k * n + j] + curvature * s->dY[k * n + j]);
    }
    integrate_from_root(s, rate2, fall);
    for (size_t j = 0; j < n; j++) {
        for (size_t k = 0; k < K; k++)
            column[k] = slope[k] * s->dY[k * n + j];
        integrate_from_root(s, column, integral);
        for (size_t k = 0; k < K; k++)
            G[k * n + j] = integral[k];
        S[j * n + j] = 1;
    }
    for (size_t k = 0; k < K; k++) {
        double mass = s->rotation * s->rho_point[k] * s->weight[k];
        const double *g = G + k * n;
        for (size_t i = 0; i < n; i++) {
            vdot[i] -= mass * g[i] * fall[k];
            for (size_t j = i; j < n; j++)
                S[i * n + j] += mass * g[i] * g[j];
        }
    }
    truth_solve_spd(n, S, vdot);
    double *owned[] = {slope, rate2, fall, G, column, integral, S};
    for (size_t i = 0; i < sizeof owned / sizeof owned[0]; i++)
        free(owned[i]);
}

/* The part of the bending stiffness that has come or gone by now. */
static void bending_change_add(const struct truth_system *s, double t_s, const double *q, double *vdot)
{
    const double smooth_s = 5e-3;
    double time_s = fmax(t_s, 0);
    if (s->drift_ps != 0 && isfinite(s->settling_s))
        time_s = -s->settling_s * expm1(-time_s / s->settling_s);
    double share = s->drift_ps * time_s + s->step * (1 + tanh((t_s - s->step_at_s) / smooth_s)) / 2;
    for (size_t i = 0; i < s->n_modes; i++)
        vdot[i] -= share * dot(s->n_modes, s->K_bending + i * s->n_modes, q);
}

void truth_laws_add(const struct truth_system *s, double t_s, const double *x, const double *delayed,
                    const int *sliding, double *xdot)
{
    size_t n = s->n_modes;
    const double *v = x + n;
    double *q = truth_array(n), *vdot = xdot + n;
    for (size_t j = 0; j < n; j++)
        q[j] = x[j] / s->scale[j];
    for (size_t k = 0; k < s->n_laws; k++) {
        const struct truth_law *law = &s->law[k];
        double rate = dot(n, law->row, v), force;
        if (law->kind == TRUTH_MICROSLIP) { /* spring and slider: Ṁ = k ẇ while it sticks, M stays while it slides */
            force = fmin(fmax(x[law->state], -law->p[1]), law->p[1]);
            xdot[law->state] = sliding[k] ? 0 : law->p[0] * rate;
        } else {
            force = law_force(law, dot(n, law->row, q), rate, delayed[k]);
        }
        for (size_t j = 0; j < n; j++)
            vdot[j] -= law->row[j] * force;
    }
    if (s->K_bending)
        bending_change_add(s, t_s, q, vdot);
    if (s->drag != 0)
        drag_add(s, v, vdot);
    if (s->rotation != 0)
        rotation_add(s, q, v, vdot);
    free(q);
}

void truth_laws_tangent(const struct truth_system *s, const double *x, const int *sliding, double *J)
{
    size_t n = s->n_modes, N = s->n_states;
    for (size_t k = 0; k < s->n_laws; k++) {
        const struct truth_law *law = &s->law[k];
        double w = 0, stiffness, damping;
        for (size_t j = 0; j < n; j++)
            w += law->row[j] * x[j] / s->scale[j];
        law_tangent(law, w, dot(n, law->row, x + n), &stiffness, &damping);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                J[(n + i) * N + j] -= law->row[i] * stiffness * law->row[j] / s->scale[j];
                J[(n + i) * N + n + j] -= law->row[i] * damping * law->row[j];
            }
        for (size_t j = 0; law->kind == TRUTH_MICROSLIP && j < n; j++) {
            J[(n + j) * N + law->state] -= law->row[j];
            J[law->state * N + n + j] += sliding[k] ? 0 : law->p[0] * law->row[j];
        }
    }
}
