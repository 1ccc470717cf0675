/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The reduced space against the fine one it was made of. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "maths/maths.h"
#include "model_fixture.h"
#include "beam/beam.h"
#include "beam/fine.h"

enum { SPLINES = 60 };

static struct reduced open_space(const struct model *model, int statics)
{
    struct reduced_options options = {
        .n_splines = SPLINES, .top_rad = 4000.0, .min_modes = 6, .max_modes = 20, .statics = statics};
    struct reduced r;
    struct bf_error err;
    if (reduced_new(model, &options, &r, &err) != BF_OK)
        fail_msg("%s", err.text);
    return r;
}

/* M and K of the beam alone on the fine space, in bands. */
static void fine_matrices(const struct reduced *r, const struct model *model, double **M, double **K)
{
    *M = bf_alloc(2 * r->space.n * FINE_BAND, sizeof(double));
    *K = *M + r->space.n * FINE_BAND;
    for (size_t i = 0; i < model->n_regions; i++) {
        const struct region *region = &model->regions[i];
        const struct material *m = model_material(model, region->name);
        fine_add_form(&r->space, 0, region->from_m, region->to_m, m->rho.value, *M);
        fine_add_form(&r->space, 2, region->from_m, region->to_m, m->EI.value, *K);
    }
}

/* A system at the model's parameters, or with EI of the first material changed by a factor. */
static void evaluate(const struct model *model, const struct reduced *r, double factor, double omega[], size_t n)
{
    struct parameter_ref *refs;
    struct bf_error err;
    struct system *system;
    size_t count = model_parameters(model, NULL, 0, &refs);
    struct parameter_map map = parameter_map_new(model, refs, count, 0);
    double *theta = bf_alloc(count, sizeof *theta);
    for (size_t i = 0; i < count; i++)
        theta[i] = refs[i].value;
    theta[map.EI[0]] *= factor;
    assert_int_equal(system_new(model, r, &map, &system, &err), BF_OK);
    assert_int_equal(system_evaluate(system, theta, NULL, &err), BF_OK);
    memcpy(omega, system->omega_rad, n * sizeof *omega);
    system_free(system);
    parameter_map_free(&map);
    free(theta);
    free(refs);
}

static void basis_is_orthonormal_in_mass(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model,
                  "  - {kind: cubic_stiffness, coefficient_Npm3: 100}\n"); /* its place is a static vector too */
    struct reduced r = open_space(&model, 2);
    double *M, *K, *y = bf_alloc(r.space.n, sizeof *y);
    fine_matrices(&r, &model, &M, &K);
    assert_true(r.n > r.n_modes + 5);
    for (size_t j = 0; j < r.n; j++) {
        fine_multiply(&r.space, M, r.V + j * r.space.n, y);
        for (size_t i = 0; i < r.n; i++)
            assert_true(fabs(dense_dot(r.space.n, r.V + i * r.space.n, y) - (i == j ? 1.0 : 0.0)) < 1e-9);
    }
    free(M);
    free(y);
    reduced_free(&r);
    model_free(&model);
}

static void modes_are_eigenvectors_of_the_fine_model(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct reduced r = open_space(&model, 2);
    double *M, *K, *y = bf_alloc(2 * r.space.n, sizeof *y), *z = y + r.space.n;
    fine_matrices(&r, &model, &M, &K);
    for (size_t k = 0; k < r.n_modes; k++) {
        double square = r.frequency_rad[k] * r.frequency_rad[k], worst = 0.0, size = 0.0;
        fine_multiply(&r.space, K, r.V + k * r.space.n, y);
        fine_multiply(&r.space, M, r.V + k * r.space.n, z);
        for (size_t i = 0; i < r.space.n; i++) {
            worst = fmax(worst, fabs(y[i] - square * z[i]));
            size = fmax(size, fabs(square * z[i]));
        }
        assert_true(worst < 1e-6 * size);
    }
    double *omega = bf_alloc(r.n, sizeof *omega);
    evaluate(&model, &r, 1.0, omega, r.n);
    for (size_t k = 0; k < r.n_modes; k++) { /* a dense solver rounds at the largest eigenvalue */
        double rounding = 1e-15 * pow(omega[r.n - 1] / omega[k], 2.0) + 1e-10;
        assert_true(rounding < 1e-6 && fabs(omega[k] / r.frequency_rad[k] - 1.0) < rounding);
    }
    free(omega);
    free(M);
    free(y);
    reduced_free(&r);
    model_free(&model);
}

/* cᵀK⁻¹b in both spaces, for every input and output. */
static void static_responses_are_exact(void **state)
{
    (void)state;
    struct model model;
    struct bf_error err;
    fixture_model(&model, "");
    struct reduced r = open_space(&model, 1), modes_only = open_space(&model, 0);
    double *M, *K, *fine = bf_alloc(r.space.n, sizeof *fine), *x = bf_alloc(r.space.n, sizeof *x);
    double *g = bf_alloc(r.n, sizeof *g), *a = bf_alloc(r.n, sizeof *a), *A = bf_alloc(r.n * r.n, sizeof *A);
    struct sparse_factor *factor;
    fine_matrices(&r, &model, &M, &K);
    assert_int_equal(sparse_factorise(r.space.n, FINE_BAND, K, &factor, &err), BF_OK);
    for (size_t j = 0; j < r.n; j++) { /* VᵀKV */
        fine_multiply(&r.space, K, r.V + j * r.space.n, x);
        dense_gemv(true, r.space.n, r.n, 1.0, r.V, x, 0.0, A + j * r.n);
    }
    assert_true(modes_only.n == modes_only.n_modes && modes_only.n < r.n);
    for (size_t i = 0; i < model.n_inputs; i++) {
        memset(fine, 0, r.space.n * sizeof *fine);
        if (model.inputs[i].kind == INPUT_POINT_FORCE) {
            fine_add_functional(&r.space, 0, model.inputs[i].at_m, 1.0, fine);
        } else {
            fine_add_functional(&r.space, 1, model.inputs[i].to_m, 1.0, fine);
            fine_add_functional(&r.space, 1, model.inputs[i].from_m, -1.0, fine);
        }
        assert_int_equal(sparse_solve(factor, fine, x, &err), BF_OK);
        reduced_input(&r, &model.inputs[i], a);
        assert_int_equal(dense_cholesky_solve(r.n, 1, A, a, &err), BF_OK);
        double *back = bf_alloc(r.space.n, sizeof *back), largest = 0.0;
        dense_gemv(false, r.space.n, r.n, 1.0, r.V, a, 0.0, back);
        for (size_t k = 0; k < r.space.n; k++)
            largest = fmax(largest, fabs(x[k]));
        for (size_t k = 0; k < r.space.n; k++) /* the whole shape, not only at the sensors */
            assert_true(fabs(back[k] - x[k]) < 1e-9 * largest);
        free(back);
    }
    sparse_free(factor);
    free(M);
    free(fine);
    free(x);
    free(g);
    free(a);
    free(A);
    reduced_free(&r);
    reduced_free(&modes_only);
    model_free(&model);
}

/* A pair of moments on a short span of a cantilever bends nothing but the span: its ends turn by h/EI against each other. */
static void span_of_a_crack_bends_as_it_should(void **state)
{
    (void)state;
    struct model model;
    struct bf_error err;
    fixture_model(&model, "  - {kind: bilinear_stiffness, change_Nmprad: 20, at_m: 0.2, width_m: 0.005}\n");
    struct reduced r = open_space(&model, 1);
    double *M, *K, *x = bf_alloc(r.space.n, sizeof *x), *g = bf_alloc(r.n, sizeof *g), *a = bf_alloc(r.n, sizeof *a);
    double *A = bf_alloc(r.n * r.n, sizeof *A);
    fine_matrices(&r, &model, &M, &K);
    for (size_t j = 0; j < r.n; j++) {
        fine_multiply(&r.space, K, r.V + j * r.space.n, x);
        dense_gemv(true, r.space.n, r.n, 1.0, r.V, x, 0.0, A + j * r.n);
    }
    const struct model_input pair = {.kind = INPUT_PATCH_MOMENT, .from_m = 0.1975, .to_m = 0.2025};
    reduced_input(&r, &pair, g);
    memcpy(a, g, r.n * sizeof *a);
    assert_int_equal(dense_cholesky_solve(r.n, 1, A, a, &err), BF_OK);
    const double compliance = 0.005 / model.materials[0].EI.value;
    assert_true(fabs(dense_dot(r.n, g, a) / compliance - 1.0) < 1e-6);
    free(M), free(x), free(g), free(a), free(A); /* K stands behind M */
    reduced_free(&r);
    model_free(&model);
}

/* Away from the base the error of a frequency is of second order: half the distance, a quarter of the error. */
static void error_away_from_the_base_is_of_second_order(void **state)
{
    (void)state;
    enum { MODES = 4 };
    static const double distance[2] = {0.2, 0.1};
    struct model model;
    double error[2][MODES];
    fixture_model(&model, "");
    struct reduced base = open_space(&model, 2);
    for (int i = 0; i < 2; i++) {
        double here[MODES], there[MODES];
        evaluate(&model, &base, 1.0 + distance[i], here, MODES);
        model.materials[0].EI.value *= 1.0 + distance[i];
        struct reduced moved = open_space(&model, 2);
        evaluate(&model, &moved, 1.0, there, MODES);
        model.materials[0].EI.value /= 1.0 + distance[i];
        reduced_free(&moved);
        for (int k = 0; k < MODES; k++) {
            error[i][k] = here[k] / there[k] - 1.0;
            assert_true(error[i][k] > -1e-10); /* a subspace is stiffer */
            assert_true(error[i][k] < 1e-3);
        }
    }
    for (int k = 0; k < MODES; k++) {
        double order = log2(error[0][k] / error[1][k]);
        if (error[0][k] > 1e-9 && order < 1.7)
            fail_msg("mode %d: order %.2f (%.2g, %.2g)", k + 1, order, error[0][k], error[1][k]);
    }
    assert_true(error[0][MODES - 1] > 1e-9); /* there is something to measure */
    reduced_free(&base);
    model_free(&model);
}

static void places_and_their_derivatives(void **state)
{
    (void)state;
    struct model model;
    fixture_model(&model, "");
    struct reduced r = open_space(&model, 2);
    double *g = bf_alloc(6 * r.n, sizeof *g), *g_at = g + r.n, *up = g_at + r.n, *down = up + r.n, *one = down + r.n;
    double *other = one + r.n;
    const double h = 1e-5;
    for (int slope = 0; slope < 2; slope++) {
        struct beam_operator place = {.kind = slope ? BEAM_AT_SLOPE : BEAM_AT_POINT, .at_m = 0.2903};
        reduced_place(&r, &place, &model, g, g_at);
        reduced_point(&r, slope, place.at_m, one);
        reduced_point(&r, slope, place.at_m + h, up);
        reduced_point(&r, slope, place.at_m - h, down);
        for (size_t i = 0; i < r.n; i++) {
            double difference = (up[i] - down[i]) / (2.0 * h);
            assert_true(fabs(g[i] - one[i]) < 1e-12 * (1.0 + fabs(one[i])));
            assert_true(fabs(g_at[i] - difference) < 1e-4 * (1.0 + fabs(difference)));
        }
    }
    struct beam_operator patch = {.kind = BEAM_AT_PATCH};
    struct beam_operator pair = {.kind = BEAM_AT_SLOPE_DIFFERENCE, .from_m = 0.02535, .to_m = 0.08905};
    reduced_place(&r, &patch, &model, g, g_at);
    reduced_place(&r, &pair, &model, up, g_at);
    reduced_point(&r, 1, 0.08905, one);
    reduced_point(&r, 1, 0.02535, other);
    for (size_t i = 0; i < r.n; i++) {
        assert_true(fabs(g[i] - up[i]) < 1e-12 * (1.0 + fabs(g[i])));
        assert_true(fabs(g[i] - (one[i] - other[i])) < 1e-12 * (1.0 + fabs(one[i])));
    }
    struct beam_operator nothing = {.kind = BEAM_OVER_SLOPE};
    reduced_place(&r, &nothing, &model, g, g_at);
    for (size_t i = 0; i < r.n; i++)
        assert_true(fabs(g[i]) + fabs(g_at[i]) < 1e-300);
    free(g);
    reduced_free(&r);
    model_free(&model);
}

static double root_slope(const char *effects)
{
    struct model model;
    fixture_model(&model, effects);
    struct reduced r = open_space(&model, 2);
    double *g = bf_alloc(r.n, sizeof *g), sum = 0.0;
    reduced_point(&r, 1, 0.0, g);
    for (size_t i = 0; i < r.n; i++)
        sum += fabs(g[i]);
    free(g);
    reduced_free(&r);
    model_free(&model);
    return sum;
}

static void root_turns_only_where_an_effect_releases_it(void **state)
{
    (void)state;
    assert_true(root_slope("") < 1e-9);
    assert_true(root_slope("  - {kind: tip_mass, mass_kg: 0.001}\n") < 1e-9);
    assert_true(root_slope("  - {kind: root_compliance, compliance_radpNm: 0.01, loss_s: 1e-5}\n") > 1e-3);
}

static void limit_is_kept(void **state)
{
    (void)state;
    struct model model;
    struct reduced r;
    struct bf_error err;
    struct reduced_options options = {
        .n_splines = SPLINES, .top_rad = INFINITY, .min_modes = 7, .max_modes = 7, .statics = 2, .limit = 10};
    fixture_model(&model, "");
    assert_int_equal(reduced_new(&model, &options, &r, &err), BF_OK);
    assert_int_equal(r.n, 10);
    assert_int_equal(r.n_modes, 7);
    reduced_free(&r);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(basis_is_orthonormal_in_mass),
        cmocka_unit_test(modes_are_eigenvectors_of_the_fine_model),
        cmocka_unit_test(static_responses_are_exact),
        cmocka_unit_test(span_of_a_crack_bends_as_it_should),
        cmocka_unit_test(error_away_from_the_base_is_of_second_order),
        cmocka_unit_test(places_and_their_derivatives),
        cmocka_unit_test(root_turns_only_where_an_effect_releases_it),
        cmocka_unit_test(limit_is_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
