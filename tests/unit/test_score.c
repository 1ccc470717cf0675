/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The score of candidates: against plain least squares, under noise alone, for weak and strong effects. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "estimate/score_base.h"
#include "score_rig.h"

/* ---- Against plain least squares ---- */

/* Central difference of the weighted prediction by one parameter. */
static void difference(struct predictor *predictor, const double theta[], size_t n, size_t i, double step,
                       const double sigma[], double out[])
{
    struct bf_error err;
    struct prediction y;
    const struct predict_channel *channels;
    double *moved = malloc(n * sizeof *moved);
    for (int side = 0; side < 2; side++) {
        memcpy(moved, theta, n * sizeof *moved);
        moved[i] += side ? -step : step;
        assert_int_equal(predictor_run(predictor, moved, NULL, &y, &err), BF_OK);
        predictor_channels(predictor, &channels);
        for (size_t c = 0; c < CHANNELS; c++)
            for (size_t k = channels[c].row; k < channels[c].row + channels[c].n; k++)
                out[k] = (side ? out[k] - y.y[k] : y.y[k]) / (side ? 2.0 * step * sigma[c] : 1.0);
    }
    free(moved);
}

static void the_score_is_the_fall_of_a_linear_least_squares_fit(void **state)
{
    (void)state;
    struct rig r;
    struct bf_error err;
    seed = 11;
    rig_records(&r);
    rig_effect(&r, "sensor_lag", (const double[]){1e-5}, 1);
    rig_score(&r, NULL);
    struct model with;
    struct predictor *predictor;
    struct parameter_ref *refs;
    struct prediction y;
    const struct predict_channel *channels;
    const char *names[RECORDS] = {"a.csv", "b.csv"};
    const size_t rows = CHANNELS * SAMPLES;
    const struct candidate *lag = &r.list.candidates[index_of(&r, "sensor_lag")];
    assert_int_equal(candidate_model(&r.model, lag, (const double[]){1e-4}, &with, &err), BF_OK);
    assert_int_equal(predictor_new(&with, r.records, RECORDS, NULL, &predictor, &err), BF_OK);
    const size_t n = model_parameters(&with, names, RECORDS, &refs);
    double *theta = calloc(n, sizeof *theta), *A = calloc(n * rows, sizeof *A), *b = calloc(rows, sizeof *b);
    size_t columns = 0, effect_column = 0;
    for (size_t i = 0; i < n; i++)
        theta[i] = refs[i].role == ROLE_EFFECT ? 2e-9 : refs[i].value;
    for (size_t i = 0; i < n; i++) {
        if (refs[i].info->fixed)
            continue;
        effect_column = columns;
        difference(predictor, theta, n, i, refs[i].role == ROLE_EFFECT ? 1e-9 : 1e-5 * fabs(theta[i]) + 1e-9, r.sigma,
                   A + columns++ * rows);
    }
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    predictor_channels(predictor, &channels);
    for (size_t c = 0; c < CHANNELS; c++)
        for (size_t k = 0; k < SAMPLES; k++)
            b[channels[c].row + k] = (channels[c].measured[k] - y.y[channels[c].row + k]) / r.sigma[c];
    double chi_square[2];
    for (int kept = 0; kept < 2; kept++) {
        double *x = calloc(columns, sizeof *x), *left = malloc(rows * sizeof *left);
        const size_t used = kept ? columns : effect_column; /* the effect's column is the last */
        assert_int_equal(effect_column, columns - 1);
        assert_int_equal(dense_least_squares(rows, used, A, b, 1e-12, x, NULL, &err), BF_OK);
        memcpy(left, b, rows * sizeof *left);
        dense_gemv(false, rows, used, -1.0, A, x, 1.0, left);
        chi_square[kept] = dense_dot(rows, left, left);
        free(x), free(left);
    }
    const struct score *score = &r.scores[index_of(&r, "sensor_lag")];
    const double fall = chi_square[0] - chi_square[1];
    assert_true(fall > 20.0);
    assert_near(score->LM, fall, 1e-3 * fall);
    double freedom;
    assert_near(score_base_misfit(r.base, &freedom), chi_square[0], 1e-3 * chi_square[0]);
    free(theta), free(A), free(b), free(refs);
    predictor_free(predictor);
    model_free(&with);
    rig_free(&r);
}

/* ---- Noise alone ---- */

static void without_an_effect_the_score_is_chi_square(void **state)
{
    (void)state;
    enum { SETS = 40 };
    double two_sided = 0.0, zeros = 0.0;
    for (int k = 0; k < SETS; k++) {
        struct rig r;
        const char *without[] = {"base_motion",  "point_mass",      "point_damper", "point_spring",
                                 "viscoelastic", "root_compliance", "mains_hum"};
        seed = 1000u + (uint64_t)k;
        rig_records(&r);
        rig_score(&r, &(struct candidate_options){.without = without, .n_without = sizeof without / sizeof *without});
        const struct score *load = &r.scores[index_of(&r, "axial_load")], *lag = &r.scores[index_of(&r, "sensor_lag")];
        two_sided += load->LM / SETS;
        zeros += lag->LM <= 0.0 ? 1.0 / SETS : 0.0;
        assert_true(load->explained < 0.5);
        rig_free(&r);
    }
    assert_near(two_sided, 1.0, 4.0 * sqrt(2.0 / SETS)); /* mean of χ²_1; its standard deviation is √2 */
    assert_near(zeros, 0.5, 4.0 * 0.5 / sqrt(SETS));     /* a one-sided strength is held half the time */
}

/* ---- Weak effects: place, size, sign ---- */

static void a_weak_mass_is_found_with_its_place_and_size(void **state)
{
    (void)state;
    struct rig r;
    seed = 21;
    rig_records(&r);
    rig_effect(&r, "point_mass", (const double[]){1e-4, 0.27}, 2);
    rig_fit(&r);
    rig_score(&r, NULL);
    const size_t best = best_of(&r);
    assert_string_equal(r.list.candidates[best].effect->id, "point_mass");
    const struct score *score = &r.scores[best];
    assert_near(score->p[1], 0.27, 0.01);
    assert_near(score->p[0], 1e-4, 4.0 * score->estimate_sd);
    assert_true(score->p_value < 1e-6);
    assert_true(score->explained > 0.9);
    assert_true(score->estimate_sd > 0.0 && score->estimate_sd < 1e-5);
    rig_free(&r);
}

/* Frequencies 0.03 % lower: far below what a trial of 1/1000 of ℓ/EI would change. */
static void a_clamp_that_turns_a_little_is_found(void **state)
{
    (void)state;
    struct rig r;
    seed = 23;
    rig_records(&r);
    rig_effect(&r, "root_compliance", (const double[]){1.5e-4, 0.0}, 2);
    rig_fit(&r);
    rig_score(&r, NULL);
    const struct score *score = &r.scores[index_of(&r, "root_compliance")];
    assert_true(score->p_value < 1e-6);
    assert_near(score->p[0], 1.5e-4, 4.0 * score->estimate_sd);
    rig_free(&r);
}

static void a_strength_of_the_wrong_sign_explains_nothing(void **state)
{
    (void)state;
    struct rig r;
    seed = 22;
    rig_records(&r);
    for (size_t i = 0; i < RECORDS; i++) /* every output is early by a sample: a negative delay */
        for (size_t c = 1; c < 3; c++)
            memmove(r.records[i].columns[c].x, r.records[i].columns[c].x + 1, (SAMPLES - 1) * sizeof(double));
    rig_score(&r, NULL);
    const struct score *score = &r.scores[index_of(&r, "sensor_delay")];
    assert_true(score->possible);
    assert_near(score->LM, 0.0, 1e-9);
    assert_int_equal(score->dof, 0);
    assert_near(score->p_value, 1.0, 0.0);
    assert_true(score->estimate <= 0.0);
    rig_free(&r);
}

static void a_finite_trial_finds_a_saturated_sensor(void **state)
{
    (void)state;
    struct rig r;
    seed = 23;
    rig_records(&r);
    double peak = 0.0;
    for (size_t k = 0; k < SAMPLES; k++)
        peak = fmax(peak, fabs(record_column(&r.records[1], "piezo_V")[k]));
    const double level = 2.0 * peak;
    rig_effect(&r, "sensor_saturation", &level, 1);
    rig_fit(&r);
    rig_score(&r, NULL);
    const size_t best = best_of(&r);
    assert_string_equal(r.list.candidates[best].effect->id, "sensor_saturation");
    assert_near(r.scores[best].p[0], level, 0.1 * level);
    rig_free(&r);
}

static void a_line_is_found_with_a_phase_for_each_record(void **state)
{
    (void)state;
    struct rig r;
    seed = 24;
    rig_records(&r);
    const double line_Hz = 50.3, phase[RECORDS] = {0.7, -2.0}, amplitude = 3.0 * r.sigma[0];
    for (size_t i = 0; i < RECORDS; i++)
        for (size_t k = 0; k < SAMPLES; k++)
            r.records[i].columns[1].x[k] += amplitude * sin(2.0 * M_PI * line_Hz * (double)k / RATE_HZ + phase[i]);
    rig_score(&r, &(struct candidate_options){.line_Hz = (const double[]){50.1}, .n_lines = 1});
    const size_t best = best_of(&r);
    assert_string_equal(r.list.candidates[best].effect->id, "mains_hum");
    const struct score *score = &r.scores[best];
    assert_near(score->p[2], line_Hz, 0.05);
    assert_near(score->p[0], amplitude, 0.2 * amplitude);
    for (size_t i = 0; i < RECORDS; i++)
        assert_near(remainder(score->per_record[i] - phase[i], 2.0 * M_PI), 0.0, 0.3);
    struct model start;
    struct bf_error err;
    assert_int_equal(score_model(r.base, &r.list.candidates[best], score, &start, &err), BF_OK);
    assert_int_equal(start.effects[0].n_per_record, RECORDS);
    model_free(&start);
    rig_free(&r);
}

/* ---- Strong effects ---- */

static void steps_through_short_windows_find_a_strong_mass(void **state)
{
    (void)state;
    struct rig r;
    seed = 31;
    rig_records(&r);
    rig_effect(&r, "tip_mass", (const double[]){4e-3}, 1);
    rig_fit(&r);
    rig_score(&r, NULL);
    size_t *order = calloc(r.list.n, sizeof *order), lowest = 0;
    const size_t n = score_rank(r.list.candidates, r.scores, r.list.n, order);
    score_refine_all(r.base, r.list.candidates, r.scores, order, n < 10 ? n : 10, 0);
    double least = INFINITY;
    for (size_t i = 0; i < r.list.n; i++) {
        assert_true(!r.scores[i].refined || isfinite(r.scores[i].chi_square));
        if (r.scores[i].refined && r.scores[i].chi_square < least) {
            least = r.scores[i].chi_square;
            lowest = i;
        }
    }
    const char *id = r.list.candidates[lowest].effect->id;
    assert_true(strcmp(id, "tip_mass") == 0 || strcmp(id, "point_mass") == 0); /* one is the other at the free end */
    assert_true(least < 0.3 * r.base->white_misfit);
    assert_near(r.scores[lowest].p[0], 4e-3, 1e-3);
    free(order);
    rig_free(&r);
}

static void a_law_is_left_to_the_trial_unless_asked_for(void **state)
{
    (void)state;
    struct rig r;
    struct bf_error err;
    seed = 61;
    rig_records(&r);
    rig_score(&r, NULL);
    const size_t i = index_of(&r, "quadratic_drag");
    assert_false(r.scores[i].possible);
    assert_contains(r.scores[i].reason, "law");
    score_refine_all(r.base, r.list.candidates, r.scores, &i, 1, 1);
    assert_false(r.scores[i].refined);
    rig_free(&r);
    rig_records(&r);
    const double drag = 2.0;
    rig_effect(&r, "quadratic_drag", &drag, 1);
    rig_fit(&r);
    const struct score_options options = {.sigma = r.sigma, .laws = true};
    assert_int_equal(score_base_new(&r.model, r.records, RECORDS, &options, &r.base, &err), BF_OK);
    assert_int_equal(candidate_list_new(&r.model, r.records, RECORDS, NULL, &r.list, &err), BF_OK);
    r.scores = calloc(r.list.n, sizeof *r.scores);
    score_run(r.base, r.list.candidates + i, 1, r.scores + i);
    assert_true(r.scores[i].possible);
    assert_near(r.scores[i].p[0], drag, 0.3 * drag);
    rig_free(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_score_is_the_fall_of_a_linear_least_squares_fit),
        cmocka_unit_test(without_an_effect_the_score_is_chi_square),
        cmocka_unit_test(a_weak_mass_is_found_with_its_place_and_size),
        cmocka_unit_test(a_clamp_that_turns_a_little_is_found),
        cmocka_unit_test(a_strength_of_the_wrong_sign_explains_nothing),
        cmocka_unit_test(a_finite_trial_finds_a_saturated_sensor),
        cmocka_unit_test(a_line_is_found_with_a_phase_for_each_record),
        cmocka_unit_test(steps_through_short_windows_find_a_strong_mass),
        cmocka_unit_test(a_law_is_left_to_the_trial_unless_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
