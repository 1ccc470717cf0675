/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Predictions against a dense simulation in the time domain, and what a predictor must and must not accept. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "predict_case.h"
#include "response/predictor.h"
#include "signals.h"
#include "state_space.h"

enum { SAMPLES = 256, FINE = 16, CHANNELS = 3 };
static const double dt_s = 1.0 / 1024.0;

static void open_case(struct predict_case *c, const char *effects, double level_N, bool inputs)
{
    struct predict_options options = {.fine_splines = 40, .modes = 8};
    struct bf_error err;
    *c = (struct predict_case){.record = case_record("case.csv", SAMPLES, dt_s, level_N, inputs)};
    fixture_model(&c->model, effects);
    if (case_open(c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static double nrmse(const double a[], const double b[], size_t n)
{
    double sum = 0.0, size = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
        size += b[i] * b[i];
    }
    return sqrt(sum / size);
}

static double input_at(size_t input, double t_s)
{
    return input == 0 ? case_hammer(t_s, 1.0) : case_drive(t_s, 0.8 * SAMPLES * dt_s);
}

/* y[CHANNELS][SAMPLES] += the response to one input, or to an initial state z0 when input is SIZE_MAX. */
static void simulate(const struct predict_case *c, size_t input, const double z0[], double y[])
{
    const struct predictor *p = c->predictor;
    const struct system *s = p->system;
    struct state_space space = state_space_new(s->n, s->M, s->C, s->K);
    size_t n = s->n, d = 2 * n + STATE_SPACE_INPUT;
    double *b = bf_alloc(n * (1 + CHANNELS), sizeof *b), *o = b + n, *z = bf_alloc(2 * d, sizeof *z), *next = z + d;
    double *E = bf_alloc(d * d, sizeof *E), h = dt_s / FINE;
    if (input != SIZE_MAX)
        state_space_functional(&space, p->inputs[input].g, b);
    for (size_t ch = 0; ch < CHANNELS; ch++)
        state_space_functional(&space, p->outputs[ch].g, o + ch * n);
    if (z0 != NULL)
        memcpy(z, z0, 2 * n * sizeof *z);
    state_space_step(&space, b, h, E);
    double gain = input == 1 ? c->theta[case_index(c, "KB_NmpV")] : 1.0, Ks = c->theta[case_index(c, "Ks_V")];
    for (size_t k = 0; k < (size_t)SAMPLES * FINE; k++) {
        double around[5] = {0};
        for (int i = 0; input != SIZE_MAX && i < 5; i++)
            around[i] = gain * input_at(input, ((double)k + i - 2.0) * h);
        state_space_input(around, z + 2 * n);
        for (size_t ch = 0; k % FINE == 0 && ch < CHANNELS; ch++)
            y[ch * SAMPLES + k / FINE] +=
                (ch == 0 ? Ks : 1.0) *
                state_space_output(&space, o + ch * n, output_order(p->model.outputs[ch].kind), b, z);
        dense_gemv(false, d, d, 1.0, E, z, 0.0, next);
        memcpy(z, next, 2 * n * sizeof *z);
    }
    free(b);
    free(z);
    free(E);
    state_space_free(&space);
}

static void linear_prediction_is_the_simulation(void **state)
{
    (void)state;
    struct predict_case c;
    static double y[CHANNELS * SAMPLES];
    open_case(&c, "", 1.0, true);
    case_run(&c, NULL);
    memset(y, 0, sizeof y);
    simulate(&c, 0, NULL, y);
    simulate(&c, 1, NULL, y);
    for (size_t ch = 0; ch < CHANNELS; ch++) {
        double error = nrmse(c.out.y + ch * SAMPLES, y + ch * SAMPLES, SAMPLES);
        print_message("  %s: %.2g of rms\n", c.model.outputs[ch].name, error);
        assert_true(error < 1e-4);
    }
    case_close(&c);
}

/* A free decay from the state that one mode with amplitude a has: x = 2 Re(a φ), x' = 2 Re(a p φ). */
static void decay_columns_are_the_simulation(void **state)
{
    (void)state;
    struct predict_case c;
    static double y[CHANNELS * SAMPLES], sum[CHANNELS * SAMPLES];
    open_case(&c, "  - {kind: point_damper, damping_Nspm: 0.01, at_m: 0.2}\n", 1.0, false); /* complex modes */
    case_run(&c, NULL);
    assert_true(c.out.n_nuisance >= 8);
    const struct system *s = c.predictor->system;
    struct state_space space = state_space_new(s->n, s->M, s->C, s->K);
    double *z = bf_alloc(4 * s->n, sizeof *z), *x = z + 2 * s->n, *Mx = x + s->n;
    size_t tested = 0;
    for (size_t pole = 0; pole < s->n_pairs; pole++) {
        double f_Hz = cimag(s->p[pole]) / (2.0 * acos(-1.0));
        if (f_Hz > 200.0)
            continue;
        size_t slower = 0;
        for (size_t k = 0; k < s->n_pairs; k++)
            slower += cimag(s->p[k]) < cimag(s->p[pole]);
        const double complex a = CMPLX(0.7, -0.4);
        for (int rate = 0; rate < 2; rate++) { /* modal state: q = Φᵀ M x */
            for (size_t i = 0; i < s->n; i++)
                x[i] = 2.0 * creal(a * (rate ? s->p[pole] : 1.0) * s->phi[i + pole * s->n]);
            dense_gemv(false, s->n, s->n, 1.0, s->M, x, 0.0, Mx);
            state_space_functional(&space, Mx, z + (size_t)rate * s->n);
        }
        for (size_t i = 0; i < s->n; i++)
            z[i] *= space.omega[i];
        memset(y, 0, sizeof y);
        simulate(&c, SIZE_MAX, z, y);
        const double *column = c.out.nuisance + 2 * slower * c.out.n_rows;
        for (size_t i = 0; i < c.out.n_rows; i++)
            sum[i] = creal(a) * column[i] + cimag(a) * column[c.out.n_rows + i];
        for (size_t ch = 0; ch < CHANNELS; ch++)
            assert_true(nrmse(sum + ch * SAMPLES, y + ch * SAMPLES, SAMPLES) < 1e-5);
        tested++;
    }
    assert_true(tested >= 3);
    free(z);
    state_space_free(&space);
    case_close(&c);
}

static void residual_compliance_is_a_direct_path(void **state)
{
    (void)state;
    struct predict_case c;
    static double before[CHANNELS * SAMPLES];
    open_case(&c, "", 1.0, true);
    case_run(&c, NULL);
    memcpy(before, c.out.y, sizeof before);
    c.theta[case_index(&c, "residual_accel_mps2_hammer_N")] = 1e-4;
    case_run(&c, NULL);
    double worst = 0.0, largest = 0.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        double t = (double)k * dt_s, h = 1e-4;
        double u_tt = (case_hammer(t + h, 1.0) - 2.0 * case_hammer(t, 1.0) + case_hammer(t - h, 1.0)) / (h * h);
        worst = fmax(worst, fabs(c.out.y[SAMPLES + k] - before[SAMPLES + k] - 1e-4 * u_tt));
        largest = fmax(largest, fabs(1e-4 * u_tt));
        assert_true(fabs(c.out.y[k] - before[k]) < 1e-12); /* the other channels do not see it */
    }
    assert_true(worst < 2e-3 * largest);
    case_close(&c);
}

static void channel_effects_act_in_their_way(void **state)
{
    (void)state;
    struct predict_case plain, delayed, offset, hum, leak;
    open_case(&plain, "", 1.0, true);
    open_case(&delayed, "  - {kind: sensor_delay, channel: tip_mps, delay_s: 0.0029296875}\n", 1.0,
              true); /* 3 samples */
    open_case(&offset, "  - {kind: sensor_offset, channel: accel_mps2, offset: 0.25, drift_per_s: 0}\n", 1.0, true);
    open_case(&hum, "  - {kind: mains_hum, channel: piezo_V, amplitude: 0.5, frequency_Hz: 50, phase_rad: 0.3}\n", 1.0,
              true);
    open_case(&leak, "  - {kind: feedthrough, channel: piezo_V, gain: 0.02}\n", 1.0, true);
    struct predict_case *const cases[] = {&plain, &delayed, &offset, &hum, &leak};
    for (int i = 0; i < 5; i++)
        case_run(cases[i], NULL);
    const double *y = plain.out.y, *tip = y + 2 * SAMPLES, *late = delayed.out.y + 2 * SAMPLES;
    double size = signal_rms(tip, SAMPLES);
    const double *drive = record_column(&plain.record, "drive_V");
    for (size_t k = 0; k < SAMPLES; k++) {
        assert_true(fabs(late[k] - (k >= 3 ? tip[k - 3] : 0.0)) < 1e-6 * size);
        assert_true(fabs(offset.out.y[SAMPLES + k] - y[SAMPLES + k] - 0.25) < 1e-12);
        assert_true(fabs(leak.out.y[k] - y[k] - 0.02 * drive[k]) < 1e-12);
        double rest = fabs(hum.out.y[k] - y[k]);
        assert_true(rest <= 0.5 + 1e-12);
        if (k >= 40) { /* Σ of two values half a period apart is not 0 at 1024 Hz; a hum obeys x'' = −ω² x */
            double a = hum.out.y[k] - y[k], b = hum.out.y[k - 1] - y[k - 1], d = hum.out.y[k - 2] - y[k - 2];
            assert_true(fabs(a - 2.0 * cos(2.0 * acos(-1.0) * 50.0 * dt_s) * b + d) < 1e-10);
        }
        assert_true(fabs(offset.out.y[k] - y[k]) < 1e-12);
        assert_true(fabs(hum.out.y[SAMPLES + k] - y[SAMPLES + k]) < 1e-12);
    }
    for (int i = 0; i < 5; i++)
        case_close(cases[i]);
}

static void window_is_the_beginning(void **state)
{
    (void)state;
    struct predict_case c;
    struct bf_error err;
    static double whole[CHANNELS * SAMPLES];
    const struct predict_channel *channels;
    open_case(&c, "", 1.0, true);
    case_run(&c, NULL);
    memcpy(whole, c.out.y, sizeof whole);
    assert_int_equal(predictor_window(c.predictor, 0.1, &err), BF_OK);
    assert_int_equal(predictor_channels(c.predictor, &channels), CHANNELS);
    case_run(&c, NULL);
    for (size_t ch = 0; ch < CHANNELS; ch++) {
        assert_int_equal(channels[ch].n, 103); /* ceil(0.1 · 1024) */
        double error = nrmse(c.out.y + channels[ch].row, whole + ch * SAMPLES, channels[ch].n);
        assert_true(error < 2e-4); /* the input fades out behind the window instead of going on */
    }
    assert_int_equal(predictor_window(c.predictor, INFINITY, &err), BF_OK);
    case_run(&c, NULL);
    assert_true(nrmse(c.out.y, whole, CHANNELS * SAMPLES) < 1e-12);
    case_close(&c);
}

static void rebase_changes_nothing_at_the_base(void **state)
{
    (void)state;
    struct predict_case c;
    struct bf_error err;
    static double y[CHANNELS * SAMPLES];
    double error[2];
    open_case(&c, "", 1.0, true);
    case_run(&c, NULL);
    memcpy(y, c.out.y, sizeof y);
    assert_int_equal(predictor_rebase(c.predictor, c.theta, &err), BF_OK);
    case_run(&c, NULL);
    assert_true(nrmse(c.out.y, y, CHANNELS * SAMPLES) < 1e-8);
    size_t EI = case_index(&c, "EI_beam_Nm2");
    double at_base = c.theta[EI];
    for (int i = 0; i < 2; i++) { /* away from it: second order */
        assert_int_equal(predictor_rebase(c.predictor, c.theta, &err), BF_OK);
        c.theta[EI] = at_base * (i == 0 ? 1.1 : 1.05);
        case_run(&c, NULL);
        memcpy(y, c.out.y, sizeof y);
        assert_int_equal(predictor_rebase(c.predictor, c.theta, &err), BF_OK);
        case_run(&c, NULL);
        error[i] = nrmse(c.out.y, y, CHANNELS * SAMPLES);
        c.theta[EI] = at_base;
    }
    assert_true(error[0] < 1e-2 && error[1] < 0.35 * error[0]);
    case_close(&c);
}

static void clone_predicts_the_same(void **state)
{
    (void)state;
    struct predict_case c;
    struct predictor *copy;
    struct prediction other;
    struct bf_error err;
    open_case(&c, "", 1.0, true);
    assert_int_equal(predictor_window(c.predictor, 0.15, &err), BF_OK);
    case_run(&c, NULL);
    assert_int_equal(predictor_clone(c.predictor, &copy, &err), BF_OK);
    assert_int_equal(predictor_run(copy, c.theta, NULL, &other, &err), BF_OK);
    assert_int_equal(other.n_rows, c.out.n_rows);
    assert_true(nrmse(other.y, c.out.y, other.n_rows) < 1e-12);
    predictor_free(copy);
    case_close(&c);
}

/* ---- What is refused ---- */

static void refuse(struct record *record, const char *effects, enum bf_status status, const char *words)
{
    struct model model;
    struct predictor *p = NULL;
    struct bf_error err;
    fixture_model(&model, effects);
    assert_int_equal(predictor_new(&model, record, 1, NULL, &p, &err), status);
    assert_null(p);
    if (strstr(err.text, words) == NULL)
        fail_msg("'%s' lacks '%s'", err.text, words);
    model_free(&model);
    record_free(record);
}

static void records_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    double zero[8] = {0};
    struct record no_input = {.path = strdup("a.csv"), .n = 8, .dt_s = dt_s};
    record_add_column(&no_input, "piezo_V", zero);
    refuse(&no_input, "", BF_BAD_FILE, "is an input of the model");
    struct record no_output = {.path = strdup("b.csv"), .n = 8, .dt_s = dt_s};
    record_add_column(&no_output, "hammer_N", zero);
    refuse(&no_output, "", BF_BAD_FILE, "is an output of the model");
    struct record late = case_record("c.csv", SAMPLES, dt_s, 1.0, false);
    record_add_meta(&late, "free_from_s", "7.0");
    refuse(&late, "", BF_BAD_FILE, "free_from_s");
    struct record fine = case_record("d.csv", SAMPLES, dt_s, 1.0, true);
    refuse(&fine, "  - {kind: patch_position, shift_m: {value: -0.05}}\n", BF_NUMERIC, "would leave the beam");
}

static void impossible_parameters_are_numeric_errors(void **state)
{
    (void)state;
    struct predict_case c;
    struct bf_error err;
    open_case(&c, "", 1.0, true);
    c.theta[case_index(&c, "rho_beam_kgpm")] = -1.0;
    c.theta[case_index(&c, "rho_patch_kgpm")] = -1.0;
    assert_int_equal(predictor_run(c.predictor, c.theta, NULL, &c.out, &err), BF_NUMERIC);
    case_close(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_prediction_is_the_simulation),
        cmocka_unit_test(decay_columns_are_the_simulation),
        cmocka_unit_test(residual_compliance_is_a_direct_path),
        cmocka_unit_test(channel_effects_act_in_their_way),
        cmocka_unit_test(window_is_the_beginning),
        cmocka_unit_test(rebase_changes_nothing_at_the_base),
        cmocka_unit_test(clone_predicts_the_same),
        cmocka_unit_test(records_that_do_not_fit_are_refused),
        cmocka_unit_test(impossible_parameters_are_numeric_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
