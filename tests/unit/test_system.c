/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Poles and vectors of the reduced model against direct solves and complex steps. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "dense_solve.h"
#include "model_fixture.h"
#include "beam/beam.h"
#include "beam/system.h"

struct fixture {
    struct model model;
    struct reduced reduced;
    struct parameter_ref *refs;
    struct parameter_map map;
    struct system *system;
    double *theta;
    size_t n;
};

static void open_supported(struct fixture *f, const char *effects, enum model_support support, size_t splines)
{
    struct bf_error err;
    struct reduced_options options = {
        .n_splines = splines, .top_rad = 6000.0, .min_modes = 6, .max_modes = 20, .statics = 2};
    fixture_model(&f->model, effects);
    f->model.support = support;
    assert_int_equal(reduced_new(&f->model, &options, &f->reduced, &err), BF_OK);
    f->n = model_parameters(&f->model, NULL, 0, &f->refs);
    f->map = parameter_map_new(&f->model, f->refs, f->n, 0);
    assert_int_equal(system_new(&f->model, &f->reduced, &f->map, &f->system, &err), BF_OK);
    f->theta = bf_alloc(f->n, sizeof(double));
    for (size_t i = 0; i < f->n; i++)
        f->theta[i] = f->refs[i].value;
}

static void open_fixture(struct fixture *f, const char *effects)
{
    open_supported(f, effects, SUPPORT_CLAMPED_FREE, 60);
}

static void close_fixture(struct fixture *f)
{
    system_free(f->system);
    parameter_map_free(&f->map);
    free(f->refs);
    free(f->theta);
    reduced_free(&f->reduced);
    model_free(&f->model);
}

/*
 * Of the rigid motion's response: the two poles of a lightly damped rigid motion have large parts of it that nearly cancel (|s| m/c is 70 at
 * |s| = 4 here), and the stiffness of a motion that bends nothing is rounding, to the solves that it is held against, too. Rounding is the BLAS
 * kernel's: 3e-6 to 3.1e-5 with OpenBLAS's Haswell, Zen, SkylakeX, Sandybridge, Prescott and Nehalem (OPENBLAS_CORETYPE).
 */
static const double rigid_accuracy = 1e-4;
/* Of a derivative held against differences, whose own rounding is 2.3e-7 with the worst of those kernels. */
static const double derivative_accuracy = 1e-6;

/* cᵀA(s)⁻¹b by LU. */
static double complex direct(const struct fixture *f, double complex s, const double c[], const double b[])
{
    size_t n = f->system->n;
    double complex *A = bf_alloc(n * n, sizeof *A), *x = bf_alloc(n, sizeof *x), sum = 0.0;
    system_dynamic_stiffness(f->system, s, A);
    for (size_t i = 0; i < n; i++)
        x[i] = b[i];
    dense_solve_complex(n, A, x);
    for (size_t i = 0; i < n; i++)
        sum += c[i] * x[i];
    free(A);
    free(x);
    return sum;
}

static double complex by_poles(const struct system *s, double complex at, const double complex alpha[],
                               const double complex beta[])
{
    double complex sum = 0.0;
    for (size_t k = 0; k < s->n_poles; k++) {
        sum += alpha[k] * beta[k] / (at - s->p[k]);
        if (k < s->n_pairs)
            sum += conj(alpha[k] * beta[k]) / (at - conj(s->p[k]));
    }
    return sum;
}

static const char *const cases[] = {
    "",
    "  - {kind: tip_mass, mass_kg: 0.002}\n",
    "  - {kind: root_compliance, compliance_radpNm: 0.01, loss_s: 3e-5, frequency_Hz: 60}\n",
    "  - {kind: point_spring, stiffness_Npm: 30, damping_Nspm: 0.02, at_m: {value: 0.3, fixed: false}}\n",
    "  - {kind: square_root_damping, coefficient_Ns: 1e-4}\n",
    "  - {kind: hysteretic_damping, loss_factor: 0.01}\n",
    "  - {kind: viscoelastic, strength_Nm2: 0.035, relaxation_s: 0.006}\n",
    "  - {kind: viscoelastic, strength_Nm2: 0.02, relaxation_s: 0.002}\n  - {kind: tip_mass, mass_kg: 0.001}\n",
    /* two effects with one relaxation time: their poles would coincide if each had states of its own */
    "  - {kind: viscoelastic, relaxation_s: 1e-3}\n  - {kind: electrical_coupling, time_constant_s: 1e-3}\n",
    "  - {kind: attached_resonator, mass_kg: 4e-3, frequency_Hz: 8, at_m: {value: 0.3, fixed: false}}\n",
    "  - {kind: electrical_coupling}\n", /* memory over a part of the span: fewer states than coordinates */
    /* two of them, one without mass */
    "  - {kind: attached_resonator}\n  - {kind: attached_resonator, mass_kg: 0, frequency_Hz: 70, at_m: 0.2}\n",
};
enum { CASES = sizeof cases / sizeof *cases };
/* The last two have poles that hardly act, of the first they nearly coincide: derivatives in test_predict_gradients.c. */
enum { DERIVATIVE_CASES = CASES - 2 };

static void functionals(const struct fixture *f, double b[], double c[])
{
    reduced_point(&f->reduced, 0, 0.0254, b);
    reduced_point(&f->reduced, 1, 0.08905, c);
}

static void pole_sum_is_the_inverse(void **state)
{
    (void)state;
    for (int i = 0; i < CASES; i++) {
        struct fixture f;
        struct bf_error err;
        open_fixture(&f, cases[i]);
        assert_int_equal(system_evaluate(f.system, f.theta, NULL, &err), BF_OK);
        double *b = bf_alloc(2 * f.system->n, sizeof *b), *c = b + f.system->n;
        double complex *alpha = bf_alloc(2 * f.system->n_poles, sizeof *alpha), *beta = alpha + f.system->n_poles;
        functionals(&f, b, c);
        system_functional(f.system, c, alpha);
        system_functional(f.system, b, beta);
        for (int k = 0; k < 12; k++) {
            double complex s = CMPLX(2.6, 3.0 * pow(2.0, k));
            double complex x = direct(&f, s, c, b), y = by_poles(f.system, s, alpha, beta);
            if (cabs(x - y) > 1e-8 * cabs(x))
                fail_msg("case %d, |s| = %g: %.3g relative", i, cabs(s), cabs(x - y) / cabs(x));
        }
        free(b);
        free(alpha);
        close_fixture(&f);
    }
}

/*
 * The two rigid motions of a free beam have one pole, to rounding, and then the eigenvectors of it are any of their span: whichever way the rounding of
 * a space falls, the sum over the poles is the inverse.
 */
static void rigid_motions_share_a_pole(void **state)
{
    (void)state;
    static const size_t splines[] = {20, 24, 32, 48, 60, 72, 96, 128, 160, 192};
    for (size_t i = 0; i < sizeof splines / sizeof *splines; i++) {
        struct fixture f;
        struct bf_error err;
        open_supported(&f, "", SUPPORT_FREE_FREE, splines[i]);
        assert_int_equal(system_evaluate(f.system, f.theta, NULL, &err), BF_OK);
        double *b = bf_alloc(2 * f.system->n, sizeof *b), *c = b + f.system->n;
        double complex *alpha = bf_alloc(2 * f.system->n_poles, sizeof *alpha), *beta = alpha + f.system->n_poles;
        functionals(&f, b, c);
        system_functional(f.system, c, alpha);
        system_functional(f.system, b, beta);
        double mass_free = 0.0; /* |s² H| where the beam moves as a rigid body */
        for (int k = 0; k < 12; k++) {
            double complex s = CMPLX(2.6, 3.0 * pow(2.0, k));
            double complex x = direct(&f, s, c, b), y = by_poles(f.system, s, alpha, beta);
            mass_free = k == 0 ? cabs(s * s * x) : mass_free;
            if (cabs(x - y) > rigid_accuracy * fmax(cabs(x), mass_free / cabs(s * s)))
                fail_msg("%zu splines, |s| = %g: %.3g relative", splines[i], cabs(s), cabs(x - y) / cabs(x));
        }
        free(b);
        free(alpha);
        close_fixture(&f);
    }
}

/* Every structural derivative of the pole sum against central differences of direct solves, Richardson-extrapolated. */
static double complex direct_at(struct fixture *f, size_t i, double value, double complex s, const double c[],
                                const double b[])
{
    struct bf_error err;
    double keep = f->theta[i];
    f->theta[i] = value;
    assert_int_equal(system_evaluate(f->system, f->theta, NULL, &err), BF_OK);
    f->theta[i] = keep;
    return direct(f, s, c, b);
}

static double complex difference(struct fixture *f, size_t i, double complex s, const double c[], const double b[])
{
    double h = 2e-3 * fabs(f->theta[i]), x = f->theta[i];
    double complex d[2];
    for (int k = 0; k < 2; k++, h *= 0.5)
        d[k] = (direct_at(f, i, x + h, s, c, b) - direct_at(f, i, x - h, s, c, b)) / (2.0 * h);
    return (4.0 * d[1] - d[0]) / 3.0;
}

/* d(cᵀA⁻¹b) = Σ_k δ(α_k β_k/(s − p_k)) by parameter i. */
static double complex change_of_poles(const struct fixture *f, size_t i, double complex s, const double c[],
                                      const double b[])
{
    const size_t P = f->system->n_poles;
    double complex *a = bf_alloc(4 * P, sizeof *a), *q = a + P, *da = q + P, *dq = da + P, sum = 0.0;
    system_functional(f->system, c, a);
    system_functional(f->system, b, q);
    system_functional_derivative(f->system, i, a, da);
    system_functional_derivative(f->system, i, q, dq);
    for (size_t p = 0; p < P; p++) {
        const double complex r = a[p] * q[p], dr = da[p] * q[p] + a[p] * dq[p], dp = f->system->derivative[i].p[p];
        const double complex gap = s - f->system->p[p], other = s - conj(f->system->p[p]);
        sum += dr / gap + r * dp / (gap * gap);
        if (p < f->system->n_pairs)
            sum += conj(dr) / other + conj(r * dp) / (other * other);
    }
    free(a);
    return sum;
}

static void derivative_of(struct fixture *f, size_t i, const double b[], const double c[])
{
    struct bf_error err;
    bool *want = bf_alloc(f->n, sizeof *want);
    want[i] = true;
    assert_int_equal(system_evaluate(f->system, f->theta, want, &err), BF_OK);
    double complex y[6], s[6];
    for (int k = 0; k < 6; k++) {
        s[k] = CMPLX(2.6, 10.0 * pow(3.0, k));
        y[k] = change_of_poles(f, i, s[k], c, b);
    }
    const bool is_free = f->model.support == SUPPORT_FREE_FREE;
    const double accuracy = is_free ? rigid_accuracy : derivative_accuracy;
    /* |s² H| where the beam moves as a rigid body, by a parameter of its own size */
    const double rigid = is_free ? cabs(s[0] * s[0] * direct_at(f, i, f->theta[i], s[0], c, b) / f->theta[i]) : 0.0;
    for (int k = 0; k < 6; k++) {
        const double complex x = difference(f, i, s[k], c, b);
        if (cabs(x - y[k]) > accuracy * (cabs(x) + rigid / cabs(s[k] * s[k])))
            fail_msg("%s at |s| = %g: %.3g relative", f->refs[i].label, cabs(s[k]), cabs(x - y[k]) / cabs(x));
    }
    free(want);
}

/* Of the fixture, which is closed. */
static void derivatives_of(struct fixture *f)
{
    struct bf_error err;
    double *b = bf_alloc(2 * f->system->n, sizeof *b), *c = b + f->system->n;
    functionals(f, b, c);
    bool *all = bf_alloc(f->n, sizeof *all);
    memset(all, 1, f->n * sizeof *all);
    assert_int_equal(system_evaluate(f->system, f->theta, all, &err), BF_OK);
    for (size_t j = 0; j < f->n; j++)
        if (f->system->derivative[j].Z != NULL)
            derivative_of(f, j, b, c);
    free(all);
    free(b);
    close_fixture(f);
}

static void derivatives_match_differences(void **state)
{
    (void)state;
    for (int i = 0; i < DERIVATIVE_CASES; i++) {
        struct fixture f;
        open_fixture(&f, cases[i]);
        derivatives_of(&f);
    }
}

static void derivatives_of_rigid_motions(void **state)
{
    (void)state;
    static const size_t splines[] = {24, 60, 96, 160};
    for (size_t i = 0; i < sizeof splines / sizeof *splines; i++) {
        struct fixture f;
        open_supported(&f, "", SUPPORT_FREE_FREE, splines[i]);
        derivatives_of(&f);
    }
}

/* A spring of nothing parts the two rigid motions, and not along the eigenvectors: dH/dk = −(cᵀA⁻¹g)(gᵀA⁻¹b). */
static void a_spring_parts_rigid_motions(void **state)
{
    (void)state;
    struct fixture f;
    struct bf_error err;
    open_supported(&f,
                   "  - {kind: point_spring, stiffness_Npm: 1e-12, damping_Nspm: 0, at_m: {value: 0.3, fixed: true}}\n",
                   SUPPORT_FREE_FREE, 96);
    size_t i = 0;
    while (i < f.n && strstr(f.refs[i].label, "stiffness_Npm") == NULL)
        i++;
    assert_true(i < f.n);
    bool *want = bf_alloc(f.n, sizeof *want);
    want[i] = true;
    assert_int_equal(system_evaluate(f.system, f.theta, want, &err), BF_OK);
    const size_t n = f.system->n;
    double *b = bf_alloc(3 * n, sizeof *b), *c = b + n, *g = c + n;
    functionals(&f, b, c);
    reduced_point(&f.reduced, 0, 0.3, g);
    double largest = 0.0, error = 0.0; /* of an acceleration */
    for (int k = 0; k < 6; k++) {
        const double complex s = CMPLX(2.6, 10.0 * pow(3.0, k));
        const double complex x = -direct(&f, s, c, g) * direct(&f, s, g, b), y = change_of_poles(&f, i, s, c, b);
        largest = fmax(largest, cabs(s * s * x));
        error = fmax(error, cabs(s * s * (y - x)));
    }
    assert_true(error < 0.02 * largest); /* what poles 1e-11 of the fastest apart leave of the digits */
    free(b);
    free(want);
    close_fixture(&f);
}

static void negative_mass_is_refused(void **state)
{
    (void)state;
    struct fixture f;
    struct bf_error err;
    open_fixture(&f, "");
    for (size_t i = 0; i < f.n; i++)
        if (f.refs[i].role == ROLE_RHO)
            f.theta[i] = -f.theta[i];
    assert_int_equal(system_evaluate(f.system, f.theta, NULL, &err), BF_NUMERIC);
    assert_non_null(strstr(err.text, "mass"));
    close_fixture(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pole_sum_is_the_inverse),       cmocka_unit_test(rigid_motions_share_a_pole),
        cmocka_unit_test(derivatives_match_differences), cmocka_unit_test(derivatives_of_rigid_motions),
        cmocka_unit_test(a_spring_parts_rigid_motions),  cmocka_unit_test(negative_mass_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
