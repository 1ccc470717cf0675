/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The answer of a fit, as JSON and as text. */
#include "show.h"
#include "estimate/estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- JSON ---- */

static const struct answer_field channel_fields[] = {
    ANSWER_ROW(TEXT, "name", "column of the record"),
    ANSWER_ROW(NUMBER, "nrmse", "norm of the misfit over norm of the signal"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data"),
    {0},
};

static const struct answer_field record_fields[] = {
    ANSWER_ROW(TEXT, "file", "the record"),
    ANSWER_ROW_OF(LIST, "channels", "one for each output", channel_fields),
    {0},
};

static const struct answer_field check_fields[] = {
    ANSWER_ROW_OF(LIST, "records", "that were held out", record_fields),
    ANSWER_ROW(NUMBER, "nrmse", "error: root mean square over channels of norm of the misfit over norm of the signal"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data (1: nothing is left to explain)"),
    ANSWER_ROW(TEXTS, "notes", "on how they disagree"),
    {0},
};

static const struct answer_field parameter_fields[] = {
    ANSWER_ROW(NUMBER, "value", "in SI units"),
    ANSWER_ROW(NUMBER, "sd", "standard error"),
    ANSWER_ROW(NUMBERS, "ci95", "interval of 95 %: from, to"),
    ANSWER_ROW(BOOL, "identifiable", "the records determine it"),
    ANSWER_ROW(BOOL, "held", "it was not estimated"),
    ANSWER_ROW(TEXT, "unit", "of the value"),
    ANSWER_ROW(NUMBER, "start", "of the fit"),
    {0},
};

static const struct answer_field null_fields[] = {
    ANSWER_ROW(NUMBER, "ratio", "of its singular value to the largest"),
    ANSWER_ROW(NUMBER_MAP, "parameters", "weight of each"),
    ANSWER_ROW(BOOL, "fixed_by_prior", "a prior determines it"),
    ANSWER_ROW(TEXT, "text", "in a sentence"),
    {0},
};

static const struct answer_field minimum_fields[] = {
    ANSWER_ROW(NUMBER, "noise_ratio", "there"),
    ANSWER_ROW(NUMBER_MAP, "parameters", "values there, in SI units"),
    {0},
};

const struct answer_field fit_fields[] = {
    ANSWER_ROW_OF(LIST, "records", "that were fitted", record_fields),
    ANSWER_ROW(NUMBER, "nrmse", "error: root mean square over channels of norm of the misfit over norm of the signal"),
    ANSWER_ROW(NUMBER, "noise_ratio", "misfit over the noise of the data (1: nothing is left to explain)"),
    {ANSWER_OBJECT, "attainable", "what the best linear model with as many modes leaves; null: not known",
     attainable_fields, ANSWER_NULL, NULL},
    {ANSWER_COUNT, "steps_per_sample", "that its laws need", NULL, ANSWER_MAYBE, NULL},
    ANSWER_ROW_OF(MAP, "parameters", "estimates by name", parameter_fields),
    ANSWER_ROW_OF(LIST, "null_directions", "what the records alone do not determine", null_fields),
    {ANSWER_NUMBER, "seconds", "the fit took", NULL, 0, "s"},
    ANSWER_ROW(COUNT, "evaluations", "of the model"),
    ANSWER_ROW(BOOL, "converged", "the optimum was reached"),
    ANSWER_ROW(BOOL, "fitted", "false: the records determine nothing, and no file was written"),
    ANSWER_ROW(NUMBER, "distance_sd", "from the optimum, in standard errors"),
    ANSWER_ROW(BOOL, "interrupted", "by Ctrl-C"),
    ANSWER_ROW(TEXT, "intersample", "what inputs do between samples"),
    {ANSWER_OBJECT, "check", "held-out records", check_fields, ANSWER_MAYBE, NULL},
    ANSWER_ROW_OF(LIST, "other_minima", "that the search found and left", minimum_fields),
    ANSWER_ROW(TEXTS, "warnings", "what was not tried or could not be judged, and what looks wrong"),
    ANSWER_ROW_OF(LIST, "channel_factors", "wrong signs and units of channels", channel_factor_fields),
    ANSWER_ROW_OF(LIST, "record_findings", "what is wrong with records before any model", record_finding_fields),
    {0},
};

static void put_records(struct json *parent, const struct record records[], size_t n,
                        const struct fit_channel_error channels[], size_t n_channels)
{
    struct json *list = json_put(parent, "records", json_new_array());
    for (size_t r = 0; r < n; r++) {
        struct json *record = json_push(list, json_new_object());
        json_put_text(record, "file", records[r].path ? records[r].path : "");
        struct json *array = json_put(record, "channels", json_new_array());
        for (size_t c = 0; c < n_channels; c++) {
            if (channels[c].record != r)
                continue;
            struct json *channel = json_push(array, json_new_object());
            json_put_text(channel, "name", channels[c].name);
            json_put_number(channel, "nrmse", channels[c].nrmse);
            json_put_number(channel, "noise_ratio", channels[c].noise_ratio);
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
    put_records(root, records, result->n_records, result->channels, result->n_channels);
    json_put_number(root, "nrmse", result->nrmse);
    json_put_number(root, "noise_ratio", result->noise_ratio);
    attainable_json(root, &result->attainable);
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
        put_records(held_out, check->records, check->n, check->channels, check->n_channels);
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

/* ---- Text ---- */

/* Left-justified in `width` columns; counts characters, not bytes (units hold '·' and '²'). */
static void print_padded(FILE *out, const char *text, int width)
{
    int used = 0;
    for (const char *c = text; *c; c++)
        used += (*c & 0xC0) != 0x80;
    fprintf(out, "%s%*s", text, used < width ? width - used : 1, "");
}

static int label_width(const struct fit_result *result)
{
    size_t width = strlen("parameter");
    for (size_t i = 0; i < result->n_parameters; i++) {
        const size_t length = strlen(result->parameters[i].label);
        width = length > width ? length : width;
    }
    return (int)width + 2;
}

static void print_estimate(FILE *out, const struct fit_parameter *p, int width, bool all)
{
    print_padded(out, p->label, width);
    print_padded(out, p->unit, 10);
    fprintf(out, "%-12.6g ", p->value);
    if (!p->estimated)
        fprintf(out, all ? "%-20s" : "%s", "held");
    else if (!p->identifiable)
        fprintf(out, all ? "%-20s" : "%s", "not identifiable");
    else
        fprintf(out, "± %-8.2g %7.3g %%", p->sd, fabs(100.0 * p->sd / p->value));
    if (all && p->estimated && p->identifiable)
        fprintf(out, "   %-11.5g … %-11.5g %.6g", p->ci95[0], p->ci95[1], p->start);
    else if (all)
        fprintf(out, "   %-25s %.6g", "", p->start);
    fprintf(out, "%s\n", p->at_bound ? " (at a bound)" : "");
}

/* The widest of these, beyond which `most` is enough. */
static size_t widest(size_t so_far, const char *text, size_t most)
{
    const size_t width = text_width(text);
    return width > so_far ? (width < most ? width : most) : so_far;
}

static void print_channels(FILE *out, const char *title, const struct record records[],
                           const struct fit_channel_error channels[], size_t n)
{
    size_t path_width = strlen("all (root mean square)"), name_width = 0;
    double nrmse, noise_ratio;
    char noise[120];
    fit_totals(channels, n, &nrmse, &noise_ratio);
    fprintf(out, "\n%s\n", title);
    for (size_t c = 0; c < n; c++) {
        path_width = widest(path_width, records[channels[c].record].path ? records[channels[c].record].path : "", 34);
        name_width = widest(name_width, channels[c].name, 16);
    }
    const size_t indent = 2 + path_width + 1 + name_width + 1;
    for (size_t c = 0; c < n; c++) {
        const struct record *record = &records[channels[c].record];
        (void)snprintf(noise, sizeof noise, "noise not seen");
        if (isfinite(channels[c].noise_ratio))
            (void)snprintf(noise, sizeof noise, "%.3f × noise", channels[c].noise_ratio);
        fputs("  ", out);
        text_print_padded(out, record->path ? record->path : "", path_width);
        fputc(' ', out);
        text_print_padded(out, channels[c].name, name_width);
        text_say(out, " ", 1, "error %.3f %%, %s", 100.0 * channels[c].nrmse, noise);
        if (channels[c].cut)
            text_say(out, "", 4, "first %.4g s of it: the rest cannot be predicted",
                     (double)channels[c].n * record->dt_s);
    }
    (void)snprintf(noise, sizeof noise, ", %.3f × noise", noise_ratio);
    text_say(out, "  all (root mean square)", indent, "error %.3f %%%s", 100.0 * nrmse,
             isfinite(noise_ratio) ? noise : "");
}

static void print_null_directions(FILE *out, const struct fit_result *result)
{
    const struct identifiability *id = &result->identifiability;
    const char **labels = unknown_labels(result);
    if (id->n_null > 0)
        fprintf(out, "\nWhat the records alone do not determine\n");
    for (size_t k = 0; k < id->n_null; k++) {
        char *text = identifiability_text(id->n, labels, &id->null[k]);
        text_say(out, "  -", 4, "%s.", text);
        free(text);
    }
    free(labels);
}

static void print_minima(FILE *out, const struct fit_result *result)
{
    if (result->n_minima > 0)
        fprintf(out, "\nOther minima that the search found and left\n");
    for (size_t k = 0; k < result->n_minima; k++) {
        char text[2000];
        size_t n = (size_t)snprintf(text, sizeof text, "%.3f × noise:", result->minima[k].noise_ratio);
        for (size_t i = 0; i < result->n_parameters && n < sizeof text; i++)
            if (result->parameters[i].estimated)
                n += (size_t)snprintf(text + n, sizeof text - n, " %s %.4g", result->parameters[i].label,
                                      result->minima[k].value[i]);
        text_say(out, "", 2, "%s", text);
    }
}

void fit_print(FILE *out, const struct fit_result *result, const struct record records[], const struct fit_check *check,
               bool all)
{
    const int width = label_width(result);
    print_padded(out, "parameter", width);
    fprintf(out, "%-10s%-13s%s\n", "unit", "value",
            all ? "standard error         95 % interval             start" : "standard error");
    for (size_t i = 0; i < result->n_parameters; i++)
        print_estimate(out, &result->parameters[i], width, all);
    for (size_t r = 0; r < result->n_records; r++)
        if (result->level[r] != 1.0)
            fprintf(out, "force level of %s: %.6g\n", result->names[r], result->level[r]);
    print_channels(out, "Fitted records", records, result->channels, result->n_channels);
    attainable_print(out, &result->attainable, result->nrmse);
    if (result->steps_per_sample > 0)
        (void)fprintf(out, "Its laws needed %d steps a sample; the model keeps that as steps_per_sample.\n",
                      result->steps_per_sample);
    if (check->n > 0)
        print_channels(out, "Held-out records", check->records, check->channels, check->n_channels);
    for (size_t k = 0; k < check->n_notes; k++)
        text_say(out, "", 2, "%s.", check->notes[k]);
    print_null_directions(out, result);
    print_minima(out, result);
    if (result->n_warnings > 0)
        fprintf(out, "\nWarnings\n");
    for (size_t k = 0; k < result->n_warnings; k++)
        text_say(out, "  -", 4, "%s%s", result->warnings[k],
                 result->warnings[k][strlen(result->warnings[k]) - 1] == '?' ? "" : ".");
    text_say(out, "\n", 0,
             "%s: %.2g standard errors from the optimum; %zu evaluations, %.2f s; inputs %s between samples.",
             result->converged ? "Converged" : "NOT CONVERGED", result->distance, result->evaluations, result->seconds,
             intersample_text(result->intersample));
}
