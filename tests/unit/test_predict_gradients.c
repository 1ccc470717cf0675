/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The Jacobian of the beam itself, and of effects that meet in one place of the code. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "gradient_check.h"

/* ---- The beam itself ---- */

static void check_beam(enum intersample intersample, const char *effects, bool inputs)
{
    struct predict_options options = {.intersample = intersample, .fine_splines = 24, .modes = 6};
    /* at 1200 Hz no mode stands at the edge of the band, where a free decay gains or loses an unknown */
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, inputs)};
    struct bf_error err;
    fixture_model(&c.model, effects);
    assert_int_equal(case_open(&c, &options, &err), BF_OK);
    struct summary s = check_case(&c, true);
    print_message("  %-28s worst %.2g at %s (reference good to %.1g)\n", inputs ? "beam" : "free decay", s.worst.error,
                  s.label, s.worst.estimate);
    /* with held inputs the acceleration is a small difference of large numbers: y itself is good to 1e-9 only */
    double goal = intersample == INTERSAMPLE_BAND_LIMITED ? linear_goal : 3e-7;
    assert_true(s.worst.estimate < goal);
    assert_true(s.worst.error < goal);
    case_close(&c);
}

static void beam_band_limited(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_BAND_LIMITED, "", true);
}

static void beam_zero_order_hold(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_ZERO_ORDER_HOLD, "", true);
}

static void beam_first_order_hold(void **state)
{
    (void)state;
    check_beam(INTERSAMPLE_FIRST_ORDER_HOLD, "", true);
}

static void free_decay_with_a_filter(void **state)
{
    (void)state;
    check_beam(
        INTERSAMPLE_BAND_LIMITED,
        "  - {kind: sensor_highpass, tau_s: 0.1}\n  - {kind: root_compliance, compliance_radpNm: 0.01, loss_s: 3e-5, "
        "frequency_Hz: {value: 55, fixed: false}}\n",
        false);
}

/* All places and gains of point channels are parameters; no place next to a knot, where differences cross a kink of the splines. */
static void free_channels(struct model *model)
{
    for (size_t i = 0; i < model->n_inputs; i++) {
        struct model_input *input = &model->inputs[i];
        if (input->kind == INPUT_PATCH_MOMENT)
            continue;
        input->own.lists_at = input->own.lists_gain = true;
        input->own.at.fixed = input->own.gain.fixed = false;
        input->own.gain.value = 1.1;
        input->at_m = input->own.at.value = 0.2113;
    }
    for (size_t o = 0; o < model->n_outputs; o++) {
        struct model_output *output = &model->outputs[o];
        if (output->kind == OUTPUT_PATCH_STRAIN)
            continue;
        output->own.lists_at = output->own.lists_gain = true;
        output->own.at.fixed = output->own.gain.fixed = false;
        output->own.gain.value = 0.9;
    }
}

/* Effects that meet in one place of the code; free: places and gains of the channels are parameters. */
static void open_case(struct predict_case *c, const char *effects, bool free, bool inputs, const char *filter)
{
    struct predict_options options = {.fine_splines = 24, .modes = 6};
    struct bf_error err;
    *c = (struct predict_case){.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, inputs)};
    if (filter != NULL)
        record_add_meta(&c->record, RECORD_FILTER, filter);
    fixture_model(&c->model, effects);
    if (free)
        free_channels(&c->model);
    if (case_open(c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
}

static void check_model(const char *effects, bool free, bool inputs, const char *filter, double goal)
{
    struct predict_case c;
    open_case(&c, effects, free, inputs, filter);
    struct summary s = check_case(&c, true);
    print_message("  worst %.2g at %s (reference good to %.1g)\n", s.worst.error, s.label, s.worst.estimate);
    assert_true(s.worst.estimate < goal);
    assert_true(s.worst.error < goal);
    case_close(&c);
}

static void check_together(const char *effects, bool inputs, const char *filter, double goal)
{
    check_model(effects, false, inputs, filter, goal);
}

static void free_places_and_gains(void **state)
{
    (void)state;
    check_model("  - {kind: sensor_lag, channel: tip_mps, tau_s: 0.0004}\n", true, true, NULL, 3e-8);
    check_model("  - {kind: sensor_lag, channel: tip_mps, tau_s: 0.0004}\n", true, false, NULL, 3e-8);
}

static void free_places_and_gains_with_a_shifted_blow_and_a_wrong_clock(void **state)
{
    (void)state;
    check_model("  - {kind: clock_error, relative: 0.002}\n"
                "  - {kind: input_position, shift_m: 0.004}\n"
                "  - {kind: drive_saturation, level_V: 20}\n"
                "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n",
                true, true, NULL, 3e-8);
}

static void free_places_and_gains_with_a_law(void **state)
{
    (void)state;
    check_model("  - {kind: drive_saturation, level_V: 20}\n"
                "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n",
                true, true, NULL, 1e-6);
}

static void free_places_and_gains_with_a_shifted_patch(void **state)
{
    (void)state;
    check_model("  - {kind: patch_position, shift_m: 0.004}\n", true, true, NULL,
                1e-7); /* a shift is differentiated at the places of the base */
}

static void shaken_clamp_with_masses_filters_and_a_shifted_patch(void **state)
{
    (void)state;
    check_together("  - {kind: patch_position, shift_m: 0.004}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: tip_mass, mass_kg: 0.003}\n"
                   "  - {kind: point_mass, mass_kg: 0.002, at_m: {value: 0.3507, fixed: false}}\n"
                   "  - {kind: hysteretic_damping, loss_factor: 0.004}\n"
                   "  - {kind: sensor_highpass, tau_s: 0.05}\n",
                   true, NULL, 3e-8);
}

static void clock_with_drives_filters_signals_and_a_shifted_blow(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: drive_saturation, level_V: 20}\n"
                   "  - {kind: input_position, shift_m: 0.004}\n"
                   "  - {kind: sensor_lag, channel: tip_mps, tau_s: 0.0004}\n"
                   "  - {kind: mains_hum, amplitude: 0.2, frequency_Hz: 50, phase_rad: 0.3}\n",
                   true, NULL, 3e-8);
}

static void free_decay_on_a_shaken_clamp_under_a_wrong_clock(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: sensor_highpass, tau_s: 0.05}\n",
                   false, NULL, 3e-8);
}

/* Once with the recorder's filter undone and applied again, once without. */
static void clock_with_hum_on_saturated_sensors(void **state)
{
    (void)state;
    const char *effects = "  - {kind: clock_error, relative: 0.002}\n"
                          "  - {kind: sensor_highpass, tau_s: 0.05}\n"
                          "  - {kind: mains_hum, amplitude: 0.2, frequency_Hz: 50, phase_rad: 0.3}\n"
                          "  - {kind: sensor_saturation, channel: piezo_V, level: 1}\n"
                          "  - {kind: sensor_saturation, channel: tip_mps, level: 0.5}\n";
    check_together(effects, true, NULL, 3e-8);
    check_together(effects, true, "Butterworth order 8 at 480 Hz, forward and backward", 3e-8);
}

static void clock_with_a_law(void **state)
{
    (void)state;
    check_together("  - {kind: clock_error, relative: 0.002}\n"
                   "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n",
                   true, NULL, 1e-6);
}

static void law_on_a_shaken_clamp_behind_a_drive(void **state)
{
    (void)state;
    check_together("  - {kind: drive_saturation, level_V: 20}\n"
                   "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                   "  - {kind: input_position, shift_m: 0.004}\n"
                   "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: 0.3507}\n",
                   true, NULL, 1e-6);
}

static void shifted_patch_with_a_law_on_it(void **state)
{
    (void)state;
    check_together("  - {kind: patch_position, shift_m: 0.004}\n"
                   "  - {kind: coulomb_friction, moment_Nm: 1e-3, velocity_radps: 0.5}\n",
                   true, NULL, 1e-6);
}

/* The columns of the initial state against differences of the whole prediction at other states. */
static double check_states(struct predict_case *c)
{
    size_t rows = c->out.n_rows, n = c->out.n_nuisance;
    uint64_t seed = signal_seed(9);
    double *a = bf_alloc(2 * n, sizeof *a), *direction = a + n, worst = 0.0;
    double *y = bf_alloc(3 * rows, sizeof *y), *column = y + 2 * rows;
    const struct point at = {.amplitude = a};
    for (size_t i = 0; i < n; i++) {
        a[i] = 1e-3 * signal_normal(&seed);
        direction[i] = 1e-3 * signal_normal(&seed);
    }
    predictor_set_nuisance(c->predictor, a);
    case_run(c, NULL);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < rows; k++)
            column[k] += direction[i] * c->out.nuisance[i * rows + k];
    const double h = 1e-4;
    for (int up = 0; up < 2; up++) {
        for (size_t i = 0; i < n; i++)
            a[i] += (up ? 2.0 : -1.0) * h * direction[i];
        predictor_set_nuisance(c->predictor, a);
        case_run(c, NULL);
        whole_prediction(c, &at, y + (size_t)up * rows);
    }
    for (size_t ch = 0; ch < CHANNELS; ch++) {
        double square = 0.0, size = channel_norm(column, NULL, ch, rows / CHANNELS);
        for (size_t k = ch * rows / CHANNELS; k < (ch + 1) * rows / CHANNELS; k++)
            square += pow((y[rows + k] - y[k]) / (2.0 * h) - column[k], 2.0);
        worst = fmax(worst, sqrt(square) / size);
    }
    free(a);
    free(y);
    return worst;
}

static void check_free_decay(const char *effects, const char *filter, double goal, double states_goal)
{
    struct predict_case c;
    open_case(&c, effects, false, false, filter);
    struct summary s = check_case(&c, true);
    const double states = check_states(&c);
    print_message("  worst %.2g at %s (reference good to %.1g), states %.2g\n", s.worst.error, s.label,
                  s.worst.estimate, states);
    assert_true(c.out.bends);
    assert_true(s.worst.estimate < goal);
    assert_true(s.worst.error < goal);
    assert_true(states < states_goal);
    case_close(&c);
}

/* The motion that a law acts on begins with the unknown state; a highpass has a state of its own. */
static void free_decay_with_laws(void **state)
{
    (void)state;
    const char *effects = "  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.5}\n"
                          "  - {kind: cubic_stiffness, coefficient_Npm3: 1e6, at_m: {value: 0.3507, fixed: false}}\n"
                          "  - {kind: sensor_highpass, channel: piezo_V, tau_s: 0.05}\n";
    check_free_decay(effects, NULL, 1e-6, 1e-6);
    check_free_decay(effects, "Butterworth order 8 at 480 Hz, forward and backward", 1e-6, 1e-6);
}

static void free_decay_with_friction_on_a_shaken_clamp_under_a_wrong_clock(void **state)
{
    (void)state;
    check_free_decay("  - {kind: clock_error, relative: 0.002}\n"
                     "  - {kind: base_motion, amplitude_mps2: 2, frequency_Hz: 31, phase_rad: 0.5}\n"
                     "  - {kind: coulomb_friction, moment_Nm: 1e-3, velocity_radps: 20}\n",
                     NULL, 1e-6, 1e-6);
}

/* Cut out of a motion: the input is known, the state is not. */
static void recorded_input_from_a_free_state(void **state)
{
    (void)state;
    struct predict_options options = {.fine_splines = 24, .modes = 6};
    struct predict_case c = {.record = case_record("case.csv", SAMPLES, 1.0 / 1200.0, 1.0, true)};
    struct bf_error err;
    record_add_meta(&c.record, "initial_state", "free");
    fixture_model(&c.model, "  - {kind: quadratic_drag, coefficient_Ns2pm3: 0.5}\n");
    if (case_open(&c, &options, &err) != BF_OK)
        fail_msg("%s", err.text);
    struct summary s = check_case(&c, true);
    const double states = check_states(&c);
    print_message("  worst %.2g at %s (reference good to %.1g), states %.2g\n", s.worst.error, s.label,
                  s.worst.estimate, states);
    assert_true(c.out.n_nuisance > 0);
    assert_true(s.worst.estimate < 1e-6);
    assert_true(s.worst.error < 1e-6);
    assert_true(states < 1e-6);
    case_close(&c);
}

static void free_decay_with_a_saturated_sensor(void **state)
{
    (void)state;
    check_free_decay("  - {kind: sensor_saturation, channel: tip_mps, level: 2}\n", NULL, 1e-7, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(beam_band_limited),
        cmocka_unit_test(beam_zero_order_hold),
        cmocka_unit_test(beam_first_order_hold),
        cmocka_unit_test(free_decay_with_a_filter),
        cmocka_unit_test(free_places_and_gains),
        cmocka_unit_test(free_places_and_gains_with_a_shifted_blow_and_a_wrong_clock),
        cmocka_unit_test(free_places_and_gains_with_a_law),
        cmocka_unit_test(free_places_and_gains_with_a_shifted_patch),
        cmocka_unit_test(shaken_clamp_with_masses_filters_and_a_shifted_patch),
        cmocka_unit_test(clock_with_drives_filters_signals_and_a_shifted_blow),
        cmocka_unit_test(free_decay_on_a_shaken_clamp_under_a_wrong_clock),
        cmocka_unit_test(clock_with_hum_on_saturated_sensors),
        cmocka_unit_test(clock_with_a_law),
        cmocka_unit_test(law_on_a_shaken_clamp_behind_a_drive),
        cmocka_unit_test(shifted_patch_with_a_law_on_it),
        cmocka_unit_test(free_decay_with_laws),
        cmocka_unit_test(free_decay_with_friction_on_a_shaken_clamp_under_a_wrong_clock),
        cmocka_unit_test(recorded_input_from_a_free_state),
        cmocka_unit_test(free_decay_with_a_saturated_sensor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
