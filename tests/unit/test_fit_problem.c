/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The weighted problem below the fit: linear unknowns are projected out, and the gradient is that of what is left. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "estimate/fit_problem.h"
#include "fit_rig.h"

/* The gradient of the projected problem (level and free decay solved for) against central differences. */
static void check_gradient(const char *effects, double goal)
{
    struct bf_error err;
    struct record records[2];
    struct model model;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct fit_problem p;
    double sigma[4];
    const char *names[2] = {"level.csv", "tap.csv"};
    seed = 20;
    make_record(names[0], 0.02, 1.0, &records[0], sigma);
    make_record(names[1], 0.02, 1.0, &records[1], sigma + 2);
    record_add_meta(&records[0], "excitation", "unknown_level");
    record_add_meta(&records[1], "excitation", "free_decay");
    record_add_meta(&records[1], "free_from_s", "0.06");
    make_model_with(&handbook, effects, &model);
    assert_int_equal(predictor_new(&model, records, 2, NULL, &predictor, &err), BF_OK);
    const size_t n_refs = model_parameters(&model, names, 2, &refs);
    assert_int_equal(fit_problem_new(&p, &model, predictor, records, 2, names, refs, n_refs, sigma, &err), BF_OK);
    const size_t n = p.n_unknowns;
    double x[16], gradient[16], gram[256], value;
    for (size_t i = 0; i < n_refs; i++)
        p.theta[i] = refs[i].value;
    fit_problem_to_x(&p, p.theta, x);
    assert_int_equal(fit_problem_stage(&p, 3.0, 0.02, x, &err), BF_OK);
    const struct least_squares view = fit_problem_view(&p);
    assert_int_equal(view.derivative(&p, x, &value, gradient, gram, &err), BF_OK);
    const double norm = dense_norm(n, gradient);
    for (size_t i = 0; i < n; i++) {
        const double at = x[i], h = 1e-6;
        double up, down;
        x[i] = at + h;
        assert_int_equal(view.value(&p, x, &up, &err), BF_OK);
        x[i] = at - h;
        assert_int_equal(view.value(&p, x, &down, &err), BF_OK);
        x[i] = at;
        assert_near((up - down) / (2.0 * h), gradient[i], goal * norm);
    }
    fit_problem_free(&p);
    free(refs);
    predictor_free(predictor);
    model_free(&model);
    record_free(&records[0]);
    record_free(&records[1]);
}

static void the_projected_gradient_is_the_gradient(void **state)
{
    (void)state;
    check_gradient(" []", 1e-6);
}

/* The states that a law acts on are solved for by steps: what is left of them to do is not in the gradient. */
static void so_it_is_with_laws(void **state)
{
    (void)state;
    check_gradient("\n  - {kind: quadratic_drag, coefficient_Ns2pm3: 3}"
                   "\n  - {kind: cubic_stiffness, coefficient_Npm3: 2e5, at_m: 0.39}",
                   1e-4);
}

/* A level solved for inside gives the residual of the same problem with the level as a parameter at its optimum. */
static void projection_equals_the_joint_solution(void **state)
{
    (void)state;
    struct bf_error err;
    struct record records[2];
    struct model model;
    struct predictor *predictor;
    double sigma[2], projected, scaled;
    seed = 21;
    make_record("level.csv", 0.02, 1.0, &records[0], sigma);
    record_add_meta(&records[0], "excitation", "unknown_level");
    make_model(&handbook, &model);
    for (int joint = 0; joint < 2; joint++) {
        const char *names[1] = {"level.csv"};
        struct parameter_ref *refs;
        struct fit_problem p;
        double x[16];
        assert_int_equal(predictor_new(&model, records, 1, NULL, &predictor, &err), BF_OK);
        const size_t n_refs = model_parameters(&model, names, 1, &refs);
        assert_int_equal(fit_problem_new(&p, &model, predictor, records, 1, names, refs, n_refs, sigma, &err), BF_OK);
        fit_problem_to_x(&p, p.theta, x);
        assert_int_equal(fit_problem_stage(&p, 0.0, 0.0, x, &err), BF_OK);
        assert_int_equal(fit_problem_evaluate(&p, x, false, joint ? &scaled : &projected, &err), BF_OK);
        const double level = p.levels[0];
        fit_problem_free(&p);
        free(refs);
        predictor_free(predictor);
        if (joint)
            continue;
        assert_true(fabs(level - 1.0) > 1e-3);
        for (size_t k = 0; k < SAMPLES; k++)
            records[0].columns[0].x[k] *= level;
        free(records[0].meta[0].value);
        records[0].meta[0].value = strdup("measured");
    }
    assert_near(scaled / projected, 1.0, 1e-9);
    model_free(&model);
    record_free(&records[0]);
}

/* A problem of one recording of the true beam, with the model's values as x. */
struct posed {
    struct record record;
    struct model model;
    struct predictor *predictor;
    struct parameter_ref *refs;
    double sigma[2], x[16];
    struct fit_problem p;
};

static void pose(struct posed *posed, uint64_t noise, const struct beam *beam, const char *effects)
{
    static const char *const names[1] = {"tap.csv"};
    struct bf_error err;
    seed = noise;
    make_record(names[0], 0.02, 1.0, &posed->record, posed->sigma);
    make_model_with(beam, effects, &posed->model);
    assert_int_equal(predictor_new(&posed->model, &posed->record, 1, NULL, &posed->predictor, &err), BF_OK);
    const size_t n_refs = model_parameters(&posed->model, names, 1, &posed->refs);
    assert_int_equal(fit_problem_new(&posed->p, &posed->model, posed->predictor, &posed->record, 1, names, posed->refs,
                                     n_refs, posed->sigma, &err),
                     BF_OK);
    fit_problem_to_x(&posed->p, posed->p.theta, posed->x);
}

static void posed_free(struct posed *posed)
{
    fit_problem_free(&posed->p);
    free(posed->refs);
    predictor_free(posed->predictor);
    model_free(&posed->model);
    record_free(&posed->record);
}

/*
 * What holds is not computed again: the same x, a strength in another unit, whole records once more. Other rows, and another x, are.
 */
static void what_holds_is_not_computed_again(void **state)
{
    (void)state;
    struct bf_error err;
    struct posed posed;
    double value, again;
    pose(&posed, 22, &handbook, "\n  - {kind: point_mass, mass_kg: 0.001, at_m: 0.3}");
    struct fit_problem *p = &posed.p;
    double *x = posed.x;
    assert_int_equal(fit_problem_whole(p, x, &err), BF_OK);
    assert_int_equal(fit_problem_evaluate(p, x, true, &value, &err), BF_OK);
    const size_t runs = p->runs;

    size_t mass = 0;
    while (p->refs[p->unknowns[mass].ref].role != ROLE_EFFECT)
        mass++;
    p->unknowns[mass].least_scale *= 7.0; /* the unit must become larger */
    const double unit = p->unknowns[mass].scale, in_units = x[mass];
    fit_problem_rescale(p, x);
    assert_true(p->unknowns[mass].scale > 2.0 * unit);
    assert_near(x[mass] * p->unknowns[mass].scale, in_units * unit, 1e-12 * fabs(in_units * unit));
    assert_int_equal(fit_problem_whole(p, x, &err), BF_OK);
    assert_int_equal(fit_problem_evaluate(p, x, true, &again, &err), BF_OK);
    assert_int_equal(p->runs, runs);
    assert_true(again == value);

    p->held_at = HOLDS_NOTHING;
    double *rescaled = bf_alloc(p->n_rows * p->n_unknowns, sizeof *rescaled);
    memcpy(rescaled, p->jacobian, p->n_rows * p->n_unknowns * sizeof *rescaled);
    assert_int_equal(fit_problem_evaluate(p, x, true, &again, &err), BF_OK);
    assert_int_equal(p->runs, runs + 1);
    for (size_t i = 0; i < p->n_unknowns; i++)
        for (size_t k = 0; k < p->n_rows; k++)
            assert_near(rescaled[i * p->n_rows + k], p->jacobian[i * p->n_rows + k],
                        1e-9 * dense_norm(p->n_rows, p->jacobian + i * p->n_rows));

    p->horizon_s[0] = 0.5 * (double)posed.record.n * posed.record.dt_s;
    assert_int_equal(fit_problem_whole(p, x, &err), BF_OK);
    assert_int_equal(fit_problem_evaluate(p, x, false, &again, &err), BF_OK);
    assert_true(again < value && p->n_used < p->n_rows);
    x[0] += 1e-9;
    const size_t before = p->runs;
    assert_int_equal(fit_problem_evaluate(p, x, false, &again, &err), BF_OK);
    assert_int_equal(p->runs, before + 1);
    free(rescaled);
    posed_free(&posed);
}

/* Damping is looked for up to where nothing swings; what a file allows stays allowed, and released, everything is. The start may lie outside. */
static void what_no_beam_has_is_not_looked_for(void **state)
{
    (void)state;
    static const double omega = 3.516015269 / (0.4 * 0.4); /* √(EI/ρ) of the beam below is 1 */
    static const struct beam overdamped = {0.1, 0.2, 0.1, 0.3, 1.0, 60.0, ", max: 40", ", fixed: true", ""};
    struct posed posed;
    pose(&posed, 23, &overdamped, " []");
    struct fit_problem *p = &posed.p;
    size_t damping = 0;
    for (size_t i = 0; i < p->n_unknowns; i++) {
        const struct parameter_ref *ref = &p->refs[p->unknowns[i].ref];
        if (ref->role == ROLE_CDI)
            damping = i;
        if (strcmp(ref->label, "EI_beam_Nm2") == 0)
            assert_near(exp(p->upper[i]), 40.0, 1e-9);
    }
    assert_near(exp(p->upper[damping]), 0.1 / omega, 1e-6 * 0.1 / omega);
    assert_true(posed.x[damping] > p->upper[damping]);
    posed.x[damping] = p->upper[damping] - 1.0;
    assert_false(fit_problem_presses(p, posed.x));
    posed.x[damping] = p->upper[damping];
    assert_true(fit_problem_presses(p, posed.x));
    fit_problem_release(p);
    assert_false(fit_problem_presses(p, posed.x));
    assert_true(p->upper[damping] > log(1e3 / omega));
    posed_free(&posed);
}

/* Of some lengths (L/s)·s is one unit of the last digit more than L: nothing may lie beyond the end for that. */
static void a_bound_is_reached_and_not_passed(void **state)
{
    (void)state;
    int beyond = 0;
    for (int mm = 100; mm < 1000; mm++)
        for (int k = 1; k < 20; k++) {
            const double length_m = 1e-3 * mm, scale = 0.037 * k * length_m, x = length_m / scale;
            struct parameter place = {.min = 0.0, .max = length_m};
            struct parameter_ref ref = {.info = &place};
            struct unknown unknown = {.scale = scale};
            const struct fit_problem p = {.n_unknowns = 1, .unknowns = &unknown, .refs = &ref};
            double theta;
            fit_problem_to_theta(&p, &x, &theta);
            assert_true(theta <= length_m && theta > (1.0 - 1e-15) * length_m);
            beyond += x * scale > length_m;
        }
    assert_true(beyond > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_projected_gradient_is_the_gradient), cmocka_unit_test(so_it_is_with_laws),
        cmocka_unit_test(projection_equals_the_joint_solution),   cmocka_unit_test(what_holds_is_not_computed_again),
        cmocka_unit_test(what_no_beam_has_is_not_looked_for),     cmocka_unit_test(a_bound_is_reached_and_not_passed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
