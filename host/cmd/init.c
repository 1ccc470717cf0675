/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"
#include "commands.h"
#include "model/model.h"

static const struct answer_field fields[] = {
    ANSWER_ROW(TEXT, "file", "the file that was written"),
    ANSWER_ROW(NUMBER_MAP, "parameters", "start values by name, in SI units"),
    ANSWER_SAY("{file}: look through it, then `{next.0}`"),
    {0},
};

static const char help[] =
    "Usage: beamfit init [options] [-o MODEL]\n"
    "\n"
    "Writes a commented model to start from: stiffness and mass from a ruler and a handbook, damping and gains as\n"
    "start values for the fit. Without options it is a 300 × 20 × 2 mm aluminium cantilever to be edited.\n";

enum option_code {
    OPT_LENGTH = 256,
    OPT_WIDTH,
    OPT_THICKNESS,
    OPT_E,
    OPT_DENSITY,
    OPT_MASS,
    OPT_PATCH_THICKNESS,
    OPT_PATCH_WIDTH,
    OPT_PATCH_E,
    OPT_PATCH_DENSITY,
    OPT_LAST_NUMBER = OPT_PATCH_DENSITY,
    OPT_MATERIAL,
    OPT_SUPPORT,
    OPT_PATCH,
    OPT_PATCH_SIDES,
    OPT_INPUT,
    OPT_OUTPUT
};

static const struct option_row options[] = {
    {OPT_LENGTH, 0, "length", "M", NULL, "free length, m"},
    {OPT_WIDTH, 0, "width", "M", NULL, "width of the cross-section, m"},
    {OPT_THICKNESS, 0, "thickness", "M", NULL, "its thickness, m"},
    {OPT_MATERIAL, 0, "material", "NAME",
     "aluminium|steel|stainless|brass|copper|titanium|glass|acrylic|abs|carbon|fibreglass|spruce",
     "aluminium (default), steel, stainless, brass, copper, titanium, glass, acrylic, abs, carbon, "
     "fibreglass, spruce"},
    {OPT_E, 0, "E", "PA", NULL, "Young's modulus in Pa, instead of the handbook's"},
    {OPT_DENSITY, 0, "density", "D", NULL, "density in kg/m³, instead of the handbook's"},
    {OPT_MASS, 0, "mass", "KG", NULL, "of the free length of the bare beam, weighed: better than any density"},
    {OPT_SUPPORT, 0, "support", "NAME", "clamped-free|clamped-clamped|pinned-pinned|free-free",
     "clamped-free (default), clamped-clamped, pinned-pinned, free-free"},
    {OPT_PATCH, 0, "patch", "FROM TO", NULL, "a piezo patch from FROM to TO, m from the clamp; again for more, alike"},
    {OPT_PATCH_THICKNESS, 0, "patch-thickness", "M", NULL, "of one patch (default 0.00025)"},
    {OPT_PATCH_WIDTH, 0, "patch-width", "M", NULL, "its width (default: the beam's)"},
    {OPT_PATCH_E, 0, "patch-E", "PA", NULL, "its Young's modulus (default 63e9 Pa)"},
    {OPT_PATCH_DENSITY, 0, "patch-density", "D", NULL, "its density (default 7750 kg/m³)"},
    {OPT_PATCH_SIDES, 0, "patch-sides", "N", "1|2", "2: a pair on both faces (default), 1: on one face"},
    {OPT_INPUT, 0, "input", "NAME=KIND[@X]", NULL,
     "KIND point_force (N, at X m) or patch_moment (V); again for more. Of several patches the one over X "
     "is meant, without X the first"},
    {OPT_OUTPUT, 0, "output", "NAME=KIND[@X]", NULL,
     "KIND displacement, velocity, acceleration (at X m) or patch_strain (V), likewise. NAME is the column "
     "of the record. Default: hammer_N, and piezo_V or accel_mps2"},
    {'o', 'o', NULL, "FILE", NULL, "where to write the model (default: standard output)"},
    {OPTION_FORCE, 0, "force", NULL, NULL, "replace FILE even when `init` has not made it or somebody has changed it"},
    OPTIONS_ANSWER,
    {0},
};

static const char closing[] =
    "Example (the seed paper's beam):\n"
    "  beamfit init --length 0.4573 --width 0.0203 --thickness 0.0016 --E 73e9 --patch 0.02535 0.08905 \\\n"
    "               --patch-thickness 0.000254 --input hammer_N=point_force@0.0254 \\\n"
    "               --output piezo_V=patch_strain -o beam.yaml\n"
    "\n"
    "Exit status: 0 done; 2 usage, or FILE exists; 3 FILE not writable.\n";

enum { MOST_CHANNELS = 16 };

struct arguments {
    double number[OPT_LAST_NUMBER + 1 - OPT_LENGTH]; /* 0: not given */
    const struct handbook_material *material;
    struct starting_beam beam;
    struct model_input inputs[MOST_CHANNELS];
    struct model_output outputs[MOST_CHANNELS];
    const char *output;
};

static enum bf_status take_material(struct arguments *a, const char *name, struct bf_error *err)
{
    const char *names[64];
    size_t n = 0, chosen = 0;
    for (; n < handbook_materials_count && n < sizeof names / sizeof *names; n++)
        names[n] = handbook_materials[n].name;
    const bool american = strcmp(name, "aluminum") == 0;
    const enum bf_status status = options_choice("--material", american ? "aluminium" : name, names, n, &chosen, err);
    a->material = &handbook_materials[chosen];
    return status;
}

/* NAME=KIND[@X]; *at_m is NAN when there is no @. */
static enum bf_status split_channel(const char *text, char name[MODEL_NAME], char kind[MODEL_NAME], double *at_m,
                                    bool *has_at, struct bf_error *err)
{
    const char *allowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-";
    const char *equals = strchr(text, '='), *at = strchr(text, '@');
    size_t n_name = equals ? (size_t)(equals - text) : 0;
    size_t n_kind = !equals ? 0 : at && at > equals ? (size_t)(at - equals) - 1 : strlen(equals + 1);
    if (n_name == 0 || n_name >= MODEL_NAME || strspn(text, allowed) < n_name || n_kind == 0 || n_kind >= MODEL_NAME)
        return bf_fail(err, BF_USAGE, "'%.60s' is no NAME=KIND@X, e.g. hammer_N=point_force@0.0254", text);
    memcpy(name, text, n_name);
    memcpy(kind, equals + 1, n_kind);
    name[n_name] = kind[n_kind] = '\0';
    *has_at = at != NULL;
    if (!at)
        *at_m = nan(""); /* the first patch */
    return at ? options_number("the place after '@'", at + 1, at_m, err) : BF_OK;
}

static enum bf_status check_at(const char *text, bool at_point, bool has_at, struct bf_error *err)
{
    if (has_at || !at_point)
        return BF_OK;
    return bf_fail(err, BF_USAGE, "'%.60s' needs a place, e.g. …@0.0254 (m from the clamp)", text);
}

static enum bf_status take_input(struct arguments *a, const char *text, struct bf_error *err)
{
    char kind[MODEL_NAME];
    bool has_at;
    struct model_input *input = &a->inputs[a->beam.n_inputs];
    if (a->beam.n_inputs == MOST_CHANNELS)
        return bf_fail(err, BF_USAGE, "more than %d inputs", MOST_CHANNELS);
    if (split_channel(text, input->name, kind, &input->at_m, &has_at, err) != BF_OK)
        return BF_USAGE;
    static const enum input_kind last = INPUT_PATCH_MOMENT;
    const char *names[INPUT_PATCH_MOMENT + 1];
    size_t chosen = 0;
    for (size_t i = 0; i <= last; i++)
        names[i] = model_input_kind_name((enum input_kind)i);
    if (options_choice("the kind of an input", kind, names, last + 1, &chosen, err) != BF_OK)
        return BF_USAGE;
    input->kind = (enum input_kind)chosen;
    a->beam.n_inputs++;
    return check_at(text, input->kind == INPUT_POINT_FORCE, has_at, err);
}

static enum bf_status take_output(struct arguments *a, const char *text, struct bf_error *err)
{
    char kind[MODEL_NAME];
    bool has_at;
    struct model_output *output = &a->outputs[a->beam.n_outputs];
    if (a->beam.n_outputs == MOST_CHANNELS)
        return bf_fail(err, BF_USAGE, "more than %d outputs", MOST_CHANNELS);
    if (split_channel(text, output->name, kind, &output->at_m, &has_at, err) != BF_OK)
        return BF_USAGE;
    static const enum output_kind last = OUTPUT_PATCH_STRAIN;
    const char *names[OUTPUT_PATCH_STRAIN + 1];
    size_t chosen = 0;
    for (size_t i = 0; i <= last; i++)
        names[i] = model_output_kind_name((enum output_kind)i);
    if (options_choice("the kind of an output", kind, names, last + 1, &chosen, err) != BF_OK)
        return BF_USAGE;
    output->kind = (enum output_kind)chosen;
    a->beam.n_outputs++;
    return check_at(text, output->kind != OUTPUT_PATCH_STRAIN, has_at, err);
}

static enum bf_status take_support(struct arguments *a, const char *name, struct bf_error *err)
{
    const char *names[SUPPORT_FREE_FREE + 1];
    size_t chosen = 0;
    for (size_t i = 0; i <= SUPPORT_FREE_FREE; i++)
        names[i] = model_support_name((enum model_support)i);
    const enum bf_status status = options_choice("--support", name, names, SUPPORT_FREE_FREE + 1, &chosen, err);
    a->beam.support = (enum model_support)chosen;
    return status;
}

/* "--patch FROM TO": the second number is the argument after the option's own; "FROM,TO" in one is as good. */
static enum bf_status take_patch(struct arguments *a, int argc, char **argv, struct bf_error *err)
{
    char from[64];
    const char *comma = strchr(optarg, ','), *to = comma ? comma + 1 : NULL;
    if (!to && optind < argc)
        to = argv[optind++];
    if (!to)
        return bf_fail(err, BF_USAGE, "--patch needs two places, FROM and TO, m from the clamp");
    (void)snprintf(from, sizeof from, "%.*s", comma ? (int)(comma - optarg) : 60, optarg);
    if (a->beam.n_patches == STARTING_PATCHES)
        return bf_fail(err, BF_USAGE, "more than %d patches; write the others into the model", STARTING_PATCHES);
    double *patch_m = a->beam.patch_m[a->beam.n_patches++];
    enum bf_status status = options_number("--patch FROM", from, &patch_m[0], err);
    return status == BF_OK ? options_number("--patch TO", to, &patch_m[1], err) : status;
}

static enum bf_status take_option(struct arguments *a, int code, int argc, char **argv, struct bf_error *err)
{
    if (code >= OPT_LENGTH && code <= OPT_LAST_NUMBER) {
        const struct option_row *row = options;
        char name[40];
        while (row->code != code)
            row++;
        (void)snprintf(name, sizeof name, "--%s", row->name);
        return options_positive(name, optarg, INFINITY, &a->number[code - OPT_LENGTH], err);
    }
    long sides;
    switch (code) {
    case OPT_MATERIAL:
        return take_material(a, optarg, err);
    case OPT_SUPPORT:
        return take_support(a, optarg, err);
    case OPT_PATCH:
        return take_patch(a, argc, argv, err);
    case OPT_PATCH_SIDES:
        if (options_count("--patch-sides", optarg, 1, 2, &sides, err) == BF_OK)
            a->beam.patch_sides = (int)sides;
        return err->status;
    case OPT_INPUT:
        return take_input(a, optarg, err);
    case OPT_OUTPUT:
        if (strchr(optarg, '='))
            return take_output(a, optarg, err);
        a->output = optarg; /* as --output of the other commands */
        return BF_OK;
    case 'o':
        a->output = optarg;
        return BF_OK;
    default:
        return BF_USAGE;
    }
}

static double given_or(const struct arguments *a, enum option_code code, double fallback)
{
    double x = a->number[(int)code - OPT_LENGTH];
    return x > 0.0 ? x : fallback;
}

static void fill_beam(struct arguments *a)
{
    struct starting_beam *b = &a->beam;
    const struct handbook_material *material = a->material ? a->material : &handbook_materials[0];
    b->length_m = given_or(a, OPT_LENGTH, 0.3);
    b->beam = (struct layer){given_or(a, OPT_E, material->E_Pa), given_or(a, OPT_DENSITY, material->density_kgpm3),
                             given_or(a, OPT_WIDTH, 0.02), given_or(a, OPT_THICKNESS, 0.002)};
    b->patch = (struct layer){given_or(a, OPT_PATCH_E, 63e9), given_or(a, OPT_PATCH_DENSITY, 7750.0),
                              given_or(a, OPT_PATCH_WIDTH, b->beam.width_m), given_or(a, OPT_PATCH_THICKNESS, 0.00025)};
    b->beam_material = given_or(a, OPT_E, 0.0) > 0.0 ? "E as given" : material->name;
    b->patch_material = "piezo";
    b->mass_kg = given_or(a, OPT_MASS, 0.0);
    if (b->n_inputs + b->n_outputs == 0) {
        a->inputs[0] = (struct model_input){.name = "hammer_N", .kind = INPUT_POINT_FORCE, .at_m = 0.1 * b->length_m};
        b->n_inputs = b->n_outputs = 1;
        a->outputs[0] =
            b->n_patches > 0
                ? (struct model_output){.name = "piezo_V", .kind = OUTPUT_PATCH_STRAIN, .at_m = nan("")}
                : (struct model_output){.name = "accel_mps2", .kind = OUTPUT_ACCELERATION, .at_m = 0.9 * b->length_m};
    }
    b->inputs = a->inputs;
    b->outputs = a->outputs;
}

/* The ends of the patch that a channel sits on; without patches model_read_text() will refuse the channel. */
static enum bf_status find_patch(const struct starting_beam *b, const char *name, double at_m, double *from_m,
                                 double *to_m, struct bf_error *err)
{
    for (size_t i = 0; i < b->n_patches; i++)
        if (isnan(at_m) || (at_m >= b->patch_m[i][0] && at_m <= b->patch_m[i][1])) {
            *from_m = b->patch_m[i][0], *to_m = b->patch_m[i][1];
            return BF_OK;
        }
    if (b->n_patches == 0)
        return bf_fail(err, BF_USAGE, "%s sits on a patch, and the beam has none; give --patch FROM TO", name);
    return bf_fail(err, BF_USAGE, "%s sits on the patch over %g m from the clamp, and there is none", name, at_m);
}

static enum bf_status place_on_patches(struct arguments *a, struct bf_error *err)
{
    const struct starting_beam *b = &a->beam;
    enum bf_status status = BF_OK;
    for (size_t i = 0; i < b->n_inputs && !status; i++)
        if (a->inputs[i].kind == INPUT_PATCH_MOMENT)
            status = find_patch(b, a->inputs[i].name, a->inputs[i].at_m, &a->inputs[i].from_m, &a->inputs[i].to_m, err);
    for (size_t i = 0; i < b->n_outputs && !status; i++)
        if (a->outputs[i].kind == OUTPUT_PATCH_STRAIN)
            status =
                find_patch(b, a->outputs[i].name, a->outputs[i].at_m, &a->outputs[i].from_m, &a->outputs[i].to_m, err);
    return status;
}

static enum bf_status parse(int argc, char **argv, struct arguments *a, struct bf_error *err)
{
    int code;
    a->beam.patch_sides = 2;
    a->output = "-";
    while ((code = options_next(argc, argv, options, err)) != -1)
        if (code == '?' || take_option(a, code, argc, argv, err) != BF_OK)
            return BF_USAGE;
    if (optind < argc)
        return bf_fail(err, BF_USAGE, "'%.60s' is too much; name the file with -o", argv[optind]);
    if (options_one_answer(a->output, err) != BF_OK)
        return BF_USAGE;
    fill_beam(a);
    return place_on_patches(a, err);
}

static enum bf_status write_file(const char *path, const char *text, struct bf_error *err)
{
    struct atomic_file out;
    enum bf_status status = atomic_open(path, &out, err);
    if (status != BF_OK)
        return status;
    outputs_mark(&out, "# ", "\n");
    (void)fputs(text, out.f);
    return atomic_commit(&out, err);
}

static enum bf_status answer(const char *path, const struct model *model, struct bf_error *err)
{
    struct parameter_ref *refs;
    const size_t n = model_parameters(model, NULL, 0, &refs);
    struct json *root = json_new_object(), *parameters = json_put(root, "parameters", json_new_object());
    json_put_text(root, "file", path);
    for (size_t i = 0; i < n; i++)
        json_put_number(parameters, refs[i].label, refs[i].value);
    answer_next(root, "beamfit", "modes", path, NULL);
    answer_next(root, "beamfit", "fit", path, "RECORD...", "-o", "FITTED", NULL);
    free(refs);
    return answer_print_and_free(root, fields, err);
}

static enum bf_status run(int argc, char **argv, struct bf_error *err)
{
    struct arguments a = {0};
    struct model model;
    err->status = BF_OK;
    if (parse(argc, argv, &a, err) != BF_OK)
        return BF_USAGE;
    char *text = starting_model_text(&a.beam);
    enum bf_status status = model_read_text("the new model", text, strlen(text), &model, err);
    if (status != BF_OK) { /* the command line asks for an impossible beam */
        free(text);
        return err->status = BF_USAGE;
    }
    model_warning warning[8];
    size_t n_warnings = model_unit_warnings(&model, warning, sizeof warning / sizeof *warning);
    for (size_t i = 0; i < n_warnings; i++)
        bf_warn("%s", warning[i]);
    if (strcmp(a.output, "-") == 0) {
        (void)fputs(text, stdout);
    } else {
        status = write_file(a.output, text, err);
        if (status == BF_OK)
            status = answer(a.output, &model, err);
    }
    free(text);
    model_free(&model);
    return status;
}

const struct command command_init = {
    .place = 10,
    .name = "init",
    .summary = "write a commented model to start from",
    .help = help,
    .options = options,
    .closing = closing,
    .answer = fields,
    .run = run,
};
