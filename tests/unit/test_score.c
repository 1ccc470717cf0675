/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The score of candidates: against plain least squares, under noise alone, for weak and strong effects, and its edges. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "fit_rig.h"
#include "score.h"

enum { RECORDS = 2, CHANNELS = 2 * RECORDS };

/* Two hammer records of a beam that may have an effect, and a baseline without it. */
struct rig {
    struct model model;
    struct record records[RECORDS];
    double sigma[CHANNELS];
    struct candidate_list list;
    struct score_base *base;
    struct score *scores;
};

static void rig_records(struct rig *r)
{
    memset(r, 0, sizeof *r);
    make_model(&truth, &r->model);
    make_record("a.csv", 0.05, 1.0, &r->records[0], r->sigma);
    make_record("b.csv", 0.1, 3.0, &r->records[1], r->sigma + 2);
}

/* The noise stays, the motion is that of the beam with the effect. */
static void rig_effect(struct rig *r, const char *id, const double p[], size_t n)
{
    struct bf_error err;
    const char *names[RECORDS] = {"a.csv", "b.csv"};
    struct prediction y;
    double *without = NULL;
    for (int with = 0; with < 2; with++) {
        struct model model;
        struct predictor *predictor;
        struct parameter_ref *refs;
        make_model(&truth, &model);
        if (with) {
            assert_int_equal(model_add_effect(&model, id, "", &err), BF_OK);
            for (size_t i = 0; i < n; i++)
                model.effects[0].parameters[i].value = p[i];
        }
        assert_int_equal(predictor_new(&model, r->records, RECORDS, NULL, &predictor, &err), BF_OK);
        const size_t n_refs = model_parameters(&model, names, RECORDS, &refs);
        double *theta = calloc(n_refs, sizeof *theta);
        for (size_t i = 0; i < n_refs; i++)
            theta[i] = refs[i].value;
        assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
        const struct predict_channel *channels;
        predictor_channels(predictor, &channels);
        for (size_t c = 0; c < CHANNELS; c++) {
            double *z = r->records[channels[c].record].columns[1 + c % 2].x;
            for (size_t k = 0; with && without && k < SAMPLES; k++)
                z[k] += y.y[channels[c].row + k] - without[channels[c].row + k];
        }
        if (!with) {
            without = calloc(y.n_rows, sizeof *without);
            memcpy(without, y.y, y.n_rows * sizeof *without);
        }
        free(theta), free(refs);
        predictor_free(predictor);
        model_free(&model);
    }
    free(without);
}

/* The baseline at its optimum: a score is a linearisation there. */
static void rig_fit(struct rig *r)
{
    struct bf_error err;
    struct fit_result fit;
    const struct fit_options options = {.quiet = true, .never_search = true, .sigma = r->sigma};
    assert_int_equal(fit_run(&r->model, r->records, RECORDS, &options, &fit, &err), BF_OK);
    fit_into_model(&fit, r->records, &(struct fit_check){0}, &r->model);
    fit_free(&fit);
}

static void rig_score(struct rig *r, const struct candidate_options *candidates)
{
    struct bf_error err;
    const struct score_options options = {.sigma = r->sigma, .threads = 2};
    assert_int_equal(candidate_list_new(&r->model, r->records, RECORDS, candidates, &r->list, &err), BF_OK);
    assert_int_equal(score_base_new(&r->model, r->records, RECORDS, &options, &r->base, &err), BF_OK);
    r->scores = calloc(r->list.n, sizeof *r->scores);
    score_run(r->base, r->list.candidates, r->list.n, r->scores);
}

static void rig_free(struct rig *r)
{
    for (size_t i = 0; i < r->list.n; i++)
        score_free(&r->scores[i]);
    free(r->scores);
    score_base_free(r->base);
    candidate_list_free(&r->list);
    for (size_t i = 0; i < RECORDS; i++)
        record_free(&r->records[i]);
    model_free(&r->model);
}

static size_t index_of(const struct rig *r, const char *id)
{
    for (size_t i = 0; i < r->list.n; i++)
        if (strcmp(r->list.candidates[i].effect->id, id) == 0)
            return i;
    fail_msg("no candidate %s", id);
    return 0;
}

static size_t best_of(const struct rig *r)
{
    size_t *order = calloc(r->list.n, sizeof *order);
    assert_true(score_rank(r->list.candidates, r->scores, r->list.n, order) > 0);
    const size_t best = order[0];
    free(order);
    return best;
}

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

static void steps_through_short_windows_lead_a_strong_mass_home(void **state)
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
    assert_true(least < 0.3 * score_base_chi_square(r.base));
    assert_near(r.scores[lowest].p[0], 4e-3, 1e-3);
    free(order);
    rig_free(&r);
}

/* ---- What the baseline can absorb ---- */

static void a_vanished_damping_comes_back(void **state)
{
    (void)state;
    struct rig r;
    seed = 41;
    rig_records(&r);
    r.model.materials[0].cDI.value = 1e-13; /* the beam has 2e-5 */
    rig_score(&r, NULL);
    struct model start;
    struct bf_error err;
    double freedom;
    const size_t i = index_of(&r, "axial_load");
    assert_true(score_base_chi_square(r.base) > 1.2 * CHANNELS * SAMPLES);
    assert_true(score_base_misfit(r.base, &freedom) < 0.9 * score_base_chi_square(r.base));
    assert_int_equal(score_model(r.base, &r.list.candidates[i], &r.scores[i], &start, &err), BF_OK);
    assert_true(start.materials[0].cDI.value > 0.05 * truth.cDI && start.materials[0].cDI.value < 3.0 * truth.cDI);
    model_free(&start);
    rig_free(&r);
}

static void free_states_of_a_decay_are_absorbed(void **state)
{
    (void)state;
    struct rig r;
    seed = 42;
    rig_records(&r);
    rig_effect(&r, "tip_mass", (const double[]){2e-4}, 1);
    for (size_t i = 0; i < RECORDS; i++) {
        record_add_meta(&r.records[i], "excitation", "free_decay");
        record_add_meta(&r.records[i], "free_from_s", "0.2");
    }
    rig_fit(&r);
    rig_score(&r, &(struct candidate_options){.without = (const char *const[]){"base_motion"}, .n_without = 1});
    double freedom;
    assert_true(score_base_misfit(r.base, &freedom) < 50.0 * freedom);
    const struct score *mass = &r.scores[index_of(&r, "tip_mass")];
    assert_true(mass->possible);
    assert_true(mass->explained > 0.8);
    rig_free(&r);
}

/* ---- Resemblance ---- */

static void cosines_tell_what_can_stand_for_what(void **state)
{
    (void)state;
    struct rig r;
    seed = 51;
    rig_records(&r);
    rig_effect(&r, "hysteretic_damping", (const double[]){2e-3}, 1);
    rig_fit(&r);
    rig_score(&r, NULL);
    const size_t n = r.list.n, a = index_of(&r, "hysteretic_damping"), b = index_of(&r, "square_root_damping");
    const size_t far = index_of(&r, "feedthrough");
    double *cosine = calloc(n * n, sizeof *cosine);
    score_cosines(r.scores, n, cosine);
    for (size_t i = 0; i < n; i++) {
        assert_near(cosine[i + n * i], r.scores[i].possible ? 1.0 : 0.0, 0.0);
        for (size_t j = 0; j < n; j++)
            assert_true(cosine[j + n * i] >= 0.0 && cosine[j + n * i] <= 1.0);
    }
    assert_true(cosine[a + n * b] > 0.95);
    assert_near(cosine[a + n * b], cosine[b + n * a], 1e-4); /* one strength each */
    assert_true(r.scores[far].rank == 0 || cosine[far + n * a] < 0.8);
    free(cosine);
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
    assert_int_equal(score_refine(r.base, &r.list.candidates[i], 1, &r.scores[i], &err), BF_USAGE);
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
        cmocka_unit_test(a_strength_of_the_wrong_sign_explains_nothing),
        cmocka_unit_test(a_finite_trial_finds_a_saturated_sensor),
        cmocka_unit_test(a_line_is_found_with_a_phase_for_each_record),
        cmocka_unit_test(steps_through_short_windows_lead_a_strong_mass_home),
        cmocka_unit_test(a_vanished_damping_comes_back),
        cmocka_unit_test(free_states_of_a_decay_are_absorbed),
        cmocka_unit_test(cosines_tell_what_can_stand_for_what),
        cmocka_unit_test(a_law_is_left_to_the_trial_unless_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
