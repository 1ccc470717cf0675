/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The Jacobian of every effect of the catalogue. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "gradient_check.h"
#include "add_effect.h"

/* ---- The catalogue ---- */

/* Values at which every effect acts on this record,and no knot near a place. */
static void strengthen(struct predict_case *c)
{
    struct model_effect *e = &c->model.effects[0];
    double factor = 5.0;
    for (int i = 0; i < e->effect->n_parameters; i++) {
        if (e->effect->parameters[i].role == BEAM_ROLE_PLACE)
            factor = 50.0, e->parameters[i].value = 0.3507; /* the middle of an element of 19.4 mm */
        if (strcmp(e->parameters[i].name, "gap_m") == 0)
            e->parameters[i].value = 1e-5;
        if (e->effect->parameters[i].role == BEAM_ROLE_RESONANCE)
            e->parameters[i].value = 50.0; /* in the band */
    }
    if (e->effect->terms != NULL)
        e->parameters[0].value *= factor; /* so strong that the rounding of y does not limit the reference */
}

static bool open_effect(struct predict_case *c, const char *id, struct bf_error *err)
{
    struct predict_options options = {.fine_splines = 24, .modes = 6, .threads = 1};
    *c = (struct predict_case){.record = case_record("case.csv", SAMPLES, 1.0 / 1024.0, 2.0, true)};
    fixture_model(&c->model, "");
    if (add_effect(&c->model, id, "", err) != BF_OK) {
        case_parameters(c);
        return false;
    }
    strengthen(c);
    return case_open(c, &options, err) == BF_OK;
}

/* Some parameter of the effect moves the prediction: an effect that is accepted must act. */
static bool acts(const struct predict_case *c)
{
    double sum = 0.0;
    for (size_t i = 0; i < c->n; i++)
        for (size_t k = 0; c->refs[i].role == ROLE_EFFECT && k < c->out.n_rows; k++)
            sum += fabs(c->out.jacobian[i * c->out.n_rows + k]);
    return sum > 0.0;
}

/* False: the Jacobian is wrong. */
static bool check_effect(struct predict_case *c, const struct beam_effect *effect)
{
    struct bf_error err;
    bool *want = bf_alloc(c->n, sizeof *want);
    memset(want, 1, c->n * sizeof *want);
    enum bf_status status = predictor_run(c->predictor, c->theta, want, &c->out, &err);
    free(want);
    if (status != BF_OK || !acts(c)) {
        print_message("  %-22s %s\n", effect->id, status != BF_OK ? err.text : "does nothing to the prediction");
        return false;
    }
    struct summary s = check_case(c, false);
    double goal = has_kinks(&c->model) ? fmax(linear_goal, 10.0 * s.worst.estimate) : linear_goal;
    bool good = s.worst.error < goal && s.worst.estimate < 1e-4;
    print_message("  %-22s %-34s %9.1e %9.1e%s\n", effect->id, s.label, s.worst.error, s.worst.estimate,
                  good ? "" : "  <-- wrong");
    return good;
}

static void every_effect(void **state)
{
    (void)state;
    size_t refused = 0, checked = 0, wrong = 0;
    print_message("  %-22s %-34s %9s %9s\n", "effect", "worst parameter", "error", "reference");
    for (int k = 0; k < beam_effects_count; k++) {
        struct predict_case c;
        struct bf_error err = {0};
        if (open_effect(&c, beam_effects[k]->id, &err)) {
            wrong += !check_effect(&c, beam_effects[k]);
            checked++;
        } else {
            assert_true(err.text[0] != '\0');
            print_message("  %-22s refused: %s\n", beam_effects[k]->id, err.text);
            refused++;
        }
        case_close(&c);
    }
    print_message("  %zu effects checked, %zu refused\n", checked, refused);
    assert_int_equal(refused, 0);
    assert_int_equal(wrong, 0);
}

/* ---- Where a search starts: an effect that is not there yet ---- */

/* d prediction/d strength at strength 0, of a predictor built at `built_at`; free(). */
static double *slope_at_zero(const char *id, bool built_at_zero, size_t *rows)
{
    struct predict_options options = {.fine_splines = 24, .modes = 6, .threads = 1};
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1024.0, 2.0, true)};
    struct bf_error err;
    fixture_model(&c.model, "");
    if (add_effect(&c.model, id, "", &err) != BF_OK)
        fail_msg("%s", err.text);
    struct parameter *strength = &c.model.effects[0].parameters[0];
    if (built_at_zero)
        strength->value = 0.0;
    if (case_open(&c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
    size_t i = 0;
    while (i + 1 < c.n && (c.refs[i].role != ROLE_EFFECT || c.refs[i].slot != 0))
        i++;
    c.theta[i] = 0.0;
    bool *want = bf_alloc(c.n, sizeof *want);
    want[i] = true;
    case_run(&c, want);
    *rows = c.out.n_rows;
    double *slope = bf_alloc(*rows, sizeof *slope);
    memcpy(slope, c.out.jacobian + i * *rows, *rows * sizeof *slope);
    free(want);
    case_close(&c);
    return slope;
}

/* A fit that starts from no drag at all must feel which way to go: the same derivative as in a model built with drag. */
static void strength_zero_has_a_derivative(void **state)
{
    (void)state;
    size_t checked = 0;
    for (int k = 0; k < beam_effects_count; k++) {
        const struct beam_effect *effect = beam_effects[k];
        size_t rows, same_rows;
        if (effect->law == NULL || effect->parameters[0].neutral != 0.0 || effect->parameters[0].minimum > 0.0)
            continue;
        double *built = slope_at_zero(effect->id, true, &rows),
               *reference = slope_at_zero(effect->id, false, &same_rows);
        assert_int_equal(rows, same_rows);
        double size = 0.0, off = 0.0;
        for (size_t i = 0; i < rows; i++) {
            size += reference[i] * reference[i];
            off += (built[i] - reference[i]) * (built[i] - reference[i]);
        }
        print_message("  %-22s |slope| %9.2e  off by %.1e of it\n", effect->id, sqrt(size), sqrt(off / size));
        assert_true(size > 0.0);
        assert_true(off <= 1e-12 * size);
        free(built), free(reference);
        checked++;
    }
    assert_true(checked >= 6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_effect),
        cmocka_unit_test(strength_zero_has_a_derivative),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
