/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sparse solves and modes against dense ones. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "maths/maths.h"
#include "dense_solve.h"
#include "signals.h"

enum { N = 40, WIDTH = 4, MODES = 6 };

/* A random symmetric band matrix whose diagonal outweighs its rows. */
static void random_band(unsigned number, double band[N * WIDTH])
{
    uint64_t seed = signal_seed(number);
    for (size_t i = 0; i < N; i++)
        for (size_t d = 0; d < WIDTH; d++)
            band[i * WIDTH + d] = d == 0 ? 8.0 + (double)i + signal_uniform(&seed) : signal_normal(&seed);
}

static void to_dense(const double band[N * WIDTH], double A[N * N])
{
    memset(A, 0, N * N * sizeof *A);
    for (size_t i = 0; i < N; i++)
        for (size_t d = 0; d < WIDTH && i + d < N; d++)
            A[i + (i + d) * N] = A[(i + d) + i * N] = band[i * WIDTH + d];
}

static void multiply_dense(const void *context, const double x[], double y[])
{
    dense_gemv(false, N, N, 1.0, context, x, 0.0, y);
}

static void solve_is_the_dense_one(void **state)
{
    (void)state;
    double band[N * WIDTH], A[N * N], b[N], x[N], y[N];
    struct sparse_factor *factor;
    struct bf_error err;
    random_band(1, band);
    to_dense(band, A);
    for (size_t i = 0; i < N; i++)
        b[i] = y[i] = cos((double)i);
    assert_int_equal(sparse_factorise(N, WIDTH, band, &factor, &err), BF_OK);
    for (int repeat = 0; repeat < 3; repeat++) { /* work space is kept between solves */
        assert_int_equal(sparse_solve(factor, b, x, &err), BF_OK);
        memcpy(y, b, sizeof y);
        dense_solve(N, A, y);
        for (size_t i = 0; i < N; i++)
            assert_true(fabs(x[i] - y[i]) < 1e-13);
        b[repeat] += 1.0;
    }
    assert_int_equal(sparse_solve(factor, b, b, &err), BF_OK); /* in place */
    dense_gemv(false, N, N, 1.0, A, b, 0.0, y);
    assert_true(fabs(y[N - 1] - cos((double)(N - 1))) < 1e-12);
    sparse_free(factor);
}

static void modes_are_the_dense_ones(void **state)
{
    (void)state;
    static const double shifts[] = {0.0, -3.0};
    double K[N * WIDTH], M[N * WIDTH], shifted[N * WIDTH], dense_K[N * N], dense_M[N * N];
    double values[N], vectors[N * N], found[MODES], shape[MODES * N];
    struct bf_error err;
    random_band(2, K);
    random_band(3, M);
    to_dense(K, dense_K);
    to_dense(M, dense_M);
    assert_int_equal(dense_symmetric_eigen(N, dense_K, dense_M, values, vectors, &err), BF_OK);
    for (int s = 0; s < 2; s++) {
        struct sparse_factor *factor;
        for (size_t i = 0; i < N * WIDTH; i++)
            shifted[i] = K[i] - shifts[s] * M[i];
        assert_int_equal(sparse_factorise(N, WIDTH, shifted, &factor, &err), BF_OK);
        assert_int_equal(sparse_modes(factor, N, MODES, shifts[s], multiply_dense, dense_M, found, shape, &err), BF_OK);
        for (size_t k = 0; k < MODES; k++) {
            double Mv[N], overlap, largest = 0.0;
            assert_true(fabs(found[k] / values[k] - 1.0) < 1e-11);
            multiply_dense(dense_M, shape + k * N, Mv);
            assert_true(fabs(dense_dot(N, shape + k * N, Mv) - 1.0) < 1e-11);
            overlap = fabs(dense_dot(N, vectors + k * N, Mv));
            assert_true(fabs(overlap - 1.0) < 1e-8); /* the same direction */
            for (size_t i = 0; i < N; i++)
                if (fabs(shape[k * N + i]) > fabs(largest))
                    largest = shape[k * N + i];
            assert_true(largest > 0.0);
        }
        sparse_free(factor);
    }
}

static void as_many_modes_as_possible(void **state)
{
    (void)state;
    double K[N * WIDTH], M[N * WIDTH], dense_K[N * N], dense_M[N * N], values[N], found[N], shape[N * N];
    struct sparse_factor *factor;
    struct bf_error err;
    random_band(4, K);
    random_band(5, M);
    to_dense(K, dense_K);
    to_dense(M, dense_M);
    assert_int_equal(dense_symmetric_eigen(N, dense_K, dense_M, values, NULL, &err), BF_OK);
    assert_int_equal(sparse_factorise(N, WIDTH, K, &factor, &err), BF_OK);
    assert_int_equal(sparse_modes(factor, N, N - 2, 0.0, multiply_dense, dense_M, found, shape, &err), BF_OK);
    for (size_t k = 0; k < N - 2; k++)
        assert_true(fabs(found[k] / values[k] - 1.0) < 1e-10);
    assert_int_equal(sparse_modes(factor, N, N - 1, 0.0, multiply_dense, dense_M, found, shape, &err), BF_NUMERIC);
    assert_non_null(strstr(err.text, "39 modes"));
    sparse_free(factor);
}

static void indefinite_and_singular_are_refused(void **state)
{
    (void)state;
    double band[N * WIDTH];
    struct sparse_factor *factor = NULL;
    struct bf_error err;
    random_band(6, band);
    band[7 * WIDTH] = -1.0;
    assert_int_equal(sparse_factorise(N, WIDTH, band, &factor, &err), BF_NUMERIC);
    assert_non_null(strstr(err.text, "positive definite"));
    memset(band, 0, sizeof band);
    assert_int_equal(sparse_factorise(N, WIDTH, band, &factor, &err), BF_NUMERIC);
    random_band(6, band);
    band[0] = NAN;
    assert_int_equal(sparse_factorise(N, WIDTH, band, &factor, &err), BF_NUMERIC);
    sparse_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(solve_is_the_dense_one),
        cmocka_unit_test(modes_are_the_dense_ones),
        cmocka_unit_test(as_many_modes_as_possible),
        cmocka_unit_test(indefinite_and_singular_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
