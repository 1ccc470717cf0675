/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Predictions at the true parameters against the independent simulator: what drives, a shaken clamp, shifted places and a
 * wrong clock do, alone and behind other effects.
 */
#include "truth_beam.h"

#include "maths/maths.h"
#include "response/response.h"
#include "response/predictor.h"

enum { OUTPUTS = 4, SETTLED = 24 }; /* samples until the recorder's filter has forgotten that shaking began */

static void add_displacement(struct model *model)
{
    model->outputs = bf_grow(model->outputs, model->n_outputs + 1, sizeof *model->outputs);
    model->outputs[model->n_outputs++] =
        (struct model_output){.name = "tip_m", .kind = OUTPUT_DISPLACEMENT, .at_m = 0.44};
}

static double deviation(const struct predict_case *c, const struct truth_record *truth, size_t output)
{
    return deviation_from(SETTLED, c, truth, output);
}

/* Effects as the model file and as the simulator spell them; lines end with '\n'. */
static void compare(const char *effects, const char *lines, double bound)
{
    struct truth_spec spec;
    struct bf_error err;
    struct predict_case c = {0};
    char line[200];
    beam_of_fixture(&spec);
    for (const char *at = lines; *at != '\0'; at += strcspn(at, "\n") + 1) {
        snprintf(line, sizeof line, "%.*s", (int)strcspn(at, "\n"), at);
        say(&spec, line);
    }
    struct truth_record truth = run(&spec);
    fixture_model(&c.model, effects);
    add_displacement(&c.model);
    c.record = measured(&truth);
    if (case_open(&c, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    case_run(&c, NULL);
    for (size_t o = 0; o < OUTPUTS; o++) {
        double e = deviation(&c, &truth, o);
        print_message("  %-12s %.1e\n", outputs[o], e);
        if (!(e < bound))
            fail_msg("%s: %.2e of its rms", outputs[o], e);
    }
    case_close(&c);
    truth_record_free(&truth);
}

/* What a recorder was; its records do not say. */
struct unstated {
    const char *order, *ratio, *causal; /* lines of a spec */
};

/* Largest deviation over the outputs of a record that does not state its filter; assumed: a usual one is taken. */
static double deviation_unstated(const struct unstated *recorder, const char *effect, const char *law, bool assumed)
{
    struct truth_spec spec;
    struct bf_error err;
    struct predict_case c = {0};
    double largest = 0.0;
    beam_of_fixture(&spec);
    say(&spec, recorder->order);
    say(&spec, recorder->ratio);
    say(&spec, recorder->causal);
    say(&spec, law);
    struct truth_record truth = run(&spec);
    fixture_model(&c.model, effect);
    add_displacement(&c.model);
    c.record = (struct record){.path = strdup("case.csv"), .n = truth.n, .dt_s = 1.0 / truth.rate_Hz};
    for (size_t i = 0; i < truth.n_channels; i++)
        record_add_column(&c.record, truth.channel[i].name, truth.channel[i].x);
    if (assumed)
        assert_true(record_assume_filter(&c.record));
    if (case_open(&c, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    case_run(&c, NULL);
    for (size_t o = 0; o < OUTPUTS; o++)
        largest = fmax(largest, deviation(&c, &truth, o));
    case_close(&c);
    truth_record_free(&truth);
    return largest;
}

/* A usual filter is nearer than none to a steep one without delay, and to a gentle one with a lower corner that delays. */
static void a_usual_filter_is_better_than_none(void **state)
{
    (void)state;
    static const struct unstated recorders[] = {{"filter_order = 8", "filter_ratio = 0.4", "filter_causal = 0"},
                                                {"filter_order = 4", "filter_ratio = 0.35", "filter_causal = 1"}};
    static const char *const cases[][2] = {
        {"  - {kind: coulomb_friction, moment_Nm: 0.001, velocity_radps: 0.005}\n",
         "effect coulomb_friction moment_Nm=0.001 velocity_radps=0.005"},
        {"  - {kind: stop_contact, stiffness_Npm: 300, gap_m: 3.0e-4, at_m: 0.25}\n",
         "effect stop_contact stiffness_Npm=300 gap_m=3e-4 at_m=0.25"},
        {"  - {kind: drive_saturation, level_V: 10}\n", "effect drive_saturation level_V=10"}};
    for (size_t r = 0; r < sizeof recorders / sizeof recorders[0]; r++)
        for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
            const double none = deviation_unstated(&recorders[r], cases[i][0], cases[i][1], false),
                         assumed = deviation_unstated(&recorders[r], cases[i][0], cases[i][1], true);
            print_message("  none %.1e, a usual one %.1e\n", none, assumed);
            assert_true(assumed < 0.6 * none);
        }
}

static void no_effect(void **state)
{
    (void)state;
    compare("", "", 3e-4);
}

/* Something that swings by itself, near the second mode and on a shaken clamp. */
static void resonator(void **state)
{
    (void)state;
    compare("  - {kind: attached_resonator, mass_kg: 0.002, frequency_Hz: 20, damping_ratio: 0.03, at_m: 0.35}\n",
            "effect attached_resonator mass_kg=0.002 frequency_Hz=20 damping_ratio=0.03 at_m=0.35\n", 3e-4);
    compare("  - {kind: base_motion, amplitude_mps2: 0.5, phase_rad: 0.4, frequency_Hz: 31}\n"
            "  - {kind: attached_resonator, mass_kg: 0.001, frequency_Hz: 45, damping_ratio: 0.01, at_m: 0.4573}\n",
            "effect base_motion amplitude_mps2=0.5 phase_rad=0.4 frequency_Hz=31\n"
            "effect attached_resonator mass_kg=0.001 frequency_Hz=45 damping_ratio=0.01\n",
            3e-4);
}

/* A clamp on a support that rocks, near the first modes and far above the beam's. */
static void support_with_a_mode(void **state)
{
    (void)state;
    compare("  - {kind: root_compliance, compliance_radpNm: 0.02, loss_s: 2e-4, frequency_Hz: 24}\n",
            "effect root_compliance compliance_radpNm=0.02 loss_s=2e-4 frequency_Hz=24\n", 3e-4);
    compare("  - {kind: root_compliance, compliance_radpNm: 0.02, loss_s: 2e-5, frequency_Hz: 4000}\n"
            "  - {kind: tip_mass, mass_kg: 0.002}\n",
            "effect root_compliance compliance_radpNm=0.02 loss_s=2e-5 frequency_Hz=4000\n"
            "effect tip_mass mass_kg=0.002\n",
            3e-4);
}

static void hum_with_a_harmonic(void **state)
{
    (void)state;
    compare("  - {kind: mains_hum, channel: piezo_V, amplitude: 0.05, frequency_Hz: 50, phase_rad: 0.5}\n"
            "  - {kind: mains_hum, channel: piezo_V, amplitude: 0.02, frequency_Hz: 150, phase_rad: 1.1}\n",
            "effect mains_hum channel=piezo_V amplitude=0.05 frequency_Hz=50 phase_rad=0.5\n"
            "effect mains_hum channel=piezo_V amplitude=0.02 frequency_Hz=150 phase_rad=1.1\n",
            3e-4);
}

static void hysteresis(void **state)
{
    (void)state;
    compare("  - {kind: drive_hysteresis, share: 0.2, slip_pV: 0.15, shape_pV: 0.06}\n",
            "effect drive_hysteresis share=0.2 slip_pV=0.15 shape_pV=0.06\n", 1e-3);
}

/* What is left is the fifth harmonic, folded at the Nyquist frequency: the recorder's filter lets a hundredth of it through. */
static void saturation(void **state)
{
    (void)state;
    compare("  - {kind: drive_saturation, level_V: 25}\n", "effect drive_saturation level_V=25\n", 2e-3);
}

static void saturation_before_hysteresis(void **state)
{
    (void)state;
    compare("  - {kind: drive_saturation, level_V: 25}\n"
            "  - {kind: drive_hysteresis, share: 0.2, slip_pV: 0.15, shape_pV: 0.06}\n",
            "effect drive_saturation level_V=25\neffect drive_hysteresis share=0.2 slip_pV=0.15 shape_pV=0.06\n", 2e-3);
}

static void saturated_sensor(void **state)
{
    (void)state;
    compare("  - {kind: sensor_saturation, channel: piezo_V, level: 0.3}\n",
            "effect sensor_saturation channel=piezo_V level=0.3\n", 1e-3);
}

static void saturated_sensor_behind_a_charge_amplifier(void **state)
{
    (void)state;
    compare("  - {kind: sensor_highpass, tau_s: 0.05}\n  - {kind: sensor_saturation, channel: piezo_V, level: 0.3}\n",
            "effect sensor_highpass channel=piezo_V tau_s=0.05\n"
            "effect sensor_saturation channel=piezo_V level=0.3\n",
            1e-3);
}

static void shaken_clamp(void **state)
{
    (void)state;
    compare("  - {kind: base_motion, amplitude_mps2: 3, frequency_Hz: 23.7, phase_rad: 0.7}\n",
            "effect base_motion amplitude_mps2=3 frequency_Hz=23.7 phase_rad=0.7\n", 3e-4);
}

static void shaken_clamp_with_a_tip_mass(void **state)
{
    (void)state;
    compare("  - {kind: tip_mass, mass_kg: 0.004}\n"
            "  - {kind: base_motion, amplitude_mps2: 3, frequency_Hz: 23.7, phase_rad: 0.7}\n",
            "effect tip_mass mass_kg=0.004\neffect base_motion amplitude_mps2=3 frequency_Hz=23.7 phase_rad=0.7\n",
            3e-4);
}

static void shaken_clamp_behind_a_charge_amplifier(void **state)
{
    (void)state;
    compare("  - {kind: sensor_highpass, tau_s: 0.05}\n"
            "  - {kind: base_motion, amplitude_mps2: 3, frequency_Hz: 23.7, phase_rad: 0.7}\n",
            "effect sensor_highpass channel=piezo_V tau_s=0.05\n"
            "effect base_motion amplitude_mps2=3 frequency_Hz=23.7 phase_rad=0.7\n",
            1e-3);
}

static void shifted_patch(void **state)
{
    (void)state;
    compare("  - {kind: patch_position, shift_m: 0.006}\n", "effect patch_position shift_m=0.006\n", 3e-4);
    compare("  - {kind: patch_position, shift_m: -0.01}\n", "effect patch_position shift_m=-0.01\n", 3e-4);
}

static void shifted_blow(void **state)
{
    (void)state;
    compare("  - {kind: input_position, shift_m: {value: 0, per_record: {case.csv: 0.004}}}\n",
            "effect input_position shift_m=0.004\n", 3e-4);
}

static void fast_clock(void **state)
{
    (void)state;
    compare("  - {kind: clock_error, relative: -0.003}\n", "effect clock_error relative=-0.003\n", 3e-4);
}

/* The mains line stands beside its frequency, and a tone of the bench too. */
static void slow_clock_on_a_shaken_bench_with_hum(void **state)
{
    (void)state;
    compare("  - {kind: clock_error, relative: 0.01}\n"
            "  - {kind: mains_hum, amplitude: 0.05, frequency_Hz: 50, phase_rad: 0.3}\n"
            "  - {kind: base_motion, amplitude_mps2: 3, frequency_Hz: 23.7, phase_rad: 0.7}\n",
            "effect clock_error relative=0.01\neffect mains_hum channel=piezo_V amplitude=0.05 frequency_Hz=50 "
            "phase_rad=0.3\n"
            "effect base_motion amplitude_mps2=3 frequency_Hz=23.7 phase_rad=0.7\n",
            3e-4);
}

static void law_on_a_shaken_clamp_behind_a_drive(void **state)
{
    (void)state;
    compare("  - {kind: drive_hysteresis, share: 0.2, slip_pV: 0.15, shape_pV: 0.06}\n"
            "  - {kind: base_motion, amplitude_mps2: 3, frequency_Hz: 7.1, phase_rad: 0.7}\n"
            "  - {kind: cubic_stiffness, coefficient_Npm3: 3e5, at_m: 0.35}\n"
            "  - {kind: input_position, shift_m: {value: 0, per_record: {case.csv: 0.004}}}\n",
            "effect drive_hysteresis share=0.2 slip_pV=0.15 shape_pV=0.06\n"
            "effect base_motion amplitude_mps2=3 frequency_Hz=7.1 phase_rad=0.7\n"
            "effect cubic_stiffness coefficient_Npm3=3e5 at_m=0.35\neffect input_position shift_m=0.004\n",
            2e-3);
}

static void law_on_a_shifted_patch_under_a_wrong_clock(void **state)
{
    (void)state;
    compare("  - {kind: patch_position, shift_m: 0.006}\n  - {kind: clock_error, relative: 0.01}\n"
            "  - {kind: coulomb_friction, moment_Nm: 1e-3, velocity_radps: 0.3}\n",
            "effect patch_position shift_m=0.006\neffect clock_error relative=0.01\n"
            "effect coulomb_friction moment_Nm=1e-3 velocity_radps=0.3\n",
            2e-3);
}

/*
 * With the mass that moves along the beam the prediction is better by `factor` on every output than without. What the patch
 * bends between its edges, more than the law's modes can, is missing: 0.8 % of the effect under its moment.
 */
static void compare_inertia(const char *drive, double scale, double bound, double factor)
{
    struct truth_spec spec;
    struct bf_error err;
    struct predict_case c = {0};
    char line[100];
    beam_of_fixture(&spec);
    spec.n_signals = 0;
    say(&spec, drive);
    snprintf(line, sizeof line, "effect large_rotation scale=%g", scale);
    say(&spec, line);
    struct truth_record truth = run(&spec);
    snprintf(line, sizeof line, "  - {kind: large_rotation, scale: %g}\n", scale);
    fixture_model(&c.model, line);
    add_displacement(&c.model);
    c.record = measured(&truth);
    if (case_open(&c, NULL, &err) != BF_OK)
        fail_msg("%s", err.text);
    double with[OUTPUTS];
    case_run(&c, NULL);
    for (size_t o = 0; o < OUTPUTS; o++)
        with[o] = deviation(&c, &truth, o);
    free(c.predictor->laws[0].shortening);
    c.predictor->laws[0].shortening = NULL;
    case_run(&c, NULL);
    for (size_t o = 0; o < OUTPUTS; o++) {
        double without = deviation(&c, &truth, o);
        print_message("  %-12s %.1e, without inertia %.1e\n", outputs[o], with[o], without);
        if (!(with[o] < bound && with[o] * factor < without))
            fail_msg("%s: %.2e of its rms, %.2e without inertia", outputs[o], with[o], without);
    }
    case_close(&c);
    truth_record_free(&truth);
}

static void large_rotation(void **state)
{
    (void)state;
    compare_inertia("signal hammer_N raised_cosine start_s=0.15 width_s=0.016 level=60", 5.0, 2e-3, 100.0);
    compare_inertia("signal drive_V chirp start_s=0 width_s=0.9 from_Hz=5 to_Hz=160 level=30 taper_s=0.1", 1.0, 5e-3,
                    30.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(resonator),
        cmocka_unit_test(support_with_a_mode),
        cmocka_unit_test(hum_with_a_harmonic),
        cmocka_unit_test(no_effect),
        cmocka_unit_test(a_usual_filter_is_better_than_none),
        cmocka_unit_test(hysteresis),
        cmocka_unit_test(saturation),
        cmocka_unit_test(saturation_before_hysteresis),
        cmocka_unit_test(saturated_sensor),
        cmocka_unit_test(saturated_sensor_behind_a_charge_amplifier),
        cmocka_unit_test(shaken_clamp),
        cmocka_unit_test(shaken_clamp_with_a_tip_mass),
        cmocka_unit_test(shaken_clamp_behind_a_charge_amplifier),
        cmocka_unit_test(shifted_patch),
        cmocka_unit_test(shifted_blow),
        cmocka_unit_test(fast_clock),
        cmocka_unit_test(slow_clock_on_a_shaken_bench_with_hum),
        cmocka_unit_test(law_on_a_shaken_clamp_behind_a_drive),
        cmocka_unit_test(law_on_a_shifted_patch_under_a_wrong_clock),
        cmocka_unit_test(large_rotation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
