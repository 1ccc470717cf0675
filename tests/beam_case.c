/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"

struct beam_description case_description(enum beam_basis basis)
{
    const struct beam_description d = {
        .basis = basis,
        .parameters = {.EI_beam_Nm2 = 0.491,
                       .EI_patch_Nm2 = 0.793,
                       .rho_beam_kgpm = 0.093,
                       .rho_patch_kgpm = 0.433,
                       .cDI_beam_sNm2 = 0.649e-5,
                       .cDI_patch_sNm2 = 1.255e-5,
                       .gamma_sNpm2 = 0.013,
                       .Ks_V = 4682.342,
                       .KB_NmpV = 1.746e-2},
        .n_inputs = 2,
        .n_outputs = 4,
        .input = {{.kind = BEAM_INPUT_POINT_FORCE, .at_m = 0.0254}, {.kind = BEAM_INPUT_PATCH_MOMENT}},
        .output = {{.kind = BEAM_OUTPUT_PATCH_STRAIN},
                   {.kind = BEAM_OUTPUT_ACCELERATION, .at_m = 0.0214},
                   {.kind = BEAM_OUTPUT_VELOCITY, .at_m = 0.44},
                   {.kind = BEAM_OUTPUT_DISPLACEMENT, .at_m = 0.44}},
    };
    return d;
}

void case_add_effect(struct beam_description *d, const struct beam_effect *effect, unsigned channels, double p0,
                     double p1, double p2)
{
    assert_non_null(effect);
    assert_true(d->n_uses < BEAM_USES);
    struct beam_use *use = &d->use[d->n_uses++];
    use->effect = effect;
    use->channels = channels;
    use->p[0] = p0;
    use->p[1] = p1;
    use->p[2] = p2;
}

void case_build(struct beam_case *c, double dt_s, enum beam_hold hold)
{
    c->options.dt_s = dt_s;
    c->options.hold = hold;
    assert_int_equal(beam_assemble(&c->description, &c->model), BEAM_OK);
    assert_int_equal(beam_factor(&c->model, &c->options, &c->work, &c->plan), BEAM_OK);
    assert_int_equal(beam_plan_check(&c->plan), BEAM_OK);
    beam_reset(&c->plan, &c->state);
}

void case_run(struct beam_case *c, int n, const double *u, double *y)
{
    double in[BEAM_INPUTS], out[BEAM_OUTPUTS];
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < c->plan.n.n_inputs; i++)
            in[i] = u[i * n + k];
        assert_int_equal(beam_step(&c->plan, &c->state, in, out), BEAM_OK);
        for (int o = 0; o < c->plan.n.n_outputs; o++)
            y[o * n + k] = out[o];
    }
}

static void multiply(int n, const long double *a, const long double *b, long double *out)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            long double sum = 0;
            for (int k = 0; k < n; k++)
                sum += a[i * n + k] * b[k * n + j];
            out[i * n + j] = sum;
        }
}

void case_expm(int n, const long double *a, long double *out)
{
    const size_t size = (size_t)(n * n) * sizeof(long double);
    long double *scaled = malloc(size), *term = malloc(size), *next = malloc(size), norm = 0;
    assert_true(scaled && term && next);
    int halvings = 0;
    for (int i = 0; i < n; i++) {
        long double row = 0;
        for (int j = 0; j < n; j++)
            row += fabsl(a[i * n + j]);
        norm = row > norm ? row : norm;
    }
    while (norm > 0.25L) {
        norm /= 2;
        halvings++;
    }
    for (int i = 0; i < n * n; i++) {
        scaled[i] = ldexpl(a[i], -halvings);
        out[i] = term[i] = i % (n + 1) == 0 ? 1 : 0;
    }
    for (int k = 1; k < 24; k++) {
        multiply(n, term, scaled, next);
        for (int i = 0; i < n * n; i++) {
            term[i] = next[i] / k;
            out[i] += term[i];
        }
    }
    for (; halvings > 0; halvings--) {
        multiply(n, out, out, next);
        memcpy(out, next, size);
    }
    free(scaled);
    free(term);
    free(next);
}

/* x ← M⁻¹ x */
static void solve_mass(const struct beam_model *model, long double x[BEAM_N])
{
    long double m[BEAM_N][BEAM_N];
    for (int i = 0; i < BEAM_N; i++)
        for (int j = 0; j < BEAM_N; j++)
            m[i][j] = model->M[i][j];
    for (int j = 0; j < BEAM_N; j++)
        for (int i = j + 1; i < BEAM_N; i++) {
            const long double f = m[i][j] / m[j][j];
            for (int k = j; k < BEAM_N; k++)
                m[i][k] -= f * m[j][k];
            x[i] -= f * x[j];
        }
    for (int i = BEAM_N - 1; i >= 0; i--) {
        for (int k = i + 1; k < BEAM_N; k++)
            x[i] -= m[i][k] * x[k];
        x[i] /= m[i][i];
    }
}

void case_first_order(const struct beam_model *model, long double a[CASE_STATES][CASE_STATES],
                      long double b[CASE_STATES][BEAM_INPUTS])
{
    long double x[BEAM_N];
    memset(a, 0, sizeof(long double) * CASE_STATES * CASE_STATES);
    memset(b, 0, sizeof(long double) * CASE_STATES * BEAM_INPUTS);
    for (int j = 0; j < BEAM_N; j++) {
        a[j][BEAM_N + j] = 1;
        for (int part = 0; part < 2; part++) {
            for (int i = 0; i < BEAM_N; i++)
                x[i] = part == 0 ? model->K[i][j] : model->C[i][j];
            solve_mass(model, x);
            for (int i = 0; i < BEAM_N; i++)
                a[BEAM_N + i][part * BEAM_N + j] = -x[i];
        }
    }
    for (int k = 0; k < model->n_inputs; k++) {
        for (int i = 0; i < BEAM_N; i++)
            x[i] = model->input[k].vector[i];
        solve_mass(model, x);
        for (int i = 0; i < BEAM_N; i++)
            b[BEAM_N + i][k] = x[i];
    }
}

static double output_of(const struct beam_model *model, int o, const long double x[CASE_STATES],
                        const long double rate[CASE_STATES])
{
    const enum beam_output_kind kind = model->output[o].kind;
    const long double *part = kind == BEAM_OUTPUT_ACCELERATION ? rate + BEAM_N
                              : kind == BEAM_OUTPUT_VELOCITY   ? x + BEAM_N
                                                               : x;
    long double sum = 0;
    for (int i = 0; i < BEAM_N; i++)
        sum += model->output[o].vector[i] * part[i];
    return (double)sum;
}

void case_reference(const struct beam_model *model, double dt_s, int held, int n, const double *u, const double *x0,
                    double *y)
{
    static long double a[CASE_STATES][CASE_STATES], b[CASE_STATES][BEAM_INPUTS];
    enum { SIZE = CASE_STATES + 2 * BEAM_INPUTS };
    static long double big[SIZE * SIZE], e[SIZE * SIZE];
    long double x[CASE_STATES] = {0}, next[CASE_STATES], rate[CASE_STATES];
    case_first_order(model, a, b);
    memset(big, 0, sizeof big);
    for (int i = 0; i < CASE_STATES; i++) {
        for (int j = 0; j < CASE_STATES; j++)
            big[i * SIZE + j] = a[i][j] * dt_s;
        for (int k = 0; k < BEAM_INPUTS; k++)
            big[i * SIZE + CASE_STATES + k] = b[i][k] * dt_s;
    }
    for (int k = 0; k < BEAM_INPUTS; k++) /* u̇ Δt */
        big[(CASE_STATES + k) * SIZE + CASE_STATES + BEAM_INPUTS + k] = 1;
    case_expm(SIZE, big, e);
    for (int i = 0; x0 && i < CASE_STATES; i++)
        x[i] = x0[i];
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < CASE_STATES; i++) {
            next[i] = 0;
            for (int j = 0; j < CASE_STATES; j++)
                next[i] += e[i * SIZE + j] * x[j];
            for (int q = 0; q < model->n_inputs; q++) { /* from sample k − 1 (0 before the first) to sample k */
                const double before = k > 0 ? u[q * n + k - 1] : 0.0, now = u[q * n + k];
                next[i] += e[i * SIZE + CASE_STATES + q] * before;
                if (!held)
                    next[i] += e[i * SIZE + CASE_STATES + BEAM_INPUTS + q] * (now - before);
            }
        }
        memcpy(x, next, sizeof x);
        for (int i = 0; i < CASE_STATES; i++) {
            rate[i] = 0;
            for (int j = 0; j < CASE_STATES; j++)
                rate[i] += a[i][j] * x[j];
            for (int q = 0; q < model->n_inputs; q++)
                rate[i] += b[i][q] * u[q * n + k];
        }
        for (int o = 0; o < model->n_outputs; o++)
            y[o * n + k] = output_of(model, o, x, rate);
    }
}

void case_close(double a, double b, double tolerance, const char *file, int line)
{
    if (fabs(a - b) <= tolerance)
        return;
    print_error("%.17g is not %.17g within %g: off by %g\n", a, b, tolerance, a - b);
    _fail(file, line);
}

double case_rms(int n, const double *x)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / n);
}

double case_rms_difference(int n, const double *x, const double *y)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum / n);
}

double case_hit(double t_s, double t0_s, double band_Hz)
{
    const double width = sqrt(2.0 * log(1e6)) / (2.0 * acos(-1.0) * band_Hz), x = (t_s - t0_s) / width;
    return exp(-0.5 * x * x);
}

double case_random(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / 8388607.5 - 1.0;
}
