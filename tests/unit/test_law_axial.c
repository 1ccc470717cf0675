/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The inertia of a beam that large rotation shortens: against its kinetic energy, with differences, and in a record. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "response/response.h"
#include "response/law.h"
#include "predict_case.h"
#include "response/predictor.h"

enum { SAMPLES = 256, PIECES = 2000 };
static const double dt_s = 1.0 / 1024.0;

static void open_case(struct predict_case *c, const char *effects, double level_N, int oversample)
{
    struct predict_options options = {.fine_splines = 160, .modes = 6, .oversample = oversample, .threads = 1};
    struct bf_error err;
    *c = (struct predict_case){.record = case_record("case.csv", SAMPLES, dt_s, level_N, true)};
    fixture_model(&c->model, effects);
    if (case_open(c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
}

/* The stiffness that large rotation adds is switched off: what is left of the law is the inertia. */
static void without_stiffness(struct predict_case *c)
{
    c->theta[case_index(c, "EI_beam_Nm2")] = c->theta[case_index(c, "EI_patch_Nm2")] = 0.0;
}

struct instant {
    double w[LAW_COORDINATES], v[LAW_COORDINATES], a[LAW_COORDINATES];
};

static void evaluate(const struct predict_case *c, const struct instant *at, struct law_force *out)
{
    struct law_motion motion = {.w = at->w, .v = at->v, .w_old = at->w, .a = at->a, .t_s = 0.1, .dt_s = 1e-4};
    struct law_prepared prepared;
    memset(out, 0, sizeof *out);
    law_prepare(&c->predictor->laws[0], &c->predictor->map, c->theta, &prepared);
    assert_int_equal(law_force(&prepared, &motion, true, true, out), 0);
    law_prepared_free(&prepared);
}

/* A smooth motion of all coordinates and its derivatives. */
static struct instant motion_at(double t)
{
    struct instant at;
    for (size_t j = 0; j < LAW_COORDINATES; j++) {
        double size = 1e-2 / (1.0 + (double)(j * j * j * j)), omega = 3.0 + 5.0 * (double)j, phase = 1.0 + (double)j;
        at.w[j] = size * sin(omega * t + phase);
        at.v[j] = size * omega * cos(omega * t + phase);
        at.a[j] = -size * omega * omega * sin(omega * t + phase);
    }
    return at;
}

/* ---- One instant ---- */

static void tangents_are_differences(void **state)
{
    (void)state;
    struct predict_case c;
    struct law_force middle, up, down;
    open_case(&c, "  - {kind: large_rotation, scale: 1.7}\n", 4.0, 0);
    without_stiffness(&c);
    struct instant at = motion_at(0.3);
    size_t d = c.predictor->laws[0].d, n_weights = 0;
    double size = 0.0;
    evaluate(&c, &at, &middle);
    assert_true(d >= 3);
    for (size_t i = 0; i < d; i++)
        size = fmax(size, fabs(middle.f[i]));
    assert_true(size > 0.0);
    for (int which = 0; which < 3; which++) {
        const double *tangent = which == 0 ? middle.by_w : which == 1 ? middle.by_v : middle.by_a;
        for (size_t j = 0; j < d; j++) {
            double *x = which == 0 ? &at.w[j] : which == 1 ? &at.v[j] : &at.a[j], keep = *x, h = 1e-4 * fabs(keep);
            *x = keep + h;
            evaluate(&c, &at, &up);
            *x = keep - h;
            evaluate(&c, &at, &down);
            *x = keep; /* quadratic in each: central differences are exact */
            for (size_t i = 0; i < d; i++)
                assert_true(fabs(tangent[i * d + j] - (up.f[i] - down.f[i]) / (2.0 * h)) <= 1e-10 * size / h);
        }
    }
    for (size_t k = 0; k < c.predictor->laws[0].n_dependencies; k++) {
        size_t p = c.predictor->laws[0].dependency[k];
        double keep = c.theta[p], h = 0.1;
        if (p == case_index(&c, "EI_beam_Nm2") || p == case_index(&c, "EI_patch_Nm2"))
            continue; /* of the stiffness */
        c.theta[p] = keep + h;
        evaluate(&c, &at, &up);
        c.theta[p] = keep - h;
        evaluate(&c, &at, &down);
        c.theta[p] = keep;
        for (size_t i = 0; i < d; i++)
            assert_true(fabs(middle.by_parameter[k][i] - (up.f[i] - down.f[i]) / (2.0 * h)) <= 1e-11 * size / h);
        n_weights++;
    }
    assert_int_equal(n_weights, 3); /* κ, and ρ of beam and patch */
    case_close(&c);
}

/* ---- Energy ---- */

/* Slopes of the coordinates at the middles of many equal pieces. */
struct fine_beam {
    size_t d;
    double h_m, slope[PIECES][LAW_COORDINATES], rho[PIECES];
};

static void slice(const struct predict_case *c, struct fine_beam *out)
{
    const struct reduced *r = &c->predictor->reduced;
    double *g = bf_alloc(r->n, sizeof *g);
    double beam = c->theta[case_index(c, "rho_beam_kgpm")], patch = c->theta[case_index(c, "rho_patch_kgpm")];
    out->d = c->predictor->laws[0].d;
    out->h_m = c->model.length_m / PIECES;
    for (size_t k = 0; k < PIECES; k++) {
        double x = out->h_m * ((double)k + 0.5);
        reduced_point(r, 1, x, g);
        memcpy(out->slope[k], g, out->d * sizeof *g);
        out->rho[k] = x > 0.02535 && x < 0.08905 ? patch : beam;
    }
    free(g);
}

/* T = ½ κ ∫ ρ u_t² dx, u_t = −∫₀ˣ y' y'_t ds */
static double energy(const struct fine_beam *b, double kappa, const double w[], const double v[])
{
    double T = 0.0, u_t = 0.0;
    for (size_t k = 0; k < PIECES; k++) {
        double slope = 0.0, rate = 0.0;
        for (size_t j = 0; j < b->d; j++) {
            slope += b->slope[k][j] * w[j];
            rate += b->slope[k][j] * v[j];
        }
        u_t -= 0.5 * b->h_m * slope * rate;
        T += 0.5 * kappa * b->rho[k] * b->h_m * u_t * u_t;
        u_t -= 0.5 * b->h_m * slope * rate;
    }
    return T;
}

/* ∂T/∂x_i for x in w or v: T is quadratic in each, so that the difference is exact. */
static double slope_of_energy(const struct fine_beam *b, double kappa, struct instant at, bool by_v, size_t i)
{
    double *x = by_v ? &at.v[i] : &at.w[i], keep = *x, h = 0.1 * fabs(keep) + 1e-4;
    *x = keep + h;
    double up = energy(b, kappa, at.w, at.v);
    *x = keep - h;
    return (up - energy(b, kappa, at.w, at.v)) / (2.0 * h);
}

/* f = d/dt ∂T/∂v − ∂T/∂w, the time derivative by differences of fourth order. */
static void the_force_is_that_of_the_kinetic_energy(void **state)
{
    (void)state;
    static struct fine_beam b;
    static const double t = 0.2, step = 1e-3, weight[4] = {1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};
    struct predict_case c;
    struct law_force force;
    open_case(&c, "  - {kind: large_rotation, scale: 1.7}\n", 4.0, 0);
    slice(&c, &b);
    without_stiffness(&c);
    struct instant now = motion_at(t);
    evaluate(&c, &now, &force);
    double worst = 0.0, size = 0.0;
    for (size_t i = 0; i < b.d; i++) {
        double expected = -slope_of_energy(&b, 1.7, now, false, i);
        for (int k = 0; k < 4; k++) {
            double at_s = t + step * (double)(k < 2 ? k - 2 : k - 1);
            expected += weight[k] / step * slope_of_energy(&b, 1.7, motion_at(at_s), true, i);
        }
        worst = fmax(worst, fabs(force.f[i] - expected));
        size = fmax(size, fabs(expected));
    }
    print_message("  force and energy differ by %.1e\n", worst / size);
    assert_true(worst < 5e-4 * size); /* ten elements of three points for the fourth power of six modes */
    case_close(&c);
}

/* And the stiffness is that of ½ κ ∫ EI y'² y″² dx. */
static double stored(const struct predict_case *c, double kappa, const double w[])
{
    const struct reduced *r = &c->predictor->reduced;
    double *g = bf_alloc(2 * r->n, sizeof *g), V = 0.0, h = c->model.length_m / PIECES;
    double beam = c->theta[case_index(c, "EI_beam_Nm2")], patch = c->theta[case_index(c, "EI_patch_Nm2")];
    for (size_t k = 0; k < PIECES; k++) {
        double x = h * ((double)k + 0.5), slope = 0.0, curvature = 0.0;
        reduced_point(r, 1, x, g);
        reduced_point(r, 2, x, g + r->n);
        for (size_t j = 0; j < c->predictor->laws[0].d; j++) {
            slope += g[j] * w[j];
            curvature += g[r->n + j] * w[j];
        }
        V += 0.5 * kappa * h * (x > 0.02535 && x < 0.08905 ? patch : beam) * slope * slope * curvature * curvature;
    }
    free(g);
    return V;
}

static void the_stiffness_is_that_of_the_curvature(void **state)
{
    (void)state;
    struct predict_case c;
    struct law_force force;
    open_case(&c, "  - {kind: large_rotation, scale: 1.7}\n", 4.0, 0);
    struct instant now = motion_at(0.2);
    memset(now.v, 0, sizeof now.v);
    memset(now.a, 0, sizeof now.a);
    evaluate(&c, &now, &force);
    double worst = 0.0, size = 0.0;
    for (size_t i = 0; i < c.predictor->laws[0].d; i++) {
        double keep = now.w[i], h = 1e-4 * fabs(keep);
        now.w[i] = keep + h;
        double up = stored(&c, 1.7, now.w);
        now.w[i] = keep - h;
        double expected = (up - stored(&c, 1.7, now.w)) / (2.0 * h);
        now.w[i] = keep;
        worst = fmax(worst, fabs(force.f[i] - expected));
        size = fmax(size, fabs(expected));
    }
    print_message("  force and energy differ by %.1e\n", worst / size);
    assert_true(worst < 1e-3 * size); /* as above */
    case_close(&c);
}

/* ---- Records ---- */

static const char strong[] = "  - {kind: large_rotation, scale: 30}\n";

static double change(const double x[], const double y[])
{
    double difference = 0.0, size = 0.0;
    for (size_t k = 0; k + 8 < SAMPLES; k++) {
        difference += (x[k] - y[k]) * (x[k] - y[k]);
        size += y[k] * y[k];
    }
    return sqrt(difference / size);
}

/* Errors of the usual step and of half of it, against an eighth. The end, where the force is cut, is left out. */
static void steps_converge(void **state)
{
    (void)state;
    static const int oversample[3] = {4, 8, 32};
    static double y[4][SAMPLES];
    for (int i = 0; i < 4; i++) {
        struct predict_case c;
        open_case(&c, strong, 4.0, oversample[i < 3 ? i : 0]);
        if (i == 3) { /* without the inertia */
            free(c.predictor->laws[0].shortening);
            c.predictor->laws[0].shortening = NULL;
        }
        case_run(&c, NULL);
        memcpy(y[i], c.out.y + 2 * SAMPLES, sizeof y[i]);
        case_close(&c);
    }
    double coarse = change(y[0], y[2]), fine = change(y[1], y[2]), inertia = change(y[3], y[2]);
    print_message("  errors %.1e, %.1e; the inertia is %.1e\n", coarse, fine, inertia);
    assert_true(inertia > 0.02);
    assert_true(coarse < 0.01 * inertia);
    assert_true(log2(coarse / fine) > 2.5);
}

/* ---- Against a simulation ---- */

enum { FINE = 32 };

/* The law's modes alone, Runge and Kutta's fourth order: z = (w, v). */
struct simulation {
    const struct predict_case *c;
    struct law_prepared law;
    size_t d;
    bool bent;
};

/* a = (1 + ∂f/∂a)⁻¹ (b u − C v − K w − f(w, v, 0)) */
static void acceleration(const struct simulation *m, double u, const double z[], double a[])
{
    const struct system *s = m->c->predictor->system;
    size_t d = m->d, n = s->n;
    static const double zero[LAW_COORDINATES];
    struct law_motion motion = {.w = z, .v = z + d, .w_old = z, .a = zero};
    struct law_force f = {.by_a = {0.0}};
    double A[LAW_COORDINATES * LAW_COORDINATES];
    if (m->bent)
        assert_int_equal(law_force(&m->law, &motion, true, false, &f), 0);
    for (size_t i = 0; i < d; i++) {
        a[i] = m->c->predictor->inputs[0].g[i] * u - f.f[i];
        for (size_t j = 0; j < d; j++) {
            a[i] -= s->K[i * n + j] * z[j] + s->C[i * n + j] * z[d + j];
            A[i * d + j] = s->M[i * n + j] + f.by_a[i * d + j];
        }
    }
    for (size_t k = 0; k < d; k++) /* Gauss without pivots: A is positive definite */
        for (size_t i = k + 1; i < d; i++) {
            double factor = A[i * d + k] / A[k * d + k];
            for (size_t j = k; j < d; j++)
                A[i * d + j] -= factor * A[k * d + j];
            a[i] -= factor * a[k];
        }
    for (size_t i = d; i-- > 0;) {
        for (size_t j = i + 1; j < d; j++)
            a[i] -= A[i * d + j] * a[j];
        a[i] /= A[i * d + i];
    }
}

static void simulate(const struct simulation *m, double level_N, double tip_mps[SAMPLES])
{
    size_t d = m->d;
    double z[2 * LAW_COORDINATES] = {0}, k[4][2 * LAW_COORDINATES], x[2 * LAW_COORDINATES], h = dt_s / FINE;
    static const double part[4] = {0.0, 0.5, 0.5, 1.0};
    for (size_t step = 0; step < (size_t)SAMPLES * FINE; step++) {
        if (step % FINE == 0) {
            tip_mps[step / FINE] = 0.0;
            for (size_t i = 0; i < d; i++)
                tip_mps[step / FINE] += m->c->predictor->outputs[2].g[i] * z[d + i];
        }
        for (int stage = 0; stage < 4; stage++) {
            for (size_t i = 0; i < 2 * d; i++)
                x[i] = z[i] + (stage > 0 ? part[stage] * h * k[stage - 1][i] : 0.0);
            memcpy(k[stage], x + d, d * sizeof(double));
            acceleration(m, case_hammer(((double)step + part[stage]) * h, level_N), x, k[stage] + d);
        }
        for (size_t i = 0; i < 2 * d; i++)
            z[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    }
}

static void a_record_is_the_simulation(void **state)
{
    (void)state;
    static double bent[SAMPLES], linear[SAMPLES], y[SAMPLES];
    struct predict_case c;
    struct bf_error err;
    struct predict_options options = {.fine_splines = 40, .modes = 6, .threads = 1};
    const double level_N = 25.0;
    open_case(&c, strong, level_N, 0);
    memset(c.record.columns[1].x, 0, c.record.n * sizeof(double));
    predictor_free(c.predictor);
    c.predictor = NULL;
    assert_int_equal(predictor_new(&c.model, &c.record, 1, &options, &c.predictor, &err), BF_OK);
    case_run(&c, NULL);
    memcpy(y, c.out.y + 2 * SAMPLES, sizeof y);
    struct simulation m = {.c = &c, .d = c.predictor->laws[0].d, .bent = true};
    law_prepare(&c.predictor->laws[0], &c.predictor->map, c.theta, &m.law);
    simulate(&m, level_N, bent);
    m.bent = false;
    simulate(&m, level_N, linear);
    law_prepared_free(&m.law);
    c.theta[case_index(&c, "scale")] = 0.0;
    case_run(&c, NULL);
    for (size_t k = 0; k < SAMPLES; k++)
        y[k] += linear[k] - c.out.y[2 * SAMPLES + k];
    print_message("  the law changes %.2g, error %.2g of rms\n", change(linear, bent), change(y, bent));
    assert_true(change(linear, bent) > 0.05);
    assert_true(change(y, bent) < 1e-4);
    case_close(&c);
}

/* Both laws' coordinates in one record: the other one's stand beside the span's. */
static void beside_a_law_at_a_point(void **state)
{
    (void)state;
    static double y[2][SAMPLES];
    static const char *const effects[2] = {
        "  - {kind: cubic_stiffness, coefficient_Npm3: 1e7, at_m: 0.35}\n  - {kind: large_rotation, scale: 30}\n",
        "  - {kind: large_rotation, scale: 30}\n  - {kind: cubic_stiffness, coefficient_Npm3: 1e7, at_m: 0.35}\n"};
    for (int i = 0; i < 2; i++) {
        struct predict_case c;
        open_case(&c, effects[i], 4.0, 0);
        case_run(&c, NULL);
        memcpy(y[i], c.out.y + 2 * SAMPLES, sizeof y[i]);
        case_close(&c);
    }
    assert_true(change(y[0], y[1]) < 1e-6);
    struct predict_case c;
    open_case(&c, strong, 4.0, 0);
    case_run(&c, NULL);
    assert_true(change(c.out.y + 2 * SAMPLES, y[0]) > 1e-3);
    case_close(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tangents_are_differences),
        cmocka_unit_test(the_force_is_that_of_the_kinetic_energy),
        cmocka_unit_test(the_stiffness_is_that_of_the_curvature),
        cmocka_unit_test(steps_converge),
        cmocka_unit_test(a_record_is_the_simulation),
        cmocka_unit_test(beside_a_law_at_a_point),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
