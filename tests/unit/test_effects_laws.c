/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What laws, filters and drives must obey whatever their numbers: energy, stability, and their textbook forms. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>
#include "effects_draw.h"

enum { STEPS = 40000, LAPS = 2 };

/* cmocka's own comparison is in float. */
static void near_or_fail(const char *what, double x, double expected, double tolerance)
{
    if (!(fabs(x - expected) <= tolerance))
        fail_msg("%s = %.17g, not %.17g", what, x, expected);
}
#define assert_near(x, expected, tolerance) near_or_fail(#x, x, expected, tolerance)

static int index_of(const char *id)
{
    for (int e = 0; e < beam_effects_count; e++)
        if (strcmp(beam_effects[e]->id, id) == 0)
            return e;
    fail_msg("%s is not in the build", id);
    return -1;
}

/* Two coordinates on a closed path that does not retrace itself, with their rates. */
static void path(double turn, const double size[2], double w[2], double v[2])
{
    const double a = 6.283185307179586 * turn;
    w[0] = size[0] * (sin(a) + 0.3 * cos(2.0 * a));
    w[1] = size[1] * (cos(a) + 0.4 * sin(3.0 * a));
    v[0] = 6.283185307179586 * size[0] * (cos(a) - 0.6 * sin(2.0 * a));
    v[1] = 6.283185307179586 * size[1] * (-sin(a) + 1.2 * cos(3.0 * a));
}

struct work {
    double total, absolute;
};

/* Work ∮ f·v dt that the law takes up on the last of LAPS laps, states followed. */
static struct work work_on_a_lap(struct shadow_case c, const double size[2])
{
    struct work work = {0.0, 0.0};
    struct shadow_answer a;
    double z[2] = {0.0, 0.0};
    path(0.0, size, &c.x[SHADOW_P + 4], (double[2]){0.0, 0.0});
    for (int k = 1; k <= LAPS * STEPS; k++) {
        path((double)k / STEPS, size, &c.x[SHADOW_P], &c.x[SHADOW_P + 2]);
        memcpy(&c.x[SHADOW_P + 6], z, sizeof z);
        beam_shadow(&c, &a);
        assert_int_equal(a.status, 0);
        memcpy(z, &a.y[2], sizeof z);
        c.x[SHADOW_P + 4] = c.x[SHADOW_P];
        c.x[SHADOW_P + 5] = c.x[SHADOW_P + 1];
        const double power = a.y[0] * c.x[SHADOW_P + 2] + a.y[1] * c.x[SHADOW_P + 3];
        if (k > (LAPS - 1) * STEPS) {
            work.total += power / STEPS;
            work.absolute += fabs(power) / STEPS;
        }
    }
    return work;
}

/* A law without rate and state (by its own derivatives) is a spring. */
static int is_spring(struct shadow_case c, uint64_t *seed)
{
    for (int k = 0; k < 50; k++) {
        struct shadow_answer a;
        struct shadow_case d = draw_case(c.effect, SHADOW_LAW, seed);
        memcpy(d.x, c.x, SHADOW_P * sizeof c.x[0]);
        beam_shadow(&d, &a);
        for (int i = 0; i < 2; i++)
            for (int j = SHADOW_P + 2; j < SHADOW_IN; j++)
                if (a.slope[i][j] != 0.0)
                    return 0;
    }
    return 1;
}

static void test_springs_conserve_and_the_rest_dissipates(void **state)
{
    (void)state;
    int springs = 0, losses = 0;
    for (int e = 0; e < beam_effects_count; e++) {
        if (!beam_effects[e]->law)
            continue;
        uint64_t seed = 17 + (uint64_t)e;
        int lossy = 0, lost = 0; /* a slider that sticks for a whole lap loses nothing in it */
        for (int k = 0; k < 3; k++) {
            const struct shadow_case c = draw_case(e, SHADOW_LAW, &seed);
            const double size[2] = {draw_uniform(&seed, 0.005, 0.05), draw_uniform(&seed, 0.01, 0.1)};
            const struct work work = work_on_a_lap(c, size);
            const char *id = beam_effects[e]->id;
            if (is_spring(c, &seed)) {
                springs++;
                if (!(fabs(work.total) <= 1e-6 * work.absolute))
                    fail_msg("%s: a closed lap costs %g of %g", id, work.total, work.absolute);
            } else {
                losses++;
                lossy = 1;
                lost |= work.total > 1e-3 * work.absolute;
                if (!(work.total > -1e-6 * work.absolute))
                    fail_msg("%s: a closed lap gives back %g of %g", id, -work.total, work.absolute);
            }
        }
        if (lossy && !lost)
            fail_msg("%s: no lap of three loses anything", beam_effects[e]->id);
    }
    assert_true(springs >= 12 && losses >= 6);
}

static void test_linear_terms_are_passive(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        uint64_t seed = 3 + (uint64_t)e;
        for (int k = 0; k < 500; k++) {
            struct shadow_answer a;
            const struct shadow_case c = draw_case(e, SHADOW_TERMS, &seed);
            beam_shadow(&c, &a);
            for (int t = 0; a.status == 0 && t < beam_effects[e]->n_terms; t++) {
                const double *y = &a.y[6 * t]; /* mass, damping, stiffness, memory, relaxation */
                if (y[0] < 0.0 || y[1] < 0.0 || y[3] < 0.0 || (y[3] > 0.0 && !(y[4] > 0.0)))
                    fail_msg("%s: a term feeds energy", beam_effects[e]->id);
            }
        }
    }
}

static void test_filters_are_stable(void **state)
{
    (void)state;
    int tried = 0;
    for (int e = 0; e < beam_effects_count; e++) {
        uint64_t seed = 8 + (uint64_t)e;
        for (int k = 0; k < 500; k++) {
            struct shadow_answer a;
            const struct shadow_case c = draw_case(e, SHADOW_FILTER, &seed);
            beam_shadow(&c, &a);
            if (a.status != 0)
                continue;
            tried++;
            const double a1 = a.y[2], a0 = a.y[3], delay = a.y[4];
            if (!(a1 >= 0.0) || !(a0 > 0.0) || !(delay >= 0.0))
                fail_msg("%s: pole %g 1/s, delay %g s", beam_effects[e]->id, -a0 / a1, delay);
        }
    }
    assert_true(tried >= 1500);
}

static double gain_at(const char *id, double tau, double w, double *phase)
{
    struct shadow_case c = {.effect = index_of(id), .slot = SHADOW_FILTER, .direction = -1, .length_m = 1.0};
    struct shadow_answer a;
    c.x[0] = tau;
    beam_shadow(&c, &a);
    *phase = atan2(a.y[0] * w, a.y[1]) - atan2(a.y[2] * w, a.y[3]) - a.y[4] * w;
    return hypot(a.y[0] * w, a.y[1]) / hypot(a.y[2] * w, a.y[3]);
}

static void test_filters_have_their_textbook_corner(void **state)
{
    (void)state;
    double phase;
    assert_near(gain_at("sensor_highpass", 0.1, 10.0, &phase), sqrt(0.5), 1e-12);
    assert_near(phase, 0.25 * 3.141592653589793, 1e-12);
    assert_near(gain_at("sensor_highpass", 0.1, 1e6, &phase), 1.0, 1e-9);
    assert_near(gain_at("sensor_lag", 1e-3, 1e3, &phase), sqrt(0.5), 1e-12);
    assert_near(phase, -0.25 * 3.141592653589793, 1e-12);
    assert_near(gain_at("sensor_delay", 1e-3, 500.0, &phase), 1.0, 1e-12);
    assert_near(phase, -0.5, 1e-12);
}

/* One step of the drive from (u_old, z) to u. */
static struct shadow_answer hysteresis(const double p[3], double u, double u_old, double z)
{
    struct shadow_case c = {.effect = index_of("drive_hysteresis"), .slot = SHADOW_DRIVE, .direction = -1};
    struct shadow_answer a;
    memcpy(c.x, p, 3 * sizeof p[0]);
    c.x[SHADOW_P] = u;
    c.x[SHADOW_P + 1] = u_old;
    c.x[SHADOW_P + 2] = z;
    beam_shadow(&c, &a);
    assert_int_equal(a.status, 0);
    return a;
}

static void test_hysteresis_does_not_see_the_sample_rate(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int k = 0; k < 2000; k++) {
        const double slip = draw_uniform(&seed, 0.01, 0.3);
        const double p[3] = {0.2, slip, draw_uniform(&seed, -0.99, 2.0) * slip};
        const double z = draw_uniform(&seed, -1.0, 1.0) / (p[1] + p[2]);
        const double u_old = draw_uniform(&seed, -10.0, 10.0), u = draw_uniform(&seed, -10.0, 10.0);
        const double whole = hysteresis(p, u, u_old, z).y[1];
        double part = z;
        for (int i = 0; i < 7; i++)
            part = hysteresis(p, u_old + (u - u_old) * (i + 1) / 7.0, u_old + (u - u_old) * i / 7.0, part).y[1];
        assert_near(part, whole, 1e-11 * fmax(1.0, 1.0 / (p[1] + p[2])));
        assert_true(fabs(whole) <= (1.0 + 1e-12) / (p[1] + p[2]));
    }
}

/* Against the differential equation itself in very small explicit steps. */
static void test_hysteresis_follows_its_equation(void **state)
{
    (void)state;
    const double p[3] = {0.3, 0.12, 0.05};
    double z = 0.0, truth = 0.0, u_old = 0.0, loop = 0.0;
    for (int k = 1; k <= 300; k++) {
        const double u = 12.0 * sin(0.1 * k) * (1.0 + 0.3 * sin(0.037 * k));
        const double du = (u - u_old) / 2000.0;
        for (int i = 0; i < 2000; i++)
            truth += du * (1.0 - (p[1] * (du * truth > 0.0 ? 1.0 : -1.0) + p[2]) * fabs(truth));
        const struct shadow_answer a = hysteresis(p, u, u_old, z);
        loop += 0.5 * (z + a.y[1]) * (u - u_old);
        z = a.y[1];
        assert_near(z, truth, 2e-3);
        assert_near(a.y[0], u - p[0] * z, 1e-12);
        u_old = u;
    }
    assert_true(loop > 0.0); /* the loop loses energy */
}

static double microslip(double w, double *z)
{
    struct shadow_case c = {.effect = index_of("microslip"), .slot = SHADOW_LAW, .direction = -1};
    struct shadow_answer a;
    c.x[0] = 2.0;   /* N·m/rad */
    c.x[1] = 0.004; /* N·m: slips after 2 mrad */
    c.x[SHADOW_P] = w;
    c.x[SHADOW_P + 6] = *z;
    beam_shadow(&c, &a);
    *z = a.y[2];
    return a.y[0];
}

/* Masing's loop of amplitude A around a slip at 2 mrad: area 4 M₀ (A − 2 mrad), corners at the yield moment. */
static void test_microslip_draws_masings_loop(void **state)
{
    (void)state;
    const double A = 0.005;
    double z = 0.0, old = 0.0, f_old = 0.0, area = 0.0;
    assert_near(microslip(0.0015, &z), 0.003, 1e-15);
    assert_near(z, 0.0, 0.0);
    for (int k = 1; k <= 3 * STEPS; k++) {
        const double w = A * sin(6.283185307179586 * k / STEPS);
        const double f = microslip(w, &z);
        if (k > 2 * STEPS)
            area += 0.5 * (f + f_old) * (w - old);
        assert_true(fabs(f) <= 0.004 * (1.0 + 1e-12));
        old = w;
        f_old = f;
    }
    assert_near(area, 4.0 * 0.004 * (A - 0.002), 1e-8);
}

static double force(const char *id, const double p[], double w, double v)
{
    struct shadow_case c = {.effect = index_of(id), .slot = SHADOW_LAW, .direction = -1, .t_s = 2.0};
    struct shadow_answer a;
    memcpy(c.x, p, 3 * sizeof p[0]);
    c.x[SHADOW_P] = w;
    c.x[SHADOW_P + 2] = v;
    beam_shadow(&c, &a);
    return a.y[0];
}

static void test_laws_have_their_textbook_values(void **state)
{
    (void)state;
    assert_near(force("quadratic_drag", (double[3]){0.5}, 0.0, -3.0), -4.5, 1e-15);
    assert_near(force("cubic_stiffness", (double[3]){100.0, 0.2}, -0.1, 0.0), -0.1, 1e-15);
    assert_near(force("patch_softening", (double[3]){-5.0}, -0.1, 0.0), 0.05, 1e-15);
    assert_near(force("coulomb_friction", (double[3]){2.0, 0.5}, 0.0, 50.0), 2.0, 1e-15);
    assert_near(force("coulomb_friction", (double[3]){2.0, 0.5}, 0.0, -0.5), -2.0 * 0.76159415595576, 1e-13);
    assert_near(force("bilinear_stiffness", (double[3]){3.0, 0.1, 0.01}, 0.2, 0.0), -0.6, 1e-15);
    assert_near(force("bilinear_stiffness", (double[3]){3.0, 0.1, 0.01}, -0.2, 0.0), 0.0, 0.0);
    assert_near(force("stop_contact", (double[3]){500.0, 0.001, 0.2}, 0.003, 0.0), 1.0, 1e-15);
    assert_near(force("stop_contact", (double[3]){500.0, 0.001, 0.2}, -0.003, 0.0), 0.0, 0.0);
    assert_near(force("thermal_drift", (double[3]){0.01}, 0.5, 0.0), 0.01, 1e-15);
}

static void test_a_tone_is_the_motion_of_its_base(void **state)
{
    int tones = 0;
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        const struct beam_effect *effect = beam_effects[e];
        uint64_t seed = 11;
        if (!effect->tone)
            continue;
        tones++;
        assert_non_null(effect->base);
        for (int point = 0; point < 100; point++) {
            const struct shadow_case c = draw_case(e, SHADOW_BASE, &seed);
            struct beam_sample_output y = {0};
            struct beam_tone tone = {0};
            assert_int_equal(effect->base(c.x, c.t_s, &y), 0);
            assert_int_equal(effect->tone(c.x, &tone), 0);
            const double turn = 6.283185307179586 * c.t_s, angle = turn * tone.frequency_Hz + tone.phase_rad;
            const double size = tone.amplitude;
            assert_near(size * sin(angle), y.y, 1e-9 * fabs(size));
            for (int j = 0; j < effect->n_parameters; j++) {
                const double *d = tone.by_parameter[j]; /* of amplitude, phase, frequency */
                assert_near(d[0] * sin(angle) + size * cos(angle) * (d[1] + turn * d[2]), y.y_p[j],
                            1e-9 * (1.0 + fabs(size) * turn));
            }
        }
    }
    assert_in_range(tones, 1, beam_effects_count);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_springs_conserve_and_the_rest_dissipates),
        cmocka_unit_test(test_linear_terms_are_passive),
        cmocka_unit_test(test_filters_are_stable),
        cmocka_unit_test(test_filters_have_their_textbook_corner),
        cmocka_unit_test(test_hysteresis_does_not_see_the_sample_rate),
        cmocka_unit_test(test_hysteresis_follows_its_equation),
        cmocka_unit_test(test_microslip_draws_masings_loop),
        cmocka_unit_test(test_laws_have_their_textbook_values),
        cmocka_unit_test(test_a_tone_is_the_motion_of_its_base),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
