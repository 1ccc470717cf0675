/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A fit whose records lie in shares is the fit that has them all: derivatives in a window and whole, errors, standard errors. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "estimate/fit_result.h"
#include "estimate/fit_work.h"
#include "predict_case.h"
#include "signals.h"

enum { RECORDS = 5, SHARES = 3, EACH = 2, MOST = 40 };
static const double same = 1e-9;

/* Hits of several lengths, and one that begins in motion; outputs are the model's, with coloured noise. */
static struct record make_record(size_t r)
{
    static const char *const names[RECORDS] = {"a.csv", "b.csv", "c.csv", "d.csv", "e.csv"};
    const size_t n = r % 2 == 0 ? 2048 : 1500;
    struct record record = case_record(names[r], n, 1.0 / 1024.0, 1.0 + (double)r, r != 2);
    uint64_t seed = signal_seed(3 + (unsigned)r);
    for (size_t c = record.n_columns - 3; c < record.n_columns; c++)
        for (size_t k = 0; k < n; k++)
            record.columns[c].x[k] = signal_normal(&seed) + (k > 0 ? 0.7 * record.columns[c].x[k - 1] : 0.0) +
                                     10.0 * exp(-0.004 * (double)k) * cos(0.3 * (double)k);
    if (r == 3)
        record_add_meta(&record, "excitation", "unknown_level");
    return record;
}

/* The shares, all of them here. */
static enum bf_status ask(void *context, const struct fit_message *question, struct fit_message answers[],
                          struct bf_error *err)
{
    struct fit_share **shares = context;
    (void)err;
    for (size_t s = SHARES; s-- > 0;)
        fit_share_answer(shares[s], question, &answers[s]);
    return BF_OK;
}

/* One way to fit. */
struct way {
    struct fit_work w;
    double value, gradient[MOST], gram[MOST * MOST];
    struct fit_channel_error *errors;
    size_t n_errors;
    struct fit_result result;
};

/* At the model's values, in a window with this decay. */
static void evaluate(struct way *way, double decay_ps)
{
    struct bf_error err;
    struct fit_problem *p = &way->w.problem;
    assert_true(p->n_unknowns > 4 && p->n_unknowns <= MOST);
    const struct least_squares view = fit_problem_view(p);
    if (fit_problem_stage(p, decay_ps, decay_ps > 0.0 ? 0.02 : 0.0, way->w.x, &err) != BF_OK)
        fail_msg("%s", err.text);
    fit_problem_weigh_priors(p, way->w.x);
    if (view.derivative(p, way->w.x, &way->value, way->gradient, way->gram, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static void finish(struct way *way, const struct model *model)
{
    struct bf_error err;
    way->errors = fit_channel_errors(&way->w.problem, way->w.noise, &way->n_errors);
    if (fit_statistics(&way->w.problem, model, way->w.x, &way->result, &err) != BF_OK)
        fail_msg("%s", err.text);
}

/* a and b within this share of what stands for their size. */
static void check(const char *what, double a, double b, double size, double share)
{
    if (!(fabs(a - b) <= share * size))
        fail_msg("%s: %.12g and %.12g", what, a, b);
}

static void check_derivatives(const struct way *whole, const struct way *shared)
{
    const size_t n = whole->w.problem.n_unknowns;
    const double *A = whole->gram;
    assert_int_equal(shared->w.problem.n_unknowns, n);
    assert_int_equal(shared->w.problem.n_rows, whole->w.problem.n_rows);
    assert_int_equal(shared->w.problem.n_used, whole->w.problem.n_used);
    check("value", shared->value, whole->value, whole->value, same);
    check("form", fit_problem_form_scale(&shared->w.problem), fit_problem_form_scale(&whole->w.problem), 1.0, 1e-6);
    for (size_t i = 0; i < n; i++) {
        check("gradient", shared->gradient[i], whole->gradient[i], sqrt(A[i + i * n] * 2.0 * whole->value), same);
        for (size_t j = 0; j < n; j++)
            check("gram", shared->gram[i + j * n], A[i + j * n], sqrt(A[i + i * n] * A[j + j * n]), same);
    }
}

static void check_statistics(const struct way *whole, const struct way *shared)
{
    const size_t n = whole->w.problem.n_unknowns;
    const double *C = whole->result.covariance;
    assert_int_equal(shared->n_errors, whole->n_errors);
    for (size_t c = 0; c < whole->n_errors; c++) {
        assert_int_equal(shared->errors[c].record, whole->errors[c].record);
        assert_string_equal(shared->errors[c].name, whole->errors[c].name);
        check("error", shared->errors[c].nrmse, whole->errors[c].nrmse, whole->errors[c].nrmse, same);
        check("noise", shared->errors[c].noise, whole->errors[c].noise, whole->errors[c].noise, same);
    }
    for (size_t r = 0; r < RECORDS; r++)
        check("level", shared->result.level[r], whole->result.level[r], 1.0, same);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            check("covariance", shared->result.covariance[i + j * n], C[i + j * n], sqrt(C[i + i * n] * C[j + j * n]),
                  1e-6); /* of unknowns that are known together only, to so much less */
    for (size_t i = 0; i < whole->result.n_parameters; i++) {
        const struct fit_parameter *a = &shared->result.parameters[i], *b = &whole->result.parameters[i];
        assert_string_equal(a->label, b->label);
        assert_true(a->identifiable == b->identifiable);
        if (b->identifiable)
            check(b->label, a->ci95[1], b->ci95[1], fabs(b->ci95[1]) + b->sd, 1e-6);
    }
}

struct rig {
    struct model model;
    struct record records[RECORDS];
    struct fit_share *share[SHARES];
    struct fit_shares shares;
    struct way whole, shared;
};

/* The scale of a residual term is told from the first instants, of each share by itself: near enough to scale by, and then the same here. */
static void take_scales(const struct fit_problem *from, struct fit_problem *to)
{
    assert_int_equal(to->n_unknowns, from->n_unknowns);
    for (size_t i = 0; i < to->n_unknowns; i++) {
        check("scale", to->unknowns[i].scale, from->unknowns[i].scale, from->unknowns[i].scale, 0.2);
        assert_true(to->unknowns[i].ref == from->unknowns[i].ref);
        to->unknowns[i].scale = from->unknowns[i].scale;
    }
}

static void open_rig(struct rig *rig)
{
    struct bf_error err;
    const struct fit_options options = {.quiet = true, .predict = {.quiet = true}};
    struct fit_options in_shares = options;
    *rig = (struct rig){.shares = {.n = SHARES, .ask = ask, .context = rig->share}};
    fixture_model(&rig->model, "");
    for (size_t r = 0; r < RECORDS; r++)
        rig->records[r] = make_record(r);
    for (size_t s = 0; s < SHARES; s++)
        if (fit_share_new(&rig->model, rig->records + EACH * s, s + 1 < SHARES ? EACH : RECORDS - EACH * s, &options,
                          &rig->share[s], &err) != BF_OK)
            fail_msg("%s", err.text);
    if (fit_shares_open(&rig->shares, &rig->model, &err) != BF_OK)
        fail_msg("%s", err.text);
    assert_int_equal(rig->shares.n_records, RECORDS);
    in_shares.shares = &rig->shares;
    if (fit_work_new(&rig->whole.w, &rig->model, rig->records, RECORDS, &options, &err) != BF_OK ||
        fit_work_new(&rig->shared.w, &rig->model, rig->shares.records, RECORDS, &in_shares, &err) != BF_OK)
        fail_msg("%s", err.text);
    take_scales(&rig->whole.w.problem, &rig->shared.w.problem);
}

static void close_rig(struct rig *rig)
{
    struct way *ways[2] = {&rig->whole, &rig->shared};
    for (int i = 0; i < 2; i++) {
        fit_free(&ways[i]->result);
        free(ways[i]->errors);
        fit_work_free(&ways[i]->w);
    }
    for (size_t s = 0; s < SHARES; s++)
        fit_share_free(rig->share[s]);
    for (size_t r = 0; r < RECORDS; r++)
        record_free(&rig->records[r]);
    fit_shares_close(&rig->shares);
    model_free(&rig->model);
}

static void shares_say_what_all_records_say(void **state)
{
    (void)state;
    struct rig rig;
    open_rig(&rig);
    for (int window = 1; window >= 0; window--) {
        evaluate(&rig.whole, 20.0 * window);
        evaluate(&rig.shared, 20.0 * window);
        check_derivatives(&rig.whole, &rig.shared);
    }
    finish(&rig.whole, &rig.model);
    finish(&rig.shared, &rig.model);
    check_statistics(&rig.whole, &rig.shared);
    close_rig(&rig);
}

/* A held unknown is not moved by any share, and moves again. */
static void an_unknown_is_held_in_all_shares(void **state)
{
    (void)state;
    struct rig rig;
    struct way *ways[2] = {&rig.whole, &rig.shared};
    open_rig(&rig);
    for (int held = 1; held >= 0; held--) {
        for (int i = 0; i < 2; i++) {
            fit_problem_hold(&ways[i]->w.problem, 1, held == 1);
            evaluate(ways[i], 0.0);
        }
        assert_true((rig.shared.gradient[1] == 0.0) == (held == 1));
        check_derivatives(&rig.whole, &rig.shared);
    }
    close_rig(&rig);
}

static void refuses(const char *effects, const char *words)
{
    struct bf_error err;
    struct model model;
    struct fit_share *share;
    struct record record = make_record(0);
    const struct fit_options options = {.quiet = true, .predict = {.quiet = true}};
    fixture_model(&model, effects);
    assert_int_equal(fit_share_new(&model, &record, 1, &options, &share, &err), BF_USAGE);
    if (strstr(err.text, words) == NULL)
        fail_msg("'%s' is not in: %s", words, err.text);
    fit_share_free(share);
    record_free(&record);
    model_free(&model);
}

static void what_differs_by_record_is_refused(void **state)
{
    (void)state;
    refuses("  - {kind: mains_hum, channel: piezo_V}\n", "has a value for each record");
    refuses("  - {kind: coulomb_friction}\n", "nonlinear law");
}

/* What is no question, or is cut, has an answer that says so. */
static void bytes_that_are_no_question(void **state)
{
    (void)state;
    struct rig rig;
    struct fit_message answer;
    unsigned char bytes[8] = {0};
    open_rig(&rig);
    fit_share_answer(rig.share[0], &(struct fit_message){sizeof bytes, bytes}, &answer);
    assert_true(answer.n > 0);
    int status;
    memcpy(&status, answer.bytes, sizeof status);
    assert_int_equal(status, BF_NUMERIC);
    free(answer.bytes);
    close_rig(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shares_say_what_all_records_say),
        cmocka_unit_test(an_unknown_is_held_in_all_shares),
        cmocka_unit_test(what_differs_by_record_is_refused),
        cmocka_unit_test(bytes_that_are_no_question),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
