/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "ground/ground.h"
#include "model/model.h"

static const struct answer_field parameter_fields[] = {
    ANSWER_ROW(TEXT, "name", "in model files"),
    ANSWER_ROW(TEXT, "unit", "of its numbers; of a position: of the length"),
    ANSWER_ROW(TEXT, "what", "it is"),
    ANSWER_ROW(NUMBER, "neutral", "the effect is absent there"),
    ANSWER_ROW(NUMBER, "minimum", "null: none"),
    ANSWER_ROW(NUMBER, "maximum", "null: none"),
    ANSWER_ROW(NUMBER, "start", "of a fit"),
    ANSWER_ROW(TEXT, "role", "place, strength, time, level, phase, frequency, share or loss"),
    ANSWER_ROW(BOOL, "position", "its numbers are fractions of the length"),
    ANSWER_ROW(BOOL, "per_record", "each record has a value of its own"),
    ANSWER_ROW(BOOL, "inner", "without influence while the effect is absent"),
    ANSWER_ROW(BOOL, "held", "in fits, unless freed"),
    ANSWER_CELL("", "{name}"),
    ANSWER_CELL("", "{what}[; at least {minimum}][; at most {maximum}][{position?} of the length][{position!} {unit}]; "
                    "start {start}{inner?; without influence while the effect is absent|}[{inner!}; absent at "
                    "{neutral}]{held?; held in a fit unless you free it|}{per_record?; one value per record|}."),
    {0},
};

#define EFFECT_FIELDS(maybe)                                                                                           \
    ANSWER_ROW(TEXT, "id", "in model files", .flags = (maybe)),                                                        \
        ANSWER_ROW(TEXT, "family", "structure, damping, nonlinear, measurement or environment", .flags = (maybe)),     \
        ANSWER_ROW(TEXT, "family_title", "the same in words", .flags = (maybe)),                                       \
        ANSWER_ROW(TEXT, "title", "in words", .flags = (maybe)),                                                       \
        ANSWER_ROW(TEXT, "form", "what it adds to the equation of motion", .flags = (maybe)),                          \
        ANSWER_ROW(TEXT, "source", "in the literature", .flags = (maybe)),                                             \
        ANSWER_ROW(TEXT, "looks_like", "in data", .flags = (maybe)),                                                   \
        ANSWER_ROW(TEXT, "confused_with", "and the experiment that tells them apart", .flags = (maybe)),               \
        ANSWER_ROW(TEXT, "target_cost", "on a controller", .flags = (maybe))

static const struct answer_field effect_fields[] = {
    EFFECT_FIELDS(0),
    ANSWER_ROW_OF(LIST, "parameters", "one each", parameter_fields),
    ANSWER_SAY("{family_title}", .flags = ANSWER_GROUP),
    ANSWER_CELL("", "  {id}"),
    ANSWER_CELL("", "{title}[; {parameters}]"),
    {0},
};

static const struct answer_field fields[] = {
    EFFECT_FIELDS(ANSWER_MAYBE),
    ANSWER_SAY("[{id} — {title}]"),
    ANSWER_SAY("[\nFamily         \t{family_title}]"),
    ANSWER_SAY("[Form           \t{form}]"),
    ANSWER_SAY("[Looks like     \t{looks_like}]"),
    ANSWER_SAY("[Confused with  \t{confused_with}]"),
    ANSWER_SAY("[Source         \t{source}]"),
    ANSWER_SAY("[On the target  \t{target_cost}]"),
    ANSWER_ROW_OF(LIST, "parameters", "one each", parameter_fields, .flags = ANSWER_MAYBE | ANSWER_TABLE,
                  .text = "\nParameters"),
    ANSWER_ROW_OF(LIST, "effects", "the catalogue; with ID that effect alone stands in its place", effect_fields,
                  .flags = ANSWER_MAYBE | ANSWER_TABLE, .text = ""),
    ANSWER_SAY("[{effects?}\n`beamfit effects ID` tells more, `beamfit add MODEL ID -o NEW` adds one to a model.]"),
    {0},
};

static const char help[] =
    "Usage: beamfit effects [ID] [--json]\n"
    "\n"
    "The catalogue of physical effects that a model may lack. Without ID: one line each, by family, with the\n"
    "parameters. With ID: what the effect adds to the equation of motion, how it shows in data, what it is\n"
    "confused with and which experiment tells them apart, its parameters with ranges, and its cost on the target.\n";

static const struct option_row options[] = {
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] = "Example:\n"
                              "  beamfit effects root_compliance\n"
                              "\n"
                              "Exit status: 0 done; 2 no such effect.\n";

static const struct {
    const char *key, *title;
} families[] = {
    [BEAM_FAMILY_STRUCTURE] = {"structure", "Structure"},
    [BEAM_FAMILY_DAMPING] = {"damping", "Damping"},
    [BEAM_FAMILY_NONLINEAR] = {"nonlinear", "Nonlinear stiffness and friction"},
    [BEAM_FAMILY_MEASUREMENT] = {"measurement", "Measurement chain"},
    [BEAM_FAMILY_ENVIRONMENT] = {"environment", "Environment"},
};
static const char *const roles[] = {
    "not stated",
    [BEAM_ROLE_PLACE] = "place",
    [BEAM_ROLE_STRENGTH] = "strength",
    [BEAM_ROLE_TIME] = "time",
    [BEAM_ROLE_LEVEL] = "level",
    [BEAM_ROLE_PHASE] = "phase",
    [BEAM_ROLE_FREQUENCY] = "frequency",
    [BEAM_ROLE_SHARE] = "share",
    [BEAM_ROLE_LOSS] = "loss",
    [BEAM_ROLE_RESONANCE] = "resonance",
};
enum { FAMILIES = sizeof families / sizeof *families };

static void put_effect(struct json *object, const struct beam_effect *effect)
{
    json_put_text(object, "id", effect->id);
    json_put_text(object, "family", families[effect->family].key);
    json_put_text(object, "family_title", families[effect->family].title);
    json_put_text(object, "title", effect->title);
    json_put_text(object, "form", effect->form);
    json_put_text(object, "source", effect->source);
    json_put_text(object, "looks_like", effect->looks_like);
    json_put_text(object, "confused_with", effect->confused_with);
    json_put_text(object, "target_cost", effect->target_cost);
    struct json *parameters = json_put(object, "parameters", json_new_array());
    for (int i = 0; i < effect->n_parameters; i++) {
        const struct beam_parameter_info *info = &effect->parameters[i];
        struct json *parameter = json_push(parameters, json_new_object());
        const bool position = info->role == BEAM_ROLE_PLACE;
        json_put_text(parameter, "name", info->name);
        json_put_text(parameter, "unit", info->unit);
        json_put_text(parameter, "what", info->what);
        json_put_number(parameter, "neutral", info->neutral);
        json_put_number(parameter, "minimum", info->minimum);
        json_put_number(parameter, "maximum", info->maximum);
        json_put_number(parameter, "start", info->start);
        json_put_text(parameter, "role", roles[info->role]);
        json_put_bool(parameter, "position", position);
        json_put_bool(parameter, "per_record", (info->flags & BEAM_PARAMETER_PER_RECORD) != 0);
        json_put_bool(parameter, "inner", (info->flags & BEAM_PARAMETER_INNER) != 0);
        json_put_bool(parameter, "held", position || (info->flags & BEAM_PARAMETER_HELD) != 0);
    }
}

static enum bf_status print(const struct beam_effect *one, struct bf_error *err)
{
    struct json *root = json_new_object();
    if (one) {
        put_effect(root, one);
    } else {
        struct json *list = json_put(root, "effects", json_new_array());
        for (int family = 0; family < FAMILIES; family++)
            for (int i = 0; i < beam_effects_count; i++)
                if ((int)beam_effects[i]->family == family)
                    put_effect(json_push(list, json_new_object()), beam_effects[i]);
    }
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    if (options_next(argc, argv, options, err) != -1)
        return BF_USAGE;
    if (argc - optind > 1)
        return bf_fail(err, BF_USAGE, "give one effect, not %d; see 'beamfit effects --help'", argc - optind);
    const struct beam_effect *one = NULL;
    if (argc > optind && (one = effect_find(argv[optind], err)) == NULL)
        return BF_USAGE;
    return print(one, err);
}

const struct command command_effects = {
    .place = 70,
    .name = "effects",
    .summary = "the catalogue of physical effects; what each looks like in data, and what it is confused with",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
