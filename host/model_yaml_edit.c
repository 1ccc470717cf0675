/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_yaml_edit.c — saving by editing. The old text is read again; wherever the model it states differs from the model
 * to save, the bytes of that value are replaced, or a key, item or block is inserted or taken out. The result is read
 * back and must state exactly the model; otherwise there is no result, and the caller writes a new file.
 */
#include "model_yaml.h"

#include <stdlib.h>
#include <string.h>

struct edit {
    size_t from, to; /* bytes of the old text to replace */
    char *text;
    size_t order;
};

struct editor {
    const char *text;
    size_t n_text;
    const struct yaml_node *root;
    const struct model *old, *new;
    struct edit *edits;
    size_t n;
    bool failed;
};

static void replace(struct editor *e, size_t from, size_t to, const char *text)
{
    e->edits = bf_grow(e->edits, e->n + 1, sizeof *e->edits);
    e->edits[e->n] = (struct edit){.from = from, .to = to, .text = bf_strdup(text), .order = e->n};
    e->n++;
}

static void replacef(struct editor *e, size_t from, size_t to, const char *before, const char *text, const char *after)
{
    struct yaml_text all = {0};
    yaml_text_add(&all, before);
    yaml_text_add(&all, text);
    yaml_text_add(&all, after);
    replace(e, from, to, all.s);
    free(all.s);
}

/* ---- Places in the text ---- */

static size_t end_of_line(const struct editor *e, size_t at)
{
    const char *newline = at < e->n_text ? memchr(e->text + at, '\n', e->n_text - at) : NULL;
    size_t end = newline ? (size_t)(newline - e->text) : e->n_text;
    return end > at && e->text[end - 1] == '\r' ? end - 1 : end;
}

static size_t start_of_next_line(const struct editor *e, size_t at)
{
    const char *newline = at < e->n_text ? memchr(e->text + at, '\n', e->n_text - at) : NULL;
    return newline ? (size_t)(newline - e->text) + 1 : e->n_text;
}

/* Start of the line of `at` when nothing but the characters of `allowed` stands before it; else fails. */
static size_t start_of_line(struct editor *e, size_t at, const char *allowed)
{
    while (at > 0 && e->text[at - 1] != '\n') {
        at--;
        if (!strchr(allowed, e->text[at]))
            e->failed = true;
    }
    return at;
}

static size_t after_colon(struct editor *e, const struct yaml_node *key)
{
    const char *colon = memchr(e->text + key->to, ':', e->n_text - key->to);
    if (!colon)
        e->failed = true;
    return colon ? (size_t)(colon - e->text) + 1 : 0;
}

/* "\n" and so many blanks. */
static char *line_break(long indent)
{
    char *text = bf_alloc((size_t)indent + 2, 1);
    text[0] = '\n';
    memset(text + 1, ' ', (size_t)indent);
    return text;
}

/* ---- Mappings ---- */

/* index < 0: the key is absent. */
static long index_of(const struct yaml_node *mapping, const char *key)
{
    for (size_t i = 0; i < mapping->n; i++)
        if (strcmp(mapping->key[i]->text, key) == 0)
            return (long)i;
    return -1;
}

/* "key: value" after the last pair of a mapping that has one. */
static void append_pair(struct editor *e, const struct yaml_node *mapping, const char *key, const char *value)
{
    struct yaml_text pair = {0};
    const struct yaml_node *last = mapping->n > 0 ? mapping->value[mapping->n - 1] : NULL;
    if (!last) {
        e->failed = true;
        return;
    }
    if (mapping->flow) {
        yaml_text_add(&pair, ", ");
    } else {
        char *indent = line_break(mapping->key[0]->column);
        yaml_text_add(&pair, indent);
        free(indent);
    }
    yaml_text_add(&pair, key);
    yaml_text_add(&pair, ": ");
    yaml_text_add(&pair, value);
    size_t at = mapping->flow ? last->to : end_of_line(e, last->to);
    replace(e, at, at, pair.s);
    free(pair.s);
}

static void delete_pair(struct editor *e, const struct yaml_node *mapping, size_t i)
{
    if (!mapping->flow)
        replace(e, start_of_line(e, mapping->key[i]->from, " "), start_of_next_line(e, mapping->value[i]->to), "");
    else if (i > 0)
        replace(e, mapping->value[i - 1]->to, mapping->value[i]->to, "");
    else
        replace(e, mapping->key[0]->from, mapping->n > 1 ? mapping->key[1]->from : mapping->value[0]->to, "");
}

/* value "" takes the key out. */
static void set_pair(struct editor *e, const struct yaml_node *mapping, const char *key, const char *value)
{
    long i = index_of(mapping, key);
    if (i >= 0 && value[0] && mapping->value[i]->from == mapping->value[i]->to)
        replacef(e, mapping->value[i]->from, mapping->value[i]->to, " ", value, "");
    else if (i >= 0 && value[0])
        replace(e, mapping->value[i]->from, mapping->value[i]->to, value);
    else if (i >= 0)
        delete_pair(e, mapping, (size_t)i);
    else if (value[0])
        append_pair(e, mapping, key, value);
}

/* ---- Parameters ---- */

/* The parameter `name` of mapping `owner`; per_record: "" or the text of that key. */
static void edit_parameter(struct editor *e, const struct yaml_node *owner, const struct parameter *old,
                           const struct parameter *new, const struct parameter *absent, const char *old_per_record,
                           const char *per_record)
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
    const struct yaml_node *node = yaml_get(owner, new->name, NULL);
    if (node && node->kind == YAML_MAPPING) {
        for (int i = 0; i < YAML_PARAMETER_KEYS; i++) {
            const char *text = after.text[i];
            if (i == YAML_PARAMETER_FIXED && !text[0] && index_of(node, "fixed") >= 0)
                text = new->fixed ? "true" : "false";
            if (strcmp(before.text[i], after.text[i]) != 0)
                set_pair(e, node, after.key[i], text);
        }
        if (strcmp(old_per_record, per_record) != 0)
            set_pair(e, node, "per_record", per_record);
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
    set_pair(e, owner, new->name, whole.s);
    free(whole.s);
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
    if (e->old->n_materials != e->new->n_materials) {
        e->failed = true;
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

static void delete_item(struct editor *e, const struct yaml_node *list, size_t i, bool is_first_left)
{
    if (!list->flow)
        replace(e, start_of_line(e, list->value[i]->from, " -"), start_of_next_line(e, list->value[i]->to), "");
    else if (!is_first_left)
        replace(e, list->value[i - 1]->to, list->value[i]->to, "");
    else
        replace(e, list->value[i]->from, i + 1 < list->n ? list->value[i + 1]->from : list->value[i]->to, "");
}

/* New key at the end of the file (or of the root's braces). */
static void append_section(struct editor *e, const char *key, const char *value)
{
    if (e->root->flow) {
        append_pair(e, e->root, key, value);
        return;
    }
    struct yaml_text section = {0};
    char *indent = line_break(e->root->key[0]->column);
    yaml_text_add(&section, e->n_text > 0 && e->text[e->n_text - 1] == '\n' ? indent + 1 : indent);
    yaml_text_addf(&section, "%s:", key);
    yaml_text_add(&section, value);
    yaml_text_add(&section, "\n");
    replace(e, e->n_text, e->n_text, section.s);
    free(indent);
    free(section.s);
}

/* One item at the end of the list of effects, whatever form the list has. */
static void append_effects(struct editor *e, size_t first, bool list_is_empty)
{
    const struct yaml_node *list = yaml_get(e->root, "effects", NULL);
    bool block = !e->root->flow && (list_is_empty || !list->flow);
    bool keep = list && list->kind == YAML_SEQUENCE && list->n > 0;
    char *indent = line_break(block && keep ? list->column : e->root->key[0]->column + 2);
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
        size_t at = block ? end_of_line(e, end) : end;
        replace(e, at, at, items.s);
    } else {
        const struct yaml_node *key = NULL;
        (void)yaml_get(e->root, "effects", &key);
        replacef(e, after_colon(e, key), list->to, block ? "" : " ", items.s, "");
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
        replace(e, list->from, list->to, "[]");
        e->failed = e->failed || new->n_effects > 0;
    } else {
        bool first_left = true;
        for (size_t i = 0; i < old->n_effects; i++) {
            if (!kept[i])
                delete_item(e, list, i, first_left);
            first_left = first_left && !kept[i];
        }
        if (empty && old->n_effects > 0 && new->n_effects == 0) {
            (void)yaml_get(e->root, "effects", &key);
            size_t at = after_colon(e, key);
            replace(e, at, at, " []");
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
            replacef(e, after_colon(e, key), node->to, block.s[0] == '\n' ? "" : " ", block.s, "");
        else if (node)
            delete_pair(e, e->root, (size_t)index_of(e->root, "fit"));
        free(block.s);
    }
    free(before.s);
    free(after.s);
}

static int by_place(const void *a, const void *b)
{
    const struct edit *p = a, *q = b;
    if (p->from != q->from)
        return p->from < q->from ? -1 : 1;
    return p->order < q->order ? -1 : p->order > q->order;
}

static void add_bytes(struct yaml_text *out, const char *text, size_t n)
{
    char *piece = bf_alloc(n + 1, 1);
    memcpy(piece, text, n);
    yaml_text_add(out, piece);
    free(piece);
}

/* The old text with all edits; line ends of the inserted pieces follow the file's. */
static char *apply(struct editor *e)
{
    struct yaml_text out = {0};
    size_t at = 0, first_line = end_of_line(e, 0);
    bool crlf = first_line < e->n_text && e->text[first_line] == '\r';
    yaml_text_add(&out, "");
    if (e->n > 0)
        qsort(e->edits, e->n, sizeof *e->edits, by_place);
    for (size_t i = 0; i < e->n; i++) {
        const struct edit *edit = &e->edits[i];
        if (edit->from < at || edit->to < edit->from) {
            e->failed = true; /* two edits want the same bytes */
            break;
        }
        add_bytes(&out, e->text + at, edit->from - at);
        for (const char *c = edit->text; *c; c++)
            add_bytes(&out, crlf && *c == '\n' ? "\r\n" : c, crlf && *c == '\n' ? 2 : 1);
        at = edit->to;
    }
    add_bytes(&out, e->text + at, e->n_text - at);
    return out.s;
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
    struct editor e = {.text = text, .n_text = n, .root = root, .old = &old, .new = model};
    e.failed = model_from_yaml("", root, &old, &err) != BF_OK;
    if (!e.failed) {
        edit_parameters(&e);
        edit_effects(&e);
        edit_fit(&e);
    }
    char *result = e.failed ? NULL : apply(&e);
    if (result && (e.failed || !states(result, model))) {
        free(result);
        result = NULL;
    }
    for (size_t i = 0; i < e.n; i++)
        free(e.edits[i].text);
    free(e.edits);
    yaml_free(root);
    model_free(&old);
    return result;
}
