/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * model_yaml.c — text to a tree with byte positions. libfyaml delivers events only: nothing of it is recursive, no alias
 * is ever expanded, and every limit is enforced while the tree grows.
 */
#include "model_yaml.h"

#include <libfyaml.h>
#include <stdlib.h>
#include <string.h>

struct builder {
    const char *path, *text;
    size_t n_text;
    struct fy_parser *parser;
    struct bf_error *err;
    size_t n_nodes;
    size_t end; /* of the last token */
    struct yaml_node *stack[YAML_DEPTH];
    struct yaml_node *pending_key[YAML_DEPTH];
    size_t depth;
    struct yaml_node *root;
    int n_documents;
};

static void free_children(struct yaml_node *node)
{
    free(node->text);
    free(node->key);
    free(node->value);
    free(node);
}

/* Depth is bounded by YAML_DEPTH. */
void yaml_free(struct yaml_node *node)
{
    if (!node)
        return;
    for (size_t i = 0; i < node->n; i++) {
        if (node->key)
            yaml_free(node->key[i]);
        yaml_free(node->value[i]);
    }
    free_children(node);
}

const struct yaml_node *yaml_get(const struct yaml_node *mapping, const char *key, const struct yaml_node **key_node)
{
    if (!mapping || mapping->kind != YAML_MAPPING)
        return NULL;
    for (size_t i = 0; i < mapping->n; i++) {
        if (strcmp(mapping->key[i]->text, key) == 0) {
            if (key_node)
                *key_node = mapping->key[i];
            return mapping->value[i];
        }
    }
    return NULL;
}

bool yaml_is_nothing(const struct yaml_node *node)
{
    return node->kind == YAML_SCALAR && node->plain &&
           (node->text[0] == '\0' || strcmp(node->text, "null") == 0 || strcmp(node->text, "~") == 0);
}

static enum bf_status append(struct builder *b, struct yaml_node *node)
{
    if (b->depth == 0) {
        b->root = node;
        return BF_OK;
    }
    struct yaml_node *parent = b->stack[b->depth - 1];
    struct yaml_node **key = &b->pending_key[b->depth - 1];
    if (parent->kind == YAML_MAPPING && !*key) {
        if (node->kind != YAML_SCALAR) {
            long line = node->line;
            yaml_free(node);
            return bf_fail_at(b->err, b->path, line, "a key is a list or a mapping; use a plain name as key");
        }
        if (yaml_get(parent, node->text, NULL)) {
            (void)bf_fail_at(b->err, b->path, node->line, "key '%.60s' stands twice; delete one of them", node->text);
            yaml_free(node);
            return b->err->status;
        }
        *key = node;
        return BF_OK;
    }
    if ((parent->n & (parent->n + 1)) == 0) { /* room doubles at 0, 1, 3, 7, … */
        size_t room = 2 * parent->n + 1;
        parent->value = bf_grow(parent->value, room, sizeof(struct yaml_node *));
        if (parent->kind == YAML_MAPPING)
            parent->key = bf_grow(parent->key, room, sizeof(struct yaml_node *));
    }
    parent->value[parent->n] = node;
    if (parent->kind == YAML_MAPPING) {
        parent->key[parent->n] = *key;
        *key = NULL;
    }
    parent->n++;
    return BF_OK;
}

static struct yaml_node *new_node(const struct builder *b, enum yaml_kind kind, struct fy_event *event)
{
    struct yaml_node *node = bf_alloc(1, sizeof *node);
    const struct fy_mark *start = fy_event_start_mark(event), *end = fy_event_end_mark(event);
    node->kind = kind;
    node->from = start ? start->input_pos : b->end;
    node->to = start && end ? end->input_pos : node->from;
    node->line = start ? start->line + 1L : 0;
    node->column = start ? start->column : 0;
    return node;
}

/* `key:` followed by nothing has no token: its place is after the colon of its key. */
static void place_nothing(struct builder *b, struct yaml_node *node)
{
    const struct yaml_node *key = b->depth > 0 ? b->pending_key[b->depth - 1] : NULL;
    const char *colon = key ? memchr(b->text + key->to, ':', b->n_text - key->to) : NULL;
    node->from = node->to = colon ? (size_t)(colon - b->text) + 1 : b->end;
    node->line = key ? key->line : 1;
    node->column = key ? key->column : 0;
    node->plain = true;
    node->text = bf_strdup("");
}

/* libfyaml 0.7.12 returns another text for two escaped quotes in a row between single quotes ('it''''s'): such a text is refused. */
static bool is_misread(const struct builder *b, const struct yaml_node *node, enum fy_node_style style)
{
    return style == FYNS_SINGLE_QUOTED && node->to >= node->from &&
           memmem(b->text + node->from, node->to - node->from, "''''", 4) != NULL;
}

static enum bf_status on_scalar(struct builder *b, struct fy_event *event)
{
    struct yaml_node *node = new_node(b, YAML_SCALAR, event);
    struct fy_token *token = fy_event_get_token(event);
    size_t n = 0;
    const char *text = token ? fy_token_get_text(token, &n) : NULL;
    enum fy_node_style style = fy_event_get_node_style(event);
    if (!text || !fy_event_start_mark(event)) {
        place_nothing(b, node);
        return append(b, node);
    }
    const bool misread = is_misread(b, node, style);
    if (misread || memchr(text, '\0', n)) {
        long line = node->line;
        yaml_free(node);
        return bf_fail_at(b->err, b->path, line,
                          misread ? "a text in single quotes has '''' inside; write it in double quotes"
                                  : "the text contains a zero byte; delete it");
    }
    node->plain = style == FYNS_PLAIN;
    node->text = bf_alloc(n + 1, 1);
    memcpy(node->text, text, n);
    if (style == FYNS_SINGLE_QUOTED || style == FYNS_DOUBLE_QUOTED) { /* marks lie inside the quotes */
        node->from--;
        node->to++;
    }
    b->end = node->to;
    return append(b, node);
}

static enum bf_status on_start(struct builder *b, struct fy_event *event, enum yaml_kind kind)
{
    struct yaml_node *node = new_node(b, kind, event);
    long line = node->line;
    node->flow = fy_event_get_node_style(event) == FYNS_FLOW;
    bool as_key = b->depth > 0 && b->stack[b->depth - 1]->kind == YAML_MAPPING && !b->pending_key[b->depth - 1];
    if (b->depth == YAML_DEPTH || as_key) {
        yaml_free(node);
        return bf_fail_at(b->err, b->path, line,
                          as_key ? "a key is a list or a mapping; use a plain name as key"
                                 : "nested deeper than a model file ever is; is this a model?");
    }
    enum bf_status status = append(b, node);
    if (status != BF_OK)
        return status;
    b->stack[b->depth] = node;
    b->pending_key[b->depth++] = NULL;
    return BF_OK;
}

static void on_end(struct builder *b, struct fy_event *event)
{
    struct yaml_node *node = b->stack[--b->depth];
    const struct fy_mark *end = fy_event_end_mark(event);
    if (node->flow && end)
        b->end = end->input_pos;
    else if (node->n > 0) {
        const struct yaml_node *first = node->key ? node->key[0] : node->value[0];
        node->from = first->from;
        b->end = node->value[node->n - 1]->to;
    }
    node->to = b->end;
}

static bool has_tag_or_anchor(const struct fy_event *event)
{
    switch (event->type) {
    case FYET_SCALAR:
        return event->scalar.tag || event->scalar.anchor;
    case FYET_MAPPING_START:
        return event->mapping_start.tag || event->mapping_start.anchor;
    case FYET_SEQUENCE_START:
        return event->sequence_start.tag || event->sequence_start.anchor;
    default:
        return false;
    }
}

static enum bf_status on_event(struct builder *b, struct fy_event *event)
{
    const struct fy_mark *mark = fy_event_start_mark(event);
    long line = mark ? mark->line + 1L : 0;
    if (++b->n_nodes > YAML_NODES)
        return bf_fail_at(b->err, b->path, line, "more than %d entries; is this a model?", YAML_NODES);
    if (has_tag_or_anchor(event))
        return bf_fail_at(b->err, b->path, line, "tags ('!') and anchors ('&') are not used in model files; delete it");
    switch (event->type) {
    case FYET_DOCUMENT_START:
        if (++b->n_documents > 1)
            return bf_fail_at(b->err, b->path, 0, "more than one document ('---'); keep one model per file");
        return BF_OK;
    case FYET_ALIAS:
        return bf_fail_at(b->err, b->path, line, "references ('*name') are not used in model files; write the value");
    case FYET_SCALAR:
        return on_scalar(b, event);
    case FYET_MAPPING_START:
        return on_start(b, event, YAML_MAPPING);
    case FYET_SEQUENCE_START:
        return on_start(b, event, YAML_SEQUENCE);
    case FYET_MAPPING_END:
    case FYET_SEQUENCE_END:
        if (b->depth > 0)
            on_end(b, event);
        return BF_OK;
    default:
        return BF_OK;
    }
}

/* Byte offset of the first byte that is not UTF-8 text, or n. */
static size_t not_text(const char *text, size_t n)
{
    static const unsigned least[5] = {0, 0, 0x80, 0x800, 0x10000};
    for (size_t i = 0; i < n;) {
        unsigned char c = (unsigned char)text[i];
        size_t length = c < 0x80 ? 1 : c >= 0xF0 ? 4 : c >= 0xE0 ? 3 : 2;
        unsigned code = length == 1 ? c : c & (0x7FU >> length);
        if ((c >= 0x80 && c < 0xC2) || c > 0xF4 || length > n - i)
            return i;
        for (size_t k = 1; k < length; k++) {
            if (((unsigned char)text[i + k] & 0xC0U) != 0x80U)
                return i;
            code = code << 6 | ((unsigned char)text[i + k] & 0x3FU);
        }
        bool surrogate = code >= 0xD800 && code < 0xE000;
        bool control = (code < 0x20 && code != '\t' && code != '\n' && code != '\r') || code == 0x7F;
        if (code < least[length] || code > 0x10FFFF || surrogate || control)
            return i;
        i += length;
    }
    return n;
}

static enum bf_status check_text(const char *path, const char *text, size_t n, struct bf_error *err)
{
    if (n > YAML_BYTES)
        return bf_fail_at(err, path, 0, "larger than %d bytes, which no model is; give the model file, not a record",
                          YAML_BYTES);
    size_t bad = not_text(text, n);
    if (bad < n) {
        long line = 1;
        for (size_t i = 0; i < bad; i++)
            line += text[i] == '\n';
        return bf_fail_at(err, path, line,
                          "not a text file (byte 0x%02x is not UTF-8 text); give a model file, or save "
                          "it as UTF-8",
                          (unsigned)(unsigned char)text[bad]);
    }
    return BF_OK;
}

static enum bf_status parse_events(struct builder *b)
{
    enum bf_status status = BF_OK;
    struct fy_event *event;
    while (status == BF_OK && (event = fy_parser_parse(b->parser)) != NULL) {
        status = on_event(b, event);
        fy_parser_event_free(b->parser, event);
    }
    return status;
}

static enum bf_status fail_with_diagnostic(const struct builder *b, struct fy_diag *diag)
{
    void *position = NULL;
    const struct fy_diag_error *error = fy_diag_errors_iterate(diag, &position);
    return bf_fail_at(b->err, b->path, error ? error->line : 0,
                      "not readable as YAML: %s; correct this line or the one above it",
                      error && error->msg ? error->msg : "syntax error");
}

static void free_unfinished(struct builder *b)
{
    for (size_t i = 0; i < b->depth; i++)
        yaml_free(b->pending_key[i]);
    yaml_free(b->root);
}

enum bf_status yaml_parse(const char *path, const char *text, size_t n, struct yaml_node **out, struct bf_error *err)
{
    *out = NULL;
    enum bf_status status = check_text(path, text, n, err);
    if (status != BF_OK)
        return status;
    struct builder b = {.path = path, .text = text, .n_text = n, .err = err};
    struct fy_diag_cfg diag_config;
    fy_diag_cfg_default(&diag_config);
    struct fy_diag *diag = fy_diag_create(&diag_config);
    if (!diag)
        return bf_fail(err, BF_NUMERIC, "%s: memory is out", path);
    fy_diag_set_collect_errors(diag, true);
    const struct fy_parse_cfg config = {
        .search_path = "", .flags = FYPCF_QUIET | FYPCF_DEFAULT_VERSION_1_2 | FYPCF_JSON_NONE, .diag = diag};
    b.parser = fy_parser_create(&config);
    if (!b.parser || fy_parser_set_string(b.parser, text, n) != 0)
        status = bf_fail(err, BF_NUMERIC, "%s: memory is out", path);
    else
        status = parse_events(&b);
    if (status == BF_OK && (fy_parser_get_stream_error(b.parser) || b.depth > 0))
        status = fail_with_diagnostic(&b, diag);
    if (status == BF_OK && (!b.root || yaml_is_nothing(b.root)))
        status = bf_fail_at(err, path, 0, "empty; `beamfit init` writes a model to start from");
    if (status == BF_OK)
        *out = b.root;
    else
        free_unfinished(&b);
    fy_parser_destroy(b.parser);
    fy_diag_destroy(diag);
    return status;
}
