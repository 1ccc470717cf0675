/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Free decays at the true parameters against the independent simulator: what is left after the state that a record begins with. */
#include "truth_beam.h"

#include "maths/maths.h"
#include "response/predictor.h"
#include "response/response.h"

/* What is left of a free decay of one channel after its linear unknowns, relative. */
static double unexplained(struct predict_case *c, const char *channel, size_t columns)
{
    struct bf_error err;
    size_t rows = c->out.n_rows;
    double *A = bf_alloc(rows * (columns + 1), sizeof *A), *b = A + rows * columns, difference = 0.0, size = 0.0;
    double *x = bf_alloc(columns, sizeof *x);
    const double *measured = record_column(&c->record, channel);
    memcpy(A, c->out.nuisance, rows * columns * sizeof *A);
    memcpy(b, measured, rows * sizeof *b);
    assert_int_equal(dense_least_squares(rows, columns, A, b, 1e-12, x, NULL, &err), BF_OK);
    for (size_t k = 0; k < rows; k++) {
        double y = 0.0;
        for (size_t j = 0; j < columns; j++)
            y += x[j] * c->out.nuisance[j * rows + k];
        difference += (measured[k] - y) * (measured[k] - y);
        size += measured[k] * measured[k];
    }
    free(A);
    free(x);
    return sqrt(difference / size);
}

/* A charge amplifier still remembers the blow when a free decay begins. */
static void free_decay_behind_a_charge_amplifier(void **state)
{
    (void)state;
    struct truth_spec spec;
    struct bf_error err;
    struct predict_case c = {.record = {.path = strdup("case.csv"), .dt_s = 1.0 / 1024.0}};
    beam_of_fixture(&spec);
    spec.n_outputs = spec.n_signals = 1; /* the blow and the patch alone */
    say(&spec, "duration_s = 1.5");
    say(&spec, "keep_from_s = 0.2");
    say(&spec, "effect sensor_highpass channel=piezo_V tau_s=0.2");
    struct truth_record truth = run(&spec);
    c.record.n = truth.n;
    record_add_column(&c.record, "piezo_V", truth_record_channel(&truth, "piezo_V"));
    record_add_meta(&c.record, "excitation", "free_decay");
    fixture_model(&c.model, "  - {kind: sensor_highpass, tau_s: 0.2}\n");
    if (case_open(&c, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    case_run(&c, NULL);
    double with = unexplained(&c, "piezo_V", c.out.n_nuisance),
           without = unexplained(&c, "piezo_V", c.out.n_nuisance - 1);
    print_message("  %.1e, without the filter's state %.1e\n", with, without);
    assert_true(with < 1e-3);
    assert_true(without > 5.0 * with);
    case_close(&c);
    truth_record_free(&truth);
}

/* A free decay from 0.2 s on. */
static struct truth_record decay(const char *line)
{
    struct truth_spec spec;
    beam_of_fixture(&spec);
    spec.n_outputs = 3, spec.n_signals = 1;
    say(&spec, "signal hammer_N raised_cosine start_s=0.05 width_s=0.02 level=12");
    say(&spec, "duration_s = 1.2");
    say(&spec, "keep_from_s = 0.2");
    say(&spec, line);
    return run(&spec);
}

/* What the model at its true parameters leaves of every output, from the state nearest to the record. */
static void decay_deviations(const struct truth_record *truth, const char *effects, double out[3])
{
    struct bf_error err;
    struct predict_case c = {.record = measured(truth)};
    double *weight = bf_alloc(3 * truth->n, sizeof *weight);
    fixture_model(&c.model, effects);
    record_add_meta(&c.record, "excitation", "free_decay");
    if (case_open(&c, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    for (size_t k = 0; k < 3 * truth->n; k++)
        weight[k] = 1e3 / root_mean_square(truth_record_channel(truth, outputs[k / truth->n]), truth->n);
    const struct predict_target target = {.weight = weight};
    if (predictor_settle(c.predictor, c.theta, &target, &err) != BF_OK)
        fail_msg("%s", err.text);
    case_run(&c, NULL);
    for (size_t i = 0; i < c.out.n_nuisance; i++)
        for (size_t k = 0; k < c.out.n_rows; k++)
            c.out.y[k] += c.out.amplitude[i] * c.out.nuisance[i * c.out.n_rows + k];
    for (size_t o = 0; o < 3; o++)
        out[o] = deviation_from(0, &c, truth, o);
    free(weight);
    case_close(&c);
}

static void compare_decay(const char *effect, const char *without, const char *line, double bound)
{
    struct truth_record truth = decay(line);
    double with[3], other[3];
    decay_deviations(&truth, effect, with);
    decay_deviations(&truth, without, other);
    for (size_t o = 0; o < 3; o++) {
        print_message("  %-12s %.1e, with hardly any %.1e\n", outputs[o], with[o], other[o]);
        assert_true(with[o] < bound);
        assert_true(other[o] > 50.0 * bound);
    }
    truth_record_free(&truth);
}

/* Every sample counts: the motion before the record is not known, and still its first ones are predicted. */
static void free_decay_under_a_law(void **state)
{
    (void)state;
    compare_decay("  - {kind: quadratic_drag, coefficient_Ns2pm3: 2}\n",
                  "  - {kind: quadratic_drag, coefficient_Ns2pm3: 1e-6}\n",
                  "effect quadratic_drag coefficient_Ns2pm3=2", 3e-4);
    compare_decay("  - {kind: cubic_stiffness, coefficient_Npm3: 3e6, at_m: 0.4}\n",
                  "  - {kind: cubic_stiffness, coefficient_Npm3: 1, at_m: 0.4}\n",
                  "effect cubic_stiffness coefficient_Npm3=3e6 at_m=0.4", 3e-4);
}

/* The blow has set it moving as a whole: its velocity is not zero, and the air slows that down. */
static void free_decay_of_a_free_beam(void **state)
{
    (void)state;
    enum { WHOLE = 3 };
    struct truth_record truth = decay("support free-free");
    for (size_t o = 1; o < 3; o++) {
        struct bf_error err;
        struct predict_case c = {.record = {.path = strdup("case.csv"), .n = truth.n, .dt_s = 1.0 / 1024.0}};
        record_add_column(&c.record, outputs[o], truth_record_channel(&truth, outputs[o]));
        record_add_meta(&c.record, "excitation", "free_decay");
        fixture_model(&c.model, "");
        c.model.support = SUPPORT_FREE_FREE;
        if (case_open(&c, NULL, &err) != BF_OK)
            fail_msg("%s", err.text);
        case_run(&c, NULL);
        const double with = unexplained(&c, outputs[o], c.out.n_nuisance),
                     without = unexplained(&c, outputs[o], c.out.n_nuisance - WHOLE);
        print_message("  %-12s %.1e, without the motion as a whole %.1e\n", outputs[o], with, without);
        assert_true(with < 1e-3);
        assert_true(without > 3.0 * with);
        case_close(&c);
    }
    truth_record_free(&truth);
}

/* The recorder's filter still rings of the blow when a free decay begins; forward and backward it does so before the record, too, and nothing is assumed of that. */
static void free_decay_behind_a_recorder(void **state)
{
    (void)state;
    static const char *const stated[] = {"Butterworth order 6 at 256 Hz", "Butterworth order 5 at 256 Hz",
                                         "Butterworth order 6 at 256 Hz, forward and backward"};
    struct truth_spec spec;
    double left[3];
    beam_of_fixture(&spec);
    spec.n_outputs = 3, spec.n_signals = 1;
    static const char *const lines[] = {"filter_order = 6", "filter_ratio = 0.25", "filter_causal = 1",
                                        "duration_s = 0.7", "keep_from_s = 0.159"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        say(&spec, lines[i]);
    struct truth_record truth = run(&spec);
    size_t columns[3];
    for (size_t k = 0; k < 3; k++) {
        struct bf_error err;
        struct predict_case c = {.record = {.path = strdup("case.csv"), .n = truth.n, .dt_s = 1.0 / 1024.0}};
        record_add_column(&c.record, "accel_mps2", truth_record_channel(&truth, "accel_mps2"));
        record_add_meta(&c.record, "excitation", "free_decay");
        record_add_meta(&c.record, RECORD_FILTER, stated[k]);
        fixture_model(&c.model, "");
        if (case_open(&c, NULL, &err) != BF_OK)
            fail_msg("%s", err.text);
        case_run(&c, NULL);
        columns[k] = c.out.n_nuisance;
        left[k] = unexplained(&c, "accel_mps2", c.out.n_nuisance);
        case_close(&c);
    }
    print_message("  %.1e, without the filter's ringing %.1e\n", left[0], left[2]);
    assert_int_equal(columns[0], columns[2] + 6);
    assert_int_equal(columns[1], columns[2] + 5);
    assert_true(left[0] < 1e-3);
    assert_true(left[2] > 10.0 * left[0]);
    truth_record_free(&truth);
}
int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(free_decay_behind_a_charge_amplifier),
        cmocka_unit_test(free_decay_under_a_law),
        cmocka_unit_test(free_decay_of_a_free_beam),
        cmocka_unit_test(free_decay_behind_a_recorder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
