/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every parameter of the catalogue states its role, and roles agree with the units, flags and places that people read. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "beam_effect.h"

static const double length_m = 0.4573;

static int has_unit(const struct beam_parameter_info *info, const char *unit)
{
    return strcmp(info->unit, unit) == 0;
}

static int within(const struct beam_parameter_info *info, double low, double high)
{
    return low <= info->minimum && info->maximum <= high;
}

/* What the role promises to those who read it; NULL when it is kept. */
static const char *broken_promise(const struct beam_parameter_info *info)
{
    const int inner = (info->flags & BEAM_PARAMETER_INNER) != 0;
    const int per_record = (info->flags & BEAM_PARAMETER_PER_RECORD) != 0;
    switch ((enum beam_role)info->role) {
    case BEAM_ROLE_PLACE:
        return has_unit(info, "m") && within(info, 0.0, 1.0) && inner && !per_record
                   ? NULL
                   : "a place is in m, a fraction of the length, INNER, and the same in every record";
    case BEAM_ROLE_STRENGTH:
        return info->neutral == 0.0 && !inner ? NULL : "the effect is absent at strength 0, and not INNER";
    case BEAM_ROLE_TIME:
        return has_unit(info, "s") && info->minimum >= 0.0 ? NULL : "a time is in s and not negative";
    case BEAM_ROLE_LEVEL:
        return !has_unit(info, "") ? NULL : "a level is a size of something and has a unit";
    case BEAM_ROLE_PHASE:
        return has_unit(info, "rad") && inner && per_record ? NULL : "a phase is in rad, INNER and PER_RECORD";
    case BEAM_ROLE_FREQUENCY:
        return has_unit(info, "Hz") && inner && info->minimum > 0.0 ? NULL : "a frequency is in Hz, positive and INNER";
    case BEAM_ROLE_SHARE:
        return has_unit(info, "") && within(info, -1.0, 1.0) ? NULL : "a share has no unit and is within -1 and 1";
    case BEAM_ROLE_LOSS:
        return (has_unit(info, "") || has_unit(info, "s")) && info->neutral == 0.0 && info->minimum == 0.0
                   ? NULL
                   : "a loss has no unit or is in s, is not negative and neutral at 0";
    case BEAM_ROLE_RESONANCE:
        return has_unit(info, "Hz") && inner && (info->flags & BEAM_PARAMETER_LOG)
                   ? NULL
                   : "a resonance is in Hz, INNER and estimated as a logarithm";
    }
    return "it states no role (see enum beam_role)";
}

static void test_every_parameter_states_a_role_and_keeps_to_it(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++)
        for (int j = 0; j < beam_effects[e]->n_parameters; j++) {
            const struct beam_parameter_info *info = &beam_effects[e]->parameters[j];
            const char *broken = broken_promise(info);
            if (broken)
                fail_msg("%s %s: %s", beam_effects[e]->id, info->name, broken);
        }
}

/* The catalogue's values, places in metres. */
static void start_values(const struct beam_effect *effect, beam_real p[BEAM_EFFECT_PARAMETERS])
{
    for (int j = 0; j < BEAM_EFFECT_PARAMETERS; j++)
        p[j] = effect->parameters[j].start * (effect->parameters[j].role == BEAM_ROLE_PLACE ? length_m : 1.0);
}

static const struct beam_place place = {length_m, 0.02535, 0.08905};

static struct beam_law_place law_place_of(const struct beam_effect *effect)
{
    struct beam_law_place out = {.points = BEAM_LAW_NONE};
    beam_real p[BEAM_EFFECT_PARAMETERS];
    start_values(effect, p);
    if (effect->law_place && effect->law_place(p, &place, &out) != 0)
        fail_msg("%s: its start is outside the beam; is its place a BEAM_ROLE_PLACE?", effect->id);
    return out;
}

/* A PLACE is what the slots name as at_parameter, and nothing else is. */
static void test_places_are_what_the_slots_name(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        const struct beam_effect *effect = beam_effects[e];
        struct beam_term terms[BEAM_EFFECT_TERMS] = {0};
        beam_real p[BEAM_EFFECT_PARAMETERS];
        int named[BEAM_EFFECT_PARAMETERS + 1] = {0};
        start_values(effect, p);
        if (effect->terms && effect->terms(p, &place, terms) != 0)
            fail_msg("%s: its start is outside the beam; is its place a BEAM_ROLE_PLACE?", effect->id);
        for (int t = 0; t < effect->n_terms; t++)
            named[terms[t].place.at_parameter] = 1;
        named[law_place_of(effect).at_parameter] = 1;
        for (int j = 0; j < effect->n_parameters; j++)
            if ((effect->parameters[j].role == BEAM_ROLE_PLACE) != named[j + 1])
                fail_msg("%s %s: a place must be the at_parameter of a slot, and that must be a place", effect->id,
                         effect->parameters[j].name);
    }
}

/* ---- Levels ---- */

static const char *coordinate_unit(enum beam_law_points points)
{
    switch (points) {
    case BEAM_LAW_AT_POINT:
    case BEAM_LAW_OVER_DEFLECTION:
        return "m";
    case BEAM_LAW_AT_PATCH:
    case BEAM_LAW_AT_SPAN:
    case BEAM_LAW_OVER_SLOPE_AND_CURVATURE:
        return "rad";
    case BEAM_LAW_OVER_CURVATURE:
        return "1/m";
    case BEAM_LAW_NONE:
        break;
    }
    return NULL;
}

/* What a level is a value of as far as its unit tells: OWN when the unit is neither motion nor strength × motion. */
static enum beam_level level_by_unit(const struct beam_effect *effect, const char *unit)
{
    const char *w = coordinate_unit(law_place_of(effect).points);
    char rate[32], elastic[64], viscous[64];
    int strength = 0;
    while (strength + 1 < effect->n_parameters && effect->parameters[strength].role != BEAM_ROLE_STRENGTH)
        strength++;
    if (!w)
        return BEAM_LEVEL_OWN;
    (void)snprintf(rate, sizeof rate, "%s/s", w);
    (void)snprintf(elastic, sizeof elastic, "%s/%s", unit, w);
    (void)snprintf(viscous, sizeof viscous, "%s·s/%s", unit, w);
    return strcmp(unit, w) == 0                                      ? BEAM_LEVEL_COORDINATE
           : strcmp(unit, rate) == 0                                 ? BEAM_LEVEL_RATE
           : strcmp(effect->parameters[strength].unit, elastic) == 0 ? BEAM_LEVEL_ELASTIC
           : strcmp(effect->parameters[strength].unit, viscous) == 0 ? BEAM_LEVEL_VISCOUS
                                                                     : BEAM_LEVEL_OWN;
}

/* A level of motion or force has the unit of that; a level of a channel belongs to an effect on a channel. */
static void test_levels_say_of_what(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++)
        for (int j = 0; j < beam_effects[e]->n_parameters; j++) {
            const struct beam_effect *effect = beam_effects[e];
            const struct beam_parameter_info *info = &effect->parameters[j];
            if (info->role != BEAM_ROLE_LEVEL) {
                assert_int_equal(info->level_of, BEAM_LEVEL_OWN);
            } else if (info->level_of == BEAM_LEVEL_CHANNEL) {
                assert_int_not_equal(effect->channels, BEAM_CHANNELS_NONE);
            } else if (info->level_of != level_by_unit(effect, info->unit)) {
                fail_msg("%s %s: level_of and the unit %s contradict each other", effect->id, info->name, info->unit);
            }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_parameter_states_a_role_and_keeps_to_it),
        cmocka_unit_test(test_places_are_what_the_slots_name),
        cmocka_unit_test(test_levels_say_of_what),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
