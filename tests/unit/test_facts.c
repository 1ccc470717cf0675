/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What records say for one explanation against another: invented spectra and noise, whose limits are known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "explain/facts.h"
#include "explain/plausible.h"
#include "model_fixture.h"
#include "signals.h"

enum { FACTS = 12 };

struct case_of_two {
    struct diagnosis d;
    struct fact facts[FACTS];
    struct hypothesis h[2];
    double left[3][FACTS];
};

/* Two hypotheses without parameters, and the baseline: each leaves the same of every fact. */
static void two(struct case_of_two *c, double first, double second, double baseline, double bins, double doubt)
{
    const double left[3] = {first, second, baseline};
    *c = (struct case_of_two){.d = {.n_facts = FACTS, .n_hypotheses = 2}};
    c->d.facts = c->facts, c->d.hypotheses = c->h;
    for (size_t f = 0; f < FACTS; f++) {
        c->facts[f] = (struct fact){.noise = 1.0, .bins = bins, .doubt = doubt};
        for (int i = 0; i < 3; i++)
            c->left[i][f] = left[i];
    }
    c->h[0].left = c->left[0], c->h[1].left = c->left[1], c->d.baseline.left = c->left[2];
}

/* At the noise every bin counts: K bins of ½ (e₂ − e₁) each. */
static void at_the_noise_it_is_half_the_difference_of_chi_square(void **state)
{
    struct case_of_two c;
    double score[3];
    (void)state;
    two(&c, 1.0, 1.0001, 1.0002, 200.0, 0.01);
    facts_scores(&c.d, score);
    const double expected = FACTS * 0.5 * 200.0 * 0.0001;
    assert_true(fabs((score[0] - score[1]) / expected - 1.0) < 0.02);
    assert_true(fabs((score[0] - score[2]) / (2.0 * expected) - 1.0) < 0.03);
}

/* Far from it a band is one fact: the number of its bins does not matter. */
static void far_from_the_noise_a_band_counts_once(void **state)
{
    static const double bins[] = {50.0, 5000.0};
    struct case_of_two c;
    double score[3];
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        two(&c, 100.0, 900.0, 1e6, bins[i], 0.01);
        facts_scores(&c.d, score);
        assert_true(fabs((score[0] - score[1]) / (FACTS * 2.0 * log(1.0 + 8.0 / 4.0)) - 1.0) < 0.05);
        assert_true(fabs((score[0] - score[2]) / (FACTS * 2.0 * log(1.0 + 9999.0 / 4.0)) - 1.0) < 0.05);
    }
}

/* Where the level of the noise is doubted, an error of twice the noise may be noise: its bins count. */
static void a_doubted_noise_is_no_error_of_form(void **state)
{
    struct case_of_two sure, doubtful;
    double score[3], doubted[3];
    (void)state;
    two(&sure, 2.0, 2.5, 9.0, 500.0, 0.01);
    two(&doubtful, 2.0, 2.5, 9.0, 500.0, 0.6);
    facts_scores(&sure.d, score);
    facts_scores(&doubtful.d, doubted);
    assert_true(score[0] - score[1] < 0.6 * FACTS);
    assert_true(doubted[0] - doubted[1] > 5.0 * FACTS);
}

/*
 * A misfit in one band, a thousand times the noise, that does not end where it began, so that it leaks into the bands above it; there the residual is the
 * noise.
 */
static void what_leaks_into_a_band_is_no_misfit_there(void **state)
{
    enum { N = 4096, BANDS = 4 };
    static double residual[N];
    static const double edge_Hz[BANDS + 1] = {0.0, 40.0, 120.0, 250.0, 500.0}, dt = 1e-3;
    (void)state;
    struct fact facts[BANDS];
    struct diagnosis d = {.facts = facts, .n_facts = BANDS, .n_channels = 1};
    struct hypothesis h = {0};
    struct bf_error err;
    uint64_t seed = signal_seed(7);
    for (size_t b = 0; b < BANDS; b++)
        facts[b] = (struct fact){
            .from_Hz = edge_Hz[b], .to_Hz = edge_Hz[b + 1], .noise = (edge_Hz[b + 1] - edge_Hz[b]) * 2.0 * dt};
    for (size_t i = 0; i < N; i++)
        residual[i] = signal_normal(&seed) + 1000.0 * exp(-(double)i / N) * cos(2.0 * M_PI * 7.3 * (double)i * dt);
    struct misfit_channel channel = {.n = N, .dt_s = dt, .measured = residual, .residual = residual};
    assert_int_equal(facts_measure(&d, &channel, &h, &err), BF_OK);
    print_message("of the noise: %.3g, %.3g, %.3g, %.3g\n", h.left[0], h.left[1], h.left[2], h.left[3]);
    assert_true(h.left[0] > 1e6);
    for (size_t b = 1; b < BANDS; b++)
        assert_true(h.left[b] > 0.85 && h.left[b] < 1.3);
    free(h.left);
}

/* Two a parameter that the catalogue counts: a tip mass has one, a point mass a place as well. */
static void parameters_have_their_price(void **state)
{
    struct case_of_two c;
    double score[3];
    (void)state;
    two(&c, 1.0, 1.0, 4.0, 200.0, 0.01);
    c.h[0].n_effects = c.h[1].n_effects = 1;
    c.h[0].effects[0] = effect_by_id("tip_mass"), c.h[1].effects[0] = effect_by_id("point_mass");
    facts_scores(&c.d, score);
    assert_true(fabs(score[0] - score[1] - 2.0) < 1e-9);
}

/* One of two equals has bent a stiffness that is known to 3 % (prior: 0.03) by so many standard deviations: 2 ln(1 + z²/4). A prior that is wrong costs both alike. */
static void what_bends_the_beam_is_believed_less(void **state)
{
    static const double bent[] = {0.0, 1.0, 6.0}, common[] = {0.0, 10.0};
    (void)state;
    for (size_t k = 0; k < 2; k++)
        for (size_t i = 0; i < 3; i++) {
            struct case_of_two c;
            double score[3];
            two(&c, 1.0, 1.0, 4.0, 200.0, 0.01);
            for (int h = 0; h < 2; h++) {
                fixture_model(&c.h[h].model, "");
                struct parameter *EI = &c.h[h].model.materials[0].EI;
                *EI = (struct parameter){.prior = 0.03, .prior_value = 0.5, .logarithmic = true};
                EI->value = 0.5 * exp(0.03 * (h == 1 ? bent[i] + common[k] : common[k]));
            }
            facts_scores(&c.d, score);
            const double z = bent[i] + common[k],
                         expected = 2.0 * (log1p(z * z / 4.0) - log1p(common[k] * common[k] / 4.0));
            assert_true(fabs(score[0] - score[1] - expected) < 1e-9);
            model_free(&c.h[0].model), model_free(&c.h[1].model);
        }
}

/* What is estimated from each record is paid for in each: a shaking clamp's phase. */
static void a_value_for_each_record_is_paid_for_in_each(void **state)
{
    struct case_of_two c;
    double score[3];
    (void)state;
    two(&c, 1.0, 1.0, 4.0, 200.0, 0.01);
    c.d.n_records = 3, c.d.n_checks = 2;
    for (int i = 0; i < 2; i++) {
        fixture_model(&c.h[i].model, i == 0 ? "  - {kind: tip_mass, mass_kg: 0.001}\n"
                                            : "  - {kind: base_motion, amplitude_mps2: 0.1, frequency_Hz: 20}\n");
        c.h[i].n_effects = 1, c.h[i].effects[0] = c.h[i].model.effects[0].effect;
    }
    facts_scores(&c.d, score);
    assert_true(fabs(score[0] - score[1] - 2.0 * (2 + 3 + 2 - 1)) < 1e-9);
    model_free(&c.h[0].model), model_free(&c.h[1].model);
}

static const double FIRST_MODE_HZ = 20.0;

/* Nats of one effect, as a YAML list item, in a hypothesis of its own; motions of the beam as a whole, at no frequency, come before its first mode. */
static double nats_beside_motions(const char *effect, const struct attainable *attainable, size_t rigid)
{
    const struct record record = {.n = 4096, .dt_s = 1e-3};
    struct diagnosis d = {.attainable = *attainable, .records = &record, .n_records = 1, .n_modes = rigid + 1};
    d.mode_Hz[rigid] = FIRST_MODE_HZ;
    struct hypothesis h = {.n_effects = 1};
    fixture_model(&h.model, effect);
    const double nats = implausible_nats(&d, &h);
    model_free(&h.model);
    return nats;
}

static double nats_of(const char *effect, const struct attainable *attainable)
{
    return nats_beside_motions(effect, attainable, 0);
}

/* Nobody measures the motion as a whole of a beam that nothing holds: a sensor that forgets it is believable, one that forgets the first bending is not. */
static void a_free_beam_has_its_first_mode_after_its_motions(void **state)
{
    (void)state;
    static const char *const sensors[] = {"  - {kind: sensor_highpass, tau_s: 0.19}\n",
                                          "  - {kind: sensor_highpass, tau_s: 1e-4}\n"};
    const struct attainable none = {0};
    for (int i = 0; i < 2; i++)
        assert_true(nats_beside_motions(sensors[i], &none, 2) == nats_of(sensors[i], &none));
}

/* A sensor that is too slow for the first mode, or that forgets it, measures nothing. */
static void a_sensor_that_loses_the_first_mode_costs(void **state)
{
    (void)state;
    const struct attainable none = {0};
    const double omega = 2.0 * M_PI * FIRST_MODE_HZ, slow = log(0.5 * hypot(1.0, 0.19 * omega)),
                 leaks = log(0.5 * hypot(1.0, 1e-4 * omega) / (1e-4 * omega));
    assert_true(nats_of("  - {kind: sensor_lag, tau_s: 0.01}\n", &none) == 0.0);
    assert_true(nats_of("  - {kind: sensor_highpass, tau_s: 0.19}\n", &none) == 0.0);
    assert_true(nats_of("  - {kind: sensor_delay, delay_s: 0.19}\n", &none) == 0.0);
    assert_true(fabs(nats_of("  - {kind: sensor_lag, tau_s: 0.19}\n", &none) - 0.5 * slow * slow) < 1e-9);
    assert_true(fabs(nats_of("  - {kind: sensor_highpass, tau_s: 1e-4}\n", &none) - 0.5 * leaks * leaks) < 1e-9);
}

/* The beam's mass is 0.08 kg at most: what is a thousand times as heavy holds it, as a support does. */
static void a_mass_far_heavier_than_the_beam_costs(void **state)
{
    (void)state;
    const struct attainable none = {0};
    assert_true(nats_of("  - {kind: tip_mass, mass_kg: 0.05}\n", &none) == 0.0);
    const double hundred = nats_of("  - {kind: point_mass, mass_kg: 100, at_m: 0.2}\n", &none),
                 ten = nats_of("  - {kind: tip_mass, mass_kg: 10}\n", &none);
    assert_true(ten > 3.0);
    /* ½ (x + ln 10)² − ½ x² with x = √(2 ten) */
    assert_true(fabs(hundred - ten - log(10.0) * (sqrt(2.0 * ten) + 0.5 * log(10.0))) < 1e-9);
}

/* A hum's phase is estimated from the records that have its channel. */
static void a_phase_counts_where_its_channel_was_recorded(void **state)
{
    (void)state;
    static const char *const columns[] = {"piezo_V", "tip_m", "piezo_V"};
    static const double x[4] = {0};
    struct record records[3] = {{0}};
    struct hypothesis h = {.n_effects = 1};
    fixture_model(&h.model, "  - {kind: mains_hum, channel: piezo_V, amplitude: 0.1, frequency_Hz: 50}\n");
    h.effects[0] = h.model.effects[0].effect;
    for (int r = 0; r < 3; r++) {
        records[r].n = 4;
        record_add_column(&records[r], columns[r], x);
    }
    for (size_t n = 1; n <= 2; n++) {
        const struct diagnosis d = {.records = records, .n_records = n, .checks = &records[2], .n_checks = 1};
        assert_int_equal(hypothesis_parameters(&d, &h), 2 + 2);
    }
    for (int r = 0; r < 3; r++)
        record_free(&records[r]);
    model_free(&h.model);
}

/* The beam's EI/l³ is 5.1 N/m: how stiff a spring is, and what it damps, the records tell until it holds the beam. */
static void a_rigid_support_has_its_place_alone(void **state)
{
    static const char *const springs[] = {
        "  - {kind: point_spring, stiffness_Npm: 500, damping_Nspm: 0, at_m: {value: 0.1, fixed: false}}\n",
        "  - {kind: point_spring, stiffness_Npm: 6000, damping_Nspm: 0, at_m: {value: 0.1, fixed: false}}\n"};
    (void)state;
    for (int rigid = 0; rigid < 2; rigid++) {
        struct hypothesis h = {.n_effects = 1};
        fixture_model(&h.model, springs[rigid]);
        h.effects[0] = h.model.effects[0].effect;
        assert_int_equal(hypothesis_parameters(&(struct diagnosis){.n_records = 1}, &h), rigid ? 1 : 3);
        model_free(&h.model);
    }
}

/* A mass thirty times the beam's is no mass that somebody put there; one of ten may be. */
static void a_mass_that_holds_the_beam_is_a_stand_in(void **state)
{
    (void)state;
    for (int holds = 0; holds < 2; holds++) {
        struct hypothesis h = {.n_effects = 1};
        fixture_model(&h.model, "  - {kind: point_mass, mass_kg: 1, at_m: 0.2}\n");
        h.model.effects[0].parameters[0].value = (holds ? 31.0 : 10.0) * model_mass_kg(&h.model);
        assert_int_equal(is_stand_in(&h), holds);
        model_free(&h.model);
    }
}

/* Air that damps the first mode by a half of critical leaves the tone alone to ring there; by a twentieth it leaves the mode. Without a tone there is none to do so. */
static void a_tone_in_the_place_of_a_mode_is_a_stand_in(void **state)
{
    (void)state;
    static const char *const effects[] = {
        "  - {kind: base_motion, amplitude_mps2: 0.1, frequency_Hz: 7, phase_rad: 0}\n",
        "  - {kind: tip_mass, mass_kg: 0.001}\n"};
    static const double damping_ratio[] = {0.05, 0.5};
    for (int tone = 0; tone < 2; tone++)
        for (int dead = 0; dead < 2; dead++) {
            struct hypothesis h = {.n_effects = 1};
            struct modes modes;
            struct bf_error err;
            fixture_model(&h.model, effects[!tone]);
            h.effects[0] = h.model.effects[0].effect;
            assert_int_equal(modes_compute(&h.model, 1, 0.0, 2, &modes, &err), BF_OK);
            /* γ/(2 ρ ω), of a beam of this mass */
            h.model.gamma.value = 4.0 * M_PI * damping_ratio[dead] * modes.mode[0].undamped_Hz *
                                  model_mass_kg(&h.model) / h.model.length_m;
            modes_free(&modes);
            h.tone_replaces_mode = tone_replaces_mode(&h);
            assert_int_equal(is_stand_in(&h), tone && dead);
            model_free(&h.model);
        }
}

/* The beam: EI 0.793 at most, 0.4573 m, so that it buckles at 9.4 N and a tenth of either is usual. */
static void an_unbelievable_strength_costs(void **state)
{
    (void)state;
    const struct attainable none = {0};
    assert_true(nats_of("  - {kind: axial_load, force_N: 0.9}\n", &none) == 0.0);
    assert_true(fabs(nats_of("  - {kind: axial_load, force_N: -25}\n", &none) -
                     0.5 * log(25 / 0.936) * log(25 / 0.936)) < 0.01);
    assert_true(nats_of("  - {kind: viscoelastic, strength_Nm2: 0.05, relaxation_s: 0.01}\n", &none) == 0.0);
    assert_true(nats_of("  - {kind: viscoelastic, strength_Nm2: 1.6, relaxation_s: 100}\n", &none) > 4.0);
    assert_true(nats_of("  - {kind: point_spring, stiffness_Npm: 1e6, damping_Nspm: 0, at_m: 0.1}\n", &none) == 0.0);
    assert_true(nats_of("  - {kind: tip_mass, mass_kg: 0.1}\n", &none) == 0.0);
}

/* What of a memory does not relax within the record is bending stiffness, of which the prior of EI speaks; what relaxes, and a beam without a prior, are judged by strength alone. */
static void a_memory_that_stays_is_bending_stiffness(void **state)
{
    static const struct {
        double relaxation_s, prior;
    } memories[] = {{1e-3, 0.05}, {630.0, 0.0}, {630.0, 0.05}};
    const struct record record = {.n = 4096, .dt_s = 1e-3};
    struct diagnosis d = {.records = &record, .n_records = 1};
    struct hypothesis h = {.n_effects = 1};
    (void)state;
    fixture_model(&h.model, "  - {kind: viscoelastic, strength_Nm2: 1, relaxation_s: 1}\n");
    struct parameter *EI = &h.model.materials[model_plain_material(&h.model)].EI;
    struct parameter *own = h.model.effects[0].parameters;
    double nats[3];
    for (int i = 0; i < 3; i++) {
        EI->prior = memories[i].prior, EI->prior_value = EI->value;
        own[0].value = EI->value, own[1].value = memories[i].relaxation_s;
        nats[i] = implausible_nats(&d, &h);
    }
    const double sds = log(1.0 + exp(-4.096 / 630.0)) / 0.05;
    assert_true(nats[0] == nats[1] && nats[1] < 3.0);
    assert_true(fabs(nats[2] - 0.5 * sds * sds) < 1e-9 * nats[2]);
    model_free(&h.model);
}

/* At a free end nothing pulls but weight, however stiff the beam is: this one, a hundred times as stiff, buckles at 940 N. */
static void what_pulls_at_a_free_end_is_weight(void **state)
{
    (void)state;
    for (int held = 0; held < 2; held++) {
        struct diagnosis d = {0};
        struct hypothesis h = {.n_effects = 1};
        fixture_model(&h.model, "  - {kind: axial_load, force_N: 1}\n");
        h.model.support = held ? SUPPORT_PINNED_PINNED : SUPPORT_CLAMPED_FREE;
        for (size_t m = 0; m < h.model.n_materials; m++)
            h.model.materials[m].EI.value *= 100.0;
        h.model.effects[0].parameters[0].value = 12.0 * 9.80665 * model_mass_kg(&h.model);
        const double nats = implausible_nats(&d, &h);
        assert_true(held ? nats == 0.0 : fabs(nats - 0.5 * log(3.0) * log(3.0)) < 1e-9);
        model_free(&h.model);
    }
}

/* A tenth of its frequency around the pole is its neighbourhood; within its bandwidth the chance is its damping over a tenth. */
static void a_tone_at_a_pole_costs(void **state)
{
    (void)state;
    struct attainable_pole pole = {.frequency_Hz = 20.0, .damping_ratio = 0.001};
    const struct attainable one = {.modes = 1, .poles = &pole};
    assert_true(fabs(nats_of("  - {kind: base_motion, amplitude_mps2: 0.1, frequency_Hz: 20}\n", &one) - log(100.0)) <
                1e-6);
    assert_true(nats_of("  - {kind: base_motion, amplitude_mps2: 0.1, frequency_Hz: 30}\n", &one) == 0.0);
    pole.damping_ratio = 1e-5; /* in 4.1 s it does not decay: no mode, but the tone itself */
    assert_true(nats_of("  - {kind: base_motion, amplitude_mps2: 0.1, frequency_Hz: 20}\n", &one) == 0.0);
}

/* Each channel has a band around each mode, up to its Nyquist frequency, and the noise of all bands together is the channel's. */
static void bands_share_the_noise(void **state)
{
    static const double mode_Hz[] = {10.0, 60.0, 170.0, 330.0}, sigma[] = {0.5};
    static const double zero[512];
    static const struct noise_estimate none;
    const struct misfit_channel channel = {.n = 512, .dt_s = 1e-3, .measured = zero, .residual = zero, .noise = &none};
    struct diagnosis d = {.n_channels = 1};
    double noise = 0.0;
    (void)state;
    facts_of_channels(&d, &channel, sigma, mode_Hz, 4);
    assert_int_equal(d.n_facts, 4);
    for (size_t f = 0; f < d.n_facts; f++) {
        assert_true(d.facts[f].from_Hz < mode_Hz[f] && mode_Hz[f] < d.facts[f].to_Hz);
        noise += d.facts[f].noise;
    }
    assert_true(fabs(noise - 0.25) < 1e-12);
    free(d.facts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_the_noise_it_is_half_the_difference_of_chi_square),
        cmocka_unit_test(far_from_the_noise_a_band_counts_once),
        cmocka_unit_test(a_doubted_noise_is_no_error_of_form),
        cmocka_unit_test(what_leaks_into_a_band_is_no_misfit_there),
        cmocka_unit_test(parameters_have_their_price),
        cmocka_unit_test(what_bends_the_beam_is_believed_less),
        cmocka_unit_test(a_value_for_each_record_is_paid_for_in_each),
        cmocka_unit_test(a_free_beam_has_its_first_mode_after_its_motions),
        cmocka_unit_test(a_sensor_that_loses_the_first_mode_costs),
        cmocka_unit_test(a_mass_far_heavier_than_the_beam_costs),
        cmocka_unit_test(an_unbelievable_strength_costs),
        cmocka_unit_test(a_memory_that_stays_is_bending_stiffness),
        cmocka_unit_test(a_mass_that_holds_the_beam_is_a_stand_in),
        cmocka_unit_test(a_tone_in_the_place_of_a_mode_is_a_stand_in),
        cmocka_unit_test(a_phase_counts_where_its_channel_was_recorded),
        cmocka_unit_test(a_rigid_support_has_its_place_alone),
        cmocka_unit_test(what_pulls_at_a_free_end_is_weight),
        cmocka_unit_test(a_tone_at_a_pole_costs),
        cmocka_unit_test(bands_share_the_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
