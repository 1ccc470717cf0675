/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A fit of a long record, whose Jacobian is never whole, is the fit that keeps it: derivatives, what is known, standard errors. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "estimate/fit_result.h"
#include "predict_case.h"
#include "signals.h"

enum { LONG = 262144, MOST = 40 };
static const double damped = 0.5; /* gamma_sNpm2: the beam forgets within 12300 samples */
static const double same = 1e-9;

/* One way to fit: whole, or in pieces. */
struct way {
    struct predictor *predictor;
    struct fit_problem p;
    double value, gradient[MOST], gram[MOST * MOST];
    struct fit_result result;
};

/* Noise drives the beam; the outputs are coloured noise. */
static struct record long_record(void)
{
    struct record record = case_record("long.csv", LONG, 1.0 / 1200.0, 1.0, true);
    uint64_t seed = signal_seed(3);
    for (size_t c = 0; c < record.n_columns; c++)
        for (size_t k = 0; k < LONG; k++)
            record.columns[c].x[k] = signal_normal(&seed) + (c > 1 && k > 0 ? 0.7 * record.columns[c].x[k - 1] : 0.0);
    return record;
}

static void run(struct way *way, bool pieces, const struct model *model, const struct record *record,
                const struct parameter_ref refs[], size_t n_refs)
{
    static const double sigma[3] = {1.3, 0.6, 2.0};
    struct bf_error err;
    const char *name = "long.csv";
    const struct predict_options how = {.quiet = true, .pieces = pieces};
    double x[MOST], theta[2 * MOST];
    if (predictor_new(model, record, 1, &how, &way->predictor, &err) != BF_OK ||
        fit_problem_new(&way->p, model, way->predictor, record, 1, &name, refs, n_refs, sigma, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_true(way->p.n_unknowns > 4 && way->p.n_unknowns <= MOST && n_refs <= 2 * MOST);
    for (size_t i = 0; i < n_refs; i++)
        theta[i] = refs[i].value;
    fit_problem_to_x(&way->p, theta, x);
    const struct least_squares view = fit_problem_view(&way->p);
    if (fit_problem_stage(&way->p, 0.0, 0.0, x, &err) != BF_OK ||
        view.derivative(&way->p, x, &way->value, way->gradient, way->gram, &err) != BF_OK ||
        fit_statistics(&way->p, model, x, &way->result, &err) != BF_OK)
        fail_msg("%s", err.text);
}

/* a[i] and b[i] within this share of what stands for their size. */
static void check(const char *what, double a, double b, double size, double share)
{
    if (!(fabs(a - b) <= share * size))
        fail_msg("%s: %.12g and %.12g", what, a, b);
}

static void compressed_rows_say_what_all_rows_say(void **state)
{
    (void)state;
    struct model model;
    struct record record = long_record();
    struct parameter_ref *refs;
    const char *name = "long.csv";
    struct way whole = {0}, pieces = {0};
    fixture_model(&model, "");
    model.gamma.value = damped;
    const size_t n_refs = model_parameters(&model, &name, 1, &refs);
    run(&whole, false, &model, &record, refs, n_refs);
    run(&pieces, true, &model, &record, refs, n_refs);
    const size_t n = whole.p.n_unknowns;
    const double *A = whole.gram, *C = whole.result.covariance;
    assert_false(whole.p.compressed);
    assert_true(pieces.p.compressed);
    assert_true(pieces.p.n_jacobian == n + 1);
    check("value", pieces.value, whole.value, whole.value, same);
    for (size_t i = 0; i < n; i++) {
        check("gradient", pieces.gradient[i], whole.gradient[i], sqrt(A[i + i * n] * 2.0 * whole.value), same);
        check("singular value", pieces.result.identifiability.singular[i], whole.result.identifiability.singular[i],
              whole.result.identifiability.singular[0], same);
        for (size_t j = 0; j < n; j++) {
            check("gram", pieces.gram[i + j * n], A[i + j * n], sqrt(A[i + i * n] * A[j + j * n]), same);
            check("covariance", pieces.result.covariance[i + j * n], C[i + j * n], sqrt(C[i + i * n] * C[j + j * n]),
                  1e-6); /* of unknowns that are known together only, to so much less */
        }
    }
    fit_free(&whole.result), fit_free(&pieces.result);
    fit_problem_free(&whole.p), fit_problem_free(&pieces.p);
    predictor_free(whole.predictor), predictor_free(pieces.predictor);
    free(refs);
    record_free(&record);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(compressed_rows_say_what_all_rows_say)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
