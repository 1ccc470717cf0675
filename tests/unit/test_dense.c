/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Dense algebra: every answer is checked by the equation it must satisfy, computed with plain loops. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>
#include "maths/maths.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { N = 7, M = 12 };

static uint64_t seed = 1;

/* Uniform in (−1, 1), the same on every machine (SplitMix64). */
static double next_random(void)
{
    uint64_t z = (seed += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return 2.0 * ((double)((z ^ (z >> 31)) >> 11) * 0x1p-53) - 1.0;
}

static void fill(size_t n, double x[])
{
    for (size_t i = 0; i < n; i++)
        x[i] = next_random();
}

/* Symmetric positive definite: XᵀX + ½ I. */
static void fill_positive(double A[N * N])
{
    double X[N * N];
    fill(N * N, X);
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++) {
            A[i + j * N] = i == j ? 0.5 : 0.0;
            for (size_t k = 0; k < N; k++)
                A[i + j * N] += X[k + i * N] * X[k + j * N];
        }
}

/* 2000 rows of the last block are as good as any other. */
static void triangle_of_a_long_matrix(void **state)
{
    (void)state;
    enum { ROWS = 5 * 65536 + 2000, COLUMNS = 3 };
    struct bf_error err;
    double *A = malloc(sizeof(double) * ROWS * COLUMNS), R[COLUMNS * COLUMNS], gram[COLUMNS * COLUMNS];
    assert_non_null(A);
    fill((size_t)ROWS * COLUMNS, A);
    assert_int_equal(dense_qr_triangle(ROWS, COLUMNS, A, R, &err), BF_OK);
    dense_gram(ROWS, COLUMNS, A, gram);
    for (size_t i = 0; i < COLUMNS; i++)
        for (size_t j = 0; j < COLUMNS; j++) {
            double sum = 0.0;
            for (size_t k = 0; k < COLUMNS; k++)
                sum += R[k + i * COLUMNS] * R[k + j * COLUMNS];
            assert_true(fabs(sum - gram[i + j * COLUMNS]) < 1e-12 * gram[0]);
            assert_true(i <= j || fabs(R[i + j * COLUMNS]) <= 0.0);
        }
    free(A);
}

static void symmetric_eigenvectors_solve_the_problem(void **state)
{
    (void)state;
    struct bf_error err;
    double K[N * N], B[N * N], values[N], V[N * N];
    fill_positive(K);
    fill_positive(B);
    assert_int_equal(dense_symmetric_eigen(N, K, B, values, V, &err), BF_OK);
    for (size_t j = 0; j < N; j++) {
        assert_true(j == 0 || values[j] >= values[j - 1]);
        double norm = 0.0;
        for (size_t i = 0; i < N; i++) {
            double Kv = 0.0, Bv = 0.0;
            for (size_t k = 0; k < N; k++) {
                Kv += K[i + k * N] * V[k + j * N];
                Bv += B[i + k * N] * V[k + j * N];
            }
            assert_near(Kv, values[j] * Bv, 1e-11);
            norm += V[i + j * N] * Bv;
        }
        assert_near(norm, 1.0, 1e-12);
    }
}

static void symmetric_eigen_says_when_the_mass_is_not_positive(void **state)
{
    (void)state;
    struct bf_error err;
    const double K[4] = {1.0, 0.0, 0.0, 1.0}, B[4] = {1.0, 0.0, 0.0, -1.0};
    double values[2];
    assert_int_equal(dense_symmetric_eigen(2, K, B, values, NULL, &err), BF_NUMERIC);
    assert_true(strlen(err.text) > 0);
}

static void general_eigenvectors_stand_left_and_right(void **state)
{
    (void)state;
    struct bf_error err;
    double A[N * N];
    double complex values[N], left[N * N], right[N * N];
    fill(N * N, A);
    A[1] = 4.0, A[N] = -4.0; /* a rotation: at least one complex pair */
    assert_int_equal(dense_general_eigen(N, A, values, left, right, &err), BF_OK);
    size_t complex_count = 0;
    for (size_t j = 0; j < N; j++) {
        complex_count += cimag(values[j]) != 0.0;
        for (size_t i = 0; i < N; i++) {
            double complex Av = 0.0, uA = 0.0;
            for (size_t k = 0; k < N; k++) {
                Av += A[i + k * N] * right[k + j * N];
                uA += conj(left[k + j * N]) * A[k + i * N];
            }
            assert_true(cabs(Av - values[j] * right[i + j * N]) < 1e-12);
            assert_true(cabs(uA - values[j] * conj(left[i + j * N])) < 1e-12);
        }
    }
    assert_true(complex_count >= 2);
}

static void a_solve_leaves_no_residual(void **state)
{
    (void)state;
    struct bf_error err;
    double P[N * N], x[2 * N], b[2 * N];
    fill_positive(P);
    fill(2 * N, b);
    memcpy(x, b, sizeof x);
    assert_int_equal(dense_cholesky_solve(N, 2, P, x, &err), BF_OK);
    for (size_t i = 0; i < 2 * N; i++) {
        double sum = 0.0;
        for (size_t k = 0; k < N; k++)
            sum += P[i % N + k * N] * x[k + i / N * N];
        assert_near(sum, b[i], 1e-12);
    }
}

static void indefinite_matrices_are_refused(void **state)
{
    (void)state;
    struct bf_error err;
    double b[2] = {1.0, 1.0};
    const double indefinite[4] = {1.0, 2.0, 2.0, 1.0};
    assert_int_equal(dense_cholesky_solve(2, 1, indefinite, b, &err), BF_NUMERIC);
}

static void products_agree_with_loops(void **state)
{
    (void)state;
    double A[M * N], G[N * N], C[N * N], x[M], y[N] = {0};
    fill(M * N, A);
    fill(M, x);
    dense_gram(M, N, A, G);
    dense_gemm(true, false, N, N, M, 2.0, A, A, 0.0, C);
    dense_gemv(true, M, N, 1.0, A, x, 0.0, y);
    for (size_t i = 0; i < N; i++) {
        double sum = 0.0;
        for (size_t k = 0; k < M; k++)
            sum += A[k + i * M] * x[k];
        assert_near(y[i], sum, 1e-13);
        for (size_t j = 0; j < N; j++) {
            double g = 0.0;
            for (size_t k = 0; k < M; k++)
                g += A[k + i * M] * A[k + j * M];
            assert_near(G[i + j * N], g, 1e-13);
            assert_near(C[i + j * N], 2.0 * g, 1e-13);
        }
    }
}

static void singular_values_rebuild_the_matrix(void **state)
{
    (void)state;
    struct bf_error err;
    double A[M * N], U[M * N], s[N], V[N * N];
    fill(M * N, A);
    assert_int_equal(dense_svd(M, N, A, U, s, V, &err), BF_OK);
    for (size_t i = 0; i < M; i++)
        for (size_t j = 0; j < N; j++) {
            double sum = 0.0;
            for (size_t k = 0; k < N; k++)
                sum += U[i + k * M] * s[k] * V[j + k * N];
            assert_near(sum, A[i + j * M], 1e-13);
        }
    for (size_t k = 1; k < N; k++)
        assert_true(s[k] <= s[k - 1]);
}

static void a_wide_matrix_has_its_null_space(void **state)
{
    (void)state;
    struct bf_error err;
    double A[2 * 3] = {1.0, 0.0, 1.0, 1.0, 0.0, 1.0}, s[2], V[9];
    assert_int_equal(dense_svd(2, 3, A, NULL, s, V, &err), BF_OK);
    for (size_t i = 0; i < 2; i++)
        assert_near(A[i] * V[6] + A[i + 2] * V[7] + A[i + 4] * V[8], 0.0, 1e-14);
}

static void the_triangle_has_the_gram_matrix(void **state)
{
    (void)state;
    struct bf_error err;
    double A[M * N], R[N * N], G[N * N], H[N * N];
    fill(M * N, A);
    assert_int_equal(dense_qr_triangle(M, N, A, R, &err), BF_OK);
    dense_gram(M, N, A, G);
    dense_gram(N, N, R, H);
    for (size_t i = 0; i < N * N; i++)
        assert_near(G[i], H[i], 1e-12);
    assert_int_equal(dense_qr_triangle(2, 3, A, R, &err), BF_NUMERIC);
}

static void a_basis_leaves_dependent_columns_out(void **state)
{
    (void)state;
    struct bf_error err;
    double A[M * 3], Q[M * 3];
    size_t rank;
    fill(M * 2, A);
    for (size_t i = 0; i < M; i++)
        A[i + 2 * M] = 2.0 * A[i] - A[i + M];
    assert_int_equal(dense_orthonormal(M, 3, A, 1e-10, Q, NULL, &rank, &err), BF_OK);
    assert_int_equal(rank, 2);
    for (size_t j = 0; j < 3; j++) { /* every column of A lies in the span of Q */
        double rest[M];
        memcpy(rest, A + j * M, sizeof rest);
        for (size_t k = 0; k < rank; k++) {
            const double along = dense_dot(M, Q + k * M, A + j * M);
            for (size_t i = 0; i < M; i++)
                rest[i] -= along * Q[i + k * M];
        }
        assert_true(dense_norm(M, rest) < 1e-12);
    }
    memset(A, 0, sizeof A);
    assert_int_equal(dense_orthonormal(M, 3, A, 1e-10, Q, NULL, &rank, &err), BF_OK);
    assert_int_equal(rank, 0);
}

/* Decays, as records have them: five of them, one nearly another, one a sum of two. [TALL][TALL_COLUMNS] */
enum { TALL = 5000, TALL_COLUMNS = 6 };

static double *tall_matrix(void)
{
    static const double rate[] = {1e-4, 3e-4, 1e-3, 3e-3, 3.0000003e-3};
    double *A = bf_alloc(TALL * TALL_COLUMNS, sizeof *A);
    for (size_t j = 0; j + 1 < TALL_COLUMNS; j++)
        for (size_t i = 0; i < TALL; i++)
            A[i + j * TALL] = exp(-rate[j] * (double)i);
    for (size_t i = 0; i < TALL; i++)
        A[i + (TALL_COLUMNS - 1) * TALL] = A[i] - 2.0 * A[i + TALL];
    return A;
}

static void a_tall_basis_is_orthonormal_and_makes_the_columns_again(void **state)
{
    (void)state;
    struct bf_error err;
    double *A = tall_matrix(), *Q = bf_alloc(TALL * TALL_COLUMNS, sizeof *Q);
    double QA[TALL_COLUMNS * TALL_COLUMNS], G[TALL_COLUMNS * TALL_COLUMNS], off = 0.0, far = 0.0;
    size_t rank;
    assert_int_equal(dense_orthonormal(TALL, TALL_COLUMNS, A, 1e-12, Q, QA, &rank, &err), BF_OK);
    assert_int_equal(rank, TALL_COLUMNS - 1);
    dense_gram(TALL, rank, Q, G);
    for (size_t i = 0; i < rank; i++)
        for (size_t j = 0; j < rank; j++)
            off = fmax(off, fabs(G[i + j * rank] - (i == j ? 1.0 : 0.0)));
    dense_gemm(false, false, TALL, TALL_COLUMNS, rank, 1.0, Q, QA, -1.0, A);
    for (size_t i = 0; i < TALL * TALL_COLUMNS; i++)
        far = fmax(far, fabs(A[i]));
    assert_true(off < 1e-13);
    assert_true(far < 1e-12);
    free(A), free(Q);
}

/* The solution that the right-hand side was made of, and nothing left where columns depend on each other. */
static void a_tall_system_is_solved(void **state)
{
    (void)state;
    static const double of[] = {1.0, -2.0, 0.5, 3.0};
    enum { INDEPENDENT = 4 };
    struct bf_error err;
    double *A = tall_matrix(), *b = bf_alloc(TALL, sizeof *b), x[TALL_COLUMNS], left = 0.0;
    size_t rank;
    dense_gemv(false, TALL, INDEPENDENT, 1.0, A, of, 0.0, b);
    assert_int_equal(dense_least_squares(TALL, INDEPENDENT, A, b, 1e-12, x, &rank, &err), BF_OK);
    assert_int_equal(rank, INDEPENDENT);
    for (size_t j = 0; j < INDEPENDENT; j++)
        assert_near(x[j], of[j], 1e-9);
    assert_int_equal(dense_least_squares(TALL, TALL_COLUMNS, A, b, 1e-12, x, &rank, &err), BF_OK);
    assert_int_equal(rank, TALL_COLUMNS - 1);
    dense_gemv(false, TALL, TALL_COLUMNS, 1.0, A, x, -1.0, b);
    for (size_t i = 0; i < TALL; i++)
        left = fmax(left, fabs(b[i]));
    assert_true(left < 1e-10);
    free(A), free(b);
}

static void a_tall_triangle_has_the_gram_matrix(void **state)
{
    (void)state;
    struct bf_error err;
    double *A = tall_matrix(), R[TALL_COLUMNS * TALL_COLUMNS], G[TALL_COLUMNS * TALL_COLUMNS],
           H[TALL_COLUMNS * TALL_COLUMNS];
    assert_int_equal(dense_qr_triangle(TALL, TALL_COLUMNS, A, R, &err), BF_OK);
    dense_gram(TALL, TALL_COLUMNS, A, G);
    dense_gram(TALL_COLUMNS, TALL_COLUMNS, R, H);
    for (size_t j = 0; j < TALL_COLUMNS; j++)
        for (size_t i = 0; i < TALL_COLUMNS; i++) {
            assert_near(G[i + j * TALL_COLUMNS], H[i + j * TALL_COLUMNS], 1e-9);
            assert_true(i <= j || R[i + j * TALL_COLUMNS] == 0.0);
        }
    free(A);
}

static void rank_deficient_least_squares_has_minimum_norm(void **state)
{
    (void)state;
    struct bf_error err;
    const double A[3 * 2] = {1.0, 2.0, 3.0, 1.0, 2.0, 3.0}, b[3] = {2.0, 4.0, 6.0};
    double x[2];
    size_t rank;
    assert_int_equal(dense_least_squares(3, 2, A, b, 1e-10, x, &rank, &err), BF_OK);
    assert_int_equal(rank, 1);
    assert_near(x[0], 1.0, 1e-12);
    assert_near(x[1], 1.0, 1e-12);
}

static void what_is_not_finite_is_refused(void **state)
{
    (void)state;
    struct bf_error err;
    double A[4] = {1.0, nan(""), 0.0, 1.0}, s[2], Q[4];
    double complex values[2];
    size_t rank;
    assert_int_equal(dense_symmetric_eigen(2, A, NULL, s, NULL, &err), BF_NUMERIC);
    assert_int_equal(dense_general_eigen(2, A, values, NULL, NULL, &err), BF_NUMERIC);
    assert_int_equal(dense_svd(2, 2, A, NULL, s, NULL, &err), BF_NUMERIC);
    assert_int_equal(dense_orthonormal(2, 2, A, 1e-10, Q, NULL, &rank, &err), BF_NUMERIC);
    assert_int_equal(dense_qr_triangle(2, 2, A, Q, &err), BF_NUMERIC);
    assert_int_equal(dense_cholesky_solve(2, 1, A, s, &err), BF_NUMERIC);
    double one[1] = {1.0}, no_number[1] = {nan("")};
    assert_int_equal(dense_lu_solve(1, 1, one, no_number, &err), BF_NUMERIC);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(symmetric_eigenvectors_solve_the_problem),
        cmocka_unit_test(symmetric_eigen_says_when_the_mass_is_not_positive),
        cmocka_unit_test(general_eigenvectors_stand_left_and_right),
        cmocka_unit_test(a_solve_leaves_no_residual),
        cmocka_unit_test(indefinite_matrices_are_refused),
        cmocka_unit_test(products_agree_with_loops),
        cmocka_unit_test(singular_values_rebuild_the_matrix),
        cmocka_unit_test(a_wide_matrix_has_its_null_space),
        cmocka_unit_test(the_triangle_has_the_gram_matrix),
        cmocka_unit_test(a_basis_leaves_dependent_columns_out),
        cmocka_unit_test(a_tall_basis_is_orthonormal_and_makes_the_columns_again),
        cmocka_unit_test(a_tall_system_is_solved),
        cmocka_unit_test(a_tall_triangle_has_the_gram_matrix),
        cmocka_unit_test(rank_deficient_least_squares_has_minimum_norm),
        cmocka_unit_test(what_is_not_finite_is_refused),
        cmocka_unit_test(triangle_of_a_long_matrix),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
