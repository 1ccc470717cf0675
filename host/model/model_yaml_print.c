/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_print.c — a model as the text of a new file, and the pieces that editing inserts into an old one. */
#include "model_parts.h"
#include "model_yaml.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SD_DIGITS = 6 }; /* of what is itself an estimate: standard errors, nrmse */

static void add_rounded(struct yaml_text *text, double x)
{
    char number[DECIMAL_TEXT];
    decimal_print_rounded(number, x, SD_DIGITS);
    yaml_text_add(text, number);
}

/* ", key: number" */
static void add_pair(struct yaml_text *text, const char *key, double x, bool rounded)
{
    yaml_text_addf(text, ", %s: ", key);
    if (rounded)
        add_rounded(text, x);
    else
        yaml_text_number(text, x);
}

static bool same(double a, double b)
{
    return !(a < b) && !(a > b);
}

void yaml_parameter_keys(const struct parameter *p, const struct parameter *absent, struct yaml_parameter_text *out)
{
    *out = (struct yaml_parameter_text){.key = {"value", "prior", "prior_value", "start", "fixed", "min", "max", "sd"}};
    decimal_print(out->text[0], p->value);
    if (p->prior > 0.0)
        decimal_print(out->text[1], p->prior);
    if (p->prior > 0.0 && !same(p->prior_value, p->value))
        decimal_print(out->text[2], p->prior_value);
    if (!same(p->start, 0.0) && !same(p->start, p->value))
        decimal_print(out->text[3], p->start);
    if (p->fixed != absent->fixed)
        (void)snprintf(out->text[YAML_PARAMETER_FIXED], DECIMAL_TEXT, "%s", p->fixed ? "true" : "false");
    if (!same(p->min, absent->min))
        decimal_print(out->text[5], p->min);
    if (!same(p->max, absent->max))
        decimal_print(out->text[6], p->max);
    if (p->sd > 0.0)
        decimal_print_rounded(out->text[7], p->sd, SD_DIGITS);
}

void yaml_channel_absent(const struct model *m, struct parameter *p)
{
    const bool place = strcmp(p->name, "at_m") == 0;
    p->fixed = false;
    p->value = p->prior = p->prior_value = p->start = p->sd = 0.0;
    p->min = strcmp(p->name, "gain") == 0 ? -HUGE_VAL : 0.0;
    p->max = place ? fmax(p->max, m->length_m) : HUGE_VAL; /* beyond the end of the beam a bound says nothing */
}

/* A free parameter of a material or of the model, as the reader makes it before it has seen the file. */
static void print_parameter(struct yaml_text *text, const struct parameter *p, bool may_be_negative)
{
    struct parameter absent;
    struct yaml_parameter_text keys;
    model_parameter_init(&absent, p->name, p->unit, may_be_negative);
    yaml_parameter_keys(p, &absent, &keys);
    yaml_text_addf(text, "  %s: {value: %s", p->name, keys.text[0]);
    for (int i = 1; i < YAML_PARAMETER_KEYS; i++)
        if (keys.text[i][0])
            yaml_text_addf(text, ", %s: %s", keys.key[i], keys.text[i]);
    yaml_text_add(text, "}\n");
}

void model_print_per_record(struct yaml_text *text, const struct model_effect *effect, int slot)
{
    bool first = true;
    yaml_text_add(text, "{");
    for (size_t i = 0; i < effect->n_per_record; i++) {
        const struct per_record_value *entry = &effect->per_record[i];
        if (entry->parameter != slot)
            continue;
        yaml_text_add(text, first ? "" : ", ");
        yaml_text_scalar(text, entry->record);
        yaml_text_add(text, ": {value: ");
        yaml_text_number(text, entry->value);
        if (entry->sd > 0.0)
            add_pair(text, "sd", entry->sd, true);
        yaml_text_add(text, "}");
        first = false;
    }
    yaml_text_add(text, "}");
}

bool model_has_per_record(const struct model_effect *effect, int slot)
{
    if (effect->by_record[slot])
        return true;
    for (size_t i = 0; i < effect->n_per_record; i++)
        if (effect->per_record[i].parameter == slot)
            return true;
    return false;
}

void model_print_effect(struct yaml_text *text, const struct model *model, const struct model_effect *effect)
{
    yaml_text_addf(text, "{kind: %s", effect->effect->id);
    if (effect->channel[0]) {
        yaml_text_add(text, ", channel: ");
        yaml_text_scalar(text, effect->channel);
    }
    for (int i = 0; i < effect->effect->n_parameters; i++) {
        struct parameter absent;
        struct yaml_parameter_text keys;
        bool per_record = model_has_per_record(effect, i), bare = !per_record && effect->parameters[i].fixed;
        model_effect_parameter(model, effect->effect, i, &absent);
        yaml_parameter_keys(&effect->parameters[i], &absent, &keys);
        for (int k = 1; k < YAML_PARAMETER_KEYS; k++)
            bare = bare && !keys.text[k][0];
        yaml_text_addf(text, bare ? ", %s: %s" : ", %s: {value: %s", effect->parameters[i].name, keys.text[0]);
        for (int k = 1; k < YAML_PARAMETER_KEYS; k++)
            if (keys.text[k][0])
                yaml_text_addf(text, ", %s: %s", keys.key[k], keys.text[k]);
        if (per_record) {
            yaml_text_add(text, ", per_record: ");
            model_print_per_record(text, effect, i);
        }
        yaml_text_add(text, bare ? "" : "}");
    }
    yaml_text_add(text, "}");
}

/* ---- The fit block: one entry per line, or all in one pair of braces ---- */

static void print_fit_record(struct yaml_text *text, const struct fit_record *record)
{
    yaml_text_add(text, "{file: ");
    yaml_text_scalar(text, record->file);
    if (record->sha256[0])
        yaml_text_addf(text, ", sha256: \"%s\"", record->sha256);
    if (record->held_out)
        yaml_text_add(text, ", held_out: true");
    yaml_text_add(text, ", channels: [");
    for (size_t i = 0; i < record->n_channels; i++) {
        yaml_text_add(text, i ? ", {name: " : "{name: ");
        yaml_text_scalar(text, record->channels[i].name);
        add_pair(text, "nrmse", record->channels[i].nrmse, true);
        add_pair(text, "noise_ratio", record->channels[i].noise_ratio, true);
        if (record->channels[i].noise_rms > 0.0)
            add_pair(text, "noise_rms", record->channels[i].noise_rms, true);
        yaml_text_add(text, "}");
    }
    yaml_text_add(text, "]}");
}

void model_print_fit(struct yaml_text *text, const struct fit_info *fit, long indent)
{
    bool flow = indent < 0;
    char next[64], item[64];
    static const char *const keys[] = {"nrmse", "noise_ratio", "check_nrmse", "check_noise_ratio"};
    const double numbers[] = {fit->nrmse, fit->noise_ratio, fit->check_nrmse, fit->check_noise_ratio};
    int blanks = indent < 40 ? (int)indent : 40;
    (void)snprintf(next, sizeof next, flow ? ", " : "\n%*s", flow ? 0 : blanks, "");
    (void)snprintf(item, sizeof item, flow ? ", " : "\n%*s  - ", flow ? 0 : blanks, "");
    yaml_text_addf(text, "%sparent_sha256: \"%s\"", flow ? "{" : next, fit->parent_sha256);
    for (size_t i = 0; i < fit->n_ancestors; i++)
        yaml_text_addf(text, "%s%s\"%s\"", i ? ", " : next, i ? "" : "ancestors: [", fit->ancestors[i]);
    yaml_text_add(text, fit->n_ancestors ? "]" : "");
    if (fit->version[0]) {
        yaml_text_addf(text, "%sversion: ", next);
        yaml_text_scalar(text, fit->version);
    }
    if (fit->present) {
        yaml_text_addf(text, "%sconverged: %s", next, fit->converged ? "true" : "false");
        for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
            if (numbers[i] > 0.0) {
                yaml_text_addf(text, "%s%s: ", next, keys[i]);
                add_rounded(text, numbers[i]);
            }
        }
        yaml_text_addf(text, "%srecords:%s", next, flow ? " [" : "");
        for (size_t i = 0; i < fit->n_records; i++) {
            yaml_text_add(text, flow && i == 0 ? "" : item);
            print_fit_record(text, &fit->records[i]);
        }
        yaml_text_add(text, flow ? "]" : fit->n_records == 0 ? " []" : "");
    }
    yaml_text_add(text, flow ? "}" : "");
}

/* ---- The whole ---- */

static void print_interval(struct yaml_text *text, double from_m, double to_m)
{
    yaml_text_add(text, "[");
    yaml_text_number(text, from_m);
    yaml_text_add(text, ", ");
    yaml_text_number(text, to_m);
    yaml_text_add(text, "]");
}

/* The value alone, or "{value: …, …}" of a length that is a parameter. */
static void print_length(struct yaml_text *text, const struct parameter *p, bool listed, double value)
{
    struct parameter absent;
    struct yaml_parameter_text keys;
    if (!listed) {
        yaml_text_number(text, value);
        return;
    }
    model_parameter_init(&absent, p->name, p->unit, false);
    yaml_parameter_keys(p, &absent, &keys);
    yaml_text_addf(text, "{value: %s", keys.text[0]);
    for (int i = 1; i < YAML_PARAMETER_KEYS; i++)
        if (keys.text[i][0])
            yaml_text_addf(text, ", %s: %s", keys.key[i], keys.text[i]);
    yaml_text_add(text, "}");
}

static void print_beam(struct yaml_text *text, const struct model *m)
{
    yaml_text_add(text, "beam:\n  length_m: ");
    print_length(text, &m->own.length, m->own.lists_length, m->length_m);
    yaml_text_addf(text, "\n  support: %s\n", model_support_name(m->support));
    if (m->n_regions == 1 && strcmp(m->regions[0].name, "beam") == 0)
        return;
    double from_m = 0.0, to_m = 0.0;
    if ((m->own.lists_from || m->own.lists_to) && model_patch(m, &from_m, &to_m)) {
        yaml_text_add(text, "  patch_m: [");
        print_length(text, &m->own.from, m->own.lists_from, from_m);
        yaml_text_add(text, ", ");
        print_length(text, &m->own.to, m->own.lists_to, to_m);
        yaml_text_add(text, "]\n");
        return;
    }
    yaml_text_add(text, "  regions:\n");
    for (size_t i = 0; i < m->n_regions; i++) {
        yaml_text_addf(text, "    - {name: %s, from_m: ", m->regions[i].name);
        yaml_text_number(text, m->regions[i].from_m);
        yaml_text_add(text, ", to_m: ");
        yaml_text_number(text, m->regions[i].to_m);
        yaml_text_add(text, "}\n");
    }
}

/* Where the channel was in single records; NULL: nothing. */
static void print_stated(struct yaml_text *text, const struct model *m, const char *channel)
{
    bool any = false;
    for (size_t i = 0; channel != NULL && i < m->n_stated; i++) {
        if (strcmp(m->stated[i].channel, channel) != 0)
            continue;
        yaml_text_add(text, any ? ", " : ", per_record: {");
        yaml_text_scalar(text, m->stated[i].record);
        yaml_text_add(text, ": ");
        yaml_text_number(text, m->stated[i].at_m);
        any = true;
    }
    yaml_text_add(text, any ? "}" : "");
}

/* ", key: {value: …}" of what is a parameter, ", key: number" of what is not. */
static void print_own(struct yaml_text *text, const struct model *m, const char *channel, const struct parameter *p,
                      bool listed, double value)
{
    struct parameter absent = *p;
    struct yaml_parameter_text keys;
    if (!listed) {
        add_pair(text, p->name[0] ? p->name : "at_m", value, false);
        return;
    }
    yaml_channel_absent(m, &absent);
    yaml_parameter_keys(p, &absent, &keys);
    yaml_text_addf(text, ", %s: {value: %s", p->name, keys.text[0]);
    for (int i = 1; i < YAML_PARAMETER_KEYS; i++)
        if (keys.text[i][0])
            yaml_text_addf(text, ", %s: %s", keys.key[i], keys.text[i]);
    print_stated(text, m, strcmp(p->name, "at_m") == 0 ? channel : NULL);
    yaml_text_add(text, "}");
}

static void print_gain(struct yaml_text *text, const struct model *m, const struct channel_parameters *own)
{
    if (own->lists_gain || (own->gain.name[0] && !same(own->gain.value, 1.0)))
        print_own(text, m, NULL, &own->gain, own->lists_gain, own->gain.value);
}

static void print_mass(struct yaml_text *text, double mass_kg)
{
    if (!(mass_kg > 0.0))
        return;
    yaml_text_add(text, ", mass_kg: ");
    yaml_text_number(text, mass_kg);
}

static void print_channels(struct yaml_text *text, const struct model *m)
{
    yaml_text_add(text, m->n_inputs ? "inputs:\n" : "inputs: {}\n");
    for (size_t i = 0; i < m->n_inputs; i++) {
        const struct model_input *input = &m->inputs[i];
        yaml_text_add(text, "  ");
        yaml_text_scalar(text, input->name);
        yaml_text_addf(text, ": {kind: %s", model_input_kind_name(input->kind));
        if (input->kind == INPUT_POINT_FORCE) {
            print_own(text, m, input->name, &input->own.at, input->own.lists_at, input->at_m);
            print_gain(text, m, &input->own);
        } else {
            yaml_text_add(text, ", patch_m: ");
            print_interval(text, input->from_m, input->to_m);
        }
        yaml_text_add(text, input->level_per_record ? ", level: per_record}\n" : "}\n");
    }
    yaml_text_add(text, m->n_outputs ? "outputs:\n" : "outputs: {}\n");
    for (size_t i = 0; i < m->n_outputs; i++) {
        const struct model_output *output = &m->outputs[i];
        yaml_text_add(text, "  ");
        yaml_text_scalar(text, output->name);
        yaml_text_addf(text, ": {kind: %s", model_output_kind_name(output->kind));
        if (output->kind != OUTPUT_PATCH_STRAIN) {
            print_own(text, m, output->name, &output->own.at, output->own.lists_at, output->at_m);
            print_gain(text, m, &output->own);
            print_mass(text, output->mass_kg);
        } else {
            yaml_text_add(text, ", patch_m: ");
            print_interval(text, output->from_m, output->to_m);
        }
        yaml_text_add(text, "}\n");
    }
}

char *model_to_text(const struct model *m)
{
    struct yaml_text text = {0};
    yaml_text_add(&text, "format: beamfit-model/1\n");
    print_beam(&text, m);
    yaml_text_add(&text, "parameters:\n");
    for (size_t i = 0; i < m->n_materials; i++) {
        print_parameter(&text, &m->materials[i].EI, false);
        print_parameter(&text, &m->materials[i].rho, false);
        print_parameter(&text, &m->materials[i].cDI, false);
    }
    const struct parameter *const shared[] = {&m->gamma, &m->Ks, &m->KB};
    for (size_t i = 0; i < sizeof shared / sizeof *shared; i++)
        if (!shared[i]->fixed || shared[i]->value < 0.0 || shared[i]->value > 0.0)
            print_parameter(&text, shared[i], shared[i] != &m->gamma);
    for (size_t i = 0; i < m->n_residuals; i++) {
        const struct parameter *p = &m->residuals[i].compliance;
        if (p->fixed || p->sd > 0.0 || p->value < 0.0 || p->value > 0.0)
            print_parameter(&text, p, true);
    }
    print_channels(&text, m);
    yaml_text_add(&text, m->n_effects ? "effects:\n" : "effects: []\n");
    for (size_t i = 0; i < m->n_effects; i++) {
        yaml_text_add(&text, "  - ");
        model_print_effect(&text, m, &m->effects[i]);
        yaml_text_add(&text, "\n");
    }
    if (m->steps_per_sample > 0)
        yaml_text_addf(&text, "steps_per_sample: %d\n", m->steps_per_sample);
    model_print_board(&text, &m->board);
    if (m->fit.present || m->fit.parent_sha256[0]) {
        yaml_text_add(&text, "fit:");
        model_print_fit(&text, &m->fit, 2);
        yaml_text_add(&text, "\n");
    }
    return text.s;
}
