/* SPDX-License-Identifier: GPL-3.0-or-later */
/* model_yaml_values.c — one value of the tree with its type checked. Every message names file, line and remedy. */
#include "model_check.h"
#include "model_yaml.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "ground/ground.h"

enum bf_status yaml_fail(const struct yaml_reader *r, const struct yaml_node *node, const char *format, ...)
{
    char text[700];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return bf_fail_at(r->err, r->path, node->line, "%s", text);
}

enum bf_status yaml_expect(const struct yaml_reader *r, const struct yaml_node *node, enum yaml_kind kind,
                           const char *what)
{
    static const char *const wanted[] = {"one word", "a list, e.g. [a, b]", "a mapping, e.g. {key: value}"};
    static const char *const found[] = {"a word", "a list", "a mapping"};
    if (node->kind == kind)
        return BF_OK;
    return yaml_fail(r, node, "%s is %s; write %s", what, yaml_is_nothing(node) ? "empty" : found[node->kind],
                     wanted[kind]);
}

enum bf_status yaml_known_keys(const struct yaml_reader *r, const struct yaml_node *mapping, const char *what,
                               const char *const known[], size_t n_known)
{
    for (size_t i = 0; i < mapping->n; i++) {
        const struct yaml_node *key = mapping->key[i];
        bool is_known = strncmp(key->text, "x_", 2) == 0 || strncmp(key->text, "x-", 2) == 0;
        for (size_t j = 0; j < n_known && !is_known; j++)
            is_known = strcmp(key->text, known[j]) == 0;
        if (is_known)
            continue;
        const char *closest = text_closest(key->text, known, n_known);
        char list[400] = "";
        for (size_t j = 0, n = 0; j < n_known && n < sizeof list - MODEL_NAME; j++)
            n += (size_t)snprintf(list + n, sizeof list - n, "%s%.60s", j ? ", " : "", known[j]);
        return yaml_fail(r, key, "unknown key '%.60s' in %s; known are %s (and your own, as x_NAME)%s%s%s", key->text,
                         what, list, closest ? "; did you mean '" : "", closest ? closest : "", closest ? "'?" : "");
    }
    return BF_OK;
}

enum bf_status yaml_number(const struct yaml_reader *r, const struct yaml_node *node, const char *what, double *out)
{
    if (node->kind == YAML_SCALAR && node->plain && decimal_parse(node->text, out))
        return BF_OK;
    if (node->kind != YAML_SCALAR)
        return yaml_fail(r, node, "%s is %s; write a number, e.g. 0.5", what,
                         node->kind == YAML_SEQUENCE ? "a list" : "a mapping");
    if (yaml_is_nothing(node))
        return yaml_fail(r, node, "%s has no value; write a number, e.g. 0.5", what);
    if (!node->plain && decimal_parse(node->text, out))
        return yaml_fail(r, node, "%s is a text because of the quotes; write the number without them", what);
    const char *comma = strchr(node->text, ',');
    return yaml_fail(r, node, "%s is '%.40s', not a number; write e.g. %s", what, node->text,
                     comma ? "0.5, with a point" : "0.5 or 1.2e-3");
}

enum bf_status yaml_bool(const struct yaml_reader *r, const struct yaml_node *node, const char *what, bool *out)
{
    if (node->kind == YAML_SCALAR && node->plain) {
        *out = strcmp(node->text, "true") == 0 || strcmp(node->text, "True") == 0 || strcmp(node->text, "TRUE") == 0;
        if (*out || strcmp(node->text, "false") == 0 || strcmp(node->text, "False") == 0 ||
            strcmp(node->text, "FALSE") == 0)
            return BF_OK;
    }
    return yaml_fail(r, node, "%s is neither true nor false; write one of them", what);
}

enum bf_status yaml_name(const struct yaml_reader *r, const struct yaml_node *node, const char *what, size_t size,
                         char *out)
{
    enum bf_status status = yaml_expect(r, node, YAML_SCALAR, what);
    if (status != BF_OK)
        return status;
    size_t n = strlen(node->text);
    if (n == 0)
        return yaml_fail(r, node, "%s is empty; give a name", what);
    if (n >= size)
        return yaml_fail(r, node, "%s '%.40s…' is longer than %zu bytes; shorten it", what, node->text, size - 1);
    for (const char *c = node->text; *c; c++)
        if ((unsigned char)*c < ' ' || *c == '"')
            return yaml_fail(r, node, "%s contains a quote or a control character; use letters, digits and _", what);
    memcpy(out, node->text, n + 1);
    return BF_OK;
}

static enum bf_status optional_number(const struct yaml_reader *r, const struct yaml_node *mapping, const char *key,
                                      const char *owner, double *out)
{
    const struct yaml_node *node = yaml_get(mapping, key, NULL);
    char what[160];
    if (!node)
        return BF_OK;
    (void)snprintf(what, sizeof what, "%.60s: %s", owner, key);
    return yaml_number(r, node, what, out);
}

static enum bf_status check_prior(const struct yaml_reader *r, const struct yaml_node *node, const struct parameter *p)
{
    const struct yaml_node *prior = yaml_get(node, "prior", NULL), *centre = yaml_get(node, "prior_value", NULL);
    const struct yaml_node *sd = yaml_get(node, "sd", NULL);
    if (prior && !(p->prior > 0.0 && isfinite(p->prior)))
        return yaml_fail(r, prior, "%s: prior is %g; it is a relative standard deviation above 0, e.g. 0.03 for 3 %%",
                         p->name, p->prior);
    if (centre && !prior)
        return yaml_fail(r, centre, "%s: prior_value without prior; add prior or delete prior_value", p->name);
    if (sd && !(p->sd >= 0.0 && isfinite(p->sd)))
        return yaml_fail(r, sd, "%s: sd is %g; a standard error is at least 0", p->name, p->sd);
    return BF_OK;
}

/* The keys of a parameter whose mapping may hold no others. */
static enum bf_status read_keys(const struct yaml_reader *r, const struct yaml_node *node, bool place,
                                struct parameter *out)
{
    const char *what = out->name;
    enum bf_status status = BF_OK;
    if (!yaml_get(node, "value", NULL))
        return yaml_fail(r, node, "%s has no value; write {value: NUMBER}", what);
    static const char *const keys[] = {"value", "prior", "start", "min", "max", "sd"};
    double *const targets[] = {&out->value, &out->prior, &out->start, &out->min, &out->max, &out->sd};
    for (size_t i = 0; i < sizeof keys / sizeof *keys && status == BF_OK; i++)
        status = optional_number(r, node, keys[i], what, targets[i]);
    out->prior_value = out->prior > 0.0 ? out->value : 0.0;
    if (status == BF_OK)
        status = optional_number(r, node, "prior_value", what, &out->prior_value);
    const struct yaml_node *fixed = yaml_get(node, "fixed", NULL);
    if (status == BF_OK && fixed)
        status = yaml_bool(r, fixed, "fixed", &out->fixed);
    const bool in_metres = place && (yaml_get(node, "prior_m", NULL) || !yaml_get(node, "prior", NULL));
    return status == BF_OK && !in_metres ? check_prior(r, node, out) : status;
}

enum bf_status yaml_parameter(const struct yaml_reader *r, const struct yaml_node *node, bool per_record,
                              struct parameter *out)
{
    /* an effect's parameter may differ from record to record, and nothing asks where it began */
    const char *const known[] = {"value", "prior", "prior_value", "fixed",
                                 "min",   "max",   "sd",          per_record ? "per_record" : "start"};
    if (node->kind == YAML_SCALAR)
        return yaml_number(r, node, out->name, &out->value);
    enum bf_status status = yaml_expect(r, node, YAML_MAPPING, out->name);
    if (status == BF_OK)
        status = yaml_known_keys(r, node, out->name, known, 8);
    return status == BF_OK ? read_keys(r, node, false, out) : status;
}

enum bf_status yaml_place(const struct yaml_reader *r, const struct yaml_node *node, struct parameter *out)
{
    if (node->kind != YAML_MAPPING)
        return yaml_number(r, node, out->name, &out->value);
    return read_keys(r, node, true, out);
}

enum bf_status yaml_interval(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                             double *from_m, double *to_m)
{
    if (node->kind != YAML_SEQUENCE || node->n != 2)
        return yaml_fail(r, node, "%s is no pair of places; write two in metres, e.g. [0.025, 0.089]", what);
    enum bf_status status = yaml_number(r, node->value[0], what, from_m);
    if (status == BF_OK)
        status = yaml_number(r, node->value[1], what, to_m);
    return status == BF_OK ? yaml_check_interval(r, node, what, *from_m, *to_m) : status;
}

enum bf_status yaml_check_interval(const struct yaml_reader *r, const struct yaml_node *node, const char *what,
                                   double from_m, double to_m)
{
    const double length = r->model->length_m;
    char advice[PLACE_ADVICE];
    if (!(to_m > from_m))
        return yaml_fail(r, node, "%s from %g to %g m is empty; give [smaller, larger]", what, from_m, to_m);
    if (from_m >= 0.0 && to_m <= length)
        return BF_OK;
    model_place_advice(to_m, length, advice);
    return yaml_fail(r, node, "%s from %g to %g m lies outside the beam (0 … %g m); %s", what, from_m, to_m, length,
                     advice);
}

enum bf_status yaml_sensor_mass(const struct yaml_reader *r, const struct yaml_node *node, double *mass_kg)
{
    const struct yaml_node *mass = yaml_get(node, "mass_kg", NULL);
    if (!mass)
        return BF_OK;
    if (mass->kind == YAML_MAPPING)
        return yaml_fail(r, mass,
                         "mass_kg of a sensor is a number, weighed; for one that a fit estimates write a point_mass "
                         "effect at the same at_m");
    const enum bf_status status = yaml_number(r, mass, "mass_kg", mass_kg);
    if (status == BF_OK && !(*mass_kg >= 0.0 && *mass_kg <= 5.0))
        return yaml_fail(r, mass, "a sensor of %g kg; write its mass in kg, 0 to 5 (54 g is 0.054)", *mass_kg);
    return status;
}
