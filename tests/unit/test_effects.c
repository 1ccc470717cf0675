/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The catalogue as a whole: its names are a contract, its texts are for people, its effects vanish at neutral. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <cmocka.h>
#include "effects_draw.h"

/* Names that model files, commands and other programs use. */
static const struct {
    const char *id, *parameters[BEAM_EFFECT_PARAMETERS];
} contract[] = {
    {"axial_load", {"force_N"}},
    {"base_motion", {"amplitude_mps2", "phase_rad", "frequency_Hz"}},
    {"bilinear_stiffness", {"change_Nmprad", "at_m", "width_m"}},
    {"clock_error", {"relative"}},
    {"coulomb_friction", {"moment_Nm", "velocity_radps"}},
    {"cubic_stiffness", {"coefficient_Npm3", "at_m"}},
    {"drive_hysteresis", {"share", "slip_pV", "shape_pV"}},
    {"drive_saturation", {"level_V"}},
    {"electrical_coupling", {"stiffening_Nm2", "time_constant_s"}},
    {"feedthrough", {"gain"}},
    {"hysteretic_damping", {"loss_factor"}},
    {"input_position", {"shift_m"}},
    {"large_rotation", {"scale"}},
    {"mains_hum", {"amplitude", "phase_rad", "frequency_Hz"}},
    {"microslip", {"stiffness_Nmprad", "slip_Nm"}},
    {"patch_position", {"shift_m"}},
    {"patch_softening", {"coefficient_Nmprad2"}},
    {"point_damper", {"damping_Nspm", "at_m"}},
    {"point_mass", {"mass_kg", "at_m"}},
    {"point_spring", {"stiffness_Npm", "damping_Nspm", "at_m"}},
    {"quadratic_drag", {"coefficient_Ns2pm3"}},
    {"root_compliance", {"compliance_radpNm", "loss_s", "frequency_Hz"}},
    {"rotary_inertia", {"scale"}},
    {"sensor_delay", {"delay_s"}},
    {"sensor_highpass", {"tau_s"}},
    {"sensor_lag", {"tau_s"}},
    {"sensor_offset", {"offset", "drift_per_s"}},
    {"sensor_saturation", {"level"}},
    {"square_root_damping", {"coefficient_Ns"}},
    {"stop_contact", {"stiffness_Npm", "gap_m", "at_m"}},
    {"thermal_drift", {"rate_ps"}},
    {"tip_mass", {"mass_kg"}},
    {"viscoelastic", {"strength_Nm2", "relaxation_s"}},
};

static int index_of(const char *id)
{
    for (int e = 0; e < beam_effects_count; e++)
        if (strcmp(beam_effects[e]->id, id) == 0)
            return e;
    return -1;
}

static void test_catalogue_names_are_kept(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof contract / sizeof contract[0]; i++) {
        const int at = index_of(contract[i].id);
        if (at < 0)
            fail_msg("%s is not in the build", contract[i].id);
        const struct beam_effect *e = beam_effects[at];
        int n = 0;
        for (; n < BEAM_EFFECT_PARAMETERS && contract[i].parameters[n]; n++)
            if (n >= e->n_parameters || strcmp(e->parameters[n].name, contract[i].parameters[n]) != 0)
                fail_msg("%s: parameter %d must be %s", e->id, n, contract[i].parameters[n]);
        assert_int_equal(e->n_parameters, n);
    }
}

static void test_table_is_sorted_and_ended(void **state)
{
    (void)state;
    for (int e = 1; e < beam_effects_count; e++)
        assert_true(strcmp(beam_effects[e - 1]->id, beam_effects[e]->id) < 0);
    assert_null(beam_effects[beam_effects_count]);
}

/* Whatever a step calls says what that takes, or no bound of a step holds. */
static void test_costs_are_stated(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        const struct beam_effect *e = beam_effects[i];
        const int is_called = e->law || e->map || e->signal || e->drive || e->base;
        if (is_called != (e->step_instructions > 0))
            fail_msg("%s: .step_instructions is %u (measure it: make target NAMES=costs)", e->id, e->step_instructions);
    }
}

static int sentences(const char *text)
{
    int n = 0;
    for (const char *c = text; *c; c++)
        n += *c == '.' && (c[1] == ' ' || c[1] == '\0');
    return n;
}

static void test_texts_are_there(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        const struct beam_effect *e = beam_effects[i];
        const struct {
            const char *what, *text;
            size_t least;
        } texts[] = {{"title", e->title, 12},
                     {"form", e->form, 8},
                     {"source", e->source, 25},
                     {"looks_like", e->looks_like, 120},
                     {"confused_with", e->confused_with, 80},
                     {"target_cost", e->target_cost, 15}};
        for (size_t t = 0; t < sizeof texts / sizeof texts[0]; t++) {
            const char *text = texts[t].text ? texts[t].text : "";
            if (strlen(text) < texts[t].least)
                fail_msg("%s: %s is missing or too short", e->id, texts[t].what);
            if (strstr(text, "  ") || strchr(text, '\n'))
                fail_msg("%s: %s holds a double blank or a line break", e->id, texts[t].what);
        }
        if (sentences(e->looks_like) < 2)
            fail_msg("%s: looks_like wants at least two sentences", e->id);
        int rivals = 0;
        for (int other = 0; other < beam_effects_count; other++)
            rivals += other != i && strstr(e->confused_with, beam_effects[other]->id) != NULL;
        if (rivals == 0)
            fail_msg("%s: confused_with names no other effect of the catalogue", e->id);
    }
}

/* A word with an underscore in a text is an id, a parameter or a symbol; an id must exist. */
static void test_texts_name_only_effects_that_exist(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        char text[2048];
        snprintf(text, sizeof text, "%s %s", beam_effects[i]->looks_like, beam_effects[i]->confused_with);
        for (char *rest, *word = strtok_r(text, " ,.;:()", &rest); word; word = strtok_r(NULL, " ,.;:()", &rest))
            if (strlen(word) > 6 && strspn(word, "abcdefghijklmnopqrstuvwxyz_") == strlen(word) && strchr(word, '_') &&
                index_of(word) < 0)
                fail_msg("%s: its texts speak of %s, which does not exist", beam_effects[i]->id, word);
    }
}

static void test_parameters_are_sane(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        const struct beam_effect *e = beam_effects[i];
        assert_in_range(e->n_parameters, 1, BEAM_EFFECT_PARAMETERS);
        int strengths = 0;
        for (int j = 0; j < e->n_parameters; j++) {
            const struct beam_parameter_info *p = &e->parameters[j];
            if (!p->name || !p->unit || !p->what || strlen(p->what) < 8)
                fail_msg("%s: parameter %d lacks a name, a unit or an explanation", e->id, j);
            if (!(p->minimum < p->maximum) || !(p->minimum <= p->start) || !(p->start <= p->maximum) ||
                !isfinite(p->start))
                fail_msg("%s %s: range and start contradict each other", e->id, p->name);
            if (!(p->minimum <= p->neutral && p->neutral <= p->maximum))
                fail_msg("%s %s: the neutral value lies outside the range", e->id, p->name);
            if ((p->flags & BEAM_PARAMETER_LOG) && !(p->minimum > 0.0))
                fail_msg("%s %s: a logarithm wants a positive range", e->id, p->name);
            if (p->role == BEAM_ROLE_PLACE && (p->minimum < 0.0 || p->maximum > 1.0))
                fail_msg("%s %s: a position is a fraction of the length", e->id, p->name);
            if (!(p->flags & BEAM_PARAMETER_INNER)) {
                strengths++;
                if (p->start == p->neutral)
                    fail_msg("%s %s: a search that starts at neutral starts without the effect", e->id, p->name);
            }
        }
        if (strengths == 0)
            fail_msg("%s: no parameter can switch it off", e->id);
    }
}

static void test_channels_fit_the_slots(void **state)
{
    (void)state;
    for (int i = 0; i < beam_effects_count; i++) {
        const struct beam_effect *e = beam_effects[i];
        const int output = e->filter || e->map || e->signal;
        const int input = e->drive != NULL;
        const int on_output = e->channels == BEAM_CHANNELS_PATCH_OUTPUT || e->channels == BEAM_CHANNELS_EVERY_OUTPUT;
        const int on_input = e->channels == BEAM_CHANNELS_PATCH_INPUT || e->channels == BEAM_CHANNELS_POINT_INPUT;
        if (output != on_output || input != on_input)
            fail_msg("%s: default channels and slots do not fit", e->id);
        if ((e->law != NULL) != (e->law_place != NULL) || (e->terms != NULL) != (e->n_terms > 0) ||
            (e->axial_inertia != NULL && e->law == NULL))
            fail_msg("%s: half a slot", e->id);
        assert_in_range(e->n_terms, 0, BEAM_EFFECT_TERMS);
        assert_in_range(e->n_law_states, 0, BEAM_LAW_STATES);
    }
}

static void neutral(struct shadow_case *c)
{
    const struct beam_effect *e = beam_effects[c->effect];
    for (int j = 0; j < e->n_parameters; j++)
        if (!(e->parameters[j].flags & BEAM_PARAMETER_INNER))
            c->x[j] = e->parameters[j].neutral;
}

/* |(b1 s + b0) e^(−s d) − (a1 s + a0)| = 0 for every s. */
static int filter_is_identity(const double y[])
{
    return y[0] == y[2] && y[1] == y[3] && y[4] == 0.0 && (y[2] != 0.0 || y[3] != 0.0);
}

/* What hangs on the beam with a coordinate of its own keeps a nanogram: the coordinate is never without mass. */
static int has_own(const struct beam_effect *e)
{
    const struct beam_place place = {1.0, 0.0, 0.0};
    double p[BEAM_EFFECT_PARAMETERS];
    struct beam_term terms[BEAM_EFFECT_TERMS];
    memset(terms, 0, sizeof terms);
    for (int j = 0; j < BEAM_EFFECT_PARAMETERS; j++)
        p[j] = j < e->n_parameters ? e->parameters[j].start : 0.0;
    if (!e->terms || e->terms(p, &place, terms) != 0)
        return 0;
    for (int t = 0; t < e->n_terms; t++)
        if (terms[t].place.kind == BEAM_AT_OWN)
            return 1;
    return 0;
}

static int absent(const struct shadow_case *c, const struct shadow_answer *a)
{
    const double *y = a->y;
    switch (c->slot) {
    case SHADOW_TERMS:
        if (has_own(beam_effects[c->effect]))
            return y[0] <= 1e-9;
        for (int i = 0; i < a->n_out; i++)
            if (i % 6 < 4 && y[i] != 0.0 && !beam_effects[c->effect]->releases_root)
                return 0;
        /* a released clamp is absent when it is rigid, not when it is soft */
        return !beam_effects[c->effect]->releases_root || y[2] >= 1e6;
    case SHADOW_LAW:
        return y[0] == 0.0 && y[1] == 0.0;
    case SHADOW_FILTER:
        return filter_is_identity(y);
    case SHADOW_MAP:
    case SHADOW_SIGNAL:
    case SHADOW_DRIVE:
        return y[0] == c->x[SHADOW_P];
    case SHADOW_BASE:
    case SHADOW_AXIAL_INERTIA:
        return y[0] == 0.0;
    case SHADOW_GEOMETRY:
        return y[0] == 0.0 && y[1] == 0.0 && y[2] == 0.0;
    default:
        return 1;
    }
}

static void test_effects_are_absent_at_neutral_and_present_at_start(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        uint64_t seed = 4711 + (uint64_t)e;
        int present = 0;
        for (int slot = 0; slot < SHADOW_SLOTS; slot++)
            for (int k = 0; k < 200; k++) {
                struct shadow_case c = draw_case(e, (enum shadow_slot)slot, &seed);
                struct shadow_answer a;
                beam_shadow(&c, &a);
                if (a.status != 0)
                    continue;
                present += !absent(&c, &a);
                neutral(&c);
                beam_shadow(&c, &a);
                if (a.status != 0 || !absent(&c, &a))
                    fail_msg("%s: still there at its neutral values (slot %d)", beam_effects[e]->id, slot);
                for (int i = 0; i < a.n_out; i++)
                    for (int j = 0; j < a.n_in; j++)
                        if (!isfinite(a.slope[i][j]))
                            fail_msg("%s: derivative %d/%d is not finite at neutral", beam_effects[e]->id, i, j);
            }
        if (present < 50)
            fail_msg("%s: does nothing at ordinary values either", beam_effects[e]->id);
    }
}

/* What INNER promises: while the others are neutral, an inner parameter moves nothing but places. */
static void test_inner_parameters_do_nothing_at_neutral(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++) {
        if (has_own(beam_effects[e]))
            continue;
        if (beam_effects[e]->releases_root)
            continue; /* its neutral value is a rigid clamp, a large number, and a loss scales it */
        uint64_t seed = 31 + (uint64_t)e;
        for (int slot = 0; slot < SHADOW_SLOTS; slot++) {
            struct shadow_case c = draw_case(e, (enum shadow_slot)slot, &seed);
            struct shadow_answer a;
            neutral(&c);
            beam_shadow(&c, &a);
            for (int j = 0; a.status == 0 && j < beam_effects[e]->n_parameters; j++) {
                if (!(beam_effects[e]->parameters[j].flags & BEAM_PARAMETER_INNER))
                    continue;
                const int outputs = slot == SHADOW_LAW ? BEAM_LAW_WIDTH : slot == SHADOW_DRIVE ? 1 : a.n_out;
                for (int i = 0; i < outputs; i++)
                    if (slot != SHADOW_LAW_PLACE && !(slot == SHADOW_TERMS && i % 6 >= 4) && a.slope[i][j] != 0.0)
                        fail_msg("%s %s acts at neutral", beam_effects[e]->id, beam_effects[e]->parameters[j].name);
            }
        }
    }
}

static void test_places_off_the_beam_are_refused(void **state)
{
    (void)state;
    for (int e = 0; e < beam_effects_count; e++)
        for (int j = 0; j < beam_effects[e]->n_parameters; j++) {
            if (beam_effects[e]->parameters[j].role != BEAM_ROLE_PLACE)
                continue;
            uint64_t seed = 5;
            for (int slot = SHADOW_TERMS; slot <= SHADOW_LAW_PLACE; slot++)
                for (int end = 0; end < 2; end++) {
                    struct shadow_case c = draw_case(e, (enum shadow_slot)slot, &seed);
                    struct shadow_answer a;
                    c.x[j] = end ? 1.01 * c.length_m : -0.01 * c.length_m;
                    beam_shadow(&c, &a);
                    if (a.status == 0)
                        fail_msg("%s accepts %s = %g on a beam of %g m", beam_effects[e]->id,
                                 beam_effects[e]->parameters[j].name, c.x[j], c.length_m);
                }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_catalogue_names_are_kept),
        cmocka_unit_test(test_table_is_sorted_and_ended),
        cmocka_unit_test(test_costs_are_stated),
        cmocka_unit_test(test_texts_are_there),
        cmocka_unit_test(test_texts_name_only_effects_that_exist),
        cmocka_unit_test(test_parameters_are_sane),
        cmocka_unit_test(test_channels_fit_the_slots),
        cmocka_unit_test(test_effects_are_absent_at_neutral_and_present_at_start),
        cmocka_unit_test(test_inner_parameters_do_nothing_at_neutral),
        cmocka_unit_test(test_places_off_the_beam_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
