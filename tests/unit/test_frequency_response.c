/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Frequency responses as records: read, predicted and fitted against the receptance of a cantilever in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "estimate/estimate.h"
#include "exact_response.h"
#include "maths/maths.h"
#include "noise/noise.h"
#include "response/response.h"
#include "test_files.h"

static const struct exact_cantilever beam = {
    .length_m = 0.3, .EI_Nm2 = 2.1, .rho_kgpm = 0.21, .cDI_sNm2 = 2e-4, .gamma_sNpm2 = 0.05};
static const double truth[] = {2.1, 0.21, 2e-4, 0.05};
static const char *const names[] = {"EI_beam_Nm2", "rho_beam_kgpm", "cDI_beam_sNm2", "gamma_sNpm2"};
enum { LINES = 800, PARAMETERS = sizeof truth / sizeof *truth };

static const char model_text[] =
    "format: beamfit-model/1\nbeam:\n  length_m: 0.3\n  support: clamped-free\nparameters:\n"
    "  EI_beam_Nm2: {value: %g}\n  rho_beam_kgpm: {value: %g}\n"
    "  cDI_beam_sNm2: {value: %g}\n  gamma_sNpm2: {value: %g}\n"
    "inputs:\n  hammer_N: {kind: point_force, at_m: 0.3}\n"
    "outputs:\n  accel_mps2: {kind: acceleration, at_m: 0.3}\neffects: [%s]\n";

static void make_model(double factor, const char *effects, struct model *model)
{
    char text[1024];
    struct bf_error err;
    (void)snprintf(text, sizeof text, model_text, factor * truth[0], factor * truth[1], factor * truth[2],
                   factor * truth[3], effects);
    char *path = temporary_file("model.yaml", text, strlen(text));
    if (model_read(path, model, &err) != BF_OK)
        fail_msg("%s", err.text);
    unlink(path);
    free(path);
}

static enum bf_status read_text(const char *text, struct record *record, struct bf_error *err)
{
    char *path = temporary_file("response.csv", text, strlen(text));
    const enum bf_status status = record_read(path, record, err);
    unlink(path);
    free(path);
    return status;
}

static void measure(const struct exact_measurement *m, struct record *record)
{
    char *text = NULL;
    size_t size = 0;
    struct bf_error err;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    exact_write(&beam, m, out);
    assert_int_equal(fclose(out), 0);
    if (read_text(text, record, &err) != BF_OK)
        fail_msg("%s", err.text);
    free(text);
}

/* |Y_k|/|U_k| at the lines of the file is the |H_k| that was written. */
static void a_response_is_one_period_of_a_pulse_and_its_answer(void **state)
{
    uint64_t seed = 1;
    const struct exact_measurement m = {.df_Hz = 0.5, .lines = LINES, .averages = 1, .seed = &seed};
    struct record record;
    const struct fft *plan;
    struct bf_error err;
    (void)state;
    measure(&m, &record);
    assert_string_equal(record_meta(&record, "excitation"), "frequency_response");
    assert_true(record_is_periodic(&record));
    assert_true(fabs((double)record.n * record.dt_s - 2.0) < 1e-12);
    assert_true(record.n >= 2 * LINES);
    assert_int_equal(fft_get(record.n, &plan, &err), BF_OK);
    double complex *U = bf_alloc(record.n / 2 + 1, sizeof *U), *Y = bf_alloc(record.n / 2 + 1, sizeof *Y);
    fft_forward(plan, record_column(&record, "hammer_N"), U);
    fft_forward(plan, record_column(&record, "accel_mps2"), Y);
    for (int i = 1; i < LINES; i++) {
        const double complex H = exact_accelerance(&beam, 0.5 * i, 0.0);
        assert_true(cabs(Y[i] / U[i] - H) <= 1e-7 * cabs(H) + 1e-7);
    }
    assert_true(cabs(U[0]) < 1e-9 * cabs(U[1]) && cabs(U[LINES]) < 1e-9 * cabs(U[1]));
    free(U), free(Y);
    record_free(&record);
}

/* The error of the prediction is that of the spline space alone, with and without an exponential window. */
static void the_prediction_is_the_steady_state(void **state)
{
    (void)state;
    for (int window = 0; window < 2; window++) {
        uint64_t seed = 1;
        const struct exact_measurement m = {.df_Hz = 0.5,
                                            .lines = LINES,
                                            .averages = 1,
                                            .seed = &seed,
                                            .window_rate = 4.0 * window,
                                            .form = window ? EXACT_DECIBEL : EXACT_COMPLEX};
        struct record record;
        struct model model;
        struct predictor *predictor;
        struct prediction y;
        struct bf_error err;
        double error = 0.0, size = 0.0;
        measure(&m, &record);
        make_model(1.0, "", &model);
        if (predictor_new(&model, &record, 1, NULL, &predictor, &err) != BF_OK)
            fail_msg("%s", err.text);
        const double theta[8] = {truth[0], truth[1], truth[2], truth[3]};
        assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
        assert_int_equal(y.n_rows, record.n);
        const double *z = record_column(&record, "accel_mps2");
        for (size_t k = 0; k < y.n_rows; k++) {
            error += (y.y[k] - z[k]) * (y.y[k] - z[k]);
            size += z[k] * z[k];
        }
        assert_true(sqrt(error / size) < 1e-5);
        predictor_free(predictor);
        model_free(&model);
        record_free(&record);
    }
}

static void coherence_is_the_noise(void **state)
{
    uint64_t seed = 3;
    const struct exact_measurement m = {.df_Hz = 0.5, .lines = LINES, .averages = 8, .noise = 0.05, .seed = &seed};
    struct record record;
    struct model model;
    struct noise_estimate noise;
    struct predictor *predictor;
    struct prediction y;
    struct bf_error err;
    double error = 0.0, sum = 0.0;
    (void)state;
    measure(&m, &record);
    make_model(1.0, "", &model);
    assert_int_equal(noise_of_channel(&model, &record, "accel_mps2", &noise, &err), BF_OK);
    assert_int_equal(noise.method, NOISE_COHERENCE);
    for (size_t k = 0; k < noise.n_bins; k++)
        sum += noise.psd[k] * noise.df_Hz;
    assert_true(fabs(sqrt(sum) / noise.rms - 1.0) < 1e-9);
    assert_int_equal(predictor_new(&model, &record, 1, NULL, &predictor, &err), BF_OK);
    const double theta[8] = {truth[0], truth[1], truth[2], truth[3]};
    assert_int_equal(predictor_run(predictor, theta, NULL, &y, &err), BF_OK);
    const double *z = record_column(&record, "accel_mps2");
    for (size_t k = 0; k < y.n_rows; k++)
        error += (y.y[k] - z[k]) * (y.y[k] - z[k]) / (double)y.n_rows;
    assert_true(fabs(sqrt(error) / noise.rms - 1.0) < 0.08); /* three standard errors of 800 lines */
    noise_free(&noise);
    predictor_free(predictor);
    model_free(&model);
    record_free(&record);
}

/* Of 95 % intervals nearly 95 % hold the truth: of 240, three standard deviations below are 218. */
static void intervals_hold_the_truth(void **state)
{
    enum { DRAWS = 60 };
    int held = 0;
    (void)state;
    for (uint64_t draw = 1; draw <= DRAWS; draw++) {
        uint64_t seed = 1000 + draw;
        const struct exact_measurement m = {
            .df_Hz = 1.0, .lines = LINES / 2, .averages = 10, .noise = 0.03, .seed = &seed};
        const struct fit_options options = {.quiet = true, .never_search = true};
        struct record record;
        struct model model;
        struct fit_result fit;
        struct bf_error err;
        measure(&m, &record);
        make_model(1.1, "", &model);
        if (fit_run(&model, &record, 1, &options, &fit, &err) != BF_OK)
            fail_msg("%s", err.text);
        for (int i = 0; i < PARAMETERS; i++)
            for (size_t j = 0; j < fit.n_parameters; j++)
                if (strcmp(fit.parameters[j].label, names[i]) == 0)
                    held += fit.parameters[j].ci95[0] <= truth[i] && truth[i] <= fit.parameters[j].ci95[1];
        fit_free(&fit);
        model_free(&model);
        record_free(&record);
    }
    assert_true(held >= 218);
}

static void laws_are_refused(void **state)
{
    uint64_t seed = 1;
    const struct exact_measurement m = {.df_Hz = 0.5, .lines = LINES, .averages = 1, .seed = &seed};
    struct record record;
    struct model model;
    struct predictor *predictor;
    struct bf_error err;
    (void)state;
    measure(&m, &record);
    make_model(1.0, "{kind: quadratic_drag, coefficient_Ns2pm3: 1}", &model);
    assert_int_equal(predictor_new(&model, &record, 1, NULL, &predictor, &err), BF_USAGE);
    assert_non_null(strstr(err.text, "linear effects only"));
    assert_non_null(strstr(err.text, "quadratic_drag"));
    model_free(&model);
    record_free(&record);
}

static void what_is_no_response_is_refused(void **state)
{
    static const struct {
        const char *text, *word;
    } bad[] = {
        {"freq_Hz,accel_mps2\n0,1\n1,2\n2,3\n", "OUTPUT/INPUT_re"},
        {"freq_Hz,a_m/f_N_re\n0,1\n1,2\n2,3\n", "OUTPUT/INPUT_im"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im,a_m/g_N_re,a_m/g_N_im\n0,1,1,1,1\n1,2,2,2,2\n", "another input"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im\n0.4,1,1\n1.4,2,2\n2.4,2,2\n", "no multiple"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im\n0,1,1\n1,2,2\n2,2,2\n3,2,2\n5,2,2\n6,2,2\n7,2,2\n", "freq_Hz"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im\n1e12,1,1\n1000000000001,2,2\n1000000000002,2,2\n", "at most"},
        {"freq_Hz,a_m/f_N_dB,a_m/f_N_deg\n0,1e9,1\n1,2,2\n2,2,2\n", "too large a response"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im\n0,1e300,1\n1,2,2\n2,2,2\n", "too large a response"},
        {"freq_Hz,a_m/f_N_re,a_m/f_N_im,a_m/f_N_coherence\n0,1,1,87\n1,2,2,1\n2,2,2,1\n", "between 0 and 1"},
        {"freq_Hz,a_m/a_m_re,a_m/a_m_im\n0,1,1\n1,2,2\n2,2,2\n", "OUTPUT/INPUT_im"},
        {"# averages: none\nfreq_Hz,a_m/f_N_re,a_m/f_N_im\n0,1,1\n1,2,2\n2,2,2\n", "averages"},
        {"# exponential window: -1 s\nfreq_Hz,a_m/f_N_re,a_m/f_N_im\n0,1,1\n1,2,2\n2,2,2\n", "time constant"},
        {"# exponential window: 1 s\ntime_s,a_m\n0,1\n1,2\n2,2\n", "time constant"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct record record;
        struct bf_error err;
        if (read_text(bad[i].text, &record, &err) != BF_BAD_FILE)
            fail_msg("accepted: %s", bad[i].text);
        if (strstr(err.text, bad[i].word) == NULL)
            fail_msg("'%s' says nothing of '%s'", err.text, bad[i].word);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_response_is_one_period_of_a_pulse_and_its_answer),
        cmocka_unit_test(the_prediction_is_the_steady_state),
        cmocka_unit_test(coherence_is_the_noise),
        cmocka_unit_test(intervals_hold_the_truth),
        cmocka_unit_test(laws_are_refused),
        cmocka_unit_test(what_is_no_response_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
