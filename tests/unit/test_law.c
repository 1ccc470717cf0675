/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Nonlinear forces on their contact coordinates, and records with them against a Runge–Kutta simulation. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "response/response.h"
#include "predict_case.h"
#include "response/predictor.h"
#include "signals.h"
#include "state_space.h"

enum { SAMPLES = 256, CHANNELS = 3, FINE = 64, SPAN_POINTS = 401 };
static const double dt_s = 1.0 / 1024.0;

static void open_case(struct predict_case *c, const char *effects, size_t n, double level_N, int oversample)
{
    struct predict_options options = {.fine_splines = 40, .modes = 6, .oversample = oversample, .threads = 1};
    struct bf_error err;
    *c = (struct predict_case){.record = case_record("case.csv", n, dt_s, level_N, true)};
    fixture_model(&c->model, effects);
    if (case_open(c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
}

/* ---- One law at one instant ---- */

struct instant {
    double w[LAW_COORDINATES], v[LAW_COORDINATES], w_old[LAW_COORDINATES], a[LAW_COORDINATES];
};

static void evaluate(const struct predict_case *c, const struct instant *at, const double theta[],
                     struct law_force *out)
{
    const double z[BEAM_LAW_STATES] = {0};
    struct law_motion motion = {
        .w = at->w, .v = at->v, .w_old = at->w_old, .a = at->a, .z = z, .t_s = 0.1, .dt_s = 1e-4};
    struct law_prepared prepared;
    memset(out, 0, sizeof *out);
    law_prepare(&c->predictor->laws[0], &c->predictor->map, theta, &prepared);
    assert_int_equal(law_force(&prepared, &motion, true, true, out), 0);
    law_prepared_free(&prepared);
}

static double *entry(struct instant *at, int which, size_t j)
{
    return which == 0 ? &at->w[j] : which == 1 ? &at->v[j] : &at->w_old[j];
}

static void check_tangents(const struct predict_case *c, struct instant at, double step)
{
    const struct law *law = &c->predictor->laws[0];
    struct law_force middle, up, down;
    evaluate(c, &at, c->theta, &middle);
    double size = 0.0;
    for (size_t i = 0; i < law->d; i++)
        size = fmax(size, fabs(middle.f[i]));
    assert_true(size > 0.0);
    for (int which = 0; which < 3; which++) {
        const double *tangent = which == 0 ? middle.by_w : which == 1 ? middle.by_v : middle.by_w_old;
        for (size_t j = 0; j < law->d; j++) {
            double *x = entry(&at, which, j), keep = *x, h = step * fabs(keep);
            *x = keep + h;
            evaluate(c, &at, c->theta, &up);
            *x = keep - h;
            evaluate(c, &at, c->theta, &down);
            *x = keep;
            for (size_t i = 0; i < law->d; i++)
                assert_true(fabs(tangent[i * law->d + j] - (up.f[i] - down.f[i]) / (2.0 * h)) <=
                            1e-5 * size / fabs(keep));
        }
    }
    for (size_t d = 0; d < law->n_dependencies; d++) {
        size_t p = law->dependency[d];
        double keep = c->theta[p], h = 1e-4 * keep;
        c->theta[p] = keep + h;
        evaluate(c, &at, c->theta, &up);
        c->theta[p] = keep - h;
        evaluate(c, &at, c->theta, &down);
        c->theta[p] = keep;
        for (size_t i = 0; i < law->d; i++)
            assert_true(fabs(middle.by_parameter[d][i] - (up.f[i] - down.f[i]) / (2.0 * h)) <=
                        1e-6 * size / fabs(keep));
    }
}

static void tangents_match_differences(void **state)
{
    (void)state;
    static const char *const effects[] = {
        "  - {kind: cubic_stiffness, coefficient_Npm3: 500, at_m: 0.4}\n",
        "  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.1}\n",
        "  - {kind: large_rotation, scale: 1}\n",
        "  - {kind: patch_softening}\n",
        "  - {kind: coulomb_friction}\n",
    };
    for (size_t e = 0; e < sizeof effects / sizeof *effects; e++) {
        struct predict_case c;
        struct instant at;
        open_case(&c, effects[e], SAMPLES, 1.0, 0);
        for (size_t j = 0; j < LAW_COORDINATES; j++) {
            at.w[j] = 1e-3 * cos(1.0 + (double)j) / (1.0 + (double)(j * j));
            at.v[j] = 1e-2 * sin(2.0 + 3.0 * (double)j) / (1.0 + (double)(j * j));
            at.w_old[j] = 0.9 * at.w[j];
            at.a[j] = -1e2 * at.w[j];
        }
        assert_true(c.predictor->laws[0].d >= 1);
        check_tangents(&c, at, 1e-5);
        case_close(&c);
    }
}

/* Drag over the span: f_j = ∫ c |y_t| y_t ψ_j dx by Simpson's rule on 400 pieces. */
static void span_law_is_an_integral(void **state)
{
    (void)state;
    struct predict_case c;
    struct instant at = {.v = {0.3, 0.02, -0.01}};
    struct law_force force;
    open_case(&c, "  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.7}\n", SAMPLES, 1.0, 0);
    const struct reduced *r = &c.predictor->reduced;
    size_t d = c.predictor->laws[0].d;
    double *g = bf_alloc(r->n, sizeof *g), exact[LAW_COORDINATES] = {0}, h = c.model.length_m / (SPAN_POINTS - 1);
    evaluate(&c, &at, c.theta, &force);
    for (int k = 0; k < SPAN_POINTS; k++) {
        double v = 0.0, weight = (k == 0 || k == SPAN_POINTS - 1 ? 1.0 : k % 2 ? 4.0 : 2.0) * h / 3.0;
        reduced_point(r, 0, h * k, g);
        for (size_t j = 0; j < d; j++)
            v += g[j] * at.v[j];
        for (size_t j = 0; j < d; j++)
            exact[j] += weight * 0.7 * fabs(v) * v * g[j];
    }
    for (size_t j = 0; j < d; j++)
        assert_true(fabs(force.f[j] - exact[j]) < 1e-4 * fabs(exact[0]));
    double power = 0.0; /* by virtual work, drag takes ∫ c |v|³ */
    for (size_t j = 0; j < d; j++)
        power += force.f[j] * at.v[j];
    assert_true(power > 0.0);
    free(g);
    case_close(&c);
}

/* ---- Records ---- */

/* Modes below 3 kHz, Runge and Kutta's fourth order; the law as a function of the deflections at points. */
struct simulation {
    struct state_space space;
    size_t n, n_points; /* modes kept; points */
    double *b, *o, *g;  /* input, [CHANNELS] outputs, [n_points] points; rows of n */
    double *weight;     /* [n_points] */
    double cubic, drag; /* force k w³ + c |v| v at each point */
};

static struct simulation simulation_new(const struct predict_case *c, const double x_m[], const double weight[],
                                        size_t n_points)
{
    const struct predictor *p = c->predictor;
    const struct system *s = p->system;
    struct simulation m = {.space = state_space_new(s->n, s->M, s->C, s->K), .n_points = n_points};
    size_t rows = 1 + CHANNELS + n_points;
    double *g = bf_alloc(s->n, sizeof *g), *modal = bf_alloc(s->n * rows, sizeof *modal);
    while (m.n < s->n && m.space.omega[m.n] < 2e4)
        m.n++;
    m.b = bf_alloc(m.n * rows + n_points, sizeof(double));
    m.o = m.b + m.n;
    m.g = m.o + CHANNELS * m.n;
    m.weight = m.g + n_points * m.n;
    memcpy(m.weight, weight, n_points * sizeof *weight);
    for (size_t row = 0; row < rows; row++) {
        memcpy(g, row == 0 ? p->inputs[0].g : row <= CHANNELS ? p->outputs[row - 1].g : g, s->n * sizeof *g);
        if (row > CHANNELS)
            reduced_point(&p->reduced, 0, x_m[row - 1 - CHANNELS], g);
        state_space_functional(&m.space, g, modal);
        memcpy(m.b + row * m.n, modal, m.n * sizeof *modal);
    }
    free(g);
    free(modal);
    return m;
}

static void simulation_free(struct simulation *m)
{
    state_space_free(&m->space);
    free(m->b);
}

/* z = (q, q'), dz = (q', q″). */
static void slope(const struct simulation *m, double u, const double z[], double dz[])
{
    size_t n = m->n, all = m->space.n;
    for (size_t k = 0; k < n; k++) {
        dz[k] = z[n + k];
        dz[n + k] = m->b[k] * u - m->space.omega[k] * m->space.omega[k] * z[k];
        for (size_t j = 0; j < n; j++)
            dz[n + k] -= m->space.damping[k + j * all] * z[n + j];
    }
    for (size_t i = 0; i < m->n_points; i++) {
        double w = 0.0, v = 0.0;
        for (size_t k = 0; k < n; k++) {
            w += m->g[i * n + k] * z[k];
            v += m->g[i * n + k] * z[n + k];
        }
        double f = m->weight[i] * (m->cubic * w * w * w + m->drag * fabs(v) * v);
        for (size_t k = 0; k < n; k++)
            dz[n + k] -= m->g[i * n + k] * f;
    }
}

/* Deflection for the patch (times Ks), velocity at the tip; hammer alone. */
static void simulate(const struct simulation *m, double level_N, double Ks, double y[2 * SAMPLES])
{
    size_t d = 2 * m->n;
    double *z = bf_alloc(6 * d, sizeof *z), *k[4] = {z + d, z + 2 * d, z + 3 * d, z + 4 * d}, *x = z + 5 * d;
    double h = dt_s / FINE;
    static const double part[4] = {0.0, 0.5, 0.5, 1.0};
    for (size_t step = 0; step < (size_t)SAMPLES * FINE; step++) {
        if (step % FINE == 0) {
            y[step / FINE] = y[SAMPLES + step / FINE] = 0.0;
            for (size_t i = 0; i < m->n; i++) {
                y[step / FINE] += Ks * m->o[i] * z[i];
                y[SAMPLES + step / FINE] += m->o[2 * m->n + i] * z[m->n + i];
            }
        }
        for (int stage = 0; stage < 4; stage++) {
            for (size_t i = 0; i < d; i++)
                x[i] = z[i] + (stage > 0 ? part[stage] * h * k[stage - 1][i] : 0.0);
            slope(m, case_hammer(((double)step + part[stage]) * h, level_N), x, k[stage]);
        }
        for (size_t i = 0; i < d; i++)
            z[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    }
    free(z);
}

/*
 * What the law changes, in the prediction and in the simulation: what modes above 3 kHz do to the linear response is no
 * matter of the law and drops out of the difference. Relative to the rms of the whole signal.
 */
static void compare_change(struct predict_case *c, struct simulation *m, double level_N, const char *strength)
{
    static double linear[2 * SAMPLES], bent[2 * SAMPLES], y[CHANNELS * SAMPLES];
    size_t p = case_index(c, strength), channel[2] = {0, 2};
    double keep = c->theta[p], Ks = c->theta[case_index(c, "Ks_V")];
    simulate(m, level_N, Ks, bent);
    m->cubic = m->drag = 0.0;
    simulate(m, level_N, Ks, linear);
    case_run(c, NULL);
    memcpy(y, c->out.y, sizeof y);
    c->theta[p] = 0.0;
    case_run(c, NULL);
    c->theta[p] = keep;
    for (int i = 0; i < 2; i++) {
        double error = 0.0, change = 0.0, size = signal_rms(bent + i * SAMPLES, SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++) {
            double simulated = bent[i * SAMPLES + (int)k] - linear[i * SAMPLES + (int)k];
            double predicted = y[channel[i] * SAMPLES + k] - c->out.y[channel[i] * SAMPLES + k];
            error += (simulated - predicted) * (simulated - predicted) / SAMPLES;
            change += simulated * simulated / SAMPLES;
        }
        print_message("  %s: the law changes %.2g, error %.2g of rms\n", c->model.outputs[channel[i]].name,
                      sqrt(change) / size, sqrt(error) / size);
        assert_true(sqrt(change) > 0.05 * size);
        assert_true(sqrt(error) < 1e-4 * size);
    }
}

static void hammer_only(struct predict_case *c)
{
    struct bf_error err;
    struct predict_options options = {.fine_splines = 40, .modes = 6, .oversample = 16, .threads = 1};
    memset(c->record.columns[1].x, 0, c->record.n * sizeof(double));
    predictor_free(c->predictor);
    c->predictor = NULL;
    assert_int_equal(predictor_new(&c->model, &c->record, 1, &options, &c->predictor, &err), BF_OK);
}

static void cubic_spring_is_the_simulation(void **state)
{
    (void)state;
    struct predict_case c;
    const double tip = 0.4573, one = 1.0;
    open_case(&c, "  - {kind: cubic_stiffness, coefficient_Npm3: 1e7, at_m: 0.4573}\n", SAMPLES, 4.0, 16);
    hammer_only(&c);
    struct simulation m = simulation_new(&c, &tip, &one, 1);
    m.cubic = 1e7;
    compare_change(&c, &m, 4.0, "coefficient_Npm3");
    simulation_free(&m);
    case_close(&c);
}

static void quadratic_drag_is_the_simulation(void **state)
{
    (void)state;
    enum { PIECES = 60 };
    struct predict_case c;
    double x[PIECES + 1], w[PIECES + 1];
    open_case(&c, "  - {kind: quadratic_drag, coefficient_Ns2pm3: 3}\n", SAMPLES, 4.0, 16);
    hammer_only(&c);
    for (int k = 0; k <= PIECES; k++) {
        x[k] = c.model.length_m * k / PIECES;
        w[k] = (k == 0 || k == PIECES ? 1.0 : k % 2 ? 4.0 : 2.0) * c.model.length_m / PIECES / 3.0;
    }
    struct simulation m = simulation_new(&c, x, w, PIECES + 1);
    m.drag = 3.0;
    compare_change(&c, &m, 4.0, "coefficient_Ns2pm3");
    simulation_free(&m);
    case_close(&c);
}

/* Errors of steps of dt/4 and dt/8 against dt/64. At the very end the force is cut: first order, and left out here. */
static void steps_converge_with_order_two(void **state)
{
    (void)state;
    static const int oversample[3] = {4, 8, 64};
    static double y[3][SAMPLES];
    for (int i = 0; i < 3; i++) {
        struct predict_case c;
        open_case(&c, "  - {kind: cubic_stiffness, coefficient_Npm3: 1e7, at_m: 0.4573}\n", SAMPLES, 4.0,
                  oversample[i]);
        case_run(&c, NULL);
        memcpy(y[i], c.out.y + 2 * SAMPLES, sizeof y[i]);
        case_close(&c);
    }
    double error[2] = {0.0, 0.0};
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k + 4 < SAMPLES; k++)
            error[i] = fmax(error[i], fabs(y[i][k] - y[2][k]));
    double order = log2(error[0] / error[1]);
    if (order < 1.8)
        fail_msg("order %.2f", order);
}

/* A patch so lossy that modes do not swing: of each such pair of real poles one is slow and one far beyond the grid, and the law feels both. */
static void assert_steps_agree_on_an_overdamped_patch(const char *law, int usual)
{
    const int oversample[2] = {usual, 64};
    static double y[2][SAMPLES];
    for (double lossy = 30.0; lossy < 1000.0; lossy *= 1.3) {
        for (int i = 0; i < 2; i++) {
            struct predict_case c;
            open_case(&c, law, SAMPLES, 4.0, oversample[i]);
            c.theta[case_index(&c, "cDI_patch_sNm2")] *= lossy;
            case_run(&c, NULL);
            memcpy(y[i], c.out.y + 2 * SAMPLES, sizeof y[i]);
            case_close(&c);
        }
        double error = 0.0;
        for (size_t k = 0; k < SAMPLES; k++)
            error = fmax(error, fabs(y[0][k] - y[1][k]));
        if (!(error < 0.005 * signal_rms(y[1], SAMPLES)))
            fail_msg("%s, cDI_patch times %g: off by %.2g of the rms", law, lossy, error / signal_rms(y[1], SAMPLES));
    }
}

static void steps_agree_on_an_overdamped_patch(void **state)
{
    (void)state;
    assert_steps_agree_on_an_overdamped_patch("  - {kind: coulomb_friction, moment_Nm: 1e-3, velocity_radps: 1e-3}\n",
                                              8);
    assert_steps_agree_on_an_overdamped_patch("  - {kind: quadratic_drag, coefficient_Ns2pm3: 3}\n", 4);
    assert_steps_agree_on_an_overdamped_patch("  - {kind: patch_softening}\n", 8);
}

/* A beam that hardly damps, thrown against a stiff stop: no touch may give it energy. */
static void contact_gives_no_energy(void **state)
{
    (void)state;
    enum { LONG = 1536, QUARTER = LONG / 4 };
    struct predict_case c;
    open_case(&c, "  - {kind: stop_contact, stiffness_Npm: 2e4, gap_m: 1e-4, at_m: 0.4573}\n", LONG, 4.0, 16);
    memset(c.record.columns[1].x, 0, LONG * sizeof(double));
    predictor_free(c.predictor);
    struct bf_error err;
    struct predict_options options = {.fine_splines = 40, .modes = 6, .oversample = 16, .threads = 1};
    assert_int_equal(predictor_new(&c.model, &c.record, 1, &options, &c.predictor, &err), BF_OK);
    c.theta[case_index(&c, "gamma_sNpm2")] *= 0.01;
    case_run(&c, NULL);
    const double *tip = c.out.y + 2 * LONG, *strain = c.out.y;
    static double y[2 * LONG];
    memcpy(y, c.out.y, LONG * sizeof *y);
    memcpy(y + LONG, tip, LONG * sizeof *y);
    for (int quarter = 1; quarter < 4; quarter++) {
        assert_true(signal_rms(tip + quarter * QUARTER, QUARTER) < 1.02 * signal_rms(tip, QUARTER));
        assert_true(signal_rms(strain + quarter * QUARTER, QUARTER) < 1.2 * signal_rms(strain, QUARTER));
    }
    c.theta[case_index(&c, "stiffness_Npm")] = 0.0; /* and it did touch */
    case_run(&c, NULL);
    double change = 0.0;
    for (size_t k = 0; k < LONG; k++)
        change = fmax(change, fabs(y[k] - c.out.y[k]));
    assert_true(change > 0.1 * signal_rms(y, LONG));
    case_close(&c);
}

/* A free decay whose state is not known yet is that of the beam without its laws: nothing to step, and linear columns. */
static void free_decay_at_rest_is_linear(void **state)
{
    (void)state;
    double *columns[2];
    for (int with = 0; with < 2; with++) {
        struct predict_case c = {.record = case_record("case.csv", SAMPLES, dt_s, 1.0, false)};
        struct bf_error err;
        fixture_model(&c.model, with ? "  - {kind: cubic_stiffness}\n" : "");
        if (case_open(&c, NULL, &err) != BF_OK)
            fail_msg("%s", err.text);
        case_run(&c, NULL);
        assert_true(c.out.n_nuisance > 0);
        assert_int_equal(c.out.bends, with == 1);
        columns[with] = bf_alloc(c.out.n_nuisance * c.out.n_rows, sizeof(double));
        memcpy(columns[with], c.out.nuisance, c.out.n_nuisance * c.out.n_rows * sizeof(double));
        double difference = 0.0, size = 0.0;
        for (size_t k = 0; with && k < c.out.n_nuisance * c.out.n_rows; k++) {
            /* the modes of two predictors may have other signs */
            difference = fmax(difference, fabs(fabs(columns[1][k]) - fabs(columns[0][k])));
            size = fmax(size, fabs(columns[0][k]));
        }
        if (difference > 1e-6 * size) /* the reduced space of a law has another vector */
            fail_msg("off by %.1e of the largest", difference / size);
        case_close(&c);
    }
    free(columns[0]);
    free(columns[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tangents_match_differences),     cmocka_unit_test(span_law_is_an_integral),
        cmocka_unit_test(cubic_spring_is_the_simulation), cmocka_unit_test(quadratic_drag_is_the_simulation),
        cmocka_unit_test(steps_converge_with_order_two),  cmocka_unit_test(contact_gives_no_energy),
        cmocka_unit_test(free_decay_at_rest_is_linear),   cmocka_unit_test(steps_agree_on_an_overdamped_patch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
