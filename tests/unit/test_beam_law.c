/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laws in the step against a fourth-order Runge–Kutta integration of the same equations, written here. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "beam_case.h"
#include "beam_plan.h"

enum { OUT = BEAM_OUTPUTS, TIP = 3 };
static struct beam_case c;
static int law_calls;

/* ---- Effects of the test's own, so that the reference knows them exactly ---- */

static int at_the_tip(const double p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    out->points = BEAM_LAW_AT_POINT;
    out->at_m = place->length_m;
    return 0;
}

static int at_the_patch(const double p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_AT_PATCH;
    return 0;
}

static int over_the_span(const double p[], const struct beam_place *place, struct beam_law_place *out)
{
    (void)p;
    (void)place;
    out->points = BEAM_LAW_OVER_DEFLECTION;
    return 0;
}

/* p[0] w³ */
static int cubic(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    law_calls++;
    out->f[0] = p[0] * in->w[0] * in->w[0] * in->w[0];
    out->f_w[0][0] = 3.0 * p[0] * in->w[0] * in->w[0];
    return 0;
}

/* p[0] w */
static int spring(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    law_calls++;
    out->f[0] = p[0] * in->w[0];
    out->f_w[0][0] = p[0];
    return 0;
}

/* p[0] tanh(v/p[1]) */
static int friction(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const double t = tanh(in->v[0] / p[1]);
    law_calls++;
    out->f[0] = p[0] * t;
    out->f_v[0][0] = p[0] / p[1] * (1.0 - t * t);
    return 0;
}

/* p[0] (w − p[1]) beyond the gap */
static int stop(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    law_calls++;
    if (in->w[0] > p[1]) {
        out->f[0] = p[0] * (in->w[0] - p[1]);
        out->f_w[0][0] = p[0];
    }
    return 0;
}

/* Jenkins: spring p[0] behind a slider of strength p[1]; z is the slider's place. */
static int jenkins(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    const double trial = p[0] * (in->w[0] - in->z[0]);
    law_calls++;
    out->z[0] = in->z[0];
    out->f[0] = trial;
    out->f_w[0][0] = p[0];
    if (fabs(trial) > p[1]) {
        out->f[0] = trial > 0 ? p[1] : -p[1];
        out->f_w[0][0] = 0.0;
        out->z[0] = in->w[0] - out->f[0] / p[0];
    }
    return 0;
}

/* p[0] |v| v */
static int drag(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    law_calls++;
    out->f[0] = p[0] * fabs(in->v[0]) * in->v[0];
    out->f_v[0][0] = 2.0 * p[0] * fabs(in->v[0]);
    return 0;
}

static int out_of_range(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    (void)p;
    (void)in;
    (void)out;
    return -1;
}

/* A spring whose claimed tangent has the wrong sign: no Newton iteration converges on it. */
static int liar(const double p[], const struct beam_law_input *in, struct beam_law_output *out)
{
    law_calls++;
    out->f[0] = p[0] * in->w[0];
    out->f_w[0][0] = -p[0];
    return 0;
}

#define EFFECT(place, function)                                                                                        \
    {                                                                                                                  \
        .id = #function, .n_parameters = 0, .law_place = (place), .law = (function)                                    \
    }
static const struct beam_effect cubic_tip = EFFECT(at_the_tip, cubic), friction_patch = EFFECT(at_the_patch, friction),
                                stop_tip = EFFECT(at_the_tip, stop), jenkins_patch = EFFECT(at_the_patch, jenkins),
                                drag_span = EFFECT(over_the_span, drag), broken = EFFECT(at_the_tip, out_of_range),
                                lying = EFFECT(at_the_tip, liar), spring_tip = EFFECT(at_the_tip, spring);

/* ---- The reference ---- */

struct reference {
    long double a[CASE_STATES][CASE_STATES], b[CASE_STATES][BEAM_INPUTS], g[CASE_STATES][BEAM_PORTS];
    double z[BEAM_PORTS];
};
static struct reference ref;

static void make_reference(void)
{
    struct beam_model model = c.model;
    long double a[CASE_STATES][CASE_STATES], b[CASE_STATES][BEAM_INPUTS];
    case_first_order(&c.model, ref.a, ref.b);
    memset(ref.z, 0, sizeof ref.z);
    model.n_inputs = 1;
    for (int p = 0; p < c.model.n_ports; p++) { /* columns M⁻¹g, by letting the port be the input */
        memcpy(model.input[0].vector, c.model.port[p].vector, sizeof model.input[0].vector);
        case_first_order(&model, a, b);
        for (int i = 0; i < CASE_STATES; i++)
            ref.g[i][p] = b[i][0];
    }
}

/* Law forces at state x; the slider's place is kept as the one of the last whole step. */
static void forces(const long double x[CASE_STATES], double f[BEAM_PORTS], double z[BEAM_PORTS])
{
    for (int p = 0; p < c.model.n_ports; p++) {
        struct beam_law_input in = {.dt_s = 1.0};
        struct beam_law_output out = {.f = {0}};
        long double w = 0, v = 0;
        for (int i = 0; i < BEAM_N; i++) {
            w += c.model.port[p].vector[i] * x[i];
            v += c.model.port[p].vector[i] * x[BEAM_N + i];
        }
        in.w[0] = (double)w;
        in.v[0] = (double)v;
        in.z[0] = ref.z[p];
        c.model.use[c.model.port[p].use].effect->law(c.model.use[c.model.port[p].use].p, &in, &out);
        f[p] = c.model.port[p].weight * out.f[0];
        z[p] = out.z[0];
    }
}

static void rate(const long double x[CASE_STATES], double u, long double out[CASE_STATES])
{
    double f[BEAM_PORTS], z[BEAM_PORTS];
    forces(x, f, z);
    for (int i = 0; i < CASE_STATES; i++) {
        out[i] = ref.b[i][0] * u;
        for (int j = 0; j < CASE_STATES; j++)
            out[i] += ref.a[i][j] * x[j];
        for (int p = 0; p < c.model.n_ports; p++)
            out[i] -= ref.g[i][p] * f[p];
    }
}

static double excitation(double t_s, double newton)
{
    return newton * case_hit(t_s, 0.02, 200.0);
}

/* Tip deflection at k/rate_Hz, by RK4 with `fold` steps in between. */
static void integrate(int n, double rate_Hz, int fold, double newton, double *tip)
{
    long double x[CASE_STATES] = {0}, k1[CASE_STATES], k2[CASE_STATES], k3[CASE_STATES], k4[CASE_STATES],
                at[CASE_STATES];
    const double h = 1.0 / rate_Hz / fold;
    double f[BEAM_PORTS];
    make_reference();
    for (int k = 0; k < n; k++) {
        for (int s = 0; k > 0 && s < fold; s++) {
            const double t = (k - 1) / rate_Hz + s * h;
            rate(x, excitation(t, newton), k1);
            for (int i = 0; i < CASE_STATES; i++)
                at[i] = x[i] + h / 2 * k1[i];
            rate(at, excitation(t + h / 2, newton), k2);
            for (int i = 0; i < CASE_STATES; i++)
                at[i] = x[i] + h / 2 * k2[i];
            rate(at, excitation(t + h / 2, newton), k3);
            for (int i = 0; i < CASE_STATES; i++)
                at[i] = x[i] + h * k3[i];
            rate(at, excitation(t + h, newton), k4);
            for (int i = 0; i < CASE_STATES; i++)
                x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
            forces(x, f, ref.z);
        }
        tip[k] = 0;
        for (int i = 0; i < BEAM_N; i++)
            tip[k] += c.model.output[TIP].vector[i] * (double)x[i];
    }
}

/* Tip deflection from the library at fold × rate_Hz. */
static void step_through(int n, double rate_Hz, int fold, double newton, double *tip)
{
    double u[2] = {0}, y[OUT];
    case_build(&c, 1.0 / rate_Hz / fold, BEAM_HOLD_FIRST_ORDER);
    law_calls = 0;
    for (int k = 0; k <= (n - 1) * fold; k++) {
        u[0] = excitation(k / rate_Hz / fold, newton);
        assert_int_equal(beam_step(&c.plan, &c.state, u, y), BEAM_OK);
        if (k % fold == 0)
            tip[k / fold] = y[TIP];
    }
    assert_true(law_calls <= ((n - 1) * fold + 1) * c.plan.n.n_ports * c.plan.n.law_evaluations);
}

struct convergence {
    double linear;   /* how much the law changes the motion, relative to rms */
    double error[3]; /* at 4, 8, 16 steps a sample */
};

static struct convergence converge(const struct beam_effect *effect, double p0, double p1, double newton,
                                   double seconds)
{
    const double rate_Hz = 1024.0;
    const int n = (int)(seconds * rate_Hz);
    double *expected = calloc((size_t)n, sizeof *expected), *tip = calloc((size_t)n, sizeof *tip);
    struct convergence result;
    assert_true(expected && tip);
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.input[0].at_m = 0.3;
    step_through(n, rate_Hz, 8, newton, tip);
    case_add_effect(&c.description, effect, 0, p0, p1, 0);
    case_build(&c, 1.0 / rate_Hz, BEAM_HOLD_FIRST_ORDER);
    integrate(n, rate_Hz, 120, newton, expected);
    result.linear = case_rms_difference(n, tip, expected) / case_rms(n, expected);
    for (int pass = 0; pass < 3; pass++) {
        step_through(n, rate_Hz, 4 << pass, newton, tip);
        result.error[pass] = case_rms_difference(n, tip, expected) / case_rms(n, expected);
    }
    print_message("%s: changes the motion by %.2g of rms; error at 4, 8, 16 steps a sample %.2g %.2g %.2g\n",
                  effect->id, result.linear, result.error[0], result.error[1], result.error[2]);
    free(expected);
    free(tip);
    return result;
}

static void a_smooth_law_converges_with_order_two(void **state)
{
    (void)state;
    const struct convergence r = converge(&cubic_tip, 1e5, 0, 4.0, 0.25);
    assert_true(r.linear > 0.1);
    assert_true(r.error[1] < 1e-3);
    assert_true(r.error[0] / r.error[1] > 3.0 && r.error[1] / r.error[2] > 3.0);
}

static void drag_over_the_span_converges(void **state)
{
    (void)state;
    const struct convergence r = converge(&drag_span, 0.3, 0, 4.0, 0.25);
    assert_true(r.linear > 0.05);
    assert_true(r.error[1] < 1e-3 && r.error[2] < 0.5 * r.error[1]);
}

static void friction_stop_and_slider_converge(void **state)
{
    (void)state;
    struct convergence r = converge(&friction_patch, 0.01, 0.3, 1.0, 0.25);
    assert_true(r.linear > 0.02 && r.error[2] < 1e-3 && r.error[2] < 0.5 * r.error[0]);
    r = converge(&stop_tip, 2000.0, 1e-3, 1.0, 0.25);
    assert_true(r.linear > 0.1 && r.error[2] < 0.05 && r.error[2] < r.error[0]);
    r = converge(&jenkins_patch, 5.0, 0.005, 1.0, 0.25);
    assert_true(r.linear > 0.02 && r.error[2] < 0.02 && r.error[2] < r.error[0]);
}

/* Friction so steep that plain Newton jumps between the branches for ever. */
static void stiff_friction_is_solved_within_the_bound(void **state)
{
    double u[2] = {0}, y[OUT];
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, &friction_patch, 0, 0.05, 1e-6, 0);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    for (int k = 0; k < 2000; k++) {
        u[0] = excitation(k / 1024.0, 3.0);
        law_calls = 0;
        assert_int_equal(beam_step(&c.plan, &c.state, u, y), BEAM_OK);
        assert_true(law_calls <= 16);
    }
    assert_true(fabs(c.state.force[0]) <= 0.05);
}

static void a_law_only_takes_energy_where_it_is_passive(void **state)
{
    /* undamped beam, friction: the elastic plus kinetic energy of free motion never rises */
    double in[2] = {0}, y[OUT], y0[BEAM_N] = {0}, v0[BEAM_N] = {0}, last = INFINITY;
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.parameters.cDI_beam_sNm2 = c.description.parameters.cDI_patch_sNm2 = 0.0;
    c.description.parameters.gamma_sNpm2 = 0.0;
    case_add_effect(&c.description, &friction_patch, 0, 0.01, 0.05, 0);
    case_build(&c, 1.0 / 8192.0, BEAM_HOLD_FIRST_ORDER);
    for (int i = 0; i < BEAM_N; i++) /* mode 1 */
        y0[i] = 0.02 * c.work.modes.shape[i][0];
    beam_start(&c.model, &c.work, &c.plan, y0, v0, &c.state);
    for (int k = 0; k < 16384; k++) {
        assert_int_equal(beam_step(&c.plan, &c.state, in, y), BEAM_OK);
        /* Σ |2p ξ|² of the normalised pairs is the energy up to a constant: x̃ lacks half a step of the law's force */
        double energy = 0.0;
        for (int b = 0; b < BEAM_N; b++)
            energy += c.work.poles.im[b] * c.work.poles.im[b] * 2.0 / c.work.poles.im[b] *
                      (c.state.x[2 * b] * c.state.x[2 * b] + c.state.x[2 * b + 1] * c.state.x[2 * b + 1]);
        if (k % 1230 == 0) { /* about once a period of mode 1 */
            assert_true(energy < last);
            last = energy;
        }
    }
}

static void what_cannot_be_solved_is_said(void **state)
{
    double u[2] = {5.0, 0.0}, y[OUT];
    (void)state;
    c.description = case_description(BEAM_BASIS_PATCH);
    case_add_effect(&c.description, &broken, 0, 0, 0, 0);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    assert_int_equal(beam_step(&c.plan, &c.state, u, y), BEAM_ERROR_EFFECT_RANGE);
    c.description = case_description(BEAM_BASIS_PATCH);
    c.description.input[0].at_m = 0.4;
    case_add_effect(&c.description, &lying, 0, 1e6, 0, 0);
    case_build(&c, 1.0 / 1024.0, BEAM_HOLD_FIRST_ORDER);
    enum beam_status status = BEAM_OK;
    law_calls = 0;
    for (int k = 0; k < 10 && status == BEAM_OK; k++)
        status = beam_step(&c.plan, &c.state, u, y);
    assert_int_equal(status, BEAM_ERROR_SOLVE);
    assert_true(isfinite(y[0]) && law_calls <= 10 * 16);
}

/* Law coordinates hear the inputs as outputs do: a spring as a law is a spring in K, under every hold. */
static void a_linear_law_equals_a_stiffness_term(void **state)
{
    enum { N = 2048 };
    static double u[2 * N], by_law[OUT * N], by_term[OUT * N];
    const double rate_Hz = 16384.0;
    (void)state;
    for (int k = 0; k < N; k++)
        u[k] = excitation(k / rate_Hz, 1.0);
    for (int hold = 0; hold < 3; hold += 2) {
        c.description = case_description(BEAM_BASIS_PATCH);
        case_add_effect(&c.description, beam_effect_find("point_spring"), 0, 20.0, 0, beam_length());
        case_build(&c, 1.0 / rate_Hz, (enum beam_hold)hold);
        case_run(&c, N, u, by_term);
        c.description = case_description(BEAM_BASIS_PATCH);
        case_add_effect(&c.description, &spring_tip, 0, 20.0, 0, 0);
        case_build(&c, 1.0 / rate_Hz, (enum beam_hold)hold);
        case_run(&c, N, u, by_law);
        assert_int_equal(c.plan.n.latency, hold ? 19 : 0);
        for (int o = 0; o < OUT; o++)
            assert_true(case_rms_difference(N, by_law + o * N, by_term + o * N) <
                        (o == 1 ? 1e-3 : 1e-5) * case_rms(N, by_term + o * N));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_smooth_law_converges_with_order_two),
        cmocka_unit_test(drag_over_the_span_converges),
        cmocka_unit_test(friction_stop_and_slider_converge),
        cmocka_unit_test(stiff_friction_is_solved_within_the_bound),
        cmocka_unit_test(a_law_only_takes_energy_where_it_is_passive),
        cmocka_unit_test(what_cannot_be_solved_is_said),
        cmocka_unit_test(a_linear_law_equals_a_stiffness_term),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
