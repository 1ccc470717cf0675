/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_yaml_edit.c — saving by editing. The old text is read again; wherever the model it states differs from the model
 * to save, the bytes of that value are replaced, or a key, item or block is inserted or taken out. The result is read
 * back and must state exactly the model; otherwise there is no result, and the caller writes a new file.
 */
#include "model_parts.h"
#include "model_yaml_splice.h"

#include <stdlib.h>
#include <string.h>

struct editor {
    struct splicer splicer;
    const struct yaml_node *root;
    const struct model *old, *new;
};

/* ---- Parameters ---- */

/*
 * The parameter `name` of mapping `owner`, or, without an owner, the mapping `node` itself; per_record: "" or the text of that key.
 */
static void edit_node(struct editor *e, const struct yaml_node *owner, const struct yaml_node *node,
                      const struct parameter *old, const struct parameter *new, const struct parameter *absent,
                      const char *old_per_record, const char *per_record)
{
    struct yaml_parameter_text before, after;
    yaml_parameter_keys(old, absent, &before);
    yaml_parameter_keys(new, absent, &after);
    bool differs = strcmp(old_per_record, per_record) != 0, bare = !per_record[0];
    for (int i = 0; i < YAML_PARAMETER_KEYS; i++) {
        differs = differs || strcmp(before.text[i], after.text[i]) != 0;
        bare = bare && (i == 0 || !after.text[i][0]);
    }
    if (!differs)
        return;
    if (node && node->kind == YAML_MAPPING) {
        for (int i = 0; i < YAML_PARAMETER_KEYS; i++) {
            const char *text = after.text[i];
            if (i == YAML_PARAMETER_FIXED && !text[0] && splice_index(node, "fixed") >= 0)
                text = new->fixed ? "true" : "false";
            if (strcmp(before.text[i], after.text[i]) != 0)
                splice_set_pair(&e->splicer, node, after.key[i], text);
        }
        /* a place whose prior is told by `sd`, which now is what a fit found */
        if (after.text[YAML_PARAMETER_PRIOR][0] && splice_index(node, "prior") < 0 && splice_index(node, "prior_m") < 0)
            splice_set_pair(&e->splicer, node, "prior", after.text[YAML_PARAMETER_PRIOR]);
        if (strcmp(old_per_record, per_record) != 0)
            splice_set_pair(&e->splicer, node, "per_record", per_record);
        return;
    }
    struct yaml_text whole = {0};
    yaml_text_addf(&whole, node && bare ? "%s" : "{value: %s", after.text[0]);
    for (int i = 1; i < YAML_PARAMETER_KEYS; i++)
        if (after.text[i][0])
            yaml_text_addf(&whole, ", %s: %s", after.key[i], after.text[i]);
    if (per_record[0]) {
        yaml_text_add(&whole, ", per_record: ");
        yaml_text_add(&whole, per_record);
    }
    yaml_text_add(&whole, node && bare ? "" : "}");
    if (owner)
        splice_set_pair(&e->splicer, owner, new->name, whole.s);
    free(whole.s);
}

static void edit_parameter(struct editor *e, const struct yaml_node *owner, const struct parameter *old,
                           const struct parameter *new, const struct parameter *absent, const char *old_per_record,
                           const char *per_record)
{
    edit_node(e, owner, yaml_get(owner, new->name, NULL), old, new, absent, old_per_record, per_record);
}

/* The length and the edges of the patch where they are parameters. */
static void edit_beam(struct editor *e)
{
    const struct geometry_parameters *old = &e->old->own, *new = &e->new->own;
    const struct yaml_node *beam = yaml_get(e->root, "beam", NULL), *patch = yaml_get(beam, "patch_m", NULL);
    struct parameter absent;
    model_parameter_init(&absent, "", "m", false);
    if (old->lists_length && new->lists_length)
        edit_parameter(e, beam, &old->length, &new->length, &absent, "", "");
    if (old->lists_from && new->lists_from)
        edit_node(e, NULL, patch->value[0], &old->from, &new->from, &absent, "", "");
    if (old->lists_to && new->lists_to)
        edit_node(e, NULL, patch->value[1], &old->to, &new->to, &absent, "", "");
}

static void edit_shared(struct editor *e, const struct yaml_node *owner, const struct parameter *old,
                        const struct parameter *new, bool may_be_negative)
{
    struct parameter absent;
    model_parameter_init(&absent, new->name, new->unit, may_be_negative);
    edit_parameter(e, owner, old, new, &absent, "", "");
}

static void edit_parameters(struct editor *e)
{
    const struct yaml_node *node = yaml_get(e->root, "parameters", NULL);
    if (e->old->n_materials != e->new->n_materials || e->old->n_residuals != e->new->n_residuals) {
        e->splicer.failed = true;
        return;
    }
    for (size_t i = 0; i < e->new->n_materials; i++) {
        edit_shared(e, node, &e->old->materials[i].EI, &e->new->materials[i].EI, false);
        edit_shared(e, node, &e->old->materials[i].rho, &e->new->materials[i].rho, false);
        edit_shared(e, node, &e->old->materials[i].cDI, &e->new->materials[i].cDI, false);
    }
    edit_shared(e, node, &e->old->gamma, &e->new->gamma, false);
    edit_shared(e, node, &e->old->Ks, &e->new->Ks, true);
    edit_shared(e, node, &e->old->KB, &e->new->KB, true);
    for (size_t i = 0; i < e->new->n_residuals; i++)
        edit_shared(e, node, &e->old->residuals[i].compliance, &e->new->residuals[i].compliance, true);
}

/* Places and gains that are parameters; where that changes the file is written anew. */
static void edit_own(struct editor *e, const struct yaml_node *channel, const struct channel_parameters *old,
                     const struct channel_parameters *new)
{
    struct parameter absent = new->at;
    yaml_channel_absent(e->new, &absent);
    if (old->lists_at && new->lists_at)
        edit_parameter(e, channel, &old->at, &new->at, &absent, "", "");
    absent = new->gain;
    yaml_channel_absent(e->new, &absent);
    if (old->lists_gain && new->lists_gain)
        edit_parameter(e, channel, &old->gain, &new->gain, &absent, "", "");
}

/* A channel that is held at the free end, which has moved. */
static void edit_held(struct editor *e, const struct yaml_node *channel, const struct channel_parameters *own,
                      double old_m, double new_m)
{
    char before[DECIMAL_TEXT], after[DECIMAL_TEXT];
    decimal_print(before, old_m);
    decimal_print(after, new_m);
    if (!own->lists_at && strcmp(before, after) != 0)
        splice_set_pair(&e->splicer, channel, "at_m", after);
}

static void edit_channels(struct editor *e)
{
    const struct yaml_node *inputs = yaml_get(e->root, "inputs", NULL), *outputs = yaml_get(e->root, "outputs", NULL);
    for (size_t i = 0; i < e->new->n_inputs &&i < e->old->n_inputs; i++) {
        const struct yaml_node *channel = yaml_get(inputs, e->new->inputs[i].name, NULL);
        edit_own(e, channel, &e->old->inputs[i].own, &e->new->inputs[i].own);
        edit_held(e, channel, &e->new->inputs[i].own, e->old->inputs[i].at_m, e->new->inputs[i].at_m);
    }
    for (size_t i = 0; i < e->new->n_outputs &&i < e->old->n_outputs; i++) {
        const struct yaml_node *channel = yaml_get(outputs, e->new->outputs[i].name, NULL);
        edit_own(e, channel, &e->old->outputs[i].own, &e->new->outputs[i].own);
        edit_held(e, channel, &e->new->outputs[i].own, e->old->outputs[i].at_m, e->new->outputs[i].at_m);
    }
}

/* ---- Effects ---- */

static char *per_record_text(const struct model_effect *effect, int slot)
{
    struct yaml_text text = {0};
    yaml_text_add(&text, "");
    if (model_has_per_record(effect, slot))
        model_print_per_record(&text, effect, slot);
    return text.s;
}

static void edit_effect(struct editor *e, const struct yaml_node *node, const struct model_effect *old,
                        const struct model_effect *new)
{
    for (int i = 0; i < new->effect->n_parameters; i++) {
        struct parameter absent;
        char *before = per_record_text(old, i), *after = per_record_text(new, i);
        model_effect_parameter(e->new, new->effect, i, &absent);
        edit_parameter(e, node, &old->parameters[i], &new->parameters[i], &absent, before, after);
        free(before);
        free(after);
    }
}

/* New key at the end of the file (or of the root's braces). */
static void append_section(struct editor *e, const char *key, const char *value)
{
    if (e->root->flow) {
        splice_append_pair(&e->splicer, e->root, key, value);
        return;
    }
    struct yaml_text section = {0};
    char *indent = splice_line_break(e->root->key[0]->column);
    yaml_text_add(&section,
                  e->splicer.n_text > 0 && e->splicer.text[e->splicer.n_text - 1] == '\n' ? indent + 1 : indent);
    yaml_text_addf(&section, "%s:", key);
    yaml_text_add(&section, value);
    yaml_text_add(&section, "\n");
    splice_replace(&e->splicer, e->splicer.n_text, e->splicer.n_text, section.s);
    free(indent);
    free(section.s);
}

/* One item at the end of the list of effects, whatever form the list has. */
static void append_effects(struct editor *e, size_t first, bool list_is_empty)
{
    const struct yaml_node *list = yaml_get(e->root, "effects", NULL);
    bool block = !e->root->flow && (list_is_empty || !list->flow);
    bool keep = list && list->kind == YAML_SEQUENCE && list->n > 0;
    char *indent = splice_line_break(block && keep ? list->column : e->root->key[0]->column + 2);
    struct yaml_text items = {0};
    yaml_text_add(&items, block || !list_is_empty ? "" : "[");
    for (size_t i = first; i < e->new->n_effects; i++) {
        if (block) {
            yaml_text_add(&items, indent);
            yaml_text_add(&items, "- ");
        } else if (i > first || !list_is_empty) {
            yaml_text_add(&items, ", ");
        }
        model_print_effect(&items, e->new, &e->new->effects[i]);
    }
    yaml_text_add(&items, block || !list_is_empty ? "" : "]");
    if (!list) {
        append_section(e, "effects", items.s);
    } else if (!list_is_empty) {
        size_t end = list->value[list->n - 1]->to;
        size_t at = block ? splice_end_of_line(&e->splicer, end) : end;
        splice_replace(&e->splicer, at, at, items.s);
    } else {
        const struct yaml_node *key = NULL;
        (void)yaml_get(e->root, "effects", &key);
        splice_replace3(&e->splicer, splice_after_colon(&e->splicer, key), list->to, block ? "" : " ", items.s, "");
    }
    free(indent);
    free(items.s);
}

static bool same_use(const struct model_effect *a, const struct model_effect *b)
{
    return a->effect == b->effect && strcmp(a->channel, b->channel) == 0;
}

static void edit_effects(struct editor *e)
{
    const struct yaml_node *list = yaml_get(e->root, "effects", NULL), *key = NULL;
    const struct model *old = e->old, *new = e->new;
    size_t next = 0, n_kept = 0;
    bool *kept = bf_alloc(old->n_effects, sizeof *kept);
    for (size_t i = 0; i < old->n_effects; i++) {
        kept[i] = next < new->n_effects &&same_use(&old->effects[i], &new->effects[next]);
        if (kept[i])
            edit_effect(e, list->value[i], &old->effects[i], &new->effects[next++]);
        n_kept += kept[i];
    }
    bool empty = n_kept == 0;
    if (empty && old->n_effects > 0 && list->flow) {
        splice_replace(&e->splicer, list->from, list->to, "[]");
        e->splicer.failed = e->splicer.failed || new->n_effects > 0;
    } else {
        bool first_left = true;
        for (size_t i = 0; i < old->n_effects; i++) {
            if (!kept[i])
                splice_delete_item(&e->splicer, list, i, first_left);
            first_left = first_left && !kept[i];
        }
        if (empty && old->n_effects > 0 && new->n_effects == 0) {
            (void)yaml_get(e->root, "effects", &key);
            size_t at = splice_after_colon(&e->splicer, key);
            splice_replace(&e->splicer, at, at, " []");
        }
    }
    if (next < new->n_effects)
        append_effects(e, next, empty && old->n_effects == 0);
    free(kept);
}

/* ---- Fit block, and the whole ---- */

static void edit_fit(struct editor *e)
{
    struct yaml_text before = {0}, after = {0};
    const struct yaml_node *key = NULL, *node = yaml_get(e->root, "fit", &key);
    model_print_fit(&before, &e->old->fit, -1);
    model_print_fit(&after, &e->new->fit, -1);
    bool wanted = e->new->fit.present || e->new->fit.parent_sha256[0];
    if (strcmp(before.s, after.s) != 0 || wanted != (node != NULL)) {
        struct yaml_text block = {0};
        if (wanted)
            model_print_fit(&block, &e->new->fit,
                            e->root->flow || (node && node->flow) ? -1 : e->root->key[0]->column + 2);
        if (!node && wanted)
            append_section(e, "fit", block.s);
        else if (node && wanted)
            splice_replace3(&e->splicer, splice_after_colon(&e->splicer, key), node->to, block.s[0] == '\n' ? "" : " ",
                            block.s, "");
        else if (node)
            splice_delete_pair(&e->splicer, e->root, (size_t)splice_index(e->root, "fit"));
        free(block.s);
    }
    free(before.s);
    free(after.s);
}

static void edit_steps(struct editor *e)
{
    char steps[16] = "";
    if (e->new->steps_per_sample == e->old->steps_per_sample)
        return;
    if (e->new->steps_per_sample > 0)
        (void)snprintf(steps, sizeof steps, " %d", e->new->steps_per_sample);
    if (e->old->steps_per_sample > 0)
        splice_set_pair(&e->splicer, e->root, "steps_per_sample", steps + (steps[0] == ' '));
    else
        append_section(e, "steps_per_sample", steps);
}

static bool states(const char *text, const struct model *model)
{
    struct bf_error err;
    struct yaml_node *root;
    struct model read = {0};
    if (yaml_parse("", text, strlen(text), &root, &err) != BF_OK)
        return false;
    bool same = false;
    if (model_from_yaml("", root, &read, &err) == BF_OK) {
        char *wanted = model_to_text(model), *got = model_to_text(&read);
        same = strcmp(wanted, got) == 0;
        free(wanted);
        free(got);
    }
    yaml_free(root);
    model_free(&read);
    return same;
}

char *model_edit_text(const char *text, size_t n, const struct model *model)
{
    struct bf_error err;
    struct yaml_node *root;
    struct model old = {0};
    if (yaml_parse("", text, n, &root, &err) != BF_OK)
        return NULL;
    struct editor e = {.splicer = {.text = text, .n_text = n}, .root = root, .old = &old, .new = model};
    char *result = NULL;
    if (model_from_yaml("", root, &old, &err) == BF_OK) {
        edit_beam(&e);
        edit_parameters(&e);
        edit_channels(&e);
        edit_effects(&e);
        edit_steps(&e);
        edit_fit(&e);
        result = splice_apply(&e.splicer);
    }
    if (result && (e.splicer.failed || !states(result, model))) {
        free(result);
        result = NULL;
    }
    splice_free(&e.splicer);
    yaml_free(root);
    model_free(&old);
    return result;
}
