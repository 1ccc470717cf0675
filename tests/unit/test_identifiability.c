/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Identifiability of Jacobians whose null directions were built in. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "estimate/estimate.h"
#include "estimate/identifiability.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { ROWS = 40, N = 4 };
static const double ones[N] = {1.0, 1.0, 1.0, 1.0}, none[N];

/* Columns of very different shape, 1000 in size: standard errors near 10⁻³. */
static void fill(double J[ROWS * N])
{
    for (size_t j = 0; j < N; j++)
        for (size_t i = 0; i < ROWS; i++)
            J[i + j * ROWS] = 1000.0 * sin(0.3 * (double)((j + 1) * i) + (double)j);
}

/* Column 2 ← −(a column 0 + b column 1): the direction (a, b, 1, 0) has no effect. */
static void tie(double J[ROWS * N], double a, double b)
{
    for (size_t i = 0; i < ROWS; i++)
        J[i + 2 * ROWS] = -(a * J[i] + b * J[i + ROWS]);
}

static void a_full_jacobian_determines_everything(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    double J[ROWS * N];
    fill(J);
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 1.0, &id, &err), BF_OK);
    assert_int_equal(id.n_null, 0);
    assert_int_equal(id.kept, N);
    for (size_t i = 0; i < N; i++)
        assert_true(id.determined[i]);
    identifiability_free(&id);
}

static void a_built_in_direction_is_found(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    double J[ROWS * N];
    fill(J);
    tie(J, 1.0, -0.5);
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 1.0, &id, &err), BF_OK);
    assert_int_equal(id.n_null, 1);
    assert_int_equal(id.kept, N - 1);
    assert_true(id.null[0].ratio < 1e-12);
    assert_false(id.null[0].pinned);
    const double norm = 1.5, expected[N] = {1.0 / norm, -0.5 / norm, 1.0 / norm, 0.0};
    for (size_t i = 0; i < N; i++)
        assert_near(id.null[0].weight[i], expected[i], 1e-9);
    const bool determined[N] = {false, false, false, true};
    for (size_t i = 0; i < N; i++)
        assert_int_equal(id.determined[i], determined[i]);
    identifiability_free(&id);
}

static void a_prior_pins_the_direction(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    const double precision[N] = {1.0 / (0.03 * 0.03), 0.0, 0.0, 0.0};
    double J[ROWS * N];
    fill(J);
    tie(J, 1.0, 1.0);
    assert_int_equal(identifiability_compute(ROWS, N, J, precision, ones, 1.0, &id, &err), BF_OK);
    assert_int_equal(id.n_null, 1); /* the data alone do not know it … */
    assert_true(id.null[0].pinned); /* … but the prior does */
    assert_int_equal(id.kept, N);
    for (size_t i = 0; i < N; i++)
        assert_true(id.determined[i]);
    identifiability_free(&id);
}

/* A weak prior (sd 300 %) determines nothing to better than 100 %. */
static void a_weak_prior_does_not(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    const double precision[N] = {1.0 / 9.0, 0.0, 0.0, 0.0};
    double J[ROWS * N];
    fill(J);
    tie(J, 1.0, 1.0);
    assert_int_equal(identifiability_compute(ROWS, N, J, precision, ones, 1.0, &id, &err), BF_OK);
    assert_false(id.null[0].pinned);
    assert_false(id.determined[0]);
    assert_true(id.determined[3]);
    identifiability_free(&id);
}

static void two_directions_come_out_apart(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    double J[ROWS * N];
    fill(J);
    for (size_t i = 0; i < ROWS; i++) {
        J[i + ROWS] = -J[i];   /* 0 and 1 together */
        J[i + 3 * ROWS] = 0.0; /* 3 alone */
    }
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 1.0, &id, &err), BF_OK);
    assert_int_equal(id.n_null, 2);
    for (size_t k = 0; k < 2; k++) { /* either 3 alone, or 0 and 1 and nothing else */
        const double *w = id.null[k].weight;
        const bool alone = fabs(w[3]) > 0.5;
        assert_near(w[3], alone ? 1.0 : 0.0, 1e-9);
        assert_near(w[0], alone ? 0.0 : sqrt(0.5), 1e-9);
        assert_near(w[1], w[0], 1e-9);
    }
    assert_true(fabs(id.null[0].weight[3] - id.null[1].weight[3]) > 0.5);
    assert_true(id.determined[2]);
    identifiability_free(&id);
}

static void a_large_residual_hides_more(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    double J[ROWS * N];
    fill(J);
    for (size_t i = 0; i < ROWS; i++)
        J[i + 3 * ROWS] *= 1e-3; /* standard error near 20 % at the noise */
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 1.0, &id, &err), BF_OK);
    assert_true(id.determined[3]);
    identifiability_free(&id);
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 30.0, &id, &err), BF_OK);
    assert_false(id.determined[3]);
    assert_true(id.determined[0]);
    identifiability_free(&id);
}

static void fewer_rows_than_unknowns(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    const double J[2 * N] = {1e3, 0.0, 0.0, 1e3, 0.0, 0.0, 0.0, 0.0};
    assert_int_equal(identifiability_compute(2, N, J, none, ones, 1.0, &id, &err), BF_OK);
    assert_int_equal(id.n_null, 2);
    assert_true(id.determined[0] && id.determined[1]);
    assert_false(id.determined[2] || id.determined[3]);
    identifiability_free(&id);
    assert_int_equal(identifiability_compute(2, 0, J, none, ones, 1.0, &id, &err), BF_OK);
    identifiability_free(&id);
}

static void a_jacobian_that_is_not_finite_is_refused(void **state)
{
    (void)state;
    struct bf_error err;
    struct identifiability id;
    double J[ROWS * N];
    fill(J);
    J[5] = nan("");
    assert_int_equal(identifiability_compute(ROWS, N, J, none, ones, 1.0, &id, &err), BF_NUMERIC);
}

static void words_name_the_parameters_and_the_remedy(void **state)
{
    (void)state;
    static const char *const labels[N] = {"EI_beam_Nm2", "rho_beam_kgpm", "Ks_V", "mass_kg"};
    double together[N] = {0.58, 0.58, 0.58, 0.0}, against[N] = {0.7, 0.0, -0.7, 0.0}, alone[N] = {0.0, 0.0, 0.0, 1.0};
    struct null_direction direction = {.ratio = 0.0, .weight = together};
    char *text = identifiability_text(N, labels, &direction);
    assert_non_null(strstr(text, "EI_beam_Nm2, rho_beam_kgpm, Ks_V scale together"));
    assert_non_null(strstr(text, "weigh the beam"));
    assert_null(strstr(text, "mass_kg"));
    free(text);
    direction.weight = against;
    text = identifiability_text(N, labels, &direction);
    assert_non_null(strstr(text, "EI_beam_Nm2 can grow by a common factor while Ks_V shrinks"));
    free(text);
    direction.weight = alone, direction.pinned = true;
    text = identifiability_text(N, labels, &direction);
    assert_non_null(strstr(text, "mass_kg has no influence"));
    assert_non_null(strstr(text, "a prior fixes it"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_full_jacobian_determines_everything),
        cmocka_unit_test(a_built_in_direction_is_found),
        cmocka_unit_test(a_prior_pins_the_direction),
        cmocka_unit_test(a_weak_prior_does_not),
        cmocka_unit_test(two_directions_come_out_apart),
        cmocka_unit_test(a_large_residual_hides_more),
        cmocka_unit_test(fewer_rows_than_unknowns),
        cmocka_unit_test(a_jacobian_that_is_not_finite_is_refused),
        cmocka_unit_test(words_name_the_parameters_and_the_remedy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
