/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "model/model.h"

static const struct answer_field parameter_fields[] = {
    ANSWER_ROW(NUMBER, "value", "in SI units", .digits = 9),
    ANSWER_ROW(TEXT, "unit", "of the value"),
    ANSWER_ROW(BOOL, "fixed", "held in fits"),
    ANSWER_ROW(BOOL, "per_record", "it has a value of its own in each record"),
    ANSWER_SAY("  {@} = {value}[ {unit}], {fixed?held|free in the next fit}[{per_record?}, another in each record]"),
    {0},
};

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(TEXT, "effect", "its id"),
    ANSWER_ROW(TEXT, "title", "in words"),
    ANSWER_SAY("{file}: {effect}, {title}"),
    ANSWER_ROW_OF(MAP, "parameters", "of the effect, as the file has them", parameter_fields, .text = ""),
    {0},
};

static const char help[] =
    "Usage: beamfit add MODEL ID [--at X] [--channel NAME] [NAME[@RECORD]=VALUE...] -o NEW\n"
    "\n"
    "Adds a physical effect to a model. Its parameters start small, at the values of the catalogue, and are free\n"
    "in the next fit, except places, which are held. Comments and order of the file are kept; standard errors and\n"
    "the results of the last fit are left out, because they do not describe the new model.\n";

static const struct option_row options[] = {
    {.name = "NAME=VALUE", .what = "a parameter's value in SI units, NAME as in the catalogue (`beamfit effects ID`)"},
    {.name = "NAME@RECORD=VALUE",
     .what = "its value in one record, named as its file: it differs from record to record"},
    {'a', 0, "at", "X", NULL, "where on the beam, metres from the clamp (the same as at_m=X)"},
    {'c', 0, "channel", "NAME", NULL,
     "the input or output on which a measurement effect sits (default: as the catalogue says)"},
    {'x', 0, "fix", "NAME", NULL, "hold this parameter in fits (again for more)"},
    {'f', 0, "free", "NAME", NULL, "let fits change this parameter, e.g. a place (again for more)"},
    {'r', 0, "per-record", "NAME", NULL,
     "this parameter differs from record to record: a fit gives each its own value (again for more)"},
    {'o', 'o', "output", "NEW", NULL, "the file to write; - is standard output"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace NEW even when `add` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example:\n"
    "  beamfit add fitted.yaml point_mass --at 0.44 mass_kg=0.0005 -o with_mass.yaml\n"
    "\n"
    "Exit status: 0 done; 2 usage, no such effect, or the model has it already; 3 bad model file or NEW not\n"
    "writable.\n";

enum { MOST_SETTINGS = 256 };

/* NAME=VALUE, or NAME@RECORD=VALUE: n_record 0, it is of all records. */
struct setting {
    const char *name, *record;
    size_t n_name, n_record;
    double value;
};

struct arguments {
    const char *model, *id, *output, *channel;
    size_t n_values, n_fixed;
    struct setting values[MOST_SETTINGS];
    struct {
        const char *name;
        bool fixed;
    } fixed[MOST_SETTINGS];
    size_t n_by_record;
    const char *by_record[BEAM_EFFECT_PARAMETERS];
};

static enum bf_status take_value(struct arguments *a, const char *name, size_t n_name, const char *value,
                                 struct bf_error *err)
{
    if (a->n_values == MOST_SETTINGS)
        return bf_fail(err, BF_USAGE, "more than %d values", MOST_SETTINGS);
    struct setting *own = &a->values[a->n_values++];
    const char *at = memchr(name, '@', n_name);
    *own = (struct setting){.name = name, .n_name = at ? (size_t)(at - name) : n_name};
    if (at) {
        own->record = at + 1;
        own->n_record = n_name - own->n_name - 1;
        if (own->n_record == 0)
            return bf_fail(err, BF_USAGE, "'%.*s' names no record after @", (int)n_name, name);
    }
    char option[80];
    (void)snprintf(option, sizeof option, "%.*s", (int)n_name, name);
    return options_number(option, value, &own->value, err);
}

static enum bf_status take_option(struct arguments *a, int code, struct bf_error *err)
{
    switch (code) {
    case 'a':
        return take_value(a, "at_m", strlen("at_m"), optarg, err);
    case 'c':
        a->channel = optarg;
        return BF_OK;
    case 'o':
        a->output = optarg;
        return BF_OK;
    case 'x':
    case 'f':
        if (a->n_fixed == MOST_SETTINGS)
            return bf_fail(err, BF_USAGE, "more than %d of --fix and --free", MOST_SETTINGS);
        a->fixed[a->n_fixed].name = optarg;
        a->fixed[a->n_fixed++].fixed = code == 'x';
        return BF_OK;
    case 'r':
        if (a->n_by_record == BEAM_EFFECT_PARAMETERS)
            return bf_fail(err, BF_USAGE, "more than %d of --per-record", BEAM_EFFECT_PARAMETERS);
        a->by_record[a->n_by_record++] = optarg;
        return BF_OK;
    default:
        return BF_USAGE;
    }
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1)
        if (take_option(a, code, err) != BF_OK)
            return BF_USAGE;
    if (argc - optind < 2)
        return bf_fail(err, BF_USAGE, "give a model and an effect: beamfit add MODEL ID -o NEW");
    a->model = argv[optind++];
    a->id = argv[optind++];
    for (; optind < argc; optind++) {
        const char *equals = strrchr(argv[optind], '='); /* a record's name may have one */
        if (!equals)
            return bf_fail(err, BF_USAGE, "'%.60s' is no NAME=VALUE; one effect is added at a time", argv[optind]);
        if (take_value(a, argv[optind], (size_t)(equals - argv[optind]), equals + 1, err) != BF_OK)
            return BF_USAGE;
    }
    if (!a->output)
        return bf_fail(err, BF_USAGE, "say where to write the new model: -o NEW");
    if (options_one_answer(a->output, err) != BF_OK)
        return BF_USAGE;
    return BF_OK;
}

static struct parameter *find_parameter(struct model_effect *effect, const char *name, size_t n, struct bf_error *err)
{
    char word[MODEL_NAME], list[BEAM_EFFECT_PARAMETERS * MODEL_NAME] = "";
    const char *known[BEAM_EFFECT_PARAMETERS];
    size_t used = 0, n_known = (size_t)effect->effect->n_parameters;
    (void)snprintf(word, sizeof word, "%.*s", (int)(n < sizeof word ? n : sizeof word - 1), name);
    for (size_t i = 0; i < n_known; i++) {
        known[i] = effect->parameters[i].name;
        if (strcmp(word, known[i]) == 0)
            return &effect->parameters[i];
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", known[i]);
    }
    const char *closest = text_closest(word, known, n_known);
    (void)bf_fail(err, BF_USAGE, "effect '%s' has no parameter '%s'; it has %s%s%s%s", effect->effect->id, word, list,
                  closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
    return NULL;
}

/* A value in each record; free, unless --fix holds those that are given. */
static void differ(struct model_effect *effect, int slot)
{
    effect->by_record[slot] = (effect->effect->parameters[slot].flags & BEAM_PARAMETER_PER_RECORD) == 0;
    effect->parameters[slot].fixed = false;
}

static enum bf_status set_in_record(const struct setting *own, struct model_effect *effect, int slot,
                                    struct bf_error *err)
{
    char record[sizeof((struct per_record_value *)NULL)->record];
    if (own->n_record >= sizeof record)
        return bf_fail(err, BF_USAGE, "'%.60s…' is longer than %zu bytes", own->record, sizeof record - 1);
    (void)snprintf(record, sizeof record, "%.*s", (int)own->n_record, own->record);
    effect_set_record_value(effect, slot, record, own->value, 0.0);
    differ(effect, slot);
    return BF_OK;
}

static enum bf_status set_parameters(const struct arguments *a, struct model_effect *effect, struct bf_error *err)
{
    for (size_t i = 0; i < a->n_values; i++) {
        struct parameter *p = find_parameter(effect, a->values[i].name, a->values[i].n_name, err);
        if (!p)
            return BF_USAGE;
        if (a->values[i].n_record == 0)
            p->value = a->values[i].value;
        else if (set_in_record(&a->values[i], effect, (int)(p - effect->parameters), err) != BF_OK)
            return BF_USAGE;
    }
    for (size_t i = 0; i < a->n_by_record; i++) {
        const struct parameter *p = find_parameter(effect, a->by_record[i], strlen(a->by_record[i]), err);
        if (!p)
            return BF_USAGE;
        differ(effect, (int)(p - effect->parameters));
    }
    for (size_t i = 0; i < a->n_fixed; i++) {
        struct parameter *p = find_parameter(effect, a->fixed[i].name, strlen(a->fixed[i].name), err);
        if (!p)
            return BF_USAGE;
        p->fixed = a->fixed[i].fixed;
    }
    return BF_OK;
}

static enum bf_status answer(const struct arguments *a, const struct model_effect *effect, struct bf_error *err)
{
    struct json *root = json_new_object();
    json_put_text(root, "file", a->output);
    json_put_text(root, "effect", effect->effect->id);
    json_put_text(root, "title", effect->effect->title);
    struct json *parameters = json_put(root, "parameters", json_new_object());
    for (int i = 0; i < effect->effect->n_parameters; i++) {
        struct json *one = json_put(parameters, effect->parameters[i].name, json_new_object());
        json_put_number(one, "value", effect->parameters[i].value);
        json_put_text(one, "unit", effect->parameters[i].unit);
        json_put_bool(one, "fixed", effect->parameters[i].fixed);
        json_put_bool(one, "per_record", effect_per_record(effect, i));
    }
    answer_next(root, "beamfit", "fit", a->output, "RECORD...", "-o", "FITTED", NULL);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {.channel = ""};
    struct model model;
    if (parse(argc, argv, &a, err) != BF_OK || !effect_find(a.id, err))
        return BF_USAGE;
    enum bf_status status = model_read(a.model, &model, err);
    if (status != BF_OK)
        return status;
    status = model_append_effect(&model, a.id, a.channel, err);
    if (status == BF_OK)
        status = set_parameters(&a, &model.effects[model.n_effects - 1], err);
    if (status == BF_OK && model_check(&model, err) != BF_OK)
        status = err->status = BF_USAGE;
    if (status == BF_OK)
        status = model_write(a.output, &model, err);
    if (status == BF_OK && strcmp(a.output, "-") != 0)
        status = answer(&a, &model.effects[model.n_effects - 1], err);
    model_free(&model);
    return status;
}

const struct command command_add = {
    .place = 80,
    .name = "add",
    .summary = "add an effect to a model",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
