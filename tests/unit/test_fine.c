/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The fine space: its forms, its boundary conditions, and frequencies against transcendental equations. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "exact_beam.h"
#include "beam/beam.h"
#include "beam/fine.h"
#include "model_fixture.h"

static struct fine_space open_space(const struct model *model, size_t n, bool released, bool on_edges)
{
    struct fine_space space;
    struct bf_error err;
    assert_int_equal(fine_new(model, n, released, on_edges, &space, &err), BF_OK);
    return space;
}

/* Coefficients of the polynomial Σ a_k x^k in a space without boundary conditions, by least squares on its points. */
static void interpolate(const struct fine_space *space, const double a[4], double c[])
{
    size_t n = space->n, rows = 4 * n;
    double *A = bf_alloc(rows * n, sizeof *A), *b = bf_alloc(rows, sizeof *b), *g = bf_alloc(n, sizeof *g);
    struct bf_error err;
    for (size_t r = 0; r < rows; r++) {
        double x = space->length_m * (double)r / (double)(rows - 1);
        memset(g, 0, n * sizeof *g);
        fine_add_functional(space, 0, x, 1.0, g);
        for (size_t j = 0; j < n; j++)
            A[r + j * rows] = g[j];
        b[r] = a[0] + x * (a[1] + x * (a[2] + x * a[3]));
    }
    assert_int_equal(dense_least_squares(rows, n, A, b, 1e-13, c, NULL, &err), BF_OK);
    free(A);
    free(b);
    free(g);
}

/* ∫ from … to of the product of the k-th derivatives of two cubics. */
static double exact_form(const double a[4], const double b[4], int k, double from, double to)
{
    double p[4], q[4], sum = 0.0;
    memcpy(p, a, sizeof p);
    memcpy(q, b, sizeof q);
    for (int d = 0; d < k; d++) {
        for (int i = 0; i < 4; i++) {
            p[i] = i < 3 ? (double)(i + 1) * p[i + 1] : 0.0;
            q[i] = i < 3 ? (double)(i + 1) * q[i + 1] : 0.0;
        }
    }
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            sum += p[i] * q[j] * (pow(to, i + j + 1) - pow(from, i + j + 1)) / (double)(i + j + 1);
    return sum;
}

static void forms_are_integrals(void **state)
{
    (void)state;
    const double a[4] = {0.2, -1.0, 3.0, 4.0}, b[4] = {1.0, 2.0, -5.0, 1.0};
    /* whole span, a region, and pieces whose ends lie inside elements */
    const double pieces[][2] = {{0.0, 0.4573}, {0.02535, 0.08905}, {0.0371, 0.0412}, {0.1, 0.1999}, {0.4, 0.4573}};
    struct model model;
    fixture_model(&model, "");
    model.support = SUPPORT_FREE_FREE;
    for (int on_edges = 0; on_edges < 2; on_edges++) {
        struct fine_space space = open_space(&model, 13, false, on_edges != 0);
        double *x = bf_alloc(3 * space.n, sizeof *x), *y = x + space.n, *z = y + space.n;
        double *band = bf_alloc(space.n * FINE_BAND, sizeof *band);
        interpolate(&space, a, x);
        interpolate(&space, b, y);
        for (int k = 0; k < 3; k++) {
            for (size_t p = 0; p < sizeof pieces / sizeof *pieces; p++) {
                memset(band, 0, space.n * FINE_BAND * sizeof *band);
                fine_add_form(&space, k, pieces[p][0], pieces[p][1], 2.5, band);
                fine_multiply(&space, band, y, z);
                double exact = 2.5 * exact_form(a, b, k, pieces[p][0], pieces[p][1]);
                assert_true(fabs(dense_dot(space.n, x, z) / exact - 1.0) < 1e-9);
            }
        }
        free(x);
        free(band);
        fine_free(&space);
    }
    model_free(&model);
}

static void band_is_upper_and_symmetric(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct fine_space space = open_space(&model, 9, false, true);
    size_t n = space.n;
    double *band = bf_alloc(n * FINE_BAND, sizeof *band), *column = bf_alloc(2 * n, sizeof *column), *unit = column + n;
    fine_add_form(&space, 0, 0.0, model.length_m, 1.0, band);
    for (size_t j = 0; j < n; j++) {
        memset(unit, 0, n * sizeof *unit);
        unit[j] = 1.0;
        fine_multiply(&space, band, unit, column);
        for (size_t i = 0; i < n; i++) {
            size_t low = i < j ? i : j, distance = i < j ? j - i : i - j;
            double entry = distance < FINE_BAND ? band[low * FINE_BAND + distance] : 0.0;
            assert_true(fabs(column[i] - entry) < 1e-16);
        }
        assert_true(column[j] > 0.0);
    }
    free(band);
    free(column);
    fine_free(&space);
    model_free(&model);
}

static void point_is_the_square_of_a_functional(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct fine_space space = open_space(&model, 12, false, true);
    size_t n = space.n;
    double *band = bf_alloc(n * FINE_BAND, sizeof *band), *g = bf_alloc(3 * n, sizeof *g), *x = g + n, *y = x + n;
    for (int k = 0; k < 2; k++) {
        memset(band, 0, n * FINE_BAND * sizeof *band);
        memset(g, 0, n * sizeof *g);
        fine_add_point(&space, k, 0.21, 3.0, band);
        fine_add_functional(&space, k, 0.21, 1.0, g);
        for (size_t i = 0; i < n; i++)
            x[i] = sin((double)i);
        fine_multiply(&space, band, x, y);
        double w = dense_dot(n, g, x);
        for (size_t i = 0; i < n; i++)
            assert_true(fabs(y[i] - 3.0 * g[i] * w) <= 1e-12 * (fabs(w) + 1.0) * (fabs(g[i]) + 1e-3));
    }
    free(band);
    free(g);
    fine_free(&space);
    model_free(&model);
}

/* Value and slope of every function at an end: 0 where the support holds it. */
static bool held(const struct fine_space *space, int derivative, double x)
{
    double *g = bf_alloc(space->n, sizeof *g), sum = 0.0;
    fine_add_functional(space, derivative, x, 1.0, g);
    for (size_t i = 0; i < space->n; i++)
        sum += fabs(g[i]);
    free(g);
    return sum < 1e-12;
}

static void supports_hold_what_they_should(void **state)
{
    (void)state;
    static const bool expected[4][4] = {/* y(0), y'(0), y(l), y'(l) */
                                        [SUPPORT_CLAMPED_FREE] = {true, true, false, false},
                                        [SUPPORT_CLAMPED_CLAMPED] = {true, true, true, true},
                                        [SUPPORT_PINNED_PINNED] = {true, false, true, false},
                                        [SUPPORT_FREE_FREE] = {false, false, false, false}};
    struct model model;
    fixture_model(&model, "");
    for (int support = 0; support < 4; support++) {
        model.support = (enum model_support)support;
        for (int released = 0; released < 2; released++) {
            struct fine_space space = open_space(&model, 10, released != 0, true);
            assert_int_equal(held(&space, 0, 0.0), expected[support][0]);
            assert_int_equal(held(&space, 1, 0.0), expected[support][1] && !released);
            assert_int_equal(held(&space, 0, model.length_m), expected[support][2]);
            assert_int_equal(held(&space, 1, model.length_m), expected[support][3]);
            fine_free(&space);
        }
    }
    model_free(&model);
}

/* ---- Frequencies ---- */

static void make_uniform(struct model *model)
{
    for (size_t m = 0; m < model->n_materials; m++) {
        model->materials[m].EI.value = 0.5;
        model->materials[m].rho.value = 0.1;
    }
}

static void uniform_beams_have_the_exact_roots(void **state)
{
    (void)state;
    enum { MODES = 6 };
    struct model model;
    struct bf_error err;
    double found[MODES + 2];
    fixture_model(&model, "");
    make_uniform(&model);
    for (int support = 0; support < 4; support++) {
        size_t rigid = support == SUPPORT_FREE_FREE ? 2 : 0;
        model.support = (enum model_support)support;
        assert_int_equal(modes_frequencies(&model, 160, false, MODES + rigid, found, &err), BF_OK);
        for (size_t k = 0; k < rigid; k++)
            assert_true(found[k] < 1e-2 * found[rigid]);
        assert_int_equal(modes_rigid(found, MODES + rigid), rigid);
        for (size_t k = 0; k < MODES; k++) {
            double root = exact_uniform_root(support, (int)k) / model.length_m;
            double exact = root * root * sqrt(0.5 / 0.1) / (2.0 * acos(-1.0));
            if (fabs(found[k + rigid] / exact - 1.0) > 1e-6)
                fail_msg("support %d mode %zu: %.9g Hz, exact %.9g Hz", support, k, found[k + rigid], exact);
        }
    }
    model_free(&model);
}

/* A piece that is nearly rigid: more stiffness changes next to nothing, and does not drown the shift that a free beam's factor needs. */
static void a_rigid_piece_in_a_free_beam(void **state)
{
    (void)state;
    static const double EI[] = {1e5, 1e6};
    struct model model;
    struct bf_error err;
    double found[2][4], uniform[4];
    fixture_model(&model, "");
    make_uniform(&model);
    model.support = SUPPORT_FREE_FREE;
    assert_int_equal(modes_frequencies(&model, 160, false, 4, uniform, &err), BF_OK);
    for (int k = 0; k < 2; k++) {
        model.materials[1].EI.value = EI[k];
        if (modes_frequencies(&model, 160, false, 4, found[k], &err) != BF_OK)
            fail_msg("EI = %g: %s", EI[k], err.text);
        if (!(found[k][2] > 1.005 * uniform[2] && found[k][1] < 1e-2 * found[k][2]))
            fail_msg("%g %g %g, uniform %g", found[k][0], found[k][1], found[k][2], uniform[2]);
    }
    assert_true(fabs(found[1][2] / found[0][2] - 1.0) < 1e-4);
    model_free(&model);
}

static struct exact_beam exact_of(const struct model *model)
{
    struct exact_beam beam = {.n = model->n_regions};
    for (size_t r = 0; r < model->n_regions; r++) {
        const struct material *m = model_material(model, model->regions[r].name);
        beam.span_m[r] = model->regions[r].to_m - model->regions[r].from_m;
        beam.EI[r] = m->EI.value;
        beam.rho[r] = m->rho.value;
    }
    return beam;
}

static void stepped_cantilever_has_the_exact_frequencies(void **state)
{
    (void)state;
    enum { MODES = 5 };
    static const double printed[MODES] = {6.64605, 38.36154, 95.51843, 178.74231, 305.19956};
    struct model model;
    struct bf_error err;
    double found[MODES];
    fixture_model(&model, "");
    struct exact_beam beam = exact_of(&model);
    assert_int_equal(modes_frequencies(&model, 160, false, MODES, found, &err), BF_OK);
    for (int k = 0; k < MODES; k++) {
        double exact = exact_stepped_Hz(&beam, k);
        assert_true(fabs(exact - printed[k]) < 1e-5); /* five digits, cut off */
        if (fabs(found[k] / exact - 1.0) > 1e-6)
            fail_msg("mode %d: %.9g Hz, exact %.9g Hz", k + 1, found[k], exact);
    }
    model_free(&model);
}

/* Observed order of the error of mode k between n and 2n functions. */
static double order_of_convergence(const struct model *model, size_t n, bool uniform, int k, double exact)
{
    double coarse[4], fine[4];
    struct bf_error err;
    assert_int_equal(modes_frequencies(model, n, uniform, 4, coarse, &err), BF_OK);
    assert_int_equal(modes_frequencies(model, 2 * n, uniform, 4, fine, &err), BF_OK);
    return log2(fabs(coarse[k] / exact - 1.0) / fabs(fine[k] / exact - 1.0));
}

/* Splines of degree 3 give frequencies of order 4; where y″ jumps and they cannot, the error falls as the element. */
static void knots_on_the_edges_give_the_order(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct exact_beam beam = exact_of(&model);
    double sum = 0.0;
    for (int k = 1; k < 4; k++) {
        double exact = exact_stepped_Hz(&beam, k);
        double order = order_of_convergence(&model, 20, false, k, exact);
        if (order < 3.5)
            fail_msg("mode %d: order %.2f", k + 1, order);
        sum += order_of_convergence(&model, 40, true, k, exact) / 6.0;
        sum += order_of_convergence(&model, 80, true, k, exact) / 6.0;
    }
    assert_true(sum > 0.4 && sum < 2.0); /* irregular, because the edges fall on different parts of an element */
    model_free(&model);
}

static void spaces_without_room_are_refused(void **state)
{
    (void)state;
    struct model model;
    struct fine_space space;
    struct bf_error err;
    fixture_model(&model, "");
    model.regions[0].to_m = model.regions[1].to_m; /* an empty region */
    assert_int_equal(fine_new(&model, 20, false, true, &space, &err), BF_NUMERIC);
    model_free(&model);
}

/* Also at an edge, where the second derivative jumps: what a central difference of the slope tends to. */
static void the_derivative_of_a_slope_by_its_place(void **state)
{
    const double edge = 0.08905, h = 1e-7, places[2] = {0.2113, edge};
    struct model model;
    (void)state;
    fixture_model(&model, "");
    struct fine_space space = open_space(&model, 40, false, true);
    double *g = bf_alloc(space.n, sizeof *g), *central = bf_alloc(space.n, sizeof *central);
    double *right = bf_alloc(space.n, sizeof *right);
    for (int k = 0; k < 2; k++) {
        double most = 0.0, off = 0.0, jump = 0.0;
        memset(g, 0, space.n * sizeof *g);
        memset(central, 0, space.n * sizeof *central);
        memset(right, 0, space.n * sizeof *right);
        fine_add_functional(&space, 2, places[k], 1.0, g);
        fine_add_functional(&space, 1, places[k] + h, 0.5 / h, central);
        fine_add_functional(&space, 1, places[k] - h, -0.5 / h, central);
        fine_add_functional(&space, 1, places[k] + h, 1.0 / h, right);
        fine_add_functional(&space, 1, places[k], -1.0 / h, right);
        for (size_t i = 0; i < space.n; i++) {
            most = fmax(most, fabs(g[i]));
            off = fmax(off, fabs(g[i] - central[i]));
            jump = fmax(jump, fabs(right[i] - central[i]));
        }
        assert_true(off < 1e-4 * most);
        assert_true(k == 0 ? jump < 1e-4 * most : jump > 0.1 * most);
    }
    free(g);
    free(central);
    free(right);
    fine_free(&space);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forms_are_integrals),
        cmocka_unit_test(band_is_upper_and_symmetric),
        cmocka_unit_test(point_is_the_square_of_a_functional),
        cmocka_unit_test(supports_hold_what_they_should),
        cmocka_unit_test(uniform_beams_have_the_exact_roots),
        cmocka_unit_test(stepped_cantilever_has_the_exact_frequencies),
        cmocka_unit_test(a_rigid_piece_in_a_free_beam),
        cmocka_unit_test(knots_on_the_edges_give_the_order),
        cmocka_unit_test(spaces_without_room_are_refused),
        cmocka_unit_test(the_derivative_of_a_slope_by_its_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
