/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every derivative that an effect states, against the complex step of the same source; float against double. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>
#include "effects_draw.h"

enum { POINTS = 400 };

static const char *const slot_name[SHADOW_SLOTS] = {"terms",  "law_place", "law",  "filter",   "map",
                                                    "signal", "drive",     "base", "geometry", "axial_inertia"};

static int compare_with_complex_step(struct shadow_case c, const char *id)
{
    struct shadow_answer stated, step;
    beam_shadow(&c, &stated);
    if (stated.status != 0)
        return 0;
    for (int j = 0; j < stated.n_in; j++) {
        c.direction = j;
        c.step = 1e-40;
        beamc_shadow(&c, &step);
        assert_int_equal(step.status, 0);
        for (int i = 0; i < stated.n_out; i++) {
            const double truth = step.y_imaginary[i] / c.step;
            const double size = fmax(fabs(truth), fabs(stated.slope[i][j]));
            const double noise = 1e-14 * fabs(c.x[j] == 0.0 ? 0.0 : stated.y[i] / c.x[j]);
            if (!(fabs(truth - stated.slope[i][j]) <= 1e-10 * size + noise))
                fail_msg("%s %s: d y[%d]/d x[%d] is stated as %.17g, the complex step gives %.17g", id,
                         slot_name[c.slot], i, j, stated.slope[i][j], truth);
            if (!(fabs(step.y[i] - stated.y[i]) <= 1e-12 * fabs(stated.y[i])))
                fail_msg("%s %s: the complex build gives y[%d] = %.17g, not %.17g", id, slot_name[c.slot], i, step.y[i],
                         stated.y[i]);
        }
    }
    return 1;
}

static void test_stated_derivatives_are_exact(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        int slots = 0;
        for (int slot = 0; slot < SHADOW_SLOTS; slot++) {
            uint64_t seed = 20231 + (uint64_t)(e * SHADOW_SLOTS + slot);
            int tried = 0;
            for (int k = 0; k < POINTS; k++)
                tried += compare_with_complex_step(draw_case(e, (enum shadow_slot)slot, &seed), beam_effects[e]->id);
            if (tried > 0)
                slots++;
            if (tried != 0 && tried < POINTS / 4)
                fail_msg("%s %s: only %d of %d points were inside its range", beam_effects[e]->id, slot_name[slot],
                         tried, POINTS);
        }
        if (slots == 0)
            fail_msg("%s: no slot could be evaluated", beam_effects[e]->id);
    }
}

/* The same inputs, exact in float, through both; an error of one rounding of each input is allowed for. */
static int compare_with_float(struct shadow_case c, const char *id)
{
    struct shadow_answer exact, single;
    for (int j = 0; j < SHADOW_IN; j++)
        c.x[j] = (double)(float)c.x[j];
    c.length_m = (double)(float)c.length_m;
    c.t_s = (double)(float)c.t_s;
    c.dt_s = (double)(float)c.dt_s;
    beam_shadow(&c, &exact);
    beamf_shadow(&c, &single);
    if (exact.status != 0)
        return 0;
    assert_int_equal(single.status, 0);
    for (int i = 0; i < exact.n_out; i++) {
        double allowed = 1e-5 * fabs(exact.y[i]);
        for (int j = 0; j < exact.n_in; j++)
            allowed += 4e-7 * fabs(exact.slope[i][j] * c.x[j]);
        if (!(fabs(single.y[i] - exact.y[i]) <= allowed))
            fail_msg("%s %s: y[%d] is %.9g in float and %.9g in double", id, slot_name[c.slot], i, single.y[i],
                     exact.y[i]);
    }
    return 1;
}

static void test_float_agrees_with_double(void **state)
{
    (void)state;
    int tried = 0;
    for (int e = 0; e < beam_effects_count; e++)
        for (int slot = 0; slot < SHADOW_SLOTS; slot++) {
            uint64_t seed = 777 + (uint64_t)(e * SHADOW_SLOTS + slot);
            for (int k = 0; k < POINTS; k++)
                tried += compare_with_float(draw_case(e, (enum shadow_slot)slot, &seed), beam_effects[e]->id);
        }
    assert_true(tried > beam_effects_count * POINTS / 2);
}

/* Central differences cross no complex arithmetic: they catch a mistake that both builds would share. */
static void test_derivatives_agree_with_differences(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++)
        for (int slot = 0; slot < SHADOW_SLOTS; slot++) {
            uint64_t seed = 99 + (uint64_t)(e * SHADOW_SLOTS + slot);
            int tried = 0, agreed = 0;
            for (int k = 0; k < POINTS / 4; k++) {
                struct shadow_case c = draw_case(e, (enum shadow_slot)slot, &seed), c2 = c;
                struct shadow_answer mid, up, down;
                beam_shadow(&c, &mid);
                for (int j = 0; mid.status == 0 && j < mid.n_in; j++) {
                    const double h = 1e-6 * fmax(fabs(c.x[j]), 1e-6);
                    c2.x[j] = c.x[j] + h;
                    beam_shadow(&c2, &up);
                    c2.x[j] = c.x[j] - h;
                    beam_shadow(&c2, &down);
                    c2.x[j] = c.x[j];
                    for (int i = 0; i < mid.n_out; i++) {
                        const double difference = (up.y[i] - down.y[i]) / (2.0 * h);
                        tried++;
                        agreed += fabs(difference - mid.slope[i][j]) <=
                                  1e-4 * fabs(mid.slope[i][j]) + 1e-8 * (fabs(mid.y[i]) / h * 1e-6 + 1.0);
                    }
                }
            }
            if (agreed < tried - tried / 50) /* a kink or an end of the beam within h of a few points */
                fail_msg("%s %s: %d of %d derivatives differ from central differences", beam_effects[e]->id,
                         slot_name[slot], tried - agreed, tried);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stated_derivatives_are_exact),
        cmocka_unit_test(test_float_agrees_with_double),
        cmocka_unit_test(test_derivatives_agree_with_differences),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
