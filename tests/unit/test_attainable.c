/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The attainable floor: linear records end at their noise whatever the model's poles are; nonlinear ones do not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <complex.h>
#include <math.h>
#include "noise/attainable_problem.h"
#include "noise/noise.h"
#include "modes_record.h"

static struct attainable find(const struct record records[], size_t n)
{
    struct model model = read_model();
    struct attainable a;
    struct bf_error err;
    if (attainable_find(&model, records, n, NULL, &a, &err) != BF_OK)
        fail_msg("%s", err.text);
    model_free(&model);
    return a;
}

static void check_floor(const struct attainable *a, size_t channels, size_t moving)
{
    assert_int_equal(a->n_channels, channels);
    assert_int_equal(a->n_moving, moving);
    assert_true(a->nrmse <= a->start_nrmse);
    for (size_t c = 0; c < channels; c++)
        if (fabs(a->channels[c].nrmse / noise_share - 1.0) > 0.04)
            fail_msg("channel %zu: %.4f times the noise that was added", c, a->channels[c].nrmse / noise_share);
    for (int m = 0; m < MODES; m++) { /* the poles are those of the records */
        double nearest = HUGE_VAL, its_damping = 0.0;
        for (size_t k = 0; k < a->modes; k++)
            if (fabs(a->poles[k].frequency_Hz - mode_Hz[m]) < nearest) {
                nearest = fabs(a->poles[k].frequency_Hz - mode_Hz[m]);
                its_damping = a->poles[k].damping_ratio;
            }
        assert_true(nearest < 1e-3 * mode_Hz[m]);
        assert_true(fabs(its_damping / damping[m] - 1.0) < 0.1);
    }
}

static void two_records_of_one_beam_end_at_their_noise(void **state)
{
    (void)state;
    struct record records[2] = {make_record(0, 1.0, 0.0, 1), make_record(1, 3.0, 0.0, 2)};
    struct attainable a = find(records, 2);
    assert_true(a.start_nrmse > 0.5);
    check_floor(&a, 4, 0);
    for (size_t k = 0; k < a.modes; k++) { /* of its poles the records need those of the beam */
        bool is_mode = false;
        for (int m = 0; m < MODES; m++)
            is_mode = is_mode || fabs(a.poles[k].frequency_Hz - mode_Hz[m]) < 1e-3 * mode_Hz[m];
        assert_true(is_mode ? a.poles[k].without_noise_ratio > 5.0 * a.noise_ratio
                            : a.poles[k].without_noise_ratio < 1.01 * a.noise_ratio);
    }
    attainable_free(&a);
    record_free(&records[0]);
    record_free(&records[1]);
}

/* The middle swings against the tip in the second mode, with it in the others, and as far. */
static void residues_are_those_of_the_records(void **state)
{
    (void)state;
    struct record record = make_record(1, 3.0, 0.0, 41);
    struct attainable a = find(&record, 1);
    assert_int_equal(a.n_outputs, 2);
    assert_int_equal(a.n_inputs, 1);
    for (int m = 0; m < MODES; m++) {
        size_t k = 0;
        while (k < a.modes && fabs(a.poles[k].frequency_Hz - mode_Hz[m]) > 1e-3 * mode_Hz[m])
            k++;
        assert_true(k < a.modes);
        const double complex ratio = a.residue[2 * k + 1] / a.residue[2 * k];
        assert_true(cabs(ratio - (m == 1 ? -1.0 : 1.0)) < 0.05);
        assert_true(fabs(carg(a.residue[2 * k]) + 0.5 * M_PI) < 0.05); /* of A sin: A/2i */
    }
    attainable_free(&a);
    record_free(&record);
}

/* What the linear model of a record leaves of another, in times the noise. */
static double held_out(const struct record *fitted, const struct record *check)
{
    struct model model = read_model();
    struct attainable a = find(fitted, 1);
    struct bf_error err;
    if (attainable_check(&model, fitted, 1, NULL, check, 1, &a, &err) != BF_OK)
        fail_msg("%s", err.text);
    const double ratio = a.held_out_noise_ratio;
    attainable_free(&a);
    model_free(&model);
    return ratio;
}

static void what_is_held_out_ends_at_its_noise_unless_its_input_is_wrong(void **state)
{
    (void)state;
    static const double wrong = 1.05; /* of the level */
    struct record sweep = make_record(1, 3.0, 0.0, 31), hit = make_record(0, 1.0, 0.0, 32);
    struct record decay = make_record(2, 1.0, 0.0, 33);
    assert_true(fabs(held_out(&sweep, &hit) - 1.0) < 0.1);
    assert_true(fabs(held_out(&sweep, &decay) - 1.0) < 0.1); /* its states are its own */
    for (size_t i = 0; i < hit.n; i++)
        hit.columns[0].x[i] *= wrong;
    assert_true(fabs(held_out(&sweep, &hit) * noise_share / (wrong - 1.0) - 1.0) < 0.06);
    assert_true(isnan(held_out(&decay, &hit))); /* no record tells what the input does */
    record_free(&sweep);
    record_free(&hit);
    record_free(&decay);
}

static void a_free_decay_ends_at_its_noise(void **state)
{
    (void)state;
    struct record record = make_record(2, 1.0, 0.0, 3);
    struct attainable a = find(&record, 1);
    check_floor(&a, 2, 1);
    attainable_free(&a);
    record_free(&record);
}

/* Without its first second a record begins in motion, its drive in full swing. */
static void cut(struct record *record, size_t from)
{
    record->n -= from;
    for (size_t c = 0; c < record->n_columns; c++)
        memmove(record->columns[c].x, record->columns[c].x + from, record->n * sizeof(double));
}

static void records_that_begin_in_motion_keep_the_floor(void **state)
{
    (void)state;
    struct record records[2] = {make_record(0, 1.0, 0.0, 4), make_record(1, 3.0, 0.0, 5)};
    cut(&records[0], 300);
    cut(&records[1], 512);
    struct attainable a = find(records, 2);
    assert_int_equal(a.n_moving, 2);
    for (size_t c = 0; c < a.n_channels; c++)
        if (!(a.channels[c].noise_ratio < 1.1))
            fail_msg("channel %zu: %.4f times the noise", c, a.channels[c].noise_ratio);
    attainable_free(&a);
    record_free(&records[0]);
    record_free(&records[1]);
}

static void an_unknown_level_is_no_misfit(void **state)
{
    (void)state;
    struct record records[2] = {make_record(0, 1.0, 0.0, 6), make_record(1, 3.0, 0.0, 7)};
    double *u = (double *)record_column(&records[1], "drive_N");
    for (size_t i = 0; i < N; i++)
        u[i] *= 7.0;
    record_add_meta(&records[1], "excitation", "unknown_level");
    struct attainable a = find(records, 2);
    check_floor(&a, 4, 0);
    attainable_free(&a);
    record_free(&records[0]);
    record_free(&records[1]);
}

/* What a cubic sensor adds at the stronger level is some per cent of the signal: no linear model explains it. */
static void a_cube_stays_above_the_noise(void **state)
{
    (void)state;
    struct record records[2] = {make_record(0, 1.0, 0.001, 8), make_record(0, 4.0, 0.001, 9)};
    struct attainable a = find(records, 2);
    if (!(a.noise_ratio > 2.0))
        fail_msg("%.3f times the noise", a.noise_ratio);
    attainable_free(&a);
    record_free(&records[0]);
    record_free(&records[1]);
}

static void what_cannot_be_fitted_has_no_modes(void **state)
{
    (void)state;
    struct record record = make_record(0, 1.0, 0.0, 10);
    struct attainable a = find(&record, 0);
    assert_int_equal(a.modes, 0);
    assert_true(isnan(a.nrmse));
    attainable_free(&a);
    record.n = 12; /* silence */
    for (size_t c = 1; c < record.n_columns; c++)
        memset(record.columns[c].x, 0, 12 * sizeof(double));
    a = find(&record, 1);
    assert_int_equal(a.modes, 0);
    attainable_free(&a);
    for (size_t c = 1; c < record.n_columns; c++) /* more unknowns than samples */
        for (size_t i = 0; i < 12; i++)
            record.columns[c].x[i] = sin((double)(i * c));
    a = find(&record, 1);
    assert_true(a.nrmse < 1e-6);
    attainable_free(&a);
    record_free(&record);
}

/* A sweep that goes on for 180,000 samples; both channels, with noise. */
static struct record make_long_record(size_t n)
{
    struct record record = {.path = strdup("long.csv"), .n = n, .dt_s = dt};
    double *u = bf_alloc(n, sizeof *u), *z = bf_alloc(n, sizeof *z);
    uint64_t seed = signal_seed(51);
    for (size_t i = 0; i < n; i++)
        u[i] = (1.0 - exp(-(double)i * dt)) *
               sin(2.0 * M_PI * (90.0 * (double)i * dt + 80.0 * sin(0.9 * (double)i * dt) / 0.9));
    record_add_column(&record, "drive_N", u);
    for (int channel = 0; channel < 2; channel++) {
        memset(z, 0, n * sizeof *z);
        for (int m = 0; m < MODES; m++)
            signal_add_mode(mode_Hz[m], damping[m], (channel == 1 && m == 1 ? -1.0 : 1.0) / (1.0 + m), dt, u, n, 0.0,
                            z);
        const double rms = signal_rms(z, n);
        for (size_t i = 0; i < n; i++)
            z[i] += noise_share * rms * signal_normal(&seed);
        record_add_column(&record, channel == 0 ? "tip_m" : "middle_m", z);
    }
    free(u), free(z);
    return record;
}

/* ½ Σ r² of a problem's records at the poles, weighted. */
static double value_at(const struct attainable_problem *p, const double x[])
{
    struct attainable_rows *rows = bf_alloc(p->n_records, sizeof *rows);
    struct bf_error err;
    double value;
    if (attainable_compress(p, x, EXTRA_NONE, rows, &err) != BF_OK ||
        attainable_value(p, rows, &value, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    attainable_rows_free(rows, p->n_records);
    free(rows);
    return value;
}

static double derivative_at(const struct attainable_problem *p, const double x[], double gradient[])
{
    struct attainable_rows *rows = bf_alloc(p->n_records, sizeof *rows);
    struct bf_error err;
    double value, gram[4 * MODES * MODES];
    if (attainable_compress(p, x, EXTRA_DERIVATIVES, rows, &err) != BF_OK ||
        attainable_derivative(p, x, rows, &value, gradient, gram, &err) != BF_OK)
        fail_msg("%s", err.text);
    attainable_rows_free(rows, p->n_records);
    free(rows);
    return value;
}

/* ½χ² a sample at the true poles, and its gradient against differences. */
static double left_at_the_poles(const struct model *model, const struct record *record)
{
    struct attainable_problem p = {.m = MODES, .n_slots = 1, .n_outputs = 2};
    double x[2 * MODES], gradient[2 * MODES], *noise;
    struct bf_error err;
    assert_int_equal(attainable_noise(model, record, 1, &noise, &err), BF_OK);
    attainable_add_record(&p, model, record, 0, noise);
    free(noise);
    for (int m = 0; m < MODES; m++) {
        x[2 * m] = log(2.0 * M_PI * mode_Hz[m]);
        x[2 * m + 1] = x[2 * m] + log(damping[m] * 1.02);
    }
    const double value = derivative_at(&p, x, gradient);
    assert_true(fabs(value_at(&p, x) / value - 1.0) < 1e-9);
    for (int i = 0; i < 2 * MODES; i++) {
        const double at = x[i], h = 1e-5;
        x[i] = at + h;
        double difference = value_at(&p, x);
        x[i] = at - h;
        difference = (difference - value_at(&p, x)) / (2.0 * h);
        x[i] = at;
        if (fabs(difference - gradient[i]) > 1e-4 * fabs(gradient[i]) + 1e-7 * value / h)
            fail_msg("derivative %d: %.9g, by differences %.9g", i, gradient[i], difference);
    }
    const double samples = (double)p.n_channels * (double)record->n;
    attainable_problem_free(&p);
    return value / samples;
}

/* What set the beam moving still rings in the recorder's filter, which the record states: that is no mode of the beam's. */
static void a_recorder_that_rings_is_no_mode(void **state)
{
    (void)state;
    static const double corner =
        0.3; /* of the sampling frequency; Butterworth of order 3: a pair of poles at 120 degrees, and a real one */
    struct model model = read_model();
    struct record record = make_record(2, 1.0, 0.0, 34);
    char text[64];
    const double before = left_at_the_poles(&model, &record);
    for (size_t c = 1; c <= 2; c++) {
        const double size = 5.0 * signal_rms(record.columns[c].x, N);
        for (size_t k = 0; k < 40; k++) {
            const double t = 2.0 * M_PI * corner * (double)k;
            record.columns[c].x[k] += size * (exp(-0.5 * t) * sin(sqrt(0.75) * t + (double)c) + 0.5 * exp(-t));
        }
    }
    assert_true(left_at_the_poles(&model, &record) > 2.0 * before);
    (void)snprintf(text, sizeof text, "Butterworth order 3 at %.9g Hz", corner / dt);
    record_add_meta(&record, RECORD_FILTER, text);
    assert_true(fabs(left_at_the_poles(&model, &record) / before - 1.0) < 0.05);
    record_free(&record);
    model_free(&model);
}

/* At the same poles the pieces leave what the whole leaves, but for what states of their own take: of noise little, of a wrong damping more. */
static void a_long_record_is_the_sum_of_its_pieces(void **state)
{
    (void)state;
    struct model model = read_model();
    struct record record = make_long_record(180000);
    struct attainable_problem p = {.m = MODES, .n_slots = 1, .n_outputs = 2};
    struct bf_error err;
    double x[2 * MODES], *noise;
    assert_int_equal(attainable_noise(&model, &record, 1, &noise, &err), BF_OK);
    attainable_add_record(&p, &model, &record, 0, noise);
    free(noise);
    assert_true(p.n_records > 1);
    assert_int_equal(p.n_channels, 2);
    struct attainable_problem whole = p;
    struct attainable_record one = p.records[0];
    one.n = one.n_whole, one.after = 0;
    whole.records = &one, whole.n_records = 1;
    for (int off = 0; off < 2; off++) { /* at the poles, and beside them */
        for (int m = 0; m < MODES; m++) {
            x[2 * m] = log(2.0 * M_PI * mode_Hz[m]);
            x[2 * m + 1] = x[2 * m] + log(damping[m] * (off ? 1.05 : 1.0));
        }
        const double wanted = value_at(&whole, x);
        attainable_close(&one); /* its sources are those of the first piece */
        const double got = value_at(&p, x);
        if (!(got <= wanted * (1.0 + 1e-9) && got > wanted * (1.0 - (off ? 3e-3 : 4e-4))))
            fail_msg("%.9g where the whole record leaves %.9g", got, wanted);
    }
    attainable_problem_free(&p);
    struct attainable a = find(&record, 1);
    check_floor(&a, 2, 0);
    attainable_free(&a);
    record_free(&record);
    model_free(&model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_records_of_one_beam_end_at_their_noise),
        cmocka_unit_test(residues_are_those_of_the_records),
        cmocka_unit_test(what_is_held_out_ends_at_its_noise_unless_its_input_is_wrong),
        cmocka_unit_test(a_free_decay_ends_at_its_noise),
        cmocka_unit_test(a_recorder_that_rings_is_no_mode),
        cmocka_unit_test(records_that_begin_in_motion_keep_the_floor),
        cmocka_unit_test(an_unknown_level_is_no_misfit),
        cmocka_unit_test(a_cube_stays_above_the_noise),
        cmocka_unit_test(what_cannot_be_fitted_has_no_modes),
        cmocka_unit_test(a_long_record_is_the_sum_of_its_pieces),
    };
    return cmocka_run_group_tests_name("attainable", tests, NULL, NULL);
}
