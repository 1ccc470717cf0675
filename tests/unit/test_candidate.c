/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Candidates: every effect of the catalogue is considered, refused for the right reason, and scanned inside its range. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "estimate/estimate.h"
#include "fit_rig.h"
#include "add_effect.h"

static struct model model;
static struct record record;

static int setup(void **state)
{
    (void)state;
    double sigma[2];
    seed = 1;
    make_model(&truth, &model);
    make_record("one.csv", 0.05, 1.0, &record, sigma);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    model_free(&model);
    record_free(&record);
    return 0;
}

static const struct candidate *candidate_of(const struct candidate_list *list, const char *id, const char *channel)
{
    for (size_t i = 0; i < list->n; i++)
        if (strcmp(list->candidates[i].effect->id, id) == 0 && strcmp(list->candidates[i].channel, channel) == 0)
            return &list->candidates[i];
    return NULL;
}

static const char *refusal_of(const struct candidate_list *list, const char *id)
{
    for (size_t i = 0; i < list->n_refused; i++)
        if (strcmp(list->refused[i].effect->id, id) == 0)
            return list->refused[i].reason;
    return "";
}

static void list_of(const struct candidate_options *options, struct candidate_list *list)
{
    struct bf_error err;
    assert_int_equal(candidate_list_new(&model, &record, 1, options, list, &err), BF_OK);
}

static void every_effect_is_a_candidate_or_refused_with_a_reason(void **state)
{
    (void)state;
    struct candidate_list list;
    list_of(NULL, &list);
    for (int i = 0; i < beam_effects_count; i++) {
        bool found = false;
        for (size_t k = 0; k < list.n; k++)
            found = found || list.candidates[k].effect == beam_effects[i];
        assert_true(found != (refusal_of(&list, beam_effects[i]->id)[0] != '\0'));
    }
    assert_non_null(candidate_of(&list, "tip_mass", ""));
    assert_contains(refusal_of(&list, "drive_saturation"), "channels"); /* no patch_moment input */
    candidate_list_free(&list);
}

static void grids_lie_inside_the_physical_range(void **state)
{
    (void)state;
    struct candidate_list list;
    list_of(NULL, &list);
    for (size_t k = 0; k < list.n; k++) {
        const struct candidate *c = &list.candidates[k];
        assert_in_range(c->strength, 0, c->effect->n_parameters - 1);
        for (int i = 0; i < c->effect->n_parameters; i++) {
            assert_true(c->role[i] != CANDIDATE_INNER || c->n_grid[i] > 0);
            assert_true(c->role[i] != CANDIDATE_INVERSE || c->n_grid[i] > 0);
            assert_true(c->n_grid[i] <= CANDIDATE_GRID);
            for (size_t j = 0; j < c->n_grid[i]; j++)
                assert_true(isfinite(c->grid[i][j]) && c->grid[i][j] >= c->lower[i] && c->grid[i][j] <= c->upper[i]);
        }
    }
    candidate_list_free(&list);
}

static void grids_follow_the_beam_and_the_records(void **state)
{
    (void)state;
    struct candidate_list list;
    const double line = 57.25;
    const struct candidate_options options = {.line_Hz = &line, .n_lines = 1};
    list_of(&options, &list);
    const struct candidate *mass = candidate_of(&list, "point_mass", "");
    assert_int_equal(mass->role[1], CANDIDATE_INNER);
    assert_near(mass->grid[1][0], 0.4, 1e-12); /* the free end first */
    const struct candidate *memory = candidate_of(&list, "viscoelastic", "");
    assert_near(memory->grid[1][0], 1e-3, 1e-12);                   /* one sample … */
    assert_near(memory->grid[1][memory->n_grid[1] - 1], 1.0, 1e-9); /* … to the record */
    const struct candidate *hum = candidate_of(&list, "mains_hum", "");
    assert_int_equal(hum->role[1], CANDIDATE_PHASE);
    assert_int_equal(hum->n_grid[2], 3);
    assert_near(hum->grid[2][0], line, 1e-12);
    double peak = 0.0;
    const double *z = record_column(&record, "piezo_V");
    for (size_t i = 0; i < record.n; i++)
        peak = fmax(peak, fabs(z[i]));
    const struct candidate *limit = candidate_of(&list, "sensor_saturation", "");
    assert_int_equal(limit->role[0], CANDIDATE_INVERSE);
    assert_true(limit->grid[0][0] < peak && limit->grid[0][limit->n_grid[0] - 1] > peak);
    candidate_list_free(&list);
}

static void what_is_in_the_model_or_left_out_is_refused(void **state)
{
    (void)state;
    struct bf_error err;
    struct candidate_list list;
    const char *without[] = {"tip_mass"};
    const struct candidate_options options = {.without = without, .n_without = 1};
    assert_int_equal(add_effect(&model, "point_damper", "", &err), BF_OK);
    list_of(&options, &list);
    assert_null(candidate_of(&list, "tip_mass", ""));
    assert_contains(refusal_of(&list, "tip_mass"), "request");
    assert_null(candidate_of(&list, "point_damper", ""));
    assert_contains(refusal_of(&list, "point_damper"), "has it");
    candidate_list_free(&list);
    without[0] = "tip_mas";
    assert_int_equal(candidate_list_new(&model, &record, 1, &options, &list, &err), BF_USAGE);
    assert_contains(err.text, "tip_mass");
}

/* An effect at the end of a beam whose length is found would be off it at once: its search begins before the end. */
static void effects_at_places_are_tried_though_the_length_is_free(void **state)
{
    (void)state;
    struct candidate_list list;
    model.own.lists_length = true;
    list_of(NULL, &list);
    for (size_t k = 0; k < list.n; k++) {
        const struct candidate *c = &list.candidates[k];
        for (int i = 0; i < c->effect->n_parameters; i++)
            if (c->effect->parameters[i].role == BEAM_ROLE_PLACE)
                assert_true(c->start[i] < model.length_m && c->upper[i] < model.length_m);
    }
    assert_non_null(candidate_of(&list, "point_spring", ""));
    assert_non_null(candidate_of(&list, "point_mass", ""));
    assert_non_null(candidate_of(&list, "cubic_stiffness", ""));
    candidate_list_free(&list);
}

static void a_clamp_that_is_none_cannot_turn(void **state)
{
    (void)state;
    struct candidate_list list;
    model.support = SUPPORT_PINNED_PINNED;
    list_of(NULL, &list);
    assert_contains(refusal_of(&list, "root_compliance"), "clamped");
    candidate_list_free(&list);
}

static void single_channels_are_offered_on_request(void **state)
{
    (void)state;
    struct candidate_list list;
    const struct candidate_options options = {.each_channel = true};
    list_of(&options, &list);
    assert_non_null(candidate_of(&list, "sensor_delay", ""));
    assert_non_null(candidate_of(&list, "sensor_delay", "piezo_V"));
    assert_non_null(candidate_of(&list, "sensor_delay", "tip_mps"));
    assert_non_null(candidate_of(&list, "sensor_lag", ""));
    assert_null(candidate_of(&list, "sensor_lag", "piezo_V")); /* that is its default */
    assert_non_null(candidate_of(&list, "sensor_lag", "tip_mps"));
    candidate_list_free(&list);
    drop_column(&record, "piezo_V"); /* without the default channel, the others are what is left */
    list_of(NULL, &list);
    assert_null(candidate_of(&list, "sensor_lag", ""));
    assert_non_null(candidate_of(&list, "sensor_lag", "tip_mps"));
    candidate_list_free(&list);
}

static void the_model_gains_the_effect_with_its_place_free(void **state)
{
    (void)state;
    struct bf_error err;
    struct candidate_list list;
    struct model with;
    list_of(NULL, &list);
    const struct candidate *mass = candidate_of(&list, "point_mass", "");
    double p[BEAM_EFFECT_PARAMETERS] = {2e-3, 0.25};
    assert_int_equal(candidate_model(&model, mass, p, &with, &err), BF_OK);
    assert_int_equal(model.n_effects, 0);
    assert_int_equal(with.n_effects, 1);
    assert_near(with.effects[0].parameters[0].value, 2e-3, 1e-15);
    assert_near(with.effects[0].parameters[1].value, 0.25, 1e-15);
    assert_false(with.effects[0].parameters[1].fixed);
    model_free(&with);
    p[1] = 0.41; /* beyond the free end */
    assert_int_equal(candidate_model(&model, mass, p, &with, &err), BF_USAGE);
    const struct candidate *crack = candidate_of(&list, "bilinear_stiffness", "");
    assert_int_equal(candidate_model(&model, crack, crack->start, &with, &err), BF_OK);
    assert_true(with.effects[0].parameters[2].fixed); /* width_m is held */
    model_free(&with);
    candidate_list_free(&list);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_effect_is_a_candidate_or_refused_with_a_reason, setup, teardown),
        cmocka_unit_test_setup_teardown(grids_lie_inside_the_physical_range, setup, teardown),
        cmocka_unit_test_setup_teardown(grids_follow_the_beam_and_the_records, setup, teardown),
        cmocka_unit_test_setup_teardown(what_is_in_the_model_or_left_out_is_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(effects_at_places_are_tried_though_the_length_is_free, setup, teardown),
        cmocka_unit_test_setup_teardown(a_clamp_that_is_none_cannot_turn, setup, teardown),
        cmocka_unit_test_setup_teardown(single_channels_are_offered_on_request, setup, teardown),
        cmocka_unit_test_setup_teardown(the_model_gains_the_effect_with_its_place_free, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
