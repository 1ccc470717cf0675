/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The measured motion against true motion of the truth simulator, at a place where no sensor is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "motion_rig.h"
#include "estimate/regression.h"

static double distance(size_t n, const double a[], const double b[])
{
    double sum = 0.0, size = 0.0;
    for (size_t k = 0; k < n; k++) {
        sum += (a[k] - b[k]) * (a[k] - b[k]);
        size += b[k] * b[k];
    }
    return sqrt(sum / size);
}

/*
 * Deflection of the free end of a record: predicted by the linear model, and measured. The last fifth (two periods of the
 * first mode) is left out: a velocity that is not known any more leaves the displacement open.
 */
static void end_errors(const struct motion_rig *rig, size_t record, double *predicted, double *measured)
{
    struct bf_error err;
    size_t n = rig->records[record].n, part = n - n / 5;
    const struct transfer_record t = transfer_record(rig->predictor, record);
    double *w = bf_alloc(n, sizeof *w), *g = bf_alloc(rig->motion.modes.dimension, sizeof *g);
    double complex *W = bf_alloc(t.grid->m, sizeof *W);
    reduced_point(transfer_reduced(rig->predictor), 0, rig->model.length_m, g);
    transfer_motion(rig->predictor, rig->theta, record, g, W);
    assert_int_equal(response_back(t.grid, W, w, &err), BF_OK);
    *predicted = distance(part, w, rig->hidden_m[record]);
    assert_int_equal(motion_of(&rig->motion, record, g, 1, w, NULL, NULL, &err), BF_OK);
    *measured = distance(part, w, rig->hidden_m[record]);
    free(w);
    free(g);
    free(W);
}

/* A hardening spring at the free end that bends the resonances: the prediction is far off, the motion is not. */
static void motion_follows_the_sensors_where_the_prediction_is_far_off(void **state)
{
    (void)state;
    struct motion_rig rig;
    double predicted, measured;
    rig_open(&rig, "effect cubic_stiffness coefficient_Npm3=20000", 0.0, 0.0);
    end_errors(&rig, 2, &predicted, &measured);
    assert_true(predicted > 0.1);
    assert_true(measured < 0.03);
    end_errors(&rig, 0, &predicted, &measured); /* one sensor, a slope difference near the clamp */
    assert_true(predicted > 0.01);
    assert_true(measured < 0.005);
    rig_close(&rig);
}

/* The same with a linear beam and a wrong model. */
static void motion_does_not_need_the_right_model(void **state)
{
    (void)state;
    struct motion_rig rig;
    double predicted, measured;
    rig_open(&rig, "", 0.15, 0.0);
    end_errors(&rig, 2, &predicted, &measured);
    assert_true(predicted > 0.1);
    assert_true(measured < 0.03);
    rig_close(&rig);
}

/* w and v belong together, and oversampling keeps the samples. */
static void rate_is_the_derivative(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct bf_error err;
    enum { FACTOR = 8 };
    rig_open(&rig, "", 0.1, 0.0);
    size_t n = rig.records[2].n;
    double *w = bf_alloc(2 * n * FACTOR, sizeof *w), *v = w + n * FACTOR, *coarse = bf_alloc(n, sizeof *coarse);
    const struct beam_operator patch = {.kind = BEAM_AT_PATCH};
    double *g = bf_alloc(2 * rig.motion.modes.dimension, sizeof *g);
    reduced_place(transfer_reduced(rig.predictor), &patch, &rig.model, g, g + rig.motion.modes.dimension);
    assert_int_equal(motion_of(&rig.motion, 2, g, FACTOR, w, v, NULL, &err), BF_OK);
    assert_int_equal(motion_of(&rig.motion, 2, g, 1, coarse, NULL, NULL, &err), BF_OK);
    double h = rig.records[2].dt_s / FACTOR, error = 0.0, size = 0.0;
    for (size_t k = 2; k + 2 < n * FACTOR; k++) { /* fourth order */
        double slope = (8.0 * (w[k + 1] - w[k - 1]) - (w[k + 2] - w[k - 2])) / (12.0 * h);
        error += (slope - v[k]) * (slope - v[k]);
        size += v[k] * v[k];
    }
    assert_true(error < 1e-6 * size);
    for (size_t k = 0; k < n; k++)
        assert_true(fabs(w[k * FACTOR] - coarse[k]) < 1e-9);
    free(g);
    free(w);
    free(coarse);
    rig_close(&rig);
}

/*
 * Far from the optimum a regression along the measured motion lands beside the truth, where stepping along the predicted
 * motion would need many steps and a window: equation error is linear.
 */
static void one_regression_finds_a_linear_beam_from_far_away(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct regression regression;
    struct bf_error err;
    rig_open(&rig, "", 0.15, 0.1);
    double scale = rig_value(&rig, rig.theta, "EI_beam_Nm2") / rig_EI_beam;
    assert_int_equal(regression_new(&rig.motion, &regression, &err), BF_OK);
    regression_move(&regression, &rig.motion, NULL, rig.theta);
    rig_near(rig_value(&rig, rig.theta, "EI_patch_Nm2") / rig_value(&rig, rig.theta, "EI_beam_Nm2"),
             rig_EI_patch / rig_EI_beam, 0.02);
    rig_near(rig_value(&rig, rig.theta, "EI_beam_Nm2") / rig_value(&rig, rig.theta, "rho_beam_kgpm"),
             rig_EI_beam / 0.0923, 0.005);
    /* the common scale is what the priors say, not what makes equation error smallest (zero) */
    rig_near(rig_value(&rig, rig.theta, "EI_beam_Nm2"), rig_EI_beam * scale, 0.03);
    regression_free(&regression);
    rig_close(&rig);
}

/* A force put into the model comes back out of it: response, then assumed motion. */
static void an_assumed_force_explains_its_response(void **state)
{
    (void)state;
    struct motion_rig rig;
    struct motion_paths paths;
    struct bf_error err;
    rig_open(&rig, "effect cubic_stiffness coefficient_Npm3=20000", 0.0, 0.0);
    size_t record = 2, n = rig.records[record].n, m = rig.motion.records[record].m;
    double *g = bf_alloc(rig.motion.modes.dimension, sizeof *g), *w = bf_alloc(n * 4, sizeof *w);
    double *rows = bf_alloc(rig.motion.n_rows, sizeof *rows);
    double complex *F = bf_alloc(m, sizeof *F);
    reduced_point(transfer_reduced(rig.predictor), 0, rig.model.length_m, g);
    motion_paths_new(&rig.motion, g, 1, &paths);
    assert_int_equal(motion_of(&rig.motion, record, g, 4, w, NULL, NULL, &err), BF_OK);
    for (size_t k = 0; k < n * 4; k++)
        w[k] = 20000.0 * w[k] * w[k] * w[k];
    assert_int_equal(motion_transform(&rig.motion, record, w, 1, 4, F, &err), BF_OK);
    assert_int_equal(motion_respond(&rig.motion, &paths, record, F, rows, &err), BF_OK);
    for (size_t c = 0; c < rig.motion.n_channels; c++) {
        const struct predict_channel *channel = &rig.motion.channels[c];
        if (channel->record == record && rig.model.outputs[channel->output].kind == OUTPUT_VELOCITY)
            assert_true(distance(n - n / 5, rows + channel->row, rig.motion.residual + channel->row) < 0.15);
    }
    motion_paths_free(&rig.motion, &paths);
    free(g);
    free(w);
    free(rows);
    free(F);
    rig_close(&rig);
}

static double first_omega(const struct predictor *predictor)
{
    struct transfer_modes modes = transfer_modes(predictor, 0.0, 1);
    double omega = modes.omega_rad[0];
    free(modes.damping);
    return omega;
}

/* A first mode whose envelope is not exponential and whose frequency falls, off the model's: the motion follows all the same. */
static void a_free_decay_is_followed(void **state)
{
    (void)state;
    enum { N = 2048 };
    static double x[N], w[N], v[N];
    struct motion_rig rig = {.n_parameters = 0};
    struct record record = {.n = N, .dt_s = 1.0 / 512.0, .path = bf_strdup("decay.csv")};
    struct bf_error err;
    double sigma[1] = {1e-3}, omega = 0.0, square = 0.0, difference = 0.0, of_w = 0.0;
    int order;
    rig_model(&rig, 0.0);
    for (int pass = 0; pass < 2; pass++) { /* once to know the model's frequency */
        for (int k = 0; k < N; k++) {
            double t = (double)k * record.dt_s;
            x[k] = sin(1.01 * omega * t - 0.01 * omega * t * t / 4.0 + 0.4) / (1.0 + 2.0 * t);
        }
        if (pass == 0) {
            record_add_column(&record, "tip_mps", x);
            record_add_meta(&record, "excitation", "free_decay");
        }
        memcpy(record.columns[0].x, x, sizeof x);
        predictor_free(pass > 0 ? rig.predictor : NULL);
        assert_int_equal(predictor_new(&rig.model, &record, 1, NULL, &rig.predictor, &err), BF_OK);
        size_t n = transfer_parameters(rig.predictor, &rig.refs);
        rig.theta = bf_grow(pass > 0 ? rig.theta : NULL, n, sizeof(double));
        for (size_t i = 0; i < n; i++)
            rig.theta[i] = rig.refs[i].value;
        omega = first_omega(rig.predictor);
    }
    if (motion_new(rig.predictor, rig.theta, sigma, 0.0, &rig.motion, &err) != BF_OK)
        fail_msg("%s", err.text);
    const double *g = transfer_output_functional(rig.predictor, rig.motion.channels[0].output, &order);
    assert_int_equal(motion_of(&rig.motion, 0, g, 1, w, v, NULL, &err), BF_OK);
    for (int k = 0; k < N; k++) {
        square += x[k] * x[k];
        difference += (v[k] - x[k]) * (v[k] - x[k]);
        of_w += omega * omega * w[k] * w[k];
    }
    print_message("  off by %.2g of it, displacement %.2g of what it must be\n", sqrt(difference / square),
                  sqrt(of_w / square));
    assert_true(sqrt(difference / square) < 0.06); /* of which the first and last windows have most */
    assert_true(fabs(sqrt(of_w / square) - 1.0) < 0.05);
    motion_free(&rig.motion);
    predictor_free(rig.predictor);
    free(rig.theta);
    record_free(&record);
    model_free(&rig.model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motion_follows_the_sensors_where_the_prediction_is_far_off),
        cmocka_unit_test(motion_does_not_need_the_right_model),
        cmocka_unit_test(rate_is_the_derivative),
        cmocka_unit_test(one_regression_finds_a_linear_beam_from_far_away),
        cmocka_unit_test(an_assumed_force_explains_its_response),
        cmocka_unit_test(a_free_decay_is_followed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
