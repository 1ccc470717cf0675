/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Decays and stable poles of the truth simulator's beams, against what is known of them in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "compare/compare.h"
#include "steel_strip.h"
#include "test_files.h"
#include "truth_rig.h"

static const double k3_Npm3 = 3e8;

static const char model_text[] = "format: beamfit-model/1\n"
                                 "beam: {length_m: 0.35}\n"
                                 "parameters:\n"
                                 "  EI_beam_Nm2: {value: 52.1}\n"
                                 "  rho_beam_kgpm: {value: 0.97}\n"
                                 "  cDI_beam_sNm2: {value: 1.1e-4}\n"
                                 "  gamma_sNpm2: {value: 1.3}\n"
                                 "inputs: {hammer_N: {kind: point_force, at_m: 0.30}}\n"
                                 "outputs:\n"
                                 "  laser_mps: {kind: velocity, at_m: 0.20}\n"
                                 "  tip_m: {kind: displacement, at_m: 0.35}\n"
                                 "effects: []\n";

static struct model read_model(void)
{
    struct model model;
    struct bf_error err;
    if (model_read_text("strip.yaml", model_text, sizeof model_text - 1, &model, &err) != BF_OK)
        fail_msg("%s", err.text);
    return model;
}

/* With the noise that the specification asks for; as a record of the program. */
static struct record measure(const struct truth_spec *spec)
{
    struct truth_record clean = run(spec), noisy;
    truth_measure(spec, &clean, spec->seed, &noisy);
    struct record record = {.path = strdup("hit.csv"), .n = noisy.n, .dt_s = 1.0 / noisy.rate_Hz};
    for (size_t c = 0; c < noisy.n_channels; c++)
        record_add_column(&record, noisy.channel[c].name, noisy.channel[c].x);
    truth_record_free(&clean);
    truth_record_free(&noisy);
    return record;
}

/* Hit once, or driven throughout; with lines of a specification. */
static struct record make_record(bool driven, const char *more)
{
    static const char *const lines[] = {"length_m 0.35",
                                        "region 0 0.35 52.1 0.97 1.1e-4",
                                        "gamma_sNpm2 1.3",
                                        "noise 0.002",
                                        "sample_rate_Hz 2048",
                                        "duration_s 2",
                                        "input hammer_N point_force at_m=0.30",
                                        "output laser_mps velocity at_m=0.20",
                                        "output tip_m displacement at_m=0.35",
                                        "seed 11"};
    struct truth_spec spec;
    truth_spec_default(&spec);
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        say(&spec, lines[i]);
    say(&spec, driven ? "signal hammer_N chirp width_s=2 level=2 from_Hz=5 to_Hz=900"
                      : "signal hammer_N raised_cosine start_s=0.1 width_s=0.002 level=40");
    if (more != NULL)
        say(&spec, more);
    return measure(&spec);
}

/* The strip as it is, one record, and the comparison of the two. */
struct compared {
    struct model model;
    struct record record;
    struct comparison all;
};

static struct compared *compared_new(struct record record)
{
    struct bf_error err;
    struct compared *c = calloc(1, sizeof *c);
    assert_non_null(c);
    c->model = read_model(), c->record = record;
    if (compare_run(&c->model, &c->record, 1, 0, NULL, &c->all, &err) != BF_OK)
        fail_msg("%s", err.text);
    return c;
}

static void compared_free(struct compared *c)
{
    compare_free(&c->all);
    record_free(&c->record);
    model_free(&c->model);
    free(c);
}

static struct amplitude_curves curves_of(const struct compared *c)
{
    struct amplitude_curves curves;
    struct bf_error err;
    assert_int_equal(amplitude_measure(&c->all, &curves, &err), BF_OK);
    return curves;
}

static const struct amplitude_curve *curve_of(const struct amplitude_curves *curves, const char *channel, size_t mode)
{
    for (size_t i = 0; i < curves->n; i++)
        if (curves->curves[i].mode == mode && strcmp(curves->curves[i].channel, channel) == 0)
            return &curves->curves[i];
    fail_msg("no curve of mode %zu in %s", mode, channel);
    return NULL;
}

/* Every point within five standard errors of the one value; drifts, too. */
static void a_linear_backbone_is_flat_within_its_error_bars(void **state)
{
    (void)state;
    struct compared *strip = compared_new(make_record(false, NULL));
    struct amplitude_curves curves = curves_of(strip);
    for (size_t i = 0; i < curves.n; i++) {
        const struct amplitude_curve *c = &curves.curves[i];
        const double f_Hz = mode_rad(c->mode - 1) / (2.0 * pi), zeta = mode_damping(c->mode - 1);
        for (size_t k = 0; k < c->n; k++) {
            assert_true(fabs(c->frequency_Hz[k] - f_Hz) < 5.0 * c->frequency_sd_Hz[k] + 2e-4 * f_Hz);
            assert_true(fabs(c->damping_ratio[k] - zeta) < 5.0 * c->damping_sd[k] + 0.01 * zeta);
            assert_true(fabs(c->amplitude[k] - c->model_amplitude[k]) < 5.0 * c->amplitude_sd + 0.01 * c->amplitude[k]);
        }
        assert_true(fabs(c->frequency_drift) < 4.0 * c->frequency_drift_sd + 1e-5);
        assert_true(fabs(c->damping_drift) < 4.0 * c->damping_drift_sd + 0.01 * zeta);
    }
    assert_int_equal(curves.n, 4);
    assert_null(amplitude_no_decay(&curves, 0));
    assert_string_equal(curves.text, "");
    amplitude_free(&curves);
    compared_free(strip);
}

/* A cubic spring at the tip: f = f₀ (1 + 3 k₃ φ² A²/(8 ω²)), φ² = 4/(ρℓ) at the tip, A there. To 3 % of the shift, below a shift of 3 %. */
static void a_cubic_spring_hardens_by_the_known_amount(void **state)
{
    (void)state;
    struct compared *strip = compared_new(make_record(false, "effect cubic_stiffness coefficient_Npm3=3e8 at_m=0.35"));
    struct amplitude_curves curves = curves_of(strip);
    const struct amplitude_curve *c = curve_of(&curves, "tip_m", 1);
    const double w = mode_rad(0), f_Hz = w / (2.0 * pi);
    size_t checked = 0;
    for (size_t k = 0; k < c->n; k++) {
        const double shift = 3.0 * k3_Npm3 * 4.0 / (rho * length) * c->amplitude[k] * c->amplitude[k] / (8.0 * w * w);
        const double measured = c->frequency_Hz[k] / f_Hz - 1.0;
        if (shift > 0.03)
            continue;
        checked++;
        if (fabs(measured - shift) > 0.03 * shift + 5.0 * c->frequency_sd_Hz[k] / f_Hz + 1e-4)
            fail_msg("at %.3g m the frequency rises by %.3f %%, not %.3f %%", c->amplitude[k], 100.0 * measured,
                     100.0 * shift);
    }
    assert_true(checked >= 8);
    assert_true(c->frequency_drift > 0.04 && c->frequency_drift < 0.08);
    assert_contains(curves.text, "frequency of mode 1 rises");
    amplitude_free(&curves);
    compared_free(strip);
}

/* A model that is 7 % off, windows that are many turns apart: both have their own frequency. */
static void a_model_that_is_off_does_not_move_what_is_measured(void **state)
{
    (void)state;
    struct compared *strip = compared_new(make_record(false, NULL));
    double off_Hz[STRIP_MODES];
    assert_true(strip->all.n_modes >= STRIP_MODES);
    for (size_t m = 0; m < STRIP_MODES; m++)
        off_Hz[m] = 1.07 * mode_rad(m) / (2.0 * pi);
    memcpy(strip->all.frequency_Hz, off_Hz, sizeof off_Hz);
    struct amplitude_curves curves = curves_of(strip);
    for (size_t mode = 1; mode <= 2; mode++) {
        const struct amplitude_curve *c = curve_of(&curves, "laser_mps", mode);
        const double f_Hz = mode_rad(mode - 1) / (2.0 * pi);
        for (size_t k = 0; k < c->n; k++) {
            assert_true(fabs(c->frequency_Hz[k] - f_Hz) < 5.0 * c->frequency_sd_Hz[k] + 2e-4 * f_Hz);
            assert_true(fabs(c->model_frequency_Hz[k] - f_Hz) < 2e-4 * f_Hz);
        }
    }
    amplitude_free(&curves);
    compared_free(strip);
}

static void a_driven_record_says_that_it_has_no_decay(void **state)
{
    (void)state;
    struct compared *strip = compared_new(make_record(true, NULL));
    struct amplitude_curves curves = curves_of(strip);
    size_t mode[3];
    assert_int_equal(curves.n, 0);
    assert_contains(amplitude_no_decay(&curves, 0), "drives the beam to the end");
    assert_int_equal(amplitude_dominant(&curves, "tip_m", SIZE_MAX, 0, mode, 3), 0);
    amplitude_free(&curves);
    compared_free(strip);
}

static void the_strongest_modes_come_first(void **state)
{
    (void)state;
    double small[] = {1e-3, 5e-4}, large[] = {1.0, 0.5}, middle[] = {0.1, 0.05};
    char channel[] = "tip_m";
    struct amplitude_curve all[] = {{.channel = channel, .mode = 1, .n = 2, .amplitude = small},
                                    {.channel = channel, .mode = 3, .n = 2, .amplitude = large},
                                    {.channel = channel, .mode = 2, .n = 2, .amplitude = middle, .record = 1}};
    const struct amplitude_curves curves = {.n = 3, .curves = all};
    size_t mode[3];
    assert_int_equal(amplitude_dominant(&curves, channel, SIZE_MAX, 0, mode, 2), 2);
    assert_true(mode[0] == 2 && mode[1] == 3);
    assert_int_equal(amplitude_dominant(&curves, channel, SIZE_MAX, 1, mode, 2), 2);
    assert_true(mode[0] == 1 && mode[1] == 3);
    assert_int_equal(amplitude_dominant(&curves, channel, 0, 0, mode, 3), 2);
    assert_int_equal(amplitude_dominant(&curves, "other_m", SIZE_MAX, 0, mode, 3), 0);
}

/* ---- Stabilisation ---- */

static const struct stabilisation_found *nearest(const struct stabilisation *s, double f_Hz)
{
    const struct stabilisation_found *best = &s->found[0];
    for (size_t k = 1; k < s->n_found; k++)
        if (fabs(s->found[k].frequency_Hz - f_Hz) < fabs(best->frequency_Hz - f_Hz))
            best = &s->found[k];
    return best;
}

/* Poles to 0.5 %, damping to the stated share, nothing else named; the beam's frequencies up to Nyquist are three. Frees the record. */
static void check_poles(struct record record, double damping_share)
{
    struct compared *strip = compared_new(record);
    struct stabilisation s;
    struct bf_error err;
    assert_int_equal(stabilisation_find(&strip->all, &s, &err), BF_OK);
    assert_int_equal(s.modes, STABILISATION_MODES);
    assert_int_equal(s.n_found, STRIP_MODES);
    for (size_t m = 0; m < STRIP_MODES; m++) {
        const double f_Hz = mode_rad(m) / (2.0 * pi), zeta = mode_damping(m);
        const struct stabilisation_found *found = nearest(&s, f_Hz);
        if (fabs(found->frequency_Hz / f_Hz - 1.0) > 0.005 || fabs(found->damping_ratio / zeta - 1.0) > damping_share)
            fail_msg("mode %zu: %.5g Hz and %.4g, not %.5g Hz and %.4g", m + 1, found->frequency_Hz,
                     found->damping_ratio, f_Hz, zeta);
    }
    assert_true(s.n_lines > 100 && s.line_Hz[s.n_lines - 1] <= 1024.0 + 1e-9);
    stabilisation_free(&s);
    compared_free(strip);
}

static void a_hit_and_a_chirp_show_the_true_poles(void **state)
{
    (void)state;
    check_poles(make_record(false, NULL), 0.2);
    check_poles(make_record(true, NULL), 0.2);
}

/* The record from 0.3 s on, in full motion at its beginning: a free decay. Mode 3 is near the noise there: its frequency is right, its
 * damping too small, as least squares of an equation's error have it. */
static void a_free_decay_shows_the_true_poles(void **state)
{
    (void)state;
    struct record hit = make_record(false, "noise 0.0002"), decay = {.path = strdup("decay.csv"), .dt_s = hit.dt_s};
    const size_t from = 614;
    decay.n = hit.n - from;
    record_add_column(&decay, "laser_mps", record_column(&hit, "laser_mps") + from);
    record_add_column(&decay, "tip_m", record_column(&hit, "tip_m") + from);
    record_add_meta(&decay, "excitation", "free_decay");
    record_free(&hit);
    check_poles(decay, 0.5);
}

static void noise_alone_has_no_stable_poles(void **state)
{
    (void)state;
    struct compared *strip = compared_new(make_record(false, "noise 100"));
    struct stabilisation s;
    struct bf_error err;
    assert_int_equal(stabilisation_find(&strip->all, &s, &err), BF_OK);
    assert_int_equal(s.n_found, 0);
    stabilisation_free(&s);
    strip->all.n_held_out = 1; /* nothing is left to compute from */
    assert_int_equal(stabilisation_find(&strip->all, &s, &err), BF_OK);
    assert_int_equal(s.modes, 0);
    stabilisation_free(&s);
    compared_free(strip);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_linear_backbone_is_flat_within_its_error_bars),
        cmocka_unit_test(a_cubic_spring_hardens_by_the_known_amount),
        cmocka_unit_test(a_model_that_is_off_does_not_move_what_is_measured),
        cmocka_unit_test(a_driven_record_says_that_it_has_no_decay),
        cmocka_unit_test(the_strongest_modes_come_first),
        cmocka_unit_test(a_hit_and_a_chirp_show_the_true_poles),
        cmocka_unit_test(a_free_decay_shows_the_true_poles),
        cmocka_unit_test(noise_alone_has_no_stable_poles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
