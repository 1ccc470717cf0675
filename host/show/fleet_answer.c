/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The population of a fleet as an answer. */
#include "fleet_words.h"
#include "show.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST_POOR = 10, SPREAD_TEXT = 48 };
static const double worth_saying = 0.1; /* share that a unit borrows */

static const struct answer_field unit_parameter_fields[] = {
    ANSWER_ROW(NUMBER, "value", "with what the fleet knows; of a logarithmic parameter too in its own unit"),
    ANSWER_ROW(NUMBER, "sd", "its standard error; relative where the parameter is logarithmic"),
    ANSWER_ROW(NUMBER, "borrowed", "share that the fleet decides: 0 the unit alone, 1 the fleet alone"),
    {0},
};
static const struct answer_field unit_fields[] = {
    ANSWER_ROW(TEXT, "unit", "name"),
    ANSWER_ROW_OF(MAP, "parameters", "by name", unit_parameter_fields),
    ANSWER_ROW(TEXT, "most_borrowed", "the parameter that borrows most"),
    ANSWER_ROW(NUMBER, "most_share", "of it that is borrowed", .flags = ANSWER_PERCENT, .digits = 2),
    ANSWER_ROW(BOOL, "borrows", "that is worth saying"),
    ANSWER_CELL("", "  {unit} borrows {most_share} of {most_borrowed} from the fleet"),
    {0},
};
static const struct answer_field parameter_fields[] = {
    ANSWER_CELL("over the fleet", "{@}"),
    ANSWER_ROW(NUMBER, "mean", "over the fleet; of a logarithmic parameter the geometric one", .text = "mean"),
    ANSWER_ROW(NUMBER, "sd", "standard error of the mean", .digits = 2, .text = "± se"),
    ANSWER_ROW(TEXT, "unit", "of the mean, SI", .text = "unit"),
    ANSWER_ROW(TEXT, "spread_text", "the spread for a person: in that unit, or in % where relative", .text = "spread"),
    ANSWER_ROW(NUMBER, "spread", "standard deviation over the units, their own errors taken off"),
    ANSWER_ROW(BOOL, "relative", "the spread is of the logarithm"),
    ANSWER_ROW(NUMBERS, "correlation", "with the parameters in their order"),
    {0},
};
static const struct answer_field outlier_fields[] = {
    ANSWER_ROW(TEXT, "unit", "name"),
    ANSWER_ROW(TEXT, "parameter", "that is furthest off"),
    ANSWER_ROW(NUMBER, "deviation", "of it from the mean, in spreads"),
    ANSWER_ROW(NUMBER, "p_value", "of the unit as a whole, once for all units"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    ANSWER_SAY("  {text}"),
    {0},
};
static const struct answer_field drift_fields[] = {
    ANSWER_ROW(TEXT, "parameter", "that drifts"),
    ANSWER_ROW(TEXT, "column", "of the manifest"),
    ANSWER_ROW(NUMBER, "slope", "for each unit of the column, a day of a date; of the logarithm where relative"),
    ANSWER_ROW(NUMBER, "sd", "its standard error"),
    ANSWER_ROW(NUMBER, "p_value", "once for all pairs"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    ANSWER_SAY("{text}"),
    {0},
};
static const struct answer_field effect_fields[] = {
    ANSWER_ROW(TEXT, "effect", "id"),
    ANSWER_ROW(TEXTS, "units", "in which it is missing"),
    ANSWER_ROW(TEXT, "parameter", "its first one"),
    ANSWER_ROW(NUMBER, "mean", "of it over these units, SI"),
    ANSWER_ROW(NUMBER, "sd", "standard error of the mean"),
    ANSWER_ROW(NUMBER, "spread", "over these units, their own errors taken off"),
    {0},
};
const struct answer_field population_fields[] = {
    ANSWER_ROW(COUNT, "units", "of the manifest"),
    ANSWER_ROW(COUNT, "failed", "without a result"),
    ANSWER_ROW(COUNT, "used", "in the population: without those that stand out"),
    ANSWER_ROW(TEXT, "why_not", "there is no population", .flags = ANSWER_NULL),
    ANSWER_ROW(NUMBER, "false_alarm_rate", "of one outlier, and of one drift, in a fleet without"),
    ANSWER_SAY("{units} units, {failed} without a result."),
    ANSWER_SAY("[{text}]"),
    ANSWER_SAY("[No population: {why_not}.]"),
    ANSWER_ROW_OF(MAP, "parameters", "of the population, by name", parameter_fields, .flags = ANSWER_TABLE,
                  .text = "\n"),
    ANSWER_ROW_OF(LIST, "estimates", "of each unit with what the fleet knows", unit_fields, .flags = ANSWER_TABLE,
                  .row = "borrows", .most = MOST_POOR, .text = ""),
    ANSWER_SAY("[{why_not!}\n{outliers?|No unit stands out.}]"),
    ANSWER_SAY("[{outliers?}{outliers#} {outliers#unit stands|units stand} out:]"),
    ANSWER_ROW_OF(LIST, "outliers", "units that differ", outlier_fields, .text = ""),
    ANSWER_ROW_OF(LIST, "drifts", "that are significant", drift_fields, .text = ""),
    ANSWER_ROW(TEXT, "alarm_text", "what the rate of false alarms means for this fleet"),
    ANSWER_SAY("[{alarm_text}]"),
    ANSWER_ROW(COUNT, "diagnosed", "units"),
    ANSWER_ROW(COUNT, "complete", "of those"),
    ANSWER_ROW_OF(LIST, "effects", "that are missing, the most frequent first", effect_fields),
    ANSWER_ROW(TEXT, "text", "what the diagnoses say together"),
    {0},
};

static void put_parameters(struct json *root, const struct fleet_population *p)
{
    struct json *all = json_put(root, "parameters", json_new_object());
    const size_t n = p->estimates.p;
    for (size_t k = 0; k < n && p->has_mixed; k++) {
        const struct fleet_value_words v = fleet_parameter(p, k);
        struct json *one = json_put(all, p->estimates.parameters[k], json_new_object());
        json_put_number(one, "mean", v.mean);
        json_put_number(one, "sd", v.sd);
        json_put_number(one, "spread", v.spread);
        char text[SPREAD_TEXT];
        (void)snprintf(text, sizeof text, "%.3g %s", (v.relative ? 100.0 : 1.0) * v.spread,
                       v.relative ? "%" : p->estimates.si_units[k]);
        json_put_text(one, "unit", p->estimates.si_units[k]);
        json_put_text(one, "spread_text", text);
        json_put_bool(one, "relative", v.relative);
        struct json *row = json_put(one, "correlation", json_new_array());
        for (size_t j = 0; j < n; j++)
            json_push_number(row, p->mixed.spread[k + j * n] /
                                      sqrt(p->mixed.spread[k + k * n] * p->mixed.spread[j + j * n]));
    }
}

static void put_unit(struct json *list, const struct fleet_population *p, size_t i, double work[])
{
    const struct fleet_estimates *e = &p->estimates;
    double *best = work, *sd = work + e->p, *borrowed = work + 2 * e->p;
    struct bf_error ignored;
    if (fleet_mixed_unit(e, &p->mixed, i, best, sd, borrowed, &ignored) != BF_OK)
        return;
    struct json *one = json_push(list, json_new_object());
    json_put_text(one, "unit", e->units[i]);
    struct json *all = json_put(one, "parameters", json_new_object());
    size_t most = 0;
    for (size_t k = 0; k < e->p; k++) {
        most = borrowed[k] > borrowed[most] ? k : most;
        struct json *parameter = json_put(all, e->parameters[k], json_new_object());
        json_put_number(parameter, "value", e->logarithmic[k] ? exp(best[k]) : best[k]);
        json_put_number(parameter, "sd", sd[k]);
        json_put_number(parameter, "borrowed", borrowed[k]);
    }
    json_put_text(one, "most_borrowed", e->parameters[most]);
    json_put_number(one, "most_share", borrowed[most]);
    json_put_bool(one, "borrows", borrowed[most] >= worth_saying);
}

static void put_findings(struct json *root, const struct fleet_population *p)
{
    const struct fleet_estimates *e = &p->estimates;
    char text[FLEET_SENTENCE];
    struct json *outliers = json_put(root, "outliers", json_new_array());
    for (size_t i = 0; i < p->n_outliers; i++) {
        struct json *one = json_push(outliers, json_new_object());
        json_put_text(one, "unit", e->units[p->outliers[i].unit]);
        json_put_text(one, "parameter", e->parameters[p->outliers[i].parameter]);
        json_put_number(one, "deviation", p->outliers[i].deviation);
        json_put_number(one, "p_value", p->outliers[i].p_value);
        fleet_outlier_words(p, &p->outliers[i], text);
        json_put_text(one, "text", text);
    }
    struct json *drifts = json_put(root, "drifts", json_new_array());
    for (size_t i = 0; i < p->n_drifts; i++) {
        struct json *one = json_push(drifts, json_new_object());
        json_put_text(one, "parameter", e->parameters[p->drifts[i].parameter]);
        json_put_text(one, "column", p->drifts[i].column);
        json_put_number(one, "slope", p->drifts[i].slope);
        json_put_number(one, "sd", p->drifts[i].sd);
        json_put_number(one, "p_value", p->drifts[i].p_value);
        fleet_drift_words(p, &p->drifts[i], text);
        json_put_text(one, "text", text);
    }
    text[0] = '\0';
    if (p->has_mixed)
        fleet_alarm_words(p, text);
    json_put_text(root, "alarm_text", text);
}

static void put_diagnosis(struct json *root, const struct fleet_population *p)
{
    char text[FLEET_SENTENCE];
    json_put_number(root, "diagnosed", (double)p->n_diagnosed);
    json_put_number(root, "complete", (double)p->n_verdicts[0]);
    struct json *effects = json_put(root, "effects", json_new_array());
    for (size_t k = 0; k < p->n_effects; k++) {
        const struct fleet_effect *e = &p->effects[k];
        struct json *one = json_push(effects, json_new_object());
        json_put_text(one, "effect", e->id);
        struct json *units = json_put(one, "units", json_new_array());
        for (size_t i = 0; i < e->n; i++)
            json_push_text(units, p->diagnosed[e->units[i]]);
        json_put_text(one, "parameter", e->parameter);
        json_put_number(one, "mean", e->mean);
        json_put_number(one, "sd", e->sd);
        json_put_number(one, "spread", e->spread);
    }
    fleet_diagnosis_words(p, text);
    json_put_text(root, "text", text);
}

struct json *population_json(const struct fleet_population *p)
{
    struct json *root = json_new_object();
    double *work = bf_alloc(3 * p->estimates.p, sizeof *work);
    json_put_number(root, "units", (double)p->n_units);
    json_put_number(root, "failed", (double)p->n_failed);
    json_put_number(root, "used", p->has_mixed ? (double)p->mixed.n : 0.0);
    json_put_text(root, "why_not", p->why_not);
    json_put_number(root, "false_alarm_rate", p->false_alarm_rate);
    put_parameters(root, p);
    struct json *units = json_put(root, "estimates", json_new_array());
    for (size_t i = 0; i < p->estimates.n && p->has_mixed; i++)
        put_unit(units, p, i, work);
    put_findings(root, p);
    put_diagnosis(root, p);
    free(work);
    return root;
}
