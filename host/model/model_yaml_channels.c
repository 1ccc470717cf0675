/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_channels.c — tree to model: inputs, outputs, effects, and what the last fit left. */
#include "model_parts.h"
#include "model_yaml.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/ground.h"

enum { MOST_CHANNELS = 64, MOST_EFFECTS = 32, MOST_RECORDS = 10000, MOST_ANCESTORS = 64 };

/* ---- Inputs and outputs ---- */

/* A number holds the place; {value: …} frees it, with `prior_m`, the standard deviation of the ruler, or without. */
static enum bf_status read_at(const struct yaml_reader *r, const struct yaml_node *node, const char *channel,
                              const char *kind, struct channel_parameters *own, double *at_m)
{
    const struct yaml_node *at = yaml_get(node, "at_m", NULL);
    model_channel_init(own, r->model->length_m);
    if (!at)
        return yaml_fail(r, node, "a %s has no at_m; add its distance from the clamp in metres", kind);
    enum bf_status status = yaml_length(r, at, &own->at, &own->lists_at);
    if (status == BF_OK)
        status = yaml_stated_places(r, at, channel);
    *at_m = own->at.value;
    return status;
}

/* What the column's numbers are worth: 1 when nothing is said. */
static enum bf_status read_gain(const struct yaml_reader *r, const struct yaml_node *node,
                                struct channel_parameters *own)
{
    struct parameter *gain = &own->gain;
    const struct yaml_node *stated = yaml_get(node, "gain", NULL);
    if (!stated)
        return BF_OK;
    own->lists_gain = stated->kind == YAML_MAPPING;
    gain->fixed = !own->lists_gain;
    const enum bf_status status = yaml_parameter(r, stated, false, gain);
    gain->logarithmic = gain->value > 0.0;
    return status;
}

static enum bf_status read_patch(const struct yaml_reader *r, const struct yaml_node *node, const char *kind,
                                 double *from_m, double *to_m)
{
    const struct yaml_node *patch = yaml_get(node, "patch_m", NULL);
    if (patch)
        return yaml_interval(r, patch, "patch_m", from_m, to_m);
    const struct model regions = {.n_regions = r->model->n_regions, .regions = r->model->regions};
    if (!model_patch(&regions, from_m, to_m))
        return yaml_fail(r, node, "a %s needs a patch; add `patch_m: [from, to]` to beam or to this channel", kind);
    return BF_OK;
}

/* Index of the node's `kind` among n names, by `what` in messages. */
static enum bf_status read_kind(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                                const char *const names[], size_t n, size_t *out)
{
    const struct yaml_node *kind = yaml_get(node, "kind", NULL);
    char list[200] = "";
    for (size_t i = 0, used = 0; i < n; i++)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", names[i]);
    if (!kind)
        return yaml_fail(r, node, "%s has no kind; add one of %s", what, list);
    for (*out = 0; kind->kind == YAML_SCALAR && *out < n; ++*out)
        if (strcmp(kind->text, names[*out]) == 0)
            return BF_OK;
    const char *closest = kind->kind == YAML_SCALAR ? text_closest(kind->text, names, n) : NULL;
    return yaml_fail(r, kind, "unknown kind%s%.40s%s of %s; it is one of %s%s%s%s", kind->text ? " '" : "",
                     kind->text ? kind->text : "", kind->text ? "'" : "", what, list, closest ? "; did you mean '" : "",
                     closest ? closest : "", closest ? "'?" : "");
}

static enum bf_status read_input(const struct yaml_reader *r, const struct yaml_node *name,
                                 const struct yaml_node *node)
{
    static const char *const force_keys[] = {"kind", "level", "at_m", "gain"}, *const moment_keys[] = {"kind", "level",
                                                                                                       "patch_m"};
    struct model_input input = {0};
    enum bf_status status = yaml_name(r, name, "an input's name", sizeof input.name, input.name);
    if (status == BF_OK)
        status = yaml_expect(r, node, YAML_MAPPING, input.name);
    if (status != BF_OK)
        return status;
    const char *const kinds[] = {model_input_kind_name(INPUT_POINT_FORCE), model_input_kind_name(INPUT_PATCH_MOMENT)};
    size_t kind = 0;
    if ((status = read_kind(r, node, input.name, kinds, 2, &kind)) != BF_OK)
        return status;
    input.kind = (enum input_kind)kind;
    bool force = input.kind == INPUT_POINT_FORCE;
    if ((status = yaml_known_keys(r, node, input.name, force ? force_keys : moment_keys, force ? 4 : 3)) != BF_OK)
        return status;
    status = force ? read_at(r, node, input.name, model_input_kind_name(input.kind), &input.own, &input.at_m)
                   : read_patch(r, node, model_input_kind_name(input.kind), &input.from_m, &input.to_m);
    if (status == BF_OK && force)
        status = read_gain(r, node, &input.own);
    const struct yaml_node *level = yaml_get(node, "level", NULL);
    if (status == BF_OK && level) {
        input.level_per_record = level->kind == YAML_SCALAR && strcmp(level->text, "per_record") == 0;
        if (!input.level_per_record && !(level->kind == YAML_SCALAR && strcmp(level->text, "known") == 0))
            return yaml_fail(r, level, "level of %s is something else than known or per_record; write one of them",
                             input.name);
    }
    if (status != BF_OK)
        return status;
    struct model *m = r->model;
    m->inputs = bf_grow(m->inputs, m->n_inputs + 1, sizeof *m->inputs);
    m->inputs[m->n_inputs++] = input;
    return BF_OK;
}

static enum bf_status read_output(const struct yaml_reader *r, const struct yaml_node *name,
                                  const struct yaml_node *node)
{
    static const char *const point_keys[] = {"kind", "at_m", "gain", "mass_kg"}, *const strain_keys[] = {"kind",
                                                                                                         "patch_m"};
    struct model_output output = {0};
    enum bf_status status = yaml_name(r, name, "an output's name", sizeof output.name, output.name);
    if (status == BF_OK)
        status = yaml_expect(r, node, YAML_MAPPING, output.name);
    if (status != BF_OK)
        return status;
    const char *kinds[OUTPUT_PATCH_STRAIN + 1];
    size_t kind = 0;
    for (kind = 0; kind <= OUTPUT_PATCH_STRAIN; kind++)
        kinds[kind] = model_output_kind_name((enum output_kind)kind);
    if ((status = read_kind(r, node, output.name, kinds, OUTPUT_PATCH_STRAIN + 1, &kind)) != BF_OK)
        return status;
    output.kind = (enum output_kind)kind;
    bool strain = output.kind == OUTPUT_PATCH_STRAIN;
    if ((status = yaml_known_keys(r, node, output.name, strain ? strain_keys : point_keys, strain ? 2 : 4)) != BF_OK)
        return status;
    status = strain ? read_patch(r, node, model_output_kind_name(output.kind), &output.from_m, &output.to_m)
                    : read_at(r, node, output.name, model_output_kind_name(output.kind), &output.own, &output.at_m);
    if (status == BF_OK && !strain)
        status = read_gain(r, node, &output.own);
    if (status == BF_OK && !strain)
        status = yaml_sensor_mass(r, node, &output.mass_kg);
    if (status != BF_OK)
        return status;
    struct model *m = r->model;
    m->outputs = bf_grow(m->outputs, m->n_outputs + 1, sizeof *m->outputs);
    m->outputs[m->n_outputs++] = output;
    return BF_OK;
}

static enum bf_status read_channels(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                                    enum bf_status (*read)(const struct yaml_reader *, const struct yaml_node *,
                                                           const struct yaml_node *))
{
    if (!node || yaml_is_nothing(node))
        return BF_OK;
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, what);
    if (status == BF_OK && node->n > MOST_CHANNELS)
        return yaml_fail(r, node, "more than %d %s; keep those that records have", MOST_CHANNELS, what);
    for (size_t i = 0; i < node->n && status == BF_OK; i++)
        status = read(r, node->key[i], node->value[i]);
    return status;
}

enum bf_status yaml_read_inputs(const struct yaml_reader *r, const struct yaml_node *node)
{
    return read_channels(r, node, "inputs", read_input);
}

enum bf_status yaml_read_outputs(const struct yaml_reader *r, const struct yaml_node *node)
{
    return read_channels(r, node, "outputs", read_output);
}

/* ---- Effects ---- */

static enum bf_status read_per_record(const struct yaml_reader *r, const struct yaml_node *node, int slot,
                                      struct model_effect *effect)
{
    const struct yaml_node *list = yaml_get(node, "per_record", NULL);
    if (!list || yaml_is_nothing(list))
        return BF_OK;
    enum bf_status status = yaml_expect(r, list, YAML_MAPPING, "per_record");
    if (status == BF_OK && list->n > MOST_RECORDS)
        return yaml_fail(r, list, "more than %d records; delete some", MOST_RECORDS);
    for (size_t i = 0; i < list->n && status == BF_OK; i++) {
        static const char *const known[] = {"value", "sd"};
        struct per_record_value entry = {.parameter = slot};
        const struct yaml_node *value = list->value[i], *sd = NULL;
        if ((status = yaml_name(r, list->key[i], "a record's name", sizeof entry.record, entry.record)) != BF_OK)
            return status;
        if (value->kind == YAML_MAPPING) {
            if ((status = yaml_known_keys(r, value, entry.record, known, 2)) != BF_OK)
                return status;
            sd = yaml_get(value, "sd", NULL);
            if (!yaml_get(value, "value", NULL))
                return yaml_fail(r, value, "%.60s has no value; write {value: NUMBER}", entry.record);
            value = yaml_get(value, "value", NULL);
        }
        status = yaml_number(r, value, entry.record, &entry.value);
        if (status == BF_OK && sd)
            status = yaml_number(r, sd, "sd", &entry.sd);
        if (status == BF_OK && !isfinite(entry.value))
            status = yaml_fail(r, value, "%.60s is infinite; write a finite number", entry.record);
        if (status != BF_OK)
            return status;
        effect->per_record = bf_grow(effect->per_record, effect->n_per_record + 1, sizeof *effect->per_record);
        effect->per_record[effect->n_per_record++] = entry;
    }
    return status;
}

static enum bf_status read_effect_parameters(const struct yaml_reader *r, const struct yaml_node *node,
                                             struct model_effect *effect)
{
    const struct beam_effect *entry = effect->effect;
    const char *known[BEAM_EFFECT_PARAMETERS + 2] = {"kind", "channel"};
    size_t n = 2;
    for (int i = 0; i < entry->n_parameters; i++)
        known[n++] = entry->parameters[i].name;
    enum bf_status status = yaml_known_keys(r, node, entry->id, known, n);
    for (int i = 0; i < entry->n_parameters && status == BF_OK; i++) {
        struct parameter *p = &effect->parameters[i];
        model_effect_parameter(r->model, entry, i, p);
        const struct parameter catalogue = *p;
        const struct yaml_node *value = yaml_get(node, p->name, NULL);
        if (!value)
            continue;
        if ((status = yaml_parameter(r, value, true, p)) != BF_OK)
            return status;
        if (p->min < catalogue.min || p->max > catalogue.max)
            return yaml_fail(r, value, "%s: bounds %g … %g reach outside the physical range %g … %g %s; narrow them",
                             p->name, p->min, p->max, catalogue.min, catalogue.max, p->unit);
        p->logarithmic = (entry->parameters[i].flags & BEAM_PARAMETER_LOG) != 0 && p->value > 0.0;
        effect->by_record[i] = yaml_get(value, "per_record", NULL) != NULL &&
                               (entry->parameters[i].flags & BEAM_PARAMETER_PER_RECORD) == 0;
        status = read_per_record(r, value, i, effect);
    }
    return status;
}

static enum bf_status read_effect(const struct yaml_reader *r, const struct yaml_node *node)
{
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, "an effect");
    if (status != BF_OK)
        return status;
    const struct yaml_node *kind = yaml_get(node, "kind", NULL), *channel = yaml_get(node, "channel", NULL);
    if (!kind)
        return yaml_fail(r, node, "an effect has no kind; `beamfit effects` lists them");
    if ((status = yaml_expect(r, kind, YAML_SCALAR, "an effect's kind")) != BF_OK)
        return status;
    struct bf_error unknown;
    const struct beam_effect *entry = effect_find(kind->text, &unknown);
    if (!entry)
        return yaml_fail(r, kind, "%s", unknown.text);
    struct model *m = r->model;
    m->effects = bf_grow(m->effects, m->n_effects + 1, sizeof *m->effects);
    struct model_effect *effect = &m->effects[m->n_effects];
    *effect = (struct model_effect){.effect = entry};
    m->n_effects++; /* from here model_free() sees it */
    if (channel && (status = yaml_name(r, channel, "channel", sizeof effect->channel, effect->channel)) != BF_OK)
        return status;
    return read_effect_parameters(r, node, effect);
}

enum bf_status yaml_read_effects(const struct yaml_reader *r, const struct yaml_node *node)
{
    if (!node || yaml_is_nothing(node))
        return BF_OK;
    enum bf_status status = yaml_expect(r, node, YAML_SEQUENCE, "effects");
    if (status == BF_OK && node->n > MOST_EFFECTS)
        return yaml_fail(r, node, "more than %d effects; delete some", MOST_EFFECTS);
    for (size_t i = 0; i < node->n && status == BF_OK; i++)
        status = read_effect(r, node->value[i]);
    return status;
}

/* ---- What the last fit left: written by the program, read leniently about keys, strictly about types ---- */

static enum bf_status read_sha256(const struct yaml_reader *r, const struct yaml_node *node, char out[65])
{
    if (node->kind != YAML_SCALAR || (node->text[0] && strlen(node->text) != 64) ||
        strspn(node->text, "0123456789abcdef") != strlen(node->text))
        return yaml_fail(r, node, "not a SHA-256 (64 digits 0-9a-f); delete the fit block, a fit writes it anew");
    memcpy(out, node->text, strlen(node->text) + 1);
    return BF_OK;
}

static enum bf_status fit_number(const struct yaml_reader *r, const struct yaml_node *mapping, const char *key,
                                 double *out)
{
    const struct yaml_node *node = yaml_get(mapping, key, NULL);
    return node ? yaml_number(r, node, key, out) : BF_OK;
}

static enum bf_status fit_bool(const struct yaml_reader *r, const struct yaml_node *mapping, const char *key, bool *out)
{
    const struct yaml_node *node = yaml_get(mapping, key, NULL);
    return node ? yaml_bool(r, node, key, out) : BF_OK;
}

static enum bf_status read_fit_channels(const struct yaml_reader *r, const struct yaml_node *list,
                                        struct fit_record *record)
{
    enum bf_status status = yaml_expect(r, list, YAML_SEQUENCE, "channels");
    if (status == BF_OK && list->n > MOST_CHANNELS)
        return yaml_fail(r, list, "more than %d channels; delete the fit block, a fit writes it anew", MOST_CHANNELS);
    if (status != BF_OK)
        return status;
    record->channels = bf_alloc(list->n, sizeof *record->channels);
    for (size_t i = 0; i < list->n && status == BF_OK; i++) {
        struct fit_channel *channel = &record->channels[record->n_channels++];
        const struct yaml_node *name = yaml_get(list->value[i], "name", NULL);
        if (!name)
            return yaml_fail(r, list->value[i],
                             "a channel of the fit block has no name; delete the block, a fit writes it anew");
        if ((status = yaml_name(r, name, "a channel's name", sizeof channel->name, channel->name)) == BF_OK &&
            (status = fit_number(r, list->value[i], "nrmse", &channel->nrmse)) == BF_OK &&
            (status = fit_number(r, list->value[i], "noise_ratio", &channel->noise_ratio)) == BF_OK)
            status = fit_number(r, list->value[i], "noise_rms", &channel->noise_rms);
    }
    return status;
}

static enum bf_status read_fit_record(const struct yaml_reader *r, const struct yaml_node *node, struct fit_info *fit)
{
    const struct yaml_node *file = yaml_get(node, "file", NULL), *sha256 = yaml_get(node, "sha256", NULL);
    const struct yaml_node *channels = yaml_get(node, "channels", NULL);
    if (!file || file->kind != YAML_SCALAR)
        return yaml_fail(r, node, "a record of the fit block has no file; delete the block, a fit writes it anew");
    struct fit_record *record = &fit->records[fit->n_records++];
    record->file = bf_strdup(file->text);
    enum bf_status status = sha256 ? read_sha256(r, sha256, record->sha256) : BF_OK;
    if (status == BF_OK)
        status = fit_bool(r, node, "held_out", &record->held_out);
    return status == BF_OK && channels ? read_fit_channels(r, channels, record) : status;
}

static enum bf_status read_ancestors(const struct yaml_reader *r, const struct yaml_node *list, struct fit_info *fit)
{
    enum bf_status status = yaml_expect(r, list, YAML_SEQUENCE, "ancestors");
    if (status == BF_OK && list->n > MOST_ANCESTORS)
        return yaml_fail(r, list, "more than %d ancestors; delete the oldest", MOST_ANCESTORS);
    fit->ancestors = bf_alloc(list->n, sizeof *fit->ancestors);
    for (size_t i = 0; i < list->n && status == BF_OK; i++)
        status = read_sha256(r, list->value[i], fit->ancestors[fit->n_ancestors++]);
    return status;
}

enum bf_status yaml_read_fit(const struct yaml_reader *r, const struct yaml_node *node)
{
    struct fit_info *fit = &r->model->fit;
    if (!node || yaml_is_nothing(node))
        return BF_OK;
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, "fit");
    if (status != BF_OK)
        return status;
    const struct yaml_node *version = yaml_get(node, "version", NULL), *parent = yaml_get(node, "parent_sha256", NULL);
    const struct yaml_node *ancestors = yaml_get(node, "ancestors", NULL), *records = yaml_get(node, "records", NULL);
    if ((version && (status = yaml_name(r, version, "version", sizeof fit->version, fit->version)) != BF_OK) ||
        (parent && (status = read_sha256(r, parent, fit->parent_sha256)) != BF_OK) ||
        (ancestors && (status = read_ancestors(r, ancestors, fit)) != BF_OK) ||
        (status = fit_number(r, node, "nrmse", &fit->nrmse)) != BF_OK ||
        (status = fit_number(r, node, "noise_ratio", &fit->noise_ratio)) != BF_OK ||
        (status = fit_number(r, node, "check_nrmse", &fit->check_nrmse)) != BF_OK ||
        (status = fit_number(r, node, "check_noise_ratio", &fit->check_noise_ratio)) != BF_OK ||
        (status = fit_bool(r, node, "converged", &fit->converged)) != BF_OK)
        return status;
    if (!records)
        return BF_OK;
    if ((status = yaml_expect(r, records, YAML_SEQUENCE, "records")) != BF_OK)
        return status;
    if (records->n > MOST_RECORDS)
        return yaml_fail(r, records, "more than %d records; delete some", MOST_RECORDS);
    fit->records = bf_alloc(records->n, sizeof *fit->records);
    for (size_t i = 0; i < records->n && status == BF_OK; i++)
        status = read_fit_record(r, records->value[i], fit);
    fit->present = status == BF_OK && records->n > 0;
    return status;
}
