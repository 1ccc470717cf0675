/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
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
    ANSWER_ROW(BOOL, "held", "in fits, unless freed"),
    {0},
};

#define EFFECT_FIELDS(flags)                                                                                           \
    {ANSWER_TEXT, "id", "in model files", NULL, flags, NULL},                                                          \
        {ANSWER_TEXT, "family", "structure, damping, nonlinear, measurement or environment", NULL, flags, NULL},       \
        {ANSWER_TEXT, "title", "in words", NULL, flags, NULL},                                                         \
        {ANSWER_TEXT, "form", "what it adds to the equation of motion", NULL, flags, NULL},                            \
        {ANSWER_TEXT, "source", "in the literature", NULL, flags, NULL},                                               \
        {ANSWER_TEXT, "looks_like", "in data", NULL, flags, NULL},                                                     \
        {ANSWER_TEXT, "confused_with", "and the experiment that tells them apart", NULL, flags, NULL},                 \
        {ANSWER_TEXT, "target_cost", "on a controller", NULL, flags, NULL},                                            \
    {                                                                                                                  \
        ANSWER_LIST, "parameters", "one each", parameter_fields, flags, NULL                                           \
    }

static const struct answer_field effect_fields[] = {
    EFFECT_FIELDS(0),
    {0},
};

static const struct answer_field fields[] = {
    EFFECT_FIELDS(ANSWER_MAYBE),
    {ANSWER_LIST, "effects", "the catalogue; with ID that effect alone stands in its place", effect_fields,
     ANSWER_MAYBE, NULL},
    {0},
};

static const char help[] =
    "Usage: beamfit effects [ID] [--json]\n"
    "\n"
    "The catalogue of physical effects that a model may lack. Without ID: one line each, by family, with the\n"
    "parameters. With ID: what the effect adds to the equation of motion, how it shows in data, what it is confused\n"
    "with and which experiment tells them apart, its parameters with ranges, and its cost on the target.\n";

static const struct option_row options[] = {
    OPTIONS_ANSWER('j'),
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
};
enum { FAMILIES = sizeof families / sizeof *families };

static void put_effect(struct json *object, const struct beam_effect *effect)
{
    json_put_text(object, "id", effect->id);
    json_put_text(object, "family", families[effect->family].key);
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
        json_put_bool(parameter, "held", position || (info->flags & BEAM_PARAMETER_HELD) != 0);
    }
}

static enum bf_status print_json(const struct beam_effect *one, struct bf_error *err)
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

static void print_table(void)
{
    size_t width = 0, columns = text_columns();
    for (int i = 0; i < beam_effects_count; i++)
        width = strlen(beam_effects[i]->id) > width ? strlen(beam_effects[i]->id) : width;
    for (int family = 0; family < FAMILIES; family++) {
        (void)printf("%s%s\n", family ? "\n" : "", families[family].title);
        for (int i = 0; i < beam_effects_count; i++) {
            const struct beam_effect *effect = beam_effects[i];
            char line[512];
            if ((int)effect->family != family)
                continue;
            size_t n = (size_t)snprintf(line, sizeof line, "%s", effect->title);
            for (int j = 0; j < effect->n_parameters && n < sizeof line; j++)
                n += (size_t)snprintf(line + n, sizeof line - n, "%s%s", j ? ", " : "; ", effect->parameters[j].name);
            (void)fputs("  ", stdout);
            text_print_padded(stdout, effect->id, width + 2);
            text_print_wrapped(stdout, line, width + 4, columns);
        }
    }
    text_say(stdout, "\n", 0, "`beamfit effects ID` tells more, `beamfit add MODEL ID -o NEW` adds one to a model.");
}

enum { INDENT = 15 };

static void print_paragraph(const char *title, const char *text)
{
    text_print_padded(stdout, title, INDENT);
    text_print_wrapped(stdout, text, INDENT, text_columns());
}

static void print_number(char text[DECIMAL_TEXT], double x)
{
    if (isinf(x))
        (void)snprintf(text, DECIMAL_TEXT, "%s", x < 0 ? "−∞" : "∞");
    else
        decimal_print(text, x);
}

static void print_parameter(const struct beam_parameter_info *info)
{
    char line[512], neutral[DECIMAL_TEXT], minimum[DECIMAL_TEXT], maximum[DECIMAL_TEXT], start[DECIMAL_TEXT];
    bool position = info->role == BEAM_ROLE_PLACE, inner = (info->flags & BEAM_PARAMETER_INNER) != 0;
    print_number(neutral, info->neutral);
    print_number(minimum, info->minimum);
    print_number(maximum, info->maximum);
    print_number(start, info->start);
    (void)snprintf(line, sizeof line, "%s; range %s … %s%s%s, start %s%s%s%s%s.", info->what, minimum, maximum,
                   info->unit[0] ? " " : "", position ? "of the length" : info->unit, start,
                   inner ? "; without influence while the effect is absent" : "; absent at ", inner ? "" : neutral,
                   position || (info->flags & BEAM_PARAMETER_HELD) ? "; held in a fit unless you free it" : "",
                   info->flags & BEAM_PARAMETER_PER_RECORD ? "; one value per record" : "");
    bool long_name = text_width(info->name) + 2 > INDENT;
    text_print_padded(stdout, info->name, INDENT);
    if (long_name)
        (void)printf("\n%*s", INDENT, "");
    text_print_wrapped(stdout, line, INDENT, text_columns());
}

static void print_effect(const struct beam_effect *effect)
{
    text_say(stdout, "", 0, "%s — %s", effect->id, effect->title);
    (void)putchar('\n');
    print_paragraph("Family", families[effect->family].title);
    print_paragraph("Form", effect->form);
    print_paragraph("Looks like", effect->looks_like);
    print_paragraph("Confused with", effect->confused_with);
    print_paragraph("Source", effect->source);
    print_paragraph("On the target", effect->target_cost);
    (void)puts("\nParameters");
    for (int i = 0; i < effect->n_parameters; i++)
        print_parameter(&effect->parameters[i]);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    bool json = false;
    int code;
    while ((code = options_next(argc, argv, options, err)) != -1) {
        if (code == '?')
            return BF_USAGE;
        json = true;
    }
    if (argc - optind > 1)
        return bf_fail(err, BF_USAGE, "give one effect, not %d; see 'beamfit effects --help'", argc - optind);
    const struct beam_effect *one = NULL;
    if (argc > optind && (one = effect_find(argv[optind], err)) == NULL)
        return BF_USAGE;
    if (json)
        return print_json(one, err);
    if (one)
        print_effect(one);
    else
        print_table();
    return BF_OK;
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
