/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of a fit. */
#include "show.h"
#include "estimate/estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "column of the record", .text = "channel"),
    ANSWER_ROW(NUMBER, "nrmse", "norm of the misfit over norm of the signal", .flags = ANSWER_PERCENT, .digits = -3,
               .text = "error"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data; null: the noise is not seen", .digits = -3,
               .text = "× noise"),
    ANSWER_ROW(NUMBER, "predicted_s", "so much of the record: the rest cannot be predicted", .flags = ANSWER_MAYBE,
               .digits = 4),
    ANSWER_CELL("", "[first {predicted_s} of it: the rest cannot be predicted]"),
    {0},
};

static const struct answer_field record_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record", .flags = ANSWER_BASE, .text = "record"),
    ANSWER_ROW(NUMBER, "level", "of the force, where it was solved for", .flags = ANSWER_MAYBE, .digits = 6,
               .text = "level of the force"),
    ANSWER_ROW_OF(LIST, "channels", "one for each output", channel_fields, .flags = ANSWER_TABLE),
    {0},
};

#define TOTALS                                                                                                         \
    ANSWER_ROW(NUMBER, "nrmse", "error: root mean square over channels of norm of the misfit over norm of the signal", \
               .flags = ANSWER_PERCENT, .digits = -3),                                                                 \
        ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data (1: nothing is left to explain)",         \
                   .digits = -3),                                                                                      \
        ANSWER_SAY("all (root mean square): error {nrmse}[, {noise_ratio} × noise]")

static const struct answer_field check_fields[] = {
    ANSWER_ROW_OF(LIST, "records", "that were held out", record_fields, .flags = ANSWER_TABLE, .text = ""),
    TOTALS,
    ANSWER_ROW(TEXTS, "notes", "on how they disagree", .text = ""),
    {0},
};

static const struct answer_field parameter_fields[] = {
    ANSWER_CELL("parameter", "{@}"),
    ANSWER_ROW(TEXT, "unit", "of the value", .text = "unit"),
    ANSWER_ROW(NUMBER, "value", "in SI units", .digits = 6, .error = "sd", .instead = "{held?held|not identifiable}",
               .text = "value"),
    ANSWER_ROW(NUMBER, "sd", "standard error; null: held, or not identifiable"),
    ANSWER_ROW(NUMBERS, "ci95", "interval of 95 %: from, to"),
    ANSWER_CELL("95 % from", "[{ci95.0}]", .flags = ANSWER_ALL),
    ANSWER_CELL("to", "[{ci95.1}]", .flags = ANSWER_ALL),
    ANSWER_ROW(NUMBER, "start", "of the fit", .digits = 6, .flags = ANSWER_ALL, .text = "start"),
    ANSWER_ROW(BOOL, "identifiable", "the records determine it"),
    ANSWER_ROW(BOOL, "held", "it was not estimated"),
    ANSWER_ROW(BOOL, "at_bound", "of its range"),
    ANSWER_CELL("", "{at_bound?at a bound|}"),
    {0},
};

static const struct answer_field null_fields[] = {
    ANSWER_ROW(NUMBER, "ratio", "of its singular value to the largest"),
    ANSWER_ROW(NUMBER_MAP, "parameters", "weight of each"),
    ANSWER_ROW(BOOL, "fixed_by_prior", "a prior determines it"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    ANSWER_SAY("- {text}."),
    {0},
};

static const struct answer_field minimum_fields[] = {
    ANSWER_ROW(NUMBER, "noise_ratio", "there", .digits = -3),
    ANSWER_ROW(NUMBER_MAP, "parameters", "values there, in SI units", .digits = 4),
    ANSWER_SAY("- {noise_ratio} × noise: {parameters}"),
    {0},
};

#define RESULT                                                                                                         \
    ANSWER_ROW_OF(LIST, "null_directions", "what the records alone do not determine", null_fields,                     \
                  .text = "\nWhat the records alone do not determine"),                                                \
        ANSWER_ROW_OF(LIST, "other_minima", "that the search found and left", minimum_fields,                          \
                      .text = "\nOther minima that the search found and left"),                                        \
        ANSWER_ROW(TEXTS, "warnings", "what was not tried or could not be judged, and what looks wrong",               \
                   .text = "\nWarnings"),                                                                              \
        ANSWER_ROW(NUMBER, "seconds", "the fit took", .unit = "s", .digits = -2),                                      \
        ANSWER_ROW(COUNT, "evaluations", "of the model"), ANSWER_ROW(BOOL, "converged", "the optimum was reached"),    \
        ANSWER_ROW(BOOL, "fitted", "false: the records determine nothing, and no file was written"),                   \
        ANSWER_ROW(NUMBER, "distance_sd", "from the optimum, in standard errors", .digits = 2),                        \
        ANSWER_ROW(BOOL, "interrupted", "by Ctrl-C"),                                                                  \
        ANSWER_ROW(TEXT, "intersample", "what inputs do between samples"),                                             \
        ANSWER_SAY(                                                                                                    \
            "\n{converged?Converged|NOT CONVERGED}: {distance_sd} standard errors from the optimum; {evaluations} "    \
            "evaluations, {seconds}; inputs {intersample} between samples.")

const struct answer_field fit_fields[] = {
    ANSWER_RECORDS_FIRST,
    ANSWER_ROW_OF(MAP, "parameters", "estimates by name", parameter_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(LIST, "records", "that were fitted", record_fields, .flags = ANSWER_TABLE,
                  .text = "\nFitted records"),
    TOTALS,
    ANSWER_ROW_OF(OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
                  attainable_fields, .flags = ANSWER_NULL, .text = ""),
    ANSWER_ROW(COUNT, "steps_per_sample", "that its laws need", .flags = ANSWER_MAYBE),
    ANSWER_SAY("[Its laws needed {steps_per_sample} steps a sample; the model keeps that as steps_per_sample.]"),
    ANSWER_ROW_OF(OBJECT, "check", "held-out records", check_fields, .flags = ANSWER_MAYBE,
                  .text = "\nHeld-out records"),
    RESULT,
    ANSWER_ROW_OF(LIST, "repeatability", "", repeatability_floor_fields, .flags = ANSWER_AGAIN, .text = ""),
    {0},
};

const struct answer_field fit_shared_fields[] = {
    ANSWER_ROW_OF(MAP, "parameters", "estimates by name", parameter_fields, .flags = ANSWER_TABLE, .text = ""),
    ANSWER_ROW_OF(LIST, "records", "that were fitted", record_fields),
    ANSWER_SAY("\n{records#} {records#record|records}"),
    TOTALS,
    ANSWER_ROW_OF(OBJECT, "attainable", "not computed", attainable_fields, .flags = ANSWER_NULL),
    ANSWER_ROW_OF(LIST, "worst", "the records with the largest misfit over noise, ten at most", record_fields,
                  .flags = ANSWER_TABLE, .text = "\nLargest misfits"),
    RESULT,
    {0},
};

static void put_records(struct json *parent, const char *name, const struct record records[], size_t n,
                        const struct fit_channel_error channels[], size_t n_channels, const double level[])
{
    struct json *list = json_put(parent, name, json_new_array());
    for (size_t r = 0; r < n; r++) {
        struct json *record = json_push(list, json_new_object());
        json_put_text(record, "file", records[r].path ? records[r].path : "");
        if (level != NULL && (level[r] < 1.0 || level[r] > 1.0))
            json_put_number(record, "level", level[r]);
        struct json *array = json_put(record, "channels", json_new_array());
        for (size_t c = 0; c < n_channels; c++) {
            if (channels[c].record != r)
                continue;
            struct json *channel = json_push(array, json_new_object());
            json_put_text(channel, "name", channels[c].name);
            json_put_number(channel, "nrmse", channels[c].nrmse);
            json_put_number(channel, "noise_ratio", channels[c].noise_ratio);
            if (channels[c].cut)
                json_put_number(channel, "predicted_s", (double)channels[c].n * records[r].dt_s);
        }
    }
}

static void put_parameters(struct json *root, const struct fit_result *result)
{
    struct json *all = json_put(root, "parameters", json_new_object());
    for (size_t i = 0; i < result->n_parameters; i++) {
        const struct fit_parameter *p = &result->parameters[i];
        struct json *one = json_put(all, p->label, json_new_object());
        json_put_number(one, "value", p->value);
        json_put_number(one, "sd", p->sd);
        struct json *ci = json_put(one, "ci95", json_new_array());
        json_push_number(ci, p->ci95[0]);
        json_push_number(ci, p->ci95[1]);
        json_put_bool(one, "identifiable", p->identifiable);
        json_put_bool(one, "held", !p->estimated);
        json_put_bool(one, "at_bound", p->at_bound);
        json_put_text(one, "unit", p->unit);
        json_put_number(one, "start", p->start);
    }
}

static const char **unknown_labels(const struct fit_result *result)
{
    const char **labels = bf_alloc(result->identifiability.n, sizeof *labels);
    for (size_t i = 0; i < result->identifiability.n; i++)
        labels[i] = result->parameters[result->unknown[i]].label;
    return labels;
}

static void put_null_directions(struct json *root, const struct fit_result *result)
{
    static const double smallest = 1e-3;
    const struct identifiability *id = &result->identifiability;
    const char **labels = unknown_labels(result);
    struct json *list = json_put(root, "null_directions", json_new_array());
    for (size_t k = 0; k < id->n_null; k++) {
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "ratio", id->null[k].ratio);
        struct json *weights = json_put(one, "parameters", json_new_object());
        for (size_t i = 0; i < id->n; i++)
            if (fabs(id->null[k].weight[i]) >= smallest)
                json_put_number(weights, labels[i], id->null[k].weight[i]);
        json_put_bool(one, "fixed_by_prior", id->null[k].pinned);
        char *text = identifiability_text(id->n, labels, &id->null[k]);
        json_put_text(one, "text", text);
        free(text);
    }
    free(labels);
}

static const char *intersample_text(enum intersample intersample)
{
    switch (intersample) {
    case INTERSAMPLE_ZERO_ORDER_HOLD:
        return "zero-order hold";
    case INTERSAMPLE_FIRST_ORDER_HOLD:
        return "first-order hold";
    case INTERSAMPLE_BAND_LIMITED:
        break;
    }
    return "band-limited";
}

static void put_minima(struct json *root, const struct fit_result *result)
{
    struct json *list = json_put(root, "other_minima", json_new_array());
    for (size_t k = 0; k < result->n_minima; k++) {
        struct json *one = json_push(list, json_new_object());
        json_put_number(one, "noise_ratio", result->minima[k].noise_ratio);
        struct json *values = json_put(one, "parameters", json_new_object());
        for (size_t i = 0; i < result->n_parameters; i++)
            if (result->parameters[i].estimated)
                json_put_number(values, result->parameters[i].label, result->minima[k].value[i]);
    }
}

struct json *fit_json(const struct fit_result *result, const struct record records[], const struct fit_check *check)
{
    struct json *root = json_new_object();
    put_records(root, "records", records, result->n_records, result->channels, result->n_channels, result->level);
    json_put_number(root, "nrmse", result->nrmse);
    json_put_number(root, "noise_ratio", result->noise_ratio);
    attainable_json(root, &result->attainable, result->nrmse);
    if (result->steps_per_sample > 0)
        json_put_number(root, "steps_per_sample", (double)result->steps_per_sample);
    put_parameters(root, result);
    put_null_directions(root, result);
    json_put_number(root, "seconds", result->seconds);
    json_put_number(root, "evaluations", (double)result->evaluations);
    json_put_bool(root, "converged", result->converged);
    json_put_bool(root, "fitted", fit_learned(result));
    json_put_number(root, "distance_sd", result->distance);
    json_put_bool(root, "interrupted", result->interrupted);
    json_put_text(root, "intersample", intersample_text(result->intersample));
    if (check->n > 0) {
        struct json *held_out = json_put(root, "check", json_new_object());
        double nrmse, noise_ratio;
        fit_totals(check->channels, check->n_channels, &nrmse, &noise_ratio);
        put_records(held_out, "records", check->records, check->n, check->channels, check->n_channels, NULL);
        json_put_number(held_out, "nrmse", nrmse);
        json_put_number(held_out, "noise_ratio", noise_ratio);
        struct json *notes = json_put(held_out, "notes", json_new_array());
        for (size_t k = 0; k < check->n_notes; k++)
            json_push_text(notes, check->notes[k]);
    }
    put_minima(root, result);
    struct json *warnings = json_put(root, "warnings", json_new_array());
    for (size_t k = 0; k < result->n_warnings; k++)
        json_push_text(warnings, result->warnings[k]);
    return root;
}

/* ---- Of many records ---- */

/* Σ (misfit/noise)² of each record, [n_records]; where the noise is not seen, of its error. */
static double *misfits_of(const struct fit_result *result)
{
    double *sum = bf_alloc(result->n_records, sizeof *sum);
    for (size_t c = 0; c < result->n_channels; c++) {
        const struct fit_channel_error *e = &result->channels[c];
        sum[e->record] += isfinite(e->noise_ratio) ? e->noise_ratio * e->noise_ratio : e->nrmse * e->nrmse;
    }
    return sum;
}

struct json *fit_shared_json(const struct fit_result *result, const struct record records[])
{
    enum { WORST = 10 };
    const struct fit_check none = {.n = 0};
    struct json *root = fit_json(result, records, &none);
    double *misfit = misfits_of(result);
    struct record worst[WORST];
    struct fit_channel_error *channels = bf_alloc(result->n_channels, sizeof *channels);
    size_t n = 0, n_channels = 0;
    for (; n < WORST && n < result->n_records; n++) {
        size_t most = 0;
        for (size_t r = 1; r < result->n_records; r++)
            most = misfit[r] > misfit[most] ? r : most;
        misfit[most] = -1.0;
        worst[n] = records[most];
        for (size_t c = 0; c < result->n_channels; c++)
            if (result->channels[c].record == most) {
                channels[n_channels] = result->channels[c];
                channels[n_channels++].record = n;
            }
    }
    put_records(root, "worst", worst, n, channels, n_channels, NULL);
    free(misfit), free(channels);
    return root;
}
